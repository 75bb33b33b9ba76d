//! Where is a mover between its poses? Dead reckoning, as in NPSNET (Schmalstieg, *The Remote Rendering Pipeline*, 1997,
//! §3.4): it goes on as its last pose says. When the next one contradicts, what is drawn does not jump: the difference fades
//! away. The same as `viewer/core/live/motion.ts`.

use serde::{Deserialize, Serialize};

/// How long it takes until a difference has become half as large.
const FADE_HALF_LIFE_MS: f64 = 90.0;
/// A difference that is larger is no error but a jump.
const JUMP_M: f64 = 4.0;

/// Where something is, and where it is going.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// In the clock of whoever says so.
    pub t_ms: i64,
    /// World space, metres.
    pub position: [f64; 3],
    /// A quaternion x, y, z, w.
    pub orientation: [f64; 4],
    /// Metres a second.
    pub velocity: [f64; 3],
    /// Metres a second squared.
    #[serde(default)]
    pub acceleration: [f64; 3],
}

impl Pose {
    /// p + v·t + a·t²/2, so long after it was true, for at most `longest_ms`.
    pub(crate) fn position_after(&self, passed_ms: f64, longest_ms: f64) -> [f64; 3] {
        let t_s = passed_ms.min(longest_ms).max(0.0) * 1e-3;
        std::array::from_fn(|a| self.position[a] + t_s * (self.velocity[a] + 0.5 * t_s * self.acceleration[a]))
    }
}

/// The angle between two unit quaternions, radians.
pub(crate) fn turned_rad(a: [f64; 4], b: [f64; 4]) -> f64 {
    2.0 * dot(a, b).abs().min(1.0).acos()
}

/// Where something is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stand {
    /// World space, metres.
    pub position: [f64; 3],
    /// A unit quaternion x, y, z, w.
    pub orientation: [f64; 4],
}

impl Stand {
    /// Looking along −z.
    #[must_use]
    pub fn upright(position: [f64; 3]) -> Self {
        Self {
            position,
            orientation: [0.0, 0.0, 0.0, 1.0],
        }
    }
}

/// What is drawn of one mover.
#[derive(Debug, Clone)]
pub(crate) struct SmoothMotion {
    pose: Pose,
    /// When that was true, by this client's clock.
    true_ms: f64,
    offset: [f64; 3],
    turned_from: [f64; 4],
    corrected_ms: f64,
}

impl SmoothMotion {
    /// `ahead_ms` added to a time of the pose makes one of this client's clock.
    pub(crate) fn new(pose: Pose, ahead_ms: f64, now_ms: f64) -> Self {
        Self {
            pose,
            true_ms: pose.t_ms as f64 + ahead_ms,
            offset: [0.0; 3],
            turned_from: pose.orientation,
            corrected_ms: now_ms,
        }
    }

    /// Takes in a newer pose; older ones are ignored.
    pub(crate) fn correct(&mut self, pose: Pose, ahead_ms: f64, now_ms: f64, longest_ms: f64) {
        if pose.t_ms < self.pose.t_ms {
            return;
        }
        let before = self.at(now_ms, longest_ms);
        *self = Self::new(pose, ahead_ms, now_ms);
        let after = self.at(now_ms, longest_ms).position;
        let offset: [f64; 3] = std::array::from_fn(|a| before.position[a] - after[a]);
        if length(offset) <= JUMP_M {
            self.offset = offset;
        }
        self.turned_from = before.orientation;
    }

    pub(crate) fn at(&self, now_ms: f64, longest_ms: f64) -> Stand {
        let left = 0.5_f64.powf((now_ms - self.corrected_ms).max(0.0) / FADE_HALF_LIFE_MS);
        let reckoned = self.pose.position_after(now_ms - self.true_ms, longest_ms);
        Stand {
            position: std::array::from_fn(|a| reckoned[a] + left * self.offset[a]),
            orientation: between(self.pose.orientation, self.turned_from, left),
        }
    }
}

/// From one orientation towards another, the short way.
fn between(a: [f64; 4], b: [f64; 4], share: f64) -> [f64; 4] {
    let sign = if dot(a, b) < 0.0 { -1.0 } else { 1.0 };
    let mixed: [f64; 4] = std::array::from_fn(|i| a[i] * (1.0 - share) + sign * b[i] * share);
    let size = dot(mixed, mixed).sqrt();
    if size > 1e-9 { mixed.map(|part| part / size) } else { a }
}

fn dot(a: [f64; 4], b: [f64; 4]) -> f64 {
    (0..4).map(|i| a[i] * b[i]).sum()
}

/// The length of a vector.
pub(crate) fn length(vector: [f64; 3]) -> f64 {
    vector.iter().map(|part| part * part).sum::<f64>().sqrt()
}
