//! What did each request cost? A source that notes sizes and real latencies.

use std::{
    future::Future,
    ops::Range,
    sync::Mutex,
    time::{Duration, Instant},
};

use belvedere_scene::BlobName;
use bytes::Bytes;

use crate::{Ask, ByteSource, Carried, Error, Part, Watch, source::unwatched};

/// One request.
#[derive(Debug, Clone, Copy)]
pub(super) struct Answer {
    /// What the line carried of what came in the end …
    pub(super) bytes: u64,
    /// … and before that in vain: what was cut, damaged, or too much.
    pub(super) failed: u64,
    pub(super) took: Duration,
}

/// A source with a note of all its answers.
pub(super) struct Metered<S> {
    source: S,
    answers: Mutex<Vec<Answer>>,
}

impl<S> Metered<S> {
    pub(super) fn new(source: S) -> Self {
        Self {
            source,
            answers: Mutex::default(),
        }
    }

    /// The answers since somebody last asked.
    pub(super) fn take(&self) -> Vec<Answer> {
        let mut answers = self.answers.lock().expect("nothing panics while it holds this lock");
        std::mem::take(&mut *answers)
    }

    fn note<T>(&self, started: Instant, count: &Carried, fetched: &Result<(T, u64), Error>) {
        let bytes = fetched.as_ref().map_or(0, |(_, carried)| *carried);
        let answer = Answer {
            bytes,
            failed: count.bytes().saturating_sub(bytes),
            // Who waits for a turn has not asked yet.
            took: started.elapsed().saturating_sub(count.queued()),
        };
        let mut answers = self.answers.lock().expect("nothing panics while it holds this lock");
        answers.push(answer);
    }
}

impl<S: ByteSource> ByteSource for Metered<S> {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        let fetched = self.get_watched(Ask::of(path), &mut unwatched).await;
        fetched.map(|(bytes, _)| bytes)
    }

    async fn get_watched(&self, ask: Ask<'_>, watch: &mut Watch<'_>) -> Result<(Bytes, u64), Error> {
        let (started, count) = (Instant::now(), Carried::default());
        let fetched = self.source.get_watched(ask.counting(&count), watch).await;
        self.note(started, &count, &fetched);
        fetched
    }

    async fn get_range(&self, ask: Ask<'_>, range: Range<u64>) -> Result<(Part, u64), Error> {
        let (started, count) = (Instant::now(), Carried::default());
        let fetched = self.source.get_range(ask.counting(&count), range).await;
        self.note(started, &count, &fetched);
        fetched
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

#[cfg(test)]
impl Metered<crate::testing::Bare> {
    /// Where objects were asked for, documents apart.
    pub(super) fn asked(&self) -> Vec<String> {
        self.source.asked()
    }
}
