//! Where are eyes, and where do they look? Draws both ends of sight lines.
//!
//! A sight line from inside a box to anything outside leaves the box through a point of its surface, from where the
//! rest of it is a sight line too. So eyes on the surface suffice for what lies outside, and where walls surround the
//! cell, eyes in its portals do: that is why most eyes are drawn there. Views begin and end at the borders of portals,
//! so borders and corners are drawn often.

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;

use super::{
    random::Random,
    solid::{Polygon, Solid},
};
use crate::{
    cells::{CellGraph, ViewCell},
    world::World,
};

/// Eyes keep this share of the cell's edge away from its surface, so that rounding puts none behind a wall.
const INSET: f32 = 1e-4;
/// The share of targets that lie near corners of triangles, where slivers show first.
const CORNERS: f32 = 0.4;
/// The share of targets that lie near edges of triangles.
const EDGES: f32 = 0.2;
/// The share of points in a portal that lie on its border.
const BORDER: f32 = 0.4;
/// The share of targets drawn by triangle instead of by area, so that small triangles count.
const BY_TRIANGLE: f32 = 0.3;

/// A cell and its openings, relative to the world's origin.
pub(super) struct Lookout {
    pub(super) min: Vec3,
    pub(super) max: Vec3,
    /// What is left of the box when the cell is not all of it.
    pub(super) solid: Option<Solid>,
    pub(super) portals: Vec<Polygon>,
}

impl Lookout {
    fn of(world: &World, cell: &ViewCell) -> Self {
        Self {
            min: world.relative(cell.bounds.min),
            max: world.relative(cell.bounds.max),
            solid: Solid::of(world, cell),
            portals: cell
                .portals
                .iter()
                .map(|p| Polygon::new(p.polygon.iter().map(|corner| world.relative(*corner)).collect()))
                .collect(),
        }
    }

    /// All cells of a graph.
    pub(super) fn all(world: &World, graph: &CellGraph) -> Vec<Self> {
        graph.cells.iter().map(|cell| Self::of(world, cell)).collect()
    }

    /// The box around it.
    pub(super) fn around(&self) -> Aabb {
        Aabb::new(Vec3A::from(self.min), Vec3A::from(self.max))
    }

    /// A place near by where an eye may be.
    pub(super) fn clamp(&self, eye: Vec3) -> Vec3 {
        let inset = INSET * (self.max - self.min);
        let eye = eye.clamp(self.min + inset, self.max - inset);
        self.solid.as_ref().map_or(eye, |solid| solid.drawn_in(eye, INSET))
    }

    /// An eye anywhere in the cell.
    pub(super) fn uniform(&self, random: &mut Random) -> Vec3 {
        const DRAWS: usize = 64;
        let mut draw = || self.min + random.cube() * (self.max - self.min);
        let first = draw();
        let eye = match &self.solid {
            Some(solid) if !solid.contains(first) => {
                (1..DRAWS).map(|_| draw()).find(|p| solid.contains(*p)).unwrap_or(first)
            }
            _ => first,
        };
        self.clamp(eye)
    }

    /// An eye on the surface: on a face, an edge or a corner.
    pub(super) fn surface(&self, random: &mut Random) -> Vec3 {
        if let Some(solid) = &self.solid {
            return self.clamp(solid.surface(random));
        }
        let mut share = random.cube();
        share[random.below(3)] = random.below(2) as f32;
        for axis in 0..3 {
            if random.unit() < 0.2 {
                share[axis] = share[axis].round();
            }
        }
        self.clamp(self.min + share * (self.max - self.min))
    }

    /// An eye in an opening, often on its border or in a corner; on the surface when there is none.
    pub(super) fn in_portal(&self, random: &mut Random) -> Vec3 {
        if self.portals.is_empty() {
            return self.surface(random);
        }
        let portal = &self.portals[random.below(self.portals.len())];
        let point = if random.unit() < BORDER {
            portal.border(random, BORDER)
        } else {
            portal.uniform(random)
        };
        // Not quite on the border, where rounding could put a point behind a jamb.
        self.clamp(portal.center.lerp(point, 1.0 - 2.0 * INSET))
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
        let to_box_m = (self.min - point).max(point - self.max).max(Vec3::ZERO).length();
        self.solid
            .as_ref()
            .map_or(to_box_m, |solid| to_box_m.max(solid.outside_m(point)))
    }
}

/// A point on an object: spread over its surface, or near a corner of one of its triangles. `None` when it has no
/// geometry.
pub(super) fn on_object(world: &World, object: u32, random: &mut Random) -> Option<Vec3> {
    let points = world.points_of(object);
    if !points.is_empty() {
        return Some(points[random.below(points.len())]);
    }
    let triangles = world.triangle_count_of(object);
    let triangle = if random.unit() < BY_TRIANGLE && triangles > 0 {
        world.triangle_of(object, random.below(triangles))
    } else {
        world.triangle_at_share(object, random.unit())?
    };
    let [mut u, mut v] = random.in_triangle();
    let [mut a, b, c] = triangle.corners;
    let (mut b, mut c) = (b, c);
    let border = random.unit();
    if border < CORNERS + EDGES {
        match random.below(3) {
            0 => {}
            1 => std::mem::swap(&mut a, &mut b),
            _ => std::mem::swap(&mut a, &mut c),
        }
        let near = 0.05 * random.unit();
        (u, v) = if border < CORNERS {
            (near * u, near * v)
        } else {
            (u, near * v * (1.0 - u))
        };
    }
    Some(a + u * (b - a) + v * (c - a))
}

/// A point on an object's surface, uniform by area over what faces the eye, as far as a few draws find that.
pub(super) fn facing(world: &World, object: u32, eye: Vec3, random: &mut Random) -> Option<Vec3> {
    const DRAWS: usize = 8;
    let points = world.points_of(object);
    if !points.is_empty() {
        return Some(points[random.below(points.len())]);
    }
    let mut triangle = world.triangle_at_share(object, random.unit())?;
    for _ in 1..DRAWS {
        let [a, b, c] = triangle.corners;
        if (b - a).cross(c - a).dot(eye - a) > 0.0 {
            break;
        }
        triangle = world.triangle_at_share(object, random.unit())?;
    }
    let [a, b, c] = triangle.corners;
    let [u, v] = random.in_triangle();
    Some(a + u * (b - a) + v * (c - a))
}
