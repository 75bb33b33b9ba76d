//! Where do samples fall? A seeded generator (SplitMix64, Steele et al. 2014), one for each cell, so that results do
//! not depend on threads.

use glam::Vec3;

/// A stream of random numbers.
#[derive(Debug, Clone)]
pub(crate) struct Random(u64);

impl Random {
    /// The stream with this number; different numbers give unrelated streams.
    pub(crate) fn stream(seed: u64, number: u64) -> Self {
        let mut random = Self(seed ^ number.wrapping_mul(0xD6E8_FEB8_6659_FD93));
        Self(random.next())
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ mixed >> 31
    }

    /// From 0 up to and excluding 1.
    pub(crate) fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1u32 << 24) as f32
    }

    /// From 0 up to and excluding `count`, which is not 0.
    pub(crate) fn below(&mut self, count: usize) -> usize {
        ((u128::from(self.next()) * count as u128) >> 64) as usize
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
