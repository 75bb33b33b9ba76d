//! Where is the visitor, and when? Poses in time, one JSON object a line, or a walk made up from the scene's cells.

use belvedere_scene::{Bounds, CellId, record::CellRecord};
use serde::{Deserialize, Serialize};

use crate::{ByteSource, Error, Scene};

/// A visitor at a time. Other members of a line, such as an orientation, are nobody's business here.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Milliseconds since the script began.
    pub t_ms: f64,
    /// The eye, world space, metres.
    pub position: [f64; 3],
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
            let pose: Pose = serde_json::from_str(line)
                .map_err(|cause| wrong(format!("{cause}; expected {{\"t_ms\": 0, \"position\": [x, y, z]}}")))?;
            if !pose.t_ms.is_finite() || !pose.position.iter().all(|x| x.is_finite()) {
                return Err(wrong("numbers must be finite".to_owned()));
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
        let places: Vec<_> = self.poses.iter().map(|pose| pose.position).collect();
        Self::along(&places, speed_mps)
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
    fn along(places: &[[f64; 3]], speed_mps: f64) -> Self {
        let mut poses = vec![Pose {
            t_ms: 0.0,
            position: places[0],
        }];
        for pair in places.windows(2) {
            let away_m = distance_m(pair[0], pair[1]);
            if away_m > 0.0 {
                let t_ms = poses[poses.len() - 1].t_ms + 1000.0 * away_m / speed_mps;
                poses.push(Pose {
                    t_ms,
                    position: pair[1],
                });
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
        let next = self.poses.partition_point(|pose| pose.t_ms <= t_ms);
        match (next.checked_sub(1).map(|i| self.poses[i]), self.poses.get(next)) {
            (None, Some(first)) => first.position,
            (Some(last), None) => last.position,
            (Some(a), Some(b)) => {
                let share = (t_ms - a.t_ms) / (b.t_ms - a.t_ms);
                [0, 1, 2].map(|i| a.position[i] + share * (b.position[i] - a.position[i]))
            }
            (None, None) => [0.0; 3],
        }
    }

    /// A walk from the scene's first viewpoint from cell to cell through their openings, at the height of that viewpoint
    /// where there is room for it: never straight back, unless there is no other way. The same number gives the same walk. From a
    /// cell whose record cannot be had it goes on next door, where both cells meet.
    ///
    /// # Errors
    /// When the index cannot be fetched or read.
    pub async fn wander<S: ByteSource>(
        scene: &Scene<S>,
        speed_mps: f64,
        duration_s: f64,
        seed: u64,
    ) -> Result<Self, Error> {
        let start = scene.pointer().viewpoints[0].position;
        let mut cell = scene.locate(start).await?.cell;
        let mut places = vec![start];
        let mut before: Option<CellId> = None;
        let (mut walked_m, mut random) = (0.0, seed);
        while walked_m < speed_mps * duration_s && places.len() < MOST_PLACES {
            let told = match scene.record(&cell).await {
                Ok(record) => way_on(&record, before, start[1], &mut random).map(|(to, place)| (to, Some(place))),
                Err(_) if cell.adjacent.is_empty() => None,
                Err(_) => Some((cell.adjacent[pick(cell.adjacent.len(), &mut random)], None)),
            };
            let Some((to, place)) = told else { break };
            let middle = scene.cell(to).await?.ok_or(Error::NoCells)?;
            let place = place.unwrap_or_else(|| where_both_meet(&cell.bounds, &middle.bounds, start[1]));
            let beyond = at_height(
                middle.bounds.center(),
                middle.bounds.min[1],
                middle.bounds.max[1],
                start[1],
            );
            for next in [place, beyond] {
                walked_m += distance_m(places[places.len() - 1], next);
                places.push(next);
            }
            before = Some(cell.cell);
            cell = middle;
        }
        Ok(Self::along(&places, speed_mps).until(1000.0 * duration_s))
    }

    /// The same, ended at a time.
    fn until(mut self, end_ms: f64) -> Self {
        let position = self.at(end_ms);
        let kept = self.poses.partition_point(|pose| pose.t_ms < end_ms).max(1);
        if kept < self.poses.len() {
            self.poses.truncate(kept);
            self.poses.push(Pose { t_ms: end_ms, position });
        }
        self
    }
}

/// A made-up walk passes through no more places.
const MOST_PLACES: usize = 100_000;

/// One of the openings of a cell: where it leads, and a place in it.
fn way_on(record: &CellRecord, before: Option<CellId>, height_m: f64, random: &mut u64) -> Option<(CellId, [f64; 3])> {
    let low_enough = |polygon: &[[f64; 3]]| polygon.iter().any(|p| p[1] <= height_m);
    let all = record.portals.iter().filter(|portal| !portal.polygon.is_empty());
    let mut ways: Vec<_> = all.clone().filter(|portal| low_enough(&portal.polygon)).collect();
    if ways.is_empty() {
        ways = all.collect();
    }
    if ways.iter().any(|portal| Some(portal.to) != before) {
        ways.retain(|portal| Some(portal.to) != before);
    }
    if ways.is_empty() {
        return None;
    }
    let way = ways[pick(ways.len(), random)];
    let count = way.polygon.len() as f64;
    let middle = [0, 1, 2].map(|i| way.polygon.iter().map(|p| p[i]).sum::<f64>() / count);
    let heights = way.polygon.iter().map(|p| p[1]);
    let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), y| (l.min(y), h.max(y)));
    Some((way.to, at_height(middle, low, high, height_m)))
}

/// A number below this (splitmix64).
fn pick(count: usize, random: &mut u64) -> usize {
    *random = random.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut mixed = *random;
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((mixed ^ (mixed >> 31)) % count as u64) as usize
}

/// The middle of what two boxes that touch share.
fn where_both_meet(a: &Bounds, b: &Bounds, height_m: f64) -> [f64; 3] {
    let shared = [0, 1, 2].map(|i| [a.min[i].max(b.min[i]), a.max[i].min(b.max[i])]);
    let middle = shared.map(|[low, high]| 0.5 * (low + high));
    at_height(
        middle,
        shared[1][0].min(shared[1][1]),
        shared[1][1].max(shared[1][0]),
        height_m,
    )
}

fn at_height(mut place: [f64; 3], low: f64, high: f64, height_m: f64) -> [f64; 3] {
    place[1] = height_m.clamp(low, high);
    place
}

fn distance_m(a: [f64; 3], b: [f64; 3]) -> f64 {
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
    fn what_is_wrong_is_told_with_its_line() {
        assert_eq!(Script::parse("\n"), Err(ScriptError::Empty));
        let message = |text: &str| Script::parse(text).unwrap_err().to_string();
        assert!(message("\n{\"t_ms\": 1}").starts_with("line 2: missing field `position`"));
        let back = "{\"t_ms\": 5, \"position\": [0, 0, 0]}\n{\"t_ms\": 5, \"position\": [1, 0, 0]}";
        assert!(message(back).contains("line 2: t_ms 5 is not after"));
    }
}
