//! How does what the rules have said reach the outboxes? Each session's events in their order, and many sessions' on all
//! threads at once.

use std::{
    collections::{BTreeMap, btree_map},
    iter::Peekable,
    sync::{Arc, atomic::Ordering},
    time::Instant,
};

use belvedere_live::event::{Event, SessionId};
use tokio::task::{JoinSet, yield_now};

use super::{Person, Stage};
use crate::live::{
    outbox::{Outbox, push_all},
    poses::Delivery,
    sending,
};

/// What one thread delivers is at least so many events: fewer are sooner written than handed on.
const LEAST_SHARE: usize = 64;
/// After so many events others get their turn on the thread.
const TURN: usize = sending::MOST;

/// Events in their order, with whom they are for.
type Share = Vec<(Arc<Outbox>, Event)>;

impl Stage {
    /// Puts what the rules have said into the outboxes. When it is done, all of it is there.
    pub(super) async fn deliver(&mut self) {
        let mut events = self.world.events();
        if events.is_empty() {
            return;
        }
        self.told_at = Instant::now();
        let count = events.len();
        self.live.0.tally.events.fetch_add(count as u64, Ordering::Relaxed);
        let threads = tokio::runtime::Handle::current().metrics().num_workers();
        let share = count.div_ceil(threads).max(LEAST_SHARE);
        // One session's stay in their order.
        events.sort_by_key(|(session, _)| *session);
        let mut others = JoinSet::new();
        let mut ours = Share::with_capacity(share.min(count));
        let (mut people, mut last) = (Rising::of(&self.people, count), None);
        for (session, event) in events {
            if ours.len() >= share && last != Some(session) {
                others.spawn(put(std::mem::take(&mut ours)));
            }
            last = Some(session);
            if let Some(person) = people.find(session) {
                let hello = matches!(event, Event::Resync { .. })
                    .then(|| self.hello(session))
                    .flatten();
                ours.push((person.outbox.clone(), event));
                // What follows may be of another clock or revision than what was told before.
                ours.extend(hello.map(|hello| (person.outbox.clone(), hello)));
            }
        }
        let mut at_once = put(ours).await;
        while let Some(done) = others.join_next().await {
            at_once += done.expect("nobody panics while delivering");
        }
        self.live.0.tally.at_once.fetch_add(at_once, Ordering::Relaxed);
    }
}

/// People of a scene, looked for by rising sessions.
struct Rising<'a> {
    all: &'a BTreeMap<SessionId, Person>,
    /// Where many are looked for, to go along takes less than to look each one up.
    along: Option<Peekable<btree_map::Iter<'a, SessionId, Person>>>,
}

impl<'a> Rising<'a> {
    /// To go along past so many takes about as long as to look one up.
    const PASSED: usize = 8;

    fn of(all: &'a BTreeMap<SessionId, Person>, looked_for: usize) -> Self {
        let along = (looked_for >= all.len() / Self::PASSED).then(|| all.iter().peekable());
        Self { all, along }
    }

    fn find(&mut self, session: SessionId) -> Option<&'a Person> {
        let Some(along) = &mut self.along else {
            return self.all.get(&session);
        };
        while along.next_if(|(id, _)| **id < session).is_some() {}
        along
            .peek()
            .filter(|(id, _)| **id == session)
            .map(|(_, person)| *person)
    }
}

/// Says how many of them their readers have already.
async fn put(share: Share) -> u64 {
    let (mut delivery, mut at_once) = (Delivery::begin(), 0);
    for (i, events) in share.chunks(TURN).enumerate() {
        if i > 0 {
            yield_now().await;
        }
        at_once += push_all(events, &mut delivery);
    }
    at_once
}
