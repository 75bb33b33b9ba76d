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
use tokio::time::sleep;

use super::{
    Ask, ByteSource, Carried, Part, Watch,
    patience::Patience,
    progress::Progress,
    pulse::Pulse,
    turns::{Turn, Turns},
    unwatched,
};
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
    turns: Arc<Turns>,
    pulse: Arc<Pulse>,
}

impl<S: Clone> Clone for Retrying<S> {
    fn clone(&self) -> Self {
        Self {
            source: self.source.clone(),
            patience: Patience::default(),
            lost: self.lost.clone(),
            turns: self.turns.clone(),
            pulse: self.pulse.clone(),
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
            turns: Arc::default(),
            pulse: Arc::default(),
        }
    }

    /// Of all clones together at most so many requests are under way at once. What waits for its turn costs no patience.
    #[must_use]
    pub fn at_most(self, requests: usize) -> Self {
        Self {
            turns: Arc::new(Turns::at_most(requests)),
            ..self
        }
    }

    /// How late this machine comes to its beats, for all clones together: it knows while somebody waits for [`Pulse::beat`].
    #[must_use]
    pub fn pulse(&self) -> Arc<Pulse> {
        self.pulse.clone()
    }

    fn request<'a>(&'a self, path: &'a str) -> Request<'a, S> {
        Request {
            was_lost: self.lost().contains(path),
            source: self,
            path,
            spent: Duration::ZERO,
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
    /// How long was waited for answers and between tries.
    spent: Duration,
    tries: u32,
    /// How long it took until the last answer began.
    begins: Duration,
}

impl<S> Request<'_, S> {
    /// One try: its answer, or that it does not come. As [`Progress::wait`] has it, so many bytes of it may not be seen.
    async fn hear<T>(
        &mut self,
        turn: Turn,
        progress: &Progress<'_>,
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
        let grace = match self.was_lost {
            true => patience.usual(),
            false => patience.grace(self.spent),
        };
        let answer = progress.wait(grace, unseen, answer);
        let (answer, waited) = self.source.turns.during(turn, answer).await;
        self.spent += waited;
        self.begins = progress.begins();
        if let Some(Err(Error::Missing(_) | Error::Refused { .. } | Error::Busy { .. } | Error::Range { .. })) = &answer
        {
            patience.hears();
        }
        answer.unwrap_or_else(|| {
            let bytes = progress.bytes();
            if bytes == 0 {
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
    async fn rest(&mut self, cause: &Error) -> bool {
        let mut pause = wait(self.path, self.tries);
        if let Error::Busy { after, .. } = cause {
            pause = pause.max(*after);
        }
        let patience = &self.source.patience;
        let is_worth = cause.passes() && self.may_try() && patience.hopes() && patience.bears(pause, self.spent);
        if is_worth {
            self.spent += pause;
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
                self.source.patience.spend(self.spent);
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
        let turn = self.turns.take(ask.count).await;
        // What comes in place of what was asked for is seen by nobody else.
        let progress = ask.count.map_or_else(Progress::new, Progress::counted);
        let mut watch = |so_far: &[u8]| {
            progress.note(so_far.len());
            watch(so_far);
        };
        let answer = self.source.get_watched(ask, &mut watch);
        let (bytes, carried) = request.hear(turn, &progress, 0, answer).await?;
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

    async fn get_range(&self, ask: Ask<'_>, range: Range<u64>) -> Result<(Part, u64), Error> {
        // Who knows no ranges sends all of the file: that is waited for as long as it comes.
        let counted = Carried::default();
        let mut ask = ask.counting(ask.count.unwrap_or(&counted));
        let mut request = self.request(ask.path);
        let unseen = range.end.saturating_sub(range.start);
        loop {
            let turn = self.turns.take(ask.count).await;
            let answer = self.source.get_range(ask, range.clone());
            let progress = ask.count.map_or_else(Progress::new, Progress::counted);
            match request.hear(turn, &progress, unseen, answer).await {
                Err(cause) if cause.is_damage() && !ask.fresh && request.may_try() => ask = ask.fresh(),
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
mod tests;
