//! How often may one ask? Whoever shows wrong keys has a pace, whoever has a right one another, and where the settings say
//! so every address has one for whatever is no immutable object that is there.

use std::{
    collections::BTreeMap,
    hash::Hash,
    net::IpAddr,
    num::NonZeroU32,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

use governor::{DefaultKeyedRateLimiter, NotUntil, Quota, RateLimiter, clock::Clock, clock::DefaultClock};
use tokio::sync::{Semaphore, SemaphorePermit};

use super::{error::ApiError, peer::Peer};

/// So many wrong keys of one address in a row, and so many a minute after that.
const WRONG_KEYS: (u32, u32) = (20, 10);
/// So many writing requests of one key in a row, and so many a minute after that.
const WRITES: (u32, u32) = (60, 60);
/// When more are counted, those that have been quiet are forgotten.
const MANY: usize = 10_000;
/// Between two times that these are looked for: each looks at all that are counted.
const SWEEPING: Duration = Duration::from_secs(1);
/// So many keys of addresses that have shown too many wrong ones are looked up at a time.
const DOUBTED: usize = 1;
/// So many of those that have shown no right one lately: however many a burst has, few are on their way when the first are told wrong.
const STRANGE: usize = 2;
/// An address is known for so long after a right key, until it shows a wrong one.
const KNOWN: Duration = Duration::from_secs(600);

/// Counts requests. Cheap to clone.
#[derive(Debug, Clone)]
pub struct Pace(Arc<Counts>);

#[derive(Debug)]
struct Counts {
    requests: Option<Limiter<IpAddr>>,
    wrong_keys: Limiter<IpAddr>,
    writes: Limiter<String>,
    /// Who has asked too often for objects that are not there.
    strayed: Held,
    /// Who has shown too many wrong keys.
    doubted: Held,
    doubts: Semaphore,
    /// Who has shown a right key lately, and no wrong one since.
    known: Held,
    strangers: Semaphore,
}

impl Pace {
    /// With so many requests a second for each address, twice as many in a row; 0 for any number.
    #[must_use]
    pub fn new(requests_per_s: u32) -> Self {
        let quota =
            |a_second: NonZeroU32| Quota::per_second(a_second).allow_burst(a_second.saturating_add(a_second.get()));
        Self(Arc::new(Counts {
            requests: NonZeroU32::new(requests_per_s).map(|a_second| Limiter::new(quota(a_second))),
            wrong_keys: Limiter::a_minute(WRONG_KEYS),
            writes: Limiter::a_minute(WRITES),
            strayed: Held::default(),
            doubted: Held::default(),
            doubts: Semaphore::new(DOUBTED),
            known: Held::default(),
            strangers: Semaphore::new(STRANGE),
        }))
    }

    /// Somebody asks for something.
    pub(super) fn request(&self, peer: &Peer) -> Result<(), ApiError> {
        match &self.0.requests {
            Some(requests) => {
                let checked = requests.check(&peer.household());
                checked.map_err(|wait| flooded("this address asks too often; nothing was done", wait))
            }
            None => Ok(()),
        }
    }

    /// Somebody asks for an object, which counts only if it is not there: then the store was asked in vain.
    pub(super) fn object(&self, peer: &Peer) -> Result<(), ApiError> {
        let wait = self.0.strayed.wait(&peer.household());
        wait.map_or(Ok(()), |wait| Err(flooded(STRAYED, wait)))
    }

    /// It was not there.
    pub(super) fn no_object(&self, peer: &Peer) {
        if let Some(requests) = &self.0.requests
            && let Err(wait) = requests.check(&peer.household())
        {
            self.0.strayed.hold(peer.household(), wait);
        }
    }

    /// Somebody has shown a wrong key.
    pub(super) fn wrong_key(&self, peer: &Peer) -> Result<(), ApiError> {
        self.0.known.release(&peer.household());
        let checked = self.0.wrong_keys.check(&peer.household());
        checked.map_err(|wait| {
            self.0.doubted.hold(peer.household(), wait);
            flooded("this address has shown too many wrong keys; nothing was done", wait)
        })
    }

    /// Somebody has shown a right key.
    pub(super) fn right_key(&self, peer: &Peer) {
        self.0.known.hold(peer.household(), KNOWN);
    }

    /// Whoever has shown no right key lately waits for its turn with the next one, until this is dropped, and longer whoever has
    /// shown too many wrong ones: a right one is taken as ever, and wrong ones keep the catalogue from nobody.
    pub(super) async fn turn(&self, peer: Option<&Peer>) -> Option<SemaphorePermit<'_>> {
        let household = peer?.household();
        if self.0.doubted.wait(&household).is_none() {
            if self.0.known.wait(&household).is_some() {
                return None;
            }
            let turn = self.0.strangers.acquire().await.ok();
            // Those of a burst that waited here, until it was known what the first ones are, go behind all strangers.
            if self.0.doubted.wait(&household).is_none() {
                return turn;
            }
        }
        self.0.doubts.acquire().await.ok()
    }

    /// The owner of a key wants to write.
    pub(super) fn write(&self, key_id: &str) -> Result<(), ApiError> {
        let checked = self.0.writes.check(&key_id.to_owned());
        checked.map_err(|wait| flooded("this key has been used too often in a row; nothing was done", wait))
    }
}

const STRAYED: &str = "this address asks too often for objects that are not there; nothing was done";

fn flooded(detail: &str, wait: Duration) -> ApiError {
    ApiError::Flooded {
        detail: detail.to_owned(),
        retry_s: wait.as_secs() + 1,
    }
}

/// Counts for each of many.
#[derive(Debug)]
struct Limiter<K: Hash + Eq + Clone> {
    limiter: DefaultKeyedRateLimiter<K>,
    sweeps: Sweeps,
}

impl<K: Hash + Eq + Clone> Limiter<K> {
    fn new(quota: Quota) -> Self {
        Self {
            limiter: RateLimiter::keyed(quota),
            sweeps: Sweeps::default(),
        }
    }

    fn a_minute((burst, a_minute): (u32, u32)) -> Self {
        let count = |n| NonZeroU32::new(n).expect("paces are constants above 0");
        Self::new(Quota::per_minute(count(a_minute)).allow_burst(count(burst)))
    }

    /// Counts one more, or says how long to wait.
    fn check(&self, who: &K) -> Result<(), Duration> {
        if self.limiter.len() > MANY && self.sweeps.are_due() {
            self.limiter.retain_recent();
        }
        let wait = |until: NotUntil<_>| until.wait_time_from(DefaultClock::default().now());
        self.limiter.check_key(who).map_err(wait)
    }
}

/// When to forget those that have been quiet.
#[derive(Debug)]
struct Sweeps {
    began: Instant,
    last_ms: AtomicU64,
}

impl Default for Sweeps {
    fn default() -> Self {
        Self {
            began: Instant::now(),
            last_ms: AtomicU64::new(0),
        }
    }
}

impl Sweeps {
    fn are_due(&self) -> bool {
        self.are_due_at(self.began.elapsed())
    }

    /// Whether it is time to, for one of all who ask at once.
    fn are_due_at(&self, age: Duration) -> bool {
        let (now_ms, pause_ms) = (age.as_millis() as u64, SWEEPING.as_millis() as u64);
        let last_ms = self.last_ms.load(Ordering::Relaxed);
        let due = now_ms >= last_ms + pause_ms;
        due && self
            .last_ms
            .compare_exchange(last_ms, now_ms, Ordering::Relaxed, Ordering::Relaxed)
            .is_ok()
    }
}

/// Of whom something holds, and until when.
#[derive(Debug, Default)]
struct Held {
    until: Mutex<BTreeMap<IpAddr, Instant>>,
    sweeps: Sweeps,
}

impl Held {
    fn hold(&self, who: IpAddr, wait: Duration) {
        let now = Instant::now();
        let mut until = self.until.lock().unwrap_or_else(PoisonError::into_inner);
        if until.len() > MANY && self.sweeps.are_due() {
            until.retain(|_, until| *until > now);
        }
        until.insert(who, now + wait);
    }

    fn release(&self, who: &IpAddr) {
        let mut until = self.until.lock().unwrap_or_else(PoisonError::into_inner);
        until.remove(who);
    }

    /// How long it must wait still.
    fn wait(&self, who: &IpAddr) -> Option<Duration> {
        let mut until = self.until.lock().unwrap_or_else(PoisonError::into_inner);
        let wait = until.get(who)?.checked_duration_since(Instant::now());
        if wait.is_none() {
            until.remove(who);
        }
        wait
    }
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

    fn peer(address: &str) -> Peer {
        Peer::new(
            format!("{address}:1").parse().unwrap(),
            super::super::peer::Requests::default(),
        )
    }

    /// The turn, if that can be had at once.
    async fn at_once<'a>(pace: &'a Pace, peer: &Peer) -> Option<Option<SemaphorePermit<'a>>> {
        tokio::time::timeout(Duration::ZERO, pace.turn(Some(peer))).await.ok()
    }

    #[tokio::test]
    async fn of_a_burst_of_keys_few_are_looked_up_together_and_a_right_one_is_remembered() {
        let (pace, burst, owner) = (Pace::new(0), peer("10.0.0.1"), peer("10.0.0.2"));
        pace.right_key(&owner);
        let turns = [at_once(&pace, &burst).await, at_once(&pace, &burst).await];
        assert!(turns.iter().all(|turn| matches!(turn, Some(Some(_)))));
        assert!(at_once(&pace, &burst).await.is_none(), "so many are on their way");
        assert!(matches!(at_once(&pace, &owner).await, Some(None)));
        pace.wrong_key(&owner).unwrap();
        assert!(at_once(&pace, &owner).await.is_none(), "it is one of many again");
        drop(turns);
        assert!(matches!(at_once(&pace, &owner).await, Some(Some(_))));
    }

    #[tokio::test]
    async fn what_is_left_of_a_burst_of_wrong_keys_waits_behind_strangers() {
        let (pace, burst, stranger) = (Pace::new(0), peer("10.0.0.1"), peer("10.0.0.2"));
        let turns = [at_once(&pace, &burst).await, at_once(&pace, &burst).await];
        let mut third = std::pin::pin!(pace.turn(Some(&burst)));
        assert!(tokio::time::timeout(Duration::ZERO, third.as_mut()).await.is_err());
        while pace.wrong_key(&burst).is_ok() {}
        drop(turns);
        let doubted = tokio::time::timeout(Duration::ZERO, third.as_mut()).await;
        assert!(matches!(doubted, Ok(Some(_))));
        assert!(at_once(&pace, &burst).await.is_none(), "one at a time");
        let strangers = [at_once(&pace, &stranger).await, at_once(&pace, &stranger).await];
        assert!(strangers.iter().all(|turn| matches!(turn, Some(Some(_)))));
    }

    #[test]
    fn those_who_have_been_quiet_are_looked_for_once_a_second_however_many_ask() {
        let sweeps = Sweeps::default();
        let swept = |age_ms| sweeps.are_due_at(Duration::from_millis(age_ms));
        let due: Vec<_> = (0..5000).filter(|age_ms| swept(*age_ms)).collect();
        assert_eq!(due, [1000, 2000, 3000, 4000]);
        assert!(!swept(10), "a clock that is read late");
    }

    #[test]
    fn who_is_held_waits_until_its_time_is_over() {
        let held = Held::default();
        let [one, other] = ["10.0.0.1", "10.0.0.2"].map(|address| address.parse().unwrap());
        held.hold(one, Duration::from_secs(3600));
        assert!(held.wait(&one).is_some() && held.wait(&other).is_none());
        held.hold(one, Duration::ZERO);
        assert!(held.wait(&one).is_none());
        assert!(held.until.lock().unwrap().is_empty());
    }
}
