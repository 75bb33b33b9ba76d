//! What is the body of an answer that holds stored bytes? Slices of them, as they lie in memory.

use std::{
    collections::VecDeque,
    convert::Infallible,
    mem,
    ops::Range,
    pin::Pin,
    task::{Context, Poll},
};

use axum::body::HttpBody;
use bytes::Bytes;
use hyper::body::{Frame, SizeHint};

/// A body of slices that are sent without being copied together.
#[derive(Debug, Default)]
pub(super) enum BlobBody {
    #[default]
    Empty,
    One(Bytes),
    Many(VecDeque<Bytes>),
}

impl BlobBody {
    /// What is still to be sent.
    pub(super) fn parts(&self) -> impl Iterator<Item = &Bytes> {
        let (one, many) = match self {
            Self::Empty => (None, None),
            Self::One(bytes) => (Some(bytes), None),
            Self::Many(parts) => (None, Some(parts)),
        };
        one.into_iter().chain(many.into_iter().flatten())
    }

    /// How many bytes that are.
    pub(super) fn len(&self) -> u64 {
        self.parts().map(|part| part.len() as u64).sum()
    }
}

/// Pieces of stored bytes that are sent one after the other.
#[derive(Debug, Default)]
pub(super) struct Pieces {
    /// What they are cut from; many are cut from one.
    sources: Vec<Bytes>,
    pieces: Vec<Piece>,
}

#[derive(Debug)]
struct Piece {
    /// Which of the sources.
    source: usize,
    range: Range<usize>,
    keep: Keep,
}

/// What may be held of a piece as long as somebody reads it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Keep {
    /// The piece itself, and so all that it was cut from.
    Shared,
    /// A copy.
    Copied,
}

impl Pieces {
    pub(super) fn with_capacity(pieces: usize) -> Self {
        Self {
            sources: Vec::with_capacity(pieces),
            pieces: Vec::with_capacity(pieces),
        }
    }

    /// Adds a part of this.
    pub(super) fn push(&mut self, source: &Bytes, range: Range<usize>, keep: Keep) {
        let same = |last: &Bytes| last.as_ptr() == source.as_ptr() && last.len() == source.len();
        // To share it once more would be counted where the threads that share it meet.
        if !self.sources.last().is_some_and(same) {
            self.sources.push(source.clone());
        }
        let source = self.sources.len() - 1;
        self.pieces.push(Piece { source, range, keep });
    }

    /// Lets go of what the last one was cut from.
    pub(super) fn let_go(&mut self) {
        if let [before @ .., last] = &mut *self.pieces
            && last.keep == Keep::Copied
        {
            let copy = Bytes::copy_from_slice(&self.sources[last.source][last.range.clone()]);
            if before.last().is_none_or(|before| before.source != last.source) {
                self.sources.pop();
            }
            (last.source, last.range) = (self.sources.len(), 0..copy.len());
            self.sources.push(copy);
        }
    }

    /// Puts one before all others.
    pub(super) fn begin_with(&mut self, first: Bytes) {
        let piece = Piece {
            source: self.sources.len(),
            range: 0..first.len(),
            keep: Keep::Copied,
        };
        self.sources.push(first);
        self.pieces.insert(0, piece);
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &[u8]> {
        self.pieces
            .iter()
            .map(|piece| &self.sources[piece.source][piece.range.clone()])
    }

    /// How many bytes they are.
    pub(super) fn len(&self) -> u64 {
        self.pieces.iter().map(|piece| piece.range.len() as u64).sum()
    }

    /// For whoever is still to read them. What is copied lies together, so that it is sent together.
    pub(super) fn kept(self) -> BlobBody {
        let mut kept = VecDeque::new();
        let mut pieces = self.pieces.iter().peekable();
        let bytes = |piece: &Piece| self.sources[piece.source].slice(piece.range.clone());
        while let Some(piece) = pieces.next() {
            if piece.keep == Keep::Shared {
                kept.push_back(bytes(piece));
                continue;
            }
            let mut copy = bytes(piece).to_vec();
            while let Some(piece) = pieces.next_if(|piece| piece.keep == Keep::Copied) {
                copy.extend_from_slice(&self.sources[piece.source][piece.range.clone()]);
            }
            kept.push_back(copy.into());
        }
        BlobBody::Many(kept)
    }
}

impl HttpBody for BlobBody {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(mut self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
        let next = match &mut *self {
            Self::Many(parts) => parts.pop_front(),
            one => match mem::take(one) {
                Self::One(bytes) => Some(bytes),
                _ => None,
            },
        };
        Poll::Ready(next.map(|part| Ok(Frame::data(part))))
    }

    fn is_end_stream(&self) -> bool {
        self.len() == 0
    }

    fn size_hint(&self) -> SizeHint {
        SizeHint::with_exact(self.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_of_pieces_says_the_same_and_holds_no_more_than_it_may() {
        let whole = Bytes::from_static(b"abcdefghij");
        for (let_go, held) in [(true, 1), (false, 5)] {
            let mut pieces = Pieces::default();
            for (range, keep) in [
                (0..2, Keep::Copied),
                (5..6, Keep::Copied),
                (2..9, Keep::Shared),
                (9..9, Keep::Copied),
                (1..2, Keep::Copied),
            ] {
                pieces.push(&whole, range, keep);
                if let_go {
                    pieces.let_go();
                }
            }
            let shared = |piece: &[u8]| whole.as_ptr_range().contains(&piece.as_ptr());
            assert_eq!(pieces.iter().filter(|piece| shared(piece)).count(), held);
            pieces.begin_with(Bytes::from_static(b"-"));
            assert_eq!(pieces.iter().collect::<Vec<_>>().concat(), b"-abfcdefghib");
            assert_eq!(pieces.len(), 12);
            let kept = pieces.kept();
            let kept: Vec<_> = kept.parts().cloned().collect();
            assert_eq!(kept, ["-abf", "cdefghi", "b"]);
            assert_eq!(
                kept.iter().map(|piece| shared(piece)).collect::<Vec<_>>(),
                [false, true, false]
            );
        }
    }
}
