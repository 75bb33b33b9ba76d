//! What must hold whatever participants do: an oracle that knows only the geometry looks on at every tick.

use std::collections::BTreeMap;

use crate::plan::{SPEED_MPS, Stage};
use belvedere_live::{
    cells::distance_m,
    event::{Event, SessionId},
    journal::replay::Replay,
    pace,
};
use proptest::prelude::*;

const CELLS: u32 = 12;

/// What somebody does for a tick.
#[derive(Debug, Clone, Copy)]
enum Step {
    Walk { who: usize, by_m: f64 },
    Jump { who: usize, to: f64 },
    Look { who: usize, enter_m: f64 },
    Resync { who: usize },
    Ears { who: usize, listens: bool },
    Gate { border: u32, open: bool },
    Nothing,
}

fn steps() -> impl Strategy<Value = Vec<Step>> {
    let who = 0..5usize;
    let step = prop_oneof![
        8 => (who.clone(), -0.2..0.2f64).prop_map(|(who, by_m)| Step::Walk { who, by_m }),
        1 => (who.clone(), 0.0..f64::from(CELLS)).prop_map(|(who, to)| Step::Jump { who, to }),
        1 => (who.clone(), 0.5..8.0f64).prop_map(|(who, enter_m)| Step::Look { who, enter_m }),
        1 => who.clone().prop_map(|who| Step::Resync { who }),
        1 => (who, any::<bool>()).prop_map(|(who, listens)| Step::Ears { who, listens }),
        2 => (1..CELLS, any::<bool>()).prop_map(|(border, open)| Step::Gate { border, open }),
        2 => Just(Step::Nothing),
    ];
    prop::collection::vec(step, 1..150)
}

/// Numbers of all sizes, with either sign.
fn magnitude(most: f64) -> impl Strategy<Value = f64> {
    (0.0..=most.log10(), any::<bool>()).prop_map(|(tens, minus)| 10f64.powf(tens) * if minus { -0.99 } else { 0.99 })
}

/// Five participants who speak whenever they must: not while they are hushed, and at once when they are woken.
struct Play {
    stage: Stage,
    people: Vec<SessionId>,
    /// Where they are, whether they have said so or not.
    x: Vec<f64>,
    hushed_until: BTreeMap<SessionId, (f64, f64, i64)>,
    enter_m: Vec<f64>,
    /// Whether they hear what they are told.
    listens: Vec<bool>,
}

impl Play {
    fn new() -> Self {
        let mut stage = Stage::row(CELLS, 1);
        let x: Vec<_> = (0..5).map(|i| 1.0 + 2.0 * f64::from(i)).collect();
        let people = x.iter().map(|x| stage.enter(*x)).collect();
        Self {
            stage,
            people,
            hushed_until: BTreeMap::new(),
            enter_m: vec![100.0; x.len()],
            listens: vec![true; x.len()],
            x,
        }
    }

    fn act(&mut self, step: Step) {
        match step {
            Step::Walk { who, by_m } => {
                // Within the promised speed.
                self.x[who] = (self.x[who] + by_m).clamp(0.0, f64::from(CELLS));
            }
            Step::Jump { who, to } => {
                self.x[who] = to;
                // A teleport breaks every promise, so it is told.
                self.hushed_until.remove(&self.people[who]);
            }
            Step::Look { who, enter_m } => {
                self.stage.set_aoi(self.people[who], enter_m, 1.2 * enter_m);
                self.enter_m[who] = enter_m;
            }
            Step::Resync { who } => self.stage.resync(self.people[who]),
            Step::Ears { who, listens } if listens != self.listens[who] => {
                self.stage.ears(self.people[who], listens);
                self.listens[who] = listens;
                // A promise that counted on being woken is void, which it knows.
                self.hushed_until.remove(&self.people[who]);
            }
            Step::Ears { .. } => {}
            Step::Gate { border, open } => self.stage.gate(border, open),
            Step::Nothing => {}
        }
        self.speak();
        self.stage.tick();
        // Who was woken by somebody's look or by the tick answers, and everybody hears of it in the next tick.
        self.speak();
        self.stage.tick();
    }

    fn speak(&mut self) {
        for (who, session) in self.people.clone().into_iter().enumerate() {
            let mut promised = self.hushed_until.get(&session).copied();
            for event in self.stage.unread(session) {
                match event {
                    Event::Wake { .. } => promised = None,
                    Event::Hush(hush) => promised = Some((hush.tbv.center[0], hush.tbv.radius_m, hush.until_ms)),
                    _ => {}
                }
            }
            let now_ms = self.stage.now_ms;
            let silent = promised.is_some_and(|(at, radius_m, until_ms)| {
                now_ms + 100 < until_ms && (self.x[who] - at).abs() <= radius_m
            });
            if silent {
                self.hushed_until.extend(promised.map(|p| (session, p)));
                continue;
            }
            match self.stage.pose(session, self.x[who]) {
                Some(hush) => {
                    let promise = (hush.tbv.center[0], hush.tbv.radius_m, hush.until_ms);
                    self.hushed_until.insert(session, promise);
                }
                None => {
                    self.hushed_until.remove(&session);
                }
            }
        }
        // A look may have woken somebody who had been asked already.
        for (who, session) in self.people.clone().into_iter().enumerate() {
            let woken = self
                .stage
                .unread(session)
                .iter()
                .any(|event| matches!(event, Event::Wake { .. }));
            if woken {
                self.hushed_until.remove(&session);
                let hush = self.stage.pose(session, self.x[who]);
                let promise = hush.map(|hush| (hush.tbv.center[0], hush.tbv.radius_m, hush.until_ms));
                self.hushed_until.extend(promise.map(|p| (session, p)));
            }
        }
    }

    fn check(&self) -> Result<(), TestCaseError> {
        for (a, session) in self.people.iter().enumerate() {
            let belief = &self.stage.beliefs[session];
            // Sessions stand where they last said.
            let eye = self.stage.x(*session);
            for (b, other) in self.people.iter().enumerate().filter(|(b, _)| *b != a) {
                let object = self.stage.avatar(*other);
                let (there, away_m) = (self.x[b], (eye - self.x[b]).abs());
                let shown = belief.shown.get(&object);
                let must = self.listens[a] && self.stage.sees(eye, there, 0.0) && away_m < self.enter_m[a] - 0.3;
                // A round trip and a tick on both sides.
                let may = self.listens[a] && self.stage.sees(eye, there, 1.2);
                prop_assert!(
                    shown.is_some() || !must,
                    "{session} at {eye} misses {object} at {there}"
                );
                prop_assert!(
                    shown.is_none() || may,
                    "{session} at {eye} hears of {object} at {there}"
                );
                if let Some(pose) = shown {
                    let believed = pose.position_at(self.stage.now_ms);
                    let wrong_m = distance_m(believed, [there, 0.5, 0.5]);
                    // What does not show, and what one has moved since.
                    let least = pace::tolerance_m(away_m) + 2.0 * 0.2 + SPEED_MPS * 0.2;
                    prop_assert!(
                        wrong_m <= least,
                        "{object} is believed {wrong_m} m away from where it is"
                    );
                }
            }
        }
        Ok(())
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, ..ProptestConfig::default() })]

    #[test]
    fn everybody_hears_of_what_they_can_see_and_of_nothing_else(steps in steps()) {
        let mut play = Play::new();
        for step in steps {
            play.act(step);
            play.check()?;
        }
    }

    #[test]
    fn a_snapshot_is_what_all_changes_before_it_add_up_to(steps in steps()) {
        let mut play = Play::new();
        for step in steps {
            play.act(step);
        }
        for session in play.people.clone() {
            let before = play.stage.beliefs[&session].clone();
            play.stage.resync(session);
            let after = &play.stage.beliefs[&session];
            prop_assert_eq!(before.shown.keys().collect::<Vec<_>>(), after.shown.keys().collect::<Vec<_>>());
            for (object, pose) in &before.shown {
                let now_ms = play.stage.now_ms;
                let apart_m = distance_m(pose.position_at(now_ms), after.shown[object].position_at(now_ms));
                prop_assert!(apart_m <= pace::tolerance_m(f64::from(CELLS)) + 1e-9, "{object}: {apart_m} m");
            }
        }
    }

    #[test]
    fn a_journal_is_lived_through_again_to_the_last_byte(steps in steps()) {
        let mut play = Play::new();
        steps.into_iter().for_each(|step| play.act(step));
        let mut replay = Replay::default();
        for (input, output) in play.stage.journal() {
            prop_assert_eq!(replay.take(&input).unwrap().output, output, "{}", input);
        }
    }

    #[test]
    fn whoever_stands_in_view_is_never_told_to_have_left_whatever_it_states(
        stated in prop::collection::vec((magnitude(1e9), magnitude(1e9)), 1..12),
    ) {
        let mut stage = Stage::hall(CELLS);
        let (eye, other) = (stage.enter(1.0), stage.enter(6.0));
        stage.set_aoi(eye, 12.0, 14.0);
        stage.tick();
        let object = stage.avatar(other);
        for (velocity, acceleration) in stated {
            stage.state(other, [velocity, 0.0, 0.0], [acceleration, 0.0, -acceleration]);
            stage.tick();
            prop_assert!(stage.beliefs[&eye].shown.contains_key(&object));
        }
        // Nor when it says nothing more.
        for _ in 0..30 {
            stage.tick();
            prop_assert!(stage.beliefs[&eye].shown.contains_key(&object));
        }
    }

    #[test]
    fn whoever_sees_where_a_silent_mover_was_heard_of_last_is_told_of_it(
        from in 0.0..f64::from(CELLS),
        strides in prop::collection::vec(-1.0..1.0f64, 1..8),
        states_mps in prop::option::of(-10.0..10.0f64),
        watching in prop::collection::vec(0.0..f64::from(CELLS), 1..5),
        coming in prop::collection::vec((0..45usize, 0.0..f64::from(CELLS)), 0..4),
    ) {
        // Rooms without doors: an extrapolation leads through walls.
        let mut stage = Stage::row(CELLS, 0);
        let mut eyes: Vec<_> = watching.iter().map(|x| (stage.enter(*x), *x)).collect();
        let (mover, mut x) = (stage.mover(from, 10.0, None), from);
        stage.tick();
        for by_m in strides {
            x = (x + by_m).clamp(0.0, f64::from(CELLS));
            stage.drive(mover, x, states_mps);
            stage.tick();
        }
        for ticks in 0..45 {
            let now = coming.iter().filter(|(at, _)| *at == ticks);
            eyes.extend(now.map(|(_, x)| (stage.enter(*x), *x)).collect::<Vec<_>>());
            stage.tick();
            for (session, eye) in &eyes {
                let told = stage.beliefs[session].shown.get(&mover);
                prop_assert!(
                    told.is_some() || !stage.sees(*eye, x, 0.0),
                    "{session} at {eye} misses what was at {x} when it spoke last, {ticks} ticks ago"
                );
                // What was no more than an estimate has ended, but for what does not show.
                let stands = ticks > 12 && states_mps.is_none();
                let off_m = told.map_or(0.0, |pose| (pose.position_at(stage.now_ms)[0] - x).abs());
                prop_assert!(!stands || off_m <= pace::tolerance_m((eye - x).abs()), "{off_m} m off");
            }
        }
    }

    #[test]
    fn whoever_sees_where_a_silent_participant_was_heard_of_last_is_told_of_it(
        from in 0.0..f64::from(CELLS),
        strides in prop::collection::vec(-0.2..0.2f64, 1..20),
        watching in prop::collection::vec(0.0..f64::from(CELLS), 1..5),
        coming in prop::collection::vec((0..45usize, 0.0..f64::from(CELLS)), 0..4),
    ) {
        let mut stage = Stage::row(CELLS, 0);
        let mut eyes: Vec<_> = watching.iter().map(|x| (stage.enter(*x), *x, 0)).collect();
        let (walker, mut x) = (stage.enter(from), from);
        let avatar = stage.avatar(walker);
        stage.tick();
        for by_m in strides {
            x = (x + by_m).clamp(0.0, f64::from(CELLS));
            stage.pose(walker, x);
            stage.tick();
        }
        for ticks in 0..45 {
            let now = coming.iter().filter(|(at, _)| *at == ticks);
            eyes.extend(now.map(|(_, x)| (stage.enter(*x), *x, ticks)).collect::<Vec<_>>());
            stage.tick();
            for (session, eye, since) in &eyes {
                let told = stage.beliefs[session].shown.contains_key(&avatar);
                // It is given a round trip to answer to being woken, and does not.
                let due = *since == 0 || ticks - since > 3;
                prop_assert!(
                    told || !due || !stage.sees(*eye, x, 0.0),
                    "{session} at {eye} misses what was at {x} when it spoke last, {ticks} ticks ago"
                );
            }
        }
    }

    #[test]
    fn the_same_inputs_give_the_same_events(steps in steps()) {
        let told = || {
            let mut play = Play::new();
            steps.iter().for_each(|step| play.act(*step));
            play.people.iter().map(|session| play.stage.all(*session)).collect::<Vec<_>>()
        };
        prop_assert_eq!(told(), told());
    }
}
