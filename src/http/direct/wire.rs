//! How does an answer go over the wire? Its head, what this moment adds, and its body in one write, gathered by the system from where
//! they lie, or, when they are short, copied together.

use std::{
    borrow::Cow,
    future::poll_fn,
    io::{self, Cursor, IoSlice, Write},
    mem::MaybeUninit,
    ops::Range,
    pin::Pin,
    task::{Context, Poll},
    time::Instant,
};

use axum::http::{HeaderMap, Method, StatusCode};
use bytes::{Buf, Bytes};
use tokio::io::{AsyncWrite, ReadBuf};

use super::socket::Socket;
use crate::http::{
    blob_body::{BlobBody, Part as BodyPart, Pieces, Source},
    bundle::Bundle,
    date,
    immutable::{BlobResponse, Chosen, Part, content_range},
    quiet::Quiet,
};
use crate::store::BlobStore;

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
    from: usize,
}

impl ChunkHead {
    pub(super) const MOST_BYTES: usize = 2 * size_of::<usize>() + 2;

    pub(super) fn of(chunk_bytes: usize) -> Self {
        const DIGITS: &[u8; 16] = b"0123456789abcdef";
        let (mut line, mut from, mut left) = ([0; Self::MOST_BYTES], Self::MOST_BYTES - 2, chunk_bytes);
        line[from..].copy_from_slice(b"\r\n");
        loop {
            from -= 1;
            line[from] = DIGITS[left % 16];
            left /= 16;
            if left == 0 {
                return Self { line, from };
            }
        }
    }

    pub(super) fn bytes(&self) -> &[u8] {
        &self.line[self.from..]
    }
}

/// Ends a head, with the time.
pub(super) fn end_head(lines: &mut impl Write, now: Instant) {
    date::with(now, |date| {
        for part in [b"date: ", date.as_bytes(), b"\r\n\r\n"] {
            lines.write_all(part).expect("there is room");
        }
    });
}

/// An answer with an object, as it lies in memory.
#[derive(Debug)]
pub(in crate::http) struct Ready<'a> {
    pub(in crate::http) status: StatusCode,
    /// Made once, for all such answers.
    head: Cow<'a, Bytes>,
    added: Added,
    body: Held<'a>,
}

/// What an answer adds to its head.
type Added = Cursor<[u8; ADDED_BYTES]>;

/// A body as it lies in memory, which nobody holds there for its sake.
#[derive(Debug)]
enum Held<'a> {
    Nothing,
    One(Source<'a>, &'a Bytes, Range<usize>),
    Pieces(&'a BlobStore, Pieces),
}

impl<'a> Ready<'a> {
    /// What was chosen of an object.
    pub(in crate::http) fn new(method: &Method, object: &BlobResponse<'a>, chosen: &Chosen<'a>, now: Instant) -> Self {
        let (bytes, heads) = (&chosen.form.bytes, chosen.heads);
        let mut added = Cursor::new([0; ADDED_BYTES]);
        let (status, head, body) = match &chosen.part {
            Part::Whole if *method == Method::HEAD => {
                (StatusCode::OK, Cow::Borrowed(heads.written_whole()), Held::Nothing)
            }
            Part::Whole => (
                StatusCode::OK,
                Cow::Borrowed(heads.written_whole()),
                Held::One(object.source(chosen), bytes, 0..bytes.len()),
            ),
            Part::Unchanged => (
                StatusCode::NOT_MODIFIED,
                Cow::Borrowed(heads.written_unchanged()),
                Held::Nothing,
            ),
            Part::One(slice) => {
                let (length, range) = (slice.end - slice.start, content_range(slice, bytes.len()));
                write!(added, "content-length: {length}\r\ncontent-range: {range}\r\n").expect("there is room");
                let slice = slice.start as usize..slice.end as usize;
                let body = Held::One(object.source(chosen), bytes, slice);
                (StatusCode::PARTIAL_CONTENT, Cow::Borrowed(heads.written_slice()), body)
            }
            Part::Many(slices) => {
                let (headers, pieces) = object.slices(chosen.form, heads, slices);
                let status = StatusCode::PARTIAL_CONTENT;
                let head = head_lines(status, &headers).into();
                (status, Cow::Owned(head), Held::Pieces(object.blobs, pieces))
            }
        };
        end_head(&mut added, now);
        Self {
            status,
            head,
            added,
            body,
        }
    }

    /// Many things at once.
    pub(in crate::http) fn bundle(blobs: &'a BlobStore, bundle: Bundle, now: Instant) -> Self {
        let mut added = Cursor::new([0; ADDED_BYTES]);
        if let Some(length) = bundle.length {
            write!(added, "content-length: {length}\r\n").expect("there is room");
        }
        end_head(&mut added, now);
        Self {
            status: bundle.status(),
            head: Cow::Borrowed(bundle.written()),
            added,
            body: Held::Pieces(blobs, bundle.pieces),
        }
    }

    pub(in crate::http) fn body_bytes(&self) -> u64 {
        match &self.body {
            Held::Nothing => 0,
            Held::One(_, _, slice) => slice.len() as u64,
            Held::Pieces(_, pieces) => pieces.len(),
        }
    }

    /// Writes as much as goes at once; gives the rest.
    pub(super) fn write(
        self,
        write: impl FnOnce(&[IoSlice<'_>]) -> io::Result<usize>,
    ) -> io::Result<Option<Box<Unsent>>> {
        let (head, added) = (IoSlice::new(&self.head), IoSlice::new(added_bytes(&self.added)));
        let (length, written) = match &self.body {
            Held::Nothing => write_few(&[head, added], write),
            Held::One(_, bytes, slice) => write_few(&[head, added, IoSlice::new(&bytes[slice.clone()])], write),
            Held::Pieces(_, pieces) => write_few(&gathered([head, added], pieces.iter()), write),
        };
        let written = written?;
        Ok((written < length).then(|| self.rest(written)))
    }

    /// What is left when so many bytes have gone.
    fn rest(self, written: usize) -> Box<Unsent> {
        let head = [&self.head[..], added_bytes(&self.added)].concat();
        let mut body = match self.body {
            Held::Nothing => BlobBody::Empty,
            Held::One(source, bytes, slice) => BlobBody::One(BodyPart::of(source, bytes, slice)),
            Held::Pieces(blobs, pieces) => pieces.kept(blobs),
        };
        let of_head = written.min(head.len());
        body.advance(written - of_head);
        let head = Bytes::from(head).slice(of_head..);
        Box::new(Unsent { head, body })
    }
}

fn added_bytes(added: &Added) -> &[u8] {
    &added.get_ref()[..added.position() as usize]
}

fn gathered<'a>(first: [IoSlice<'a>; 2], parts: impl Iterator<Item = &'a [u8]>) -> Vec<IoSlice<'a>> {
    first.into_iter().chain(parts.map(IoSlice::new)).collect()
}

/// What of an answer did not go at once.
#[derive(Debug)]
pub(super) struct Unsent {
    head: Bytes,
    body: BlobBody,
}

impl Unsent {
    /// Writes it as the peer takes it. While it takes nothing, no more than a piece that is lent is held for it.
    pub(super) async fn write(mut self, io: &mut Quiet<Socket>) -> io::Result<()> {
        while !self.head.is_empty() || self.body.len() > 0 {
            poll_fn(|cx| io.poll_ready(cx, Socket::poll_writable)).await?;
            let Some(bytes) = self.body.now().or_else(|| (self.body.len() == 0).then(Bytes::new)) else {
                self.body.fetch().await.map_err(io::Error::other)?;
                continue;
            };
            let slices = [IoSlice::new(&self.head), IoSlice::new(&bytes)];
            let written = io.write_now(|socket| socket.write_now(&slices))?;
            let of_head = written.min(self.head.len());
            self.head.advance(of_head);
            self.body.advance(written - of_head);
        }
        Ok(())
    }
}

/// Writes all of these, together as far as that goes.
pub(super) async fn write_all<T: AsyncWrite + Unpin>(io: &mut T, slices: &mut [IoSlice<'_>]) -> io::Result<()> {
    let mut slices = slices;
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
    let write = |slices: &[IoSlice<'_>]| match slices {
        [one] => io.poll_write(cx, one),
        many => io.poll_write_vectored(cx, many),
    };
    write_few(slices, write).1
}

/// Writes these as one where they are short; says how many bytes they are.
fn write_few<R>(slices: &[IoSlice<'_>], write: impl FnOnce(&[IoSlice<'_>]) -> R) -> (usize, R) {
    let length = slices.iter().map(|slice| slice.len()).sum();
    if slices.len() == 1 || length > COPIED_BYTES {
        return (length, write(slices));
    }
    let mut room = [MaybeUninit::uninit(); COPIED_BYTES];
    let mut whole = ReadBuf::uninit(&mut room);
    slices.iter().for_each(|slice| whole.put_slice(slice));
    (length, write(&[IoSlice::new(whole.filled())]))
}
