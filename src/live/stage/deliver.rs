//! How does what the rules have said reach the outboxes? Each session's events in their order, and many sessions' on all
//! threads at once.

use std::{
    sync::{Arc, atomic::Ordering},
    time::Instant,
};

use belvedere_live::event::Event;
use tokio::task::{JoinSet, yield_now};

use super::Stage;
use crate::live::{outbox::Outbox, poses::Delivery};

/// What one thread delivers is at least so many events: fewer are sooner written than handed on.
const LEAST_SHARE: usize = 64;
/// After so many events others get their turn on the thread.
const TURN: usize = 64;

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
        let mut last = None;
        for (session, event) in events {
            if ours.len() >= share && last != Some(session) {
                others.spawn(put(std::mem::take(&mut ours)));
            }
            last = Some(session);
            if let Some(person) = self.people.get(&session) {
                ours.push((person.outbox.clone(), event));
            }
        }
        let mut at_once = put(ours).await;
        while let Some(done) = others.join_next().await {
            at_once += done.expect("nobody panics while delivering");
        }
        self.live.0.tally.at_once.fetch_add(at_once, Ordering::Relaxed);
    }
}

/// Says how many of them their readers have already.
async fn put(share: Share) -> u64 {
    let (mut delivery, mut at_once) = (Delivery::begin(), 0);
    for (i, (outbox, event)) in share.iter().enumerate() {
        if i > 0 && i % TURN == 0 {
            yield_now().await;
        }
        at_once += u64::from(outbox.push_with(event, &mut delivery));
    }
    at_once
}
