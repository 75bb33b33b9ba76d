//! How do poses leave for many readers at once? Those whose readers wait for nothing else are written past their tasks, all of one round in
//! one step, while their outboxes are held.

use std::{
    ops::Range,
    sync::{Arc, MutexGuard},
    time::Instant,
};

use belvedere_live::event::Event;

use super::{Outbox, State, told::Said};
use crate::live::{
    line::{Held, Line, Taken},
    poses::{Delivery, Written},
    sending::{self, Outgoing},
};

/// Puts in events of many sessions, in their order; says how many of them their readers have already. Those of one session follow
/// each other: its outbox is held until it departs, and must not be asked for again before.
pub(in crate::live) fn push_all(events: &[(Arc<Outbox>, Event)], delivery: &mut Delivery) -> u64 {
    let (mut departing, mut at_once, mut last) = (Vec::with_capacity(events.len()), 0, None);
    for (outbox, event) in events {
        // The outboxes of those that are about to depart are held, and of one session all is told in order.
        if last.is_some_and(|last| Arc::ptr_eq(last, outbox)) {
            at_once += depart(&mut departing, delivery);
        }
        last = Some(outbox);
        departing.extend(outbox.offer(event, delivery));
    }
    at_once + depart(&mut departing, delivery)
}

/// Poses for a reader that waits for nothing else. Nobody else looks into its outbox meanwhile.
pub(super) struct Departing<'a> {
    pub(super) state: MutexGuard<'a, State>,
    pub(super) line: Arc<dyn Line>,
    pub(super) written: Arc<Written>,
    pub(super) said: Said,
}

/// Sends poses along their lines, all together; what a line does not take is left to its reader. Says how many were sent.
pub(super) fn depart(departing: &mut Vec<Departing>, delivery: &mut Delivery) -> u64 {
    let Delivery { begun, wire, .. } = delivery;
    wire.clear();
    let mut ways = Vec::with_capacity(departing.len());
    for poses in departing.iter() {
        let (held, from) = (poses.line.hold(), wire.len());
        if held.is_some() {
            poses.state.told.frame_next(&poses.said, &*poses.line, wire);
        }
        ways.push(held.map(|held| (held, from..wire.len())));
    }
    let outgoing = ways.iter().flatten().map(|(held, chunk)| Outgoing {
        socket: held.socket(),
        chunk: &wire[chunk.clone()],
    });
    let mut sent = sending::send(&outgoing.collect::<Vec<_>>()).into_iter();
    let taken = |way: Option<(Held, Range<usize>)>| {
        let (held, chunk) = way?;
        Some(held.has_sent(&sent.next()?, &wire[chunk]))
    };
    let taken: Vec<_> = ways.into_iter().map(taken).collect();
    let mut at_once = 0;
    for (poses, taken) in departing.drain(..).zip(taken) {
        at_once += u64::from(poses.end(taken.unwrap_or(Taken::Nothing), *begun));
    }
    at_once
}

impl Departing<'_> {
    /// Takes note of what became of it; says whether the reader has it.
    fn end(mut self, taken: Taken, now: Instant) -> bool {
        match taken {
            Taken::Nothing => {
                self.state.poses.add(&self.written);
                self.state.wake();
                return false;
            }
            Taken::All => {}
            Taken::Begun => self.state.wake(),
        }
        self.state.told.keep(self.said);
        self.state.has_told(now);
        true
    }
}
