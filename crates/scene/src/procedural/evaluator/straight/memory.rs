//! Which noise was asked for before? Layers of a landscape lie on the same ground: each field asks again for what the last
//! one has asked, point for point and in the same order. So rows of places lie in the order in which they were asked for first,
//! where the processor finds the next one before it is asked for.

use crate::procedural::operation::fractal_of_each;
use crate::procedural::random::{mixed, step, step_number};

/// Rows of places that are remembered: three fields of 128 steps along each side, or what was asked last of larger ones.
const ROWS: usize = 1 << 13;
/// Where rows are looked up; so many more that few are to be found at one slot.
const SLOTS: usize = 1 << 15;
/// What is asked of fewer places at once is not worth it.
const LEAST_PLACES: usize = 8;
/// What of fewer octaves neither.
const LEAST_OCTAVES: u32 = 3;

/// Octaves of noise at some places, where they were asked for last. Each has one slot to be found at, and the last one stays.
#[derive(Debug, Default)]
pub(super) struct Memory {
    /// The row that was last found at each slot.
    slots: Vec<u16>,
    /// Octaves of each row, 0 where nothing is.
    octaves: Vec<u32>,
    /// For each row all x, all z, and what was found there.
    numbers: Vec<f64>,
    /// The row that is written next.
    next: usize,
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
        if self.slots.is_empty() {
            self.slots = vec![0; SLOTS];
            self.octaves = vec![0; ROWS];
            self.numbers = vec![0.0; ROWS * 3 * N];
        }
        let path = step_number(step_number(step(0, octaves), x[0]), z[0]);
        let slot = mixed(path) as usize % SLOTS;
        let rows = self.numbers.as_chunks_mut::<N>().0.as_chunks_mut::<3>().0;
        let row = usize::from(self.slots[slot]);
        let [of_x, of_z, found] = &rows[row];
        if self.octaves[row] == octaves && differences(of_x, x) | differences(of_z, z) == 0 {
            return Some(*found);
        }
        let found = fractal_of_each(seed, [x, z], octaves)?;
        rows[self.next] = [*x, *z, found];
        self.octaves[self.next] = octaves;
        self.slots[slot] = self.next as u16;
        self.next = (self.next + 1) % ROWS;
        Some(found)
    }
}

/// Bits by which numbers differ: of all at once, without a branch for each.
fn differences<const N: usize>(a: &[f64; N], b: &[f64; N]) -> u64 {
    let mut bits = 0;
    for i in 0..N {
        bits |= a[i].to_bits() ^ b[i].to_bits();
    }
    bits
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_remembered_is_what_would_be_found() {
        let mut memory = Memory::default();
        // More places than rows and slots, so that many share one; each is asked for again while it is still there.
        for i in 0..2 * SLOTS {
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
