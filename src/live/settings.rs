//! What can be set of live sessions?

use std::time::Duration;

use belvedere_live::{Ms, world::Rules};

/// Limits of live sessions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiveSettings {
    /// How many sessions may be open.
    pub sessions: usize,
    /// How many movers there may be, avatars not included.
    pub movers: usize,
    /// Time between ticks.
    pub tick: Duration,
    /// A session that is silent, and whose stream is not read, ends after this.
    pub lease: Duration,
}

impl Default for LiveSettings {
    fn default() -> Self {
        Self {
            sessions: 5_000,
            movers: 100_000,
            tick: Duration::from_millis(100),
            lease: Duration::from_secs(30),
        }
    }
}

impl LiveSettings {
    pub(super) fn rules(&self) -> Rules {
        Rules {
            tick_ms: self.tick.as_millis() as Ms,
            ..Rules::default()
        }
    }
}
