//! When is a request worth another try? When it failed for a reason that may pass, and [patience](super::patience) bears the wait; each
//! try waits four times as long as the one before, more or less, so that clients that failed together do not come back together. What
//! came damaged is asked for once more, at once and past all caches: a copy may be damaged, and what is published damaged stays so. A file
//! that could not be had is tried once when it is wanted again, and not waited for longer than answers take.

use std::{
    collections::HashSet,
    future::Future,
    hash::{BuildHasher, Hash, RandomState},
    ops::Range,
    sync::{Arc, Mutex, MutexGuard},
    time::Duration,
};

use belvedere_scene::BlobName;
use bytes::Bytes;
use tokio::time::{Instant, sleep};

use super::{Ask, ByteSource, Watch, patience::Patience, progress::Progress, unwatched};
use crate::{Error, document::as_promised};

/// Tries of one request, the first included.
const TRIES: u32 = 5;
/// Before the second try, on average.
const FIRST_WAIT: Duration = Duration::from_millis(30);
/// How many times as long each wait is as the one before.
const LONGER: u32 = 4;

/// A source that is asked again where that may help. Each clone is for somebody with patience of their own; what could not be had is
/// known to all.
#[derive(Debug)]
pub struct Retrying<S> {
    source: S,
    patience: Patience,
    /// Files that could not be had when they were last asked for.
    lost: Arc<Mutex<HashSet<String>>>,
}

impl<S: Clone> Clone for Retrying<S> {
    fn clone(&self) -> Self {
        Self {
            source: self.source.clone(),
            patience: Patience::default(),
            lost: self.lost.clone(),
        }
    }
}

impl<S> Retrying<S> {
    /// Asks this source, up to five times within about three seconds, and less often where much is asked for in vain.
    #[must_use]
    pub fn new(source: S) -> Self {
        Self {
            source,
            patience: Patience::default(),
            lost: Arc::default(),
        }
    }

    fn request<'a>(&'a self, path: &'a str) -> Request<'a, S> {
        Request {
            was_lost: self.lost().contains(path),
            source: self,
            path,
            asked: Instant::now(),
            tries: 0,
            begins: Duration::ZERO,
        }
    }

    fn lost(&self) -> MutexGuard<'_, HashSet<String>> {
        self.lost.lock().expect("nothing panics while it holds this lock")
    }
}

/// A request that is tried until something comes of it, or nothing will.
struct Request<'a, S> {
    source: &'a Retrying<S>,
    path: &'a str,
    /// Whether it could not be had before.
    was_lost: bool,
    asked: Instant,
    tries: u32,
    /// How long it took until the last answer began.
    begins: Duration,
}

impl<S> Request<'_, S> {
    /// One try: its answer, or that it does not come. As [`Progress::wait`] has it, so many bytes of it are not seen.
    async fn hear<T>(
        &mut self,
        progress: &Progress,
        unseen: u64,
        answer: impl Future<Output = Result<T, Error>>,
    ) -> Result<T, Error> {
        let patience = &self.source.patience;
        let fails = |cause: String| Error::Fetch {
            path: self.path.to_owned(),
            cause,
        };
        self.tries += 1;
        if !patience.takes_turn() {
            return Err(fails("nothing has been answered for long".to_owned()));
        }
        let spent = self.asked.elapsed();
        let grace = match self.was_lost {
            true => patience.usual(),
            false => patience.grace(spent),
        };
        let answer = progress.wait(grace, unseen, answer).await;
        self.begins = progress.begins();
        if let Some(Err(Error::Missing(_) | Error::Refused { .. } | Error::Busy { .. } | Error::Range { .. })) = &answer
        {
            patience.hears();
        }
        answer.unwrap_or_else(|| {
            let (bytes, waited) = (progress.bytes(), self.asked.elapsed() - spent);
            if bytes == 0 && unseen == 0 {
                patience.hears_nothing(waited);
            }
            Err(fails(format!("{bytes} bytes came in {:.1} s", waited.as_secs_f64())))
        })
    }

    /// Whether it may be tried once more.
    fn may_try(&self) -> bool {
        !self.was_lost && self.tries < TRIES
    }

    /// Waits before it is tried once more; answers whether it is worth that.
    async fn rest(&self, cause: &Error) -> bool {
        let mut pause = wait(self.path, self.tries);
        if let Error::Busy { after, .. } = cause {
            pause = pause.max(*after);
        }
        let patience = &self.source.patience;
        let is_worth =
            cause.passes() && self.may_try() && patience.hopes() && patience.bears(pause, self.asked.elapsed());
        if is_worth {
            sleep(pause).await;
        }
        is_worth
    }

    /// Takes note of what became of it in the end. An answer that there is nothing says nothing of others.
    fn end<T>(self, answer: Result<T, Error>) -> Result<T, Error> {
        match &answer {
            Ok(_) => {
                self.source.patience.came(self.begins);
                self.source.lost().remove(self.path);
            }
            Err(cause) if cause.is_transient() => {
                self.source.patience.spend(self.asked.elapsed());
                self.source.lost().insert(self.path.to_owned());
            }
            Err(_) => {}
        }
        answer
    }
}

impl<S: ByteSource> Retrying<S> {
    /// All that is at a path, by one try; an immutable object is what its name promises.
    async fn once(
        &self,
        request: &mut Request<'_, S>,
        ask: Ask<'_>,
        watch: &mut Watch<'_>,
    ) -> Result<(Bytes, u64), Error> {
        let progress = Progress::new();
        let mut watch = |so_far: &[u8]| {
            progress.note(so_far.len());
            watch(so_far);
        };
        let answer = self.source.get_watched(ask, &mut watch);
        let (bytes, carried) = request.hear(&progress, 0, answer).await?;
        match BlobName::from_url(ask.path) {
            Ok(name) => Ok((as_promised(&name, bytes)?, carried)),
            // Other paths promise nothing.
            Err(_) => Ok((bytes, carried)),
        }
    }
}

impl<S: ByteSource> ByteSource for Retrying<S> {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        Ok(self.get_carried(path).await?.0)
    }

    async fn get_carried(&self, path: &str) -> Result<(Bytes, u64), Error> {
        self.get_watched(Ask::of(path), &mut unwatched).await
    }

    /// Each try begins anew.
    async fn get_watched(&self, mut ask: Ask<'_>, watch: &mut Watch<'_>) -> Result<(Bytes, u64), Error> {
        let mut request = self.request(ask.path);
        loop {
            match self.once(&mut request, ask, watch).await {
                Err(cause) if cause.is_damage() && !ask.fresh && request.may_try() => ask = ask.fresh(),
                Err(cause) if request.rest(&cause).await => {}
                answer => return request.end(answer),
            }
        }
    }

    async fn get_range(&self, path: &str, range: Range<u64>) -> Result<(Bytes, u64), Error> {
        let mut request = self.request(path);
        loop {
            let answer = self.source.get_range(path, range.clone());
            // Who knows no ranges sends all of the file, which is as long as this at least.
            match request.hear(&Progress::new(), range.end, answer).await {
                Err(cause) if request.rest(&cause).await => {}
                answer => return request.end(answer),
            }
        }
    }

    fn offers_bundles(&self) -> bool {
        self.source.offers_bundles()
    }

    fn keep(&self, path: &str, bytes: &Bytes) -> impl Future<Output = ()> + Send {
        self.source.keep(path, bytes)
    }

    fn kept(&self, path: &str, bytes: u64) -> impl Future<Output = Option<Bytes>> + Send {
        self.source.kept(path, bytes)
    }

    fn forget_parts(&self, whole: &BlobName) {
        self.source.forget_parts(whole);
    }
}

/// How long to wait after so many tries: between half and one and a half of what they have on average.
fn wait(path: &str, tried: u32) -> Duration {
    about(FIRST_WAIT * LONGER.pow(tried - 1), (path, tried))
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

        async fn get_watched(&self, ask: Ask<'_>, watch: &mut Watch<'_>) -> Result<(Bytes, u64), Error> {
            self.asked_fresh.fetch_add(u32::from(ask.fresh), Ordering::Relaxed);
            let bytes = self.get(ask.path).await?;
            watch(&bytes);
            Ok((bytes, 5))
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
        let ask = Ask::of("/v1/scenes/town/index.json").fresh();
        assert_eq!(source.get_watched(ask, &mut unwatched).await.unwrap().1, 5);
        let asked = [&source.source.asked, &source.source.asked_fresh].map(|asked| asked.load(Ordering::Relaxed));
        assert_eq!(asked, [2, 2]);
    }

    /// What becomes of so many files of a source, of which those that end in 1, 4 or 7 fail for so many tries.
    async fn walk(files: u32, failures: u32, failure: Failure) -> (u32, Duration) {
        let source = Retrying::new(Sick {
            failures,
            failure,
            tried: Mutex::default(),
        });
        let begun = Instant::now();
        let mut lost = 0;
        for file in 0..files {
            lost += u32::from(source.get(&format!("/v1/{file}")).await.is_err());
        }
        (lost, begun.elapsed())
    }

    #[derive(Debug, Clone, Copy, PartialEq)]
    enum Failure {
        Refuses,
        Busy,
        Hangs,
        Trickles,
    }

    struct Sick {
        failures: u32,
        failure: Failure,
        tried: Mutex<std::collections::BTreeMap<String, u32>>,
    }

    impl ByteSource for Sick {
        async fn get(&self, path: &str) -> Result<Bytes, Error> {
            Ok(self.get_watched(Ask::of(path), &mut unwatched).await?.0)
        }

        async fn get_watched(&self, ask: Ask<'_>, watch: &mut Watch<'_>) -> Result<(Bytes, u64), Error> {
            sleep(Duration::from_millis(1)).await;
            let tried = {
                let mut tried = self.tried.lock().expect("the notes");
                let tried = tried.entry(ask.path.to_owned()).or_default();
                *tried += 1;
                *tried
            };
            if ask.path.ends_with(['1', '4', '7']) && tried <= self.failures {
                match self.failure {
                    Failure::Refuses => return Err(silence(ask.path)),
                    Failure::Busy => {
                        return Err(Error::Busy {
                            path: ask.path.to_owned(),
                            status: 429,
                            after: Duration::from_hours(1),
                        });
                    }
                    Failure::Hangs => std::future::pending().await,
                    Failure::Trickles => {
                        for bytes in 0..10_000 {
                            watch(&vec![0; 20 * bytes]);
                            sleep(Duration::from_millis(200)).await;
                        }
                    }
                }
            }
            watch(b"right");
            Ok((Bytes::from_static(b"right"), 5))
        }
    }

    #[tokio::test(start_paused = true)]
    async fn files_that_never_come_cost_little_more_than_a_minute_together() {
        for failure in [Failure::Refuses, Failure::Busy, Failure::Hangs, Failure::Trickles] {
            let (lost, took) = walk(800, u32::MAX, failure).await;
            assert_eq!(lost, 240, "{failure:?}");
            assert!(took < Duration::from_secs(105), "{failure:?}: {took:?}");
        }
    }

    #[tokio::test(start_paused = true)]
    async fn files_that_fail_twice_and_then_come_are_not_lost() {
        for failures in [1, 2] {
            let (lost, took) = walk(800, failures, Failure::Refuses).await;
            assert_eq!(lost, 0);
            assert!(took < Duration::from_secs(60), "{took:?}");
        }
        assert_eq!(walk(100, 1, Failure::Hangs).await.0, 0);
    }

    #[tokio::test(start_paused = true)]
    async fn a_server_that_falls_silent_is_left_alone_and_asked_again_later() {
        let source = Retrying::new(Sick {
            failures: 250,
            failure: Failure::Hangs,
            tried: Mutex::default(),
        });
        source.get("/v1/right").await.unwrap();
        let begun = Instant::now();
        for _ in 0..1000 {
            source.get("/v1/1").await.unwrap_err();
            source.get("/v1/other-1").await.unwrap_err();
        }
        assert!(begun.elapsed() < Duration::from_mins(2), "{:?}", begun.elapsed());
        sleep(Duration::from_secs(10)).await;
        source.get("/v1/right").await.unwrap();
    }

    #[tokio::test(start_paused = true)]
    async fn what_could_not_be_had_is_tried_once_when_it_is_wanted_again() {
        let source = shaky(TRIES + 2, away);
        let mut asked = 0;
        let mut tries = async |source: &Retrying<Shaky>| {
            let came = source.get("/v1/file").await.is_ok();
            let before = std::mem::replace(&mut asked, source.source.asked.load(Ordering::Relaxed));
            (came, asked - before)
        };
        assert_eq!(tries(&source).await, (false, TRIES));
        assert_eq!(tries(&source).await, (false, 1));
        assert_eq!(tries(&source).await, (false, 1));
        assert_eq!(tries(&source).await, (true, 1));
        assert!(source.lost().is_empty());
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
            let mean = FIRST_WAIT * LONGER.pow(tried);
            assert!((mean / 2..=mean * 3 / 2).contains(&wait), "{wait:?}");
        }
    }
}
