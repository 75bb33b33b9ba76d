//! What do the headers of a floor plan say? Room styles, and what each character of the drawing stands for.

use super::error::Problem;
use super::finish::Rgb;
use super::kinds::Kind;

/// The four ways a thing can face; north is up in the drawing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Facing {
    North,
    East,
    South,
    West,
}

impl Facing {
    pub(crate) const ALL: [Self; 4] = [Self::North, Self::East, Self::South, Self::West];

    /// One tile that way, in columns and rows.
    pub(crate) fn step(self) -> (isize, isize) {
        match self {
            Self::North => (0, -1),
            Self::East => (1, 0),
            Self::South => (0, 1),
            Self::West => (-1, 0),
        }
    }

    pub(crate) fn opposite(self) -> Self {
        Self::ALL[(self as usize + 2) % 4]
    }

    pub(crate) fn word(self) -> &'static str {
        ["north", "east", "south", "west"][self as usize]
    }

    /// Turn about +Y that makes +Z look this way, radians.
    pub(crate) fn turn_from_south(self) -> f64 {
        [2.0, 1.0, 0.0, -1.0][self as usize] * std::f64::consts::FRAC_PI_2
    }
}

/// What a thing is set on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Support {
    Floor,
    Plinth,
    Vitrine,
}

/// What a thing is made of, where its kind leaves a choice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stuff {
    Marble,
    Limestone,
    Granite,
    Bronze,
    Gold,
    Steel,
    Iron,
    Clay,
    Oak,
    Walnut,
}

/// One entry of the legend: a kind of furniture with its parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Entry {
    pub(crate) kind: Kind,
    pub(crate) height_m: Option<f32>,
    pub(crate) width_m: Option<f32>,
    pub(crate) colour: Option<Rgb>,
    pub(crate) stuff: Option<Stuff>,
    pub(crate) variant: u32,
    pub(crate) facing: Option<Facing>,
    pub(crate) support: Support,
}

impl Entry {
    pub(crate) fn plain(kind: Kind) -> Self {
        Self {
            kind,
            height_m: None,
            width_m: None,
            colour: None,
            stuff: None,
            variant: 0,
            facing: None,
            support: Support::Floor,
        }
    }
}

/// How a floor is laid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Floor {
    Plain(Rgb),
    Checker(Rgb, Rgb),
    Planks(Rgb),
    Border(Rgb, Rgb),
}

/// What is overhead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Ceiling {
    Plaster(Rgb),
    Beams(Rgb),
    Skylight(Rgb),
    Glass,
    Open,
}

/// How a room looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RoomStyle {
    pub(crate) walls: Rgb,
    pub(crate) dado: Option<Rgb>,
    pub(crate) floor: Floor,
    pub(crate) ceiling: Ceiling,
    pub(crate) height_m: Option<f32>,
}

impl Default for RoomStyle {
    fn default() -> Self {
        Self {
            walls: Rgb::hex(0xe6dfd0),
            dado: None,
            floor: Floor::Plain(Rgb::hex(0xb8a88c)),
            ceiling: Ceiling::Plaster(Rgb::hex(0xf4f1ea)),
            height_m: None,
        }
    }
}

/// Words of one line with their columns, read one after another.
pub(super) struct Words<'a> {
    words: Vec<(usize, &'a str)>,
    at: usize,
    /// Column just after the last word.
    end: usize,
}

/// A problem and the column where it is.
pub(super) type At<T> = Result<T, (usize, Problem)>;

impl<'a> Words<'a> {
    /// `first_column` is the column of the first character of `text`.
    pub(super) fn new(text: &'a str, first_column: usize) -> Self {
        let mut words = Vec::new();
        let mut start = None;
        for (column, (byte, c)) in text.char_indices().enumerate() {
            match (c.is_whitespace(), start) {
                (false, None) => start = Some((column, byte)),
                (true, Some((from, at))) => {
                    words.push((first_column + from, &text[at..byte]));
                    start = None;
                }
                _ => {}
            }
        }
        if let Some((from, at)) = start {
            words.push((first_column + from, &text[at..]));
        }
        Self {
            words,
            at: 0,
            end: first_column + text.trim_end().chars().count(),
        }
    }

    pub(super) fn peek(&self) -> Option<&'a str> {
        self.words.get(self.at).map(|w| w.1)
    }

    pub(super) fn column(&self) -> usize {
        self.words.get(self.at).map_or(self.end, |w| w.0)
    }

    pub(super) fn next(&mut self) -> Option<&'a str> {
        let word = self.peek();
        self.at += 1;
        word
    }

    pub(super) fn expected<T>(&self, what: impl Into<String>) -> At<T> {
        let found = self.peek().map_or_else(|| "the end of the line".to_owned(), clipped);
        Err((
            self.column(),
            Problem::Expected {
                found,
                expected: what.into(),
            },
        ))
    }

    fn parsed<T>(&mut self, what: &str, read: impl Fn(&str) -> Option<T>) -> At<T> {
        match self.peek().and_then(read) {
            Some(value) => {
                self.at += 1;
                Ok(value)
            }
            None => self.expected(what),
        }
    }

    /// A length such as `0.6`, `0.6m` or `0.6 m`.
    pub(super) fn metres(&mut self, what: &str, min: f32, max: f32) -> At<f32> {
        let column = self.column();
        let value = self.parsed("a length in metres, such as `0.6`", |word| {
            word.strip_suffix('m').unwrap_or(word).parse::<f32>().ok()
        })?;
        if self.peek() == Some("m") {
            self.at += 1;
        }
        if !(min..=max).contains(&value) {
            let (min, max) = (min.to_string(), max.to_string());
            return Err((
                column,
                Problem::OutOfRange {
                    what: what.to_owned(),
                    min,
                    max,
                },
            ));
        }
        Ok(value)
    }

    pub(super) fn facing(&mut self) -> At<Facing> {
        self.parsed("n, e, s or w", read_facing)
    }

    fn colour(&mut self) -> At<Rgb> {
        self.parsed("a colour such as `#2a5` or `#20a050`", read_colour)
    }
}

fn clipped(word: &str) -> String {
    let mut short: String = word.chars().take(24).collect();
    if short.len() < word.len() {
        short.push('…');
    }
    short
}

fn read_colour(word: &str) -> Option<Rgb> {
    let hex = word.strip_prefix('#')?;
    if !hex.bytes().all(|b| b.is_ascii_hexdigit()) {
        return None;
    }
    let value = u32::from_str_radix(hex, 16).ok()?;
    match hex.len() {
        3 => Some(Rgb([8, 4, 0].map(|shift| ((value >> shift) & 0xf) as u8 * 17))),
        6 => Some(Rgb::hex(value)),
        _ => None,
    }
}

const STUFFS: [(&str, Stuff); 10] = [
    ("marble", Stuff::Marble),
    ("limestone", Stuff::Limestone),
    ("granite", Stuff::Granite),
    ("bronze", Stuff::Bronze),
    ("gold", Stuff::Gold),
    ("steel", Stuff::Steel),
    ("iron", Stuff::Iron),
    ("clay", Stuff::Clay),
    ("oak", Stuff::Oak),
    ("walnut", Stuff::Walnut),
];

fn read_facing(word: &str) -> Option<Facing> {
    Facing::ALL
        .into_iter()
        .find(|f| f.word() == word || f.word().get(..1) == Some(word))
}

/// `vase height 0.6 colour #2a5 on plinth`.
pub(super) fn read_entry(words: &mut Words<'_>) -> At<Entry> {
    let Some(kind) = words.peek().and_then(Kind::named) else {
        return words.expected(format!("a kind of furniture: {}", Kind::names()));
    };
    words.next();
    let mut entry = Entry::plain(kind);
    while let Some(word) = words.peek() {
        if let Some((_, stuff)) = STUFFS.into_iter().find(|(name, _)| *name == word) {
            entry.stuff = Some(stuff);
            words.next();
            continue;
        }
        match word {
            "height" | "width" | "colour" | "color" | "variant" | "facing" | "on" | "in" => words.next(),
            _ => {
                return words.expected(
                    "height, width, colour, variant, facing, `on plinth`, `in vitrine` or a material such as bronze",
                );
            }
        };
        match word {
            "height" => entry.height_m = Some(words.metres("a height", 0.05, 20.0)?),
            "width" => entry.width_m = Some(words.metres("a width", 0.05, 20.0)?),
            "variant" => entry.variant = words.parsed("a whole number", |w| w.parse().ok())?,
            "facing" => entry.facing = Some(words.facing()?),
            "on" => entry.support = words.parsed("`plinth`", |w| (w == "plinth").then_some(Support::Plinth))?,
            "in" => entry.support = words.parsed("`vitrine`", |w| (w == "vitrine").then_some(Support::Vitrine))?,
            _ => entry.colour = Some(words.colour()?),
        }
    }
    Ok(entry)
}

/// One comma-separated part of a room's line, such as `floor checker #fff #222`.
pub(super) fn read_style(words: &mut Words<'_>, style: &mut RoomStyle) -> At<()> {
    let word = words.peek().unwrap_or_default();
    match word {
        "walls" | "dado" | "floor" | "ceiling" | "height" => words.next(),
        _ => return words.expected("walls, dado, floor, ceiling or height"),
    };
    match word {
        "walls" => style.walls = words.colour()?,
        "dado" => style.dado = Some(words.colour()?),
        "height" => style.height_m = Some(words.metres("a room's height", 2.2, 30.0)?),
        "floor" => {
            let pattern = words.peek().unwrap_or_default();
            style.floor = match pattern {
                "checker" | "planks" | "border" => {
                    words.next();
                    let first = words.colour()?;
                    match pattern {
                        "planks" => Floor::Planks(first),
                        "border" => Floor::Border(first, words.colour()?),
                        _ => Floor::Checker(first, words.colour()?),
                    }
                }
                _ if pattern.starts_with('#') => Floor::Plain(words.colour()?),
                _ => return words.expected("checker, planks, border or a colour"),
            };
        }
        _ => {
            style.ceiling = match words.peek().unwrap_or_default() {
                "glass" | "open" => {
                    if words.next() == Some("glass") {
                        Ceiling::Glass
                    } else {
                        Ceiling::Open
                    }
                }
                "beams" => {
                    words.next();
                    Ceiling::Beams(words.colour()?)
                }
                "skylight" => {
                    words.next();
                    Ceiling::Skylight(words.colour()?)
                }
                other if other.starts_with('#') => Ceiling::Plaster(words.colour()?),
                _ => return words.expected("glass, open, beams, skylight or a colour"),
            };
        }
    }
    match words.peek() {
        None => Ok(()),
        Some(_) => words.expected("a comma or the end of the line"),
    }
}
