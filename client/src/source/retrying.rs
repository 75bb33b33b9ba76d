//! When is a request worth another try? When it failed for a reason that may pass; each try waits twice as long as the one
//! before, more or less, so that clients that failed together do not come back together. What came damaged is asked for once
//! more, at once and past all caches: a copy may be damaged, and what is published damaged stays so. Where one file after the other
//! cannot be had, each is asked for once, until one comes: who walks through a broken tree need not wait for it.

use std::{
    collections::HashSet,
    future::Future,
    hash::{BuildHasher, Hash, RandomState},
    ops::Range,
    sync::{Arc, Mutex},
    time::Duration,
};

use belvedere_scene::BlobName;
use bytes::Bytes;

use super::{ByteSource, Watch, unwatched};
use crate::{Error, scene::as_promised};

/// Tries of one request, the first included.
const TRIES: u32 = 5;
/// Before the second try, on average.
const FIRST_WAIT: Duration = Duration::from_millis(250);
/// When so many files in a row could not be had, the next is no better for being asked for again.
const HOPELESS: usize = 4;

/// A source that is asked again where that may help.
#[derive(Debug, Clone)]
pub struct Retrying<S> {
    source: S,
    /// Files that could not be had since the last one that came.
    lost: Arc<Mutex<HashSet<String>>>,
}

impl<S> Retrying<S> {
    /// Asks this source, up to five times within about four seconds.
    #[must_use]
    pub fn new(source: S) -> Self {
        Self {
            source,
            lost: Arc::default(),
        }
    }

    /// How often the next request may be tried.
    fn tries(&self) -> u32 {
        let lost = self.lost.lock().expect("nothing panics while it holds this lock");
        if lost.len() >= HOPELESS { 1 } else { TRIES }
    }

    /// Takes note of what became of a request. An answer that there is nothing came at once, and says nothing of others.
    fn note<T>(&self, path: &str, answer: Result<T, Error>) -> Result<T, Error> {
        let mut lost = self.lost.lock().expect("nothing panics while it holds this lock");
        match &answer {
            Ok(_) => lost.clear(),
            Err(cause) if cause.is_transient() && lost.len() < HOPELESS => _ = lost.insert(path.to_owned()),
            Err(_) => {}
        }
        answer
    }
}

impl<S: ByteSource> Retrying<S> {
    /// All that is at a path; `fresh` when copies on the way are not believed from the start.
    async fn whole(&self, path: &str, mut fresh: bool, watch: &mut Watch<'_>) -> Result<(Bytes, u64), Error> {
        // Other paths than those of immutable objects promise nothing.
        let promised = BlobName::from_url(path);
        let (tries, mut tried) = (self.tries(), 0);
        loop {
            let answer = match fresh {
                true => self.source.get_fresh(path).await.inspect(|(bytes, _)| watch(bytes)),
                false => self.source.get_watched(path, watch).await,
            };
            let answer = answer.and_then(|(bytes, carried)| match &promised {
                Ok(name) => Ok((as_promised(name, bytes)?, carried)),
                Err(_) => Ok((bytes, carried)),
            });
            tried += 1;
            match answer {
                Err(cause) if cause.is_damage() && !fresh && tried < tries => fresh = true,
                Err(cause) if cause.is_damage() => return self.note(path, Err(cause)),
                Err(cause) if cause.is_transient() && tried < tries => tokio::time::sleep(wait(path, tried)).await,
                answer => return self.note(path, answer),
            }
        }
    }
}

impl<S: ByteSource> ByteSource for Retrying<S> {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        Ok(self.get_carried(path).await?.0)
    }

    async fn get_carried(&self, path: &str) -> Result<(Bytes, u64), Error> {
        self.whole(path, false, &mut unwatched).await
    }

    /// Each try begins anew.
    async fn get_watched(&self, path: &str, watch: &mut Watch<'_>) -> Result<(Bytes, u64), Error> {
        self.whole(path, false, watch).await
    }

    async fn get_fresh(&self, path: &str) -> Result<(Bytes, u64), Error> {
        self.whole(path, true, &mut unwatched).await
    }

    async fn get_range(&self, path: &str, range: Range<u64>) -> Result<(Bytes, u64), Error> {
        let (tries, mut tried) = (self.tries(), 0);
        loop {
            let answer = self.source.get_range(path, range.clone()).await;
            tried += 1;
            match answer {
                Err(cause) if cause.is_transient() && tried < tries => tokio::time::sleep(wait(path, tried)).await,
                answer => return self.note(path, answer),
            }
        }
    }

    fn offers_bundles(&self) -> bool {
        self.source.offers_bundles()
    }

    fn keep(&self, path: &str, bytes: &Bytes) -> impl Future<Output = ()> + Send {
        self.source.keep(path, bytes)
    }
}

/// How long to wait after so many tries: between half and one and a half of what they have on average.
fn wait(path: &str, tried: u32) -> Duration {
    about(FIRST_WAIT * (1 << (tried - 1)), (path, tried))
}

/// Between half and one and a half of a time, each time another.
pub(crate) fn about(mean: Duration, what: impl Hash) -> Duration {
    // Keys of this map are as random as anything in the standard library.
    let share = RandomState::new().hash_one(what) as f64 / u64::MAX as f64;
    mean.mul_f64(0.5 + share)
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU32, Ordering};

    use super::*;
    use crate::testing::silence;

    /// Fails so many times, each in its own way, then answers.
    struct Shaky {
        failures: u32,
        asked: AtomicU32,
        asked_fresh: AtomicU32,
        failure: fn(&str) -> Result<Bytes, Error>,
    }

    impl ByteSource for Shaky {
        async fn get(&self, path: &str) -> Result<Bytes, Error> {
            if self.asked.fetch_add(1, Ordering::Relaxed) < self.failures {
                (self.failure)(path)
            } else {
                Ok(Bytes::from_static(b"right"))
            }
        }

        async fn get_fresh(&self, path: &str) -> Result<(Bytes, u64), Error> {
            self.asked_fresh.fetch_add(1, Ordering::Relaxed);
            self.get_carried(path).await
        }
    }

    fn shaky(failures: u32, failure: fn(&str) -> Result<Bytes, Error>) -> Retrying<Shaky> {
        Retrying::new(Shaky {
            failures,
            asked: AtomicU32::new(0),
            asked_fresh: AtomicU32::new(0),
            failure,
        })
    }

    fn away(path: &str) -> Result<Bytes, Error> {
        Err(silence(path))
    }

    #[tokio::test(start_paused = true)]
    async fn what_may_pass_is_asked_again() {
        let name = BlobName::of(b"right", "cell").unwrap().url();
        let source = shaky(TRIES - 1, away);
        assert_eq!(source.get(&name).await.unwrap(), Bytes::from_static(b"right"));
        let source = shaky(TRIES, away);
        assert!(source.get(&name).await.unwrap_err().is_transient());
        assert_eq!(source.source.asked.load(Ordering::Relaxed), TRIES);
    }

    #[tokio::test(start_paused = true)]
    async fn what_came_damaged_is_asked_for_once_more_past_all_caches() {
        let name = BlobName::of(b"right", "cell").unwrap().url();
        let damaged = |_: &str| Ok(Bytes::from_static(b"wrong"));
        let begun = tokio::time::Instant::now();
        for (failures, comes) in [(1, true), (2, false)] {
            let source = shaky(failures, damaged);
            assert_eq!(source.get(&name).await.is_ok(), comes);
            let asked = [&source.source.asked, &source.source.asked_fresh].map(|asked| asked.load(Ordering::Relaxed));
            assert_eq!(asked, [2, 1]);
        }
        assert_eq!(begun.elapsed(), Duration::ZERO);
    }

    #[tokio::test(start_paused = true)]
    async fn who_asks_past_all_caches_is_answered_so() {
        let source = shaky(1, away);
        assert_eq!(source.get_fresh("/v1/scenes/town/index.json").await.unwrap().1, 5);
        let asked = [&source.source.asked, &source.source.asked_fresh].map(|asked| asked.load(Ordering::Relaxed));
        assert_eq!(asked, [2, 2]);
    }

    #[tokio::test(start_paused = true)]
    async fn where_nothing_comes_each_file_is_asked_for_once_until_one_does() {
        let files = HOPELESS as u32;
        let source = shaky(TRIES * files + 2, away);
        let mut asked = 0;
        let mut tries = async |path: &str| {
            let came = source.get(path).await.is_ok();
            let before = std::mem::replace(&mut asked, source.source.asked.load(Ordering::Relaxed));
            (came, asked - before)
        };
        for file in 0..files {
            assert_eq!(tries(&format!("/o/{file}")).await, (false, TRIES));
        }
        assert_eq!(tries("/o/next").await, (false, 1));
        assert_eq!(tries("/o/one-more").await, (false, 1));
        assert_eq!(tries("/o/right").await, (true, 1));
        assert_eq!(source.tries(), TRIES);
    }

    #[tokio::test(start_paused = true)]
    async fn what_will_not_pass_is_asked_once() {
        let refused = |path: &str| {
            Err(Error::Refused {
                path: path.to_owned(),
                status: 403,
            })
        };
        for failure in [refused, |path: &str| Err(Error::Missing(path.to_owned()))] {
            let source = shaky(1, failure);
            source.get("/v1/scenes/town/index.json").await.unwrap_err();
            assert_eq!(source.source.asked.load(Ordering::Relaxed), 1);
        }
    }

    #[test]
    fn waits_grow_and_differ() {
        let waits = |path: &str| (1..TRIES).map(|tried| wait(path, tried)).collect::<Vec<_>>();
        assert_ne!(waits("/a"), waits("/b"));
        for (tried, wait) in (0..).zip(waits("/a")) {
            let mean = FIRST_WAIT * (1 << tried);
            assert!((mean / 2..=mean * 3 / 2).contains(&wait), "{wait:?}");
        }
    }
}
