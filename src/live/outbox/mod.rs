//! What has a session not heard yet?
//!
//! Events that must not be lost wait in a queue; poses wait in a table with one place for each mover, where the newest
//! wins ([`waiting`]). A reader gets the queue first and the poses after it, so that a pose never names a mover whose info is
//! still to come, or that is gone. What it got stays for a while, under its number, for a reader that was cut off ([`told`]). What
//! many sessions are told alike is held once for all of them.
//!
//! Both are bounded: when too much waits or too much was missed, everything is dropped, and the rules are asked to tell
//! all anew, once there is a reader that has taken what it got before. So a stuck reader costs this much memory, and nobody else
//! anything. Infos, of which a crowd is many, wait with the rules until there is room. Infos of what does not move stand [`aside`] of
//! the queue, and hold none of that up.
//!
//! Poses for a reader that has heard everything and waits are written at once into its [`Line`], where it has one: nobody is woken,
//! and they wait nowhere ([`departing`]). As soon as a line takes no more, the reader's task sees to the rest.

mod aside;
mod departing;
mod told;
mod waiting;

#[cfg(test)]
mod tests;

use std::{
    collections::VecDeque,
    sync::{
        Arc, Mutex, MutexGuard,
        atomic::{AtomicBool, Ordering},
    },
    task::{Context, Poll, Waker},
    time::{Duration, Instant},
};

use belvedere_live::event::{Event, Void};
use bytes::Bytes;

pub(super) use self::departing::push_all;
use self::{
    aside::Aside,
    departing::{Departing, depart},
    told::{Said, Told},
    waiting::Waiting,
};
use super::{line::Line, poses::Delivery};

/// So many bytes may wait for a reader …
const QUEUE_BYTES: usize = 256 << 10;
/// … and so many for the first one: whoever opens sessions and reads none costs little.
const FIRST_BYTES: usize = 64 << 10;
/// A piece of the stream is cut at the first event beyond this.
const PIECE_BYTES: usize = 32 << 10;

/// The events of one session.
#[derive(Debug, Default)]
pub(super) struct Outbox {
    state: Mutex<State>,
    readers_changed: Arc<AtomicBool>,
}

#[derive(Debug)]
struct State {
    /// Events to be read.
    queue: VecDeque<Said>,
    queue_bytes: usize,
    poses: Waiting,
    /// Of what does not move.
    aside: Aside,
    told: Told,
    missed: Option<Void>,
    /// What is told first says what time it is, so it is said when there is somebody who hears it.
    awaits_greeting: bool,
    reader: Reader,
    closed: bool,
    last_sign: Instant,
}

#[derive(Debug)]
struct Reader {
    /// Which reader is the last one.
    number: u64,
    attached: bool,
    /// It was told more than it took, and has not asked for more since.
    behind: bool,
    /// There while the reader waits, and nothing waits for it.
    waker: Option<Waker>,
    line: Option<Arc<dyn Line>>,
    /// When it was told something last.
    told_at: Instant,
}

/// Why a reader has gone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum End {
    /// Its connection ended.
    Cut,
    /// Another one took its place.
    Replaced,
    /// The session ended.
    Over,
}

impl Reader {
    fn none(number: u64) -> Self {
        Self {
            number,
            attached: false,
            behind: false,
            waker: None,
            line: None,
            told_at: Instant::now(),
        }
    }
}

impl Default for State {
    fn default() -> Self {
        Self {
            queue: VecDeque::new(),
            queue_bytes: 0,
            poses: Waiting::None,
            aside: Aside::default(),
            told: Told::default(),
            missed: None,
            awaits_greeting: false,
            reader: Reader::none(0),
            closed: false,
            last_sign: Instant::now(),
        }
    }
}

impl Outbox {
    /// An empty one, which says to whoever looks after several of them that a reader has come, gone or missed something.
    /// A session that was opened awaits a greeting; of one that was taken up, what others have told is void.
    pub(super) fn new(readers_changed: Arc<AtomicBool>, taken: u64) -> Self {
        let state = State {
            told: Told::after(taken),
            missed: (taken > 0).then_some(Void::Missed),
            awaits_greeting: taken == 0,
            ..State::default()
        };
        Self {
            state: Mutex::new(state),
            readers_changed,
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().expect("nobody panics while holding this lock")
    }

    /// Puts an event in.
    pub(super) fn push(&self, event: &Event) {
        let mut delivery = Delivery::begin();
        let departing = self.offer(event, &mut delivery);
        depart(&mut departing.into_iter().collect(), &mut delivery);
    }

    /// Puts an event in, or, when the reader's line may take it at once, gives what is to [`depart`].
    fn offer(&self, event: &Event, delivery: &mut Delivery) -> Option<Departing<'_>> {
        let mut state = self.state();
        match event {
            Event::Resync { .. } => {
                state.clear();
                state.awaits_greeting = false;
            }
            _ if state.missed.is_some() => return None,
            // The greeting says it.
            Event::Cell { .. } if state.awaits_greeting => return None,
            Event::ObjectPos { t_ms, objects } => {
                let written = delivery.poses.all(*t_ms, objects);
                let line = state.reader.line.as_ref().filter(|_| state.reader.waker.is_some());
                if let Some(line) = line.cloned() {
                    let said = Said::poses(written.data.clone());
                    return Some(Departing {
                        state,
                        line,
                        written,
                        said,
                    });
                }
                state.poses.add(&written);
                state.wake();
                return None;
            }
            Event::ObjectGone { objects, .. } => state.poses.remove(objects),
            // Ids of what does not move are void from then on.
            Event::Revision { .. } => {
                state.aside.revoke();
                if state.awaits_greeting {
                    // The greeting tells of the newest alone.
                    state.forget("revision");
                }
            }
            _ => {}
        }
        let said = said(event);
        if matches!(event, Event::ObjectInfo(told) if told.moving.is_none()) {
            state.aside.push(said);
            if state.aside.goes() {
                state.wake();
            }
            return None;
        }
        state.queue_bytes += said.data.len();
        state.queue.push_back(said);
        if state.queue_bytes > state.most_bytes() {
            state.miss(Void::Missed);
            state.reader.behind = true;
            self.readers_changed.store(true, Ordering::Release);
        }
        state.wake();
        None
    }

    /// Whether the first reader has come, and has not been greeted.
    pub(super) fn wants_greeting(&self) -> bool {
        let state = self.state();
        state.awaits_greeting && state.reader.attached && state.missed.is_none()
    }

    /// Puts in what is told before all else.
    pub(super) fn greet(&self, hello: &Event) {
        let mut state = self.state();
        let said = said(hello);
        state.queue_bytes += said.data.len();
        state.queue.push_front(said);
        state.awaits_greeting = false;
        state.wake();
    }

    /// Whether more than half of the room is left, for what does not move.
    pub(super) fn has_room(&self) -> bool {
        let state = self.state();
        state.queue_bytes + state.aside.bytes() < state.most_bytes() / 2
    }

    /// Of what does not move it may be told or not: the rules have told of all who do, or some of them still wait.
    pub(super) fn let_aside_go(&self, free: bool) {
        let mut state = self.state();
        state.aside.let_go(free);
        if state.aside.goes() {
            state.wake();
        }
    }

    /// Whether a reader that is there has taken all that had to be told, and may be told more of it.
    pub(super) fn is_drained(&self) -> bool {
        let state = self.state();
        state.reader.attached && state.missed.is_none() && state.queue.is_empty() && !state.told.has_more()
    }

    /// Why a reader that is there, and has taken what it got before, must be told everything anew; none when it need not be.
    pub(super) fn wants_resync(&self) -> Option<Void> {
        let state = self.state();
        state.missed.filter(|_| state.reader.attached && !state.reader.behind)
    }

    /// Whether what is said may be heard: by a reader that is there, or by one that was cut off and has missed nothing yet.
    pub(super) fn listens(&self) -> bool {
        let state = self.state();
        state.reader.attached || state.reader.number > 0 && state.missed.is_none()
    }

    /// Whether what is said is heard at once: a reader is there.
    pub(super) fn is_read(&self) -> bool {
        self.state().reader.attached
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
        match last_seen {
            Some(last_seen) if state.told.go_back_to(last_seen) => {}
            // Nobody has heard anything yet.
            None if state.told.is_nothing() => {}
            Some(_) => state.miss(Void::Missed),
            None => state.miss(Void::Unknown),
        }
        state.wake();
        state.last_sign = Instant::now();
        state.reader = Reader {
            attached: true,
            ..Reader::none(state.reader.number + 1)
        };
        state.aside.let_go(false);
        self.readers_changed.store(true, Ordering::Release);
        state.reader.number
    }

    /// From now on a reader's poses may be written past its task.
    pub(super) fn lay(&self, reader: u64, line: Arc<dyn Line>) {
        let mut state = self.state();
        if state.reader.number == reader && state.reader.attached {
            state.reader.line = Some(line);
        }
    }

    /// A reader has gone; says why.
    pub(super) fn detach(&self, reader: u64) -> End {
        let mut state = self.state();
        if state.reader.number != reader {
            return End::Replaced;
        }
        state.reader = Reader::none(reader);
        // Whoever was cut off has the whole lease to come back.
        state.last_sign = Instant::now();
        self.readers_changed.store(true, Ordering::Release);
        if state.closed { End::Over } else { End::Cut }
    }

    /// The next piece of the stream; none when it has ended for this reader.
    pub(super) fn poll(&self, reader: u64, cx: &Context<'_>) -> Poll<Option<Bytes>> {
        let mut state = self.state();
        if state.reader.number != reader {
            return Poll::Ready(None);
        }
        if let Some(piece) = state.piece() {
            state.has_told(Instant::now());
            return Poll::Ready(Some(piece));
        }
        if state.closed {
            return Poll::Ready(None);
        }
        if std::mem::take(&mut state.reader.behind) {
            self.readers_changed.store(true, Ordering::Release);
        }
        state.reader.waker = Some(cx.waker().clone());
        Poll::Pending
    }

    /// When the reader was told something last.
    pub(super) fn told_at(&self) -> Instant {
        self.state().reader.told_at
    }

    /// The reader hears that there is nothing to hear.
    pub(super) fn beat(&self) {
        self.state().has_told(Instant::now());
    }
}

/// An event as it is written.
fn said(event: &Event) -> Said {
    let data = serde_json::to_string(event).expect("an event holds nothing that JSON cannot say");
    Said {
        name: event.name(),
        // Without the room that was not needed: it is kept.
        data: Bytes::from(data.into_boxed_str().into_boxed_bytes()),
    }
}

impl State {
    /// How much may wait.
    fn most_bytes(&self) -> usize {
        match self.reader.number {
            0 => FIRST_BYTES,
            _ => QUEUE_BYTES,
        }
    }

    fn wake(&mut self) {
        if let Some(waker) = self.reader.waker.take() {
            waker.wake();
        }
    }

    fn has_told(&mut self, now: Instant) {
        self.last_sign = now;
        self.reader.told_at = now;
    }

    fn clear(&mut self) {
        self.queue.clear();
        self.queue_bytes = 0;
        self.poses = Waiting::None;
        self.aside.clear();
        self.told.clear();
        self.missed = None;
    }

    /// Events of a name are void.
    fn forget(&mut self, name: &str) {
        let old = |said: &&Said| said.name == name;
        self.queue_bytes -= self.queue.iter().filter(old).map(|said| said.data.len()).sum::<usize>();
        self.queue.retain(|said| said.name != name);
    }

    fn miss(&mut self, why: Void) {
        self.clear();
        self.missed = Some(why);
    }

    /// Takes out what is to be read next.
    fn piece(&mut self) -> Option<Bytes> {
        if self.awaits_greeting {
            return None;
        }
        if !self.told.has_more() && self.queue.is_empty() && self.poses.is_none() && !self.aside.goes() {
            return None;
        }
        self.aside.pass_over();
        let mut piece = Vec::new();
        self.told.write_again(&mut piece, PIECE_BYTES);
        while piece.len() < PIECE_BYTES
            && let Some(said) = self.queue.pop_front()
        {
            self.queue_bytes -= said.data.len();
            self.told.write_next(&said, &mut piece);
            self.told.keep(said);
        }
        if self.queue.is_empty() {
            // Most sessions have nothing to wait for most of the time.
            self.queue = VecDeque::new();
        }
        if piece.len() < PIECE_BYTES
            && let Some(said) = self.poses.take()
        {
            self.told.write_next(&said, &mut piece);
            self.told.keep(said);
        }
        while let Some(said) = self.aside.next(piece.len() < PIECE_BYTES) {
            self.told.write_next(&said, &mut piece);
            self.told.keep(said);
        }
        (!piece.is_empty()).then(|| piece.into())
    }
}
