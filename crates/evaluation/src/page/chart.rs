//! How is a curve drawn? Lines over two axes, as an SVG that can be read on light and on dark pages.

use std::fmt::Write;

const WIDTH: f64 = 860.0;
const HEIGHT: f64 = 340.0;
const LEFT: f64 = 74.0;
const RIGHT: f64 = 74.0;
const TOP: f64 = 66.0;
const BOTTOM: f64 = 50.0;
/// Places at an axis.
const TICKS: u32 = 4;
/// The longest row of a legend, in letters.
const LEGEND_LETTERS: usize = 120;

/// The look of all pictures: strokes, texts and the page below them, in both kinds of light.
pub(super) const STYLE: &str = "<style>
text{font:12px sans-serif;fill:#333}.page{fill:#fff}.grid{stroke:#ddd;fill:none}.line{fill:none;stroke-width:2}
.c0{stroke:#1f6f8b}.c1{stroke:#b5651d}.c2{stroke:#6a4fa3}.c3{stroke:#3c7d3c}.f0{fill:#1f6f8b}.f1{fill:#b5651d}.f2{fill:#6a4fa3}.f3{fill:#3c7d3c}
.dashed{stroke-dasharray:6 4}
@media (prefers-color-scheme:dark){text{fill:#ddd}.page{fill:#15191e}.grid{stroke:#39414a}
.c0{stroke:#6fc3df}.c1{stroke:#f0a35e}.c2{stroke:#b9a3ee}.c3{stroke:#83cf83}.f0{fill:#6fc3df}.f1{fill:#f0a35e}.f2{fill:#b9a3ee}.f3{fill:#83cf83}}
</style>";

/// An axis.
#[derive(Debug, Clone)]
pub struct Axis {
    /// What it counts, with its unit.
    pub label: String,
    /// Whether equal steps are equal ratios.
    pub log: bool,
    /// Its end, if it is not the largest number.
    pub most: Option<f64>,
}

impl Axis {
    /// One with equal steps.
    #[must_use]
    pub fn linear(label: impl Into<String>) -> Self {
        Self {
            label: label.into(),
            log: false,
            most: None,
        }
    }

    /// One with equal ratios; numbers are positive.
    #[must_use]
    pub fn log(label: impl Into<String>) -> Self {
        Self {
            log: true,
            ..Self::linear(label)
        }
    }

    /// The same, up to a number.
    #[must_use]
    pub fn up_to(self, most: f64) -> Self {
        Self {
            most: Some(most),
            ..self
        }
    }
}

/// A line.
#[derive(Debug, Clone)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// Its colour, 0 to 3.
    pub colour: usize,
    /// Whether it is dashed.
    pub dashed: bool,
    /// Whether it belongs to the axis at the right.
    pub right: bool,
    /// Its points.
    pub points: Vec<[f64; 2]>,
}

impl Series {
    /// A line in a colour.
    #[must_use]
    pub fn new(name: impl Into<String>, colour: usize, points: Vec<[f64; 2]>) -> Self {
        Self {
            name: name.into(),
            colour,
            dashed: false,
            right: false,
            points,
        }
    }

    /// The same, dashed.
    #[must_use]
    pub fn dashed(self) -> Self {
        Self { dashed: true, ..self }
    }

    /// The same, at the axis at the right.
    #[must_use]
    pub fn right(self) -> Self {
        Self { right: true, ..self }
    }
}

/// Lines over two axes.
#[derive(Debug, Clone)]
pub struct Chart {
    /// What it shows.
    pub title: String,
    /// Along the page.
    pub x: Axis,
    /// Up the page.
    pub y: Axis,
    /// Up the page, at the right.
    pub right: Option<Axis>,
    /// The lines.
    pub series: Vec<Series>,
}

/// Where an axis begins and ends, and in which steps.
struct Scale {
    from: f64,
    to: f64,
    log: bool,
}

impl Scale {
    fn of(axis: &Axis, values: impl Iterator<Item = f64> + Clone) -> Self {
        let finite = values.filter(|value| value.is_finite());
        let most = axis.most.unwrap_or_else(|| finite.clone().fold(0.0, f64::max));
        if axis.log {
            let least = finite.filter(|value| *value > 0.0).fold(f64::INFINITY, f64::min);
            let from = least.min(most).max(f64::MIN_POSITIVE).log10().floor();
            let to = most.max(f64::MIN_POSITIVE).log10().ceil().max(from + 1.0);
            return Self { from, to, log: true };
        }
        let to = if axis.most.is_some() {
            most
        } else {
            f64::from(TICKS) * round_step(most / f64::from(TICKS))
        };
        Self {
            from: 0.0,
            to,
            log: false,
        }
    }

    /// From 0 to 1.
    fn share(&self, value: f64) -> f64 {
        let value = if self.log {
            value.max(f64::MIN_POSITIVE).log10()
        } else {
            value
        };
        ((value - self.from) / (self.to - self.from)).clamp(0.0, 1.0)
    }

    /// Shares and texts of the places that are marked.
    fn ticks(&self) -> Vec<(f64, String)> {
        if self.log {
            let powers = self.from as i32..=self.to as i32;
            return powers
                .map(|power| 10f64.powi(power))
                .map(|value| (self.share(value), short(value)))
                .collect();
        }
        let at = |i: u32| f64::from(i) / f64::from(TICKS);
        (0..=TICKS).map(|i| (at(i), short(self.to * at(i)))).collect()
    }
}

/// The next number that reads well: 1, 2, 2.5, 5 times a power of ten.
fn round_step(step: f64) -> f64 {
    if step <= 0.0 {
        return 0.25;
    }
    let power = 10f64.powf(step.log10().floor());
    let steps = [1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 7.5, 10.0].map(|digit| digit * power);
    steps
        .into_iter()
        .find(|round| *round >= step * (1.0 - 1e-9))
        .unwrap_or(10.0 * power)
}

/// Three digits, with thousands as k.
fn short(value: f64) -> String {
    let digits = |value: f64| {
        let decimals = if value >= 100.0 || value == 0.0 {
            0
        } else if value >= 10.0 {
            1
        } else {
            2
        };
        let text = format!("{value:.decimals$}");
        if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        } else {
            text
        }
    };
    match value {
        _ if value >= 1e6 => format!("{}M", digits(value / 1e6)),
        _ if value >= 1e4 => format!("{}k", digits(value / 1e3)),
        _ => digits(value),
    }
}

impl Chart {
    /// Draws it.
    #[must_use]
    pub fn to_svg(&self) -> String {
        let at = |i: usize, right: Option<bool>| {
            let lines = self
                .series
                .iter()
                .filter(move |s| right.is_none_or(|right| s.right == right));
            lines.flat_map(move |s| s.points.iter().map(move |p| p[i]))
        };
        let x = Scale::of(&self.x, at(0, None));
        let y = Scale::of(&self.y, at(1, Some(false)));
        let right = self
            .right
            .as_ref()
            .map(|axis| (axis, Scale::of(axis, at(1, Some(true)))));
        let across = |share: f64| LEFT + (WIDTH - LEFT - RIGHT) * share;
        let up = |share: f64| HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * share;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\">\n<title>{}</title>\n{STYLE}\n<rect class=\"page\" width=\"{WIDTH}\" height=\"{HEIGHT}\"/>\n",
            escaped(&self.title)
        );
        for (share, words) in x.ticks() {
            text(&mut svg, across(share), HEIGHT - BOTTOM + 18.0, "middle", &words);
        }
        for (share, words) in y.ticks() {
            text(&mut svg, LEFT - 8.0, up(share) + 4.0, "end", &words);
        }
        text(&mut svg, across(0.5), HEIGHT - 10.0, "middle", &self.x.label);
        text(&mut svg, 8.0, TOP - 12.0, "start", &self.y.label);
        if let Some((axis, scale)) = &right {
            for (share, words) in scale.ticks() {
                text(&mut svg, WIDTH - RIGHT + 8.0, up(share) + 4.0, "start", &words);
            }
            text(&mut svg, WIDTH - 8.0, TOP - 12.0, "end", &axis.label);
        }
        let (mut letters, mut row) = (0, 0.0);
        for line in &self.series {
            if letters > 0 && letters + line.name.chars().count() + 6 > LEGEND_LETTERS {
                (letters, row) = (0, row + 1.0);
            }
            let [x, y] = [16.0 + 6.6 * letters as f64, 18.0 + 16.0 * row];
            text(&mut svg, x + 30.0, y, "start", &line.name);
            _ = writeln!(
                svg,
                "<path class=\"line c{}{}\" d=\"M{x:.1} {:.1}h24\"/>",
                line.colour % 4,
                if line.dashed { " dashed" } else { "" },
                y - 4.0
            );
            letters += line.name.chars().count() + 7;
        }
        for (share, _) in y.ticks() {
            _ = writeln!(
                svg,
                "<path class=\"grid\" d=\"M{LEFT} {:.1}H{}\"/>",
                up(share),
                WIDTH - RIGHT
            );
        }
        for line in &self.series {
            let scale = right.as_ref().filter(|_| line.right).map_or(&y, |(_, scale)| scale);
            let mut path = String::new();
            for point in line.points.iter().filter(|p| p.iter().all(|v| v.is_finite())) {
                _ = write!(
                    path,
                    "{:.1},{:.1} ",
                    across(x.share(point[0])),
                    up(scale.share(point[1]))
                );
            }
            _ = writeln!(
                svg,
                "<polyline class=\"line c{}{}\" points=\"{}\"/>",
                line.colour % 4,
                if line.dashed { " dashed" } else { "" },
                path.trim_end()
            );
        }
        svg + "</svg>\n"
    }
}

fn text(svg: &mut String, x: f64, y: f64, anchor: &str, words: &str) {
    // A string takes whatever it is given.
    _ = writeln!(
        svg,
        "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{}</text>",
        escaped(words)
    );
}

/// A text as XML has it.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(y: Axis) -> Chart {
        Chart {
            title: "a < b".to_owned(),
            x: Axis::linear("frames"),
            y,
            right: None,
            series: vec![Series::new("load", 1, vec![[0.0, 1.0], [100.0, 1000.0]]).dashed()],
        }
    }

    #[test]
    fn a_line_spans_the_picture() {
        let svg = chart(Axis::linear("bytes")).to_svg();
        let ends = format!(
            "points=\"{LEFT:.1},{:.1} {:.1},{TOP:.1}\"",
            HEIGHT - BOTTOM - 0.224,
            WIDTH - RIGHT
        );
        assert!(svg.contains(&ends), "{svg}");
        assert!(svg.contains("a &lt; b") && svg.contains("line c1 dashed"));
        assert!(svg.contains("prefers-color-scheme:dark"));
    }

    #[test]
    fn ratios_are_equal_steps_on_a_logarithmic_axis() {
        let scale = Scale::of(&Axis::log(""), [1.0, 1000.0].into_iter());
        assert!((scale.share(10.0) - 1.0 / 3.0).abs() < 1e-12);
        let marks: Vec<_> = scale.ticks().into_iter().map(|(_, text)| text).collect();
        assert_eq!(marks, ["1", "10", "100", "1000"]);
    }

    #[test]
    fn nothing_to_draw_is_drawn_as_nothing() {
        let mut empty = chart(Axis::log(""));
        empty.series.clear();
        assert!(!empty.to_svg().contains("NaN"));
        assert_eq!([0.0, 0.25, 12.5, 1_500_000.0].map(short), ["0", "0.25", "12.5", "1.5M"]);
    }
}
