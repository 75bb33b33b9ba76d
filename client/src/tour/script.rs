//! Where is the visitor, and when? Poses in time, one JSON object a line, as the viewer records them.

use serde::{Deserialize, Serialize};

/// A visitor at a time. Other members of a line are nobody's business here.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Milliseconds since the script began.
    pub t_ms: f64,
    /// The eye, world space, metres.
    pub position: [f64; 3],
    /// How it is turned, a quaternion x, y, z, w; without one the visitor looks where it goes. What comes over the line does
    /// not depend on it, since cells see all around; others in a live scene are told.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orientation: Option<[f64; 4]>,
}

/// Poses with rising times, at least one.
#[derive(Debug, Clone, PartialEq)]
pub struct Script {
    poses: Vec<Pose>,
}

/// Why a text is no script.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ScriptError {
    /// A line cannot be used.
    #[error("line {line}: {what}")]
    Line {
        /// Counted from 1.
        line: usize,
        /// What is wrong with it.
        what: String,
    },
    /// There is none.
    #[error("there is no pose in it; each line is {{\"t_ms\": 0, \"position\": [x, y, z]}}")]
    Empty,
}

/// What is wrong with the JSON of a line: where in it, without the number of the only line that it knows.
fn of_line(cause: &serde_json::Error) -> String {
    let place = format!(" at line {} column {}", cause.line(), cause.column());
    let what = cause.to_string();
    match what.strip_suffix(&place) {
        Some(what) => format!("{what} at column {}", cause.column()),
        None => what,
    }
}

impl Script {
    /// Reads JSON lines; empty ones are skipped.
    ///
    /// # Errors
    /// With the first line that is no pose, or whose time is not after that of the one before.
    pub fn parse(text: &str) -> Result<Self, ScriptError> {
        let mut poses: Vec<Pose> = Vec::new();
        let text = text.trim_start_matches('\u{feff}');
        for (number, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
            let wrong = |what: String| ScriptError::Line { line: number + 1, what };
            // An array would be taken for the members' values in a row.
            if !line.trim_start().starts_with('{') {
                return Err(wrong(
                    "expected an object, {\"t_ms\": 0, \"position\": [x, y, z]}".to_owned(),
                ));
            }
            let pose: Pose = serde_json::from_str(line).map_err(|cause| {
                wrong(format!(
                    "{}; expected {{\"t_ms\": 0, \"position\": [x, y, z]}}",
                    of_line(&cause)
                ))
            })?;
            let turned = pose.orientation.unwrap_or(UPRIGHT);
            let mut numbers = pose.position.iter().chain(&turned).chain([&pose.t_ms]);
            if !numbers.all(|x| x.is_finite()) {
                return Err(wrong("numbers must be finite".to_owned()));
            }
            if pose.t_ms < 0.0 {
                return Err(wrong(format!("t_ms {} is before the script begins, at 0", pose.t_ms)));
            }
            if turned.iter().all(|x| *x == 0.0) {
                return Err(wrong("an orientation of length 0 turns nothing".to_owned()));
            }
            if poses.last().is_some_and(|before| before.t_ms >= pose.t_ms) {
                return Err(wrong(format!(
                    "t_ms {} is not after that of the pose before",
                    pose.t_ms
                )));
            }
            poses.push(pose);
        }
        if poses.is_empty() {
            return Err(ScriptError::Empty);
        }
        Ok(Self { poses })
    }

    /// The same as JSON lines.
    #[must_use]
    pub fn to_text(&self) -> String {
        let line = |pose: &Pose| serde_json::to_string(pose).expect("a pose is numbers") + "\n";
        self.poses.iter().map(line).collect()
    }

    /// The same way at one speed throughout, in metres a second; pauses are left out.
    #[must_use]
    pub fn at_speed(&self, speed_mps: f64) -> Self {
        Self::along(&self.poses, speed_mps)
    }

    /// The same way, begun later: the visitor waits where it begins.
    #[must_use]
    pub fn later(&self, by_ms: f64) -> Self {
        let Some(first) = self.poses.first().filter(|_| by_ms > 0.0) else {
            return self.clone();
        };
        let moved = self.poses.iter().map(|pose| Pose {
            t_ms: pose.t_ms + by_ms,
            ..*pose
        });
        Self {
            poses: [*first].into_iter().chain(moved).collect(),
        }
    }

    /// A way at one speed, metres a second, through places, which are not none.
    pub(super) fn through(places: &[[f64; 3]], speed_mps: f64) -> Self {
        let pose = |position: &[f64; 3]| Pose {
            t_ms: 0.0,
            position: *position,
            orientation: None,
        };
        Self::along(&places.iter().map(pose).collect::<Vec<_>>(), speed_mps)
    }

    fn along(way: &[Pose], speed_mps: f64) -> Self {
        let mut poses = vec![Pose { t_ms: 0.0, ..way[0] }];
        for pair in way.windows(2) {
            let away_m = distance_m(pair[0].position, pair[1].position);
            if away_m > 0.0 {
                let t_ms = poses[poses.len() - 1].t_ms + 1000.0 * away_m / speed_mps;
                poses.push(Pose { t_ms, ..pair[1] });
            }
        }
        Self { poses }
    }

    /// When it begins and ends.
    #[must_use]
    pub fn times_ms(&self) -> [f64; 2] {
        [self.poses[0].t_ms, self.poses[self.poses.len() - 1].t_ms]
    }

    /// Where the visitor is; between poses on the straight line.
    #[must_use]
    pub fn at(&self, t_ms: f64) -> [f64; 3] {
        let [a, b] = self.around(t_ms);
        let share = share_of(a, b, t_ms);
        [0, 1, 2].map(|i| a.position[i] + share * (b.position[i] - a.position[i]))
    }

    /// Where it goes, metres a second.
    #[must_use]
    pub fn velocity_mps(&self, t_ms: f64) -> [f64; 3] {
        let [a, b] = self.around(t_ms);
        let passed_s = (b.t_ms - a.t_ms) / 1000.0;
        if passed_s <= 0.0 {
            return [0.0; 3];
        }
        [0, 1, 2].map(|i| (b.position[i] - a.position[i]) / passed_s)
    }

    /// As fast as it ever goes, metres a second.
    #[must_use]
    pub fn fastest_mps(&self) -> f64 {
        let speeds = self.poses.windows(2).map(|pair| {
            let passed_s = (pair[1].t_ms - pair[0].t_ms) / 1000.0;
            distance_m(pair[0].position, pair[1].position) / passed_s
        });
        speeds.fold(0.0, f64::max)
    }

    /// How the visitor is turned, a unit quaternion x, y, z, w: as the script says, else to where it goes.
    #[must_use]
    pub fn orientation(&self, t_ms: f64) -> [f64; 4] {
        let [a, b] = self.around(t_ms);
        let (Some(from), Some(to)) = (a.orientation, b.orientation) else {
            return a.orientation.map_or_else(|| facing(self.velocity_mps(t_ms)), unit);
        };
        let (from, to, share) = (unit(from), unit(to), share_of(a, b, t_ms));
        // Both signs of a quaternion are the same turn; the nearer one is the short way round.
        let sign = (0..4).map(|i| from[i] * to[i]).sum::<f64>().signum();
        unit([0, 1, 2, 3].map(|i| from[i] + share * (sign * to[i] - from[i])))
    }

    /// The poses before and after a time; the same one twice before it begins and after it ends.
    fn around(&self, t_ms: f64) -> [Pose; 2] {
        let next = self.poses.partition_point(|pose| pose.t_ms <= t_ms);
        let last = self.poses.len() - 1;
        [next.saturating_sub(1), next.min(last)].map(|i| self.poses[i])
    }

    /// The same, ended at a time.
    pub(super) fn until(mut self, end_ms: f64) -> Self {
        let position = self.at(end_ms);
        let kept = self.poses.partition_point(|pose| pose.t_ms < end_ms).max(1);
        if kept < self.poses.len() {
            self.poses.truncate(kept);
            self.poses.push(Pose {
                t_ms: end_ms,
                position,
                orientation: None,
            });
        }
        self
    }
}

/// Turned not at all: one looks along −z.
const UPRIGHT: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// How far a time is from one pose to the next, 0 to 1.
fn share_of(a: Pose, b: Pose, t_ms: f64) -> f64 {
    let passed_ms = b.t_ms - a.t_ms;
    if passed_ms > 0.0 {
        (t_ms - a.t_ms) / passed_ms
    } else {
        0.0
    }
}

/// Turned about the vertical to look along a velocity; whoever stands is not turned.
fn facing([x, _, z]: [f64; 3]) -> [f64; 4] {
    if x == 0.0 && z == 0.0 {
        return UPRIGHT;
    }
    let half = 0.5 * (-x).atan2(-z);
    [0.0, half.sin(), 0.0, half.cos()]
}

fn unit(q: [f64; 4]) -> [f64; 4] {
    let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length > 0.0 { q.map(|x| x / length) } else { UPRIGHT }
}

pub(super) fn distance_m(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_are_read_and_walked_in_straight_lines() {
        let text = "\u{feff}{\"t_ms\": 0, \"position\": [0, 1, 0], \"orientation\": [0, 0, 0, 1]}\n\n{\"t_ms\": 1000, \"position\": [4, 1, 0]}\n";
        let script = Script::parse(text).unwrap();
        assert_eq!(script.at(-5.0), [0.0, 1.0, 0.0]);
        assert_eq!(script.at(250.0), [1.0, 1.0, 0.0]);
        assert_eq!(script.at(9000.0), [4.0, 1.0, 0.0]);
        assert_eq!(Script::parse(&script.to_text()), Ok(script.clone()));
        let slow = script.at_speed(0.5);
        assert_eq!(slow.times_ms(), [0.0, 8000.0]);
        assert_eq!(slow.at(4000.0), [2.0, 1.0, 0.0]);
    }

    #[test]
    fn a_recording_of_the_viewer_says_how_one_is_turned_and_all_else_is_left_alone() {
        let quarter = std::f64::consts::FRAC_1_SQRT_2;
        let text = format!(
            "{}\n{}\n{}\n",
            r#"{"t_ms": 0.5, "position": [0, 1.6, 0], "orientation": [0, 0, 0, 2], "door": "o7"}"#,
            format_args!(r#"{{"t_ms": 1000.5, "position": [0, 1.6, 0], "orientation": [0, {quarter}, 0, {quarter}]}}"#),
            r#"{"t_ms": 2000.5, "position": [3, 1.6, 0]}"#,
        );
        let script = Script::parse(&text).unwrap();
        let near = |found: [f64; 4], wanted: [f64; 4]| (0..4).all(|i| (found[i] - wanted[i]).abs() < 1e-9);
        assert!(near(script.orientation(0.5), UPRIGHT));
        let eighth = std::f64::consts::FRAC_PI_8;
        assert!(near(script.orientation(500.5), [0.0, eighth.sin(), 0.0, eighth.cos()]));
        assert!(
            near(script.orientation(1500.5), [0.0, quarter, 0.0, quarter]),
            "as it was said last"
        );
        // Nobody says how one is turned at the end: who stands there is not turned.
        assert!(near(script.orientation(9000.0), UPRIGHT));
        assert_eq!(script.velocity_mps(1500.5), [3.0, 0.0, 0.0]);
        let plain = Script::through(&[[0.0; 3], [2.0, 0.0, 0.0]], 1.0);
        assert!(
            near(plain.orientation(1.0), [0.0, -quarter, 0.0, quarter]),
            "−90°: from −z to x"
        );
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        assert_eq!(Script::parse("\n"), Err(ScriptError::Empty));
        let message = |text: &str| Script::parse(text).unwrap_err().to_string();
        assert!(message("\n{\"t_ms\": 1}").starts_with("line 2: missing field `position`"));
        assert!(message("[1, [0, 0, 0]]").starts_with("line 1: expected an object"));
        let flat = message("{\"t_ms\": 1, \"position\": [0, 0]}");
        assert!(
            flat.starts_with("line 1: invalid length 2, expected an array of length 3 at column "),
            "{flat}"
        );
        assert_eq!(flat.matches("line").count(), 1, "{flat}");
        let early = r#"{"t_ms": -5, "position": [0, 0, 0]}"#;
        assert_eq!(message(early), "line 1: t_ms -5 is before the script begins, at 0");
        let back = "{\"t_ms\": 5, \"position\": [0, 0, 0]}\n{\"t_ms\": 5, \"position\": [1, 0, 0]}";
        assert!(message(back).contains("line 2: t_ms 5 is not after"));
        let turned = r#"{"t_ms": 5, "position": [0, 0, 0], "orientation": [0, 0, 0, 0]}"#;
        assert_eq!(message(turned), "line 1: an orientation of length 0 turns nothing");
    }
}
