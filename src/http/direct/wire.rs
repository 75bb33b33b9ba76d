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

use axum::http::{HeaderMap, Method, Response, StatusCode};
use bytes::Bytes;
use tokio::io::{AsyncWrite, ReadBuf};

use crate::http::{
    blob_body::{BlobBody, Pieces},
    bundle::Bundle,
    date,
    immutable::{BlobResponse, Chosen, Part, content_range},
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

/// A body that nobody else holds for its sake.
#[derive(Debug)]
enum Held<'a> {
    Nothing,
    One(&'a Bytes, Range<usize>),
    /// Put together for this answer.
    Kept(BlobBody),
    Pieces(Pieces),
}

impl<'a> Ready<'a> {
    /// What was chosen of an object.
    pub(in crate::http) fn new(method: &Method, object: &BlobResponse, chosen: &Chosen<'a>, now: Instant) -> Self {
        let (bytes, heads) = (&chosen.form.bytes, chosen.heads);
        let mut added = Cursor::new([0; ADDED_BYTES]);
        let (status, head, body) = match &chosen.part {
            Part::Whole if *method == Method::HEAD => {
                (StatusCode::OK, Cow::Borrowed(heads.written_whole()), Held::Nothing)
            }
            Part::Whole => (
                StatusCode::OK,
                Cow::Borrowed(heads.written_whole()),
                Held::One(bytes, 0..bytes.len()),
            ),
            Part::Unchanged => (
                StatusCode::NOT_MODIFIED,
                Cow::Borrowed(heads.written_unchanged()),
                Held::Nothing,
            ),
            Part::One(slice) => {
                let (length, range) = (slice.end - slice.start, content_range(slice, bytes.len()));
                write!(added, "content-length: {length}\r\ncontent-range: {range}\r\n").expect("there is room");
                let body = Held::One(bytes, slice.start as usize..slice.end as usize);
                (StatusCode::PARTIAL_CONTENT, Cow::Borrowed(heads.written_slice()), body)
            }
            Part::Many(_) => return Self::of(object.respond(method, chosen).map(Held::Kept), now),
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
    pub(in crate::http) fn bundle(bundle: Bundle, now: Instant) -> Self {
        let mut added = Cursor::new([0; ADDED_BYTES]);
        if let Some(length) = bundle.length {
            write!(added, "content-length: {length}\r\n").expect("there is room");
        }
        end_head(&mut added, now);
        Self {
            status: bundle.status(),
            head: Cow::Borrowed(bundle.written()),
            added,
            body: Held::Pieces(bundle.pieces),
        }
    }

    /// What was put together for this request.
    fn of(response: Response<Held<'a>>, now: Instant) -> Self {
        let (parts, body) = response.into_parts();
        let mut added = Cursor::new([0; ADDED_BYTES]);
        end_head(&mut added, now);
        Self {
            status: parts.status,
            head: Cow::Owned(head_lines(parts.status, &parts.headers).into()),
            added,
            body,
        }
    }

    pub(in crate::http) fn body_bytes(&self) -> u64 {
        match &self.body {
            Held::Nothing => 0,
            Held::One(_, slice) => slice.len() as u64,
            Held::Kept(body) => body.len(),
            Held::Pieces(pieces) => pieces.len(),
        }
    }

    /// Writes as much as goes at once; gives the rest.
    pub(super) fn write(
        self,
        write: impl FnOnce(&[IoSlice<'_>]) -> io::Result<usize>,
    ) -> io::Result<Option<Box<Rest>>> {
        let (head, added) = (IoSlice::new(&self.head), IoSlice::new(added_bytes(&self.added)));
        let (length, written) = match &self.body {
            Held::Nothing => write_few(&[head, added], write),
            Held::One(bytes, slice) => write_few(&[head, added, IoSlice::new(&bytes[slice.clone()])], write),
            Held::Kept(body) => write_few(&gathered([head, added], parts(body)), write),
            Held::Pieces(pieces) => write_few(&gathered([head, added], pieces.iter()), write),
        };
        let written = written?;
        let rest = || {
            let body = match self.body {
                Held::Nothing => BlobBody::Empty,
                Held::One(bytes, slice) => BlobBody::One(bytes.slice(slice)),
                Held::Kept(body) => body,
                Held::Pieces(pieces) => pieces.kept(),
            };
            Box::new(Rest {
                head: self.head.into_owned(),
                added: self.added,
                body,
                written,
            })
        };
        Ok((written < length).then(rest))
    }
}

fn added_bytes(added: &Added) -> &[u8] {
    &added.get_ref()[..added.position() as usize]
}

fn gathered<'a>(first: [IoSlice<'a>; 2], parts: impl Iterator<Item = &'a [u8]>) -> Vec<IoSlice<'a>> {
    first.into_iter().chain(parts.map(IoSlice::new)).collect()
}

fn parts(body: &BlobBody) -> impl Iterator<Item = &[u8]> {
    body.parts().map(|part| &part[..])
}

/// What of an answer did not go at once.
#[derive(Debug)]
pub(super) struct Rest {
    head: Bytes,
    added: Added,
    body: BlobBody,
    /// So many bytes of all these have gone.
    written: usize,
}

impl Rest {
    pub(super) async fn write<T: AsyncWrite + Unpin>(&self, io: &mut T) -> io::Result<()> {
        let (head, added) = (IoSlice::new(&self.head), IoSlice::new(added_bytes(&self.added)));
        write_after(self.written, io, &mut gathered([head, added], parts(&self.body))).await
    }
}

/// Writes all of these, together as far as that goes.
pub(super) async fn write_all<T: AsyncWrite + Unpin>(io: &mut T, slices: &mut [IoSlice<'_>]) -> io::Result<()> {
    // Empty ones in front are passed over.
    write_after(0, io, slices).await
}

/// The same but for the first bytes.
async fn write_after<T: AsyncWrite + Unpin>(
    first: usize,
    io: &mut T,
    mut slices: &mut [IoSlice<'_>],
) -> io::Result<()> {
    IoSlice::advance_slices(&mut slices, first);
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
