//! How much do lists take that are needed at once? Those that lie on the stack, and those that wait for what is computed beside
//! them. Each is counted whole wherever it is, so that it does not matter who shares it with whom; and what is done at one
//! go, which makes numbers only, leaves those alone that are there.

use super::{Evaluator, Outcome, Scope};
use crate::procedural::limits::{MAX_HELD, MAX_LIST, reached};
use crate::procedural::syntax::At;
use crate::procedural::value::Value;

/// What is done at one go holds less than this, one list at a time.
const ROOM: usize = 2 * MAX_LIST;

impl Evaluator<'_> {
    /// Counts what is held until it is [released](Self::release), or the call ends.
    pub(super) fn hold(&mut self, (module, at): (usize, At), numbers: usize) -> Outcome<()> {
        self.held = self.held.saturating_add(numbers);
        if self.held > MAX_HELD {
            return self.error(module, at, reached("numbers in lists at once", MAX_HELD as u64));
        }
        Ok(())
    }

    pub(super) fn release(&mut self, numbers: usize) {
        self.held -= numbers;
    }

    /// Whether nothing that is done at one go could hold too much.
    pub(super) fn has_room_for_lists(&self) -> bool {
        self.held + ROOM <= MAX_HELD
    }

    /// Makes a frame for so many values of a call.
    pub(super) fn open_frame(&mut self, base: usize, slots: u32) {
        let top = base + slots as usize;
        self.stack.resize(top, Value::NONE);
        self.listed.resize(top, 0);
    }

    /// Ends the frame of a call, with all that it held.
    pub(super) fn close_frame(&mut self, &Scope { base, held, .. }: &Scope) {
        self.stack.truncate(base);
        self.listed.truncate(base);
        self.held = held;
    }

    /// Puts a value into a place of a frame; `place` is where it is written. A list is counted there until another takes its
    /// place.
    pub(super) fn put(&mut self, at_of_frame: usize, value: Value, place: (usize, At)) -> Outcome<()> {
        let listed = value.listed();
        self.stack[at_of_frame] = value;
        if listed > 0 {
            let before = std::mem::replace(&mut self.listed[at_of_frame], listed as u32);
            self.release(before as usize);
            self.hold(place, listed)?;
        }
        Ok(())
    }
}
