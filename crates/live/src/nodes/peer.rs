//! What does a node keep of another?

use std::collections::{BTreeMap, BTreeSet};

use belvedere_scene::{CellId, ObjectId};

use super::message::Count;
use crate::{Ms, motion::Pose};

#[derive(Debug)]
pub(super) struct Peer {
    pub(super) heard_ms: Ms,
    /// When it came to the scene, by its own clock.
    pub(super) since_ms: Ms,
    /// Number of the last beat or watch that counted.
    pub(super) beat: u64,
    /// Cells that its sessions watch.
    pub(super) watches: BTreeSet<CellId>,
    /// Movers that outlive nodes and that it has, with the time it took charge of each.
    pub(super) keeps: BTreeMap<ObjectId, Ms>,
    pub(super) told: Told,
    pub(super) heard: Heard,
}

/// What we have told it.
#[derive(Debug)]
pub(super) struct Told {
    pub(super) count: Count,
    /// Movers of ours that it has, with the pose that it extrapolates.
    pub(super) movers: BTreeMap<ObjectId, ToldPose>,
    /// It has missed something, or nothing was told yet.
    pub(super) owes_all: bool,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct ToldPose {
    pub(super) pose: Pose,
    /// The round in which it was last seen to be there.
    pub(super) round: u64,
}

/// What it has told us.
#[derive(Debug, Default)]
pub(super) struct Heard {
    pub(super) count: Count,
    /// Something is missing.
    pub(super) broken: bool,
    /// When we asked for it again.
    pub(super) asked_ms: Option<Ms>,
    /// Movers of its own that we have.
    pub(super) movers: BTreeSet<ObjectId>,
    /// When it last said that it tells us anything.
    pub(super) counted_ms: Ms,
}

impl Peer {
    pub(super) fn new(now_ms: Ms) -> Self {
        Self {
            heard_ms: now_ms,
            since_ms: now_ms,
            beat: 0,
            watches: BTreeSet::new(),
            keeps: BTreeMap::new(),
            told: Told {
                count: Count {
                    met_ms: now_ms,
                    number: 0,
                },
                movers: BTreeMap::new(),
                owes_all: false,
            },
            heard: Heard {
                counted_ms: now_ms,
                ..Heard::default()
            },
        }
    }

    pub(super) fn watches_any(&self, cells: &[CellId]) -> bool {
        cells.iter().any(|cell| self.watches.contains(cell))
    }
}
