//! Where do small irregularities come from? A seeded generator, SplitMix64 (Steele, Lea & Flood, "Fast splittable
//! pseudorandom number generators", 2014), and value noise on top of it. The same seed gives the same world.

use glam::Vec3;

/// A seeded stream of numbers.
#[derive(Debug, Clone)]
pub(super) struct Rng(u64);

fn mixed(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

impl Rng {
    pub(super) fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mixed(self.0)
    }

    /// In [0, 1).
    pub(super) fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1u64 << 24) as f32
    }

    /// In [low, high).
    pub(super) fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// In 0..count.
    pub(super) fn below(&mut self, count: usize) -> usize {
        (self.next() % count.max(1) as u64) as usize
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
