//! Where does a point lie in its model?

use glam::DVec3;

use crate::lod::octree::to_f64;
use crate::morton;

/// Finest depth: 3 × 21 bits fill a code.
pub(super) const MAX_DEPTH: u32 = 21;

/// The smallest cube around some points, with their least coordinates: the root of the octree.
pub(super) struct RootCube {
    min: DVec3,
    max: DVec3,
    side: f64,
}

impl RootCube {
    pub(super) fn around(points: impl Iterator<Item = DVec3>) -> Self {
        let (min, max) = points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| {
            (min.min(p), max.max(p))
        });
        let side = (max - min).max_element().max(0.0);
        Self { min, max, side }
    }

    /// Where a point lies in the cube, each coordinate from 0 to 1.
    pub(super) fn unit(&self, point: DVec3) -> DVec3 {
        let scale = if self.side > 0.0 { self.side.recip() } else { 0.0 };
        (point - self.min) * scale
    }

    /// The point of a place in the cube that is nearest to it and in the box of the points around which the cube is.
    pub(super) fn position(&self, unit: [f32; 3]) -> [f32; 3] {
        let point = self.min + to_f64(unit) * self.side;
        point.max(self.min).min(self.max).as_vec3().to_array()
    }

    /// The Morton code of the cell of depth [`MAX_DEPTH`] that holds a point; x is the lowest bit of each digit.
    pub(super) fn code(&self, point: DVec3) -> u64 {
        let cells = f64::from(1u32 << MAX_DEPTH);
        let cell = (self.unit(point) * cells).min(DVec3::splat(cells - 1.0));
        morton::code(cell.to_array().map(|x| x as u64))
    }
}
