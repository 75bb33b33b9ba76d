//! Where is a mover between its poses?
//!
//! Dead reckoning, as in NPSNET (Schmalstieg, *The Remote Rendering Pipeline*, 1997, §3.4): whoever knows a pose extrapolates
//! it, the server extrapolates the pose that it has sent likewise, and sends another only when the two are too far apart.

use belvedere_scene::Bounds;
use serde::{Deserialize, Serialize};

use crate::Ms;

/// Extrapolation ends after this time: who has not been heard of for longer stands still.
pub const LONGEST_EXTRAPOLATION_MS: Ms = 2_000;

/// Where something is, and where it is going.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Pose {
    /// When this was so.
    pub t_ms: Ms,
    /// World space, metres.
    pub position: [f64; 3],
    /// A unit quaternion x, y, z, w: `world_from_object` without translation and scale.
    pub orientation: [f64; 4],
    /// Metres a second.
    pub velocity: [f64; 3],
    /// Metres a second squared; zero means first-order extrapolation.
    #[serde(skip_serializing_if = "is_zero")]
    pub acceleration: [f64; 3],
}

fn is_zero(vector: &[f64; 3]) -> bool {
    *vector == [0.0; 3]
}

impl Pose {
    /// Standing still.
    #[must_use]
    pub fn resting(t_ms: Ms, position: [f64; 3], orientation: [f64; 4]) -> Self {
        Self {
            t_ms,
            position,
            orientation,
            velocity: [0.0; 3],
            acceleration: [0.0; 3],
        }
    }

    /// Whether it is the same at all times.
    #[must_use]
    pub fn is_resting(&self) -> bool {
        is_zero(&self.velocity) && is_zero(&self.acceleration)
    }

    /// The position at another time: p + v·t + a·t²/2, for at most [`LONGEST_EXTRAPOLATION_MS`].
    #[must_use]
    pub fn position_at(&self, now_ms: Ms) -> [f64; 3] {
        let t_s = (now_ms - self.t_ms).clamp(0, LONGEST_EXTRAPOLATION_MS) as f64 * 1e-3;
        std::array::from_fn(|a| self.position[a] + t_s * (self.velocity[a] + 0.5 * t_s * self.acceleration[a]))
    }

    /// The position at another time, no further from here than somebody comes at this speed.
    #[must_use]
    pub fn position_within(&self, most_mps: f64, now_ms: Ms) -> [f64; 3] {
        let position = self.position_at(now_ms);
        if is_zero(&self.acceleration) && is_zero(&self.velocity) {
            return position;
        }
        let t_s = (now_ms - self.t_ms).clamp(0, LONGEST_EXTRAPOLATION_MS) as f64 * 1e-3;
        let way = shortened(std::array::from_fn(|a| position[a] - self.position[a]), most_mps * t_s);
        std::array::from_fn(|a| self.position[a] + way[a])
    }

    /// The same motion from another time on.
    #[must_use]
    pub fn at(&self, now_ms: Ms) -> Self {
        let t_ms = (now_ms - self.t_ms).max(0);
        let position = self.position_at(now_ms);
        if t_ms >= LONGEST_EXTRAPOLATION_MS {
            return Self::resting(now_ms, position, self.orientation);
        }
        let t_s = t_ms as f64 * 1e-3;
        Self {
            t_ms: now_ms,
            position,
            velocity: std::array::from_fn(|a| self.velocity[a] + t_s * self.acceleration[a]),
            ..*self
        }
    }

    /// The angle between two orientations in radians.
    #[must_use]
    pub fn turned_rad(&self, other: &Self) -> f64 {
        if self.orientation == other.orientation {
            return 0.0;
        }
        let dot: f64 = (0..4).map(|i| self.orientation[i] * other.orientation[i]).sum();
        2.0 * dot.abs().min(1.0).acos()
    }
}

/// A vector in the same direction that is no longer than this.
pub(crate) fn shortened(vector: [f64; 3], most: f64) -> [f64; 3] {
    let length = vector.iter().fold(0.0f64, |sum, x| sum.hypot(*x));
    if length <= most {
        return vector;
    }
    vector.map(|x| x / length * most)
}

/// The orientation a share of the shortest turn on from one to another, at an even rate (Shoemake, *Animating rotation with quaternion
/// curves*, 1985).
fn turned(from: [f64; 4], to: [f64; 4], share: f64) -> [f64; 4] {
    /// Nobody sees so small a turn.
    const CLOSE: f64 = 1.0 - 1e-9;
    let dot: f64 = (0..4).map(|i| from[i] * to[i]).sum();
    if dot.abs() > CLOSE {
        return from;
    }
    let angle = dot.abs().acos();
    let [before, after] = [1.0 - share, share].map(|part| (part * angle).sin() / angle.sin());
    // Either of two opposite quaternions is the same orientation; the nearer one is turned to.
    let after = after * dot.signum();
    std::array::from_fn(|i| before * from[i] + after * to[i])
}

/// A point of a trajectory.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Key {
    /// Since the trajectory began.
    pub t_ms: Ms,
    /// World space, metres.
    pub position: [f64; 3],
    /// A quaternion of any length but zero; in a trajectory of length one.
    pub orientation: [f64; 4],
}

/// A way that is known ahead: straight lines between keys, with an even turn on each.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Written")]
pub struct Trajectory {
    begin_ms: Ms,
    /// At least one, rising in time, the first at zero.
    keys: Vec<Key>,
    repeat: bool,
}

/// A trajectory as it may have been written.
#[derive(Deserialize)]
struct Written {
    begin_ms: Ms,
    keys: Vec<Key>,
    repeat: bool,
}

impl TryFrom<Written> for Trajectory {
    type Error = TrajectoryError;

    fn try_from(written: Written) -> Result<Self, TrajectoryError> {
        Self::new(written.begin_ms, written.keys, written.repeat)
    }
}

/// Why keys make no trajectory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum TrajectoryError {
    /// There is none.
    #[error("a trajectory has at least one key")]
    Empty,
    /// Times must rise from zero.
    #[error("the keys' times must rise from 0; key {0} does not")]
    Order(usize),
}

impl TrajectoryError {
    /// A JSON pointer to what is wrong.
    #[must_use]
    pub fn pointer(&self) -> String {
        match self {
            Self::Empty => "/trajectory/keys".to_owned(),
            Self::Order(number) => format!("/trajectory/keys/{number}/t_ms"),
        }
    }
}

impl Trajectory {
    /// A trajectory that starts now.
    ///
    /// # Errors
    /// When there is no key or their times do not rise from zero.
    pub fn new(begin_ms: Ms, mut keys: Vec<Key>, repeat: bool) -> Result<Self, TrajectoryError> {
        let first = keys.first().ok_or(TrajectoryError::Empty)?;
        if first.t_ms != 0 {
            return Err(TrajectoryError::Order(0));
        }
        if let Some(at) = keys.windows(2).position(|pair| pair[0].t_ms >= pair[1].t_ms) {
            return Err(TrajectoryError::Order(at + 1));
        }
        for key in &mut keys {
            // What has no length is no orientation, and is refused as such.
            let length = key.orientation.iter().fold(0.0f64, |sum, x| sum.hypot(*x));
            key.orientation = key.orientation.map(|x| x / length.max(f64::MIN_POSITIVE));
        }
        Ok(Self { begin_ms, keys, repeat })
    }

    /// Every time that it names.
    pub(crate) fn times(&self) -> impl Iterator<Item = Ms> {
        self.keys.iter().map(|key| key.t_ms).chain([self.begin_ms])
    }

    /// What it passes.
    #[must_use]
    pub fn keys(&self) -> &[Key] {
        &self.keys
    }

    /// The speed on each of its lines.
    pub(crate) fn speeds_mps(&self) -> impl Iterator<Item = f64> {
        self.keys.windows(2).map(|pair| {
            let length_s = (pair[1].t_ms - pair[0].t_ms) as f64 * 1e-3;
            crate::cells::distance_m(pair[0].position, pair[1].position) / length_s
        })
    }

    /// The speed on the fastest of its lines.
    #[must_use]
    pub fn fastest_mps(&self) -> f64 {
        self.speeds_mps().fold(0.0, f64::max)
    }

    fn period_ms(&self) -> Ms {
        self.keys.last().map_or(0, |key| key.t_ms)
    }

    /// Time since the begin of the round that is under way.
    fn phase_ms(&self, now_ms: Ms) -> Ms {
        let (since, period) = ((now_ms - self.begin_ms).max(0), self.period_ms());
        if self.repeat && period > 0 {
            since % period
        } else {
            since.min(period)
        }
    }

    /// The index of the key before a phase.
    fn before(&self, phase_ms: Ms) -> usize {
        self.keys.partition_point(|key| key.t_ms <= phase_ms).max(1) - 1
    }

    /// Where it is.
    #[must_use]
    pub fn pose_at(&self, now_ms: Ms) -> Pose {
        let phase = self.phase_ms(now_ms);
        let at = self.before(phase);
        let from = &self.keys[at];
        let Some(to) = self.keys.get(at + 1) else {
            return Pose::resting(now_ms, from.position, from.orientation);
        };
        let length_s = (to.t_ms - from.t_ms) as f64 * 1e-3;
        let velocity = std::array::from_fn(|a| (to.position[a] - from.position[a]) / length_s);
        let since_s = (phase - from.t_ms) as f64 * 1e-3;
        Pose {
            t_ms: now_ms,
            position: std::array::from_fn(|a| from.position[a] + since_s * velocity[a]),
            orientation: turned(from.orientation, to.orientation, since_s / length_s),
            velocity,
            acceleration: [0.0; 3],
        }
    }

    /// Boxes around everything that it passes between two times: its swept volume without its own size.
    #[must_use]
    pub fn swept(&self, from_ms: Ms, until_ms: Ms) -> Vec<Bounds> {
        let ends = [self.pose_at(from_ms).position, self.pose_at(until_ms).position];
        let (first, last) = (self.phase_ms(from_ms), self.phase_ms(until_ms));
        let whole_round = self.repeat && until_ms - from_ms >= self.period_ms();
        let keys = self.keys.iter();
        let mut passed: Vec<[f64; 3]> = if whole_round {
            keys.map(|key| key.position).collect()
        } else if self.repeat && last < first {
            // Over the end of a round and on from its begin.
            let late = keys.clone().filter(|key| key.t_ms > first);
            late.chain(keys.filter(|key| key.t_ms < last))
                .map(|key| key.position)
                .collect()
        } else {
            keys.filter(|key| first < key.t_ms && key.t_ms < last)
                .map(|key| key.position)
                .collect()
        };
        passed.insert(0, ends[0]);
        passed.push(ends[1]);
        passed
            .windows(2)
            .map(|pair| Bounds::around([pair[0], pair[1]]))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UP: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

    fn key(t_ms: Ms, x: f64) -> Key {
        Key {
            t_ms,
            position: [x, 0.0, 0.0],
            orientation: UP,
        }
    }

    #[test]
    fn extrapolation_is_of_second_order_and_ends() {
        let pose = Pose {
            velocity: [1.0, 0.0, 0.0],
            acceleration: [2.0, 0.0, 0.0],
            ..Pose::resting(1_000, [0.0; 3], UP)
        };
        assert_eq!(pose.position_at(2_000), [2.0, 0.0, 0.0]);
        assert_eq!(pose.position_at(3_000), pose.position_at(60_000));
        assert_eq!(pose.position_at(0), [0.0; 3], "the past is not extrapolated");
    }

    #[test]
    fn a_trajectory_is_where_its_keys_say() {
        let way = Trajectory::new(500, vec![key(0, 0.0), key(1_000, 10.0), key(3_000, 0.0)], true).unwrap();
        let x = |t| way.pose_at(t).position[0];
        assert_eq!(
            [x(0), x(1_000), x(1_500), x(2_500), x(4_500)],
            [0.0, 5.0, 10.0, 5.0, 10.0]
        );
        let hull = |from, until| {
            let boxes = way.swept(from, until);
            let all = boxes.iter().fold(Bounds::EMPTY, |a, b| a.union(b));
            (all.min[0], all.max[0])
        };
        assert_eq!(hull(500, 1_000), (0.0, 5.0));
        assert_eq!(hull(1_000, 2_500), (5.0, 10.0));
        assert_eq!(hull(3_000, 4_000), (0.0, 5.0), "over the end of a round");
        assert_eq!(hull(700, 9_000), (0.0, 10.0));
    }

    #[test]
    fn it_turns_evenly_the_shortest_way_between_keys() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let about_y = |orientation, t_ms| Key {
            orientation,
            ..key(t_ms, 0.0)
        };
        // A quarter turn about y, written as either of two quaternions; then there it stays.
        for sign in [1.0, -1.0] {
            let quarter = [0.0, sign * half, 0.0, sign * half].map(|x| 3.0 * x);
            let keys = vec![about_y(UP, 0), about_y(quarter, 1_000), about_y(quarter, 2_000)];
            let way = Trajectory::new(0, keys, false).unwrap();
            for t_ms in [0, 250, 500, 900, 1_000, 1_500] {
                let [x, y, z, w] = way.pose_at(t_ms).orientation;
                let turned = 2.0 * y.atan2(w);
                let expected = std::f64::consts::FRAC_PI_2 * (t_ms.min(1_000) as f64 * 1e-3);
                let wrong = (turned - expected).sin();
                assert!(
                    x == 0.0 && z == 0.0 && wrong.abs() < 1e-9,
                    "{turned} and not {expected} at {t_ms}"
                );
                assert!((y.hypot(w) - 1.0).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn keys_must_rise_from_zero() {
        assert_eq!(Trajectory::new(0, vec![], false), Err(TrajectoryError::Empty));
        assert_eq!(
            Trajectory::new(0, vec![key(5, 0.0)], false),
            Err(TrajectoryError::Order(0))
        );
        let twice = vec![key(0, 0.0), key(7, 0.0), key(7, 1.0)];
        assert_eq!(Trajectory::new(0, twice, false), Err(TrajectoryError::Order(2)));
    }
}
