//! What does a model look like from a direction? A z-buffer without perspective; each pixel is the mean over a grid of
//! samples.
//!
//! Spaces: *ball space* is the model's, moved and scaled so that the ball around the model has radius 1 at the origin; a
//! view has the axes of [`Axes`] in it. Faces that are not double-sided are drawn from their front only. Points and lines
//! are not drawn.

use std::borrow::Cow;
use std::convert::Infallible;

use belvedere_scene::impostor::octahedral::Axes;
use glam::{DVec3, Vec3};

use super::surface::{Surface, Surfaces};
use crate::source::{Primitive, Topology};

/// Samples along a side of a view, at least; and along a side of a pixel.
const LEAST_SAMPLES: u32 = 256;
const LEAST_SAMPLES_OF_PIXEL: u32 = 4;
/// Normals that lean back further than this are turned towards the eye: a view cannot show others.
const LEAST_TOWARDS: f32 = 0.05;

/// What a pixel of a view shows. All but coverage are means over what is covered.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Pixel {
    /// Linear light.
    pub colour: Vec3,
    /// Share of the pixel that is covered, 0 to 1.
    pub coverage: f32,
    /// In the view's axes, of length 1; z is towards the eye.
    pub normal: Vec3,
    /// How far it lies before the middle of the ball, in its radii.
    pub depth: f32,
    /// Share of it whose colour each who wears the model chooses, 0 to 1.
    pub recolour: f32,
}

/// A model in its ball.
pub struct Body<'a> {
    /// The ball's middle in the model's space.
    pub centre: DVec3,
    /// Its radius there.
    pub radius: f64,
    parts: Vec<Part<'a>>,
}

struct Part<'a> {
    primitive: &'a Primitive,
    surface: Surface<'a>,
    /// In ball space.
    positions: Vec<Vec3>,
}

/// What the z-buffer holds at a sample: the triangle `triangle` of `part` is nearest.
#[derive(Clone, Copy)]
struct Nearest {
    depth: f32,
    part: u32,
    triangle: u32,
}

impl<'a> Body<'a> {
    /// Puts a model's triangles into their ball; `None` when they have no extent.
    #[must_use]
    pub fn new(primitives: &'a [Primitive], surfaces: &'a Surfaces<'_>) -> Option<Self> {
        let Ok(ball) = ball(1, |_| Ok::<_, Infallible>(primitives.into()));
        Some(Self::within(primitives, surfaces, ball?))
    }

    /// The same in a given ball (middle, radius), which other bodies share.
    #[must_use]
    pub fn within(primitives: &'a [Primitive], surfaces: &'a Surfaces<'_>, (centre, radius): (DVec3, f64)) -> Self {
        let place = |p: &[f32; 3]| ((Vec3::from_array(*p).as_dvec3() - centre) / radius).as_vec3();
        let parts = drawn(primitives).map(|primitive| Part {
            primitive,
            surface: surfaces.of(primitive),
            positions: primitive.positions.iter().map(place).collect(),
        });
        let parts = parts.collect();
        Self { centre, radius, parts }
    }

    /// Draws it as an eye in this direction sees it: `size_px` rows of as many pixels, from above.
    #[must_use]
    pub fn picture(&self, direction: [f64; 3], size_px: u32) -> Vec<Pixel> {
        let view = View::of(direction);
        let per_pixel = (LEAST_SAMPLES / size_px).max(LEAST_SAMPLES_OF_PIXEL);
        let side = (size_px * per_pixel) as usize;
        let mut nearest: Vec<Option<Nearest>> = vec![None; side * side];
        for (number, part) in self.parts.iter().enumerate() {
            let placed: Vec<Vec3> = part.positions.iter().map(|p| view.from_ball(*p)).collect();
            part.enter(number as u32, &placed, side, &mut nearest);
        }
        let (size_px, per_pixel) = (size_px as usize, per_pixel as usize);
        let pixel = |index: usize| {
            let (x, y) = (index % size_px * per_pixel, index / size_px * per_pixel);
            let samples = (0..per_pixel * per_pixel).filter_map(|sample| {
                let (x, y) = (x + sample % per_pixel, y + sample / per_pixel);
                let found = nearest[y * side + x]?;
                self.parts[found.part as usize].shade(&view, found, sample_place(x, y, side))
            });
            mean(samples, per_pixel * per_pixel)
        };
        (0..size_px * size_px).map(pixel).collect()
    }
}

/// The ball around so many poses (middle, radius); `None` when they have no extent. Each is asked for twice, one after the other.
///
/// # Errors
/// The first that a pose has.
pub fn ball<'p, E>(
    count: u32,
    pose: impl Fn(u32) -> Result<Cow<'p, [Primitive]>, E>,
) -> Result<Option<(DVec3, f64)>, E> {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for number in 0..count {
        (low, high) = corners(&pose(number)?).fold((low, high), |(low, high), p| (low.min(p), high.max(p)));
    }
    let centre = (low + high) / 2.0;
    let mut radius: f64 = 0.0;
    for number in 0..count {
        radius = corners(&pose(number)?)
            .map(|p| p.distance(centre))
            .fold(radius, f64::max);
    }
    Ok((radius > 0.0 && radius.is_finite()).then_some((centre, radius)))
}

/// The corners of its triangles.
fn corners(pose: &[Primitive]) -> impl Iterator<Item = DVec3> {
    let corner = |p: &[f32; 3]| Vec3::from_array(*p).as_dvec3();
    drawn(pose).flat_map(move |p| p.indices.iter().map(move |i| corner(&p.positions[*i as usize])))
}

fn drawn(primitives: &[Primitive]) -> impl Iterator<Item = &Primitive> {
    primitives.iter().filter(|p| p.topology == Topology::Triangles)
}

impl Part<'_> {
    fn corners(&self, triangle: u32) -> [usize; 3] {
        let first = 3 * triangle as usize;
        [0, 1, 2].map(|i| self.primitive.indices[first + i] as usize)
    }

    /// Enters what is nearer than what is there.
    fn enter(&self, number: u32, placed: &[Vec3], side: usize, nearest: &mut [Option<Nearest>]) {
        for triangle in 0..self.primitive.count() as u32 {
            let corners = self.corners(triangle);
            let places = corners.map(|i| placed[i]);
            let Some(area) = drawn_area(places, self.surface.double_sided) else {
                continue;
            };
            let [columns, rows] = samples_around(places, side);
            for y in rows {
                for x in columns.clone() {
                    let Some(weights) = weights(places, area, sample_place(x, y, side)) else {
                        continue;
                    };
                    let depth = (0..3).map(|i| weights[i] * places[i].z).sum();
                    let slot = &mut nearest[y * side + x];
                    let is_nearer = slot.is_none_or(|there| depth > there.depth);
                    let is_there =
                        || self.surface.is_whole() || self.surface.colour(self.primitive, corners, weights).is_some();
                    if is_nearer && is_there() {
                        *slot = Some(Nearest {
                            depth,
                            part: number,
                            triangle,
                        });
                    }
                }
            }
        }
    }

    /// What a sample shows.
    fn shade(&self, view: &View, found: Nearest, place: [f32; 2]) -> Option<Pixel> {
        let corners = self.corners(found.triangle);
        let places = corners.map(|i| view.from_ball(self.positions[i]));
        let area = drawn_area(places, self.surface.double_sided)?;
        let weights = weights(places, area, place)?;
        let normals = &self.primitive.normals;
        let normal = if normals.is_empty() {
            (places[1] - places[0]).cross(places[2] - places[0])
        } else {
            let sum: Vec3 = (0..3).map(|i| weights[i] * Vec3::from(normals[corners[i]])).sum();
            view.from_ball(sum)
        };
        // Seen from behind, a double-sided face shows the reverse of its normal.
        let normal = normal.normalize_or(Vec3::Z) * area.signum();
        let normal = Vec3::new(normal.x, normal.y, normal.z.max(LEAST_TOWARDS));
        Some(Pixel {
            colour: self.surface.colour(self.primitive, corners, weights)?.into(),
            coverage: 1.0,
            normal: normal.normalize(),
            depth: found.depth,
            recolour: f32::from(u8::from(self.surface.recolour)),
        })
    }
}

/// The axes of a view in single precision.
struct View {
    axes: [Vec3; 3],
}

impl View {
    fn of(direction: [f64; 3]) -> Self {
        let Axes { right, up, towards } = Axes::of(direction);
        Self {
            axes: [right, up, towards].map(|axis| DVec3::from(axis).as_vec3()),
        }
    }

    /// From ball space into that of the view: x to the right, y up, z towards the eye.
    #[allow(clippy::wrong_self_convention, reason = "named after the space that it leads from")]
    fn from_ball(&self, v: Vec3) -> Vec3 {
        Vec3::from_array(self.axes.map(|axis| axis.dot(v)))
    }
}

/// The middle of a sample in the view: −1 to 1, y up.
fn sample_place(x: usize, y: usize, side: usize) -> [f32; 2] {
    let step = 2.0 / side as f32;
    [(x as f32 + 0.5) * step - 1.0, 1.0 - (y as f32 + 0.5) * step]
}

/// Twice the area of a triangle as it is seen, negative from behind; `None` when it is not drawn.
fn drawn_area([a, b, c]: [Vec3; 3], double_sided: bool) -> Option<f32> {
    let area = (b - a).truncate().perp_dot((c - a).truncate());
    (area > 0.0 || (double_sided && area < 0.0)).then_some(area)
}

/// Columns and rows of the samples that may lie in a triangle.
fn samples_around(places: [Vec3; 3], side: usize) -> [std::ops::Range<usize>; 2] {
    let range = |axis: usize, sign: f32| {
        let along = places.map(|p| (sign * p[axis] + 1.0) / 2.0 * side as f32);
        let low = along.into_iter().fold(f32::INFINITY, f32::min);
        let high = along.into_iter().fold(f32::NEG_INFINITY, f32::max);
        // Casts from floats stop at the ends of the range.
        (low - 0.5).floor() as usize..((high + 0.5).ceil() as usize).min(side)
    };
    [range(0, 1.0), range(1, -1.0)]
}

/// The weights of the corners at a place; `None` outside.
fn weights([a, b, c]: [Vec3; 3], area: f32, [x, y]: [f32; 2]) -> Option<[f32; 3]> {
    let side = |p: Vec3, q: Vec3| ((q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x)) / area;
    let weights = [side(b, c), side(c, a), side(a, b)];
    weights.iter().all(|weight| *weight >= 0.0).then_some(weights)
}

fn mean(samples: impl Iterator<Item = Pixel>, of: usize) -> Pixel {
    let sum = samples.fold(Pixel::default(), |sum, one| Pixel {
        colour: sum.colour + one.colour,
        coverage: sum.coverage + 1.0,
        normal: sum.normal + one.normal,
        depth: sum.depth + one.depth,
        recolour: sum.recolour + one.recolour,
    });
    if sum.coverage == 0.0 {
        return sum;
    }
    Pixel {
        colour: sum.colour / sum.coverage,
        coverage: sum.coverage / of as f32,
        normal: sum.normal.normalize_or(Vec3::Z),
        depth: sum.depth / sum.coverage,
        recolour: sum.recolour / sum.coverage,
    }
}
