//! Where do samples fall? A seeded generator, one for each cell, so that results do not depend on threads.

use glam::Vec3;

use crate::random::SplitMix64;

/// A stream of random numbers.
#[derive(Debug, Clone)]
pub(crate) struct Random(SplitMix64);

impl Random {
    /// The stream with this number; different numbers give unrelated streams.
    pub(crate) fn stream(seed: u64, number: u64) -> Self {
        let mut first = SplitMix64::new(seed ^ number.wrapping_mul(0xD6E8_FEB8_6659_FD93));
        Self(SplitMix64::new(first.next()))
    }

    /// From 0 up to and excluding 1.
    pub(crate) fn unit(&mut self) -> f32 {
        self.0.unit()
    }

    /// From 0 up to and excluding `count`, which is not 0.
    pub(crate) fn below(&mut self, count: usize) -> usize {
        ((u128::from(self.0.next()) * count as u128) >> 64) as usize
    }

    /// Each coordinate from 0 to 1.
    pub(crate) fn cube(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit())
    }

    /// Each coordinate from -1 to 1.
    pub(crate) fn around_zero(&mut self) -> Vec3 {
        2.0 * self.cube() - Vec3::ONE
    }

    /// A direction, uniform on the unit sphere.
    pub(crate) fn direction(&mut self) -> Vec3 {
        let (z, turn) = (2.0 * self.unit() - 1.0, std::f32::consts::TAU * self.unit());
        let ring = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(ring * turn.cos(), ring * turn.sin(), z)
    }

    /// Two weights of a point in a triangle, uniform by area.
    pub(crate) fn in_triangle(&mut self) -> [f32; 2] {
        let (a, b) = (self.unit(), self.unit());
        if a + b > 1.0 { [1.0 - a, 1.0 - b] } else { [a, b] }
    }
}
