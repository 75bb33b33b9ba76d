//! How are decisions written in fractions of a bit? An adaptive binary range coder.
//!
//! After Martin, *Range encoding: an algorithm for removing redundancy from a digitised message* (1979), in the
//! carryless 32-bit form. Every decision has a [`Bit`] that learns how likely it is: fast at first (the mean of what it
//! has seen), then as a moving average. All arithmetic is on integers, so that every language decodes the same.
//!
//! Whoever codes with a [`Coder`] writes one function for both directions: each call is given what shall be written
//! and gives what stands in the stream; a decoder ignores what it is given.
//!
//! Guarantee: a decoder refuses to go on more than four bytes behind the end. A decision takes at least 1/89 of a bit,
//! so work and memory are linear in the bytes that are there, whatever they say.

use super::DecodeError;

/// Learns how likely a decision is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bit {
    /// Chance of a 1, in 1/65536.
    chance: u16,
    /// How often it was asked, up to [`SLOWEST`].
    seen: u8,
}

/// From then on what is new counts 1/32.
const SLOWEST: u8 = 30;
/// No decision is more certain than 127 : 1.
const LEAST: i32 = 512;

impl Default for Bit {
    fn default() -> Self {
        Self {
            chance: 1 << 15,
            seen: 0,
        }
    }
}

impl Bit {
    fn learn(&mut self, bit: bool) {
        let chance = i32::from(self.chance);
        let target = if bit { 65535 } else { 0 };
        // 1 / (seen + 1.5), in 1/4096.
        let rate = 8192 / (2 * i32::from(self.seen) + 3);
        self.chance = (chance + (((target - chance) * rate) >> 12)).clamp(LEAST, 65536 - LEAST) as u16;
        self.seen = (self.seen + 1).min(SLOWEST);
    }
}

/// Writes decisions, or reads them.
pub(super) trait Coder {
    /// One decision. Gives the one that stands in the stream.
    fn bit(&mut self, model: &mut Bit, bit: bool) -> Result<bool, DecodeError>;
}

/// The numbers from `low` to `high` are those that begin with what was written so far.
struct Interval {
    low: u32,
    high: u32,
}

impl Interval {
    const ALL: Self = Self { low: 0, high: u32::MAX };

    /// The last number that stands for a 1.
    fn split(&self, chance: u16) -> u32 {
        let range = u64::from(self.high - self.low);
        self.low + ((range * u64::from(chance)) >> 16) as u32
    }

    fn narrow(&mut self, split: u32, bit: bool) {
        if bit {
            self.high = split;
        } else {
            self.low = split + 1;
        }
    }

    /// Whether the first byte is decided; takes it out.
    fn shift(&mut self) -> Option<u8> {
        let first = (self.low >> 24) as u8;
        if first != (self.high >> 24) as u8 {
            return None;
        }
        self.low <<= 8;
        self.high = self.high << 8 | 0xff;
        Some(first)
    }
}

/// Writes decisions.
pub(super) struct Encoder {
    interval: Interval,
    bytes: Vec<u8>,
}

impl Encoder {
    pub(super) fn new() -> Self {
        Self {
            interval: Interval::ALL,
            bytes: Vec::new(),
        }
    }

    /// The stream: as few bytes as name a number of the last interval when zeros follow them.
    pub(super) fn finish(mut self) -> Vec<u8> {
        let Interval { low, high } = self.interval;
        for length in 0..=4u32 {
            let rest = (1u64 << (32 - 8 * length)) - 1;
            let number = (u64::from(low) + rest) & !rest;
            if number <= u64::from(high) {
                self.bytes.extend(&(number as u32).to_be_bytes()[..length as usize]);
                break;
            }
        }
        self.bytes
    }
}

impl Coder for Encoder {
    fn bit(&mut self, model: &mut Bit, bit: bool) -> Result<bool, DecodeError> {
        self.interval.narrow(self.interval.split(model.chance), bit);
        model.learn(bit);
        while let Some(byte) = self.interval.shift() {
            self.bytes.push(byte);
        }
        Ok(bit)
    }
}

/// Reads decisions.
pub(super) struct Decoder<'a> {
    interval: Interval,
    bytes: &'a [u8],
    /// The next four bytes.
    number: u32,
    /// How many bytes were taken, zeros behind the end included.
    taken: usize,
}

impl<'a> Decoder<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        let mut decoder = Self {
            interval: Interval::ALL,
            bytes,
            number: 0,
            taken: 0,
        };
        for _ in 0..4 {
            decoder.take();
        }
        decoder
    }

    fn take(&mut self) {
        let byte = self.bytes.get(self.taken).copied().unwrap_or(0);
        self.number = self.number << 8 | u32::from(byte);
        self.taken += 1;
    }

    /// The stream must end where its last decision does.
    pub(super) fn finish(self) -> Result<(), DecodeError> {
        if self.taken < self.bytes.len() {
            return Err(DecodeError::damaged("its stream goes on after its last decision"));
        }
        Ok(())
    }
}

impl Coder for Decoder<'_> {
    fn bit(&mut self, model: &mut Bit, _: bool) -> Result<bool, DecodeError> {
        let split = self.interval.split(model.chance);
        let bit = self.number <= split;
        self.interval.narrow(split, bit);
        model.learn(bit);
        while self.interval.shift().is_some() {
            self.take();
            if self.taken > self.bytes.len() + 4 {
                return Err(DecodeError::damaged("its stream ends early"));
            }
        }
        Ok(bit)
    }
}

/// Learns how large numbers are: their length in bits in unary, the two bits below the first, the rest as they are.
#[derive(Debug, Clone, Default)]
pub(super) struct Number {
    longer: [Bit; Self::LONGEST],
    leading: [[Bit; 3]; Self::LONGEST],
}

impl Number {
    /// Bits after the first one.
    const LONGEST: usize = 32;

    /// A number up to 2³² − 1.
    pub(super) fn code(&mut self, coder: &mut impl Coder, number: u64) -> Result<u64, DecodeError> {
        let given = number + 1;
        let mut bits = 0;
        while bits < Self::LONGEST && coder.bit(&mut self.longer[bits], given >> (bits + 1) > 0)? {
            bits += 1;
        }
        let mut found = 1u64;
        for at in (0..bits).rev() {
            let bit = given >> at & 1 == 1;
            let below = bits - 1 - at;
            let bit = if below < 2 {
                coder.bit(&mut self.leading[bits - 1][found as usize - 1], bit)?
            } else {
                coder.bit(&mut Bit::default(), bit)?
            };
            found = found << 1 | u64::from(bit);
        }
        let number = found - 1;
        if number > u64::from(u32::MAX) {
            return Err(DecodeError::damaged("a number has more than 32 bits"));
        }
        Ok(number)
    }
}

/// Learns which of 2ⁿ symbols is likely, first bit first.
#[derive(Debug, Clone)]
pub(super) struct Symbol<const COUNT: usize>([Bit; COUNT]);

impl<const COUNT: usize> Default for Symbol<COUNT> {
    fn default() -> Self {
        Self([Bit::default(); COUNT])
    }
}

impl<const COUNT: usize> Symbol<COUNT> {
    pub(super) fn code(&mut self, coder: &mut impl Coder, symbol: u8) -> Result<u8, DecodeError> {
        let mut node = 1;
        for at in (0..COUNT.ilog2()).rev() {
            let bit = coder.bit(&mut self.0[node], symbol >> at & 1 == 1)?;
            node = 2 * node + usize::from(bit);
        }
        Ok((node - COUNT) as u8)
    }
}

/// Learns how a small number changes from what it was.
#[derive(Debug, Clone, Default)]
pub(super) struct Change {
    changed: [Bit; 3],
    up: [Bit; 3],
    size: Number,
}

impl Change {
    /// What a number has become that was `before`, and which way that is: 0 none, 1 down, 2 up. `near` is the way that
    /// something related went.
    pub(super) fn code(
        &mut self,
        coder: &mut impl Coder,
        near: usize,
        before: i64,
        after: i64,
    ) -> Result<(i64, usize), DecodeError> {
        if !coder.bit(&mut self.changed[near], after != before)? {
            return Ok((before, 0));
        }
        let up = coder.bit(&mut self.up[near], after > before)?;
        let size = self
            .size
            .code(coder, (after - before).unsigned_abs().saturating_sub(1))? as i64
            + 1;
        Ok(if up { (before + size, 2) } else { (before - size, 1) })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn numbers_symbols_and_changes_are_read_as_they_were_written(
            given in prop::collection::vec((any::<u32>(), 0u32..33, any::<u8>(), 0usize..3, -9i64..9), 0..200),
        ) {
            let mut encoder = Encoder::new();
            let (mut number, mut symbol, mut change) = (Number::default(), Symbol::<256>::default(), Change::default());
            for (n, width, s, near, c) in &given {
                let n = u64::from(*n) >> (32 - width);
                number.code(&mut encoder, n).unwrap();
                symbol.code(&mut encoder, *s).unwrap();
                change.code(&mut encoder, *near, 3, 3 + c).unwrap();
            }
            let bytes = encoder.finish();
            let mut decoder = Decoder::new(&bytes);
            let (mut number, mut symbol, mut change) = (Number::default(), Symbol::<256>::default(), Change::default());
            for (n, width, s, near, c) in &given {
                let n = u64::from(*n) >> (32 - width);
                prop_assert_eq!(number.code(&mut decoder, 0).unwrap(), n);
                prop_assert_eq!(symbol.code(&mut decoder, 0).unwrap(), *s);
                prop_assert_eq!(change.code(&mut decoder, *near, 3, 0).unwrap().0, 3 + c);
            }
            decoder.finish().unwrap();
        }
    }

    #[test]
    fn what_nearly_always_happens_costs_nearly_nothing() {
        let mut encoder = Encoder::new();
        let mut bit = Bit::default();
        for i in 0..8000 {
            encoder.bit(&mut bit, i % 100 == 0).unwrap();
        }
        // The entropy of one in a hundred is 0.081 bits; 8,000 of them are 81 bytes.
        let bytes = encoder.finish().len();
        assert!((81..100).contains(&bytes), "{bytes} bytes");
    }

    #[test]
    fn an_endless_stream_ends() {
        let mut decoder = Decoder::new(&[0, 0]);
        let mut bit = Bit::default();
        let decisions = (0..100_000)
            .take_while(|_| decoder.bit(&mut bit, false).is_ok())
            .count();
        assert!(decisions < 89 * 8 * 6, "{decisions} decisions from two bytes");
    }
}
