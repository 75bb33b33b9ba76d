//! What has a session not heard yet?
//!
//! Events that must not be lost wait in a queue; poses wait in a table with one place for each mover, where the newest
//! wins. A reader gets the queue first and the poses after it, so that a pose never names a mover whose info is still to
//! come, or that is gone. What it got stays in a ring for a while, under its number, for a reader that was cut off. What
//! many sessions are told alike is held once for all of them, in tables and in rings.
//!
//! Both are bounded: when too much waits or too much was missed, everything is dropped, and the rules are asked to tell
//! all anew, once there is a reader. So a stuck reader costs this much memory, and nobody else anything.

use std::{
    collections::{BTreeMap, VecDeque},
    io::Write,
    sync::{Arc, Mutex, MutexGuard},
    task::{Context, Poll, Waker},
    time::{Duration, Instant},
};

use belvedere_live::{
    Ms,
    event::{Event, Void},
};
use belvedere_scene::ObjectId;
use bytes::Bytes;

use super::poses::{self, Poses, Written};

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
    queue: VecDeque<Said>,
    queue_bytes: usize,
    poses: Waiting,
    /// What was read, or is to be read again; the last one has the number before `next`.
    ring: VecDeque<Said>,
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

/// An event without its number.
#[derive(Debug, Clone)]
struct Said {
    name: &'static str,
    data: Bytes,
}

/// Poses that wait for a reader.
#[derive(Debug, Default)]
enum Waiting {
    #[default]
    None,
    /// Those of one tick, as others are told of them too.
    Shared(Arc<Written>),
    /// The newest of each mover.
    Newest(Box<(Ms, BTreeMap<ObjectId, Bytes>)>),
}

impl Waiting {
    fn add(&mut self, written: &Arc<Written>) {
        if matches!(self, Self::None) {
            *self = Self::Shared(written.clone());
            return;
        }
        let newest = self.newest();
        newest.0 = written.t_ms;
        newest.1.extend(written.entries.iter().cloned());
    }

    fn remove(&mut self, objects: &[ObjectId]) {
        if matches!(self, Self::None) {
            return;
        }
        let newest = self.newest();
        for object in objects {
            newest.1.remove(object);
        }
        if newest.1.is_empty() {
            *self = Self::None;
        }
    }

    fn newest(&mut self) -> &mut (Ms, BTreeMap<ObjectId, Bytes>) {
        let shared = match self {
            Self::Shared(written) => Some(written.clone()),
            _ => None,
        };
        if !matches!(self, Self::Newest(_)) {
            let all = shared.map(|written| (written.t_ms, written.entries.iter().cloned().collect()));
            *self = Self::Newest(Box::new(all.unwrap_or_default()));
        }
        match self {
            Self::Newest(newest) => newest,
            Self::None | Self::Shared(_) => unreachable!("it was made just now"),
        }
    }

    /// All of them as an event, if there are some.
    fn take(&mut self) -> Option<Said> {
        let data = match std::mem::take(self) {
            Self::None => return None,
            Self::Shared(written) => written.data.clone(),
            Self::Newest(newest) => poses::data(newest.0, newest.1.values()).into(),
        };
        let name = "object-pos";
        Some(Said { name, data })
    }
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
            poses: Waiting::None,
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
                state.poses.add(&poses.all(*t_ms, objects));
                return state.wake();
            }
            Event::ObjectGone { objects, .. } => state.poses.remove(objects),
            _ => {}
        }
        let data = serde_json::to_string(event).expect("an event holds nothing that JSON cannot say");
        // Without the room that was not needed: it is kept.
        let data = Bytes::from(data.into_boxed_str().into_boxed_bytes());
        state.queue_bytes += data.len();
        let name = event.name();
        state.queue.push_back(Said { name, data });
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
        let (oldest, next) = (state.oldest(), state.next);
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
        self.poses = Waiting::None;
        self.ring.clear();
        self.ring_bytes = 0;
        self.again = self.next;
        self.missed = None;
    }

    fn miss(&mut self, why: Void) {
        self.clear();
        self.missed = Some(why);
    }

    /// The number of the first event in the ring.
    fn oldest(&self) -> u64 {
        self.next - self.ring.len() as u64
    }

    /// Takes out what is to be read next.
    fn piece(&mut self) -> Option<Bytes> {
        if self.again == self.next && self.queue.is_empty() && matches!(self.poses, Waiting::None) {
            return None;
        }
        let mut piece = Vec::new();
        while self.again < self.next && piece.len() < PIECE_BYTES {
            if let Some(said) = self.ring.get((self.again - self.oldest()) as usize) {
                said.write(self.again, &mut piece);
            }
            self.again += 1;
        }
        while piece.len() < PIECE_BYTES
            && let Some(said) = self.queue.pop_front()
        {
            self.queue_bytes -= said.data.len();
            self.tell(said, &mut piece);
        }
        if self.queue.is_empty() {
            // Most sessions have nothing to wait for most of the time.
            self.queue = VecDeque::new();
        }
        if piece.len() < PIECE_BYTES
            && let Some(said) = self.poses.take()
        {
            self.tell(said, &mut piece);
        }
        (!piece.is_empty()).then(|| piece.into())
    }

    /// Writes an event that is new to all readers, and keeps it for those that come back.
    fn tell(&mut self, said: Said, piece: &mut Vec<u8>) {
        said.write(self.next, piece);
        self.ring_bytes += said.bytes();
        if self.ring.capacity() == 0 {
            // Most hear little more than that they have come.
            self.ring.reserve_exact(1);
        }
        self.ring.push_back(said);
        self.next += 1;
        self.again = self.next;
        while self.ring_bytes > RING_BYTES
            && let Some(oldest) = self.ring.pop_front()
        {
            self.ring_bytes -= oldest.bytes();
        }
    }
}

impl Said {
    /// About what it takes in the stream.
    fn bytes(&self) -> usize {
        /// What stands around name and data, with the longest number.
        const AROUND: usize = 48;
        AROUND + self.name.len() + self.data.len()
    }

    fn write(&self, number: u64, piece: &mut Vec<u8>) {
        piece.reserve(self.bytes());
        write!(piece, "id: {number}\nevent: {}\ndata: ", self.name).expect("a vector takes it");
        piece.extend_from_slice(&self.data);
        piece.extend_from_slice(b"\n\n");
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
    fn what_many_are_told_alike_is_held_once_and_each_hears_it_in_its_own_order() {
        let outboxes: [Outbox; 3] = Default::default();
        let readers = outboxes.each_ref().map(|outbox| outbox.attach(None));
        outboxes[2].push(&gone());
        let mut poses = Poses::default();
        outboxes.iter().for_each(|outbox| outbox.push_with(&pos(7), &mut poses));
        let heard = [0, 1, 2].map(|i| read(&outboxes[i], readers[i]));
        assert_eq!(heard[0], heard[1]);
        assert!(
            heard[0].starts_with("id: 1\nevent: object-pos\ndata: {"),
            "{}",
            heard[0]
        );
        assert!(heard[2].contains("id: 2\nevent: object-pos\ndata: {"), "{}", heard[2]);
        let kept = outboxes
            .each_ref()
            .map(|outbox| outbox.state().ring.back().unwrap().data.clone());
        assert!(kept.iter().all(|data| data.as_ptr() == kept[0].as_ptr()));
        // What came later to one of them is nobody else's.
        outboxes.iter().for_each(|outbox| outbox.push_with(&pos(8), &mut poses));
        outboxes[0].push(&gone());
        outboxes[1].push(&pos(9));
        assert_eq!(names(&read(&outboxes[0], readers[0])), ["object-gone"]);
        let [newest, shared] = [1, 2].map(|i| read(&outboxes[i], readers[i]));
        assert!(newest.contains("\"position\":[9.0") && shared.contains("\"position\":[8.0"));
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
