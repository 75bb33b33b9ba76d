//! What time is it? One clock for all scenes.

use std::time::Instant;

use belvedere_live::Ms;

use crate::epoch::since_1970;

/// Unix time that never jumps.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clock {
    start: Instant,
    start_ms: Ms,
}

impl Clock {
    pub(super) fn start() -> Self {
        Self {
            start: Instant::now(),
            start_ms: since_1970().as_millis() as Ms,
        }
    }

    pub(super) fn now_ms(&self) -> Ms {
        self.start_ms + self.start.elapsed().as_millis() as Ms
    }
}
