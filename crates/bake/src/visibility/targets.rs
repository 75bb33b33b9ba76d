//! Where are eyes, and where do they look? Draws both ends of sight lines.
//!
//! A sight line from inside a box to anything outside leaves the box through a point of its surface, from where the
//! rest of it is a sight line too. So eyes on the surface suffice for what lies outside, and where walls surround the
//! cell, eyes in its portals do: that is why most eyes are drawn there.

use glam::Vec3;

use super::random::Random;
use crate::{
    cells::{CellGraph, ViewCell},
    world::World,
};

/// Eyes keep this share of the cell's edge away from its surface, so that rounding puts none behind a wall.
const INSET: f32 = 1e-4;
/// The share of targets that lie near corners of triangles, where slivers show first.
const CORNERS: f32 = 0.4;
/// The share of targets drawn by triangle instead of by area, so that small triangles count.
const BY_TRIANGLE: f32 = 0.3;

/// A cell and its openings, relative to the world's origin.
pub(super) struct Lookout {
    pub(super) min: Vec3,
    pub(super) max: Vec3,
    pub(super) portals: Vec<Opening>,
}

/// A parallelogram.
#[derive(Debug, Clone, Copy)]
pub(super) struct Opening {
    corner: Vec3,
    edges: [Vec3; 2],
}

impl Opening {
    fn of(world: &World, polygon: &[[f64; 3]; 4]) -> Self {
        let [a, b, _, d] = polygon.map(|p| world.relative(p));
        Self {
            corner: a,
            edges: [b - a, d - a],
        }
    }

    /// A point of it; often near its border, where views begin and end.
    pub(super) fn point(&self, random: &mut Random) -> Vec3 {
        let mut at = [random.unit(), random.unit()];
        if random.unit() < 0.3 {
            let side = random.below(4);
            let near = 0.02 * random.unit();
            at[side / 2] = if side % 2 == 0 { near } else { 1.0 - near };
        }
        self.corner + at[0] * self.edges[0] + at[1] * self.edges[1]
    }
}

impl Lookout {
    pub(super) fn of(world: &World, cell: &ViewCell) -> Self {
        Self {
            min: world.relative(cell.bounds.min),
            max: world.relative(cell.bounds.max),
            portals: cell.portals.iter().map(|p| Opening::of(world, &p.polygon)).collect(),
        }
    }

    /// All cells of a graph.
    pub(super) fn all(world: &World, graph: &CellGraph) -> Vec<Self> {
        graph.cells.iter().map(|cell| Self::of(world, cell)).collect()
    }

    /// The nearest place where an eye may be.
    pub(super) fn clamp(&self, eye: Vec3) -> Vec3 {
        let inset = INSET * (self.max - self.min);
        eye.clamp(self.min + inset, self.max - inset)
    }

    /// An eye anywhere in the cell.
    pub(super) fn uniform(&self, random: &mut Random) -> Vec3 {
        self.clamp(self.min + random.cube() * (self.max - self.min))
    }

    /// An eye on the surface: on a face, an edge or a corner.
    pub(super) fn surface(&self, random: &mut Random) -> Vec3 {
        let mut share = random.cube();
        share[random.below(3)] = random.below(2) as f32;
        for axis in 0..3 {
            if random.unit() < 0.2 {
                share[axis] = share[axis].round();
            }
        }
        self.clamp(self.min + share * (self.max - self.min))
    }

    /// An eye in an opening, or on the surface when there is none.
    pub(super) fn in_portal(&self, random: &mut Random) -> Vec3 {
        if self.portals.is_empty() {
            return self.surface(random);
        }
        let portal = self.portals[random.below(self.portals.len())];
        self.clamp(portal.point(random))
    }

    /// An eye from where something outside is most likely seen.
    pub(super) fn searching(&self, random: &mut Random) -> Vec3 {
        match random.unit() {
            u if u < 0.5 => self.in_portal(random),
            u if u < 0.75 => self.surface(random),
            _ => self.uniform(random),
        }
    }

    /// Distance to a point, zero inside.
    pub(super) fn distance_m(&self, point: Vec3) -> f32 {
        (self.min - point).max(point - self.max).max(Vec3::ZERO).length()
    }
}

/// A point on an object: spread over its surface, or near a corner of one of its triangles. `None` when it has no
/// geometry.
pub(super) fn on_object(world: &World, object: u32, random: &mut Random) -> Option<Vec3> {
    let points = world.points_of(object);
    if !points.is_empty() {
        return Some(points[random.below(points.len())]);
    }
    let triangles = world.triangles_of(object);
    let triangle = if random.unit() < BY_TRIANGLE && !triangles.is_empty() {
        &triangles[random.below(triangles.len())]
    } else {
        world.triangle_at_share(object, random.unit())?
    };
    let [mut u, mut v] = random.in_triangle();
    let [mut a, b, c] = triangle.corners;
    let (mut b, mut c) = (b, c);
    if random.unit() < CORNERS {
        match random.below(3) {
            0 => {}
            1 => std::mem::swap(&mut a, &mut b),
            _ => std::mem::swap(&mut a, &mut c),
        }
        let near = 0.05 * random.unit();
        (u, v) = (near * u, near * v);
    }
    Some(a + u * (b - a) + v * (c - a))
}

/// A point on an object's surface, uniform by area.
pub(super) fn by_area(world: &World, object: u32, random: &mut Random) -> Option<Vec3> {
    let points = world.points_of(object);
    if !points.is_empty() {
        return Some(points[random.below(points.len())]);
    }
    let [a, b, c] = world.triangle_at_share(object, random.unit())?.corners;
    let [u, v] = random.in_triangle();
    Some(a + u * (b - a) + v * (c - a))
}
