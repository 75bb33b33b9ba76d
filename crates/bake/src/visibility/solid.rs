//! Where are points of convex polygons and of cells that are no boxes? Relative to the world's origin, f32.

use glam::{Vec3, Vec4};

use super::random::Random;
use crate::{cells::ViewCell, world::World};

/// The share of points on a cell's surface that lie on its edges and corners.
const EDGES: f32 = 0.4;

/// A plane convex polygon.
#[derive(Debug, Clone)]
pub(super) struct Polygon {
    corners: Vec<Vec3>,
    /// The middle of its corners.
    pub(super) center: Vec3,
    /// Sums of the areas of the triangles between the first corner and each edge, in m².
    area_sums_m2: Vec<f32>,
}

impl Polygon {
    pub(super) fn new(corners: Vec<Vec3>) -> Self {
        let center = corners.iter().sum::<Vec3>() / corners.len().max(1) as f32;
        let mut sum = 0.0;
        let fan = corners.windows(2).skip(1);
        let area_sums_m2 = fan.map(|pair| {
            sum += 0.5 * (pair[0] - corners[0]).cross(pair[1] - corners[0]).length();
            sum
        });
        Self {
            area_sums_m2: area_sums_m2.collect(),
            center,
            corners,
        }
    }

    /// A point anywhere in it.
    pub(super) fn uniform(&self, random: &mut Random) -> Vec3 {
        let whole_m2 = self.area_sums_m2.last().copied().unwrap_or(0.0);
        let wanted = random.unit() * whole_m2;
        let triangle = self
            .area_sums_m2
            .partition_point(|sum| *sum < wanted)
            .min(self.corners.len().saturating_sub(3));
        let [u, v] = random.in_triangle();
        let a = self.corners[0];
        a + u * (self.corners[triangle + 1] - a) + v * (self.corners[triangle + 2] - a)
    }

    /// A point on its border, with a chance in a corner.
    pub(super) fn border(&self, random: &mut Random, corner_chance: f32) -> Vec3 {
        let edge = random.below(self.corners.len());
        let share = random.unit();
        let share = if random.unit() < corner_chance {
            share.round()
        } else {
            share
        };
        self.corners[edge].lerp(self.corners[(edge + 1) % self.corners.len()], share)
    }
}

/// A cell that is not a box.
pub(super) struct Solid {
    /// It is where `xyz · p ≤ w` for each.
    planes: Vec<Vec4>,
    faces: Vec<Polygon>,
    center: Vec3,
}

impl Solid {
    /// `None` for a cell that is a box.
    pub(super) fn of(world: &World, cell: &ViewCell) -> Option<Self> {
        let hull = cell.hull.as_ref()?;
        let faces = (0..hull.planes.len()).map(|face| {
            let corners = hull.corners_of(face).map(|p| world.relative(p.to_array()));
            Polygon::new(corners.collect())
        });
        let planes = hull.planes.iter().map(|half| {
            let normal = glam::DVec3::new(half[0], half[1], half[2]);
            normal.extend(half[3] - normal.dot(world.origin())).as_vec4()
        });
        Some(Self {
            planes: planes.collect(),
            faces: faces.collect(),
            center: world.relative(cell.center()),
        })
    }

    /// How far a point lies outside its outermost plane, zero or less inside.
    pub(super) fn outside_m(&self, point: Vec3) -> f32 {
        let heights = self.planes.iter().map(|plane| plane.truncate().dot(point) - plane.w);
        heights.fold(f32::NEG_INFINITY, f32::max)
    }

    pub(super) fn contains(&self, point: Vec3) -> bool {
        self.outside_m(point) <= 0.0
    }

    /// The point itself, or where the way from it to the middle enters: a little within the surface, by a share of
    /// that way.
    pub(super) fn drawn_in(&self, point: Vec3, inset: f32) -> Vec3 {
        let along = point - self.center;
        let share = self.planes.iter().fold(1.0, |share: f32, plane| {
            let (room, rise) = (plane.w - plane.truncate().dot(self.center), plane.truncate().dot(along));
            if rise > room * (1.0 - inset) {
                share.min(room * (1.0 - inset) / rise)
            } else {
                share
            }
        });
        self.center + share * along
    }

    /// A point on its surface: on a face, an edge or a corner.
    pub(super) fn surface(&self, random: &mut Random) -> Vec3 {
        let face = &self.faces[random.below(self.faces.len())];
        if random.unit() < EDGES {
            face.border(random, EDGES)
        } else {
            face.uniform(random)
        }
    }

    /// Whether a ray of this reach meets it.
    pub(super) fn meets(&self, eye: Vec3, direction: Vec3, reach: f32) -> bool {
        let (mut enter, mut leave) = (0.0f32, reach);
        for plane in &self.planes {
            let (outside, rise) = (plane.truncate().dot(eye) - plane.w, plane.truncate().dot(direction));
            if rise == 0.0 {
                if outside > 0.0 {
                    return false;
                }
            } else if rise < 0.0 {
                enter = enter.max(-outside / rise);
            } else {
                leave = leave.min(-outside / rise);
            }
        }
        enter < leave
    }
}
