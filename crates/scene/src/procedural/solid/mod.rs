//! What can be seen of a model? Its terminals: solids and surfaces, each a function from a few numbers to triangles.
//!
//! A solid stands on the origin: its base lies in the plane y = 0, its middle is at x = z = 0. A sphere has its middle at
//! the origin. Lengths are metres; triangles are counter-clockwise from outside.

mod flat;
mod mesh;
mod polygon;
mod round;

pub use mesh::Mesh;
pub(super) use mesh::{Tools, Writer};
pub(super) use polygon::outline;

use super::limits::FINEST;
use super::problem::Problem;
use crate::Bounds;
use crate::impostor::Wish;

/// The terminals that are written like a call.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SolidKind {
    Box,
    Cone,
    Cylinder,
    Lathe,
    Mesh,
    Polygon,
    Prism,
    Sphere,
}

/// A name, and what it is when it is not given.
pub(super) type Formals = &'static [(&'static str, Option<f64>)];

/// What an author can say of the pictures that stand for a part from far away.
pub(super) const IMPOSTOR: Formals = &[
    ("views", Some(Wish::DEFAULT.views as f64)),
    ("size", Some(Wish::DEFAULT.size_px as f64)),
    ("below", Some(0.0)),
    ("frames", Some(1.0)),
    ("stride", Some(1.4)),
];

impl SolidKind {
    const ALL: [(&'static str, Self, Formals); 8] = [
        ("box", Self::Box, &[("width", None), ("height", None), ("depth", None)]),
        (
            "cone",
            Self::Cone,
            &[
                ("radius", None),
                ("height", None),
                ("top", Some(0.0)),
                ("sides", Some(0.0)),
                ("closed", Some(1.0)),
            ],
        ),
        (
            "cylinder",
            Self::Cylinder,
            &[
                ("radius", None),
                ("height", None),
                ("sides", Some(0.0)),
                ("closed", Some(1.0)),
            ],
        ),
        (
            "lathe",
            Self::Lathe,
            &[("profile", None), ("sides", Some(0.0)), ("smooth", Some(0.0))],
        ),
        ("mesh", Self::Mesh, &[("points", None), ("faces", None)]),
        ("polygon", Self::Polygon, &[("points", None)]),
        ("prism", Self::Prism, &[("footprint", None), ("height", None)]),
        ("sphere", Self::Sphere, &[("radius", None), ("sides", Some(0.0))]),
    ];

    pub(super) fn named(name: &str) -> Option<Self> {
        Self::ALL
            .iter()
            .find(|(known, ..)| *known == name)
            .map(|(_, kind, _)| *kind)
    }

    pub(super) fn names() -> [&'static str; 8] {
        Self::ALL.map(|(name, ..)| name)
    }

    pub(super) fn name(self) -> &'static str {
        Self::ALL[self as usize].0
    }

    pub(super) fn formals(self) -> Formals {
        Self::ALL[self as usize].2
    }
}

/// A terminal with its numbers: checked, finite.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Solid {
    Box([f64; 3]),
    /// A cylinder when both radii are the same.
    Cone {
        radii: [f64; 2],
        height: f64,
        sides: u32,
        closed: bool,
    },
    Sphere {
        radius: f64,
        sides: u32,
    },
    /// Radius and height of each corner, from bottom to top for faces that look outwards.
    Lathe {
        profile: Vec<[f64; 2]>,
        sides: u32,
        smooth: bool,
    },
    /// Corners x, z.
    Prism {
        footprint: Vec<[f64; 2]>,
        height: f64,
    },
    Mesh {
        points: Vec<[f64; 3]>,
        faces: Faces,
    },
    Heights(Heights),
}

/// Polygons by the numbers of their corners, one after the other.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Faces {
    corners: Vec<u32>,
    /// Where each ends in `corners`.
    ends: Vec<u32>,
    /// Whether the points must lie in a plane: there is one face, around all of them.
    is_flat: bool,
}

impl Faces {
    /// One that must be flat, around `corners` points in their order.
    pub(super) fn one(corners: u32) -> Self {
        Self {
            corners: (0..corners).collect(),
            ends: vec![corners],
            is_flat: true,
        }
    }

    /// Adds a corner to the face that is not ended; `None` when it is none of so many points.
    pub(super) fn corner(&mut self, corner: f64, points: usize) -> Option<()> {
        let is_one = corner >= 0.0 && corner < points as f64;
        is_one.then(|| self.corners.push(corner as u32))
    }

    pub(super) fn end(&mut self) {
        self.ends.push(self.corners.len() as u32);
    }

    /// All of them, when each is a triangle.
    pub(super) fn triangles(&self) -> Option<Vec<[u32; 3]>> {
        self.iter().map(|face| face.try_into().ok()).collect()
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &[u32]> {
        let mut first = 0;
        self.ends.iter().map(move |&end| {
            let face = &self.corners[first..end as usize];
            first = end as usize;
            face
        })
    }
}

/// A surface over a rectangle around the origin.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Heights {
    /// Width and depth.
    pub(super) over: [f64; 2],
    /// Cells along x and z.
    pub(super) steps: [u32; 2],
    /// Rows along x, rising z, with one more sample around the rectangle: (steps₀ + 3) · (steps₁ + 3) heights.
    pub(super) heights: Vec<f64>,
}

impl Heights {
    /// Rows on the rectangle, without the samples around it.
    fn inside(&self) -> impl Iterator<Item = &[f64]> {
        let [columns, rows] = self.steps.map(|steps| steps as usize);
        let all = self.heights.chunks(columns + 3).skip(1).take(rows + 1);
        all.map(move |row| &row[1..columns + 2])
    }
}

/// Sides of a round solid whose author does not say how many, by level of detail.
pub(super) const SIDES: [u32; FINEST as usize + 1] = [4, 6, 8, 12, 16];

impl Solid {
    /// Adds its triangles.
    pub(super) fn write(&self, writer: &mut Writer, tools: &mut Tools) -> Result<(), Problem> {
        match self {
            Self::Box(size) => flat::write_box(writer, *size),
            Self::Cone {
                radii,
                height,
                sides,
                closed,
            } => round::write_cone(writer, &tools.circles.of(*sides), (*radii, *height), *closed),
            Self::Sphere { radius, sides } => round::write_sphere(writer, &tools.circles.of(*sides), *radius),
            Self::Lathe { profile, sides, smooth } => {
                round::write_lathe(writer, &tools.circles.of(*sides), profile, *smooth)
            }
            Self::Prism { footprint, height } => return flat::write_prism(writer, &mut tools.ears, footprint, *height),
            Self::Mesh { points, faces } => return flat::write_mesh(writer, tools, points, faces),
            Self::Heights(heights) => flat::write_heights(writer, heights),
        }
        Ok(())
    }

    /// At least as many triangles as [`Solid::write`] adds.
    pub(super) fn most_triangles(&self) -> u64 {
        match self {
            Self::Cone { radii: [0.0, 0.0], .. } | Self::Sphere { radius: 0.0, .. } => 0,
            Self::Lathe { profile, .. } if profile.iter().all(|[radius, _]| *radius == 0.0) => 0,
            Self::Box(_) => 12,
            Self::Cone { sides, .. } => 4 * u64::from(*sides),
            Self::Sphere { sides, .. } => u64::from(*sides) * u64::from(*sides),
            Self::Lathe { profile, sides, .. } => 2 * profile.len() as u64 * u64::from(*sides),
            Self::Prism { footprint, .. } => 4 * footprint.len() as u64,
            Self::Mesh { faces, .. } => faces.corners.len() as u64,
            Self::Heights(heights) => 2 * u64::from(heights.steps[0]) * u64::from(heights.steps[1]),
        }
    }

    /// A box that holds it.
    pub(super) fn extent(&self) -> Bounds {
        let round = |radius: f64, low: f64, high: f64| {
            let r = radius.abs();
            Bounds::around([[-r, low, -r], [r, high, r]])
        };
        match self {
            Self::Box([w, h, d]) => Bounds::around([[-w / 2.0, 0.0, -d / 2.0], [w / 2.0, *h, d / 2.0]]),
            Self::Cone { radii, height, .. } => round(radii[0].max(radii[1]), 0.0, *height),
            Self::Sphere { radius, .. } => round(*radius, -radius, *radius),
            Self::Lathe { profile, .. } => profile
                .iter()
                .map(|[r, y]| round(*r, *y, *y))
                .fold(Bounds::EMPTY, |all, ring| all.union(&ring)),
            Self::Prism { footprint, height } => {
                Bounds::around(footprint.iter().flat_map(|[x, z]| [[*x, 0.0, *z], [*x, *height, *z]]))
            }
            Self::Mesh { points, .. } => {
                let mut bounds = Bounds::EMPTY;
                for point in points {
                    for (axis, &along) in point.iter().enumerate() {
                        let (min, max) = (&mut bounds.min[axis], &mut bounds.max[axis]);
                        *min = if along < *min { along } else { *min };
                        *max = if along > *max { along } else { *max };
                    }
                }
                bounds
            }
            Self::Heights(heights) => {
                let [w, d] = heights.over;
                let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
                for &y in heights.inside().flatten() {
                    low = if y < low { y } else { low };
                    high = if y > high { y } else { high };
                }
                Bounds::around([[-w / 2.0, low, -d / 2.0], [w / 2.0, high, d / 2.0]])
            }
        }
    }
}
