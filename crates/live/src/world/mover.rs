//! What is kept of a mover?

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{Arc, Weak},
};

use belvedere_scene::{Bounds, CellId, ObjectId, object::ObjectInfo};

use serde::{Deserialize, Serialize};

use super::{check::SLACK, clock::SenderClock, movers::LONGEST_STEP_MS, session::Session};
use crate::{
    Ms,
    event::{Attention, Moving, SessionId, Told},
    motion::{Pose, Trajectory},
    tbv::{Tbv, Validity},
};

#[derive(Debug)]
pub(super) struct Mover {
    /// Who drives it, and hears `hush` and `wake`. Nobody is told of what they drive.
    pub(super) owner: Option<SessionId>,
    /// It lives on another node, which says where it is, and puts it away when nobody here watches it.
    pub(super) abroad: bool,
    pub(super) look: Look,
    pub(super) radius_m: f64,
    pub(super) max_speed_mps: f64,
    pub(super) max_acceleration_mps2: Option<f64>,
    /// The velocity of the pose is what its owner said, no estimate.
    pub(super) velocity_is_said: bool,
    pub(super) way: Option<Trajectory>,
    pub(super) clock: SenderClock,
    /// The newest.
    pub(super) pose: Pose,
    pub(super) state: State,
    /// Where it is registered, rising: the cells that it touches, or that its volume does.
    pub(super) cells: Vec<CellId>,
    pub(super) shown_to: BTreeSet<SessionId>,
    /// What somebody was told of it last, while that is under way.
    pub(super) told: Weak<ObjectInfo>,
    pub(super) validity: Validity,
}

/// What a mover looks like.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Look {
    /// A name for people.
    pub name: String,
    /// The static object whose model it wears.
    pub model: Option<Arc<ObjectInfo>>,
}

/// Half as wide as people are, as whom clients draw who wears no model.
const PERSON_M: f64 = 0.3;

impl Look {
    /// So far around where it stands it is taken to hide what is behind it: the box of what is drawn of it, which counts as filled,
    /// reaches so far to all sides, and its ball as well.
    #[must_use]
    pub fn hides_m(&self, radius_m: f64) -> f64 {
        let drawn_m = self.model.as_deref().map_or(PERSON_M, |model| {
            let Bounds { min, max } = &model.bounds;
            let to_sides = [0, 2].map(|axis| {
                let origin = model.transform[12 + axis];
                (origin - min[axis]).min(max[axis] - origin)
            });
            to_sides.into_iter().fold(f64::INFINITY, f64::min)
        });
        drawn_m.min(radius_m).max(0.0)
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum State {
    /// Its pose counts.
    Awake,
    /// Nobody may see it; it is registered where its volume is.
    Hushed { tbv: Tbv, until_ms: Ms },
    /// Its volume has ended, and a pose is awaited; whoever says nothing until then has not moved.
    Asked { until_ms: Ms },
}

impl Mover {
    pub(super) fn is_awake(&self) -> bool {
        self.state == State::Awake
    }

    /// Who fell silent, and never said how fast it goes, has stopped where it was heard of last.
    pub(super) fn rest(&mut self, now_ms: Ms) {
        let silent = now_ms - self.pose.t_ms >= LONGEST_STEP_MS;
        if silent && self.way.is_none() && !self.velocity_is_said {
            self.pose = Pose::resting(self.pose.t_ms, self.pose.position, self.pose.orientation);
        }
    }

    /// Where it is now: where its pose leads, and no further away than it promised to come meanwhile.
    pub(super) fn position_at(&self, now_ms: Ms) -> [f64; 3] {
        self.pose.position_within(SLACK * self.max_speed_mps, now_ms)
    }

    /// Whether it said that it goes on from its last pose, as far as that is believed.
    pub(super) fn goes_on(&self) -> bool {
        self.velocity_is_said && !self.pose.is_resting()
    }

    /// The same with how it moves on.
    pub(super) fn pose_at(&self, now_ms: Ms) -> Pose {
        Pose {
            position: self.position_at(now_ms),
            ..self.pose.at(now_ms)
        }
    }

    /// Whether its owner says when it leaves its volume, and hears when it is to speak before.
    pub(super) fn is_heard_when_it_leaves(&self, sessions: &BTreeMap<SessionId, Box<Session>>) -> bool {
        let owner = self.owner.and_then(|owner| sessions.get(&owner));
        self.way.is_none() && owner.is_some_and(|session| session.wakeable)
    }

    /// Whether a volume still holds it. Of an owner who would have said when it left, the end of the promise says nothing.
    pub(super) fn keeps_to(
        &self,
        (tbv, until_ms): (&Tbv, Ms),
        sessions: &BTreeMap<SessionId, Box<Session>>,
        now_ms: Ms,
    ) -> bool {
        (now_ms < until_ms || self.is_heard_when_it_leaves(sessions)) && tbv.holds(self.pose.position)
    }

    /// When it must be looked at again.
    pub(super) fn alarm_ms(&self) -> Option<Ms> {
        match self.state {
            State::Awake => None,
            State::Hushed { until_ms, .. } | State::Asked { until_ms } => Some(until_ms),
        }
    }

    /// What a session is told that does not know it.
    pub(super) fn told(&mut self, object: ObjectId, attention: Attention) -> Told {
        let moving = Moving {
            pose: self.pose,
            radius_m: self.radius_m,
            attention,
        };
        Told {
            info: self.info(object),
            moving: Some(moving),
        }
    }

    /// An object info as of what is published; many who come to see it at once share it.
    fn info(&mut self, object: ObjectId) -> Arc<ObjectInfo> {
        let Look { name, model } = &self.look;
        let position = self.pose.position;
        let scale = model.as_deref().map_or([1.0; 3], |model| axis_scales(&model.transform));
        let transform = world_from_object(&self.pose, scale);
        if let Some(told) = self.told.upgrade().filter(|told| told.transform == transform) {
            return told;
        }
        let info = Arc::new(ObjectInfo {
            object,
            source_node: name.clone(),
            part: 0,
            bounds: Bounds {
                min: position.map(|x| x - self.radius_m),
                max: position.map(|x| x + self.radius_m),
            },
            transform,
            model: model.as_deref().and_then(|model| model.model),
            procedural: None,
            mover: true,
            door: false,
            levels: model.as_deref().map_or_else(Vec::new, |model| model.levels.clone()),
            smooth: None,
            impostor: model.as_deref().and_then(|model| model.impostor.clone()),
        });
        self.told = Arc::downgrade(&info);
        info
    }
}

/// The lengths of a matrix' axes.
fn axis_scales(matrix: &[f64; 16]) -> [f64; 3] {
    std::array::from_fn(|axis| {
        matrix[4 * axis..4 * axis + 3]
            .iter()
            .fold(0.0f64, |sum, x| sum.hypot(*x))
    })
}

/// A column-major matrix: scale, then turn, then move.
fn world_from_object(pose: &Pose, scale: [f64; 3]) -> [f64; 16] {
    let [x, y, z, w] = pose.orientation;
    let axes = [
        [
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y + z * w),
            2.0 * (x * z - y * w),
        ],
        [
            2.0 * (x * y - z * w),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z + x * w),
        ],
        [
            2.0 * (x * z + y * w),
            2.0 * (y * z - x * w),
            1.0 - 2.0 * (x * x + y * y),
        ],
        pose.position,
    ];
    std::array::from_fn(|i| match (i / 4, i % 4) {
        (3, 3) => 1.0,
        (_, 3) => 0.0,
        (3, row) => axes[3][row],
        (axis, row) => axes[axis][row] * scale[axis],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_hides_further_than_what_is_drawn_of_it_and_than_its_ball() {
        let worn = |min: [f64; 3], max: [f64; 3]| Look {
            name: String::new(),
            model: Some(Arc::new(ObjectInfo {
                object: ObjectId(1),
                source_node: String::new(),
                part: 0,
                bounds: Bounds { min, max },
                transform: world_from_object(&Pose::resting(0, [10.0, 0.0, 20.0], [0.0, 0.0, 0.0, 1.0]), [1.0; 3]),
                model: None,
                procedural: None,
                mover: false,
                door: false,
                levels: Vec::new(),
                smooth: None,
                impostor: None,
            })),
        };
        assert_eq!(
            [0.1, 0.5, 50.0].map(|radius_m| Look::default().hides_m(radius_m)),
            [0.1, PERSON_M, PERSON_M]
        );
        let lorry = worn([8.0, 0.0, 19.0], [12.0, 3.0, 22.0]);
        assert_eq!(
            [0.5, 50.0].map(|radius_m| lorry.hides_m(radius_m)),
            [0.5, 1.0],
            "as far as its nearest side"
        );
        assert_eq!(
            worn([11.0, 0.0, 19.0], [12.0, 3.0, 22.0]).hides_m(50.0),
            0.0,
            "it stands beside its origin"
        );
        assert_eq!(worn(Bounds::EMPTY.min, Bounds::EMPTY.max).hides_m(50.0), 0.0);
    }

    #[test]
    fn a_matrix_turns_scales_and_moves() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        // A quarter turn about y takes z to x.
        let pose = Pose::resting(0, [5.0, 6.0, 7.0], [0.0, half, 0.0, half]);
        let matrix = world_from_object(&pose, [1.0, 1.0, 2.0]);
        let z_axis = &matrix[8..11];
        assert!((z_axis[0] - 2.0).abs() < 1e-12 && z_axis[2].abs() < 1e-12, "{matrix:?}");
        assert_eq!(matrix[12..], [5.0, 6.0, 7.0, 1.0]);
        let scales = axis_scales(&matrix);
        assert!((scales[2] - 2.0).abs() < 1e-12 && (scales[0] - 1.0).abs() < 1e-12);
    }
}
