//! What does a node tell others of its own movers? Only of those that are awake in a cell which the other watches: an
//! introduction when one comes in, a word when it goes, and in between, through the subject of one of its cells, poses that
//! the other would extrapolate wrongly.
//!
//! A pose goes into as few cells as reach every node that watches one of the mover's. Work in a round is that of the movers
//! that are awake, times nodes; nothing is said of who is hushed.

use std::collections::{BTreeMap, BTreeSet};

use belvedere_scene::{CellId, ObjectId};

use super::{
    Exchange, REFRESH_MS,
    message::{NodeId, Poses, Says, Tell, To},
    peer::ToldPose,
};
use crate::{
    Ms, World,
    cells::distance_m,
    motion::Pose,
    pace,
    world::{Exported, NewMover},
};

/// Half of what shows nearby: sessions over there are told with a tolerance of their own.
const TOLERANCE: f64 = 0.5;
/// A message holds at most so many introductions.
const MOST_INTRODUCED: usize = 100;
/// A message holds at most so many poses.
const MOST_POSES: usize = 1_000;

/// Movers that one node is introduced to in a round.
type Introduced = BTreeMap<NodeId, Vec<(ObjectId, NewMover)>>;

impl Exchange {
    /// Tells other nodes what they may see.
    pub(super) fn export(&mut self, world: &World, now_ms: Ms) {
        self.round += 1;
        let mut all = BTreeSet::new();
        for (node, peer) in &mut self.peers {
            if std::mem::take(&mut peer.told.owes_all) {
                peer.told.movers.clear();
                all.insert(node.clone());
            }
        }
        let mut poses: BTreeMap<CellId, Poses> = BTreeMap::new();
        let mut introduced = Introduced::new();
        for mover in world.exported(now_ms) {
            if self.see(&mover, &mut introduced, now_ms) {
                for cell in self.reaching(&mover) {
                    poses.entry(cell).or_default().push(mover.object, &mover.pose);
                }
            }
        }
        self.tell(world, introduced, &all);
        for (cell, batch) in poses {
            for part in batch.poses.chunks(MOST_POSES) {
                let poses = part.to_vec();
                self.write(To::Cell(cell), Says::Poses(Poses { t_ms: now_ms, poses }));
            }
        }
    }

    /// Takes note of a mover for each node that may see it; says whether its pose is due.
    fn see(&mut self, mover: &Exported<'_>, introduced: &mut Introduced, now_ms: Ms) -> bool {
        let (mut due, round, pose) = (false, self.round, mover.pose);
        for (node, peer) in &mut self.peers {
            if !peer.watches_any(mover.cells) {
                continue;
            }
            match peer.told.movers.get_mut(&mover.object) {
                Some(told) => {
                    told.round = round;
                    due |= is_wrong(&told.pose, &pose, now_ms);
                }
                None => {
                    peer.told.movers.insert(mover.object, ToldPose { pose, round });
                    let introduction = (mover.object, mover.introduction());
                    introduced.entry(node.clone()).or_default().push(introduction);
                }
            }
        }
        due
    }

    /// As few cells as reach everybody who may see a mover; takes note that they hear its pose.
    fn reaching(&mut self, mover: &Exported<'_>) -> Vec<CellId> {
        let (mut cells, mut reached) = (Vec::new(), BTreeSet::new());
        for cell in mover.cells {
            let before = reached.len();
            for (node, peer) in &mut self.peers {
                if peer.watches.contains(cell)
                    && let Some(told) = peer.told.movers.get_mut(&mover.object)
                {
                    told.pose = mover.pose;
                    reached.insert(node.clone());
                }
            }
            if reached.len() > before {
                cells.push(*cell);
            }
        }
        cells
    }

    /// Tells each node what has come and gone.
    fn tell(&mut self, world: &World, mut introduced: Introduced, all: &BTreeSet<NodeId>) {
        let (round, mut letters) = (self.round, Vec::new());
        for (node, peer) in &mut self.peers {
            let appear = introduced.remove(node).unwrap_or_default();
            let gone = peer.told.movers.extract_if(.., |_, told| told.round != round);
            let (hidden, ended): (Vec<_>, Vec<_>) =
                gone.map(|(object, _)| object).partition(|object| world.holds(*object));
            let whole = all.contains(node).then(|| peer.told.movers.keys().copied().collect());
            if appear.is_empty() && hidden.is_empty() && ended.is_empty() && whole.is_none() {
                continue;
            }
            let mut parts = appear.chunks(MOST_INTRODUCED).map(<[_]>::to_vec);
            let mut tell = Tell {
                all: whole,
                appear: parts.next().unwrap_or_default(),
                hidden,
                ended,
                ..Tell::default()
            };
            loop {
                peer.told.count.number += 1;
                tell.count = peer.told.count;
                letters.push((To::Node(node.clone()), Says::Tell(tell)));
                let Some(appear) = parts.next() else { break };
                tell = Tell {
                    appear,
                    ..Tell::default()
                };
            }
        }
        letters.into_iter().for_each(|(to, says)| self.write(to, says));
    }
}

/// Whether somebody who extrapolates the one pose must hear the other.
fn is_wrong(told: &Pose, pose: &Pose, now_ms: Ms) -> bool {
    distance_m(told.position_at(now_ms), pose.position) > TOLERANCE * pace::tolerance_m(0.0)
        || told.turned_rad(pose) > TOLERANCE * pace::TOLERANCE_RAD
        || now_ms - told.t_ms >= REFRESH_MS
}
