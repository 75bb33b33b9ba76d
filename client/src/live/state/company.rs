//! Who else is here, and which doors are closed? What the events of a session add up to. Times of the server become times
//! of this client's clock.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use belvedere_scene::{ObjectId, object::ObjectInfo};

use super::{
    event::{Appearance, Attention, Gone, Hello, LiveEvent},
    motion::{Pose, SmoothMotion, Stand},
};

/// Infos of movers out of sight are kept, as the server expects; of so many.
const MOST_HIDDEN: usize = 256;
/// Until the stream says so.
const EXTRAPOLATE_MS: f64 = 2000.0;

/// Others and doors, as a session was told.
#[derive(Debug, Clone)]
pub struct Company {
    seen: BTreeMap<ObjectId, (Known, SmoothMotion)>,
    hidden: BTreeMap<ObjectId, Known>,
    /// The hidden ones, longest hidden first.
    hidden_order: VecDeque<ObjectId>,
    closed: BTreeSet<ObjectId>,
    extrapolate_ms: f64,
    /// Adds to a time of the server to make one of this clock, as what came quickest says.
    ahead_ms: f64,
}

#[derive(Debug, Clone)]
struct Known {
    info: ObjectInfo,
    radius_m: f64,
    attention: Attention,
}

/// Somebody who can be seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mover<'a> {
    /// Name and look.
    pub info: &'a ObjectInfo,
    /// Where it stands now.
    pub stand: Stand,
    /// A ball of this radius around its position holds it.
    pub radius_m: f64,
    /// How closely it is followed.
    pub attention: Attention,
}

impl Default for Company {
    fn default() -> Self {
        Self {
            seen: BTreeMap::new(),
            hidden: BTreeMap::new(),
            hidden_order: VecDeque::new(),
            closed: BTreeSet::new(),
            extrapolate_ms: EXTRAPOLATE_MS,
            ahead_ms: 0.0,
        }
    }
}

impl Company {
    /// Takes an event in, at a time of this client's clock.
    pub fn take(&mut self, event: &LiveEvent, now_ms: f64) {
        match event {
            LiveEvent::Hello(Hello {
                now_ms: then_ms,
                extrapolate_ms,
                ..
            }) => {
                self.ahead_ms = now_ms - *then_ms as f64;
                self.extrapolate_ms = *extrapolate_ms as f64;
            }
            LiveEvent::Appear(appearance) => self.appear(appearance, now_ms),
            LiveEvent::Move(poses) => {
                for (_, pose) in poses {
                    self.hears(*pose, now_ms);
                }
                for (object, pose) in poses {
                    self.move_to(*object, *pose, now_ms);
                }
            }
            LiveEvent::Vanish { objects, reason } => {
                for object in objects {
                    self.vanish(*object, *reason);
                }
            }
            LiveEvent::Rate(rated) => {
                for (object, attention) in rated {
                    if let Some((known, _)) = self.seen.get_mut(object) {
                        known.attention = *attention;
                    }
                }
            }
            LiveEvent::Door { object, open: true } => _ = self.closed.remove(object),
            LiveEvent::Door { object, open: false } => _ = self.closed.insert(*object),
            LiveEvent::Resync => {
                self.seen.clear();
                self.hidden.clear();
                self.hidden_order.clear();
                self.closed.clear();
            }
            // Its doors are other objects, and all of them are open.
            LiveEvent::Revision(_) => self.closed.clear(),
            LiveEvent::Cell(_) | LiveEvent::Hush(_) | LiveEvent::Wake | LiveEvent::Network(_) => {}
        }
    }

    /// Those who can be seen, as they stand at this time, by their ids.
    pub fn movers(&self, now_ms: f64) -> impl Iterator<Item = Mover<'_>> {
        self.seen.values().map(move |(known, motion)| Mover {
            info: &known.info,
            stand: motion.at(now_ms, self.extrapolate_ms),
            radius_m: known.radius_m,
            attention: known.attention,
        })
    }

    /// Doors that are closed, as the last revision numbers them that one was told of. Whoever still shows an earlier one opens all
    /// of its doors instead.
    #[must_use]
    pub fn closed_doors(&self) -> &BTreeSet<ObjectId> {
        &self.closed
    }

    fn appear(&mut self, appearance: &Appearance, now_ms: f64) {
        let object = appearance.info.object;
        self.hears(appearance.pose, now_ms);
        self.forget(object);
        let known = Known {
            info: appearance.info.clone(),
            radius_m: appearance.radius_m,
            attention: appearance.attention,
        };
        let motion = SmoothMotion::new(appearance.pose, self.ahead_ms, now_ms);
        self.seen.insert(object, (known, motion));
    }

    /// Nothing is heard of before it was so.
    fn hears(&mut self, pose: Pose, now_ms: f64) {
        self.ahead_ms = self.ahead_ms.min(now_ms - pose.t_ms as f64);
    }

    fn move_to(&mut self, object: ObjectId, pose: Pose, now_ms: f64) {
        if let Some((_, motion)) = self.seen.get_mut(&object) {
            motion.correct(pose, self.ahead_ms, now_ms, self.extrapolate_ms);
        } else if let Some(known) = self.forget(object) {
            let motion = SmoothMotion::new(pose, self.ahead_ms, now_ms);
            self.seen.insert(object, (known, motion));
        }
    }

    fn vanish(&mut self, object: ObjectId, reason: Gone) {
        let seen = self.seen.remove(&object).map(|(known, _)| known);
        let Some(known) = seen.or_else(|| self.forget(object)) else {
            return;
        };
        if reason != Gone::Hidden {
            return;
        }
        self.hidden.insert(object, known);
        self.hidden_order.push_back(object);
        if self.hidden_order.len() > MOST_HIDDEN
            && let Some(longest) = self.hidden_order.pop_front()
        {
            self.hidden.remove(&longest);
        }
    }

    /// Takes one out of the hidden ones.
    fn forget(&mut self, object: ObjectId) -> Option<Known> {
        let known = self.hidden.remove(&object)?;
        self.hidden_order.retain(|hidden| *hidden != object);
        Some(known)
    }
}
