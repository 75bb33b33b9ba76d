//! Which node has the movers that outlive nodes? Each has one home: the node that made it, or, when that is gone, the one
//! of those left that has been there longest. When two nodes had it, because they did not hear of each other, the one
//! that took charge first keeps it.

use std::collections::{BTreeMap, BTreeSet};

use belvedere_scene::ObjectId;

use super::{BEAT_MS, Exchange, NodeId};
use crate::Ms;

/// Before a node takes charge of what nobody seems to have, it listens for so long.
const SETTLE_MS: Ms = 2 * BEAT_MS;

#[derive(Debug)]
pub(super) struct Keeping {
    /// Movers that are kept here, with the time when that began.
    kept: BTreeMap<ObjectId, Ms>,
    /// Movers that another node keeps with more right.
    yielded: BTreeSet<ObjectId>,
    /// When to look whether something has no home; none when all is well.
    look_at_ms: Option<Ms>,
    /// Nobody has looked since the node came: it may do so while it is cut off.
    fresh: bool,
}

impl Keeping {
    pub(super) fn new(now_ms: Ms) -> Self {
        Self {
            kept: BTreeMap::new(),
            yielded: BTreeSet::new(),
            look_at_ms: Some(now_ms + SETTLE_MS),
            fresh: true,
        }
    }

    /// Something may have lost its home.
    pub(super) fn look_later(&mut self, now_ms: Ms) {
        self.look_at_ms = Some(now_ms + SETTLE_MS);
    }

    pub(super) fn all(&self) -> Vec<(ObjectId, Ms)> {
        self.kept
            .iter()
            .map(|(object, since_ms)| (*object, *since_ms))
            .collect()
    }

    /// Another node says what it keeps; whether something must go from here for it.
    pub(super) fn hear(&mut self, node: &NodeId, us: &NodeId, keeps: &[(ObjectId, Ms)]) -> bool {
        let before = self.yielded.len();
        for (object, since_ms) in keeps {
            let ours = self.kept.get(object);
            if ours.is_some_and(|ours_ms| (since_ms, node) < (ours_ms, us)) {
                self.kept.remove(object);
                self.yielded.insert(*object);
            }
        }
        self.yielded.len() > before
    }
}

impl Exchange {
    /// From now on this node keeps a mover.
    pub fn keep(&mut self, object: ObjectId, now_ms: Ms) {
        self.keeping.kept.insert(object, now_ms);
        self.hurry();
    }

    /// It does not any more.
    pub fn forget(&mut self, object: ObjectId) {
        self.keeping.kept.remove(&object);
    }

    /// Movers that another node keeps with more right: they must go from here, and come back as those of that node.
    pub fn yielded(&mut self) -> BTreeSet<ObjectId> {
        std::mem::take(&mut self.keeping.yielded)
    }

    /// Whether it is for this node to take charge of kept movers that have no home; told once each time.
    pub fn takes_charge(&mut self, now_ms: Ms) -> bool {
        let due = self.keeping.look_at_ms.is_some_and(|at_ms| at_ms <= now_ms);
        if !due || !(self.connected || self.keeping.fresh) {
            return false;
        }
        self.keeping.look_at_ms = None;
        self.keeping.fresh = false;
        let us = (self.since_ms, &self.node);
        self.peers.iter().all(|(node, peer)| us < (peer.since_ms, node))
    }

    /// Whether some node has a mover.
    #[must_use]
    pub fn is_kept(&self, object: ObjectId) -> bool {
        self.keeping.kept.contains_key(&object) || self.peers.values().any(|peer| peer.keeps.contains(&object))
    }
}
