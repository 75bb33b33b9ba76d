//! What waits until nothing else is to be told? Infos of what does not move: they are many, and go on waiting where people do not.
//!
//! They fill what is left of a piece once the rules have told of everybody in sight. Where that never comes, one of them goes with each
//! so many pieces all the same: nothing waits for ever.

use std::collections::VecDeque;

use super::Said;

/// So many pieces in a row may go without one of them.
const MOST_PASSED: u32 = 8;

#[derive(Debug, Default)]
pub(super) struct Aside {
    waiting: VecDeque<Said>,
    bytes: usize,
    /// Nobody waits who comes first.
    free: bool,
    /// Pieces since the last one that held some of it.
    passed: u32,
}

impl Aside {
    pub(super) fn push(&mut self, said: Said) {
        self.bytes += said.data.len();
        self.waiting.push_back(said);
    }

    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }

    pub(super) fn let_go(&mut self, free: bool) {
        self.free = free;
    }

    /// Whether some of it is to be told even if nothing else is.
    pub(super) fn goes(&self) -> bool {
        self.free && !self.waiting.is_empty()
    }

    /// A piece is about to be made.
    pub(super) fn pass_over(&mut self) {
        self.passed += u32::from(!self.waiting.is_empty());
    }

    /// What goes with the piece, in which there is room or not.
    pub(super) fn next(&mut self, room: bool) -> Option<Said> {
        let waits_long = self.passed > MOST_PASSED;
        let said = self.waiting.pop_front_if(|_| self.free && room || waits_long)?;
        self.bytes -= said.data.len();
        self.passed = 0;
        if self.waiting.is_empty() {
            self.waiting = VecDeque::new();
        }
        Some(said)
    }

    /// Nothing of what waits is true any more.
    pub(super) fn revoke(&mut self) {
        *self = Self {
            free: self.free,
            ..Self::default()
        };
    }

    /// What was told before is void, and others come first again.
    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }
}
