//! How is the router's answer written? As hyper frames it: with its length when that is known, in chunks when not.
//!
//! While it is waited for, whoever has asked is listened to: a peer that goes away ends what was asked for, and what it
//! says ahead of time is kept, up to the size of a head. What is held while a stream is quiet is the stream.

use std::{
    convert::Infallible,
    future::poll_fn,
    io::{self, IoSlice},
    mem::MaybeUninit,
    pin::Pin,
    task::{Context, Poll},
    time::Instant,
};

use axum::{
    body::{Body, HttpBody},
    http::{HeaderValue, Method, Request, Response, StatusCode, header, response::Parts},
};
use bytes::Bytes;
use http_body_util::Either;
use tokio::io::{AsyncRead, ReadBuf};
use tokio_util::task::AbortOnDropHandle;

use super::{
    Direct, MAX_HEAD_BYTES, head_lines,
    wire::{self, CHUNK_END, ChunkHead},
};
use crate::{http::blob_body::BlobBody, live::Shortcut};

type AnyBody = Either<BlobBody, Body>;

type Answering = Pin<Box<dyn Future<Output = Result<Response<AnyBody>, Infallible>> + Send>>;

/// What paths of things that are named by their content begin with.
const IMMUTABLE: &str = "/o/";

/// How the end of a body is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Framing {
    /// There is none.
    None,
    /// By its length, of which so much is to come.
    Length(u64),
    /// By a last chunk.
    Chunks,
}

/// What comes next of a body.
enum Part {
    Data(Bytes),
    /// Nothing at once, and something else waits to be sent.
    Later,
    End,
}

/// An answer of the router that is to be written.
#[derive(Debug)]
pub(in crate::http) struct Answer {
    head: Vec<u8>,
    framing: Framing,
    body: AnyBody,
    /// How it may be said past the body.
    shortcut: Option<Shortcut>,
    /// Whether it is the last one here.
    pub(super) last: bool,
}

impl Answer {
    /// Whether nobody knows how long it will be.
    pub(super) fn is_stream(&self) -> bool {
        self.framing == Framing::Chunks
    }
}

impl Direct {
    /// Asks the router.
    pub(super) async fn answered(&mut self, request: Box<Request<Body>>) -> io::Result<Box<Answer>> {
        let method = request.method().clone();
        let (front, peer) = (self.front.clone(), self.peer.clone());
        // What is named by its content is most often in memory, and then answered here and now.
        let at_once = request.uri().path().starts_with(IMMUTABLE);
        let mut answering: Answering = Box::pin(async move { front.answer(*request, &peer).await });
        let here = poll_fn(|cx| {
            let _within = self.shared.enter();
            Poll::Ready(if at_once {
                answering.as_mut().poll(cx)
            } else {
                Poll::Pending
            })
        });
        let answer = match here.await {
            Poll::Ready(Ok(answer)) => answer,
            Poll::Pending => {
                let mut answering = AbortOnDropHandle::new(self.shared.spawn(answering));
                let answer = poll_fn(|cx| match Pin::new(&mut answering).poll(cx) {
                    Poll::Ready(Ok(Ok(answer))) => Poll::Ready(Ok(answer)),
                    Poll::Ready(Err(broken)) => Poll::Ready(Err(io::Error::other(broken))),
                    Poll::Pending => self.poll_gone(cx).map(Err),
                });
                answer.await?
            }
        };
        let (mut parts, body) = answer.into_parts();
        let last = self.stopping.given() || says_close(&parts);
        if last {
            parts
                .headers
                .insert(header::CONNECTION, HeaderValue::from_static("close"));
        }
        let mut head = head_lines(parts.status, &parts.headers);
        let shortcut = parts.extensions.remove();
        let framing = frame(&method, &parts, &body, &mut head);
        wire::end_head(&mut head, Instant::now());
        Ok(Box::new(Answer {
            head,
            framing,
            body,
            shortcut,
            last,
        }))
    }

    /// Writes an answer. Says whether the connection goes on.
    pub(in crate::http) async fn write(&mut self, mut answer: Box<Answer>) -> io::Result<bool> {
        let (mut head, framing) = (std::mem::take(&mut answer.head), answer.framing);
        let mut left = match framing {
            Framing::Length(left) => left,
            Framing::Chunks | Framing::None => 0,
        };
        if let Some(shortcut) = answer.shortcut.take().filter(|_| framing == Framing::Chunks) {
            shortcut.lay(self.io.get_ref().shared().clone());
        }
        loop {
            // What is there at once goes with the head.
            let next = match framing {
                Framing::None => Part::End,
                _ => poll_fn(|cx| self.poll_part(&mut answer.body, !head.is_empty(), cx)).await?,
            };
            let ends = matches!(next, Part::End);
            if ends {
                // Nobody says anything past it after its end.
                answer.body = Either::Left(BlobBody::Empty);
            }
            let rest = self.io.get_ref().shared().take_turn();
            wire::write_all(&mut self.io, &mut [IoSlice::new(&rest)]).await?;
            let (data, line_end) = match (next, framing) {
                // An empty chunk would be the end.
                (Part::Data(data), _) if data.is_empty() => continue,
                (Part::Data(data), Framing::Chunks) => {
                    head.extend_from_slice(ChunkHead::of(data.len()).bytes());
                    (data, CHUNK_END)
                }
                (Part::Data(data), _) => {
                    left = left.checked_sub(data.len() as u64).ok_or(io::ErrorKind::InvalidData)?;
                    (data, &b""[..])
                }
                (Part::End, Framing::Chunks) => (Bytes::from_static(b"0\r\n\r\n"), &b""[..]),
                (Part::End | Part::Later, _) => (Bytes::new(), &b""[..]),
            };
            let slices = [&head[..], &data, line_end];
            wire::write_all(&mut self.io, &mut slices.map(IoSlice::new)).await?;
            if ends {
                return if left == 0 {
                    Ok(!answer.last)
                } else {
                    Err(io::ErrorKind::UnexpectedEof.into())
                };
            }
            head = Vec::new();
        }
    }

    fn poll_part(&mut self, body: &mut AnyBody, head_waits: bool, cx: &mut Context<'_>) -> Poll<io::Result<Part>> {
        let shared = self.io.get_ref().shared();
        if shared.has_rest() {
            return Poll::Ready(Ok(Part::Later));
        }
        match poll_data(body, cx) {
            Poll::Ready(None) => Poll::Ready(Ok(Part::End)),
            Poll::Ready(Some(data)) => Poll::Ready(data.map(Part::Data)),
            Poll::Pending if head_waits => Poll::Ready(Ok(Part::Later)),
            Poll::Pending => {
                shared.free();
                self.poll_gone(cx).map(Err)
            }
        }
    }

    /// Ready when the peer has gone; what it says is kept.
    fn poll_gone(&mut self, cx: &mut Context<'_>) -> Poll<io::Error> {
        while self.said.len() < MAX_HEAD_BYTES {
            let mut room = [MaybeUninit::uninit(); 1 << 10];
            let mut read = ReadBuf::uninit(&mut room);
            match Pin::new(&mut self.io).poll_read(cx, &mut read) {
                Poll::Pending => return Poll::Pending,
                Poll::Ready(Err(error)) => return Poll::Ready(error),
                Poll::Ready(Ok(())) if read.filled().is_empty() => {
                    return Poll::Ready(io::ErrorKind::UnexpectedEof.into());
                }
                Poll::Ready(Ok(())) => self.said.extend_from_slice(read.filled()),
            }
        }
        Poll::Pending
    }
}

fn says_close(parts: &Parts) -> bool {
    let said = parts.headers.get(header::CONNECTION);
    said.is_some_and(|said| said.as_bytes().eq_ignore_ascii_case(b"close"))
}

/// How the end of a body is told, with the line that says so where the fields do not say it.
fn frame(method: &Method, parts: &Parts, body: &AnyBody, head: &mut Vec<u8>) -> Framing {
    let none = matches!(parts.status, StatusCode::NO_CONTENT | StatusCode::NOT_MODIFIED);
    let said = parts.headers.get(header::CONTENT_LENGTH);
    let said = said.and_then(|said| said.to_str().ok()?.parse().ok());
    let known = if body.is_end_stream() {
        Some(0)
    } else {
        body.size_hint().exact()
    };
    let asked_for = *method != Method::HEAD;
    let framing = match (said, known) {
        _ if none => Framing::None,
        (Some(length), _) => Framing::Length(length),
        (None, Some(0)) if !asked_for => Framing::None,
        (None, Some(length)) => {
            head.extend_from_slice(format!("content-length: {length}\r\n").as_bytes());
            Framing::Length(length)
        }
        (None, None) if asked_for => {
            head.extend_from_slice(b"transfer-encoding: chunked\r\n");
            Framing::Chunks
        }
        (None, None) => Framing::None,
    };
    if asked_for { framing } else { Framing::None }
}

/// The next bytes of a body.
fn poll_data(body: &mut AnyBody, cx: &mut Context<'_>) -> Poll<Option<io::Result<Bytes>>> {
    loop {
        return match Pin::new(&mut *body).poll_frame(cx) {
            Poll::Ready(Some(Ok(frame))) => match frame.into_data() {
                Ok(data) => Poll::Ready(Some(Ok(data))),
                // Trailers are nobody's here.
                Err(_) => continue,
            },
            Poll::Ready(Some(Err(error))) => Poll::Ready(Some(Err(io::Error::other(error)))),
            Poll::Ready(None) => Poll::Ready(None),
            Poll::Pending => Poll::Pending,
        };
    }
}
