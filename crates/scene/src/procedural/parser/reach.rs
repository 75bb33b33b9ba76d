//! Which values are in reach, and where do they lie? Finding one takes as long however many there are.

use std::collections::HashMap;

/// Values in reach: each has the slot after the one before.
#[derive(Default)]
pub(super) struct Reach<'t> {
    names: Vec<&'t str>,
    /// The slots of all values of a name, the nearest last.
    slots: HashMap<&'t str, Vec<u32>>,
}

impl<'t> Reach<'t> {
    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.names.len()
    }

    /// Brings one more into reach.
    pub(super) fn push(&mut self, name: &'t str) -> u32 {
        let slot = self.names.len() as u32;
        self.names.push(name);
        self.slots.entry(name).or_default().push(slot);
        slot
    }

    /// Leaves only the first ones in reach.
    pub(super) fn truncate(&mut self, length: usize) {
        for name in self.names.drain(length..) {
            if let Some(slots) = self.slots.get_mut(name) {
                slots.pop();
            }
        }
    }

    /// The name of the value that came into reach last.
    pub(super) fn last(&self) -> Option<&'t str> {
        self.names.last().copied()
    }

    /// The slot of the nearest value of that name.
    pub(super) fn slot_of(&self, name: &str) -> Option<u32> {
        self.slots.get(name)?.last().copied()
    }
}
