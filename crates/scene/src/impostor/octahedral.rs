//! Which views of an impostor does an eye need? Directions lie on an octahedron that is unfolded into a square (Meyer et
//! al., *On floating-point normal vectors*, 2010), and views stand at the points of a grid on the square. So the nearest
//! are found by rounding, and three of them surround every direction.
//!
//! Directions lead from the model to the eye, in the model's space, +Y up. `viewer/core/documents/impostors.ts` does the same; both are
//! held against `tests/golden/impostors.json`.

use serde::{Deserialize, Serialize};

/// How views surround a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mapping {
    /// From all sides.
    Octahedral,
    /// From all sides but from below: what lies below the horizon is taken to lie on it.
    HemiOctahedral,
}

/// A view and how much it counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weighted {
    /// Column and row in the atlas.
    pub view: [u32; 2],
    /// 0 to 1; those of three add up to 1.
    pub weight: f64,
}

/// The axes of a view's picture in the model's space: to the right, up, and towards the eye; of length 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axes {
    /// To the right.
    pub right: [f64; 3],
    /// Up.
    pub up: [f64; 3],
    /// Towards the eye.
    pub towards: [f64; 3],
}

impl Mapping {
    /// The point of a direction in the square, each coordinate 0 to 1. Any length will do but 0.
    #[must_use]
    pub fn point(self, [x, y, z]: [f64; 3]) -> [f64; 2] {
        let y = if self == Self::HemiOctahedral { y.max(0.0) } else { y };
        let reach = x.abs() + y.abs() + z.abs();
        let reach = if reach > 0.0 { reach } else { 1.0 };
        let (x, z) = (x / reach, z / reach);
        let [a, b] = match self {
            Self::HemiOctahedral => [x + z, x - z],
            Self::Octahedral if y < 0.0 => [fold(x, z), fold(z, x)],
            Self::Octahedral => [x, z],
        };
        [(a + 1.0) / 2.0, (b + 1.0) / 2.0]
    }

    /// The direction of a point in the square, of length 1.
    #[must_use]
    pub fn direction(self, [u, v]: [f64; 2]) -> [f64; 3] {
        let [a, b] = [2.0 * u - 1.0, 2.0 * v - 1.0];
        let [x, z] = match self {
            Self::HemiOctahedral => [(a + b) / 2.0, (a - b) / 2.0],
            Self::Octahedral => [a, b],
        };
        let y = 1.0 - x.abs() - z.abs();
        let [x, z] = if y < 0.0 { [fold(x, z), fold(z, x)] } else { [x, z] };
        unit([x, y, z])
    }

    /// The direction from which a view was taken.
    #[must_use]
    pub fn of_view(self, [column, row]: [u32; 2], views: u32) -> [f64; 3] {
        let last = f64::from(views - 1);
        self.direction([f64::from(column) / last, f64::from(row) / last])
    }

    /// The three views around a direction; weights are those of the place in their triangle.
    #[must_use]
    pub fn nearest(self, direction: [f64; 3], views: u32) -> [Weighted; 3] {
        let last = f64::from(views - 1);
        let [u, v] = self.point(direction).map(|x| x * last);
        let [column, row] = [u, v].map(|x| x.floor().clamp(0.0, last - 1.0));
        let [x, y] = [u - column, v - row];
        // Cells are cut across the way down from the top, so that no triangle reaches from there to the horizon.
        let is_right = |number: f64| 2.0 * number + 1.0 > last;
        let is_mirrored = self == Self::Octahedral && is_right(column) != is_right(row);
        let (near, far, x) = if is_mirrored { (1, 0, 1.0 - x) } else { (0, 1, x) };
        let (column, row) = (column as u32, row as u32);
        let weighted = |dx: u32, dy: u32, weight: f64| Weighted {
            view: [column + dx, row + dy],
            weight,
        };
        if x + y <= 1.0 {
            [
                weighted(near, 0, 1.0 - x - y),
                weighted(far, 0, x),
                weighted(near, 1, y),
            ]
        } else {
            [
                weighted(far, 1, x + y - 1.0),
                weighted(far, 0, 1.0 - y),
                weighted(near, 1, 1.0 - x),
            ]
        }
    }
}

impl Axes {
    /// Those of the picture that an eye in this direction sees; right is level, and +X where the eye is right above or below.
    #[must_use]
    pub fn of(direction: [f64; 3]) -> Self {
        let towards = unit(direction);
        let [x, y, z] = towards;
        let level = (x * x + z * z).sqrt();
        let right = if level > 1e-6 {
            [z / level, 0.0, -x / level]
        } else {
            [1.0, 0.0, 0.0]
        };
        let up = [
            y * right[2] - z * right[1],
            z * right[0] - x * right[2],
            x * right[1] - y * right[0],
        ];
        Self { right, up, towards }
    }
}

/// Over the edge of the lower half.
fn fold(a: f64, b: f64) -> f64 {
    let far = 1.0 - b.abs();
    if a < 0.0 { -far } else { far }
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length > 0.0 {
        v.map(|x| x / length)
    } else {
        [0.0, 1.0, 0.0]
    }
}
