//! Where do bytes come from? A server, a CDN, or a folder; through a cache on disk, and asked for again when that may help.
//! Sources go into each other: `DiskCache::open(folder, bytes, Retrying::new(HttpSource::new(address)?))`.

use std::{
    future::Future,
    ops::Range,
    sync::atomic::{AtomicU64, Ordering},
    time::Duration,
};

mod disk_cache;
mod failure;
mod folder;
mod http;
mod incoming;
mod label;
mod patience;
mod progress;
mod pulse;
mod retrying;
mod shelf;
mod turns;

pub use disk_cache::DiskCache;
pub(crate) use failure::failed;
pub use folder::FolderSource;
pub use http::HttpSource;
pub(crate) use http::succeeded;
pub use pulse::{Lateness, Pulse};
pub use retrying::Retrying;
pub(crate) use retrying::about;

use belvedere_scene::BlobName;
use bytes::Bytes;

use crate::Error;

/// A count of the bytes that a line has carried for a request, whatever became of them: of tries that failed and of answers that were
/// given up as well. It is handed over with [`Ask::counting`], and can be read while the answer comes.
#[derive(Debug, Default)]
pub struct Carried {
    bytes: AtomicU64,
    queued_us: AtomicU64,
}

impl Carried {
    /// So many bytes more have come.
    pub fn note(&self, bytes: u64) {
        self.bytes.fetch_add(bytes, Ordering::Relaxed);
    }

    /// How many bytes have come so far.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.bytes.load(Ordering::Relaxed)
    }

    /// It waited so long for its turn, before it was asked.
    pub(crate) fn waits(&self, queued: Duration) {
        let queued_us = u64::try_from(queued.as_micros()).unwrap_or(u64::MAX);
        self.queued_us.fetch_add(queued_us, Ordering::Relaxed);
    }

    /// For how long nobody had been asked.
    pub(crate) fn queued(&self) -> Duration {
        Duration::from_micros(self.queued_us.load(Ordering::Relaxed))
    }
}

/// What is asked for: what is at a path.
#[derive(Debug, Clone, Copy)]
pub struct Ask<'a> {
    /// It starts with `/`.
    pub path: &'a str,
    /// How many bytes it has, where that is known: more are not taken.
    pub bytes: Option<u64>,
    /// Whether it is to come from where it is published, past whatever keeps copies on the way, as far as that can be asked for.
    pub fresh: bool,
    /// Where bytes that a line carries are counted as they come, if anybody wants to know.
    pub count: Option<&'a Carried>,
}

impl<'a> Ask<'a> {
    /// For what is at a path, however long it is.
    #[must_use]
    pub fn of(path: &'a str) -> Self {
        Self {
            path,
            bytes: None,
            fresh: false,
            count: None,
        }
    }

    /// The same where it is known to have so many bytes, if it is.
    #[must_use]
    pub fn having(self, bytes: Option<u64>) -> Self {
        Self { bytes, ..self }
    }

    /// The same past all copies.
    #[must_use]
    pub fn fresh(self) -> Self {
        Self { fresh: true, ..self }
    }

    /// The same, with a count of what a line carries for it.
    #[must_use]
    pub fn counting(self, count: &'a Carried) -> Self {
        Self {
            count: Some(count),
            ..self
        }
    }
}

/// What is answered to who asks for a part.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Part {
    /// That.
    Asked(Bytes),
    /// All of what it is a part of, as who knows no ranges answers.
    Whole(Bytes),
}

/// Who looks at something while it comes: told again and again of all bytes of it that are here, from its beginning. Where it has to
/// be asked for once more they are fewer again.
pub type Watch<'a> = dyn FnMut(&[u8]) + Send + 'a;

/// Nobody looks.
pub(crate) const fn unwatched(_: &[u8]) {}

/// Reads one document or object of a published tree.
pub trait ByteSource: Send + Sync {
    /// The bytes at a path that starts with `/`.
    fn get(&self, path: &str) -> impl Future<Output = Result<Bytes, Error>> + Send;

    /// The same, and how many bytes of it a line had to carry: fewer where it came compressed.
    fn get_carried(&self, path: &str) -> impl Future<Output = Result<(Bytes, u64), Error>> + Send {
        async {
            let bytes = self.get(path).await?;
            let carried = bytes.len() as u64;
            Ok((bytes, carried))
        }
    }

    /// The same for who looks at it while it comes; who has all of it at once shows it once.
    fn get_watched(
        &self,
        ask: Ask<'_>,
        watch: &mut Watch<'_>,
    ) -> impl Future<Output = Result<(Bytes, u64), Error>> + Send {
        async move {
            let (bytes, carried) = self.get_carried(ask.path).await?;
            watch(&bytes);
            Ok((bytes, carried))
        }
    }

    /// A part of what is at a path, and what a line had to carry. Who cannot answer ranges answers with the whole.
    fn get_range(&self, ask: Ask<'_>, _range: Range<u64>) -> impl Future<Output = Result<(Part, u64), Error>> + Send {
        async move {
            let (whole, carried) = self.get_watched(ask, &mut unwatched).await?;
            Ok((Part::Whole(whole), carried))
        }
    }

    /// Whether many small objects may be asked for at once; what is not known yet is no.
    fn offers_bundles(&self) -> bool {
        false
    }

    /// Takes in an immutable object, or a rung of one, that came otherwise, for who keeps such things.
    fn keep(&self, _path: &str, _bytes: &Bytes) -> impl Future<Output = ()> + Send {
        async {}
    }

    /// An immutable object, or a rung of one, of so many bytes, where it is kept: nobody else is asked.
    fn kept(&self, _path: &str, _bytes: u64) -> impl Future<Output = Option<Bytes>> + Send {
        async { None }
    }

    /// What was kept of the parts of an object is not what its name promises, and is kept no longer.
    fn forget_parts(&self, _whole: &BlobName) {}
}

/// A part of bytes that are here whole.
pub(crate) fn part_of(path: &str, whole: &Bytes, range: Range<u64>) -> Result<Bytes, Error> {
    let wrong = || Error::Length {
        path: path.to_owned(),
        found: whole.len() as u64,
        expected: range.end,
    };
    let [from, to] = [range.start, range.end].map(|at| usize::try_from(at).unwrap_or(usize::MAX));
    (from <= to && to <= whole.len())
        .then(|| whole.slice(from..to))
        .ok_or_else(wrong)
}
