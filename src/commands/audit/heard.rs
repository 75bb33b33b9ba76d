//! What may be told of a pose that has come in, and where does it lead? From the pose and the time at which it came alone.
//!
//! When a pose was true its sender says in a clock of its own, of which only differences count. It was on its way for at least as long
//! as the fastest of the last few seconds, and came when it came: between these two it was true. Between poses a mover is where the stated velocity and
//! acceleration lead, as far as they keep to what was promised; where no velocity was stated it may be anywhere that it comes straight
//! on in the direction of its last step. So what is held against this is excused by what nobody could know, and by no more.

use belvedere_live::{
    Ms,
    cells::distance_m,
    motion::{LONGEST_EXTRAPOLATION_MS, Pose},
    world::{MOST_ACCELERATION_MPS2, SLACK, Sent},
};

use super::clock::Clock;

/// A velocity that nobody stated is taken for true for so long, with a few ticks for what comes late.
pub(super) const ESTIMATE_LASTS_MS: Ms = 1_500;
/// Numbers that are further apart than this share of them are not the same.
const SAME: f64 = 1e-9;
/// A share is found by halving the range of what it may be so often.
const HALVINGS: u32 = 60;
/// A curve is taken for so many straight lines.
const PIECES: u32 = 8;

/// A pose, and when it may have been true.
#[derive(Debug, Clone)]
pub(super) struct Heard {
    sent: Sent,
    /// As far as they were promised.
    velocity: Option<[f64; 3]>,
    acceleration: [f64; 3],
    most_mps: f64,
    /// From where it was before.
    step: [f64; 3],
    /// It may have been true at the same moment as the one before, so that the step says nothing.
    at_once: bool,
    earliest_ms: Ms,
    latest_ms: Ms,
    clock: Clock,
    /// The last time that its sender told, in its clock and, at the earliest, in ours.
    stamped_ms: Option<(Ms, Ms)>,
}

/// What was promised of how something moves.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    pub(super) max_speed_mps: f64,
    pub(super) max_acceleration_mps2: Option<f64>,
}

impl Heard {
    /// The first pose of something counts from when it comes.
    pub(super) fn first(sent: &Sent, promise: Limits, now_ms: Ms) -> Self {
        let mut clock = Clock::default();
        let earliest_ms = clock.earliest_ms(sent.t_ms, now_ms);
        Self {
            sent: *sent,
            velocity: Some(limited(
                sent.velocity.unwrap_or_default(),
                SLACK * promise.max_speed_mps,
            )),
            acceleration: acceleration(sent, promise),
            most_mps: SLACK * promise.max_speed_mps,
            step: [0.0; 3],
            at_once: false,
            earliest_ms: now_ms,
            latest_ms: now_ms,
            clock,
            stamped_ms: sent.t_ms.map(|t_ms| (t_ms, earliest_ms)),
        }
    }

    /// Another one comes.
    pub(super) fn hear(&mut self, sent: &Sent, promise: Limits, now_ms: Ms) {
        let most_mps = SLACK * promise.max_speed_mps;
        let earliest_ms = self.clock.earliest_ms(sent.t_ms, now_ms);
        self.stamped_ms = sent.t_ms.map(|t_ms| (t_ms, earliest_ms)).or(self.stamped_ms);
        self.step = std::array::from_fn(|axis| sent.position[axis] - self.sent.position[axis]);
        self.at_once = earliest_ms <= self.latest_ms;
        self.earliest_ms = earliest_ms.clamp(self.earliest_ms, now_ms);
        self.latest_ms = now_ms;
        self.velocity = sent.velocity.map(|stated| limited(stated, most_mps));
        self.acceleration = acceleration(sent, promise);
        self.most_mps = most_mps;
        self.sent = *sent;
    }

    /// A time of the sender's clock in ours, the earliest that it may be; who has told none goes by ours.
    pub(super) fn ours_ms(&self, theirs_ms: Ms) -> Ms {
        self.stamped_ms
            .map_or(theirs_ms, |(t_ms, earliest_ms)| earliest_ms + theirs_ms - t_ms)
    }

    /// What is wrong with a pose that somebody is told, and by how many metres.
    pub(super) fn belies(&self, told: &Pose) -> Option<(&'static str, Option<f64>)> {
        let off_m = distance_m(told.position, self.sent.position);
        let length = norm(&self.sent.orientation);
        let orientation = self.sent.orientation.map(|x| x / length);
        if !same(&told.position, &self.sent.position) {
            Some(("another position came in", Some(off_m)))
        } else if !same(&told.orientation, &orientation) {
            Some(("another orientation came in", None))
        } else if !(self.earliest_ms..=self.latest_ms).contains(&told.t_ms) {
            Some(("it cannot have been true then", None))
        } else if !self.may_go(told.velocity) {
            Some(("another velocity came in", None))
        } else if !same(&told.acceleration, &self.held(told.velocity)) && told.acceleration != [0.0; 3] {
            Some(("another acceleration came in", None))
        } else {
            None
        }
    }

    fn may_go(&self, velocity: [f64; 3]) -> bool {
        match self.velocity {
            // Who never said how fast it goes stands when it was not heard of for a while.
            Some(stated) => same(&velocity, &stated),
            None => norm(&velocity) <= self.most_mps * (1.0 + SAME),
        }
    }

    /// How far a place is from wherever it may be by now.
    pub(super) fn off_m(&self, place: [f64; 3], now_ms: Ms) -> f64 {
        let since = |from_ms: Ms, most_ms: Ms| (now_ms - from_ms).clamp(0, most_ms) as f64 * 1e-3;
        let at = self.sent.position;
        if let Some(velocity) = self.velocity {
            let [least_s, most_s] =
                [self.latest_ms, self.earliest_ms].map(|from_ms| since(from_ms, LONGEST_EXTRAPOLATION_MS));
            let pieces = if self.acceleration == [0.0; 3] { 1 } else { PIECES };
            let points = (0..=pieces).map(|i| least_s + (most_s - least_s) * f64::from(i) / f64::from(pieces));
            let points: Vec<_> = points.map(|t_s| self.along(velocity, t_s)).collect();
            let lines = points.windows(2).map(|line| from_line_m(place, line[0], line[1]));
            return lines.fold(f64::INFINITY, f64::min);
        }
        if now_ms - self.latest_ms > ESTIMATE_LASTS_MS {
            return distance_m(place, at);
        }
        let t_s = since(self.earliest_ms, ESTIMATE_LASTS_MS);
        let reach_m = self.most_mps * t_s;
        if self.at_once || self.acceleration != [0.0; 3] {
            return (distance_m(place, at) - reach_m).max(0.0);
        }
        let way = limited(self.step.map(|x| x / norm(&self.step).max(f64::MIN_POSITIVE)), 1.0);
        let end = std::array::from_fn(|axis| at[axis] + reach_m * way[axis]);
        from_line_m(place, at, end)
    }

    /// Where that leads from its place.
    fn along(&self, velocity: [f64; 3], t_s: f64) -> [f64; 3] {
        let acceleration = self.held(velocity);
        std::array::from_fn(|axis| self.sent.position[axis] + t_s * (velocity[axis] + 0.5 * t_s * acceleration[axis]))
    }

    /// The share of the acceleration that leads from this velocity to no higher speed than was promised, for as long as others extrapolate.
    fn held(&self, velocity: [f64; 3]) -> [f64; 3] {
        let lasts_s = LONGEST_EXTRAPOLATION_MS as f64 * 1e-3;
        let keeps = |share: f64| {
            let at: [f64; 3] = std::array::from_fn(|axis| velocity[axis] + lasts_s * share * self.acceleration[axis]);
            norm(&at) <= self.most_mps
        };
        if keeps(1.0) {
            return self.acceleration;
        }
        let (mut least, mut most) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (least + most);
            *(if keeps(middle) { &mut least } else { &mut most }) = middle;
        }
        self.acceleration.map(|x| least * x)
    }

    /// How it goes on as it said, if it did.
    fn goes_on(&self) -> Option<[f64; 3]> {
        let moves = |velocity: &[f64; 3]| *velocity != [0.0; 3] || self.acceleration != [0.0; 3];
        self.velocity.filter(moves)
    }

    /// What it has passed since, up to where it is now at the furthest, if it goes on as it said; else the place where it said that it is.
    pub(super) fn passes(&self, now_ms: Ms) -> Vec<[f64; 3]> {
        let Some(velocity) = self.goes_on() else {
            return vec![self.sent.position];
        };
        let since_s = (now_ms - self.earliest_ms).clamp(0, LONGEST_EXTRAPOLATION_MS) as f64 * 1e-3;
        let times = (0..=PIECES).map(|i| since_s * f64::from(i) / f64::from(PIECES));
        times.map(|t_s| self.along(velocity, t_s)).collect()
    }

    /// Where it is now if it goes on as it said; none when it never said so, or when it is not known to this time since when it does.
    pub(super) fn comes_to(&self, now_ms: Ms, within_ms: Ms) -> Option<[f64; 3]> {
        let velocity = self
            .goes_on()
            .filter(|_| self.latest_ms - self.earliest_ms <= within_ms)?;
        let since_s = (now_ms - self.latest_ms).clamp(0, LONGEST_EXTRAPOLATION_MS) as f64 * 1e-3;
        Some(self.along(velocity, since_s))
    }

    /// How it stands.
    pub(super) fn pose(&self) -> Pose {
        let length = norm(&self.sent.orientation);
        Pose::resting(
            self.latest_ms,
            self.sent.position,
            self.sent.orientation.map(|x| x / length),
        )
    }
}

fn acceleration(sent: &Sent, promise: Limits) -> [f64; 3] {
    let most = promise.max_acceleration_mps2.unwrap_or(MOST_ACCELERATION_MPS2);
    limited(sent.acceleration.unwrap_or_default(), most)
}

fn norm(vector: &[f64]) -> f64 {
    vector.iter().fold(0.0f64, |sum, x| sum.hypot(*x))
}

/// A vector in the same direction that is no longer than this.
fn limited(vector: [f64; 3], most: f64) -> [f64; 3] {
    let length = norm(&vector);
    let share = if length > most { most / length } else { 1.0 };
    vector.map(|x| x * share)
}

/// Whether these are the same numbers, but for how they were written and divided.
pub(super) fn same<const N: usize>(a: &[f64; N], b: &[f64; N]) -> bool {
    let largest = a.iter().chain(b).fold(1.0f64, |most, x| most.max(x.abs()));
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME * largest)
}

/// How far a place is from a straight line between two others.
fn from_line_m(place: [f64; 3], from: [f64; 3], to: [f64; 3]) -> f64 {
    let way: [f64; 3] = std::array::from_fn(|axis| to[axis] - from[axis]);
    let dot = |vector: [f64; 3]| (0..3).map(|axis| vector[axis] * way[axis]).sum::<f64>();
    let ahead = dot(std::array::from_fn(|axis| place[axis] - from[axis]));
    let share = (ahead / dot(way).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    distance_m(place, std::array::from_fn(|axis| from[axis] + share * way[axis]))
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits {
        max_speed_mps: 2.0,
        max_acceleration_mps2: None,
    };

    fn sent(t_ms: Ms, x: f64, velocity: Option<f64>) -> Sent {
        Sent {
            t_ms: Some(t_ms),
            position: [x, 0.0, 0.0],
            orientation: [0.0, 0.0, 0.0, 2.0],
            velocity: velocity.map(|x| [x, 0.0, 0.0]),
            acceleration: None,
        }
    }

    /// Two poses, the second of which was 30 ms longer on its way.
    fn heard(velocity: Option<f64>) -> Heard {
        let mut heard = Heard::first(&sent(0, 0.0, velocity), LIMITS, 1_000);
        heard.hear(&sent(100, 0.1, velocity), LIMITS, 1_130);
        heard
    }

    fn told(t_ms: Ms, x: f64, velocity: f64) -> Pose {
        Pose {
            velocity: [velocity, 0.0, 0.0],
            ..Pose::resting(t_ms, [x, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])
        }
    }

    #[test]
    fn only_what_came_in_may_be_told() {
        let (stated, guessed) = (heard(Some(1.0)), heard(None));
        let why = |heard: &Heard, told: Pose| heard.belies(&told).map(|(why, _)| why.split(' ').nth(1).unwrap_or(why));
        for t_ms in [1_100, 1_130] {
            assert_eq!(why(&stated, told(t_ms, 0.1, 1.0)), None);
        }
        assert_eq!(why(&guessed, told(1_100, 0.1, 1.7)), None);
        assert_eq!(why(&stated, told(1_090, 0.1, 1.0)), Some("cannot"));
        assert_eq!(why(&stated, told(1_131, 0.1, 1.0)), Some("cannot"));
        assert_eq!(why(&stated, told(1_100, 0.1, 1.1)), Some("velocity"));
        assert_eq!(why(&guessed, told(1_100, 0.1, 2.2)), Some("velocity"));
        let turned = Pose {
            orientation: [0.0, 0.6, 0.0, 0.8],
            ..told(1_100, 0.1, 1.0)
        };
        assert_eq!(why(&stated, turned), Some("orientation"));
        let (why, off_m) = stated.belies(&told(1_100, 1.1, 1.0)).unwrap();
        assert_eq!(why, "another position came in");
        assert!((off_m.unwrap() - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_promise_limits_what_is_stated() {
        let fast = heard(Some(9.0));
        assert_eq!(fast.belies(&told(1_100, 0.1, SLACK * 2.0)), None);
        assert!(fast.belies(&told(1_100, 0.1, 9.0)).is_some());
    }

    #[test]
    fn a_promise_limits_what_an_acceleration_leads_to() {
        let fast = Sent {
            acceleration: Some([0.0, 0.0, 5_000.0]),
            ..sent(0, 0.0, Some(0.0))
        };
        let heard = Heard::first(&fast, LIMITS, 1_000);
        let told = |acceleration| Pose {
            acceleration: [0.0, 0.0, acceleration],
            ..told(1_000, 0.0, 0.0)
        };
        // In two seconds from standing still.
        assert_eq!(heard.belies(&told(SLACK)), None);
        assert!(heard.belies(&told(5_000.0)).is_some() && heard.belies(&told(1.1 * SLACK)).is_some());
        assert!(heard.off_m([0.0, 0.0, 2.0 * SLACK], 60_000) < 1e-6);
        assert!((heard.off_m([0.0, 0.0, 10_000.0], 60_000) - 10_000.0).abs() < 3.0);
    }

    #[test]
    fn a_stated_velocity_leads_somewhere_and_a_guessed_one_straight_on_for_a_while() {
        let (stated, guessed) = (heard(Some(1.0)), heard(None));
        let off = |heard: &Heard, place: [f64; 3], now_ms| (heard.off_m(place, now_ms) * 1e3).round() as i64;
        // A second later it has gone on for 1 s to 1.032 s.
        assert_eq!(off(&stated, [1.1, 0.0, 0.0], 2_130), 0);
        assert_eq!(off(&stated, [1.13, 0.0, 0.0], 2_130), 0);
        assert_eq!(off(&stated, [1.2, 0.0, 0.0], 2_130), 68);
        assert_eq!(off(&stated, [1.0, 0.0, 0.0], 2_130), 100);
        assert_eq!(off(&guessed, [0.1, 0.0, 0.0], 2_130), 0);
        assert_eq!(off(&guessed, [1.5, 0.3, 0.0], 2_130), 300);
        assert_eq!(off(&guessed, [1.1, 0.0, 0.0], 3_000), 1_000, "it stands there again");
    }

    #[test]
    fn who_said_that_it_goes_on_passes_what_lies_before_it_and_all_others_stay() {
        let (stated, guessed) = (heard(Some(1.0)), heard(None));
        let last = |heard: &Heard, now_ms| heard.passes(now_ms).last().unwrap()[0];
        assert!((last(&stated, 2_130) - 1.132).abs() < 1e-9, "for 1.032 s at most");
        assert!((last(&stated, 60_000) - 2.1).abs() < 1e-9, "for two seconds");
        assert_eq!(guessed.passes(2_130), [[0.1, 0.0, 0.0]]);
        assert!((stated.comes_to(2_130, 50).unwrap()[0] - 1.1).abs() < 1e-9);
        assert_eq!(
            stated.comes_to(2_130, 20),
            None,
            "it was under way for 30 ms, or not at all"
        );
        assert_eq!(guessed.comes_to(2_130, 50), None);
    }

    #[test]
    fn poses_that_come_at_once_say_nothing_of_where_it_goes() {
        let mut heard = heard(None);
        heard.hear(&sent(101, 0.11, None), LIMITS, 1_131);
        // 30 ms at 2.1 m/s.
        assert_eq!(heard.off_m([0.11, 0.05, 0.0], 1_131), 0.0);
        assert!(heard.off_m([0.11, 0.1, 0.0], 1_131) > 0.03);
    }
}
