//! How does an answer go over the wire? Its head, what this moment adds, and its body in one write, gathered by the system from where
//! they lie, or, when they are short, copied together.

use std::{
    cell::RefCell,
    future::poll_fn,
    io::{self, IoSlice, Write},
    mem::MaybeUninit,
    pin::Pin,
    task::{Context, Poll},
    time::{Duration, Instant, SystemTime},
};

use axum::http::{HeaderMap, Method, StatusCode};
use bytes::Bytes;
use tokio::io::{AsyncWrite, ReadBuf};

use crate::{
    epoch::since_1970,
    http::{
        blob_body::BlobBody,
        immutable::{BlobResponse, Chosen, Part, content_range},
    },
};

/// What every answer adds: a length and a range, the date.
const ADDED_BYTES: usize = 192;

/// What is no longer is copied together before it is written: that takes less time than to have the system gather it.
const COPIED_BYTES: usize = 6 << 10;

/// The first lines of a head, without its end.
pub(in crate::http) fn head_lines(status: StatusCode, headers: &HeaderMap) -> Vec<u8> {
    let mut lines = Vec::with_capacity(640);
    let reason = status.canonical_reason().unwrap_or_default();
    lines.extend_from_slice(format!("HTTP/1.1 {} {reason}\r\n", status.as_str()).as_bytes());
    for (name, value) in headers {
        for part in [name.as_str().as_bytes(), b": ", value.as_bytes(), b"\r\n"] {
            lines.extend_from_slice(part);
        }
    }
    lines
}

/// What ends a chunk.
pub(super) const CHUNK_END: &[u8] = b"\r\n";

/// What begins a chunk: its length.
pub(super) struct ChunkHead {
    line: [u8; Self::MOST_BYTES],
    length: usize,
}

impl ChunkHead {
    pub(super) const MOST_BYTES: usize = 2 * size_of::<usize>() + 2;

    pub(super) fn of(chunk_bytes: usize) -> Self {
        let mut line = [0; Self::MOST_BYTES];
        let mut left = &mut line[..];
        write!(left, "{chunk_bytes:x}\r\n").expect("it is as long as the longest length");
        let length = Self::MOST_BYTES - left.len();
        Self { line, length }
    }

    pub(super) fn bytes(&self) -> &[u8] {
        &self.line[..self.length]
    }
}

/// Ends a head, with the time.
pub(super) fn end_head(lines: &mut Vec<u8>, now: Instant) {
    thread_local! {
        /// The line, and until when it is right.
        static DATE: RefCell<(String, Option<Instant>)> = const { RefCell::new((String::new(), None)) };
    }
    DATE.with_borrow_mut(|(line, right_until)| {
        if right_until.is_none_or(|until| until <= now) {
            *line = format!("date: {}\r\n\r\n", httpdate::fmt_http_date(SystemTime::now()));
            let of_this_second = Duration::from_nanos(since_1970().subsec_nanos().into());
            *right_until = Some(now + (Duration::from_secs(1) - of_this_second));
        }
        lines.extend_from_slice(line.as_bytes());
    });
}

/// An answer with an object, to be written.
#[derive(Debug)]
pub(in crate::http) struct Ready {
    pub(in crate::http) status: StatusCode,
    /// Made once, for all such answers.
    head: Bytes,
    added: Vec<u8>,
    pub(in crate::http) body: BlobBody,
}

impl Ready {
    /// What was chosen of an object.
    pub(in crate::http) fn new(method: &Method, object: &BlobResponse, chosen: &Chosen, now: Instant) -> Self {
        let (bytes, written) = (&chosen.form.bytes, chosen.heads.written());
        let mut added = Vec::with_capacity(ADDED_BYTES);
        let (status, head, body) = match &chosen.part {
            Part::Whole if *method == Method::HEAD => (StatusCode::OK, &written.whole, BlobBody::Empty),
            Part::Whole => (StatusCode::OK, &written.whole, BlobBody::One(bytes.clone())),
            Part::Unchanged => (StatusCode::NOT_MODIFIED, &written.unchanged, BlobBody::Empty),
            Part::One(slice) => {
                let (length, range) = (slice.end - slice.start, content_range(slice, bytes.len()));
                write!(added, "content-length: {length}\r\ncontent-range: {range}\r\n").expect("a vector takes it");
                let body = bytes.slice(slice.start as usize..slice.end as usize);
                (StatusCode::PARTIAL_CONTENT, &written.slice, BlobBody::One(body))
            }
            Part::Many(_) => {
                let (parts, body) = object.respond(method, chosen).into_parts();
                (parts.status, &head_lines(parts.status, &parts.headers).into(), body)
            }
        };
        end_head(&mut added, now);
        Self {
            status,
            head: head.clone(),
            added,
            body,
        }
    }

    pub(super) async fn write<T: AsyncWrite + Unpin>(&self, io: &mut T) -> io::Result<()> {
        let (head, added) = (IoSlice::new(&self.head), IoSlice::new(&self.added));
        match &self.body {
            BlobBody::Empty => write_all(io, &mut [head, added]).await,
            BlobBody::One(bytes) => write_all(io, &mut [head, added, IoSlice::new(bytes)]).await,
            BlobBody::Many(parts) => {
                let parts = parts.iter().map(|part| IoSlice::new(part));
                write_all(io, &mut [head, added].into_iter().chain(parts).collect::<Vec<_>>()).await
            }
        }
    }
}

/// Writes all of these, together as far as that goes.
pub(super) async fn write_all<T: AsyncWrite + Unpin>(io: &mut T, mut slices: &mut [IoSlice<'_>]) -> io::Result<()> {
    // Empty ones in front are passed over.
    IoSlice::advance_slices(&mut slices, 0);
    while !slices.is_empty() {
        let written = poll_fn(|cx| poll_write(Pin::new(&mut *io), slices, cx)).await?;
        if written == 0 {
            return Err(io::ErrorKind::WriteZero.into());
        }
        IoSlice::advance_slices(&mut slices, written);
    }
    Ok(())
}

fn poll_write(io: Pin<&mut impl AsyncWrite>, slices: &[IoSlice<'_>], cx: &mut Context<'_>) -> Poll<io::Result<usize>> {
    if let [one] = slices {
        return io.poll_write(cx, one);
    }
    if slices.iter().map(|slice| slice.len()).sum::<usize>() > COPIED_BYTES {
        return io.poll_write_vectored(cx, slices);
    }
    let mut room = [MaybeUninit::uninit(); COPIED_BYTES];
    let mut whole = ReadBuf::uninit(&mut room);
    slices.iter().for_each(|slice| whole.put_slice(slice));
    io.poll_write(cx, whole.filled())
}
