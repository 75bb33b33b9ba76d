//! What does a session's reader hear? Its events as they come, and a beat when there are none, so that nobody on the way
//! takes the stream for dead.

use std::{
    pin::Pin,
    sync::{Arc, atomic::Ordering},
    task::{Context, Poll},
    time::{Duration, Instant},
};

use bytes::Bytes;
use futures_util::Stream;
use tokio::time::Sleep;

use super::{
    Tally,
    line::Line,
    outbox::{End, Outbox},
};

const BEAT: Duration = Duration::from_secs(15);

/// The event stream of a session (`text/event-stream`), piece by piece.
#[derive(Debug)]
pub struct EventReader {
    outbox: Arc<Outbox>,
    tally: Arc<Tally>,
    number: u64,
    /// At most [`BEAT`], and often enough to keep the session's lease.
    between_beats: Duration,
    /// Looked at when it fires, and not set anew with each event.
    beat: Pin<Box<Sleep>>,
    greeted: bool,
}

impl EventReader {
    pub(super) fn attach(outbox: Arc<Outbox>, tally: Arc<Tally>, last_seen: Option<u64>, lease: Duration) -> Self {
        let between_beats = BEAT.min(lease / 2);
        Self {
            number: outbox.attach(last_seen),
            outbox,
            tally,
            between_beats,
            beat: Box::pin(tokio::time::sleep(between_beats)),
            greeted: false,
        }
    }

    /// The way past this stream.
    #[must_use]
    pub fn shortcut(&self) -> Shortcut {
        Shortcut {
            outbox: self.outbox.clone(),
            number: self.number,
        }
    }
}

/// The way past a stream to its reader. Cheap to clone.
#[derive(Debug, Clone)]
pub struct Shortcut {
    outbox: Arc<Outbox>,
    number: u64,
}

impl Shortcut {
    /// Whoever takes the stream lays this line, and writes to the same place. Poses may go into the line as soon as a look into
    /// the stream has found nothing, and until it finds something; none does any more when the stream has been dropped.
    pub fn lay(&self, line: Arc<dyn Line>) {
        self.outbox.lay(self.number, line);
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
        if polled.is_ready() {
            return polled;
        }
        while self.beat.as_mut().poll(cx).is_ready() {
            let (now, due) = (Instant::now(), self.outbox.told_at() + self.between_beats);
            if due > now {
                self.beat.as_mut().reset(due.into());
                continue;
            }
            self.outbox.beat();
            let next = now + self.between_beats;
            self.beat.as_mut().reset(next.into());
            return Poll::Ready(Some(Bytes::from_static(b": beat\n\n")));
        }
        Poll::Pending
    }
}

impl Drop for EventReader {
    fn drop(&mut self) {
        let streams = &self.tally.streams;
        let counted = match self.outbox.detach(self.number) {
            End::Cut => &streams.cut,
            End::Replaced => &streams.replaced,
            End::Over => &streams.over,
        };
        counted.fetch_add(1, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use std::future::poll_fn;

    use super::*;
    use belvedere_live::event::{Event, Gone};

    #[tokio::test]
    async fn streams_that_end_are_counted_by_why() {
        let (outbox, tally) = (Arc::new(Outbox::default()), Arc::<Tally>::default());
        let attach = || EventReader::attach(outbox.clone(), tally.clone(), None, BEAT);
        let ended = || {
            let streams = &tally.streams;
            [&streams.cut, &streams.replaced, &streams.over].map(|count| count.load(Ordering::Relaxed))
        };
        let first = attach();
        let second = attach();
        drop(first);
        assert_eq!(ended(), [0, 1, 0], "another one took its place");
        drop(second);
        assert_eq!(ended(), [1, 1, 0], "its connection ended");
        let third = attach();
        outbox.close();
        drop(third);
        assert_eq!(ended(), [1, 1, 1], "the session ended");
    }

    #[tokio::test]
    async fn beats_come_when_nothing_was_said_for_as_long() {
        const LEASE: Duration = Duration::from_millis(200);
        let outbox = Arc::new(Outbox::default());
        let mut reader = EventReader::attach(outbox.clone(), Arc::default(), None, LEASE);
        let mut hear = async || poll_fn(|cx| Pin::new(&mut reader).poll_next(cx)).await.unwrap();
        assert!(hear().await.starts_with(b"retry"));
        for _ in 0..4 {
            // Whoever is told something needs no beat yet.
            tokio::time::sleep(LEASE / 4).await;
            let (objects, reason) = (vec![], Gone::Hidden);
            outbox.push(&Event::ObjectGone { objects, reason });
            assert!(hear().await.starts_with(b"id:"));
        }
        let silent = Instant::now();
        for beats in 1..3 {
            assert_eq!(hear().await, ": beat\n\n");
            assert!(silent.elapsed() >= LEASE / 2 * beats);
        }
        assert!(outbox.silent_for() < LEASE, "a stream that is read keeps the lease");
    }
}
