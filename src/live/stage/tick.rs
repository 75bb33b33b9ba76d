//! What does a scene's task do each tick? It follows revisions, ends leases, takes poses that came too fast, lets the rules say
//! what is to be told, and hands on what is to be kept.

use std::{
    sync::atomic::Ordering,
    time::{Duration, Instant},
};

use belvedere_live::event::Void;

use super::{Live, Stage, StageHandle};

/// Where people stand is kept so often.
const STANDS: Duration = Duration::from_secs(5);
/// Silent movers are looked for at least so often, silent sessions ten times as often.
const LONGEST_PAUSE: Duration = Duration::from_secs(10);

impl Stage {
    /// Whether somebody has moved after nothing was told for a tick: then the next need not be waited for. Never more often than
    /// once a tick.
    pub(super) fn hurries(&mut self) -> bool {
        let hurries = self.moved && self.told_at.elapsed() >= self.live.0.settings.tick;
        if hurries {
            self.told_at = Instant::now();
        }
        hurries
    }

    pub(super) async fn tick(&mut self, handle: &StageHandle) {
        self.follow(handle);
        self.end_silent_sessions();
        self.step_late(handle);
        self.end_silent_movers(handle);
        self.moved = false;
        let looks = handle.take_readers_changed();
        if looks {
            self.attend();
        }
        self.learn_ahead(handle);
        self.make_room();
        self.world.tick(self.live.now_ms());
        self.ticked = true;
        self.keeping.keep(&self.live.0.sources.catalogue, self.live.now_ms());
        self.keep_stands();
        if looks {
            self.resync().await;
        }
    }

    /// Greets first readers, and says whose have come or gone, and whose have missed so much that there is nothing to be told until
    /// they come back.
    fn attend(&mut self) {
        let now_ms = self.live.now_ms();
        for (session, person) in &self.people {
            if !person.listens
                && person.outbox.wants_greeting()
                && let Some(hello) = self.hello(*session)
            {
                person.outbox.greet(&hello);
            }
        }
        for (session, person) in &mut self.people {
            let listens = person.outbox.listens();
            if std::mem::replace(&mut person.listens, listens) != listens {
                self.world.listens(*session, listens, now_ms);
                person.wakeable = listens;
            }
            let wakeable = listens && person.outbox.is_read();
            if std::mem::replace(&mut person.wakeable, wakeable) != wakeable {
                self.world.wakeable(*session, wakeable, now_ms);
            }
        }
    }

    /// Whoever has taken what was waiting may be told of more.
    fn make_room(&mut self) {
        let waiting: Vec<_> = self.world.wants_room().collect();
        for session in waiting {
            if self
                .people
                .get(&session)
                .is_some_and(|person| person.outbox.is_drained())
            {
                self.world.make_room(session, self.live.now_ms());
            }
        }
    }

    /// Ends sessions that are silent and whose streams are not read, now and then.
    fn end_silent_sessions(&mut self) {
        let lease = self.live.0.settings.lease;
        if self.people_counted.elapsed() < lease.min(LONGEST_PAUSE) / 10 {
            return;
        }
        self.people_counted = Instant::now();
        let silent = self.people.iter().filter(|(_, p)| p.outbox.silent_for() > lease);
        for session in silent.map(|(s, _)| *s).collect::<Vec<_>>() {
            self.live.0.tally.expired.fetch_add(1, Ordering::Relaxed);
            self.close(session);
        }
    }

    /// Has it kept where people stand who have moved, now and then.
    fn keep_stands(&mut self) {
        if self.stands_kept.elapsed() < STANDS {
            return;
        }
        self.stands_kept = Instant::now();
        for (session, person) in &mut self.people {
            if std::mem::take(&mut person.moved)
                && let Some(stand) = self.world.stand(*session)
            {
                self.live.0.ledger.stands(*session, stand);
            }
        }
    }

    /// Ends movers whose senders have gone without a word, now and then.
    fn end_silent_movers(&mut self, handle: &StageHandle) {
        let Live(live) = &self.live;
        let lease = live.settings.mover_lease;
        if self.movers_counted.elapsed() < pause(lease) {
            return;
        }
        self.movers_counted = Instant::now();
        for object in live.registry.silent_movers(handle, lease) {
            live.tally.expired.fetch_add(1, Ordering::Relaxed);
            self.world.destroy(object, live.clock.now_ms());
            live.registry.end_mover(object);
        }
    }

    async fn resync(&mut self) {
        let waiting: Vec<_> = self
            .people
            .iter()
            .filter_map(|(s, person)| Some((*s, person.outbox.wants_resync()?)))
            .collect();
        if waiting.is_empty() {
            return;
        }
        // What the tick has just said belongs before.
        self.deliver().await;
        for (session, reason) in waiting {
            let counted = &self.live.0.tally.resyncs;
            let counted = match reason {
                Void::Missed => &counted.missed,
                Void::Unknown => &counted.unknown,
            };
            counted.fetch_add(1, Ordering::Relaxed);
            self.world.resync(session, reason, self.live.now_ms());
            self.deliver().await;
            self.tell_network(session);
            self.show_statics(session, true);
        }
    }

    /// Hands on what has been written since the last tick.
    pub(super) async fn record(&mut self) {
        let ticked = std::mem::take(&mut self.ticked);
        let Some(recorder) = &self.live.0.sources.recorder else {
            return;
        };
        if (ticked || self.world.is_empty())
            && let Some(written) = self.world.written()
        {
            recorder.write(&self.scene, written).await;
        }
    }
}

/// The time from one look for silent movers to the next: none stays for much longer than its lease.
fn pause(lease: Duration) -> Duration {
    (lease / 4).min(LONGEST_PAUSE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_mover_outlives_its_lease_by_more_than_a_quarter_nor_by_ten_seconds() {
        let pauses = [4, 30, 3_600].map(|lease_s| pause(Duration::from_secs(lease_s)).as_secs_f64());
        assert_eq!(pauses, [1.0, 7.5, 10.0]);
    }
}
