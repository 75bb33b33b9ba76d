//! What does a live session tell? The events of `docs/LIVE.md` as values; what they hold beyond that is ignored.

use belvedere_scene::{CellId, ObjectId, Revision, object::ObjectInfo};
use serde::{Deserialize, de::DeserializeOwned};

use super::motion::Pose;

/// Something that a session is told. Times are those of the server.
#[derive(Debug, Clone, PartialEq)]
pub enum LiveEvent {
    /// The stream begins.
    Hello(Hello),
    /// One is in another cell.
    Cell(CellId),
    /// Somebody comes into view who was not known.
    Appear(Box<Appearance>),
    /// Where movers are.
    Move(Vec<(ObjectId, Pose)>),
    /// These are not told of any more.
    Vanish {
        /// The movers.
        objects: Vec<ObjectId>,
        /// Why.
        reason: Gone,
    },
    /// How closely movers are followed from now on.
    Rate(Vec<(ObjectId, Attention)>),
    /// Nobody may see one's own mover: one need not speak.
    Hush(Hush),
    /// Somebody may see one's own mover.
    Wake,
    /// A door was opened or closed.
    Door {
        /// The door.
        object: ObjectId,
        /// Whether one can see and go through.
        open: bool,
    },
    /// The scene was published anew: ids of its cells and objects are void.
    Revision(Revision),
    /// Whether all nodes of the scene can be heard: `whole` or `cut-off`.
    Network(String),
    /// What was told before is void; everything follows.
    Resync,
}

impl LiveEvent {
    /// Whether a promise that nobody looks is void, and with it what was said before: somebody may look, volumes are among cells that
    /// are no more, or another server may have taken the session up.
    #[must_use]
    pub fn voids_promises(&self) -> bool {
        matches!(self, Self::Wake | Self::Revision(_) | Self::Resync)
    }
}

/// How a stream begins.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Hello {
    /// One's own mover.
    pub object: ObjectId,
    /// The revision that ids are of.
    pub revision: Revision,
    /// Where one is.
    pub cell: CellId,
    /// The server's clock.
    pub now_ms: i64,
    /// Movers are told of at most so often.
    pub tick_ms: i64,
    /// A session that neither speaks nor listens ends after this time.
    pub lease_ms: i64,
    /// Poses are extrapolated for at most so long.
    pub extrapolate_ms: i64,
    /// Whether all nodes of the scene can be heard, where there may be several; [`LiveEvent::Network`] says when that changes.
    pub network: Option<String>,
}

/// Somebody who comes into view.
#[derive(Debug, Clone, PartialEq)]
pub struct Appearance {
    /// Name and look; without levels where no model is worn.
    pub info: ObjectInfo,
    /// Where it is.
    pub pose: Pose,
    /// A ball of this radius around its position holds it.
    pub radius_m: f64,
    /// How closely it is followed.
    pub attention: Attention,
}

/// How closely a mover is followed.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Attention {
    /// Shortest time between what is told of it.
    pub period_ms: i64,
    /// In a crowd: about the share of it that one sees.
    pub visibility: Option<f64>,
    /// In a crowd: the level of its model that will do.
    pub level: Option<u32>,
}

/// Why a mover is not told of any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Gone {
    /// Something hides it; it may come back without an info.
    Hidden,
    /// It is outside the area of interest.
    Left,
    /// It does not exist any more.
    Destroyed,
}

/// Nobody wants to hear of one's mover while it keeps to a ball.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Hush {
    /// The mover.
    pub object: ObjectId,
    /// Where it may be.
    pub tbv: Ball,
    /// Until then, in the clock of one's own poses.
    pub until_ms: i64,
}

/// The volume of a promise.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Ball {
    /// World space, metres.
    pub center: [f64; 3],
    /// Metres.
    pub radius_m: f64,
}

/// Reads an event; nothing for a kind that is not known, and for objects that do not move, of which records tell.
pub(crate) fn read(name: &str, data: &str) -> Result<Option<LiveEvent>, serde_json::Error> {
    Ok(Some(match name {
        "hello" => LiveEvent::Hello(json(data)?),
        "cell" => LiveEvent::Cell(json::<Place>(data)?.cell),
        "object-info" => return appearance(data),
        "object-pos" => {
            let Objects::<PosedObject> { objects } = json(data)?;
            LiveEvent::Move(objects.into_iter().map(|one| (one.object, one.pose)).collect())
        }
        "object-gone" => {
            let GoneObjects { objects, reason } = json(data)?;
            LiveEvent::Vanish { objects, reason }
        }
        "rate" => {
            let Objects::<RatedObject> { objects } = json(data)?;
            LiveEvent::Rate(objects.into_iter().map(|one| (one.object, one.attention)).collect())
        }
        "hush" => LiveEvent::Hush(json(data)?),
        "wake" => LiveEvent::Wake,
        "door" => {
            let Leaf { object, open } = json(data)?;
            LiveEvent::Door { object, open }
        }
        "revision" => LiveEvent::Revision(json::<Published>(data)?.revision),
        "network" => LiveEvent::Network(json::<Nodes>(data)?.network),
        "resync" => LiveEvent::Resync,
        _ => return Ok(None),
    }))
}

fn appearance(data: &str) -> Result<Option<LiveEvent>, serde_json::Error> {
    if json::<MaybeMoving>(data)?.pose.is_none() {
        return Ok(None);
    }
    let Moving {
        pose,
        radius_m,
        attention,
    } = json(data)?;
    let info = json(data)?;
    Ok(Some(LiveEvent::Appear(Box::new(Appearance {
        info,
        pose,
        radius_m,
        attention,
    }))))
}

fn json<T: DeserializeOwned>(data: &str) -> Result<T, serde_json::Error> {
    serde_json::from_str(data)
}

#[derive(Deserialize)]
struct Place {
    cell: CellId,
}

#[derive(Deserialize)]
struct MaybeMoving {
    pose: Option<serde::de::IgnoredAny>,
}

#[derive(Deserialize)]
struct Moving {
    pose: Pose,
    radius_m: f64,
    #[serde(flatten)]
    attention: Attention,
}

#[derive(Deserialize)]
struct Objects<T> {
    objects: Vec<T>,
}

#[derive(Deserialize)]
struct PosedObject {
    object: ObjectId,
    #[serde(flatten)]
    pose: Pose,
}

#[derive(Deserialize)]
struct RatedObject {
    object: ObjectId,
    #[serde(flatten)]
    attention: Attention,
}

#[derive(Deserialize)]
struct GoneObjects {
    objects: Vec<ObjectId>,
    reason: Gone,
}

#[derive(Deserialize)]
struct Leaf {
    object: ObjectId,
    open: bool,
}

#[derive(Deserialize)]
struct Published {
    revision: Revision,
}

#[derive(Deserialize)]
struct Nodes {
    network: String,
}
