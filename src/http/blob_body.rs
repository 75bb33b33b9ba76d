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
