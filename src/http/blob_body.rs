//! What is the body of an answer that holds stored bytes? Slices of them, as they lie in memory.

use std::{
    collections::VecDeque,
    convert::Infallible,
    mem,
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
pub(super) struct Pieces(Vec<(Bytes, Keep)>);

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
        Self(Vec::with_capacity(pieces))
    }

    pub(super) fn push(&mut self, piece: Bytes, keep: Keep) {
        self.0.push((piece, keep));
    }

    /// Lets go of what the last one was cut from.
    pub(super) fn let_go(&mut self) {
        if let Some((piece, Keep::Copied)) = self.0.last_mut() {
            *piece = Bytes::copy_from_slice(piece);
        }
    }

    /// Puts one before all others.
    pub(super) fn begin_with(&mut self, first: Bytes) {
        self.0.insert(0, (first, Keep::Copied));
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &Bytes> {
        self.0.iter().map(|(piece, _)| piece)
    }

    /// How many bytes they are.
    pub(super) fn len(&self) -> u64 {
        self.iter().map(|piece| piece.len() as u64).sum()
    }

    /// For whoever is still to read them. What is copied lies together, so that it is sent together.
    pub(super) fn kept(self) -> BlobBody {
        let mut kept = VecDeque::new();
        let mut pieces = self.0.into_iter().peekable();
        while let Some((piece, keep)) = pieces.next() {
            if keep == Keep::Shared {
                kept.push_back(piece);
                continue;
            }
            let mut copy = piece.to_vec();
            while let Some((piece, _)) = pieces.next_if(|(_, keep)| *keep == Keep::Copied) {
                copy.extend_from_slice(&piece);
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
        let mut pieces = Pieces::default();
        for (range, keep) in [
            (0..2, Keep::Copied),
            (5..6, Keep::Copied),
            (2..9, Keep::Shared),
            (9..9, Keep::Copied),
            (1..2, Keep::Copied),
        ] {
            pieces.push(whole.slice(range), keep);
            pieces.let_go();
        }
        let shared = |piece: &Bytes| whole.as_ptr_range().contains(&piece.as_ptr());
        assert_eq!(pieces.iter().filter(|piece| shared(piece)).count(), 1);
        assert_eq!(pieces.len(), 11);
        let kept = pieces.kept();
        let kept: Vec<_> = kept.parts().cloned().collect();
        assert_eq!(kept, ["abf", "cdefghi", "b"]);
        assert_eq!(kept.iter().map(shared).collect::<Vec<_>>(), [false, true, false]);
    }
}
