//! What does a node say, and to whom? Values that JSON can carry; `docs/NODES.md` describes them for others.

use std::{collections::BTreeMap, fmt, str::FromStr};

use belvedere_scene::{Bounds, CellId, ObjectId};
use serde::{Deserialize, Serialize};

use crate::{Ms, motion::Pose, world::NewMover};

/// One run of one server: whoever starts again is another node.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct NodeId(String);

/// The text names no node.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("a node's name has 1 to {MOST_NAME} lower-case letters, digits and hyphens")]
pub struct NoNodeId;

const MOST_NAME: usize = 64;

impl FromStr for NodeId {
    type Err = NoNodeId;

    fn from_str(text: &str) -> Result<Self, NoNodeId> {
        let plain = text.bytes().all(|b| matches!(b, b'a'..=b'z' | b'0'..=b'9' | b'-'));
        let fits = (1..=MOST_NAME).contains(&text.len());
        (plain && fits).then(|| Self(text.to_owned())).ok_or(NoNodeId)
    }
}

impl TryFrom<String> for NodeId {
    type Error = NoNodeId;

    fn try_from(text: String) -> Result<Self, NoNodeId> {
        text.parse()
    }
}

impl From<NodeId> for String {
    fn from(node: NodeId) -> Self {
        node.0
    }
}

impl fmt::Display for NodeId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// A message with its address.
#[derive(Debug, Clone, PartialEq)]
pub struct Letter {
    /// Who should hear it.
    pub to: To,
    /// What is said.
    pub said: Said,
}

/// Who hears a message.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum To {
    /// All nodes of the scene that have the same revision.
    All,
    /// One of them.
    Node(NodeId),
    /// Those whose sessions watch a cell.
    Cell(CellId),
}

/// What a node says.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Said {
    /// Who says it.
    pub from: NodeId,
    /// What.
    pub says: Says,
}

/// What can be said.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Says {
    /// To all: it lives, and watches these cells.
    Beat(Beat),
    /// To all: it watches others.
    Watch(Watch),
    /// To all: it goes.
    Bye,
    /// To all: a door was moved.
    Door(DoorState),
    /// To one: movers come into the cells that it watches, or out of them.
    Tell(Tell),
    /// To one: what was told has been lost; tell it again.
    Again,
    /// To a cell: where movers in it are.
    Poses(Poses),
}

/// All that a node wants others to know of it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Beat {
    /// Beats and watches are counted together.
    pub number: u64,
    /// When it came to the scene, by its own clock.
    pub since_ms: Ms,
    /// Whoever hears it is to beat at once.
    #[serde(default)]
    pub asks: bool,
    /// Cells that its sessions watch.
    pub watches: Vec<CellId>,
    /// What it has told whom.
    pub told: BTreeMap<NodeId, Count>,
    /// Doors that were moved since it came.
    #[serde(default)]
    pub doors: Vec<DoorState>,
    /// Movers that outlive nodes and that it has, each with the time it took charge of it.
    #[serde(default)]
    pub keeps: Vec<(ObjectId, Ms)>,
}

/// A change of what a node watches.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Watch {
    /// Beats and watches are counted together; it counts only after the one before.
    pub number: u64,
    /// From now on.
    pub begun: Vec<CellId>,
    /// No longer.
    pub ended: Vec<CellId>,
}

/// How much one node has told another.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Count {
    /// When they met; counting begins anew when they meet again.
    pub met_ms: Ms,
    /// So many messages.
    pub number: u64,
}

/// Movers that come and go for another node.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Tell {
    /// Which of all.
    pub count: Count,
    /// These are all movers that it is told of; what it was told before is void.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub all: Option<Vec<ObjectId>>,
    /// What it may see from now on.
    #[serde(default)]
    pub appear: Vec<(ObjectId, NewMover)>,
    /// What it may not.
    #[serde(default)]
    pub hidden: Vec<ObjectId>,
    /// What does not exist any more.
    #[serde(default)]
    pub ended: Vec<ObjectId>,
}

/// A mover with its position, orientation, velocity and acceleration.
pub type Whereabouts = (ObjectId, [f64; 3], [f64; 4], [f64; 3], [f64; 3]);

/// Where movers are.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Poses {
    /// When that was so, by the clock of who says it.
    pub t_ms: Ms,
    /// Each mover at most once.
    pub poses: Vec<Whereabouts>,
}

impl Poses {
    pub(super) fn push(&mut self, object: ObjectId, pose: &Pose) {
        self.poses.push((
            object,
            pose.position,
            pose.orientation,
            pose.velocity,
            pose.acceleration,
        ));
    }

    /// The movers with their poses.
    pub(super) fn iter(&self) -> impl Iterator<Item = (ObjectId, Pose)> {
        let t_ms = self.t_ms;
        self.poses
            .iter()
            .map(move |(object, position, orientation, velocity, acceleration)| {
                let pose = Pose {
                    t_ms,
                    position: *position,
                    orientation: *orientation,
                    velocity: *velocity,
                    acceleration: *acceleration,
                };
                (*object, pose)
            })
    }
}

/// How a door stands, and who says so.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DoorState {
    /// A static object of the revision.
    pub object: ObjectId,
    /// The box around it.
    pub bounds: Bounds,
    /// Whether one can see and go through.
    pub open: bool,
    /// Whose word it is: the larger one counts.
    pub stamp: Stamp,
}

/// The time of a change among nodes without a common clock (Lamport, *Time, Clocks, and the Ordering of Events in a
/// Distributed System*, 1978): a counter that goes on from the largest that was heard of, and the node, for ties.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Stamp {
    /// Larger than that of what it replaces.
    pub counter: u64,
    /// Who moved it.
    pub node: NodeId,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_the_json_that_is_documented() {
        let said = Said {
            from: "a-1f".parse().unwrap(),
            says: Says::Watch(Watch {
                number: 3,
                begun: vec![CellId(7)],
                ended: vec![],
            }),
        };
        let json = serde_json::to_string(&said).unwrap();
        assert_eq!(
            json,
            r#"{"from":"a-1f","says":{"watch":{"number":3,"begun":["c7"],"ended":[]}}}"#
        );
        assert_eq!(serde_json::from_str::<Said>(&json).unwrap(), said);
        let bye = r#"{"from":"a-1f","says":"bye"}"#;
        assert_eq!(serde_json::from_str::<Said>(bye).unwrap().says, Says::Bye);
    }

    #[test]
    fn names_are_fit_for_subjects() {
        for text in ["", "A", "a.b", "a b", "*", &"a".repeat(65)] {
            assert_eq!(text.parse::<NodeId>(), Err(NoNodeId), "{text}");
        }
        assert_eq!("eu-1-3f".parse::<NodeId>().unwrap().to_string(), "eu-1-3f");
    }
}
