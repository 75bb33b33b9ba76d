//! What of an object lies in a box? Its faces, cut to convex polygons.
//!
//! The box around an object says little of where it is: a wall with a door has a box that is closed where the door is open.
//! So proofs that fail for the whole box are tried for parts of the surface, each of which has a box of its own that fits.

use std::ops::Range;

use glam::Vec3;

use super::random::Random;
use crate::{occluders::Region, world::World};

/// Of an object with more faces than this only the box is known: cutting would cost more than it shows.
const MOST_FACES: usize = 1024;
/// The share of points that lie close to a corner of a face: outlines are seen first.
const CORNERS: f32 = 0.4;

/// Convex polygons, relative to the world's origin, in metres.
#[derive(Debug, Clone)]
pub struct Surface {
    corners: Vec<Vec3>,
    /// Where each polygon's corners end.
    ends: Vec<u32>,
    /// The box around all corners.
    min: Vec3,
    max: Vec3,
}

impl Default for Surface {
    fn default() -> Self {
        Self {
            corners: Vec::new(),
            ends: Vec::new(),
            min: Vec3::INFINITY,
            max: Vec3::NEG_INFINITY,
        }
    }
}

impl Surface {
    /// The faces of an object; `None` when it has none or very many, or is more than faces.
    #[must_use]
    pub fn of(world: &World, object: u32) -> Option<Self> {
        let few = world.triangle_count_of(object) <= MOST_FACES && !world.has_lines_or_points(object);
        few.then(|| Self::of_triangles(world.triangles_of(object).iter().map(|triangle| triangle.corners)))?
    }

    /// Faces by their corners; `None` when there are none or very many.
    #[must_use]
    pub fn of_triangles(triangles: impl Iterator<Item = [Vec3; 3]>) -> Option<Self> {
        let mut surface = Self::default();
        triangles
            .take(MOST_FACES + 1)
            .for_each(|corners| surface.push(&corners));
        (1..=MOST_FACES).contains(&surface.ends.len()).then_some(surface)
    }

    /// The faces of a box: whoever sees into it from outside sees one of them.
    #[must_use]
    pub fn of_box(region: &Region) -> Self {
        let mut surface = Self::default();
        for axis in 0..3 {
            let [u, v] = [1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3)];
            for side in [0, 1 << axis] {
                surface.push(&[side, side + u, side + u + v, side + v].map(|corner| region.corner(corner)));
            }
        }
        surface
    }

    fn push(&mut self, polygon: &[Vec3]) {
        polygon.iter().for_each(|corner| self.add(*corner));
        self.ends.push(self.corners.len() as u32);
    }

    fn add(&mut self, corner: Vec3) {
        self.corners.push(corner);
        (self.min, self.max) = (self.min.min(corner), self.max.max(corner));
    }

    /// Whether there is nothing of it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// The box around it, so much larger on all sides; it is not empty.
    #[must_use]
    pub fn around(&self, margin_m: f32) -> Region {
        Region::rounded(self.min - margin_m, self.max + margin_m)
    }

    /// What lies on either side of the middle of its box, across the longest edge.
    #[must_use]
    pub fn halves(&self) -> [Self; 2] {
        let axis = (self.max - self.min).max_position();
        let middle = 0.5 * (self.min[axis] + self.max[axis]);
        [1.0, -1.0].map(|side| {
            let mut half = Self::default();
            for polygon in self.polygons() {
                half.push_clipped(polygon, axis, middle, side);
            }
            half
        })
    }

    /// Adds what of a polygon lies below (`side` is 1) or above (−1) a place on an axis.
    fn push_clipped(&mut self, polygon: &[Vec3], axis: usize, at: f32, side: f32) {
        let first = self.corners.len();
        let inside_m = |p: Vec3| side * (at - p[axis]);
        for (i, a) in polygon.iter().enumerate() {
            let b = polygon[(i + 1) % polygon.len()];
            let (here_m, there_m) = (inside_m(*a), inside_m(b));
            if here_m >= 0.0 {
                self.add(*a);
            }
            if here_m * there_m < 0.0 {
                let mut cut = *a + here_m / (here_m - there_m) * (b - *a);
                cut[axis] = at;
                self.add(cut);
            }
        }
        if self.corners.len() > first {
            self.ends.push(self.corners.len() as u32);
        }
    }

    /// Its polygons: the corners of each, in order.
    pub fn polygons(&self) -> impl Iterator<Item = &[Vec3]> {
        self.ranges().map(|range| &self.corners[range])
    }

    fn ranges(&self) -> impl Iterator<Item = Range<usize>> + '_ {
        let mut from = 0;
        self.ends.iter().map(move |end| {
            let range = from..*end as usize;
            from = range.end;
            range
        })
    }

    /// A point on one of its polygons, which it has.
    pub(super) fn point(&self, random: &mut Random) -> Vec3 {
        let polygon = random.below(self.ends.len());
        let from = polygon.checked_sub(1).map_or(0, |before| self.ends[before] as usize);
        let corners = &self.corners[from..self.ends[polygon] as usize];
        let corner = random.below(corners.len());
        let [next, last] = [1, corners.len() - 1].map(|step| corners[(corner + step) % corners.len()]);
        let ([u, v], corner) = (random.in_triangle(), corners[corner]);
        let near = if random.unit() < CORNERS {
            0.02 * random.unit()
        } else {
            1.0
        };
        corner + near * (u * (next - corner) + v * (last - corner))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area_m2(surface: &Surface) -> f32 {
        let of = |corners: &[Vec3]| -> f32 {
            let fan = corners.windows(2).skip(1);
            fan.map(|pair| 0.5 * (pair[0] - corners[0]).cross(pair[1] - corners[0]).length())
                .sum()
        };
        surface.polygons().map(of).sum()
    }

    #[test]
    fn halves_of_a_surface_are_all_of_it() {
        let mut random = Random::stream(3, 0);
        for _ in 0..100 {
            let mut whole = Surface::default();
            for _ in 0..5 {
                whole.push(&[0; 3].map(|_| 10.0 * random.cube()));
            }
            let mut parts = vec![whole.clone()];
            for _ in 0..4 {
                parts = parts
                    .iter()
                    .flat_map(Surface::halves)
                    .filter(|part| !part.is_empty())
                    .collect();
            }
            let together_m2: f32 = parts.iter().map(area_m2).sum();
            assert!((together_m2 - area_m2(&whole)).abs() < 1e-3 * area_m2(&whole));
            for part in &parts {
                let around = part.around(1e-4);
                for _ in 0..10 {
                    let point = part.point(&mut random);
                    assert!(
                        around.overlaps(&Region::of_box(point, point)),
                        "{point} outside of {around:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_box_has_six_faces() {
        let surface = Surface::of_box(&Region::of_box(Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0)));
        assert_eq!(surface.ends.len(), 6);
        assert!((area_m2(&surface) - 22.0).abs() < 1e-4);
    }

    #[test]
    fn a_wall_with_a_door_is_not_where_the_door_is() {
        let mut wall = Surface::default();
        let mut upright = |x: [f32; 2], y: [f32; 2]| {
            wall.push(&[(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| Vec3::new(x[i], y[j], 0.0)));
        };
        upright([0.0, 4.0], [0.0, 3.0]);
        upright([5.0, 10.0], [0.0, 3.0]);
        upright([4.0, 5.0], [2.0, 3.0]);
        let mut parts = vec![wall];
        for _ in 0..8 {
            parts = parts
                .iter()
                .flat_map(Surface::halves)
                .filter(|part| !part.is_empty())
                .collect();
        }
        let door = Region::of_box(Vec3::new(4.4, 0.1, -1.0), Vec3::new(4.6, 1.6, 1.0));
        assert!(parts.iter().all(|part| !part.around(0.0).overlaps(&door)));
    }
}
