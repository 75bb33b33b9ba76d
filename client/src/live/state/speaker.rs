//! Need one say where one is? Only when the others, who extrapolate the last pose, would be wrong by more than they would
//! notice; and not at all while nobody may look, as long as one keeps to the promised ball. The same as
//! `viewer/core/live/speaker.ts`.

use super::{
    event::Hush,
    motion::{Pose, length, turned_rad},
};

const WRONG_M: f64 = 0.04;
const WRONG_RAD: f64 = 0.06;
const SHORTEST_PERIOD_MS: f64 = 80.0;
/// Others stop extrapolating after this time.
const LONGEST_MS: f64 = 2000.0;

/// What became of a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Speech {
    /// It is said.
    Said(Pose),
    /// It would be, but nobody may look.
    Hushed,
    /// Others believe it anyway, or were told a moment ago.
    Known,
    /// Nothing can be said now: an answer is awaited, the server has asked for silence, or there is no session.
    Waiting,
}

#[derive(Debug, Default)]
pub(crate) struct Speaker {
    /// The last pose that was said; while nobody may look, that would have been.
    said: Option<Pose>,
    hush: Option<Hush>,
    /// The server has had too much before that.
    silent_until_ms: f64,
}

impl Speaker {
    /// Whether there is something to say now.
    pub(crate) fn speak(
        &mut self,
        now_ms: f64,
        position: [f64; 3],
        orientation: [f64; 4],
        velocity: [f64; 3],
    ) -> Speech {
        if now_ms < self.silent_until_ms {
            return Speech::Waiting;
        }
        let is_hushed = self.is_hushed(now_ms, position);
        if let Some(said) = &self.said {
            let passed_ms = now_ms - said.t_ms as f64;
            let believed = said.position_after(passed_ms, LONGEST_MS);
            let wrong_m = length(std::array::from_fn(|a| position[a] - believed[a]));
            let is_right = wrong_m < WRONG_M && turned_rad(orientation, said.orientation) < WRONG_RAD;
            if passed_ms < SHORTEST_PERIOD_MS || is_right {
                return Speech::Known;
            }
        }
        let pose = Pose {
            t_ms: now_ms.round() as i64,
            position,
            orientation,
            velocity,
            acceleration: [0.0; 3],
        };
        // Who is woken, or leaves its ball, forgets it.
        self.said = Some(pose);
        if is_hushed { Speech::Hushed } else { Speech::Said(pose) }
    }

    /// Nobody may look from now on, as long as the ball is kept to.
    pub(crate) fn keep_quiet(&mut self, hush: Hush) {
        self.hush = Some(hush);
    }

    /// Somebody may look: who is looked at again must be found where it is.
    pub(crate) fn wake(&mut self) {
        self.hush = None;
        self.said = None;
    }

    /// The server asks for silence until then. What was said last may not have been heard.
    pub(crate) fn pause(&mut self, until_ms: f64) {
        self.silent_until_ms = until_ms;
        self.said = None;
    }

    fn is_hushed(&mut self, now_ms: f64, position: [f64; 3]) -> bool {
        let Some(hush) = &self.hush else {
            return false;
        };
        let from_middle = std::array::from_fn(|a| position[a] - hush.tbv.center[a]);
        let is_kept = now_ms < hush.until_ms as f64 && length(from_middle) < hush.tbv.radius_m;
        if !is_kept {
            self.wake();
        }
        is_kept
    }
}
