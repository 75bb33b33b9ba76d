//! What may a sender say? Everything that comes from outside is checked here, before it changes anything.

use std::borrow::Cow;

use belvedere_scene::{Bounds, CellId, ObjectId};
use serde::{Deserialize, Serialize};

use crate::{
    Ms,
    cells::Place,
    event::Hush,
    motion::{LONGEST_EXTRAPOLATION_MS, Trajectory, shortened},
};

/// A pose as it was sent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sent {
    /// In the sender's clock; none means now.
    pub t_ms: Option<Ms>,
    /// World space, metres.
    pub position: [f64; 3],
    /// A quaternion of any length but zero.
    pub orientation: [f64; 4],
    /// Metres a second; none means that it is to be estimated.
    pub velocity: Option<[f64; 3]>,
    /// Metres a second squared.
    pub acceleration: Option<[f64; 3]>,
}

/// Why an input is refused. Nothing has changed then, but that a clock is known to have gone back.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// A number is not finite, or too large to be meant.
    #[error("numbers must be finite and at most {MOST:e}")]
    Number(&'static str),
    /// A quaternion of no length.
    #[error("an orientation is a quaternion [x, y, z, w] that is not zero")]
    Orientation,
    /// The position is nowhere near the scene.
    #[error(
        "positions must lie between {:?} and {:?}: no further from the scene than it is large",
        .0.min, .0.max
    )]
    OutOfWorld(Bounds),
    /// A pose that is older than the last one.
    #[error(
        "time runs backwards: the last pose was of t_ms = {last_ms}; go on from there, or leave t_ms out. A clock that was set back \
         counts again when it has gone on for half a second"
    )]
    Backwards {
        /// The last time, in the sender's clock.
        last_ms: Ms,
    },
    /// No usable speed; the largest one.
    #[error("max_speed_mps must be from 0 to {0}")]
    Speed(f64),
    /// No usable acceleration.
    #[error("max_acceleration_mps2 must be from 0 to {MOST_ACCELERATION_MPS2}")]
    Acceleration,
    /// A key of a trajectory is nowhere near the scene, or has no orientation.
    #[error("key {number} of the trajectory is no pose near the scene; its {} cannot be", &.pointer[1..])]
    Key {
        /// Which one, from 0.
        number: usize,
        /// A JSON pointer to the member of the key that is wrong.
        pointer: &'static str,
    },
    /// A trajectory is too fast on the way to a key.
    #[error("a trajectory is at most {MOST_SPEED_MPS} m/s fast; on the way to key {0} it is faster")]
    TooFast(usize),
    /// No usable size.
    #[error("radius_m must be above 0 and at most {MOST_RADIUS_M}")]
    Radius,
    /// No usable area of interest.
    #[error("an area of interest has 0 < enter_m < leave_m, at most {MOST_AOI_M:e}")]
    Aoi(Radius),
    /// There is no such session.
    #[error("the session has ended")]
    NoSession,
    /// There is no such mover.
    #[error("the mover has been deleted")]
    NoMover,
    /// Another mover has its id.
    #[error("a mover of this node has the id already")]
    Taken,
    /// It goes its own way.
    #[error("the mover follows the trajectory that it was created with, and takes no poses")]
    OnTrajectory,
    /// The scene has no view cell.
    #[error("the scene has no view cells")]
    NoCells,
}

impl Refusal {
    /// A JSON pointer to the member that is wrong.
    #[must_use]
    pub fn pointer(&self) -> Cow<'static, str> {
        Cow::Borrowed(match self {
            Self::Number(pointer) => pointer,
            Self::Orientation => "/orientation",
            Self::OutOfWorld(_) => "/position",
            Self::Backwards { .. } => "/t_ms",
            Self::Speed(_) => "/max_speed_mps",
            Self::Acceleration => "/max_acceleration_mps2",
            Self::Radius => "/radius_m",
            Self::Aoi(Radius::Enter) => "/aoi/enter_m",
            Self::Aoi(Radius::Leave) => "/aoi/leave_m",
            Self::Key { number, pointer } => return format!("/trajectory/keys/{number}{pointer}").into(),
            Self::TooFast(number) => return format!("/trajectory/keys/{number}/t_ms").into(),
            Self::NoSession | Self::NoMover | Self::Taken | Self::OnTrajectory | Self::NoCells => "",
        })
    }
}

/// A radius of an area of interest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Radius {
    /// `enter_m`.
    Enter,
    /// `leave_m`.
    Leave,
}

/// No number of a pose is larger: single precision holds no scene out there.
const MOST: f64 = 1e9;
/// No mover is promised to be faster.
pub const MOST_SPEED_MPS: f64 = 1_000.0;
/// No participant is promised to be faster: it would see from wherever it may have come in a round trip.
pub const MOST_WALK_MPS: f64 = 100.0;
/// No mover is promised to change its velocity faster.
pub const MOST_ACCELERATION_MPS2: f64 = 10_000.0;
/// No mover is larger.
pub const MOST_RADIUS_M: f64 = 100.0;
/// No area of interest is larger.
pub const MOST_AOI_M: f64 = 1e6;

/// Who is faster than promised by less than this factor breaks no promise, and nobody is taken for faster.
pub const SLACK: f64 = 1.05;

/// What became of a participant's pose.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Seen {
    /// Where the participant is.
    pub place: Place,
    /// What became of its avatar's pose.
    pub moved: Moved,
}

/// What became of a mover's pose.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Moved {
    /// The mover.
    pub object: ObjectId,
    /// Nobody may see it: no pose is needed for a while.
    pub hush: Option<Hush>,
    /// It was further away than its speed allows, and stands there now.
    pub teleported: bool,
}

impl Sent {
    /// The same with an orientation of length one.
    pub(super) fn checked(mut self, world: &Bounds) -> Result<Self, Refusal> {
        let sane = |numbers: &[f64]| numbers.iter().all(|x| x.abs() <= MOST);
        let vectors = [
            ("/position", Some(self.position)),
            ("/velocity", self.velocity),
            ("/acceleration", self.acceleration),
        ];
        if let Some((pointer, _)) = vectors.iter().find(|(_, v)| v.is_some_and(|v| !sane(&v))) {
            return Err(Refusal::Number(pointer));
        }
        if !sane(&self.orientation) {
            return Err(Refusal::Number("/orientation"));
        }
        let length = self.orientation.iter().fold(0.0f64, |sum, x| sum.hypot(*x));
        if length < 1e-6 {
            return Err(Refusal::Orientation);
        }
        if !world.contains(self.position) {
            return Err(Refusal::OutOfWorld(*world));
        }
        self.orientation = self.orientation.map(|x| x / length);
        Ok(self)
    }

    /// The velocity that was stated, as far as it keeps to the promise: nobody who stands in view can be somewhere else by saying so.
    pub(super) fn velocity_within(&self, max_speed_mps: f64) -> Option<[f64; 3]> {
        self.velocity.map(|stated| shortened(stated, SLACK * max_speed_mps))
    }

    /// The acceleration, as far as it keeps to what was promised, or to the most there is, and as it leads from a velocity that keeps to
    /// its promise to no higher speed while others extrapolate. Between begin and end of that no speed is higher than at both.
    pub(super) fn acceleration_within(
        &self,
        most_mps2: Option<f64>,
        velocity: [f64; 3],
        max_speed_mps: f64,
    ) -> [f64; 3] {
        let stated = shortened(
            self.acceleration.unwrap_or_default(),
            most_mps2.unwrap_or(MOST_ACCELERATION_MPS2),
        );
        let gained = stated.map(|x| x * LONGEST_EXTRAPOLATION_MS as f64 * 1e-3);
        let dot = |a: [f64; 3], b: [f64; 3]| (0..3).map(|axis| a[axis] * b[axis]).sum::<f64>();
        let (along, square, most) = (dot(velocity, gained), dot(gained, gained), SLACK * max_speed_mps);
        let left = most * most - dot(velocity, velocity);
        // A velocity that was shortened may be a hair too high.
        if square == 0.0 || 2.0 * along + square <= left {
            return stated;
        }
        let share = ((along * along + square * left).max(0.0).sqrt() - along) / square;
        stated.map(|x| x * share.clamp(0.0, 1.0))
    }
}

/// What positions may be: as far from a scene as it is large.
pub(crate) fn around(scene: &Bounds) -> Bounds {
    let reach_m = scene.diagonal_m();
    Bounds {
        min: scene.min.map(|x| x - reach_m),
        max: scene.max.map(|x| x + reach_m),
    }
}

/// Whether something can move along a trajectory.
pub(super) fn way(way: &Trajectory, world: &Bounds) -> Result<(), Refusal> {
    for (number, key) in way.keys().iter().enumerate() {
        let pose = Sent {
            t_ms: None,
            position: key.position,
            orientation: key.orientation,
            velocity: None,
            acceleration: None,
        };
        pose.checked(world).map_err(|refusal| Refusal::Key {
            number,
            pointer: if refusal.pointer() == "/position" {
                "/position"
            } else {
                "/orientation"
            },
        })?;
    }
    match way.speeds_mps().position(|speed_mps| speed_mps > MOST_SPEED_MPS) {
        Some(line) => Err(Refusal::TooFast(line + 1)),
        None => Ok(()),
    }
}

pub(super) fn speed(max_speed_mps: f64) -> Result<f64, Refusal> {
    up_to(MOST_SPEED_MPS, max_speed_mps)
}

pub(super) fn walking_speed(max_speed_mps: f64) -> Result<f64, Refusal> {
    up_to(MOST_WALK_MPS, max_speed_mps)
}

fn up_to(most: f64, max_speed_mps: f64) -> Result<f64, Refusal> {
    let sound = (0.0..=most).contains(&max_speed_mps);
    sound.then_some(max_speed_mps).ok_or(Refusal::Speed(most))
}

pub(super) fn acceleration(most_mps2: Option<f64>) -> Result<Option<f64>, Refusal> {
    let sound = most_mps2.is_none_or(|most_mps2| (0.0..=MOST_ACCELERATION_MPS2).contains(&most_mps2));
    sound.then_some(most_mps2).ok_or(Refusal::Acceleration)
}

pub(super) fn radius(radius_m: f64) -> Result<f64, Refusal> {
    let sound = radius_m > 0.0 && radius_m <= MOST_RADIUS_M;
    sound.then_some(radius_m).ok_or(Refusal::Radius)
}

pub(super) fn aoi(aoi: crate::aoi::Aoi) -> Result<crate::aoi::Aoi, Refusal> {
    let enters = aoi.enter_m > 0.0 && aoi.enter_m < MOST_AOI_M;
    let wrong = if enters { Radius::Leave } else { Radius::Enter };
    let sound = aoi.is_sound() && aoi.leave_m <= MOST_AOI_M;
    sound.then_some(aoi).ok_or(Refusal::Aoi(wrong))
}

/// Cells that the caller must [`teach`](super::World::teach) before a participant can stand there.
pub type Unknown = Vec<CellId>;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_pose_is_refused_with_its_place() {
        let world = Bounds {
            min: [-10.0; 3],
            max: [10.0; 3],
        };
        let good = Sent {
            t_ms: None,
            position: [0.0; 3],
            orientation: [0.0, 0.0, 0.0, 2.0],
            velocity: None,
            acceleration: None,
        };
        assert_eq!(good.checked(&world).unwrap().orientation, [0.0, 0.0, 0.0, 1.0]);
        let refused = |sent: Sent| sent.checked(&world).unwrap_err().pointer();
        let position = |x| Sent {
            position: [0.0, x, 0.0],
            ..good
        };
        for x in [f64::NAN, f64::INFINITY, -1e300, 11.0] {
            assert_eq!(refused(position(x)), "/position");
        }
        let orientation = [0.0; 4];
        assert_eq!(refused(Sent { orientation, ..good }), "/orientation");
        let velocity = Some([f64::NAN; 3]);
        assert_eq!(refused(Sent { velocity, ..good }), "/velocity");
    }

    #[test]
    fn a_stated_acceleration_leads_to_no_speed_beyond_the_promise() {
        let within = |velocity: [f64; 3], acceleration: [f64; 3], max_speed_mps| {
            let sent = Sent {
                t_ms: None,
                position: [0.0; 3],
                orientation: [0.0, 0.0, 0.0, 1.0],
                velocity: None,
                acceleration: Some(acceleration),
            };
            sent.acceleration_within(None, velocity, max_speed_mps)
        };
        assert_eq!(within([1.0, 0.0, 0.0], [0.5, 0.0, 0.0], 2.0), [0.5, 0.0, 0.0]);
        assert_eq!(within([0.0; 3], [0.0; 3], 0.0), [0.0; 3]);
        assert_eq!(within([0.0; 3], [0.0, 0.0, 5_000.0], 0.0), [0.0; 3]);
        for i in 0..1_000 {
            let way = [1.0, 0.37 * f64::from(i), 1_000.0 - f64::from(i)];
            let velocity = shortened(way, SLACK * 2.0);
            assert_eq!(within(velocity, [0.0; 3], 2.0), [0.0; 3], "{velocity:?}");
            let tiny = within(velocity, [1e-200, 0.0, 0.0], 2.0);
            assert!(tiny.iter().all(|x| x.is_finite()), "{velocity:?}: {tiny:?}");
        }
        let cases = [
            ([0.0; 3], [0.0, 0.0, 5_000.0]),
            ([2.0, 0.0, 0.0], [-50.0, 1.0, 0.0]),
            ([1.0, 1.0, 0.0], [3.0, -4.0, 5.0]),
            ([2.1, 0.0, 0.0], [1e-3, 0.0, 0.0]),
        ];
        for (velocity, acceleration) in cases {
            let kept = within(velocity, acceleration, 2.0);
            let speed = |t_s: f64| {
                let at: [f64; 3] = std::array::from_fn(|axis| velocity[axis] + t_s * kept[axis]);
                crate::cells::distance_m(at, [0.0; 3])
            };
            let fastest = (0..=20).map(|i| speed(0.1 * f64::from(i))).fold(0.0, f64::max);
            assert!((fastest - SLACK * 2.0).abs() < 1e-9, "{fastest} m/s by {kept:?}");
        }
    }
}
