//! Which node has the movers that outlive nodes? Each has one home: the node that made it, or, when that is gone, the one
//! of those left that has been there longest. A node that is asked to move one takes charge of it, so its home follows
//! whoever drives it. When two nodes have one, the one that took charge last keeps it.

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
    /// Movers that another node has taken charge of since.
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
            if ours.is_some_and(|ours_ms| (since_ms, node) > (ours_ms, us)) {
                self.kept.remove(object);
                self.yielded.insert(*object);
            }
        }
        self.yielded.len() > before
    }
}

impl Exchange {
    /// From now on this node keeps a mover, whichever did before.
    pub fn keep(&mut self, object: ObjectId, now_ms: Ms) {
        let mut since_ms = now_ms;
        self.adopt(object);
        for peer in self.peers.values() {
            let theirs_ms = peer.keeps.get(&object).map_or(since_ms, |theirs_ms| theirs_ms + 1);
            since_ms = since_ms.max(theirs_ms);
        }
        self.keeping.kept.insert(object, since_ms);
        self.hurry();
    }

    /// From now on a mover lives on this node: what is under way of it is said of another's.
    pub fn adopt(&mut self, object: ObjectId) {
        for peer in self.peers.values_mut() {
            peer.heard.movers.remove(&object);
        }
    }

    /// It does not any more.
    pub fn forget(&mut self, object: ObjectId) {
        self.keeping.kept.remove(&object);
    }

    /// Movers that another node has taken charge of: they must go from here, and come back as those of that node.
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
        self.keeping.kept.contains_key(&object) || self.peers.values().any(|peer| peer.keeps.contains_key(&object))
    }
}
