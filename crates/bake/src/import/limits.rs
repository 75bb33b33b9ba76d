//! How much may a source claim? Every decoded array is claimed here before it is allocated.

use std::cell::Cell;
use std::rc::Rc;

use super::ImportError;

/// What a source may cost.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Limits {
    /// Memory for everything that is decoded from the source, added up, bytes.
    pub memory_bytes: u64,
    /// Placed objects, instances included.
    pub max_objects: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            memory_bytes: 4 << 30,
            max_objects: 1_000_000,
        }
    }
}

/// Adds up claims; clones add to the same sum. Claims are never given back: the sum bounds the work of an import as well as
/// its memory.
#[derive(Debug, Clone)]
pub(super) struct Budget {
    limit_bytes: u64,
    claimed_bytes: Rc<Cell<u64>>,
    held_shapes: Rc<Cell<usize>>,
}

impl Budget {
    pub(super) fn new(limits: &Limits) -> Self {
        Self {
            limit_bytes: limits.memory_bytes,
            claimed_bytes: Rc::default(),
            held_shapes: Rc::default(),
        }
    }

    /// Claims room for `count` things of `size_bytes`.
    pub(super) fn claim(
        &self,
        count: usize,
        size_bytes: usize,
        place: impl FnOnce() -> String,
    ) -> Result<(), ImportError> {
        let claimed_bytes = (count as u64)
            .saturating_mul(size_bytes as u64)
            .saturating_add(self.claimed_bytes.get());
        if claimed_bytes > self.limit_bytes {
            return Err(ImportError::Memory {
                place: place(),
                claimed_bytes,
                limit_bytes: self.limit_bytes,
            });
        }
        self.claimed_bytes.set(claimed_bytes);
        Ok(())
    }

    /// Counts shapes of poses that are held together.
    pub(super) fn hold(&self, shapes: usize) {
        self.held_shapes.set(self.held_shapes() + shapes);
    }

    /// How many of these there are so far.
    pub(super) fn held_shapes(&self) -> usize {
        self.held_shapes.get()
    }

    /// What can be claimed in all.
    pub(super) fn limit_bytes(&self) -> u64 {
        self.limit_bytes
    }

    /// What can still be claimed.
    pub(super) fn left_bytes(&self) -> u64 {
        self.limit_bytes - self.claimed_bytes.get()
    }

    /// The refusal of something that is larger than what is left.
    pub(super) fn refusal(&self, place: String, wanted_bytes: u64) -> ImportError {
        ImportError::Memory {
            place,
            claimed_bytes: self.claimed_bytes.get().saturating_add(wanted_bytes),
            limit_bytes: self.limit_bytes,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn claims_add_up_to_the_limit_and_no_further() {
        let budget = Budget::new(&Limits {
            memory_bytes: 100,
            max_objects: 1,
        });
        budget.claim(10, 6, || "a".into()).unwrap();
        let refused = budget.claim(41, 1, || "b".into()).unwrap_err().to_string();
        assert!(
            refused.contains("b: needs 101 bytes") && refused.contains("limit is 100"),
            "{refused}"
        );
        budget.claim(40, 1, || "c".into()).unwrap();
        assert_eq!(budget.left_bytes(), 0);
        assert!(budget.claim(usize::MAX, usize::MAX, || "d".into()).is_err());
    }
}
