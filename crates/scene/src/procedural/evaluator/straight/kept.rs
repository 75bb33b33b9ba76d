//! What stays known of a program when a model has grown? Its plans: they depend on the text alone, so that what grows next of the
//! same program, another level of detail or another part, finds them made.

use std::sync::Mutex;

use super::{Planning, Plans};

/// Plans that nobody uses now; nothing when none were made, or another thread has them.
#[derive(Debug, Default)]
pub(in crate::procedural) struct Kept(Mutex<Option<Plans>>);

impl Clone for Kept {
    /// A program that is read or copied has none yet.
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl Kept {
    pub(in crate::procedural::evaluator) fn take(&self) -> Option<Plans> {
        self.0.lock().ok()?.take()
    }

    /// Keeps them without the room in which they were computed. What something was amiss with may be sound the next time, which may
    /// take as much planning again.
    pub(in crate::procedural::evaluator) fn put(&self, mut plans: Plans) {
        plans.room = None;
        plans.work = 0;
        for planning in plans.of.iter_mut().flatten() {
            if matches!(planning, Planning::Amiss) {
                *planning = Planning::Untried;
            }
        }
        if let Ok(mut kept) = self.0.lock() {
            *kept = Some(plans);
        }
    }
}
