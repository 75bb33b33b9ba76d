//! Is this what it was before? SHA-256 over numbers, each written in one width and order, so that equal inputs have equal
//! digests on every machine.

use std::fmt;

use glam::Vec3;
use sha2::{Digest as _, Sha256};

/// A digest of some input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Digest(pub [u8; 32]);

impl Digest {
    /// Its first eight bytes, where a random stream may start.
    pub(crate) fn number(&self) -> u64 {
        let mut first = [0; 8];
        first.copy_from_slice(&self.0[..8]);
        u64::from_le_bytes(first)
    }
}

impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

/// Takes an input piece by piece. Lists of unknown length are preceded by it.
#[derive(Clone, Default)]
pub(crate) struct Digester(Sha256);

impl Digester {
    pub(crate) fn finish(self) -> Digest {
        Digest(self.0.finalize().into())
    }

    pub(crate) fn add(&mut self, part: Digest) -> &mut Self {
        self.0.update(part.0);
        self
    }

    pub(crate) fn text(&mut self, text: &str) -> &mut Self {
        self.count(text.len()).0.update(text);
        self
    }

    pub(crate) fn count(&mut self, count: usize) -> &mut Self {
        self.0.update((count as u64).to_le_bytes());
        self
    }

    pub(crate) fn flag(&mut self, flag: bool) -> &mut Self {
        self.0.update([u8::from(flag)]);
        self
    }

    pub(crate) fn floats(&mut self, numbers: &[f32]) -> &mut Self {
        for number in numbers {
            self.0.update(number.to_le_bytes());
        }
        self
    }

    pub(crate) fn doubles(&mut self, numbers: &[f64]) -> &mut Self {
        for number in numbers {
            self.0.update(number.to_le_bytes());
        }
        self
    }

    pub(crate) fn point(&mut self, point: Vec3) -> &mut Self {
        self.floats(&point.to_array())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(feed: impl Fn(&mut Digester)) -> Digest {
        let mut digester = Digester::default();
        feed(&mut digester);
        digester.finish()
    }

    #[test]
    fn equal_inputs_have_equal_digests_and_others_do_not() {
        let ab = of(|d| {
            d.text("ab").text("c");
        });
        assert_eq!(ab, of(|d| _ = d.text("ab").text("c")));
        assert_ne!(ab, of(|d| _ = d.text("a").text("bc")));
        assert_ne!(of(|d| _ = d.floats(&[0.0])), of(|d| _ = d.floats(&[-0.0])));
    }
}
