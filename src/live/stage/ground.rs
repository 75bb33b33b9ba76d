//! How does a scene's task know what the rules must know of the scene? It has found out what closed doors hide of it, follows
//! new revisions, and puts back what outlived the server.

use std::{
    collections::BTreeSet,
    sync::{Arc, atomic::Ordering},
    time::{Duration, Instant},
};

use belvedere_live::{
    event::{Event, Manifest},
    world::NewMover,
};
use belvedere_scene::{ObjectId, Revision};

use super::Stage;
use crate::{
    live::{
        Door, Token, keeping,
        message::{Message, StageHandle},
        screens::{self, Screen},
        terrain::{Prospect, Terrain},
    },
    published::ReadError,
};

/// A revision that could not be read is tried again after so long.
const READ_AGAIN: Duration = Duration::from_secs(10);

impl Stage {
    /// Puts back whatever outlived the server; movers only when no other node may have them.
    pub(super) async fn restore(&mut self, handle: &StageHandle) {
        if let Err(error) = self.restore_doors().await {
            tracing::error!(scene = %self.scene, %error, "how doors stood cannot be read");
        }
        if self.abroad.is_none() {
            self.restore_movers(handle).await;
        }
    }

    async fn restore_doors(&mut self) -> anyhow::Result<()> {
        let (catalogue, revision) = (&self.live.0.sources.catalogue, self.terrain.published.pointer.revision);
        for Door { object, bounds, open } in keeping::kept_doors(catalogue, &self.scene, revision).await? {
            self.world.set_door(object, &bounds, open, self.live.now_ms());
        }
        Ok(())
    }

    async fn restore_movers(&mut self, handle: &StageHandle) {
        match keeping::kept_movers(&self.live.0.sources.catalogue, &self.scene).await {
            Ok(movers) => self.put_back(movers, handle),
            Err(error) => tracing::error!(scene = %self.scene, %error, "the movers that were kept cannot be read"),
        }
    }

    /// Has it read which movers were kept, beside the scene's task.
    pub(super) fn find_kept(&mut self, handle: &StageHandle) {
        if self.destroyed.is_some() {
            // Somebody is reading it.
            return;
        }
        self.destroyed = Some(BTreeSet::new());
        let (catalogue, scene, handle) = (
            self.live.0.sources.catalogue.clone(),
            self.scene.clone(),
            handle.clone(),
        );
        tokio::spawn(async move {
            let kept = keeping::kept_movers(&catalogue, &scene).await;
            let kept = kept.unwrap_or_else(|error| {
                tracing::error!(%scene, %error, "the movers that were kept cannot be read");
                Vec::new()
            });
            _ = handle.send(Message::Kept(kept)).await;
        });
    }

    /// Puts back the movers that were kept and that no node has.
    pub(super) fn put_back(&mut self, movers: Vec<(ObjectId, Token, NewMover)>, handle: &StageHandle) {
        for (object, token, new) in movers {
            if self.world.holds(object) || self.is_kept_elsewhere(object) {
                continue;
            }
            if !self.live.0.registry.restore_mover(handle, object, token) {
                tracing::warn!(scene = %self.scene, %object, "a mover stays away: another one of its id lives here");
                continue;
            }
            match self.world.create(object, None, new, self.live.now_ms()) {
                Ok(_) => self.stay(object),
                Err(refusal) => {
                    self.live.0.registry.end_mover(object);
                    tracing::warn!(scene = %self.scene, %object, %refusal, "a mover has no place any more");
                }
            }
        }
    }

    /// Has it found out what closed doors hide from where people are.
    pub(super) fn find_screens(&mut self, handle: &StageHandle) {
        if self.proving {
            return;
        }
        if let Some(question) = self.world.next_unscreened() {
            self.proving = true;
            screens::find(self.terrain.published.clone(), question, handle.clone());
        }
    }

    pub(super) fn screen(&mut self, revision: Revision, screen: Result<Option<Screen>, ReadError>) {
        self.proving = false;
        match screen {
            // Cells of another revision are other cells.
            Ok(Some(screen)) if Arc::ptr_eq(&screen.published, &self.terrain.published) => {
                let now_ms = self.live.now_ms();
                self.world.screen(screen.cell, &screen.closed, &screen.hidden, now_ms);
            }
            Ok(_) => {}
            Err(error) => {
                self.live.0.tally.unscreened.fetch_add(1, Ordering::Relaxed);
                if self.no_screens.is_news(revision, Instant::now()) {
                    tracing::error!(scene = %self.scene, %revision, %error, "doors hide nothing: what hides in the scene cannot be read");
                }
            }
        }
    }

    /// Has a new revision read, beside the scene's task; says whether that is under way. The old one stays while the new one cannot
    /// be read.
    pub(super) fn follow(&mut self, handle: &StageHandle) -> bool {
        if self.following {
            return true;
        }
        let Some(published) = self.live.0.sources.publications.scene(&self.scene) else {
            return false;
        };
        let revision = published.pointer.revision;
        if Arc::ptr_eq(&published, &self.terrain.published) || self.is_unreadable(revision) {
            return false;
        }
        self.look_ahead(Terrain { published }, None, handle);
        true
    }

    /// Whether somebody who comes in has to wait for a new revision. Where nobody is nothing ticks, so nobody has followed it yet, and
    /// what the old one is read from may be gone.
    pub(super) fn is_outdated(&mut self, handle: &StageHandle) -> bool {
        self.world.is_empty() && self.follow(handle)
    }

    /// Those who waited for a new revision, and still want to come in, once nobody reads one any more.
    pub(super) fn let_in(&mut self) -> Vec<Message> {
        if self.following {
            return Vec::new();
        }
        let mut outside = std::mem::take(&mut self.outside);
        outside.retain(|message| !message.is_forsaken());
        outside
    }

    /// Whether a revision could not be read a moment ago.
    pub(super) fn is_unreadable(&self, revision: Revision) -> bool {
        let since = self.unreadable.filter(|(unreadable, _)| *unreadable == revision);
        since.is_some_and(|(_, tried)| tried.elapsed() < READ_AGAIN)
    }

    /// Has read what must be known before people go on with a revision, and is not yet.
    fn look_ahead(&mut self, terrain: Terrain, prospect: Option<Box<Prospect>>, handle: &StageHandle) {
        self.following = true;
        let (eyes, handle) = (self.world.eyes().collect::<Vec<_>>(), handle.clone());
        tokio::spawn(async move {
            let read = match prospect {
                Some(mut prospect) => terrain.look_around(&mut prospect, &eyes).await.map(|()| prospect),
                None => terrain.prospect(&eyes).await.map(Box::new),
            };
            _ = handle.send(Message::Newer { terrain, read }).await;
        });
    }

    /// Goes on with a new revision that was read.
    pub(super) async fn go_on(
        &mut self,
        terrain: Terrain,
        read: Result<Box<Prospect>, ReadError>,
        handle: &StageHandle,
    ) {
        self.following = false;
        match read {
            Ok(prospect) => {
                let eyes: Vec<_> = self.world.eyes().collect();
                if !prospect.unknown_under(&eyes).is_empty() {
                    // Somebody has gone on meanwhile.
                    self.look_ahead(terrain, Some(prospect), handle);
                    return;
                }
                self.rebase(terrain, &prospect, handle).await;
            }
            Err(error) => {
                let revision = terrain.published.pointer.revision;
                tracing::error!(scene = %self.scene, %revision, %error, "visitors stay with an earlier revision");
                self.unreadable = Some((revision, Instant::now()));
            }
        }
        for (asked, who) in std::mem::take(&mut self.doors_to_come) {
            self.move_door(asked, who, handle);
        }
    }

    async fn rebase(&mut self, terrain: Terrain, prospect: &Prospect, handle: &StageHandle) {
        self.deliver().await;
        let published = &terrain.published;
        let revision = Event::Revision {
            revision: published.pointer.revision,
            manifest: Manifest(published.pointer.manifest.clone()),
        };
        for (session, person) in &self.people {
            let say = || person.outbox.push(&revision);
            if let Some(view) = self.views.get(session) {
                // In one step: what stands around it is told of the old revision before, and of the new one after.
                view.send_modify(|view| {
                    view.turn_to(published.clone());
                    say();
                });
            } else {
                say();
            }
        }
        self.world
            .rebase(&prospect.ground, &prospect.sights, self.live.now_ms());
        self.terrain = terrain;
        self.move_abroad(handle);
    }
}
