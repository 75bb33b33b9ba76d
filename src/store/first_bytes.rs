//! How long does a request to a bucket wait before anything comes? A server that takes connections and says nothing would hold
//! whoever asks until its own patience ends. What is read is answered soon or asked for again; what is written may take long
//! to arrive, and lists of many objects long to make.
//!
//! A body that has begun may take any time, as long as something comes.

use std::{
    fmt,
    future::Future,
    io::{self, ErrorKind},
    pin::Pin,
    time::Duration,
};

use bytes::{Bytes, BytesMut};
use futures_util::StreamExt;
use object_store::{
    ClientOptions, GetResult,
    client::{
        HttpClient, HttpConnector, HttpError, HttpErrorKind, HttpRequest, HttpResponse, HttpService, ReqwestConnector,
    },
};
use tokio::time::timeout;

/// The head of an answer to `GET` and `HEAD` comes within this time, or the request is made again.
pub(super) const FIRST_BYTE: Duration = Duration::from_secs(2);
/// Between two parts of a body.
const SILENCE: Duration = Duration::from_secs(5);

/// Makes clients that do not wait for a server that says nothing.
#[derive(Debug)]
pub(super) struct Impatient;

impl HttpConnector for Impatient {
    fn connect(&self, options: &ClientOptions) -> object_store::Result<HttpClient> {
        let client = ReqwestConnector::default().connect(options)?;
        Ok(HttpClient::new(Timed {
            client,
            first_byte: FIRST_BYTE,
        }))
    }
}

#[derive(Debug)]
struct Timed {
    client: HttpClient,
    first_byte: Duration,
}

/// Nothing came.
#[derive(Debug)]
struct Silent(Duration);

impl fmt::Display for Silent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "no answer within {:?}", self.0)
    }
}

impl std::error::Error for Silent {}

impl HttpService for Timed {
    fn call<'a, 'b>(
        &'a self,
        request: HttpRequest,
    ) -> Pin<Box<dyn Future<Output = Result<HttpResponse, HttpError>> + Send + 'b>>
    where
        'a: 'b,
        Self: 'b,
    {
        let method = request.method().as_str();
        let lists = request.uri().query().is_some_and(|query| query.contains("list-type="));
        let soon = matches!(method, "GET" | "HEAD") && !lists;
        let answer = self.client.execute(request);
        Box::pin(async move {
            if !soon {
                return answer.await;
            }
            let silent = |_| HttpError::new(HttpErrorKind::Timeout, Silent(self.first_byte));
            timeout(self.first_byte, answer).await.map_err(silent)?
        })
    }
}

/// All that a bucket gives of an object.
pub(super) async fn whole(found: GetResult) -> object_store::Result<Bytes> {
    let expected = found.range.end - found.range.start;
    let mut parts = found.into_stream();
    let mut bytes = BytesMut::new();
    while let Some(part) = timeout(SILENCE, parts.next()).await.map_err(|_| cut())? {
        let part = part?;
        if part.len() as u64 == expected {
            return Ok(part);
        }
        bytes.extend_from_slice(&part);
    }
    Ok(bytes.freeze())
}

fn cut() -> object_store::Error {
    let silent = io::Error::new(ErrorKind::TimedOut, Silent(SILENCE));
    object_store::Error::Generic {
        store: "S3",
        source: Box::new(silent),
    }
}

#[cfg(test)]
mod tests {
    use object_store::client::HttpRequestBody;

    use super::*;

    /// Answers nothing, or after a while.
    #[derive(Debug)]
    struct Slow(Option<Duration>);

    impl HttpService for Slow {
        fn call<'a, 'b>(
            &'a self,
            _: HttpRequest,
        ) -> Pin<Box<dyn Future<Output = Result<HttpResponse, HttpError>> + Send + 'b>>
        where
            'a: 'b,
            Self: 'b,
        {
            Box::pin(async move {
                match self.0 {
                    Some(after) => tokio::time::sleep(after).await,
                    None => std::future::pending().await,
                }
                Ok(HttpResponse::new(Bytes::new().into()))
            })
        }
    }

    async fn ask(method: &str, path: &str, slow: Slow) -> Result<HttpResponse, HttpErrorKind> {
        let request = hyper::Request::builder().method(method).uri(path);
        let request = request.body(HttpRequestBody::empty()).unwrap();
        let timed = Timed {
            client: HttpClient::new(slow),
            first_byte: Duration::from_millis(20),
        };
        timed.call(request).await.map_err(|error| error.kind())
    }

    #[tokio::test]
    async fn what_is_read_does_not_wait_for_who_says_nothing_and_what_is_written_may_take_long() {
        let object = "http://store/worlds/o/a.glb";
        for method in ["GET", "HEAD"] {
            assert!(matches!(
                ask(method, object, Slow(None)).await,
                Err(HttpErrorKind::Timeout)
            ));
        }
        let late = || Slow(Some(Duration::from_millis(200)));
        assert!(ask("PUT", object, late()).await.is_ok());
        let list = "http://store/worlds?list-type=2&prefix=o";
        assert!(ask("GET", list, late()).await.is_ok());
    }
}
