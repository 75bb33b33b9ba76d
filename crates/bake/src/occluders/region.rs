//! What do sight lines start from, pass through and end in? Convex regions.

use belvedere_scene::{Bounds, convex::outside_m};
use glam::Vec3;

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
        let center = cell.center();
        let inside_m = cell
            .planes()
            .iter()
            .map(|half| -outside_m(half, center))
            .fold(f64::INFINITY, f64::min);
        let (middle, reach) = (
            world.relative(center),
            around.min.abs().max(around.max.abs()).max_element(),
        );
        let grow = 1.0 + 8.0 * f32::EPSILON * reach / (inside_m as f32).max(f32::MIN_POSITIVE);
        let points = cell.shape().points.into_iter();
        Self::hull(points.map(|p| middle + grow * (world.relative(p) - middle)).collect())
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

    /// The smallest and largest value of `normal · p − offset` in it.
    #[must_use]
    pub fn heights(&self, normal: Vec3, offset: f32) -> [f32; 2] {
        if self.points.is_empty() {
            let middle = normal.dot(self.center()) - offset;
            let reach = normal.abs().dot(0.5 * (self.max - self.min));
            [middle - reach, middle + reach]
        } else {
            self.points
                .iter()
                .fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], p| {
                    let height = normal.dot(*p) - offset;
                    [low.min(height), high.max(height)]
                })
        }
    }

    /// Two boxes that together are the box around it, cut across its longest edge.
    #[must_use]
    pub fn halves(&self) -> [Self; 2] {
        let axis = (self.max - self.min).max_position();
        let middle = self.center()[axis];
        let (mut low, mut high) = (self.max, self.min);
        low[axis] = middle;
        high[axis] = middle;
        [Self::of_box(self.min, low), Self::of_box(high, self.max)]
    }
}
