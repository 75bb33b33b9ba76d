//! What does a mesh look like after so many bytes? Flat-shaded triangles, painted from back to front, as an SVG.

use std::fmt::Write;

use serde::{Deserialize, Serialize};

use super::chart::STYLE;

/// Half of a picture, and its height, in pixels.
const HALF: f64 = 200.0;
const HEIGHT: f64 = 240.0;
const BAR: f64 = 8.0;

/// A model after some bytes.
#[derive(Debug, Serialize, Deserialize)]
pub struct Stage {
    /// So many.
    pub bytes: u64,
    /// Triangles of the smooth LOD.
    pub smooth: Vec<Triangle>,
    /// Triangles of the conventional level that is complete.
    pub levels: Vec<Triangle>,
}

/// Corners in model space, in whole units, such as millimetres.
pub type Triangle = [[i32; 3]; 3];

/// Draws stages side by side: smooth at the left of each, conventional at the right, and how much of `whole` is there as bars.
#[must_use]
pub fn stages(stages: &[Stage], whole: usize) -> String {
    let width = 2.0 * HALF * stages.len() as f64;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {}\">\n<title>Stages of a model</title>\n{STYLE}\n<rect class=\"page\" width=\"{width}\" height=\"{}\"/>\n",
        HEIGHT + 24.0,
        HEIGHT + 24.0
    );
    let view = View::of(stages.iter().flat_map(|stage| stage.smooth.iter().chain(&stage.levels)));
    for (i, stage) in stages.iter().enumerate() {
        let left = 2.0 * HALF * i as f64;
        for (side, triangles) in [(0.0, &stage.smooth), (1.0, &stage.levels)] {
            view.paint(&mut svg, triangles, left + HALF * side);
            let tall = HEIGHT * (triangles.len() as f64 / whole.max(1) as f64).min(1.0);
            let at = left + side * (2.0 * HALF - BAR);
            // A string takes whatever it is given.
            _ = writeln!(
                svg,
                "<path class=\"f{}\" d=\"M{at:.0} {:.1}h{BAR}V{HEIGHT}h-{BAR}z\"/>",
                side as u8,
                HEIGHT - tall
            );
        }
        let words = format!(
            "{:.1} kB: {} and {} triangles",
            stage.bytes as f64 / 1e3,
            stage.smooth.len(),
            stage.levels.len()
        );
        _ = writeln!(
            svg,
            "<text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"middle\">{words}</text>\n<path class=\"grid\" d=\"M{:.0} 0V{HEIGHT}\"/>",
            left + HALF,
            HEIGHT + 17.0,
            left + HALF
        );
    }
    svg + "</svg>\n"
}

/// From where models are looked at: a little from above and from the side.
struct View {
    middle: [f64; 3],
    scale: f64,
}

impl View {
    fn of<'a>(triangles: impl Iterator<Item = &'a Triangle>) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in triangles.flatten().map(|&p| turned(p.map(f64::from))) {
            for i in 0..3 {
                (low[i], high[i]) = (low[i].min(p[i]), high[i].max(p[i]));
            }
        }
        let fits = |axis: usize, room: f64| room / (high[axis] - low[axis]).max(1e-9);
        Self {
            middle: [0, 1, 2].map(|i| 0.5 * (low[i] + high[i])),
            scale: fits(0, HALF - 2.0 * BAR - 12.0).min(fits(1, HEIGHT - 12.0)),
        }
    }

    fn paint(&self, svg: &mut String, triangles: &[Triangle], left: f64) {
        let mut faces: Vec<(f64, String)> = Vec::with_capacity(triangles.len());
        for triangle in triangles {
            let [a, b, c] = triangle.map(|p| turned(p.map(f64::from)));
            let normal = cross(minus(b, a), minus(c, a));
            let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
            if normal[2] <= 1e-9 * length || length == 0.0 {
                continue;
            }
            let light = (0.3 * normal[0] + 0.6 * normal[1] + 0.75 * normal[2]) / length;
            let grey = (70.0 + 150.0 * light.clamp(0.0, 1.0)) as u8;
            let at = |p: [f64; 3]| {
                let x = left + 0.5 * HALF + self.scale * (p[0] - self.middle[0]);
                let y = 0.5 * HEIGHT - self.scale * (p[1] - self.middle[1]);
                format!("{x:.1} {y:.1}")
            };
            let path = format!(
                "<path fill=\"#{grey:02x}{grey:02x}{grey:02x}\" d=\"M{}L{}L{}z\"/>",
                at(a),
                at(b),
                at(c)
            );
            faces.push((a[2] + b[2] + c[2], path));
        }
        faces.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, path) in faces {
            svg.push_str(&path);
            svg.push('\n');
        }
    }
}

/// Turned by 30° about the upright, then tilted by 20°; +z is towards the eye.
fn turned([x, y, z]: [f64; 3]) -> [f64; 3] {
    let ((sin, cos), (rise, run)) = (30f64.to_radians().sin_cos(), 20f64.to_radians().sin_cos());
    let [x, z] = [cos * x - sin * z, sin * x + cos * z];
    [x, run * y - rise * z, rise * y + run * z]
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i| a[i] - b[i])
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_faces_the_eye_is_painted() {
        let front = [[0, 0, 0], [1000, 0, 0], [0, 1000, 0]];
        let back = [front[0], front[2], front[1]];
        let stage = Stage {
            bytes: 1200,
            smooth: vec![front, back],
            levels: vec![],
        };
        let svg = stages(&[stage], 4);
        assert_eq!(svg.matches("fill=\"#").count(), 1);
        assert!(svg.contains("1.2 kB: 2 and 0 triangles"));
        assert!(svg.contains(&format!("M0 {:.1}h{BAR}", HEIGHT / 2.0)), "{svg}");
        assert!(!stages(&[], 0).contains("NaN"));
    }
}
