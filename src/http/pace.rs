//! How often may one ask? Whoever shows wrong keys has a pace, whoever has a right one another, and where the settings say
//! so every address has one for whatever is no immutable object.

use std::{hash::Hash, net::IpAddr, num::NonZeroU32, sync::Arc};

use governor::{DefaultKeyedRateLimiter, Quota, RateLimiter, clock::Clock, clock::DefaultClock};

use super::{error::ApiError, peer::Peer};

/// So many wrong keys of one address in a row, and so many a minute after that.
const WRONG_KEYS: (u32, u32) = (20, 10);
/// So many writing requests of one key in a row, and so many a minute after that.
const WRITES: (u32, u32) = (60, 60);
/// When more are counted, those that have been quiet are forgotten.
const MANY: usize = 10_000;

/// Counts requests. Cheap to clone.
#[derive(Debug, Clone)]
pub struct Pace {
    requests: Option<Arc<DefaultKeyedRateLimiter<IpAddr>>>,
    wrong_keys: Arc<DefaultKeyedRateLimiter<IpAddr>>,
    writes: Arc<DefaultKeyedRateLimiter<String>>,
}

impl Pace {
    /// With so many requests a second for each address, twice as many in a row; 0 for any number.
    #[must_use]
    pub fn new(requests_per_s: u32) -> Self {
        let quota =
            |a_second: NonZeroU32| Quota::per_second(a_second).allow_burst(a_second.saturating_add(a_second.get()));
        Self {
            requests: NonZeroU32::new(requests_per_s).map(|a_second| Arc::new(RateLimiter::keyed(quota(a_second)))),
            wrong_keys: Arc::new(limiter(WRONG_KEYS)),
            writes: Arc::new(limiter(WRITES)),
        }
    }

    /// Somebody asks for something.
    pub(super) fn request(&self, peer: &Peer) -> Result<(), ApiError> {
        match &self.requests {
            Some(requests) => check(requests, &peer.household(), "this address asks too often"),
            None => Ok(()),
        }
    }

    /// Somebody has shown a wrong key.
    pub(super) fn wrong_key(&self, peer: &Peer) -> Result<(), ApiError> {
        check(
            &self.wrong_keys,
            &peer.household(),
            "this address has shown too many wrong keys",
        )
    }

    /// The owner of a key wants to write.
    pub(super) fn write(&self, key_id: &str) -> Result<(), ApiError> {
        check(
            &self.writes,
            &key_id.to_owned(),
            "this key has been used too often in a row",
        )
    }
}

fn limiter<K: Hash + Eq + Clone>((burst, a_minute): (u32, u32)) -> DefaultKeyedRateLimiter<K> {
    let count = |n| NonZeroU32::new(n).expect("paces are constants above 0");
    RateLimiter::keyed(Quota::per_minute(count(a_minute)).allow_burst(count(burst)))
}

fn check<K: Hash + Eq + Clone>(limiter: &DefaultKeyedRateLimiter<K>, who: &K, what: &str) -> Result<(), ApiError> {
    if limiter.len() > MANY {
        limiter.retain_recent();
    }
    limiter.check_key(who).map_err(|until| {
        let wait = until.wait_time_from(DefaultClock::default().now());
        ApiError::Flooded {
            detail: format!("{what}; nothing was done"),
            retry_s: wait.as_secs() + 1,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_that_is_used_too_often_must_wait_and_no_other_one() {
        let pace = Pace::new(0);
        for _ in 0..WRITES.0 {
            pace.write("a").unwrap();
        }
        let Err(ApiError::Flooded { retry_s, .. }) = pace.write("a") else {
            panic!("it was let through");
        };
        assert!((1..=60).contains(&retry_s), "{retry_s}");
        pace.write("b").unwrap();
    }
}
