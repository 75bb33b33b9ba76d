//! How likely is each decision? Models that learn from what was decided.
//!
//! [`Nibble`] after Giesen, *Models for adaptive arithmetic coding* (2015): sixteen symbols whose cumulative chances all
//! move a little towards the symbol that came; short loops over arrays of 16-bit numbers, which processors do at once.
//! All arithmetic is on integers, so that every language decodes the same.

use super::rans::{CHANCE_BITS, Coder};

/// Learns how likely a decision is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bit {
    /// Chance of a 0, in 1/2¹⁵.
    zero: u16,
    /// How often it was asked, up to [`Bit::SETTLED`].
    seen: u8,
}

impl Default for Bit {
    fn default() -> Self {
        Self {
            zero: 1 << (CHANCE_BITS - 1),
            seen: 0,
        }
    }
}

impl Bit {
    const SETTLED: u8 = 32;
    /// In halves of the number of times it was asked, the first few steps are long.
    const LEAST: i32 = 1 << 6;

    #[inline(always)]
    pub(super) fn chance_of_zero(self) -> u32 {
        u32::from(self.zero)
    }

    #[inline(always)]
    pub(super) fn learn(&mut self, bit: bool) {
        let rate = RATES[usize::from(self.seen)];
        let target = if bit {
            Self::LEAST
        } else {
            (1 << CHANCE_BITS) - Self::LEAST
        };
        let zero = i32::from(self.zero);
        self.zero = (zero + ((target - zero) >> rate)) as u16;
        self.seen += u8::from(self.seen < Self::SETTLED);
    }
}

/// Step sizes, as shifts, by how often a model was asked.
const RATES: [u8; 33] = [
    1, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4, 4, 4, 4, 4, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 6,
];

/// Learns which of 16 symbols is likely. Aligned so that it is in one line of a cache.
#[derive(Debug, Clone)]
#[repr(align(64))]
pub(super) struct Nibble {
    /// Chance of a symbol below the i-th, in 1/2¹⁵; the first is 0.
    below: [i16; 16],
    seen: u8,
}

impl Default for Nibble {
    fn default() -> Self {
        Self {
            below: std::array::from_fn(|i| (i << (CHANCE_BITS - 4)) as i16),
            seen: 0,
        }
    }
}

/// Where the cumulative chances go when a symbol came: everything to it, the least to all others.
const TARGETS: [[i16; 16]; 16] = {
    let mut targets = [[0; 16]; 16];
    let mut symbol = 0;
    while symbol < 16 {
        let mut i = 0;
        while i < 16 {
            let least = (Nibble::LEAST * i as i32) as i16;
            targets[symbol][i] = if i <= symbol {
                least
            } else {
                ((1 << CHANCE_BITS) - Nibble::LEAST * (16 - i as i32)) as i16
            };
            i += 1;
        }
        symbol += 1;
    }
    targets
};

impl Nibble {
    const SETTLED: u8 = 60;
    const LEAST: i32 = 8;

    #[inline(always)]
    pub(super) fn find(&self, slot: u32) -> usize {
        let slot = slot as i16;
        let above: i16 = self.below.iter().map(|&below| i16::from(below <= slot)).sum();
        (above - 1) as usize & 15
    }

    #[inline(always)]
    pub(super) fn interval(&self, symbol: usize) -> (u32, u32) {
        let start = self.below[symbol & 15] as u32;
        let end = if symbol < 15 {
            self.below[(symbol + 1) & 15] as u32
        } else {
            1 << CHANCE_BITS
        };
        (start, end - start)
    }

    #[inline(always)]
    pub(super) fn learn(&mut self, symbol: usize) {
        // The first steps are long, so that few symbols suffice.
        let rate = NIBBLE_RATES[usize::from(self.seen >> 2)];
        self.seen += u8::from(self.seen < Self::SETTLED);
        let target = &TARGETS[symbol & 15];
        for (below, target) in self.below.iter_mut().zip(target) {
            *below += (*target - *below) >> rate;
        }
    }
}

/// Step sizes, as shifts, by a quarter of how often a model was asked.
const NIBBLE_RATES: [u8; 16] = [3, 4, 4, 4, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, 6];

/// A number of which 0 … 14 are likely: a symbol, and above it how much more in Elias' gamma code (1975).
#[inline(always)]
pub(super) fn number(coder: &mut impl Coder, model: &mut Nibble, value: u32) -> u32 {
    let symbol = coder.symbol(model, value.min(15) as usize) as u32;
    if symbol < 15 {
        symbol
    } else {
        gamma(coder, value.wrapping_sub(15)).saturating_add(15)
    }
}

/// Any number: how many bits, then the bits.
pub(super) fn gamma(coder: &mut impl Coder, value: u32) -> u32 {
    let value = value.wrapping_add(1);
    let bits = coder.raw(5, 31 - value.max(1).leading_zeros());
    (wide(coder, bits, value & ((1 << bits) - 1)) | 1 << bits) - 1
}

/// A number of up to 31 bits that nothing is known of.
pub(super) fn wide(coder: &mut impl Coder, bits: u32, value: u32) -> u32 {
    let low_bits = bits.min(CHANCE_BITS);
    let low = coder.raw(low_bits, value & ((1 << low_bits) - 1));
    let rest = bits - low_bits;
    if rest == 0 {
        return low;
    }
    let middle_bits = rest.min(CHANCE_BITS);
    let middle = coder.raw(middle_bits, value >> low_bits & ((1 << middle_bits) - 1));
    let top_bits = rest - middle_bits;
    let top = if top_bits == 0 {
        0
    } else {
        coder.raw(top_bits, value >> 30)
    };
    low | middle << CHANCE_BITS | top << 30
}
