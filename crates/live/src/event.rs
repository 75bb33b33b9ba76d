//! What is a session told?
//!
//! Each event has a name and JSON data; `docs/LIVE.md` describes them for clients. Ids are those of the scene's revision,
//! or of movers, which are counted from [`FIRST_MOVER`] on and never reused.

use std::{fmt, str::FromStr, sync::Arc};

use belvedere_scene::{BlobName, CellId, ObjectId, Revision, SceneName, object::ObjectInfo};
use serde::{Deserialize, Serialize};

use crate::{Ms, motion::Pose, tbv::Tbv};

/// Movers' ids start here, where no revision's objects are.
pub const FIRST_MOVER: u32 = 100_000_000;

/// A session, `s7`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SessionId(pub u64);

impl fmt::Display for SessionId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "s{}", self.0)
    }
}

/// The text names no session.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not a session: expected `s` and a number, like `s12`")]
pub struct NoSessionId(String);

impl FromStr for SessionId {
    type Err = NoSessionId;

    fn from_str(text: &str) -> Result<Self, NoSessionId> {
        let digits = text.strip_prefix('s').filter(|digits| {
            digits.bytes().all(|b| b.is_ascii_digit()) && (*digits == "0" || !digits.starts_with('0'))
        });
        let number = digits.and_then(|digits| digits.parse().ok());
        number.map(Self).ok_or_else(|| NoSessionId(text.to_owned()))
    }
}

impl Serialize for SessionId {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> serde::Deserialize<'de> for SessionId {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = std::borrow::Cow::<'de, str>::deserialize(deserializer)?;
        text.parse().map_err(serde::de::Error::custom)
    }
}

/// Something that a session is told.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Event {
    /// The stream begins.
    Hello(Hello),
    /// What was told before is void; a snapshot follows.
    Resync {
        /// Why.
        reason: Void,
    },
    /// The participant is in another cell.
    Cell {
        /// That cell.
        cell: CellId,
    },
    /// A mover or a static object that the session did not know.
    ObjectInfo(Box<Told>),
    /// Where movers are.
    ObjectPos {
        /// The time of the tick.
        t_ms: Ms,
        /// At most one entry for each mover. Sessions that are told the same share it.
        objects: Arc<[ObjectPose]>,
    },
    /// Movers that are no longer told of.
    ObjectGone {
        /// The movers.
        objects: Vec<ObjectId>,
        /// Why.
        reason: Gone,
    },
    /// Nobody may see one of the session's own movers: it need not speak.
    Hush(Hush),
    /// Somebody may see it, or its volume is void: it must speak.
    Wake {
        /// The mover.
        object: ObjectId,
    },
    /// How often movers are told of from now on.
    Rate {
        /// Only those whose period has changed.
        objects: Vec<Period>,
    },
    /// A door was opened or closed.
    Door {
        /// The door.
        object: ObjectId,
        /// Whether one can see and go through.
        open: bool,
    },
    /// The scene was published anew: ids of its cells and objects are void, those of movers are not.
    Revision {
        /// The revision that is current.
        revision: Revision,
        /// Its manifest.
        manifest: Manifest,
    },
    /// Other nodes of the scene can be heard again, or cannot be any more.
    Network {
        /// How it is.
        network: Network,
    },
}

/// Whether the nodes of a scene hear each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Network {
    /// Everybody in the scene can be met.
    Whole,
    /// Only who is on the same node.
    CutOff,
}

/// The address of a manifest.
#[derive(Debug, Clone, PartialEq)]
pub struct Manifest(pub BlobName);

impl Serialize for Manifest {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.0.url())
    }
}

/// The first event of a session.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Hello {
    /// The session.
    pub session: SessionId,
    /// The participant's own mover.
    pub object: ObjectId,
    /// The scene.
    pub scene: SceneName,
    /// Its revision.
    pub revision: Revision,
    /// The participant's cell.
    pub cell: CellId,
    /// The server's clock, Unix time: that of every `t_ms` in events.
    pub now_ms: Ms,
    /// Time between ticks; movers are told of at most once a tick.
    pub tick_ms: Ms,
    /// A session that is silent for longer ends.
    pub lease_ms: Ms,
    /// Poses are extrapolated for at most this long.
    pub extrapolate_ms: Ms,
    /// How it is among nodes, where there may be several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub network: Option<Network>,
}

/// Why earlier events are void.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Void {
    /// The reader was away or too slow for longer than events are kept.
    Missed,
    /// The reader said nothing of what it knows.
    Unknown,
}

/// An object info with what only movers have.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Told {
    /// As in the published scene; a mover without a model has no levels.
    #[serde(flatten)]
    pub info: Arc<ObjectInfo>,
    /// A mover's pose, size and update period.
    #[serde(flatten)]
    pub moving: Option<Moving>,
}

/// What only movers have.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Moving {
    /// Where it is.
    pub pose: Pose,
    /// A ball of this radius around its position holds it.
    pub radius_m: f64,
    /// How closely the session follows it.
    #[serde(flatten)]
    pub attention: Attention,
}

/// How closely a session follows a mover.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Attention {
    /// Shortest time between its updates.
    pub period_ms: Ms,
    /// In a crowd: about the share of it that one sees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub visibility: Option<f64>,
    /// In a crowd: the level of its model that will do.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub level: Option<u32>,
}

/// Where a mover is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ObjectPose {
    /// The mover.
    pub object: ObjectId,
    /// Its pose.
    #[serde(flatten)]
    pub pose: Pose,
}

impl Attention {
    /// Whether the two make no difference to whoever follows the mover.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        (self.period_ms, self.level) == (other.period_ms, other.level)
    }
}

/// How closely a mover is followed from now on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Period {
    /// The mover.
    pub object: ObjectId,
    /// That.
    #[serde(flatten)]
    pub attention: Attention,
}

/// Why a mover is no longer told of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Gone {
    /// Something hides it. Its info stays valid: it may come back without one.
    Hidden,
    /// It is outside the area of interest.
    Left,
    /// It does not exist any more.
    Destroyed,
}

/// A promise: while the mover keeps to the volume, nobody wants to hear of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Hush {
    /// The mover.
    pub object: ObjectId,
    /// Where it may be.
    pub tbv: Tbv,
    /// Until when, in the clock of the mover's own poses.
    pub until_ms: Ms,
}

impl Event {
    /// The name of the event in the stream.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Hello(_) => "hello",
            Self::Resync { .. } => "resync",
            Self::Cell { .. } => "cell",
            Self::ObjectInfo(_) => "object-info",
            Self::ObjectPos { .. } => "object-pos",
            Self::ObjectGone { .. } => "object-gone",
            Self::Hush(_) => "hush",
            Self::Wake { .. } => "wake",
            Self::Rate { .. } => "rate",
            Self::Door { .. } => "door",
            Self::Revision { .. } => "revision",
            Self::Network { .. } => "network",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_is_flat_json() {
        let gone = Event::ObjectGone {
            objects: vec![ObjectId(FIRST_MOVER)],
            reason: Gone::Hidden,
        };
        let json = serde_json::to_string(&gone).unwrap();
        assert_eq!(json, r#"{"objects":["o100000000"],"reason":"hidden"}"#);
        let hush = Event::Hush(Hush {
            object: ObjectId(5),
            tbv: Tbv::around([1.0, 2.0, 3.0], 2.0, 500),
            until_ms: 7,
        });
        let json = serde_json::to_string(&hush).unwrap();
        assert_eq!(
            json,
            r#"{"object":"o5","tbv":{"center":[1.0,2.0,3.0],"radius_m":1.0},"until_ms":7}"#
        );
    }

    #[test]
    fn sessions_have_one_spelling() {
        assert_eq!("s12".parse(), Ok(SessionId(12)));
        for text in ["", "s", "12", "s01", "s-1", "s1x", "o1", "s99999999999999999999"] {
            assert!(text.parse::<SessionId>().is_err(), "{text}");
        }
    }
}
