//! The state machine of one node in one scene. Nothing here waits or knows a wire: messages go in with
//! [`Exchange::take`], and what is to be said comes out of [`Exchange::round`], which is called several times a tick.

use std::collections::{BTreeMap, BTreeSet};

use belvedere_scene::{Bounds, CellId, ObjectId};

use super::{
    BEAT_MS, LEASE_MS, NodeId,
    doors::Doors,
    keeping::Keeping,
    message::{Beat, DoorState, Letter, Said, Says, To, Watch},
    peer::Peer,
};
use crate::{Ms, event::Gone, journal::Journal};

/// One node among those of a scene.
#[derive(Debug)]
pub struct Exchange {
    pub(super) node: NodeId,
    /// When it came to the scene.
    pub(super) since_ms: Ms,
    /// Whether others can be heard, as far as is known here.
    pub(super) connected: bool,
    pub(super) peers: BTreeMap<NodeId, Peer>,
    pub(super) round: u64,
    pub(super) keeping: Keeping,
    doors: Doors,
    letters: Vec<Letter>,
    /// What others know of what is watched here.
    announced: Announced,
}

#[derive(Debug, Default)]
struct Announced {
    number: u64,
    watches: BTreeSet<CellId>,
    /// Of the world's watched cells, when that was so.
    changes: u64,
    /// When all was told; none when it must be told at once.
    beat_ms: Option<Ms>,
    /// Others are to beat too.
    asks: bool,
}

impl Exchange {
    /// A node that knows of no other.
    #[must_use]
    pub fn new(node: NodeId, now_ms: Ms) -> Self {
        Self {
            node,
            since_ms: now_ms,
            connected: false,
            peers: BTreeMap::new(),
            round: 0,
            keeping: Keeping::new(now_ms),
            doors: Doors::default(),
            letters: Vec::new(),
            announced: Announced::default(),
        }
    }

    /// Who it is.
    #[must_use]
    pub fn id(&self) -> &NodeId {
        &self.node
    }

    /// Other nodes of the scene, as far as it is known.
    pub fn peers(&self) -> impl Iterator<Item = &NodeId> {
        self.peers.keys()
    }

    /// Whether others can be heard.
    #[must_use]
    pub fn is_connected(&self) -> bool {
        self.connected
    }

    /// From now on others can be heard, or not; who comes back asks them what it has missed.
    pub fn set_connected(&mut self, connected: bool, now_ms: Ms) {
        if connected && !self.connected {
            self.announced.asks = true;
            self.hurry();
            self.keeping.look_later(now_ms);
        }
        self.connected = connected;
    }

    /// Everything that is to be known of this node is told in the next round.
    pub(super) fn hurry(&mut self) {
        self.announced.beat_ms = None;
    }

    /// Cells whose poses are to be heard: those of which others know that they are watched here.
    #[must_use]
    pub fn subscribed(&self) -> &BTreeSet<CellId> {
        &self.announced.watches
    }

    /// The world has other cells now. Others meet this node anew among those that have them too; what they have told stays
    /// until then, as long as they are heard of.
    pub fn revise(&mut self, now_ms: Ms) {
        self.doors.clear();
        self.letters.clear();
        self.announced.watches.clear();
        self.announced.changes = u64::MAX;
        self.announced.asks = true;
        self.hurry();
        for peer in self.peers.values_mut() {
            peer.watches.clear();
            peer.told.owes_all = true;
            peer.heard.counted_ms = now_ms;
        }
    }

    /// A door was moved on this node.
    pub fn set_door(&mut self, object: ObjectId, bounds: &Bounds, open: bool) {
        let state = self.doors.set(&self.node, object, bounds, open);
        if self.connected {
            self.write(To::All, Says::Door(state));
        }
    }

    /// A message has come. What was said for other ears, or by ourselves, changes nothing.
    pub fn take(&mut self, said: Said, world: &mut Journal, now_ms: Ms) {
        let Said { from, says } = said;
        if from == self.node {
            return;
        }
        if says == Says::Bye {
            self.part(&from, world, now_ms);
            return;
        }
        if !self.peers.contains_key(&from) {
            // It is to know of us without having asked.
            self.hurry();
            self.peers.insert(from.clone(), Peer::new(now_ms));
        }
        if let Some(peer) = self.peers.get_mut(&from) {
            peer.heard_ms = now_ms;
        }
        match says {
            Says::Beat(beat) => self.hear_beat(&from, beat, world, now_ms),
            Says::Watch(watch) => self.hear_watch(&from, &watch, world, now_ms),
            Says::Door(door) => self.hear_door(&door, world, now_ms),
            Says::Tell(tell) => self.hear_tell(&from, tell, world, now_ms),
            Says::Poses(poses) => self.hear_poses(&from, &poses, world, now_ms),
            Says::Again => {
                if let Some(peer) = self.peers.get_mut(&from) {
                    peer.told.owes_all = true;
                }
            }
            Says::Bye => {}
        }
    }

    fn hear_beat(&mut self, from: &NodeId, beat: Beat, world: &mut Journal, now_ms: Ms) {
        let Some(peer) = self.peers.get_mut(from) else { return };
        if beat.number <= peer.beat {
            return;
        }
        (peer.beat, peer.since_ms) = (beat.number, beat.since_ms);
        peer.keeps = beat.keeps.iter().copied().collect();
        // What was said of a mover that must go from here was not heeded.
        peer.heard.broken |= self.keeping.hear(from, &self.node, &beat.keeps);
        self.set_watches(from, beat.watches.into_iter().collect(), world, now_ms);
        if beat.asks {
            self.hurry();
        }
        for door in &beat.doors {
            self.hear_door(door, world, now_ms);
        }
        self.hear_count(from, beat.told.get(&self.node).copied(), now_ms);
    }

    fn hear_watch(&mut self, from: &NodeId, watch: &Watch, world: &mut Journal, now_ms: Ms) {
        let Some(peer) = self.peers.get_mut(from) else { return };
        // After a gap the next beat tells everything.
        if watch.number != peer.beat + 1 {
            return;
        }
        peer.beat = watch.number;
        let mut watches = peer.watches.clone();
        watches.retain(|cell| !watch.ended.contains(cell));
        watches.extend(&watch.begun);
        self.set_watches(from, watches, world, now_ms);
    }

    fn set_watches(&mut self, node: &NodeId, watches: BTreeSet<CellId>, world: &mut Journal, now_ms: Ms) {
        let Some(peer) = self.peers.get_mut(node) else { return };
        let before = std::mem::replace(&mut peer.watches, watches);
        let begun: Vec<_> = peer.watches.difference(&before).copied().collect();
        let others = |cell: &CellId| self.peers.values().any(|peer| peer.watches.contains(cell));
        let ended: Vec<_> = before.into_iter().filter(|cell| !others(cell)).collect();
        if !begun.is_empty() || !ended.is_empty() {
            world.watch_abroad(&begun, &ended, now_ms);
        }
    }

    fn hear_door(&mut self, door: &DoorState, world: &mut Journal, now_ms: Ms) {
        if self.doors.hear(door) {
            world.set_door(door.object, &door.bounds, door.open, now_ms);
        }
    }

    /// A node is gone, and its movers with it.
    fn part(&mut self, node: &NodeId, world: &mut Journal, now_ms: Ms) {
        self.set_watches(node, BTreeSet::new(), world, now_ms);
        if let Some(peer) = self.peers.remove(node) {
            for object in peer.heard.movers {
                world.withdraw(object, Gone::Left, now_ms);
            }
            self.keeping.look_later(now_ms);
        }
    }

    /// What is to be said now, in order. Nodes that were silent for too long are gone.
    pub fn round(&mut self, world: &mut Journal, now_ms: Ms) -> Vec<Letter> {
        self.end_leases(world, now_ms);
        if self.connected {
            self.announce(world, now_ms);
            self.export(world, now_ms);
        }
        std::mem::take(&mut self.letters)
    }

    /// The last words.
    #[must_use]
    pub fn bye(&self) -> Letter {
        Letter {
            to: To::All,
            said: Said {
                from: self.node.clone(),
                says: Says::Bye,
            },
        }
    }

    fn end_leases(&mut self, world: &mut Journal, now_ms: Ms) {
        let silent = self.peers.iter().filter(|(_, peer)| now_ms - peer.heard_ms > LEASE_MS);
        let silent: Vec<_> = silent.map(|(node, _)| node.clone()).collect();
        silent.iter().for_each(|node| self.part(node, world, now_ms));
        // Who lives, and says nothing to us, does not hear us: what it told is as old as that.
        for peer in self.peers.values_mut() {
            if now_ms - peer.heard.counted_ms > LEASE_MS && !peer.heard.movers.is_empty() {
                peer.heard.broken = true;
                for object in std::mem::take(&mut peer.heard.movers) {
                    world.withdraw(object, Gone::Left, now_ms);
                }
            }
        }
    }

    /// Says what is watched here, all of it now and then, and in between what has changed.
    fn announce(&mut self, world: &Journal, now_ms: Ms) {
        let (watched, changes) = world.watched();
        let last = &mut self.announced;
        let beats = last.beat_ms.is_none_or(|beat_ms| now_ms - beat_ms >= BEAT_MS);
        if !beats && last.changes == changes {
            return;
        }
        let (begun, ended): (Vec<_>, Vec<_>) = (
            watched.difference(&last.watches).copied().collect(),
            last.watches.difference(watched).copied().collect(),
        );
        last.changes = changes;
        if !beats && begun.is_empty() && ended.is_empty() {
            return;
        }
        last.watches = watched.clone();
        last.number += 1;
        let number = last.number;
        let says = if beats {
            last.beat_ms = Some(now_ms);
            Says::Beat(Beat {
                number,
                since_ms: self.since_ms,
                asks: std::mem::take(&mut last.asks),
                watches: watched.iter().copied().collect(),
                told: self
                    .peers
                    .iter()
                    .map(|(node, peer)| (node.clone(), peer.told.count))
                    .collect(),
                doors: self.doors.all(),
                keeps: self.keeping.all(),
            })
        } else {
            Says::Watch(Watch { number, begun, ended })
        };
        self.write(To::All, says);
    }

    pub(super) fn write(&mut self, to: To, says: Says) {
        let from = self.node.clone();
        self.letters.push(Letter {
            to,
            said: Said { from, says },
        });
    }
}
