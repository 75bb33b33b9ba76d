//! What do sight lines start from, pass through and end in? Convex regions.

use belvedere_scene::{
    Bounds,
    convex::{HalfSpace, outside_m},
};
use glam::{DVec3, Vec3};

use crate::{cells::ViewCell, world::World};

/// A convex region, relative to the world's origin: a box, or the hull of a few points.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Region {
    /// The box around it.
    pub min: Vec3,
    /// The box around it.
    pub max: Vec3,
    /// Its corners when it is not a box.
    pub points: Vec<Vec3>,
}

impl Region {
    /// A box.
    #[must_use]
    pub fn of_box(min: Vec3, max: Vec3) -> Self {
        Self {
            min,
            max,
            points: Vec::new(),
        }
    }

    /// A box in world space, rounded outwards.
    #[must_use]
    pub fn around(world: &World, bounds: &Bounds) -> Self {
        Self::rounded(world.relative(bounds.min), world.relative(bounds.max))
    }

    /// A box whose sides were rounded to single precision, rounded outwards.
    #[must_use]
    pub fn rounded(min: Vec3, max: Vec3) -> Self {
        let rounding = f32::EPSILON * min.abs().max(max.abs());
        Self::of_box(min - rounding, max + rounding)
    }

    /// A view cell, rounded outwards.
    #[must_use]
    pub fn of_cell(world: &World, cell: &ViewCell) -> Self {
        let around = Self::around(world, &cell.bounds);
        if cell.hull.is_none() {
            return around;
        }
        around.hull_within(cell.planes(), &cell.shape().points, |p| world.relative(p.to_array()))
    }

    /// The hull of corners in world space, which planes there bound too, rounded outwards. This is the box around it, and
    /// `relative` gives positions as they are in there.
    #[must_use]
    pub fn hull_within(&self, planes: &[HalfSpace], corners: &[[f64; 3]], relative: impl Fn(DVec3) -> Vec3) -> Self {
        let count = corners.len() as f64;
        let center = [0, 1, 2].map(|axis| corners.iter().map(|p| p[axis]).sum::<f64>() / count);
        let inside_m = planes
            .iter()
            .map(|half| -outside_m(half, center))
            .fold(f64::INFINITY, f64::min);
        // Rounding to single precision moves a corner by less than one unit in the last place.
        let grow = 1.0 + f64::from(2.0 * f32::EPSILON * self.reach_m()) / inside_m.max(f64::from(f32::MIN_POSITIVE));
        let grown = |p: &[f64; 3]| DVec3::from(center).lerp((*p).into(), grow);
        Self::hull(corners.iter().map(|p| relative(grown(p))).collect())
    }

    /// The hull of points, which are not none.
    #[must_use]
    pub fn hull(points: Vec<Vec3>) -> Self {
        let min = points.iter().copied().fold(Vec3::INFINITY, Vec3::min);
        let max = points.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
        Self { min, max, points }
    }

    /// One of the eight corners of its box: bits 0, 1, 2 choose the larger x, y, z.
    #[must_use]
    pub fn corner(&self, index: usize) -> Vec3 {
        Vec3::select(
            glam::BVec3::new(index & 1 != 0, index & 2 != 0, index & 4 != 0),
            self.max,
            self.min,
        )
    }

    /// Points whose hull it is.
    pub fn corners(&self) -> impl Iterator<Item = Vec3> + '_ {
        let of_box = if self.points.is_empty() { 0..8 } else { 0..0 };
        of_box.map(|i| self.corner(i)).chain(self.points.iter().copied())
    }

    /// The middle of its box.
    #[must_use]
    pub fn center(&self) -> Vec3 {
        0.5 * (self.min + self.max)
    }

    /// The largest coordinate in it, whatever its sign.
    #[must_use]
    pub fn reach_m(&self) -> f32 {
        self.min.abs().max(self.max.abs()).max_element()
    }

    /// Whether the boxes share a point.
    #[must_use]
    pub fn overlaps(&self, other: &Self) -> bool {
        self.min.cmple(other.max).all() && self.max.cmpge(other.min).all()
    }

    /// Distance between the boxes, zero when they meet.
    #[must_use]
    pub fn distance_m(&self, other: &Self) -> f32 {
        (other.min - self.max)
            .max(self.min - other.max)
            .max(Vec3::ZERO)
            .length()
    }

    /// The solid angle of its box seen from a point, in steradians: roughly its faces over the square of the distance to its
    /// middle, 4π from within.
    #[must_use]
    pub fn solid_angle_sr(&self, eye: Vec3) -> f32 {
        const ALL_AROUND: f32 = 4.0 * std::f32::consts::PI;
        if eye.cmpge(self.min).all() && eye.cmple(self.max).all() {
            return ALL_AROUND;
        }
        let size = self.max - self.min;
        let faces = Vec3::new(size.y * size.z, size.z * size.x, size.x * size.y);
        let away = self.center() - eye;
        let distance = away.length().max(f32::MIN_POSITIVE);
        (faces.dot(away.abs() / distance) / (distance * distance)).min(ALL_AROUND)
    }

    /// The smallest and largest value of `normal · p − offset` in it, in double precision, since far out the difference of large
    /// numbers is small.
    #[must_use]
    pub fn heights(&self, normal: Vec3, offset: f32) -> [f32; 2] {
        let (normal, offset) = (normal.as_dvec3(), f64::from(offset));
        let heights = if self.points.is_empty() {
            let (min, max) = (self.min.as_dvec3(), self.max.as_dvec3());
            let middle = 0.5 * normal.dot(min + max) - offset;
            let reach = 0.5 * normal.abs().dot(max - min);
            [middle - reach, middle + reach]
        } else {
            self.points
                .iter()
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| {
                    let height = normal.dot(p.as_dvec3()) - offset;
                    [low.min(height), high.max(height)]
                })
        };
        heights.map(|height| height as f32)
    }

    /// Two regions that together are all of it, cut across the longest edge of its box.
    #[must_use]
    pub fn halves(&self) -> [Self; 2] {
        let axis = (self.max - self.min).max_position();
        self.cut(axis, self.center()[axis])
    }

    /// Two regions that together are all of it, cut across an axis at a place inside of it.
    #[must_use]
    pub fn cut(&self, axis: usize, at: f32) -> [Self; 2] {
        if !self.points.is_empty() {
            let section = self.section(axis, at);
            return [1.0, -1.0].map(|side: f32| {
                let beside = self.points.iter().filter(|p| side * (at - p[axis]) > 0.0);
                Self::hull(beside.chain(&section).copied().collect())
            });
        }
        let (mut low, mut high) = (self.max, self.min);
        low[axis] = at;
        high[axis] = at;
        [Self::of_box(self.min, low), Self::of_box(high, self.max)]
    }

    /// Corners of what a plane across an axis has in common with a hull.
    fn section(&self, axis: usize, at: f32) -> Vec<Vec3> {
        let mut met: Vec<Vec3> = self.points.iter().filter(|p| p[axis] == at).copied().collect();
        for a in self.points.iter().filter(|p| p[axis] < at) {
            for b in self.points.iter().filter(|p| p[axis] > at) {
                let mut cut = *a + (at - a[axis]) / (b[axis] - a[axis]) * (*b - *a);
                cut[axis] = at;
                met.push(cut);
            }
        }
        outline(met, (axis + 1) % 3, (axis + 2) % 3)
    }
}

/// The corners of the convex hull of points of a plane, along two of its axes (Andrew 1979).
fn outline(mut points: Vec<Vec3>, u: usize, v: usize) -> Vec<Vec3> {
    points.sort_by(|a, b| a[u].total_cmp(&b[u]).then(a[v].total_cmp(&b[v])));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let turns_left = |a: Vec3, b: Vec3, c: Vec3| (b[u] - a[u]) * (c[v] - a[v]) - (b[v] - a[v]) * (c[u] - a[u]) > 0.0;
    let chain = |points: &mut dyn Iterator<Item = &Vec3>| {
        let mut chain: Vec<Vec3> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..] {
                if turns_left(a, b, *point) {
                    break;
                }
                chain.pop();
            }
            chain.push(*point);
        }
        chain.pop();
        chain
    };
    let mut corners = chain(&mut points.iter());
    corners.extend(chain(&mut points.iter().rev()));
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A prism over a hexagon, 4 m across and 3 m high.
    fn prism() -> Region {
        let corners = (0..6).flat_map(|i| {
            let turn = std::f32::consts::FRAC_PI_3 * i as f32 + 0.2;
            [0.0, 3.0].map(|y| Vec3::new(2.0 * turn.cos(), y, 2.0 * turn.sin()))
        });
        Region::hull(corners.collect())
    }

    #[test]
    fn halves_of_a_hull_are_hulls() {
        let mut parts = vec![prism()];
        for _ in 0..5 {
            parts = parts.iter().flat_map(Region::halves).collect();
        }
        assert_eq!(parts.len(), 32);
        let directions = (0..64).map(|i| {
            let turn = 0.1 * i as f32;
            Vec3::new(turn.cos(), (0.37 * i as f32).sin(), turn.sin()).normalize()
        });
        for direction in directions {
            // What leans furthest out is the same before and after.
            let [_, whole] = prism().heights(direction, 0.0);
            let together = parts.iter().map(|part| part.heights(direction, 0.0)[1]);
            let together = together.fold(f32::NEG_INFINITY, f32::max);
            assert!(
                (whole - together).abs() < 1e-4,
                "{whole} and {together} along {direction}"
            );
        }
        assert!(
            parts.iter().all(|part| part.points.len() <= 32),
            "no more corners than need be"
        );
    }

    #[test]
    fn halves_of_a_box_are_boxes() {
        let [low, high] = Region::of_box(Vec3::ZERO, Vec3::new(1.0, 4.0, 2.0)).halves();
        assert_eq!(low, Region::of_box(Vec3::ZERO, Vec3::new(1.0, 2.0, 2.0)));
        assert_eq!(high, Region::of_box(Vec3::new(0.0, 2.0, 0.0), Vec3::new(1.0, 4.0, 2.0)));
    }
}
