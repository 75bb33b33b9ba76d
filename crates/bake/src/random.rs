//! Which number comes next where nobody chooses? That of SplitMix64 (Steele, Lea & Flood, "Fast splittable pseudorandom number
//! generators", 2014): the same after the same seed on every machine.

/// 2⁶⁴ over the golden ratio, odd: its multiples lie as evenly as can be.
pub(crate) const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// A number in which each bit depends on all bits of another.
#[inline]
pub(crate) fn mixed(bits: u64) -> u64 {
    let bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ bits >> 31
}

/// A stream of numbers.
#[derive(Debug, Clone)]
pub(crate) struct SplitMix64(u64);

impl SplitMix64 {
    /// The stream that begins with a seed.
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next of them.
    #[inline]
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(GOLDEN);
        mixed(self.0)
    }

    /// From 0 up to and excluding 1.
    #[inline]
    pub(crate) fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1u32 << 24) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_other_implementations() {
        let mut numbers = SplitMix64::new(1_234_567);
        let next: Vec<_> = std::iter::repeat_with(|| numbers.next()).take(5).collect();
        assert_eq!(
            next,
            [
                6_457_827_717_110_365_317,
                3_203_168_211_198_807_973,
                9_817_491_932_198_370_423,
                4_593_380_528_125_082_431,
                16_408_922_859_458_223_821
            ]
        );
    }

    #[test]
    fn parts_of_one_stay_below_it() {
        let mut numbers = SplitMix64::new(0);
        let units: Vec<_> = std::iter::repeat_with(|| numbers.unit()).take(10_000).collect();
        assert!(units.iter().all(|unit| (0.0..1.0).contains(unit)));
        let mean = units.iter().sum::<f32>() / units.len() as f32;
        assert!((mean - 0.5).abs() < 0.02, "{mean}");
    }
}
