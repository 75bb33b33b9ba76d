//! Did an owner that was told to `hush` hear in time that somebody may see its mover?
//!
//! A promise: as long as the mover keeps to its ball, nobody is to see it, and its owner need not speak. So wherever in the ball a
//! participant plainly sees to a place inside a cell, well inside its area of interest, the owner must be told to `wake`,
//! whether the mover is there or not: nobody but its owner knows. A promise ends with a pose that is answered with no other one, with
//! `wake`, with its time, when nobody listens any more, and with all that was told. What is promised is what the answers and events
//! of the recording say; which volumes the rules keep is not asked.
//!
//! Owners keep to it as well or as badly as they can: a mover that turns up further outside its ball than it comes while that is said is
//! counted as *broken*, which is no mistake of the server's. But no promise may begin or go on with a mover outside its ball.

use std::collections::BTreeMap;

use belvedere_live::{
    Ms,
    cells::{Ball, Cells, distance_m},
    event::SessionId,
    journal::Input,
    world::SLACK,
};
use belvedere_scene::{Bounds, ObjectId};
use serde_json::Value;

use super::{
    account::{Account, Person},
    judge::{Finding, Judge, PLAIN_M, TICKS_TO_TELL, finding},
    mover::Mover,
    poses::{ROUNDING, Untrue},
    sights::Sights,
};

/// Of each cell a place so far on the way from the ball's middle to the cell's is looked at, from where it is nearest, …
const INWARDS: f64 = 0.1;
/// … and six on the ball's axes, at this share of its radius.
const OUTWARDS: f64 = 0.7;

/// What an owner may rely on.
#[derive(Debug, Clone)]
pub(super) struct Promise {
    ball: Ball,
    /// Since when, and until when at least, in the server's clock.
    since_ms: Ms,
    until_ms: Ms,
    /// Places of the ball that are looked for: inside cells.
    places: Vec<[f64; 3]>,
    /// Somebody saw into it, and that was told as a miss.
    missed: bool,
}

impl Promise {
    fn new(ball: Ball, cells: &Cells, (since_ms, until_ms): (Ms, Ms)) -> Self {
        Self {
            ball,
            since_ms,
            until_ms,
            places: places(&ball, cells),
            missed: false,
        }
    }
}

/// Some of the places inside both a ball and a cell: by each cell that it touches, and about its middle.
fn places(ball: &Ball, cells: &Cells) -> Vec<[f64; 3]> {
    let around = (0..6).map(|i| {
        let mut place = ball.center;
        place[i / 2] += [OUTWARDS, -OUTWARDS][i % 2] * ball.radius_m;
        place
    });
    let touched = cells.under(ball);
    let bounds = touched
        .iter()
        .filter_map(|cell| cells.cell(*cell))
        .map(|cell| cell.bounds);
    let in_cells = bounds.flat_map(|bounds| {
        let middle: [f64; 3] = std::array::from_fn(|axis| 0.5 * (bounds.min[axis] + bounds.max[axis]));
        let nearest: [f64; 3] = std::array::from_fn(|axis| ball.center[axis].clamp(bounds.min[axis], bounds.max[axis]));
        let inside = std::array::from_fn(|axis| nearest[axis] + INWARDS * (middle[axis] - nearest[axis]));
        [inside, middle]
    });
    let all = [ball.center].into_iter().chain(around).chain(in_cells);
    let inside = |place: &[f64; 3]| ball.holds(*place) && cells.at(*place).is_some_and(|at| at.distance_m == 0.0);
    all.filter(inside).collect()
}

/// How many promises there were.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Promises {
    /// That began.
    pub(super) begun: u64,
    /// That their owners broke.
    pub(super) broken: u64,
}

impl Account {
    /// What somebody was answered, and promised by that. What was refused has changed nothing.
    pub(super) fn answered(&mut self, input: &Input, answer: &Value, now_ms: Ms) -> Option<Untrue> {
        let object = match input {
            Input::Open { object, .. } | Input::Create { object, .. } | Input::Move { object, .. } => *object,
            Input::Pose { session, .. } => self.people.get(session)?.avatar,
            _ => return None,
        };
        let moved = answer.get("moved").or_else(|| answer.get("seen")?.get("moved"))?;
        if let Some(mover) = self.movers.get(&object)
            && let Some(promise) = mover.promise.as_ref().filter(|promise| now_ms < promise.until_ms)
        {
            let comes_m = SLACK * mover.reach_in_m(self.rules.round_trip_ms + 2 * self.rules.tick_ms);
            let outside_m = distance_m(mover.position(now_ms), promise.ball.center) - promise.ball.radius_m;
            self.promises.broken += u64::from(outside_m > comes_m);
        }
        if moved["hush"].is_null() {
            self.movers.get_mut(&object)?.promise = None;
            return None;
        }
        self.promise(object, &moved["hush"], now_ms)
    }

    /// The owner of a mover is promised something; says whether that cannot hold.
    pub(super) fn promise(&mut self, object: ObjectId, hush: &Value, now_ms: Ms) -> Option<Untrue> {
        let mover = self.movers.get_mut(&object)?;
        let number = |value: &Value| value.as_f64();
        let tbv = &hush["tbv"];
        let center: Option<Vec<f64>> = tbv["center"].as_array()?.iter().map(number).collect();
        let ball = Ball {
            center: center?.try_into().ok()?,
            radius_m: number(&tbv["radius_m"])?,
        };
        let until_ms = mover.ours_ms(hush["until_ms"].as_i64()?);
        match &mut mover.promise {
            Some(promise) if promise.ball == ball => promise.until_ms = until_ms,
            promise => {
                *promise = Some(Promise::new(ball, &self.cells, (now_ms, until_ms)));
                self.promises.begun += 1;
            }
        }
        let off_m = mover.off_at_least_m(ball.center, now_ms) - ball.radius_m;
        let session = mover.owner.filter(|_| off_m > ROUNDING * (1.0 + ball.radius_m))?;
        Some(Untrue {
            at_ms: now_ms,
            session,
            object,
            event: Some("hush"),
            off_m: Some(off_m),
            why: "the mover is outside the volume that it is to keep to",
        })
    }

    /// What a session was promised is void.
    pub(super) fn end_promises_to(&mut self, session: SessionId) {
        let driven = self.movers.values_mut().filter(|mover| mover.owner == Some(session));
        driven.for_each(|mover| mover.promise = None);
    }

    /// The owner to be woken, and what it relies on, if it hears of it and could not have moved on by itself.
    fn relies(&self, mover: &Mover, now_ms: Ms) -> bool {
        let owner = mover.owner.and_then(|owner| self.people.get(&owner));
        let holds = |promise: &Promise| !promise.missed && now_ms + self.woken_within_ms() < promise.until_ms;
        mover.promise.as_ref().is_some_and(holds)
            && mover.reach_in_m(1_000) > 0.0
            && owner.is_some_and(|owner| owner.listens)
    }

    /// For so long at most somebody sees into a ball and its owner is not told.
    fn woken_within_ms(&self) -> Ms {
        TICKS_TO_TELL * self.rules.tick_ms + self.rules.round_trip_ms
    }

    /// A place in the ball of a mover that a participant plainly sees.
    fn sees_into(
        &self,
        sights: &Sights,
        (session, person): (SessionId, &Person),
        mover: &Mover,
        now_ms: Ms,
    ) -> Option<[f64; 3]> {
        let promise = mover.promise.as_ref().filter(|_| self.relies(mover, now_ms))?;
        let avatar = self.movers.get(&person.avatar)?;
        let margin_m = avatar.ball(now_ms, self.rules.tick_ms).radius_m;
        let within_m = person.aoi.enter_m - margin_m;
        if mover.owner == Some(session)
            || !person.hears()
            || distance_m(avatar.position(now_ms), promise.ball.center) > within_m + promise.ball.radius_m
        {
            return None;
        }
        let closed: Vec<Bounds> = self.closed().map(|(_, door)| door.bounds).collect();
        let stands = avatar.stands(now_ms, self.known_within_ms());
        let eyes: Vec<_> = stands.into_iter().filter(|eye| self.is_in_a_cell(*eye)).collect();
        let size_m = PLAIN_M.min(0.5 * mover.radius_m);
        let sees = |place: &[f64; 3]| {
            let mut near = eyes.iter().filter(|eye| distance_m(**eye, *place) < within_m);
            near.any(|eye| sights.in_plain_view(*eye, *place, size_m, &closed))
        };
        promise.places.iter().copied().find(sees)
    }
}

impl Judge {
    /// Looks who sees into the balls of movers whose owners are not told: anew in some ticks, and in each at those of whom that is known.
    pub(super) fn look_at_promises(&mut self, account: &mut Account, sights: &Sights, now_ms: Ms, looks: bool) {
        if looks {
            for (object, mover) in account.movers.iter().filter(|(_, mover)| account.relies(mover, now_ms)) {
                for (session, person) in &account.people {
                    if account.sees_into(sights, (*session, person), mover, now_ms).is_some() {
                        self.unwoken.entry((*session, *object)).or_insert(now_ms);
                    }
                }
            }
        }
        let mut still = BTreeMap::new();
        for ((session, object), since_ms) in std::mem::take(&mut self.unwoken) {
            let (Some(person), Some(mover)) = (account.people.get(&session), account.movers.get(&object)) else {
                continue;
            };
            // What is promised anew has its own time.
            let since_ms = since_ms.max(mover.promise.as_ref().map_or(now_ms, |promise| promise.since_ms));
            let Some(place) = account.sees_into(sights, (session, person), mover, now_ms) else {
                continue;
            };
            if now_ms - since_ms <= account.woken_within_ms() {
                still.insert((session, object), since_ms);
                continue;
            }
            self.misses
                .extend(finding(account, session, object, now_ms).map(|found| Finding {
                    position: place,
                    why: Some("its owner was told to hush, and not to wake, though it may be there"),
                    ..found
                }));
            // Once for each promise.
            if let Some(promise) = account.movers.get_mut(&object).and_then(|mover| mover.promise.as_mut()) {
                promise.missed = true;
            }
        }
        self.unwoken = still;
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::{
        super::hall::{FIRST, Hall, sent},
        *,
    };

    const WATCHER: SessionId = SessionId(0);
    const OWNER: SessionId = SessionId(1);
    const MINE: ObjectId = ObjectId(FIRST + 1);

    /// Somebody stands at each end, of whom one looks so far, and the other was told to be silent there for a minute.
    fn hushed(aoi_m: f64) -> Hall {
        let mut hall = Hall::empty();
        hall.enter(WATCHER, 1.0, aoi_m, true);
        hall.enter(OWNER, 19.0, aoi_m, false);
        // Whoever is shown is no miss of another kind.
        hall.account.tell(&json!(["s0", "object-info", {"object": MINE}]), 0);
        assert_eq!(hall.tell(&json!(["s1", "hush", hush(19.0)])), 0);
        hall
    }

    impl Hall {
        /// Says how much is wrong with it at once.
        fn tell(&mut self, told: &Value) -> usize {
            self.account.tell(told, self.now_ms).len()
        }

        /// The owner says where it is, and is answered.
        fn pose(&mut self, x: f64, hush: Value) -> Option<Untrue> {
            let (session, sent) = (OWNER, sent(x));
            let input = Input::Pose { session, sent };
            self.hear(&input);
            let answer = json!({"seen": {"moved": {"hush": hush}}});
            self.account.answered(&input, &answer, self.now_ms)
        }

        fn misses(&mut self, ticks: usize) -> &[Finding] {
            self.ticks(ticks);
            &self.judge.misses
        }
    }

    /// A ball of 4 m, for a minute.
    fn hush(x: f64) -> Value {
        json!({"object": MINE, "tbv": {"center": [x, 1.0, 1.0], "radius_m": 4.0}, "until_ms": 60_000})
    }

    #[test]
    fn an_owner_is_missed_once_that_is_not_woken_in_time_though_somebody_sees_where_it_may_be() {
        let mut hall = hushed(19.0);
        assert_eq!(hall.misses(6), [], "there are three ticks and a round trip for it");
        let [missed] = hall.misses(20) else {
            panic!("{:?}", hall.judge.misses)
        };
        assert_eq!((missed.session, missed.object), (WATCHER, MINE));
        assert!(missed.why.is_some_and(|why| why.contains("hush")), "{missed:?}");
        assert!(missed.position[0] < 18.0, "it stands beyond what the other looks at");
        assert_eq!(hall.account.promises, Promises { begun: 1, broken: 0 });
    }

    #[test]
    fn who_was_woken_or_relies_on_nothing_is_not_missed() {
        let ends: [fn(&mut Hall); 6] = [
            |hall| assert_eq!(hall.tell(&json!(["s1", "wake", {"object": MINE}])), 0),
            |hall| assert_eq!(hall.tell(&json!(["s1", "resync", {"reason": "missed"}])), 0),
            |hall| assert_eq!(hall.pose(19.0, Value::Null), None),
            |hall| {
                let (session, listens) = (OWNER, false);
                hall.hear(&Input::Listens { session, listens });
            },
            |hall| hall.hear(&Input::Close { session: OWNER }),
            |hall| hall.now_ms = 60_000,
        ];
        for (number, end) in ends.into_iter().enumerate() {
            let mut hall = hushed(19.0);
            hall.misses(4);
            end(&mut hall);
            assert!(hall.misses(20).iter().all(|missed| missed.why.is_none()), "{number}");
        }
        assert_eq!(hushed(10.0).misses(20), [], "nobody looks so far");
    }

    #[test]
    fn who_leaves_its_ball_is_promised_no_more_by_it() {
        let mut hall = hushed(10.0);
        assert_eq!(hall.pose(18.0, hush(19.0)), None);
        let untrue = hall.pose(14.0, hush(19.0)).expect("it has gone out of it");
        assert!(
            untrue.off_m.is_some_and(|off_m| (off_m - 1.0).abs() < 1e-9),
            "{untrue:?}"
        );
        assert_eq!(untrue.session, OWNER);
        assert_eq!(hall.account.promises.broken, 1, "it comes 0.5 m in time to say so");
        assert_eq!(hall.pose(14.0, hush(14.0)), None);
        assert_eq!(hall.account.promises.begun, 2);
    }
}
