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
    /// How many bytes are still to be sent.
    pub(super) fn len(&self) -> u64 {
        match self {
            Self::Empty => 0,
            Self::One(bytes) => bytes.len() as u64,
            Self::Many(parts) => parts.iter().map(|part| part.len() as u64).sum(),
        }
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
