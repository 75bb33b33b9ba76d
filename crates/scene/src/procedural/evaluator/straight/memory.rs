//! Which noise and which angles were asked for before? Layers of a landscape lie on the same ground: each field asks again for what the last
//! one has asked, point for point and in the same order. So rows of places lie in the order in which they were asked for first,
//! where the processor finds the next one before it is asked for. And the leaves of each spray turn by the same angles.

use crate::procedural::arithmetic::sin_cos_of_each;
use crate::procedural::operation::fractal_of_each;
use crate::procedural::random::{mixed, step, step_number};

/// Rows of places that are remembered: three fields of 128 steps along each side, or what was asked last of larger ones.
const ROWS: usize = 1 << 13;
/// Where rows are looked up; so many more that few are to be found at one slot.
const SLOTS: usize = 1 << 15;
/// Rows have so many places: of fewer it is not worth it.
const PLACES: usize = 8;
/// What of fewer octaves neither.
const LEAST_OCTAVES: u32 = 3;

/// So many rows of angles are remembered, of so many at most.
const ANGLE_ROWS: usize = 32;
const ANGLES: usize = 12;
/// Fewer angles are not worth it.
const LEAST_ANGLES: usize = 4;

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
    /// Rows of angles in degrees, of their sines and of their cosines: each number is that of its angle.
    angles: Vec<[[f64; ANGLES]; 3]>,
}

impl Memory {
    /// As [`fractal_of_each`]; the seed is always the same.
    #[inline(always)]
    pub(super) fn fractal<const N: usize>(
        &mut self,
        seed: u32,
        [x, z]: [&[f64; N]; 2],
        octaves: u32,
    ) -> Option<[f64; N]> {
        if N != PLACES || octaves < LEAST_OCTAVES {
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

impl Memory {
    /// As [`sin_cos_of_each`].
    #[inline(always)]
    pub(super) fn sin_cos<const N: usize>(&mut self, degrees: &[f64; N]) -> ([f64; N], [f64; N]) {
        if !(LEAST_ANGLES..=ANGLES).contains(&N) {
            return sin_cos_of_each(degrees);
        }
        let bits = degrees[N - 1].to_bits();
        let row = ((bits ^ bits >> 32) as u32).wrapping_mul(0x9e37_79b1) as usize >> 16;
        if self.angles.is_empty() {
            self.angles = vec![[[0.0; ANGLES], [0.0; ANGLES], [1.0; ANGLES]]; ANGLE_ROWS];
        }
        let row = &mut self.angles[row % ANGLE_ROWS];
        let [of, sin, cos] = row;
        let (of, sin, cos) = (first_mut(of), first_mut(sin), first_mut(cos));
        if differences(of, degrees) != 0 {
            *of = *degrees;
            (*sin, *cos) = sin_cos_of_each(degrees);
        }
        (*sin, *cos)
    }
}

/// The first so many of a row.
#[inline(always)]
fn first_mut<const N: usize>(row: &mut [f64; ANGLES]) -> &mut [f64; N] {
    &mut row.as_chunks_mut().0[0]
}

/// Bits by which numbers differ: of all at once, without a branch for each.
#[inline(always)]
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
    fn angles_that_are_remembered_have_their_sines() {
        let mut memory = Memory::default();
        for i in 0..20 * ANGLE_ROWS {
            let degrees: [f64; 8] = std::array::from_fn(|place| (i % 50) as f64 * place as f64 - 0.0);
            assert_eq!(memory.sin_cos(&degrees), sin_cos_of_each(&degrees));
            let four = &degrees.as_chunks::<4>().0[0];
            assert_eq!(memory.sin_cos(four), sin_cos_of_each(four));
        }
    }

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
