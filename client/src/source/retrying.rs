//! When is a request worth another try? When it failed for a reason that may pass, or what came is damaged. Each try waits
//! twice as long as the one before, more or less, so that clients that failed together do not come back together.

use std::{
    future::Future,
    hash::{BuildHasher, Hash, RandomState},
    ops::Range,
    time::Duration,
};

use belvedere_scene::BlobName;
use bytes::Bytes;

use super::ByteSource;
use crate::Error;

/// Tries of one request, the first included.
const TRIES: u32 = 5;
/// Before the second try, on average.
const FIRST_WAIT: Duration = Duration::from_millis(250);

/// A source that is asked again where that may help.
#[derive(Debug, Clone)]
pub struct Retrying<S> {
    source: S,
}

impl<S> Retrying<S> {
    /// Asks this source, up to five times within about four seconds.
    #[must_use]
    pub fn new(source: S) -> Self {
        Self { source }
    }
}

impl<S: ByteSource> ByteSource for Retrying<S> {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        Ok(self.get_carried(path).await?.0)
    }

    async fn get_carried(&self, path: &str) -> Result<(Bytes, u64), Error> {
        // Other paths than those of immutable objects promise nothing.
        let promised = BlobName::from_url(path);
        let mut tried = 0;
        loop {
            let answer = self.source.get_carried(path).await;
            let answer = answer.and_then(|(bytes, carried)| match &promised {
                Ok(name) if !name.is_of(&bytes) => Err(Error::Corrupt(name.clone())),
                _ => Ok((bytes, carried)),
            });
            tried += 1;
            match answer {
                Err(cause) if cause.is_transient() && tried < TRIES => tokio::time::sleep(wait(path, tried)).await,
                answer => return answer,
            }
        }
    }

    async fn get_range(&self, path: &str, range: Range<u64>) -> Result<(Bytes, u64), Error> {
        let mut tried = 0;
        loop {
            let answer = self.source.get_range(path, range.clone()).await;
            tried += 1;
            match answer {
                Err(cause) if cause.is_transient() && tried < TRIES => tokio::time::sleep(wait(path, tried)).await,
                answer => return answer,
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

    /// Fails so many times, each in its own way, then answers.
    struct Shaky {
        failures: u32,
        asked: AtomicU32,
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
    }

    fn shaky(failures: u32, failure: fn(&str) -> Result<Bytes, Error>) -> Retrying<Shaky> {
        Retrying::new(Shaky {
            failures,
            asked: AtomicU32::new(0),
            failure,
        })
    }

    fn away(path: &str) -> Result<Bytes, Error> {
        Err(Error::Fetch {
            path: path.to_owned(),
            cause: "nobody listens".to_owned(),
        })
    }

    #[tokio::test(start_paused = true)]
    async fn what_may_pass_is_asked_again() {
        let name = BlobName::of(b"right", "cell").unwrap().url();
        for failure in [away, |_: &str| Ok(Bytes::from_static(b"wrong"))] {
            let source = shaky(TRIES - 1, failure);
            assert_eq!(source.get(&name).await.unwrap(), Bytes::from_static(b"right"));
            let source = shaky(TRIES, failure);
            assert!(source.get(&name).await.unwrap_err().is_transient());
            assert_eq!(source.source.asked.load(Ordering::Relaxed), TRIES);
        }
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
