//! What does a scene's task do each tick? It follows revisions, ends leases, takes poses that came too fast, lets the rules say
//! what is to be told, and hands on what is to be kept.

use std::sync::atomic::Ordering;

use super::Stage;

impl Stage {
    pub(super) async fn tick(&mut self) {
        self.follow().await;
        let lease = self.live.0.settings.lease;
        let expired: Vec<_> = self
            .people
            .iter()
            .filter(|(_, p)| p.outbox.silent_for() > lease)
            .map(|(s, _)| *s)
            .collect();
        for session in expired {
            self.live.0.tally.expired.fetch_add(1, Ordering::Relaxed);
            self.close(session);
        }
        let late: Vec<_> = self
            .people
            .iter_mut()
            .filter_map(|(s, p)| Some((*s, p.late.take()?)))
            .collect();
        for (session, sent) in late {
            // It was refused once already; what is wrong with it would have been told then.
            _ = self.apply(session, sent).await;
        }
        self.world.tick(self.live.now_ms());
        self.ticked = true;
        self.keeping.keep(&self.live.0.sources.catalogue, self.live.now_ms());
        self.resync();
    }

    fn resync(&mut self) {
        let waiting: Vec<_> = self
            .people
            .iter()
            .filter_map(|(s, person)| Some((*s, person.outbox.wants_resync()?)))
            .collect();
        if waiting.is_empty() {
            return;
        }
        // What the tick has just said belongs before.
        self.deliver();
        for (session, reason) in waiting {
            self.live.0.tally.resyncs.fetch_add(1, Ordering::Relaxed);
            self.world.resync(session, reason, self.live.now_ms());
            self.deliver();
            self.show_statics(session, true);
        }
    }

    /// Hands on what has been written since the last tick.
    pub(super) async fn record(&mut self) {
        let Some(recorder) = &self.live.0.sources.recorder else {
            return;
        };
        if (self.ticked || self.world.is_empty())
            && let Some(written) = self.world.written()
        {
            recorder.write(&self.scene, written).await;
        }
        self.ticked = false;
    }
}
