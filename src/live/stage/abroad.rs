//! What has a scene's task to do with other nodes? It gives what they say to the exchange and what the exchange says to the
//! wire, several times a tick, tells sessions when others cannot be heard, and takes charge of kept movers that have lost
//! their node.

use belvedere_live::world::NewMover;
use belvedere_live::{
    event::{Event, Gone, Network, SessionId},
    nodes::{
        Exchange,
        message::{Said, Says},
    },
};
use belvedere_scene::{ObjectId, Revision, SceneName};
use tokio::sync::watch;

use super::{Live, Stage};
use crate::live::{
    LiveError,
    message::StageHandle,
    nodes::{Link, Nodes},
    terrain::Terrain,
};

/// So often in a tick others are told what has changed.
pub(super) const ROUNDS: u32 = 4;

/// Other nodes of a scene.
pub(super) struct Abroad {
    pub(super) exchange: Exchange,
    nodes: Nodes,
    link: Link,
    connected: watch::Receiver<bool>,
}

impl Abroad {
    /// None where there are no other nodes.
    pub(super) fn begin(live: &Live, scene: &SceneName, terrain: &Terrain, handle: &StageHandle) -> Option<Self> {
        let nodes = live.0.sources.nodes.clone()?;
        let (revision, connected) = (terrain.published.pointer.revision, nodes.connected());
        let mut exchange = nodes.exchange(live.0.clock);
        exchange.set_connected(*connected.borrow(), live.now_ms());
        Some(Self {
            exchange,
            link: Link::start(&nodes, scene, revision, handle, &live.0.stopping),
            connected,
            nodes,
        })
    }
}

impl Stage {
    /// Another node says something.
    pub(super) fn hear(&mut self, revision: Revision, said: Said) {
        let now_ms = self.live.now_ms();
        // Cells of another revision are other cells.
        if let Some(abroad) = &mut self.abroad
            && revision == self.terrain.published.pointer.revision
        {
            let may_move_doors = matches!(said.says, Says::Door(_) | Says::Beat(_));
            let closed = may_move_doors.then(|| self.world.closed());
            abroad.exchange.take(said, &mut self.world, now_ms);
            if closed.is_some_and(|closed| closed != self.world.closed()) {
                self.show_statics_to_all();
            }
        }
    }

    /// Tells others what has changed.
    pub(super) fn exchange(&mut self, handle: &StageHandle) {
        // Where nobody is nothing ticks; but who stays behind in an old revision would hear nobody and think itself alone.
        if self.world.is_empty() {
            self.follow(handle);
        }
        let now_ms = self.live.now_ms();
        let Some(abroad) = &mut self.abroad else { return };
        let connected = *abroad.connected.borrow();
        if connected != abroad.exchange.is_connected() {
            abroad.exchange.set_connected(connected, now_ms);
            let sessions: Vec<_> = self.people.keys().copied().collect();
            sessions.into_iter().for_each(|session| self.tell_network(session));
        }
        let Some(abroad) = &mut self.abroad else { return };
        for object in abroad.exchange.yielded() {
            self.keeping.forget(object);
            self.world.destroy(object, now_ms);
            self.live.0.registry.end_mover(object);
        }
        let letters = abroad.exchange.round(&mut self.world, now_ms);
        abroad.link.listen_to(abroad.exchange.subscribed());
        letters.iter().for_each(|letter| abroad.link.send(letter));
        abroad.nodes.count_others(&self.scene, abroad.exchange.peers().count());
        if abroad.exchange.takes_charge(now_ms) {
            self.find_kept(handle);
        }
    }

    /// The scene has other cells.
    pub(super) fn move_abroad(&mut self, handle: &StageHandle) {
        let (now_ms, revision) = (self.live.now_ms(), self.terrain.published.pointer.revision);
        if let Some(abroad) = &mut self.abroad {
            abroad.exchange.revise(now_ms);
            abroad.link = Link::start(&abroad.nodes, &self.scene, revision, handle, &self.live.0.stopping);
        }
    }

    /// Whether others can be heard, where there may be some.
    pub(super) fn network(&self) -> Option<Network> {
        let connected = self.abroad.as_ref()?.exchange.is_connected();
        Some(if connected { Network::Whole } else { Network::CutOff })
    }

    /// Tells a session whether others can be heard.
    pub(super) fn tell_network(&self, session: SessionId) {
        if let (Some(network), Some(person)) = (self.network(), self.people.get(&session)) {
            person.outbox.push(&Event::Network { network });
        }
    }

    /// A mover stays here.
    pub(super) fn stay(&mut self, object: ObjectId) {
        self.keeping.stay(object);
        if let Some(abroad) = &mut self.abroad {
            abroad.exchange.keep(object, self.live.now_ms());
        }
    }

    /// A mover is about to come here that may still be known as one of another node's.
    pub(super) fn adopt(&mut self, object: ObjectId) {
        if self.world.holds(object) {
            self.world.withdraw(object, Gone::Hidden, self.live.now_ms());
        }
        if let Some(abroad) = &mut self.abroad {
            abroad.exchange.adopt(object);
        }
    }

    /// A mover that stays has its home here from now on, and not where it had it before.
    pub(super) fn take_over(&mut self, object: ObjectId, new: NewMover) -> Result<(), LiveError> {
        let now_ms = self.live.now_ms();
        self.world.withdraw(object, Gone::Hidden, now_ms);
        if !self.world.holds(object) {
            self.world.create(object, None, new, now_ms)?;
            self.stay(object);
        }
        Ok(())
    }

    /// It does not any more.
    pub(super) fn forget(&mut self, object: ObjectId) {
        self.keeping.forget(object);
        if let Some(abroad) = &mut self.abroad {
            abroad.exchange.forget(object);
        }
    }

    /// Whether some node has a kept mover.
    pub(super) fn is_kept_elsewhere(&self, object: ObjectId) -> bool {
        self.abroad
            .as_ref()
            .is_some_and(|abroad| abroad.exchange.is_kept(object))
    }
}
