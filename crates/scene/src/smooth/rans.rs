//! How are decisions written in fractions of a bit, fast to read? Two interleaved range coders of the ANS family.
//!
//! After Duda, *Asymmetric numeral systems* (2013), in the range variant with 32-bit states that take in 16 bits at a
//! time, and Giesen, *Interleaved entropy coders* (2014): decisions go to the two states in turn, so that a processor
//! works on two at once. The models adapt ([`super::model`]), so the writer notes all decisions and codes them last to
//! first; the reader goes forward and can stop at any byte.
//!
//! Whoever codes with a [`Coder`] writes one function for both directions: each call is given what shall be written and
//! gives what stands in the stream; a reader ignores what it is given.

use std::ops::Range;

use super::course::Told;
use super::geometry::{Hood, Weights};
use super::model::{Bit, Nibble};
use super::residual::ResidualModels;

/// Chances are in 1/2¹⁵.
pub(super) const CHANCE_BITS: u32 = 15;
/// A state below this takes in 16 bits.
const LOWEST: u32 = 1 << 16;
/// Bytes of the two states before anything was decided.
pub(super) const STATE_BYTES: usize = 8;

/// Writes decisions, or reads them.
pub(super) trait Coder: Sized {
    /// Whether it writes.
    const WRITES: bool;
    /// A decision. Gives the one that stands in the stream.
    fn bit(&mut self, model: &mut Bit, bit: bool) -> bool;
    /// One of 16 symbols.
    fn symbol(&mut self, model: &mut Nibble, symbol: usize) -> usize;
    /// A number of up to 15 bits that nothing is known of.
    fn raw(&mut self, bits: u32, value: u32) -> u32;
    /// Where a new vertex is, from the old one, and which of its coordinates are those of vertices nearby.
    #[inline(always)]
    fn place(
        &mut self,
        models: &mut ResidualModels,
        hood: &Hood,
        weights: &Weights,
        before: usize,
        way: [i32; 3],
    ) -> ([i32; 3], usize) {
        models.code(self, hood, weights, before, way)
    }
    /// Whether so many bytes have come, or all that will, for what follows on what was told. Always when writing.
    #[inline(always)]
    fn has(&mut self, _bytes: usize, _told: Told) -> bool {
        true
    }
    /// Whether what it gave cannot be believed, because the stream has not come so far. Never when writing.
    #[inline(always)]
    fn starved(&self) -> bool {
        false
    }
}

/// Notes decisions and writes them when all are known.
#[derive(Debug, Default)]
pub(super) struct Writer {
    /// First chance and width of each decision.
    decisions: Vec<(u16, u16)>,
}

impl Writer {
    /// Before the first decision, with room for so many.
    pub(super) fn with_room(decisions: usize) -> Self {
        Self {
            decisions: Vec::with_capacity(decisions),
        }
    }

    /// How many decisions there are.
    pub(super) fn decisions(&self) -> usize {
        self.decisions.len()
    }

    /// The stream, and for each of `marks` (numbers of decisions, rising) how many bytes of it decide those.
    pub(super) fn finish(self, marks: &[usize]) -> (Vec<u8>, Vec<usize>) {
        let mut words: Vec<u16> = Vec::new();
        let mut states = [LOWEST; 2];
        let mut words_behind = vec![0; marks.len()];
        let mut mark = marks.len();
        for (i, &(start, width)) in self.decisions.iter().enumerate().rev() {
            while mark > 0 && marks[mark - 1] > i {
                mark -= 1;
                words_behind[mark] = words.len();
            }
            let (start, width) = (u32::from(start), u32::from(width));
            let state = &mut states[i & 1];
            if u64::from(*state) >= u64::from(width) << 17 {
                words.push(*state as u16);
                *state >>= 16;
            }
            *state = ((*state / width) << CHANCE_BITS) + *state % width + start;
        }
        let total = words.len();
        words_behind[..mark].fill(total);
        let mut bytes = Vec::with_capacity(STATE_BYTES + 2 * total);
        bytes.extend(states.iter().flat_map(|state| state.to_le_bytes()));
        bytes.extend(words.iter().rev().flat_map(|word| word.to_le_bytes()));
        let ends = words_behind
            .iter()
            .map(|behind| STATE_BYTES + 2 * (total - behind))
            .collect();
        (bytes, ends)
    }

    /// Notes some of another's decisions.
    pub(super) fn copy(&mut self, from: &Self, decisions: Range<usize>) {
        self.decisions.extend_from_slice(&from.decisions[decisions]);
    }

    #[inline(always)]
    fn note(&mut self, start: u32, width: u32) {
        self.decisions.push((start as u16, width as u16));
    }
}

impl Coder for Writer {
    const WRITES: bool = true;

    #[inline(always)]
    fn bit(&mut self, model: &mut Bit, bit: bool) -> bool {
        let zero = model.chance_of_zero();
        if bit {
            self.note(zero, (1 << CHANCE_BITS) - zero);
        } else {
            self.note(0, zero);
        }
        model.learn(bit);
        bit
    }

    #[inline(always)]
    fn symbol(&mut self, model: &mut Nibble, symbol: usize) -> usize {
        let (start, width) = model.interval(symbol);
        self.note(start, width);
        model.learn(symbol);
        symbol
    }

    #[inline(always)]
    fn raw(&mut self, bits: u32, value: u32) -> u32 {
        let shift = CHANCE_BITS - bits;
        self.note(value << shift, 1 << shift);
        value
    }
}

/// The two states of a reader and its place in the stream: all that it must keep between two deliveries.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    states: [u32; 2],
    /// Bytes taken.
    pub(super) taken: usize,
}

impl Place {
    /// At the beginning of a stream of which the first [`STATE_BYTES`] are here.
    pub(super) fn start(bytes: &[u8; STATE_BYTES]) -> Self {
        let [a, b, c, d, e, f, g, h] = *bytes;
        Self {
            states: [u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h])],
            taken: STATE_BYTES,
        }
    }

    /// Whether everything that was written has been read: both states are as the writer's were at its beginning.
    pub(super) fn is_end(&self) -> bool {
        self.states == [LOWEST; 2]
    }
}

/// Reads decisions. Behind the end of what is there it reads zeros and says that it is [`Reader::starved`].
#[derive(Debug)]
pub(super) struct Reader<'a> {
    now: u32,
    next: u32,
    bytes: &'a [u8],
    /// Whether no more will come.
    is_whole: bool,
    taken: usize,
}

impl<'a> Reader<'a> {
    pub(super) fn new(bytes: &'a [u8], is_whole: bool, place: Place) -> Self {
        Self {
            now: place.states[0],
            next: place.states[1],
            bytes,
            is_whole,
            taken: place.taken,
        }
    }

    pub(super) fn place(&self) -> Place {
        Place {
            states: [self.now, self.next],
            taken: self.taken,
        }
    }

    /// Bytes that are there and not yet taken.
    pub(super) fn left(&self) -> usize {
        self.bytes.len().saturating_sub(self.taken)
    }

    /// The chance that decides next.
    #[inline(always)]
    fn slot(&self) -> u32 {
        self.now & ((1 << CHANCE_BITS) - 1)
    }

    #[inline(always)]
    fn take(&mut self, start: u32, width: u32) {
        let slot = self.slot();
        let state = width
            .wrapping_mul(self.now >> CHANCE_BITS)
            .wrapping_add(slot.wrapping_sub(start));
        let word = match self.bytes.get(self.taken..self.taken + 2) {
            Some(&[low, high]) => u32::from(low) | u32::from(high) << 8,
            _ => 0,
        };
        // One in seven decisions takes a word in, and nobody can guess which: so there is no branch.
        let takes = u32::from(state < LOWEST);
        self.now = self.next;
        self.next = state << (16 * takes) | word & takes.wrapping_neg();
        self.taken += 2 * takes as usize;
    }
}

impl Coder for Reader<'_> {
    const WRITES: bool = false;

    #[inline(always)]
    fn bit(&mut self, model: &mut Bit, _: bool) -> bool {
        let zero = model.chance_of_zero();
        let bit = self.slot() >= zero;
        let (start, width) = if bit {
            (zero, (1 << CHANCE_BITS) - zero)
        } else {
            (0, zero)
        };
        self.take(start, width);
        model.learn(bit);
        bit
    }

    #[inline(always)]
    fn symbol(&mut self, model: &mut Nibble, _: usize) -> usize {
        let symbol = model.find(self.slot());
        let (start, width) = model.interval(symbol);
        self.take(start, width);
        model.learn(symbol);
        symbol
    }

    #[inline(always)]
    fn raw(&mut self, bits: u32, _: u32) -> u32 {
        let shift = CHANCE_BITS - bits;
        let value = self.slot() >> shift;
        self.take(value << shift, 1 << shift);
        value
    }

    #[inline(always)]
    fn has(&mut self, bytes: usize, _: Told) -> bool {
        self.is_whole || self.left() >= bytes
    }

    #[inline(always)]
    fn starved(&self) -> bool {
        self.taken > self.bytes.len()
    }
}
