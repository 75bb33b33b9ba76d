//! What does a server or CDN answer? Every answer is bounded: by what is known of its length, and else by what a document may have.

use std::{
    ops::Range,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use belvedere_scene::{BlobName, bundle};
use bytes::Bytes;
use reqwest::{
    Method, RequestBuilder, Response, StatusCode,
    header::{ACCEPT_ENCODING, CACHE_CONTROL, CONTENT_ENCODING, CONTENT_RANGE, LINK, RANGE, RETRY_AFTER},
};
use tokio::time::timeout;

use super::{
    Ask, ByteSource, Carried, Part, Watch,
    failure::{cut, failed},
    incoming::Incoming,
    unwatched,
};
use crate::Error;

/// Answers that say that the request is wrong now, and not for ever.
const MAY_CHANGE: [StatusCode; 3] = [
    StatusCode::REQUEST_TIMEOUT,
    StatusCode::TOO_EARLY,
    StatusCode::TOO_MANY_REQUESTS,
];

/// Of what comes in place of what was asked for, such as a page that says what is wrong, no more is read …
const MOST_REFUSAL_BYTES: u64 = 1 << 20;
/// … and nothing of it longer than this.
const MOST_REFUSAL_TIME: Duration = Duration::from_secs(2);

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

impl HttpSource {
    /// All that is at a path, and what the line carried.
    async fn whole(&self, ask: Ask<'_>, watch: &mut Watch<'_>) -> Result<(Bytes, u64), Error> {
        let request = self.request(Method::GET, ask.path).header(ACCEPT_ENCODING, "gzip");
        read(ask, self.send(ask, request).await?, watch).await
    }

    /// Sends a request, past all caches where that is asked for; answers with success only.
    async fn send(&self, ask: Ask<'_>, request: RequestBuilder) -> Result<Response, Error> {
        let path = ask.path;
        let request = match ask.fresh {
            true => request.header(CACHE_CONTROL, "no-cache"),
            false => request,
        };
        let mut answer = request.send().await.map_err(|cause| failed(path, &cause))?;
        let is_refusal = answer.status().is_client_error() || answer.status().is_server_error();
        if let Some(count) = ask.count.filter(|_| is_refusal) {
            refusal(&mut answer, count).await;
        }
        let answer = succeeded(path, answer)?;
        let links = answer.headers().get_all(LINK).iter();
        if links.filter_map(|link| link.to_str().ok()).any(bundle::is_offered) {
            self.bundles.store(true, Ordering::Relaxed);
        }
        Ok(answer)
    }

    /// A request for a path, to be completed and sent.
    pub(crate) fn request(&self, method: Method, path: &str) -> RequestBuilder {
        self.http.request(method, format!("{}{path}", self.base))
    }
}

/// All of an answer, and what the line carried. One that is longer than it may be is not read to its end, nor at all where it says so.
async fn read(ask: Ask<'_>, mut answer: Response, watch: &mut Watch<'_>) -> Result<(Bytes, u64), Error> {
    let encoding = answer.headers().get(CONTENT_ENCODING);
    let mut incoming = Incoming::new(ask, encoding.is_some_and(|encoding| encoding == "gzip"));
    let announced = answer.content_length();
    incoming.expect(announced)?;
    loop {
        let piece = answer.chunk().await;
        let Some(piece) = piece.map_err(|cause| cut(ask.path, &cause, (incoming.carried, announced)))? else {
            break;
        };
        incoming.push(&piece)?;
        watch(incoming.so_far());
    }
    let carried = incoming.carried;
    Ok((incoming.whole()?, carried))
}

/// Counts what the line carries of an answer that is not one of success. Its status counts, whatever becomes of the rest of it.
async fn refusal(answer: &mut Response, count: &Carried) {
    let reading = async {
        let mut bytes = 0;
        while bytes < MOST_REFUSAL_BYTES
            && let Ok(Some(piece)) = answer.chunk().await
        {
            bytes += piece.len() as u64;
            count.note(piece.len() as u64);
        }
    };
    // What has come by then counts.
    _ = timeout(MOST_REFUSAL_TIME, reading).await;
}

/// An answer, if it is one of success.
pub(crate) fn succeeded(path: &str, answer: Response) -> Result<Response, Error> {
    let status = answer.status();
    if [StatusCode::NOT_FOUND, StatusCode::GONE].contains(&status) {
        return Err(Error::Missing(path.to_owned()));
    }
    let may_change = status.is_server_error() || MAY_CHANGE.contains(&status);
    let after = answer
        .headers()
        .get(RETRY_AFTER)
        .and_then(|after| after.to_str().ok()?.parse().ok());
    if let Some(after_s) = after.filter(|_| may_change) {
        return Err(Error::Busy {
            path: path.to_owned(),
            status: status.as_u16(),
            after: Duration::from_secs(after_s),
        });
    }
    if status.is_client_error() && !may_change {
        return Err(Error::Refused {
            path: path.to_owned(),
            status: status.as_u16(),
        });
    }
    answer.error_for_status().map_err(|cause| failed(path, &cause))
}

impl ByteSource for HttpSource {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        Ok(self.get_carried(path).await?.0)
    }

    async fn get_carried(&self, path: &str) -> Result<(Bytes, u64), Error> {
        self.whole(Ask::of(path), &mut unwatched).await
    }

    async fn get_watched(&self, ask: Ask<'_>, watch: &mut Watch<'_>) -> Result<(Bytes, u64), Error> {
        self.whole(ask, watch).await
    }

    /// A server that knows no ranges answers with all of it, which is believed where it is that, is damaged where only its length is
    /// right, and one that answers with another part is not believed.
    async fn get_range(&self, ask: Ask<'_>, range: Range<u64>) -> Result<(Part, u64), Error> {
        let path = ask.path;
        let (from, last) = (range.start, range.end.saturating_sub(1));
        // A range of what is compressed would be one of other bytes.
        let request = self
            .request(Method::GET, path)
            .header(ACCEPT_ENCODING, "identity")
            .header(RANGE, format!("bytes={from}-{last}"));
        let answer = self.send(ask, request).await?;
        let wrong = |cause: String| Error::Range {
            path: path.to_owned(),
            cause,
        };
        if answer.status() != StatusCode::PARTIAL_CONTENT {
            let (whole, carried) = read(ask, answer, &mut unwatched).await?;
            let found = whole.len() as u64;
            let other = BlobName::from_url(path).ok().filter(|name| !name.is_of(&whole));
            return match other {
                None if range.end <= found => Ok((Part::Whole(whole), carried)),
                Some(name) if ask.bytes == Some(found) => Err(Error::Corrupt(name)),
                _ => Err(wrong(format!("with {found} bytes as if that were all of it"))),
            };
        }
        let told = answer.headers().get(CONTENT_RANGE).and_then(|told| told.to_str().ok());
        if !told.is_some_and(|told| told.starts_with(&format!("bytes {from}-{last}/"))) {
            return Err(wrong(format!("with {}", told.unwrap_or("a part that has no place"))));
        }
        let expected = range.end - range.start;
        let (bytes, carried) = read(ask.having(Some(expected)), answer, &mut unwatched).await?;
        match bytes.len() as u64 == expected {
            true => Ok((Part::Asked(bytes), carried)),
            false => Err(wrong(format!("with {} bytes of these", bytes.len()))),
        }
    }

    fn offers_bundles(&self) -> bool {
        self.bundles.load(Ordering::Relaxed)
    }
}
