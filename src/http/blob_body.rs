//! What is the body of an answer that holds stored bytes? Parts of them, which are sent from where they lie and are not kept there for
//! whoever reads them slowly.

use std::{
    collections::VecDeque,
    fmt, mem,
    ops::Range,
    pin::Pin,
    task::{Context, Poll, ready},
};

use axum::body::HttpBody;
use belvedere_scene::BlobName;
use bytes::Bytes;
use hyper::body::{Frame, SizeHint};

use crate::store::{BlobStore, Coding, Representation, Rest, StoreError};

/// What is no longer is held by whoever reads it: to find it again would take more.
const HELD_BYTES: usize = 16 << 10;

/// Where the bytes of a form lie in the store.
#[derive(Debug, Clone, Copy)]
pub(super) struct Source<'a> {
    pub(super) blobs: &'a BlobStore,
    pub(super) name: &'a BlobName,
    /// The form, where it is not the blob itself.
    pub(super) variant: Option<(Coding, &'a Representation)>,
    /// Where they begin in what is stored.
    pub(super) from: usize,
}

/// What is still to be sent, without being copied together.
#[derive(Debug, Default)]
pub(super) enum BlobBody {
    #[default]
    Empty,
    One(Part),
    Many(VecDeque<Part>),
}

#[derive(Debug)]
pub(super) enum Part {
    /// Bytes that are this body's own, or short.
    Held(Bytes),
    Stored(Rest),
    /// Some of it comes.
    Coming(Rest, Reading),
}

/// A piece of what is stored, on its way.
pub(super) struct Reading(Pin<Box<dyn Future<Output = Result<Bytes, StoreError>> + Send>>);

impl fmt::Debug for Reading {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Reading").finish_non_exhaustive()
    }
}

impl Part {
    /// Some bytes of a form, all of which are these.
    pub(super) fn of(source: Source<'_>, form: &Bytes, range: Range<usize>) -> Self {
        if form.len() <= HELD_BYTES {
            // It may be cut from something large, of which nothing is kept.
            return Self::Held(source.blobs.lend(form[range].to_vec()));
        }
        let Source {
            blobs,
            name,
            variant,
            from,
        } = source;
        Self::Stored(blobs.rest(name, variant, from + range.start..from + range.end))
    }

    fn len(&self) -> usize {
        match self {
            Self::Held(bytes) => bytes.len(),
            Self::Stored(rest) | Self::Coming(rest, _) => rest.len(),
        }
    }

    fn advance(&mut self, bytes: usize) {
        match self {
            Self::Held(held) => drop(held.split_to(bytes)),
            Self::Stored(rest) | Self::Coming(rest, _) => rest.advance(bytes),
        }
    }

    /// Its first bytes, for whoever keeps them.
    fn poll_piece(&mut self, cx: &mut Context<'_>) -> Poll<Result<Bytes, StoreError>> {
        loop {
            match self {
                Self::Held(bytes) => return Poll::Ready(Ok(mem::take(bytes))),
                Self::Stored(rest) => {
                    if let Some(piece) = rest.piece_in_memory() {
                        rest.advance(piece.len());
                        return Poll::Ready(Ok(piece));
                    }
                    *self = Self::Coming(rest.clone(), Reading(Box::pin(rest.read())));
                }
                Self::Coming(rest, Reading(reading)) => {
                    let piece = ready!(reading.as_mut().poll(cx))?;
                    rest.advance(piece.len());
                    *self = Self::Stored(rest.clone());
                    return Poll::Ready(Ok(piece));
                }
            }
        }
    }
}

impl BlobBody {
    /// How many bytes are still to be sent.
    pub(super) fn len(&self) -> u64 {
        match self {
            Self::Empty => 0,
            Self::One(part) => part.len() as u64,
            Self::Many(parts) => parts.iter().map(|part| part.len() as u64).sum(),
        }
    }

    /// The first part of which something is still to be sent.
    fn first(&mut self) -> Option<&mut Part> {
        match self {
            Self::Empty => None,
            Self::One(part) => (part.len() > 0).then_some(part),
            Self::Many(parts) => {
                while parts.front().is_some_and(|part| part.len() == 0) {
                    parts.pop_front();
                }
                parts.front_mut()
            }
        }
    }

    /// The first of these bytes were sent.
    pub(super) fn advance(&mut self, mut bytes: usize) {
        while bytes > 0
            && let Some(part) = self.first()
        {
            let sent = bytes.min(part.len());
            part.advance(sent);
            bytes -= sent;
        }
    }

    /// The next bytes, for whoever writes what goes now and keeps none: none if they are not in memory, or there are no more.
    pub(super) fn now(&mut self) -> Option<Bytes> {
        match self.first()? {
            Part::Held(bytes) => Some(bytes.clone()),
            Part::Stored(rest) => rest.in_memory(),
            Part::Coming(..) => None,
        }
    }

    /// Reads the next bytes, which this body holds then.
    pub(super) async fn fetch(&mut self) -> Result<(), StoreError> {
        if let Some(Part::Stored(rest)) = self.first() {
            let piece = rest.read().await?;
            rest.advance(piece.len());
            match self {
                Self::Many(parts) => parts.push_front(Part::Held(piece)),
                one => {
                    if let Self::One(rest) = mem::take(one) {
                        *one = Self::Many([Part::Held(piece), rest].into());
                    }
                }
            }
        }
        Ok(())
    }
}

impl HttpBody for BlobBody {
    type Data = Bytes;
    type Error = StoreError;

    fn poll_frame(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Option<Result<Frame<Bytes>, StoreError>>> {
        let Some(part) = self.first() else {
            return Poll::Ready(None);
        };
        let piece = ready!(part.poll_piece(cx));
        Poll::Ready(Some(piece.map(Frame::data)))
    }

    fn is_end_stream(&self) -> bool {
        self.len() == 0
    }

    fn size_hint(&self) -> SizeHint {
        SizeHint::with_exact(self.len())
    }
}

/// Puts a body together of many parts: what is short is copied together, so that it is sent together.
#[derive(Debug)]
pub(super) struct Keeping<'a> {
    blobs: &'a BlobStore,
    parts: VecDeque<Part>,
    copied: Vec<u8>,
}

impl<'a> Keeping<'a> {
    pub(super) fn new(blobs: &'a BlobStore) -> Self {
        Self {
            blobs,
            parts: VecDeque::new(),
            copied: Vec::new(),
        }
    }

    /// Adds some of these bytes, which begin there in a blob.
    pub(super) fn add(&mut self, name: &BlobName, from: usize, bytes: &[u8], range: Range<usize>) {
        if range.len() <= HELD_BYTES && !self.blobs.has_lent_much() {
            self.copied.extend_from_slice(&bytes[range]);
        } else {
            self.end_copy();
            let stored = from + range.start..from + range.end;
            self.parts.push_back(Part::Stored(self.blobs.rest(name, None, stored)));
        }
    }

    /// Adds what is stored nowhere.
    pub(super) fn add_own(&mut self, bytes: &[u8]) {
        self.copied.extend_from_slice(bytes);
    }

    fn end_copy(&mut self) {
        if !self.copied.is_empty() {
            let copied = self.blobs.lend(mem::take(&mut self.copied));
            self.parts.push_back(Part::Held(copied));
        }
    }

    pub(super) fn done(mut self) -> BlobBody {
        self.end_copy();
        BlobBody::Many(self.parts)
    }

    /// The same after what is stored nowhere.
    pub(super) fn done_after(mut self, first: Bytes) -> BlobBody {
        self.end_copy();
        self.parts.push_front(Part::Held(first));
        BlobBody::Many(self.parts)
    }
}

/// Pieces of bytes in memory that are sent one after the other.
#[derive(Debug, Default)]
pub(super) struct Pieces {
    /// What they are cut from, and where that begins in which blob; many are cut from one.
    sources: Vec<(Option<(BlobName, usize)>, Bytes)>,
    pieces: Vec<Piece>,
}

#[derive(Debug)]
struct Piece {
    /// Which of the sources.
    source: usize,
    range: Range<usize>,
}

impl Pieces {
    pub(super) fn with_capacity(pieces: usize) -> Self {
        Self {
            sources: Vec::with_capacity(pieces),
            pieces: Vec::with_capacity(pieces),
        }
    }

    /// Adds some of these bytes, which begin there in a blob.
    pub(super) fn push(&mut self, name: &BlobName, from: usize, bytes: &Bytes, range: Range<usize>) {
        let same = |last: &Bytes| last.as_ptr() == bytes.as_ptr() && last.len() == bytes.len();
        // To share it once more would be counted where the threads that share it meet.
        if !self.sources.last().is_some_and(|(_, last)| same(last)) {
            self.sources.push((Some((name.clone(), from)), bytes.clone()));
        }
        let source = self.sources.len() - 1;
        self.pieces.push(Piece { source, range });
    }

    /// Adds what is stored nowhere.
    pub(super) fn push_own(&mut self, bytes: Bytes) {
        let piece = self.own(bytes);
        self.pieces.push(piece);
    }

    /// Puts what is stored nowhere before all others.
    pub(super) fn begin_with(&mut self, bytes: Bytes) {
        let piece = self.own(bytes);
        self.pieces.insert(0, piece);
    }

    fn own(&mut self, bytes: Bytes) -> Piece {
        let (source, range) = (self.sources.len(), 0..bytes.len());
        self.sources.push((None, bytes));
        Piece { source, range }
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &[u8]> {
        self.pieces
            .iter()
            .map(|piece| &self.sources[piece.source].1[piece.range.clone()])
    }

    /// How many bytes they are.
    pub(super) fn len(&self) -> u64 {
        self.pieces.iter().map(|piece| piece.range.len() as u64).sum()
    }

    /// For whoever is still to read them.
    pub(super) fn kept(self, blobs: &BlobStore) -> BlobBody {
        let mut kept = Keeping::new(blobs);
        for Piece { source, range } in self.pieces {
            match &self.sources[source] {
                (Some((name, from)), bytes) => kept.add(name, *from, bytes, range),
                (None, own) => kept.add_own(&own[range]),
            }
        }
        kept.done()
    }
}

#[cfg(test)]
mod tests {
    use http_body_util::BodyExt;

    use super::*;

    #[tokio::test]
    async fn what_is_kept_of_pieces_says_the_same_and_holds_what_is_short() {
        let data = tempfile::tempdir().unwrap();
        let blobs = BlobStore::open_folder(data.path(), 64 << 20).await.unwrap();
        let whole: Bytes = (0..100_000u32).flat_map(u32::to_le_bytes).collect();
        let name = BlobName::of(&whole, "bin").unwrap();
        blobs.put(&name, whole.clone()).await.unwrap();
        let source = Source {
            blobs: &blobs,
            name: &name,
            variant: None,
            from: 0,
        };
        let part = Part::of(source, &whole, 1_000..300_000);
        assert!(part.len() == 299_000 && whole.is_unique());
        let pieces = || {
            let mut pieces = Pieces::default();
            pieces.push(&name, 0, &whole, 0..200);
            pieces.push(&name, 0, &whole, 5..5);
            pieces.push(&name, 0, &whole, 1_000..399_000);
            pieces.push_own(Bytes::from_static(b"-"));
            pieces.push(&name, 0, &whole, 7..9);
            pieces.begin_with(Bytes::from_static(b"first"));
            pieces
        };
        let said = pieces().iter().collect::<Vec<_>>().concat();
        assert_eq!(pieces().len(), said.len() as u64);
        let kept = pieces().kept(&blobs);
        assert_eq!(
            blobs.cache_use().lent_bytes,
            5 + 200 + 1 + 2,
            "what is long is not held"
        );
        assert!(kept.collect().await.unwrap().to_bytes() == said);
        for sent in [0, 3, 205, 1_205, 300_000, 398_207] {
            let mut kept = pieces().kept(&blobs);
            kept.advance(sent);
            assert_eq!(kept.len(), (said.len() - sent) as u64);
            let mut rest = Vec::new();
            while kept.len() > 0 {
                if let Some(bytes) = kept.now() {
                    // As little goes as a busy line takes.
                    let goes = bytes.len().min(50_000);
                    rest.extend_from_slice(&bytes[..goes]);
                    kept.advance(goes);
                } else {
                    kept.fetch().await.unwrap();
                }
            }
            assert!(rest == said[sent..]);
        }
        assert_eq!(blobs.cache_use().lent_bytes, 0);
    }

    #[tokio::test]
    async fn a_body_whose_form_is_stored_anew_ends_with_an_error_and_not_with_other_bytes() {
        let data = tempfile::tempdir().unwrap();
        // The cache has room for nothing.
        let blobs = BlobStore::open_folder(data.path(), 16 << 10).await.unwrap();
        let digits = (0..120_000u32).flat_map(|n| format!("{:08x}", n.wrapping_mul(2_654_435_761)).into_bytes());
        let whole: Bytes = digits.collect();
        let name = BlobName::of(&whole, "json").unwrap();
        blobs.put(&name, whole.clone()).await.unwrap();
        let coding = Coding::Gzip;
        let forms = blobs.forms(&name, Some(coding)).await.unwrap().unwrap();
        blobs.load(&name, &forms, Some(coding)).await.unwrap();
        let form = forms.of(Some(coding)).unwrap();
        let source = Source {
            blobs: &blobs,
            name: &name,
            variant: Some((coding, form)),
            from: 0,
        };
        let mut body = BlobBody::One(Part::of(source, &form.bytes, 0..form.bytes.len()));
        let begun = form.bytes.clone();
        drop(forms);
        let first = body.frame().await.unwrap().unwrap().into_data().unwrap();
        assert!(first.len() < begun.len() && first == begun[..first.len()]);
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        std::io::Write::write_all(&mut encoder, &whole).unwrap();
        let file = data.path().join("o").join(format!("{name}.gz"));
        std::fs::write(&file, encoder.finish().unwrap()).unwrap();
        assert_eq!(body.len(), (begun.len() - first.len()) as u64);
        let ended = body.frame().await.unwrap();
        assert!(matches!(ended, Err(StoreError::Changed { .. })), "{ended:?}");
    }
}
