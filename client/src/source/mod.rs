//! Where do bytes come from? A server, a CDN, or a folder; through a cache on disk, and asked for again when that may help.
//! Sources go into each other: `DiskCache::open(folder, bytes, Retrying::new(HttpSource::new(address)?))`.

use std::{
    future::Future,
    ops::Range,
    path::PathBuf,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

mod disk_cache;
mod incoming;
mod retrying;
mod shelf;

pub use disk_cache::DiskCache;
pub use retrying::Retrying;
pub(crate) use retrying::about;

use bytes::Bytes;
use incoming::Incoming;
use reqwest::{
    Method, RequestBuilder, Response, StatusCode,
    header::{ACCEPT_ENCODING, CACHE_CONTROL, CONTENT_ENCODING, CONTENT_RANGE, LINK, RANGE},
};

use crate::Error;

/// Who looks at something while it comes: told again and again of all bytes of it that are here, from its beginning. Where it has to
/// be asked for once more they are fewer again.
pub type Watch<'a> = dyn FnMut(&[u8]) + Send + 'a;

/// Nobody looks.
const fn unwatched(_: &[u8]) {}

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
        path: &str,
        watch: &mut Watch<'_>,
    ) -> impl Future<Output = Result<(Bytes, u64), Error>> + Send {
        async {
            let (bytes, carried) = self.get_carried(path).await?;
            watch(&bytes);
            Ok((bytes, carried))
        }
    }

    /// The same from where it is published, past whatever keeps copies on the way, as far as that can be asked for.
    fn get_fresh(&self, path: &str) -> impl Future<Output = Result<(Bytes, u64), Error>> + Send {
        self.get_carried(path)
    }

    /// A part of what is at a path, and what a line had to carry of it. Who cannot answer ranges answers out of the whole.
    fn get_range(&self, path: &str, range: Range<u64>) -> impl Future<Output = Result<(Bytes, u64), Error>> + Send {
        async move {
            let (whole, carried) = self.get_carried(path).await?;
            Ok((part_of(path, &whole, range)?, carried))
        }
    }

    /// Whether many small objects may be asked for at once; what is not known yet is no.
    fn offers_bundles(&self) -> bool {
        false
    }

    /// Takes in an immutable object that came otherwise, for who keeps such things.
    fn keep(&self, _path: &str, _bytes: &Bytes) -> impl Future<Output = ()> + Send {
        async {}
    }
}

/// A part of bytes that are here whole.
fn part_of(path: &str, whole: &Bytes, range: Range<u64>) -> Result<Bytes, Error> {
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

/// Answers that say that the request is wrong now, and not for ever.
const MAY_CHANGE: [StatusCode; 3] = [
    StatusCode::REQUEST_TIMEOUT,
    StatusCode::TOO_EARLY,
    StatusCode::TOO_MANY_REQUESTS,
];

/// A server or CDN.
#[derive(Debug, Clone)]
pub struct HttpSource {
    base: String,
    http: reqwest::Client,
    /// Whether an answer offered bundles.
    bundles: Arc<AtomicBool>,
}

impl HttpSource {
    /// The tree below an address such as `http://127.0.0.1:8080` or `https://cdn.example.org/worlds`.
    ///
    /// # Errors
    /// When the address is none, or has a query or a fragment.
    pub fn new(base: &str) -> Result<Self, Error> {
        let wrong = || Error::Address(base.to_owned());
        let url: reqwest::Url = base.parse().map_err(|_| wrong())?;
        if !matches!(url.scheme(), "http" | "https") || url.cannot_be_a_base() {
            return Err(wrong());
        }
        if let Some(end) = base.find(['?', '#']) {
            return Err(Error::Link {
                address: base.to_owned(),
                tree: base[..end].to_owned(),
            });
        }
        let http = reqwest::Client::builder()
            .connect_timeout(Duration::from_secs(10))
            .read_timeout(Duration::from_secs(30))
            .build()
            .map_err(|_| wrong())?;
        Ok(Self {
            base: base.trim_end_matches('/').to_owned(),
            http,
            bundles: Arc::default(),
        })
    }
}

/// What of a path is asked for.
#[derive(Debug, Clone, Copy)]
enum Part<'a> {
    Whole,
    /// All of it, and no copy that somebody on the way has kept.
    WholeFresh,
    Range(&'a Range<u64>),
}

impl HttpSource {
    /// All that is at a path, and what the line carried.
    async fn whole(&self, path: &str, part: Part<'_>, watch: &mut Watch<'_>) -> Result<(Bytes, u64), Error> {
        let mut answer = self.ask(path, part).await?;
        let encoding = answer.headers().get(CONTENT_ENCODING);
        let mut incoming = Incoming::new(path, encoding.is_some_and(|encoding| encoding == "gzip"));
        while let Some(piece) = answer.chunk().await.map_err(|cause| failed(path, &cause))? {
            incoming.push(&piece)?;
            watch(incoming.so_far());
        }
        let carried = incoming.carried;
        Ok((incoming.whole()?, carried))
    }

    /// Asks for a path, all of it or a part; answers with success only.
    async fn ask(&self, path: &str, part: Part<'_>) -> Result<Response, Error> {
        let request = self.http.get(format!("{}{path}", self.base));
        let request = match part {
            // A range of what is compressed would be one of other bytes.
            Part::Range(range) => request
                .header(ACCEPT_ENCODING, "identity")
                .header(RANGE, format!("bytes={}-{}", range.start, range.end.saturating_sub(1))),
            Part::Whole => request.header(ACCEPT_ENCODING, "gzip"),
            Part::WholeFresh => request
                .header(ACCEPT_ENCODING, "gzip")
                .header(CACHE_CONTROL, "no-cache"),
        };
        let answer = request.send().await.map_err(|cause| failed(path, &cause))?;
        let answer = succeeded(path, answer)?;
        let links = answer
            .headers()
            .get_all(LINK)
            .iter()
            .filter_map(|link| link.to_str().ok());
        if links
            .into_iter()
            .any(|link| link.contains("rel=\"bundles\"") || link.contains("rel=bundles"))
        {
            self.bundles.store(true, Ordering::Relaxed);
        }
        Ok(answer)
    }

    /// A request for a path, to be completed and sent.
    pub(crate) fn request(&self, method: Method, path: &str) -> RequestBuilder {
        self.http.request(method, format!("{}{path}", self.base))
    }
}

/// An answer, if it is one of success.
pub(crate) fn succeeded(path: &str, answer: Response) -> Result<Response, Error> {
    let status = answer.status();
    if status == StatusCode::NOT_FOUND {
        return Err(Error::Missing(path.to_owned()));
    }
    if status.is_client_error() && !MAY_CHANGE.contains(&status) {
        return Err(Error::Refused {
            path: path.to_owned(),
            status: status.as_u16(),
        });
    }
    answer.error_for_status().map_err(|cause| failed(path, &cause))
}

pub(crate) fn failed(path: &str, cause: &reqwest::Error) -> Error {
    Error::Fetch {
        path: path.to_owned(),
        cause: chain(cause),
    }
}

impl ByteSource for HttpSource {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        Ok(self.get_carried(path).await?.0)
    }

    async fn get_carried(&self, path: &str) -> Result<(Bytes, u64), Error> {
        self.whole(path, Part::Whole, &mut unwatched).await
    }

    async fn get_watched(&self, path: &str, watch: &mut Watch<'_>) -> Result<(Bytes, u64), Error> {
        self.whole(path, Part::Whole, watch).await
    }

    async fn get_fresh(&self, path: &str) -> Result<(Bytes, u64), Error> {
        self.whole(path, Part::WholeFresh, &mut unwatched).await
    }

    /// A server that knows no ranges answers with all of it, and one that answers with another part is not believed.
    async fn get_range(&self, path: &str, range: Range<u64>) -> Result<(Bytes, u64), Error> {
        let answer = self.ask(path, Part::Range(&range)).await?;
        let is_part = answer.status() == StatusCode::PARTIAL_CONTENT;
        let told = answer.headers().get(CONTENT_RANGE).and_then(|told| told.to_str().ok());
        let begins = format!("bytes {}-{}/", range.start, range.end.saturating_sub(1));
        let right = told.is_some_and(|told| told.starts_with(&begins));
        let bytes = answer.bytes().await.map_err(|cause| failed(path, &cause))?;
        let carried = bytes.len() as u64;
        let expected = range.end - range.start;
        if !is_part {
            return Ok((part_of(path, &bytes, range)?, carried));
        }
        if right && carried == expected {
            return Ok((bytes, carried));
        }
        Err(Error::Length {
            path: path.to_owned(),
            found: carried,
            expected,
        })
    }

    fn offers_bundles(&self) -> bool {
        self.bundles.load(Ordering::Relaxed)
    }
}

/// A folder that `belvedere publish` wrote.
#[derive(Debug, Clone)]
pub struct FolderSource {
    root: PathBuf,
}

impl FolderSource {
    /// The tree in this folder.
    #[must_use]
    pub fn new(root: impl Into<PathBuf>) -> Self {
        Self { root: root.into() }
    }
}

impl ByteSource for FolderSource {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        let below = path.trim_start_matches('/');
        if below.split('/').any(|part| part == "..") {
            return Err(Error::Missing(path.to_owned()));
        }
        match tokio::fs::read(self.root.join(below)).await {
            Ok(bytes) => Ok(bytes.into()),
            Err(cause) if cause.kind() == std::io::ErrorKind::NotFound => Err(Error::Missing(path.to_owned())),
            Err(cause) => Err(Error::Fetch {
                path: path.to_owned(),
                cause: cause.to_string(),
            }),
        }
    }

    /// What a web server in front of the folder would send.
    async fn get_carried(&self, path: &str) -> Result<(Bytes, u64), Error> {
        let bytes = self.get(path).await?;
        let packed = tokio::fs::metadata(self.root.join(format!("{}.gz", path.trim_start_matches('/')))).await;
        let carried = packed.map_or(bytes.len() as u64, |packed| packed.len());
        Ok((bytes, carried))
    }
}

/// The error with its causes, outermost first.
fn chain(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut next = error.source();
    while let Some(cause) = next {
        text.push_str(": ");
        text.push_str(&cause.to_string());
        next = cause.source();
    }
    text
}
