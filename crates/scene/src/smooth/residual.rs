//! What is missing from the prediction of a new vertex?
//!
//! The residual is coded along lattice axes, that along which the surface is steepest last: what the surface's plane says of
//! it, given the other two, is taken off first. This parts what lies in the surface from what sticks out of it, as Alliez &
//! Desbrun (2001) do, but without rounding.

use super::geometry::{Hood, Weights};
use super::model::{Nibble, gamma};
use super::quotient::quotient;
use super::rans::Coder;

/// Models of residuals.
#[derive(Debug, Clone)]
pub(super) struct ResidualModels {
    shared: [[Nibble; 3]; 8],
    first: [Nibble; 32],
    second: Box<[[Nibble; 8]; 16]>,
    third: Box<[[Nibble; 8]; 16]>,
}

impl Default for ResidualModels {
    fn default() -> Self {
        let table = || Box::new(std::array::from_fn(|_| std::array::from_fn(|_| Nibble::default())));
        Self {
            shared: std::array::from_fn(|_| std::array::from_fn(|_| Nibble::default())),
            first: std::array::from_fn(|_| Nibble::default()),
            second: table(),
            third: table(),
        }
    }
}

impl ResidualModels {
    /// Where the new vertex is, from the old one.
    #[inline(always)]
    pub(super) fn code<C: Coder>(
        &mut self,
        coder: &mut C,
        hood: &Hood,
        weights: &Weights,
        before: usize,
        given: [i32; 3],
    ) -> ([i32; 3], usize) {
        let expected = hood.expected(weights);
        let mut given_shared = 0;
        if C::WRITES {
            for axis in 0..3 {
                given_shared |= usize::from(given[axis] == hood.nearest(axis, expected[axis])) << axis;
            }
        }
        let shared = coder.symbol(&mut self.shared[before & 7][hood.kind / 4], given_shared);
        let is_shared = |axis: usize| shared >> axis & 1 == 1;

        let [low, middle, top] = by_steepness(hood.normal);
        let mut found = [0; 3];
        let size = usize::from(hood.size);
        let round = |sixteenths: i32| sixteenths.wrapping_add(8) >> 4;
        let mut classes = [0; 2];
        for (i, axis) in [low, middle].into_iter().enumerate() {
            if is_shared(axis) {
                found[axis] = hood.nearest(axis, expected[axis]);
                continue;
            }
            let model = if i == 0 {
                &mut self.first[size]
            } else {
                &mut self.second[size / 2][classes[0] / 2]
            };
            let (value, class) = residual(coder, model, given[axis].wrapping_sub(round(expected[axis])));
            found[axis] = value.wrapping_add(round(expected[axis]));
            classes[i] = class;
        }
        if is_shared(top) {
            found[top] = hood.nearest(top, expected[top]);
            return (found, shared);
        }
        let normal = hood.normal;
        let mut on_plane = i64::from(expected[top]);
        if normal[top] != 0 {
            let off = |axis: usize| normal[axis] * (16 * i64::from(found[axis]) - i64::from(expected[axis]));
            on_plane -= quotient(off(low) + off(middle), normal[top]);
        }
        let on_plane = round(on_plane as i32);
        let model = &mut self.third[size / 2][classes[0].max(classes[1]) / 2];
        let (value, _) = residual(coder, model, given[top].wrapping_sub(on_plane));
        found[top] = value.wrapping_add(on_plane);
        (found, shared)
    }
}

/// The axes, that of the normal's largest component last.
#[inline(always)]
fn by_steepness(normal: [i64; 3]) -> [usize; 3] {
    let [x, y, z] = normal.map(i64::abs);
    let top = if x > y {
        if x > z { 0 } else { 2 }
    } else if y > z {
        1
    } else {
        2
    };
    [(top + 1) % 3, (top + 2) % 3, top]
}

/// A number around 0 and the class of its size: in halves of powers of two, what is below that raw.
#[inline(always)]
pub(super) fn residual<C: Coder>(coder: &mut C, model: &mut Nibble, value: i32) -> (i32, usize) {
    let size = value.unsigned_abs();
    let class = coder.symbol(model, class_of(size));
    if class == 0 {
        return (0, 0);
    }
    let negative = u32::from(value < 0);
    let (size, negative) = if class < 15 {
        let bits = u32::from(BITS[class]);
        let raw = coder.raw(
            bits + 1,
            size.wrapping_sub(BASE[class]) << 1 & ((2 << bits) - 1) | negative,
        );
        (BASE[class] + (raw >> 1), raw & 1)
    } else {
        let more = gamma(coder, size.wrapping_sub(LARGE));
        (LARGE.wrapping_add(more), coder.raw(1, negative))
    };
    let value = size as i32;
    (if negative == 1 { value.wrapping_neg() } else { value }, class)
}

/// By class, the least size, and how many bits tell what is above it.
const BASE: [u32; 16] = [0, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, LARGE];
const BITS: [u8; 16] = [0, 0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 0];

/// From here on sizes are in class 15.
const LARGE: u32 = 192;

fn class_of(size: u32) -> usize {
    if size < 4 {
        return size as usize;
    }
    let log = size.ilog2();
    ((2 * log + (size >> (log - 1) & 1)) as usize).min(15)
}
