//! What can be set of live sessions, and what does it come to?

use std::time::Duration;

use clap::Args;
use serde::Deserialize;

use super::{ConfigError, usable::within};
use crate::live::LiveSettings;

/// Settings of live sessions.
#[derive(Debug, Clone, Default, PartialEq, Args, Deserialize)]
pub struct LiveArgs {
    /// How many live sessions may be open [default: 5000]
    #[arg(long, value_name = "N", env = "BELVEDERE_MAX_SESSIONS")]
    pub max_sessions: Option<usize>,
    /// How many of them one address may open; as many as all where a proxy stands in front [default: half of all]
    #[arg(long, value_name = "N", env = "BELVEDERE_MAX_SESSIONS_PER_ADDRESS")]
    pub max_sessions_per_address: Option<usize>,
    /// How many program-driven movers there may be [default: 100000]
    #[arg(long, value_name = "N", env = "BELVEDERE_MAX_MOVERS")]
    pub max_movers: Option<usize>,
    /// How many of them may outlive the server [default: 1000]
    #[arg(long, value_name = "N", env = "BELVEDERE_MAX_PERSISTENT")]
    pub max_persistent: Option<usize>,
    /// Which share of them, and of those that outlive the server, one address may make, in percent; all where a proxy stands in
    /// front [default: 50]
    #[arg(long, value_name = "PERCENT", env = "BELVEDERE_MAX_MOVERS_PER_ADDRESS_PERCENT")]
    pub max_movers_per_address_percent: Option<u64>,
    /// Only who shows this token makes movers that outlive the server, and may delete any mover; 32 hex digits, as
    /// `openssl rand -hex 16` prints [default: everybody makes them]
    #[arg(long, value_name = "TOKEN", env = "BELVEDERE_OPERATOR_TOKEN", hide_env_values = true)]
    pub operator_token: Option<String>,
    /// A mover that does not outlive the server ends when its sender is silent for longer, in seconds [default: 3600]
    #[arg(long, value_name = "S", env = "BELVEDERE_MOVER_LEASE_S")]
    pub mover_lease_s: Option<u64>,
    /// In a crowd, who is visible to a smaller share is not told of, in percent [default: 0]
    #[arg(long, value_name = "PERCENT", env = "BELVEDERE_CULL_BELOW_PERCENT")]
    pub cull_below_percent: Option<u64>,
    /// Time between ticks of live sessions, in milliseconds [default: 100]
    #[arg(long, value_name = "MS", env = "BELVEDERE_TICK_MS")]
    pub tick_ms: Option<u64>,
    /// How many bytes a second of poses a live session is told at most [default: 64000]
    #[arg(long, value_name = "BYTES", env = "BELVEDERE_SESSION_BYTES_PER_S")]
    pub session_bytes_per_s: Option<u64>,
    /// A live session that is silent for longer ends, in seconds [default: 30]
    #[arg(long, value_name = "S", env = "BELVEDERE_LEASE_S")]
    pub lease_s: Option<u64>,
}

impl LiveArgs {
    pub(super) fn or(self, fallback: Self) -> Self {
        Self {
            max_sessions: self.max_sessions.or(fallback.max_sessions),
            max_sessions_per_address: self.max_sessions_per_address.or(fallback.max_sessions_per_address),
            max_movers: self.max_movers.or(fallback.max_movers),
            max_persistent: self.max_persistent.or(fallback.max_persistent),
            max_movers_per_address_percent: self
                .max_movers_per_address_percent
                .or(fallback.max_movers_per_address_percent),
            operator_token: self.operator_token.or(fallback.operator_token),
            mover_lease_s: self.mover_lease_s.or(fallback.mover_lease_s),
            cull_below_percent: self.cull_below_percent.or(fallback.cull_below_percent),
            tick_ms: self.tick_ms.or(fallback.tick_ms),
            session_bytes_per_s: self.session_bytes_per_s.or(fallback.session_bytes_per_s),
            lease_s: self.lease_s.or(fallback.lease_s),
        }
    }
}

impl TryFrom<LiveArgs> for LiveSettings {
    type Error = ConfigError;

    fn try_from(args: LiveArgs) -> Result<Self, ConfigError> {
        let unset = Self::default();
        let sessions = args.max_sessions.unwrap_or(unset.sessions) as u64;
        let of_an_address = args
            .max_sessions_per_address
            .map_or(sessions.div_ceil(2), |most| most as u64);
        let movers = args.max_movers.unwrap_or(unset.movers) as u64;
        let percent = args
            .max_movers_per_address_percent
            .unwrap_or(unset.movers_of_an_address_percent.into());
        let persistent = args.max_persistent.unwrap_or(unset.persistent) as u64;
        let mover_lease_s = args.mover_lease_s.unwrap_or(unset.mover_lease.as_secs());
        let cull_below_percent = args.cull_below_percent.unwrap_or(unset.cull_below_percent.into());
        let tick_ms = args.tick_ms.unwrap_or(unset.tick.as_millis() as u64);
        let bytes_per_s = args.session_bytes_per_s.unwrap_or(unset.session_bytes_per_s);
        let lease_s = args.lease_s.unwrap_or(unset.lease.as_secs());
        Ok(Self {
            sessions: within("max_sessions", sessions, 0, 1_000_000)? as usize,
            sessions_of_an_address: within("max_sessions_per_address", of_an_address, 0, 1_000_000)? as usize,
            movers: within("max_movers", movers, 0, 10_000_000)? as usize,
            persistent: within("max_persistent", persistent, 0, 10_000_000)? as usize,
            movers_of_an_address_percent: within("max_movers_per_address_percent", percent, 0, 100)? as u8,
            operator: args.operator_token.map(|token| token.parse()).transpose()?,
            mover_lease: Duration::from_secs(within("mover_lease_s", mover_lease_s, 1, 10_000_000)?),
            cull_below_percent: within("cull_below_percent", cull_below_percent, 0, 50)? as u8,
            tick: Duration::from_millis(within("tick_ms", tick_ms, 1, 1_000)?),
            session_bytes_per_s: within("session_bytes_per_s", bytes_per_s, 1_000, 1_000_000_000)?,
            lease: Duration::from_secs(within("lease_s", lease_s, 1, 3_600)?),
        })
    }
}
