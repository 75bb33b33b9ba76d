//! How do participants come, look around and go?

use belvedere_scene::ObjectId;
use serde::{Deserialize, Serialize};

use super::{Look, NewMover, Refusal, Seen, Sent, World, check, session::Session};
use crate::{
    Ms,
    aoi::Aoi,
    cells::Place,
    event::{Event, SessionId, Void},
    pace::Bucket,
    tbv::Validity,
};

/// A participant that is to be.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Visitor {
    /// Where the participant is.
    pub pose: Sent,
    /// How far it looks.
    pub aoi: Aoi,
    /// A promise.
    pub max_speed_mps: f64,
    /// Another one, if it is made; it counts where poses say their velocity.
    #[serde(default)]
    pub max_acceleration_mps2: Option<f64>,
    /// The size of its avatar.
    pub radius_m: f64,
    /// What its avatar looks like.
    pub look: Look,
    /// Whether it wants to hear of movers and doors.
    pub hears_movers: bool,
    /// Whether somebody listens from the beginning ([`World::listens`]).
    #[serde(default = "at_once")]
    pub listens: bool,
}

fn at_once() -> bool {
    true
}

/// How a participant stands, without motion, and how far it looks.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Stand {
    /// World space, metres.
    pub position: [f64; 3],
    /// A quaternion.
    pub orientation: [f64; 4],
    /// How far it looks.
    pub aoi: Aoi,
}

impl Visitor {
    /// The same, come to stand where it was last; times are those of whatever clock it has by now.
    #[must_use]
    pub fn standing(mut self, last: Option<Stand>) -> Self {
        if let Some(Stand {
            position,
            orientation,
            aoi,
        }) = last
        {
            (self.pose.position, self.pose.orientation, self.aoi) = (position, orientation, aoi);
        }
        self.pose = Sent {
            t_ms: None,
            velocity: None,
            acceleration: None,
            ..self.pose
        };
        self
    }
}

impl World {
    /// Opens a session with an avatar; nothing else ever had their ids. The caller greets it; what it sees is told at the
    /// next tick.
    ///
    /// # Errors
    /// When something about it cannot be.
    pub fn open(&mut self, id: SessionId, object: ObjectId, new: Visitor, now_ms: Ms) -> Result<Seen, Refusal> {
        let aoi = check::aoi(new.aoi)?;
        let avatar = NewMover {
            pose: new.pose,
            max_speed_mps: check::walking_speed(new.max_speed_mps)?,
            max_acceleration_mps2: new.max_acceleration_mps2,
            radius_m: new.radius_m,
            look: new.look,
            way: None,
        };
        self.add(object, Some(id), avatar, now_ms)?;
        let second = self.rules.bytes_per_s;
        let bytes = Bucket::full(second, second, now_ms);
        let session = Session::new(object, aoi, (new.hears_movers, new.listens), bytes);
        self.sessions.insert(id, Box::new(session));
        self.look_from_pose(id, now_ms);
        self.seen(id, false, now_ms)
    }

    /// Takes a participant's pose. `unknown_to` must be empty for it.
    ///
    /// # Errors
    /// When it cannot be; then nothing has changed.
    pub fn pose(&mut self, id: SessionId, sent: Sent, now_ms: Ms) -> Result<Seen, Refusal> {
        let object = self.sessions.get(&id).ok_or(Refusal::NoSession)?.object;
        let before = self.place_of(id);
        let teleported = self.shift(object, sent, now_ms)?;
        self.look_from_pose(id, now_ms);
        if self.strays(object) {
            // What it may rely on instead is in the answer.
            self.rouse(object, now_ms);
        }
        let seen = self.seen(id, teleported, now_ms)?;
        if before.is_ok_and(|before| before.cell != seen.place.cell) {
            let cell = seen.place.cell;
            self.say(id, Event::Cell { cell });
        }
        Ok(seen)
    }

    /// Changes how far a participant looks.
    ///
    /// # Errors
    /// When the radii are no area, or there is no such session.
    pub fn set_aoi(&mut self, id: SessionId, aoi: Aoi, now_ms: Ms) -> Result<(), Refusal> {
        let aoi = check::aoi(aoi)?;
        self.sessions.get_mut(&id).ok_or(Refusal::NoSession)?.aoi = aoi;
        self.look(id, now_ms);
        Ok(())
    }

    /// Where a participant is.
    ///
    /// # Errors
    /// When there is no such session.
    pub fn place_of(&self, id: SessionId) -> Result<Place, Refusal> {
        let session = self.sessions.get(&id).ok_or(Refusal::NoSession)?;
        let position = self.movers[&session.object].pose.position;
        self.cells.at(position).ok_or(Refusal::NoCells)
    }

    /// The participant's position and how far it looks.
    #[must_use]
    pub fn standpoint(&self, id: SessionId) -> Option<([f64; 3], Aoi)> {
        let session = self.sessions.get(&id)?;
        Some((self.movers[&session.object].pose.position, session.aoi))
    }

    /// How a participant stands.
    #[must_use]
    pub fn stand(&self, id: SessionId) -> Option<Stand> {
        let session = self.sessions.get(&id)?;
        let pose = &self.movers[&session.object].pose;
        Some(Stand {
            position: pose.position,
            orientation: pose.orientation,
            aoi: session.aoi,
        })
    }

    /// Ends a session and its avatar. Movers that it drove stay, and are driven by nobody.
    pub fn close(&mut self, id: SessionId, now_ms: Ms) {
        let Some(session) = self.sessions.remove(&id) else {
            return;
        };
        for cell in &session.eye.watched {
            self.unwatch(*cell, id);
        }
        for object in session.shown.keys() {
            if let Some(mover) = self.movers.get_mut(object) {
                mover.shown_to.remove(&id);
            }
        }
        self.stirred_sessions.remove(&id);
        self.under_way.remove(&id);
        self.uninformed.remove(&id);
        self.in_crowd.remove(&id);
        self.gone.retain(|(session, _), _| *session != id);
        self.destroy(session.object);
        for object in session.driven {
            // Nobody can be woken, and nobody relies on a promise any more.
            if let Some(mover) = self.movers.get_mut(&object) {
                mover.owner = None;
                mover.validity = Validity::new(self.rules.longest_unheard_tbv_ms);
                self.rouse(object, now_ms);
            }
        }
    }

    /// From now on somebody listens to a session, or nobody does, and what was told before is void. Whoever is told of nothing
    /// watches nothing, so that it costs others nothing; whoever comes is told of all that it sees at the next tick. A mover whose
    /// owner cannot be woken any more keeps no volume that counts on that.
    pub fn listens(&mut self, id: SessionId, listens: bool, now_ms: Ms) {
        let session = self.sessions.get_mut(&id);
        let Some(session) = session.filter(|session| session.listens != listens) else {
            return;
        };
        session.listens = listens;
        session.wakeable = listens;
        session.forget();
        // What is seen from there may have changed: of those who hear nothing that is not followed.
        session.eye.cells.clear();
        self.uninformed.remove(&id);
        for object in std::mem::take(&mut session.shown).into_keys() {
            if let Some(mover) = self.movers.get_mut(&object) {
                mover.shown_to.remove(&id);
            }
        }
        self.gone.retain(|(session, _), _| *session != id);
        self.look(id, now_ms);
        if listens {
            self.end_straying(id, now_ms);
        } else {
            self.end_promises(id, now_ms);
        }
    }

    /// The stream of a session that is listened to has ended, or is there again. What is said meanwhile waits for whoever comes back,
    /// but nobody knows whether one does: none of its movers keeps a volume that counts on a word of it.
    pub fn wakeable(&mut self, id: SessionId, wakeable: bool, now_ms: Ms) {
        let session = self.sessions.get_mut(&id);
        let Some(session) = session.filter(|session| session.listens && session.wakeable != wakeable) else {
            return;
        };
        session.wakeable = wakeable;
        if !wakeable {
            self.end_promises(id, now_ms);
        }
    }

    /// Forgets what a session was told, and tells everything again; the caller greets it, and says in which cell it is.
    pub fn resync(&mut self, id: SessionId, reason: Void, now_ms: Ms) {
        let Some(session) = self.sessions.get_mut(&id) else {
            return;
        };
        session.forget();
        self.gone.retain(|(session, _), _| *session != id);
        for shown in session.shown.values_mut() {
            shown.known = false;
            shown.sent = None;
        }
        self.uninformed.insert(id);
        self.say(id, Event::Resync { reason });
        self.inform(id, now_ms);
        self.tell_doors(id);
    }

    fn seen(&mut self, id: SessionId, teleported: bool, now_ms: Ms) -> Result<Seen, Refusal> {
        let place = self.place_of(id)?;
        let object = self.sessions[&id].object;
        let hush = self.settle(object, now_ms);
        let moved = super::Moved {
            object,
            hush,
            teleported,
        };
        Ok(Seen { place, moved })
    }
}
