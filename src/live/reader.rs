//! What does a session's reader hear? Its events as they come, and a beat when there are none, so that nobody on the way
//! takes the stream for dead.

use std::{
    pin::Pin,
    sync::Arc,
    task::{Context, Poll},
    time::Duration,
};

use bytes::Bytes;
use futures_util::Stream;
use tokio::time::{Instant, Sleep};

use super::outbox::Outbox;

const BEAT: Duration = Duration::from_secs(15);

/// The event stream of a session (`text/event-stream`), piece by piece.
#[derive(Debug)]
pub struct EventReader {
    outbox: Arc<Outbox>,
    number: u64,
    /// At most [`BEAT`], and often enough to keep the session's lease.
    between_beats: Duration,
    beat: Pin<Box<Sleep>>,
    greeted: bool,
}

impl EventReader {
    pub(super) fn attach(outbox: Arc<Outbox>, last_seen: Option<u64>, lease: Duration) -> Self {
        let between_beats = BEAT.min(lease / 2);
        Self {
            number: outbox.attach(last_seen),
            outbox,
            between_beats,
            beat: Box::pin(tokio::time::sleep(between_beats)),
            greeted: false,
        }
    }
}

impl Stream for EventReader {
    type Item = Bytes;

    fn poll_next(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Option<Bytes>> {
        if !self.greeted {
            // A first byte at once, and how soon to come back.
            self.greeted = true;
            return Poll::Ready(Some(Bytes::from_static(b"retry: 1000\n\n")));
        }
        let polled = self.outbox.poll(self.number, cx);
        if polled.is_pending() && self.beat.as_mut().poll(cx).is_pending() {
            return Poll::Pending;
        }
        let next = Instant::now() + self.between_beats;
        self.beat.as_mut().reset(next);
        if polled.is_pending() {
            self.outbox.sign();
            return Poll::Ready(Some(Bytes::from_static(b": beat\n\n")));
        }
        polled
    }
}

impl Drop for EventReader {
    fn drop(&mut self) {
        self.outbox.detach(self.number);
    }
}
