//! What has a session not heard yet?
//!
//! Events that must not be lost wait in a queue; poses wait in a table with one place for each mover, where the newest
//! wins. A reader gets the queue first and the poses after it, so that a pose never names a mover whose info is still to
//! come, or that is gone. What it got stays in a ring for a while, under its number, for a reader that was cut off.
//!
//! Both are bounded: when too much waits or too much was missed, everything is dropped, and the rules are asked to tell
//! all anew, once there is a reader. So a stuck reader costs this much memory, and nobody else anything.

use std::{
    collections::{BTreeMap, VecDeque},
    fmt::Write,
    sync::{Mutex, MutexGuard},
    task::{Context, Poll, Waker},
    time::{Duration, Instant},
};

use belvedere_live::{
    Ms,
    event::{Event, Void},
};
use belvedere_scene::ObjectId;
use bytes::Bytes;

use super::poses::{self, Poses};

/// So many bytes may wait for a reader.
const QUEUE_BYTES: usize = 256 << 10;
/// So many bytes are kept for one that comes back.
const RING_BYTES: usize = 64 << 10;
/// A piece of the stream is cut at the first event beyond this.
const PIECE_BYTES: usize = 32 << 10;

/// The events of one session.
#[derive(Debug, Default)]
pub(super) struct Outbox(Mutex<State>);

#[derive(Debug)]
struct State {
    /// Names and data of events to be read.
    queue: VecDeque<(&'static str, String)>,
    queue_bytes: usize,
    /// The newest of each mover, as they are written.
    poses: BTreeMap<ObjectId, Bytes>,
    poses_at_ms: Ms,
    /// What was read, or is to be read again, by number.
    ring: VecDeque<(u64, Bytes)>,
    ring_bytes: usize,
    /// The number of the next event.
    next: u64,
    /// The number of the next event to be read again; `next` when there is none.
    again: u64,
    missed: Option<Void>,
    reader: Reader,
    closed: bool,
    last_sign: Instant,
}

#[derive(Debug, Default)]
struct Reader {
    /// Which reader is the last one.
    number: u64,
    attached: bool,
    waker: Option<Waker>,
}

impl Default for State {
    fn default() -> Self {
        Self {
            queue: VecDeque::new(),
            queue_bytes: 0,
            poses: BTreeMap::new(),
            poses_at_ms: 0,
            ring: VecDeque::new(),
            ring_bytes: 0,
            next: 1,
            again: 1,
            missed: None,
            reader: Reader::default(),
            closed: false,
            last_sign: Instant::now(),
        }
    }
}

impl Outbox {
    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().expect("nobody panics while holding this lock")
    }

    /// Puts an event in.
    pub(super) fn push(&self, event: &Event) {
        self.push_with(event, &mut Poses::default());
    }

    /// The same for one of many that are told of the same poses.
    pub(super) fn push_with(&self, event: &Event, poses: &mut Poses) {
        let mut state = self.state();
        match event {
            Event::Resync { .. } => state.clear(),
            _ if state.missed.is_some() => return,
            Event::ObjectPos { t_ms, objects } => {
                let written = objects.iter().map(|told| (told.object, poses.written(told)));
                state.poses.extend(written);
                state.poses_at_ms = *t_ms;
                return state.wake();
            }
            Event::ObjectGone { objects, .. } => objects.iter().for_each(|object| {
                state.poses.remove(object);
            }),
            _ => {}
        }
        let data = serde_json::to_string(event).expect("an event holds nothing that JSON cannot say");
        state.queue_bytes += data.len();
        state.queue.push_back((event.name(), data));
        if state.queue_bytes > QUEUE_BYTES {
            state.miss(Void::Missed);
        }
        state.wake();
    }

    /// Whether more than half of the room is left.
    pub(super) fn has_room(&self) -> bool {
        self.state().queue_bytes < QUEUE_BYTES / 2
    }

    /// Why a reader that is there must be told everything anew; none when it need not be.
    pub(super) fn wants_resync(&self) -> Option<Void> {
        let state = self.state();
        state.missed.filter(|_| state.reader.attached)
    }

    /// The session has ended: its reader hears what waits, and then the end.
    pub(super) fn close(&self) {
        let mut state = self.state();
        state.closed = true;
        state.wake();
    }

    /// The session has shown that it lives.
    pub(super) fn sign(&self) {
        self.state().last_sign = Instant::now();
    }

    /// How long it has not.
    pub(super) fn silent_for(&self) -> Duration {
        self.state().last_sign.elapsed()
    }

    /// Makes way for a reader that has heard everything up to `last_seen`; gives its number.
    pub(super) fn attach(&self, last_seen: Option<u64>) -> u64 {
        let mut state = self.state();
        let (oldest, next) = (state.ring.front().map_or(state.next, |(number, _)| *number), state.next);
        match last_seen {
            Some(last_seen) if (oldest..=next).contains(&last_seen.saturating_add(1)) => state.again = last_seen + 1,
            // Nobody has heard anything yet.
            None if next == 1 => {}
            Some(_) => state.miss(Void::Missed),
            None => state.miss(Void::Unknown),
        }
        state.wake();
        state.last_sign = Instant::now();
        state.reader.number += 1;
        state.reader.attached = true;
        state.reader.number
    }

    pub(super) fn detach(&self, reader: u64) {
        let mut state = self.state();
        if state.reader.number == reader {
            state.reader = Reader {
                number: reader,
                ..Reader::default()
            };
        }
    }

    /// The next piece of the stream; none when it has ended for this reader.
    pub(super) fn poll(&self, reader: u64, cx: &Context<'_>) -> Poll<Option<Bytes>> {
        let mut state = self.state();
        if state.reader.number != reader {
            return Poll::Ready(None);
        }
        if let Some(piece) = state.piece() {
            state.last_sign = Instant::now();
            return Poll::Ready(Some(piece));
        }
        if state.closed {
            return Poll::Ready(None);
        }
        state.reader.waker = Some(cx.waker().clone());
        Poll::Pending
    }
}

impl State {
    fn wake(&mut self) {
        if let Some(waker) = self.reader.waker.take() {
            waker.wake();
        }
    }

    fn clear(&mut self) {
        self.queue.clear();
        self.queue_bytes = 0;
        self.poses.clear();
        self.ring.clear();
        self.ring_bytes = 0;
        self.again = self.next;
        self.missed = None;
    }

    fn miss(&mut self, why: Void) {
        self.clear();
        self.missed = Some(why);
    }

    /// Takes out what is to be read next.
    fn piece(&mut self) -> Option<Bytes> {
        let mut piece = Piece::default();
        while self.again < self.next && piece.has_room() {
            let oldest = self.ring.front().map_or(self.next, |(number, _)| *number);
            if let Some((_, bytes)) = self.ring.get((self.again - oldest) as usize) {
                piece.add(bytes.clone());
            }
            self.again += 1;
        }
        while piece.has_room()
            && let Some((name, data)) = self.queue.pop_front()
        {
            self.queue_bytes -= data.len();
            piece.add(self.numbered(name, &data));
        }
        if self.queue.is_empty() {
            // Most sessions have nothing to wait for most of the time.
            self.queue = VecDeque::new();
        }
        if piece.has_room() && !self.poses.is_empty() {
            let poses = std::mem::take(&mut self.poses);
            let data = poses::data(self.poses_at_ms, poses.into_values().collect::<Vec<_>>().into_iter());
            piece.add(self.numbered("object-pos", &data));
        }
        piece.whole()
    }

    /// An event as it is sent, kept for readers that come back.
    fn numbered(&mut self, name: &str, data: &str) -> Bytes {
        let mut text = String::with_capacity(data.len() + name.len() + 40);
        _ = write!(text, "id: {}\nevent: {name}\ndata: {data}\n\n", self.next);
        // Without the room that was not needed: it is kept.
        let bytes = Bytes::from(text.into_boxed_str().into_boxed_bytes());
        self.ring.push_back((self.next, bytes.clone()));
        self.ring_bytes += bytes.len();
        self.next += 1;
        self.again = self.next;
        while self.ring_bytes > RING_BYTES
            && let Some((_, oldest)) = self.ring.pop_front()
        {
            self.ring_bytes -= oldest.len();
        }
        bytes
    }
}

/// Events that are sent together. One alone is not copied.
#[derive(Default)]
struct Piece {
    first: Bytes,
    all: Vec<u8>,
}

impl Piece {
    fn has_room(&self) -> bool {
        self.first.len().max(self.all.len()) < PIECE_BYTES
    }

    fn add(&mut self, event: Bytes) {
        if self.first.is_empty() {
            self.first = event;
            return;
        }
        if self.all.is_empty() {
            self.all.extend_from_slice(&self.first);
        }
        self.all.extend_from_slice(&event);
    }

    fn whole(self) -> Option<Bytes> {
        let whole = if self.all.is_empty() {
            self.first
        } else {
            self.all.into()
        };
        (!whole.is_empty()).then_some(whole)
    }
}

#[cfg(test)]
mod tests {
    use belvedere_live::{
        event::{Gone, ObjectPose},
        motion::Pose,
    };

    use super::*;

    const O: ObjectId = ObjectId(5);

    fn pos(t_ms: Ms) -> Event {
        Event::ObjectPos {
            t_ms,
            objects: vec![ObjectPose {
                object: O,
                pose: Pose::resting(t_ms, [t_ms as f64, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]),
            }],
        }
    }

    fn gone() -> Event {
        Event::ObjectGone {
            objects: vec![O],
            reason: Gone::Hidden,
        }
    }

    /// What a reader hears at once.
    fn read(outbox: &Outbox, reader: u64) -> String {
        let mut text = String::new();
        while let Poll::Ready(Some(piece)) = outbox.poll(reader, &Context::from_waker(Waker::noop())) {
            text.push_str(std::str::from_utf8(&piece).unwrap());
        }
        text
    }

    fn names(text: &str) -> Vec<&str> {
        text.lines().filter_map(|line| line.strip_prefix("event: ")).collect()
    }

    #[test]
    fn of_poses_only_the_newest_is_told_and_none_of_what_is_gone() {
        let outbox = Outbox::default();
        let reader = outbox.attach(None);
        (0..100).for_each(|t_ms| outbox.push(&pos(t_ms)));
        let text = read(&outbox, reader);
        assert_eq!(names(&text), ["object-pos"]);
        assert!(text.contains(r#""position":[99.0"#), "{text}");
        outbox.push(&pos(100));
        outbox.push(&gone());
        assert_eq!(names(&read(&outbox, reader)), ["object-gone"]);
    }

    #[test]
    fn a_reader_that_was_cut_off_goes_on_after_what_it_has_heard() {
        let outbox = Outbox::default();
        let first = outbox.attach(None);
        for _ in 0..3 {
            outbox.push(&gone());
        }
        assert!(read(&outbox, first).starts_with("id: 1\nevent: object-gone\ndata: {"));
        outbox.push(&gone());
        let second = outbox.attach(Some(2));
        let text = read(&outbox, second);
        assert!(text.starts_with("id: 3\n") && text.contains("id: 4\n"), "{text}");
        assert_eq!(names(&text).len(), 2);
        assert_eq!(
            outbox.poll(first, &Context::from_waker(Waker::noop())),
            Poll::Ready(None)
        );
    }

    #[test]
    fn who_has_missed_too_much_is_told_anew() {
        let outbox = Outbox::default();
        let first = outbox.attach(None);
        outbox.push(&gone());
        read(&outbox, first);
        for (last_seen, why) in [
            (None, Void::Unknown),
            (Some(77), Void::Missed),
            (Some(u64::MAX), Void::Missed),
        ] {
            let reader = outbox.attach(last_seen);
            assert_eq!(outbox.wants_resync(), Some(why));
            outbox.push(&gone());
            assert_eq!(read(&outbox, reader), "", "void until everything is told anew");
            outbox.push(&Event::Resync { reason: why });
            assert_eq!(names(&read(&outbox, reader)), ["resync"]);
        }
    }

    #[test]
    fn a_stuck_reader_costs_bounded_memory() {
        let outbox = Outbox::default();
        let reader = outbox.attach(None);
        for _ in 0..100_000 {
            outbox.push(&gone());
            assert!(outbox.state().queue_bytes <= QUEUE_BYTES);
        }
        assert_eq!(outbox.wants_resync(), Some(Void::Missed));
        outbox.detach(reader);
        assert_eq!(outbox.wants_resync(), None, "nobody would hear it");
    }

    #[test]
    fn the_end_comes_after_what_waits() {
        let outbox = Outbox::default();
        let reader = outbox.attach(None);
        outbox.push(&gone());
        outbox.close();
        let cx = Context::from_waker(Waker::noop());
        assert!(matches!(outbox.poll(reader, &cx), Poll::Ready(Some(_))));
        assert_eq!(outbox.poll(reader, &cx), Poll::Ready(None));
    }
}
