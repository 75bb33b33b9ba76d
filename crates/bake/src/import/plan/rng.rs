//! Where do small irregularities come from? A seeded generator, and value noise on top of it. The same seed gives the same
//! world.

use glam::Vec3;

use crate::random::{SplitMix64, mixed};

/// A seeded stream of numbers.
#[derive(Debug, Clone)]
pub(super) struct Rng(SplitMix64);

impl Rng {
    pub(super) fn new(seed: u64) -> Self {
        Self(SplitMix64::new(seed))
    }

    /// In [0, 1).
    pub(super) fn unit(&mut self) -> f32 {
        self.0.unit()
    }

    /// In [low, high).
    pub(super) fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// In 0..count.
    pub(super) fn below(&mut self, count: usize) -> usize {
        (self.0.next() % count.max(1) as u64) as usize
    }
}

fn lattice(x: i32, y: i32, z: i32, seed: u64) -> f32 {
    let key = (x as u32 as u64) ^ ((y as u32 as u64) << 21) ^ ((z as u32 as u64) << 42);
    (mixed(key.wrapping_add(mixed(seed))) >> 40) as f32 / (1u64 << 23) as f32 - 1.0
}

/// Smooth value noise in [−1, 1] with features of size one.
pub(super) fn noise(p: Vec3, seed: u64) -> f32 {
    let base = p.floor();
    let t = p - base;
    let s = t * t * (Vec3::splat(3.0) - 2.0 * t);
    let [x, y, z] = base.to_array().map(|c| c as i32);
    let along_x = |dy, dz| {
        let (a, b) = (lattice(x, y + dy, z + dz, seed), lattice(x + 1, y + dy, z + dz, seed));
        a + (b - a) * s.x
    };
    let along_y = |dz| {
        let (a, b) = (along_x(0, dz), along_x(1, dz));
        a + (b - a) * s.y
    };
    let (a, b) = (along_y(0), along_y(1));
    a + (b - a) * s.z
}
