//! Which noise was asked for before? Layers of a landscape lie on the same ground: each field asks again for what the last
//! one has asked, point for point.

use crate::procedural::operation::fractal_of_each;
use crate::procedural::random::{mixed, step, step_number};

/// Rows of places that are remembered: three fields of 128 steps along each side, or what was asked last of larger ones.
const SLOTS: usize = 1 << 13;
/// What is asked of fewer places at once is not worth it.
const LEAST_PLACES: usize = 8;
/// What of fewer octaves neither.
const LEAST_OCTAVES: u32 = 3;

/// Octaves of noise at some places, where they were asked for last. Each has one slot to be in, and the last one stays.
#[derive(Debug, Default)]
pub(super) struct Memory {
    /// Octaves, 0 where nothing is.
    octaves: Vec<u32>,
    /// For each slot all x, all z, and what was found there.
    numbers: Vec<f64>,
}

impl Memory {
    /// As [`fractal_of_each`]; the seed and `N` are always the same.
    pub(super) fn fractal<const N: usize>(
        &mut self,
        seed: u32,
        [x, z]: [&[f64; N]; 2],
        octaves: u32,
    ) -> Option<[f64; N]> {
        if N < LEAST_PLACES || octaves < LEAST_OCTAVES {
            return fractal_of_each(seed, [x, z], octaves);
        }
        if self.octaves.is_empty() {
            self.octaves = vec![0; SLOTS];
            self.numbers = vec![0.0; SLOTS * 3 * N];
        }
        let path = step_number(step_number(step(0, octaves), x[0]), z[0]);
        let slot = mixed(step_number(path, x[N - 1])) as usize % SLOTS;
        let kept = &mut self.numbers.as_chunks_mut::<N>().0[3 * slot..3 * slot + 3];
        let is_same = |a: &[f64; N], b: &[f64; N]| a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits());
        if self.octaves[slot] == octaves && is_same(&kept[0], x) && is_same(&kept[1], z) {
            return Some(kept[2]);
        }
        let found = fractal_of_each(seed, [x, z], octaves)?;
        self.octaves[slot] = octaves;
        kept.copy_from_slice(&[*x, *z, found]);
        Some(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_remembered_is_what_would_be_found() {
        let mut memory = Memory::default();
        // More places than slots, so that many share one; each is asked for again while it is still there.
        for i in 0..3 * SLOTS {
            let x: [f64; 8] = std::array::from_fn(|place| i as f64 * 0.37 + place as f64 * 0.21);
            let z = [(i % 7) as f64 * 0.9; 8];
            for octaves in [LEAST_OCTAVES, LEAST_OCTAVES, 1] {
                let found = memory.fractal(5, [&x, &z], octaves);
                assert_eq!(found, fractal_of_each(5, [&x, &z], octaves), "{i}");
            }
        }
        assert_eq!(memory.fractal(5, [&[2e9; 8], &[0.0; 8]], LEAST_OCTAVES), None);
    }
}
