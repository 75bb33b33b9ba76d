//! How does a scene's task know what the rules must know of the scene? It reads what is seen from where people stand, has
//! found out what closed doors hide of it, follows new revisions, and puts back what outlived the server.

use std::sync::Arc;

use belvedere_live::event::{Event, Manifest};
use belvedere_scene::CellId;

use super::Stage;
use crate::{
    live::{
        Door, keeping,
        message::StageHandle,
        screens::{self, Screen},
        terrain::Terrain,
    },
    published::ReadError,
};

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

    /// Puts back the movers that were kept and that no node has.
    pub(super) async fn restore_movers(&mut self, handle: &StageHandle) {
        let movers = match keeping::kept_movers(&self.live.0.sources.catalogue, &self.scene).await {
            Ok(movers) => movers,
            Err(error) => {
                tracing::error!(scene = %self.scene, %error, "the movers that were kept cannot be read");
                return;
            }
        };
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

    /// Reads what is seen from cells where nobody has stood yet.
    pub(super) async fn learn(&mut self, cells: Vec<CellId>) -> Result<(), ReadError> {
        for (cell, sees) in self.terrain.sights(cells).await? {
            self.world.teach(cell, &sees, self.live.now_ms());
        }
        Ok(())
    }

    /// Has it found out what closed doors hide from where people are.
    pub(super) fn find_screens(&mut self, handle: &StageHandle) {
        if self.proving {
            return;
        }
        let questions = self.world.unscreened();
        if !questions.is_empty() {
            self.proving = true;
            screens::find(self.terrain.published.clone(), questions, handle.clone());
        }
    }

    pub(super) fn screen(&mut self, screen: &Screen) {
        // Cells of another revision are other cells.
        if Arc::ptr_eq(&screen.published, &self.terrain.published) {
            let now_ms = self.live.now_ms();
            self.world.screen(screen.cell, &screen.closed, &screen.hidden, now_ms);
        }
    }

    /// Goes on with a new revision; with the old one while the new one cannot be read.
    pub(super) async fn follow(&mut self, handle: &StageHandle) {
        let Some(published) = self.live.0.sources.publications.scene(&self.scene) else {
            return;
        };
        let revision = published.pointer.revision;
        if Arc::ptr_eq(&published, &self.terrain.published) || self.unreadable == Some(revision) {
            return;
        }
        if let Err(error) = self.rebase(Terrain { published }, handle).await {
            tracing::error!(scene = %self.scene, %revision, %error, "visitors stay with an earlier revision");
            self.unreadable = Some(revision);
        }
    }

    async fn rebase(&mut self, terrain: Terrain, handle: &StageHandle) -> Result<(), ReadError> {
        let ground = terrain.ground().await?;
        let sights = terrain.sights_around(&ground, self.world.eyes()).await?;
        self.deliver().await;
        let pointer = &terrain.published.pointer;
        for person in self.people.values() {
            person.outbox.push(&Event::Revision {
                revision: pointer.revision,
                manifest: Manifest(pointer.manifest.clone()),
            });
        }
        self.world.rebase(&ground, &sights, self.live.now_ms());
        self.terrain = terrain;
        self.move_abroad(handle);
        self.show_statics_to_all(true);
        Ok(())
    }
}
