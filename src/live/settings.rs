//! What can be set of live sessions?

use std::time::Duration;

use belvedere_live::{Ms, crowd::Crowding, world::Rules};

use super::Token;

/// Limits of live sessions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiveSettings {
    /// How many sessions may be open.
    pub sessions: usize,
    /// How many of them one address may open.
    pub sessions_of_an_address: usize,
    /// How many movers there may be, avatars not included.
    pub movers: usize,
    /// How many of these may outlive the server.
    pub persistent: usize,
    /// Which share of either one address may make.
    pub movers_of_an_address_percent: u8,
    /// Whose token makes movers that outlive the server; without one anybody may.
    pub operator: Option<Token>,
    /// A mover that does not outlive the server, and of which its sender says nothing, ends after this.
    pub mover_lease: Duration,
    /// Of whom less is visible in a crowd is not told of.
    pub cull_below_percent: u8,
    /// Time between ticks.
    pub tick: Duration,
    /// So many bytes of poses a session is told a second.
    pub session_bytes_per_s: u64,
    /// A session that is silent, and whose stream is not read, ends after this.
    pub lease: Duration,
}

impl Default for LiveSettings {
    fn default() -> Self {
        Self {
            sessions: 5_000,
            sessions_of_an_address: 2_500,
            movers: 100_000,
            persistent: 1_000,
            movers_of_an_address_percent: 50,
            operator: None,
            mover_lease: Duration::from_secs(3_600),
            cull_below_percent: 0,
            tick: Duration::from_millis(100),
            session_bytes_per_s: 64_000,
            lease: Duration::from_secs(30),
        }
    }
}

impl LiveSettings {
    pub(super) fn rules(&self) -> Rules {
        Rules {
            tick_ms: self.tick.as_millis() as Ms,
            bytes_per_s: self.session_bytes_per_s as f64,
            crowd: Some(Crowding {
                cull_below: f64::from(self.cull_below_percent) * 0.01,
                ..Crowding::default()
            }),
            ..Rules::default()
        }
    }
}
