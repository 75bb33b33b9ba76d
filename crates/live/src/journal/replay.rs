//! Does the same happen again? Entries of a journal are put into a world of their own, and what it says is compared byte for
//! byte with what was written.

use std::collections::BTreeSet;

use belvedere_scene::ObjectId;

use super::{Answer, Input, Output, input::At, ranges, taught, text};
use crate::{World, world::Sent};

/// No time is further from zero: every whole number up to here is one of JSON's.
const MOST_MS: At = 1 << 53;

/// Why a journal cannot be read on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ReplayError {
    /// A line is not an entry's.
    #[error("no input: {0}")]
    Malformed(String),
    /// Nothing like this can have happened.
    #[error("{0}")]
    Impossible(&'static str),
    /// No server has such rules or such a scene.
    #[error("{what} is {value:e}, and must be from {least:e} to {most:e}")]
    OutOfRange {
        /// What.
        what: &'static str,
        /// As it is told.
        value: f64,
        /// The smallest that may be.
        least: f64,
        /// The largest.
        most: f64,
    },
}

/// A world that lives through a journal again.
#[derive(Debug, Default)]
pub struct Replay {
    world: Option<World>,
    avatars: BTreeSet<ObjectId>,
    last_ms: At,
}

/// An entry, and what came of it this time.
#[derive(Debug)]
pub struct Replayed {
    /// When it happened.
    pub at_ms: At,
    /// What happened.
    pub input: Input,
    /// What the world says now, as it would be written.
    pub output: String,
}

impl Replay {
    /// Lives through one entry, of which this is the first line.
    ///
    /// # Errors
    /// When the line is none, or cannot follow what came before.
    pub fn take(&mut self, line: &str) -> Result<Replayed, ReplayError> {
        let read: Result<(At, Input), _> = serde_json::from_str(line);
        let (at_ms, input) = read.map_err(|error| ReplayError::Malformed(error.to_string()))?;
        self.check(at_ms, &input)?;
        self.last_ms = at_ms;
        let answer = self.apply(input.clone(), at_ms)?;
        let said = self.world.as_mut().map(World::events).unwrap_or_default();
        let told = said.into_iter().map(|(session, event)| (session, event.name(), event));
        let output = Output {
            answer,
            told: told.collect(),
        };
        Ok(Replayed {
            at_ms,
            input,
            output: text(&output),
        })
    }

    fn check(&mut self, at_ms: At, input: &Input) -> Result<(), ReplayError> {
        let sane = |time_ms: At| time_ms.abs() <= MOST_MS;
        let sent_is_sane = |sent: &Sent| sent.t_ms.is_none_or(sane);
        let times_are_sane = match input {
            Input::Open { visitor, .. } => sent_is_sane(&visitor.pose),
            Input::Pose { sent, .. } | Input::Move { sent, .. } => sent_is_sane(sent),
            Input::Create { new, .. } | Input::Import { new, .. } => {
                sent_is_sane(&new.pose) && new.way.as_ref().is_none_or(|way| way.times().all(sane))
            }
            _ => true,
        };
        if !sane(at_ms) || !times_are_sane {
            return Err(ReplayError::Impossible("a time is out of range"));
        }
        if at_ms < self.last_ms && !matches!(input, Input::Begin { .. }) {
            return Err(ReplayError::Impossible("time runs backwards"));
        }
        match input {
            Input::Begin { rules, ground, .. } => {
                ranges::check_rules(rules)?;
                ranges::check_ground(ground)
            }
            Input::Rebase { ground, .. } => ranges::check_ground(ground),
            Input::Open { object, .. } | Input::Create { object, .. } if self.holds(*object) => {
                Err(ReplayError::Impossible("an id is used by two at once"))
            }
            Input::Destroy { object } if self.avatars.contains(object) => {
                Err(ReplayError::Impossible("an avatar is destroyed without its session"))
            }
            _ => Ok(()),
        }
    }

    fn holds(&self, object: ObjectId) -> bool {
        self.world.as_ref().is_some_and(|world| world.holds(object))
    }

    fn apply(&mut self, input: Input, now_ms: At) -> Result<Answer, ReplayError> {
        if let Input::Begin { rules, ground, .. } = input {
            *self = Self::default();
            self.last_ms = now_ms;
            self.world = Some(ground.world(rules));
            return Ok(Answer::Done);
        }
        if let Input::Open { object, .. } = input {
            self.avatars.insert(object);
        }
        let world = self.world.as_mut();
        let world = world.ok_or(ReplayError::Impossible("something happens before the scene begins"))?;
        Ok(match input {
            Input::Begin { .. } => Answer::Done,
            Input::Teach { cell, sees } => (&world.teach(cell, &sees)).into(),
            Input::Open {
                session,
                object,
                visitor,
            } => (&world.open(session, object, visitor, now_ms)).into(),
            Input::Pose { session, sent } => (&world.pose(session, sent, now_ms)).into(),
            Input::Aoi { session, aoi } => (&world.set_aoi(session, aoi, now_ms)).into(),
            Input::Close { session } => (&world.close(session, now_ms)).into(),
            Input::Create { object, owner, new } => (&world.create(object, owner, new, now_ms)).into(),
            Input::Move { object, sent } => (&world.move_to(object, sent, now_ms)).into(),
            Input::Destroy { object } => (&world.destroy(object)).into(),
            Input::Import { object, new } => (&world.import(object, new, now_ms)).into(),
            Input::Withdraw { object, reason } => (&world.withdraw(object, reason, now_ms)).into(),
            Input::WatchAbroad { begun, ended } => (&world.watch_abroad(&begun, &ended, now_ms)).into(),
            Input::Door { object, bounds, open } => (&world.set_door(object, &bounds, open, now_ms)).into(),
            Input::Screen { cell, closed, hidden } => (&world.screen(cell, &closed, &hidden, now_ms)).into(),
            Input::Resync { session, reason } => (&world.resync(session, reason, now_ms)).into(),
            Input::Room { session } => (&world.make_room(session)).into(),
            Input::Listens { session, listens } => (&world.listens(session, listens, now_ms)).into(),
            Input::Wakeable { session, wakeable } => (&world.wakeable(session, wakeable, now_ms)).into(),
            Input::Rebase { ground, sights } => {
                (&world.rebase(taught(&ground, &sights), &ground.bounds, &ground.foliage, now_ms)).into()
            }
            Input::Tick => (&world.tick(now_ms)).into(),
        })
    }
}
