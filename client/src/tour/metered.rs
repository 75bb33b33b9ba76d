//! What did each request cost? A source that notes sizes and real latencies.

use std::{
    future::Future,
    ops::Range,
    sync::Mutex,
    time::{Duration, Instant},
};

use belvedere_scene::BlobName;
use bytes::Bytes;

use crate::{Ask, ByteSource, Error, Watch, source::unwatched};

/// One request. Who fails carries nothing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Answer {
    pub(super) bytes: u64,
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

    fn note(&self, started: Instant, fetched: &Result<(Bytes, u64), Error>) {
        let answer = Answer {
            bytes: fetched.as_ref().map_or(0, |(_, carried)| *carried),
            took: started.elapsed(),
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
        let started = Instant::now();
        let fetched = self.source.get_watched(ask, watch).await;
        self.note(started, &fetched);
        fetched
    }

    async fn get_range(&self, path: &str, range: Range<u64>) -> Result<(Bytes, u64), Error> {
        let started = Instant::now();
        let fetched = self.source.get_range(path, range).await;
        self.note(started, &fetched);
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
