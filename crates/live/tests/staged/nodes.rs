//! Two nodes with one scene, joined by a bus that loses, repeats and reorders: does everybody hear what they would on one?

use std::collections::{BTreeMap, BTreeSet};

use crate::plan::{SPEED_MPS, Stage};
use belvedere_live::{
    Ms,
    cells::distance_m,
    event::{Event, Gone, SessionId},
    nodes::{
        Exchange, LEASE_MS,
        message::{Letter, Said, Says, To},
    },
    pace,
    world::Sent,
};
use belvedere_scene::{Bounds, ObjectId};
use proptest::prelude::*;

const CELLS: u32 = 12;
const ROUND_MS: Ms = 25;

/// How a bus treats messages.
#[derive(Debug, Clone, Copy)]
struct Weather {
    lost_percent: u64,
    twice_percent: u64,
    longest_ms: Ms,
}

const CALM: Weather = Weather {
    lost_percent: 0,
    twice_percent: 0,
    longest_ms: 0,
};

struct Node {
    stage: Stage,
    exchange: Exchange,
    /// What is under way to it, and until when.
    under_way: Vec<(Ms, Said)>,
}

impl Node {
    fn new(name: &str, first: u32) -> Self {
        let stage = Stage::row(CELLS, 1).numbered_from(first);
        let mut exchange = Exchange::new(name.parse().expect("a name"), stage.now_ms);
        exchange.set_connected(true, stage.now_ms);
        Self {
            stage,
            exchange,
            under_way: Vec::new(),
        }
    }

    fn hears(&self, to: &To) -> bool {
        match to {
            To::All => true,
            To::Node(node) => *node == *self.exchange.id(),
            To::Cell(cell) => self.exchange.subscribed().contains(cell),
        }
    }
}

/// Nodes, and a bus between them.
struct House {
    nodes: Vec<Node>,
    weather: Weather,
    dice: u64,
    said: Vec<Letter>,
}

impl House {
    fn new(dice: u64) -> Self {
        Self {
            nodes: vec![Node::new("a", 0), Node::new("b", 1_000)],
            weather: CALM,
            dice,
            said: Vec::new(),
        }
    }

    fn roll(&mut self, below: u64) -> u64 {
        self.dice = self.dice.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (self.dice >> 33) % below
    }

    fn now_ms(&self) -> Ms {
        self.nodes[0].stage.now_ms
    }

    /// A tick of both nodes, with the rounds before it.
    fn tick(&mut self) {
        for _ in 0..100 / ROUND_MS {
            self.nodes.iter_mut().for_each(|node| node.stage.now_ms += ROUND_MS);
            for from in 0..self.nodes.len() {
                let node = &mut self.nodes[from];
                let letters = node.exchange.round(&mut node.stage.world, node.stage.now_ms);
                node.stage.listen();
                letters.into_iter().for_each(|letter| self.post(from, letter));
            }
            self.deliver();
        }
        self.nodes.iter_mut().for_each(|node| node.stage.tick_now());
    }

    fn post(&mut self, from: usize, letter: Letter) {
        for to in (0..self.nodes.len()).filter(|to| *to != from) {
            if !self.nodes[to].hears(&letter.to) {
                continue;
            }
            let copies = 1 + u64::from(self.roll(100) < self.weather.twice_percent);
            for _ in 0..copies {
                if self.roll(100) >= self.weather.lost_percent {
                    let late_ms = self.roll(1 + self.weather.longest_ms as u64) as Ms;
                    let at_ms = self.now_ms() + late_ms;
                    self.nodes[to].under_way.push((at_ms, letter.said.clone()));
                }
            }
        }
        self.said.push(letter);
    }

    fn deliver(&mut self) {
        for node in &mut self.nodes {
            let now_ms = node.stage.now_ms;
            let there: Vec<_> = node.under_way.extract_if(.., |(at_ms, _)| *at_ms <= now_ms).collect();
            for (_, said) in there {
                node.exchange.take(said, &mut node.stage.world, now_ms);
                node.stage.listen();
            }
        }
    }

    fn silence(&mut self, ms: Ms) {
        (0..ms / 100).for_each(|_| self.tick());
    }

    /// What was said since the last call.
    fn overheard(&mut self) -> Vec<Letter> {
        std::mem::take(&mut self.said)
    }

    fn gate(&mut self, node: usize, border: u32, open: bool) {
        let Node { stage, exchange, .. } = &mut self.nodes[node];
        stage.gate(border, open);
        let at = Bounds::around([[f64::from(border), 0.5, 0.5]]);
        exchange.set_door(ObjectId(1_000 + border), &at, open);
        // Geometry is the same everywhere, whether or not a node has heard of the door yet.
        self.nodes
            .iter_mut()
            .for_each(|node| node.stage.know_gate(border, open));
    }
}

fn is_beat(letter: &Letter) -> bool {
    matches!(letter.said.says, Says::Beat(_) | Says::Watch(_))
}

#[test]
fn who_comes_into_view_on_another_node_is_told_of_within_a_tick_and_who_is_hidden_costs_nothing() {
    let mut house = House::new(1);
    let a = house.nodes[0].stage.enter(0.5);
    house.silence(500);
    let b = house.nodes[1].stage.enter(1.5);
    house.tick();
    assert_eq!(house.nodes[0].stage.heard(a, "wake").len(), 1);
    house.nodes[0].stage.stand(a);
    house.tick();
    let (avatar_a, avatar_b) = (house.nodes[0].stage.avatar(a), house.nodes[1].stage.avatar(b));
    assert_eq!(house.nodes[0].stage.seen_by(a), [avatar_b]);
    assert_eq!(house.nodes[1].stage.seen_by(b), [avatar_a]);

    let hush = house.nodes[1].stage.pose(b, 9.5);
    house.tick();
    assert_eq!(house.nodes[0].stage.last_gone(a), Some((avatar_b, Gone::Hidden)));
    let hush = hush
        .or_else(|| house.nodes[1].stage.stand(b))
        .expect("nobody on any node sees it");
    assert!(hush.tbv.holds([9.5, 0.5, 0.5]));
    house.silence(500);
    house.overheard();
    for _ in 0..50 {
        house.nodes[1].stage.stand(b);
        house.tick();
    }
    assert!(house.overheard().iter().all(is_beat), "a hidden mover is talked of");

    let infos = house.nodes[0].stage.count(a, "object-info");
    house.nodes[0].stage.pose(a, 8.5);
    house.tick();
    assert_eq!(house.nodes[1].stage.heard(b, "wake").len(), 1);
    house.nodes[1].stage.stand(b);
    house.tick();
    assert_eq!(house.nodes[0].stage.seen_by(a), [avatar_b]);
    assert_eq!(house.nodes[0].stage.count(a, "object-info"), infos, "its info was kept");
}

#[test]
fn a_node_that_dies_takes_its_movers_along_and_one_that_says_bye_does_so_at_once() {
    let mut house = House::new(2);
    let a = house.nodes[0].stage.enter(0.5);
    let b = house.nodes[1].stage.enter(1.5);
    let avatar = house.nodes[1].stage.avatar(b);
    house.silence(500);
    assert_eq!(house.nodes[0].stage.seen_by(a), [avatar]);
    house.weather.lost_percent = 100;
    house.silence(LEASE_MS - 1_000);
    assert_eq!(house.nodes[0].stage.seen_by(a), [avatar], "it may be back yet");
    house.silence(1_500);
    assert_eq!(house.nodes[0].stage.last_gone(a), Some((avatar, Gone::Left)));
    assert!(house.nodes[0].stage.stand(a).is_some(), "nobody sees a any more");

    house.weather = CALM;
    house.silence(2_000);
    house.nodes[0].stage.stand(a);
    house.silence(1_200);
    assert_eq!(house.nodes[0].stage.seen_by(a), [avatar], "all is as it was");
    let bye = house.nodes[1].exchange.bye();
    house.nodes[1].exchange.set_connected(false, 0);
    house.post(1, bye);
    house.tick();
    house.tick();
    assert_eq!(house.nodes[0].stage.last_gone(a), Some((avatar, Gone::Left)));
}

#[test]
fn of_two_words_about_a_door_both_nodes_believe_the_same_one() {
    let mut house = House::new(3);
    let a = house.nodes[0].stage.enter(0.4);
    let b = house.nodes[1].stage.enter(1.6);
    house.silence(500);
    house.gate(0, 1, false);
    house.silence(500);
    assert!(house.nodes[1].stage.seen_by(b).is_empty() && house.nodes[0].stage.seen_by(a).is_empty());
    house.gate(0, 1, true);
    house.gate(1, 1, false);
    house.silence(500);
    let closed: Vec<_> = house.nodes.iter().map(|node| node.stage.world.closed()).collect();
    assert_eq!(closed[0], closed[1]);
    // Somebody comes later, and hears of it with the first beat.
    house.nodes.push(Node::new("c", 2_000));
    house.nodes[2].stage.now_ms = house.now_ms();
    house.nodes[2].stage.enter(2.5);
    house.silence(500);
    assert_eq!(house.nodes[2].stage.world.closed(), closed[0]);
}

#[test]
fn a_mover_that_outlives_nodes_has_one_home_and_another_when_that_is_gone() {
    let mut house = House::new(4);
    let robot = house.nodes[0].stage.park(1.5);
    let now_ms = house.now_ms();
    house.nodes[0].exchange.keep(robot, now_ms);
    let b = house.nodes[1].stage.enter(1.5);
    house.silence(2_500);
    assert_eq!(house.nodes[1].stage.seen_by(b), [robot]);
    assert!(house.nodes[1].exchange.is_kept(robot));
    let now_ms = house.now_ms();
    let charge: Vec<_> = house
        .nodes
        .iter_mut()
        .map(|node| node.exchange.takes_charge(now_ms))
        .collect();
    assert_eq!(charge, [true, false], "the one that has been there longest");

    house.weather.lost_percent = 100;
    house.silence(LEASE_MS + 2_500);
    let now_ms = house.now_ms();
    assert!(house.nodes[1].exchange.takes_charge(now_ms) && !house.nodes[1].exchange.is_kept(robot));
    house.nodes[1].exchange.keep(robot, now_ms);
    house.weather = CALM;
    house.silence(2_500);
    assert_eq!(
        house.nodes[0].exchange.yielded(),
        BTreeSet::from([robot]),
        "the last one keeps it"
    );
    assert_eq!(house.nodes[1].exchange.yielded(), BTreeSet::new());
    // Somebody asks the first one to move it.
    let now_ms = house.now_ms();
    house.nodes[0].exchange.keep(robot, now_ms);
    house.silence(500);
    assert_eq!(house.nodes[1].exchange.yielded(), BTreeSet::from([robot]));
}

#[test]
fn who_is_taken_up_is_not_moved_by_what_its_last_node_still_says() {
    let mut house = House::new(5);
    let guest = house.nodes[0].stage.park(1.5);
    let b = house.nodes[1].stage.enter(1.5);
    house.silence(500);
    assert_eq!(house.nodes[1].stage.seen_by(b), [guest]);
    let now_ms = house.now_ms();
    let exported = house.nodes[0].stage.world.exported(now_ms).next();
    let as_told = exported.expect("it is seen over there").introduction();
    let Node { stage, exchange, .. } = &mut house.nodes[1];
    stage.world.withdraw(guest, Gone::Hidden, now_ms);
    exchange.adopt(guest);
    stage
        .world
        .create(guest, None, as_told.clone(), now_ms)
        .expect("a place");
    let mut moved = Sent {
        t_ms: None,
        ..as_told.pose
    };
    moved.position[0] = 1.9;
    let last_node = &mut house.nodes[0].stage.world;
    last_node.move_to(guest, moved, now_ms).expect("it moves there");
    house.silence(500);
    let pose = house.nodes[1].stage.beliefs[&b].shown[&guest];
    assert_eq!(pose.position, as_told.pose.position);
    let now_ms = house.now_ms();
    house.nodes[0].stage.world.destroy(guest, now_ms);
    house.silence(500);
    assert_eq!(house.nodes[1].stage.seen_by(b), [guest]);
}

#[test]
fn a_known_way_is_told_turn_by_turn() {
    let mut house = House::new(5);
    let a = house.nodes[0].stage.enter(5.5);
    let tram = house.nodes[1].stage.tram(5.1, 5.9, 4_000);
    house.silence(1_000);
    house.overheard();
    house.silence(8_000);
    let shown = house.nodes[0].stage.beliefs[&a].shown[&tram].position_at(house.now_ms());
    let there = house.nodes[1]
        .stage
        .world
        .exported(house.now_ms())
        .next()
        .expect("it is watched")
        .pose;
    assert!(distance_m(shown, there.position) < 0.05, "{shown:?} and {there:?}");
    let poses = house
        .overheard()
        .iter()
        .filter(|letter| matches!(letter.to, To::Cell(_)))
        .count();
    assert!(
        (2..=8).contains(&poses),
        "{poses} messages for two turns and four refreshes"
    );
}

/// What somebody does for a tick.
#[derive(Debug, Clone, Copy)]
enum Step {
    Walk { who: usize, by_m: f64 },
    Jump { who: usize, to: f64 },
    Look { who: usize, enter_m: f64 },
    Gate { node: usize, border: u32, open: bool },
    Nothing,
}

fn steps() -> impl Strategy<Value = Vec<Step>> {
    let who = 0..5usize;
    let step = prop_oneof![
        8 => (who.clone(), -0.2..0.2f64).prop_map(|(who, by_m)| Step::Walk { who, by_m }),
        1 => (who.clone(), 0.0..f64::from(CELLS)).prop_map(|(who, to)| Step::Jump { who, to }),
        1 => (who, 0.5..8.0f64).prop_map(|(who, enter_m)| Step::Look { who, enter_m }),
        1 => (0..2usize, 1..CELLS, any::<bool>()).prop_map(|(node, border, open)| Step::Gate { node, border, open }),
        2 => Just(Step::Nothing),
    ];
    prop::collection::vec(step, 1..60)
}

/// Five participants, on two nodes by turns, who speak whenever they must.
struct Play {
    house: House,
    people: Vec<(usize, SessionId)>,
    x: Vec<f64>,
    promised: BTreeMap<usize, (f64, f64, i64)>,
    enter_m: Vec<f64>,
}

impl Play {
    fn new(dice: u64) -> Self {
        let mut house = House::new(dice);
        let x: Vec<_> = (0..5).map(|i| 1.0 + 2.0 * f64::from(i)).collect();
        let enter = |(i, x): (usize, &f64)| (i % 2, house.nodes[i % 2].stage.enter(*x));
        let people = x.iter().enumerate().map(enter).collect();
        house.tick();
        Self {
            house,
            people,
            promised: BTreeMap::new(),
            enter_m: vec![100.0; x.len()],
            x,
        }
    }

    fn stage(&mut self, who: usize) -> (&mut Stage, SessionId) {
        let (node, session) = self.people[who];
        (&mut self.house.nodes[node].stage, session)
    }

    fn act(&mut self, step: Step) {
        match step {
            Step::Walk { who, by_m } => self.x[who] = (self.x[who] + by_m).clamp(0.0, f64::from(CELLS)),
            Step::Jump { who, to } => {
                self.x[who] = to;
                self.promised.remove(&who);
            }
            Step::Look { who, enter_m } => {
                let (stage, session) = self.stage(who);
                stage.set_aoi(session, enter_m, 1.2 * enter_m);
                self.enter_m[who] = enter_m;
            }
            Step::Gate { node, border, open } => self.house.gate(node, border, open),
            Step::Nothing => {}
        }
        self.pass();
    }

    /// Two ticks, before each of which everybody speaks who must.
    fn pass(&mut self) {
        for _ in 0..2 {
            (0..self.people.len()).for_each(|who| self.speak(who));
            self.house.tick();
        }
    }

    fn speak(&mut self, who: usize) {
        let (stage, session) = self.stage(who);
        let (heard, now_ms) = (stage.unread(session), stage.now_ms);
        for event in heard {
            match event {
                Event::Wake { .. } => _ = self.promised.remove(&who),
                Event::Hush(hush) => {
                    let promise = (hush.tbv.center[0], hush.tbv.radius_m, hush.until_ms);
                    self.promised.insert(who, promise);
                }
                _ => {}
            }
        }
        let silent = self
            .promised
            .get(&who)
            .is_some_and(|(at, radius_m, until_ms)| now_ms + 100 < *until_ms && (self.x[who] - at).abs() <= *radius_m);
        if silent {
            return;
        }
        let x = self.x[who];
        let (stage, session) = self.stage(who);
        let hush = stage.pose(session, x);
        self.promised.remove(&who);
        let promise = hush.map(|hush| (hush.tbv.center[0], hush.tbv.radius_m, hush.until_ms));
        self.promised.extend(promise.map(|promise| (who, promise)));
    }

    /// Where somebody has said to be: who is hushed may have gone on.
    fn said(&self, who: usize) -> f64 {
        let (node, session) = self.people[who];
        self.house.nodes[node].stage.x(session)
    }

    /// The same people on one node, where they have said to be.
    fn on_one(&self) -> (Stage, Vec<SessionId>) {
        let mut stage = Stage::row(CELLS, 1);
        let people: Vec<_> = (0..self.people.len()).map(|who| stage.enter(self.said(who))).collect();
        for (session, enter_m) in people.iter().zip(&self.enter_m) {
            stage.set_aoi(*session, *enter_m, 1.2 * enter_m);
        }
        for border in self.house.nodes[0].stage.shut_gates() {
            stage.gate(border, false);
        }
        stage.silence(2_000);
        (stage, people)
    }

    fn check(&self, slack_m: f64) -> Result<(), TestCaseError> {
        for (a, (node, session)) in self.people.iter().enumerate() {
            let stage = &self.house.nodes[*node].stage;
            let eye = stage.x(*session);
            for (b, (home, other)) in self.people.iter().enumerate().filter(|(b, _)| *b != a) {
                let object = self.house.nodes[*home].stage.avatar(*other);
                let (there, away_m) = (self.x[b], (eye - self.x[b]).abs());
                let shown = stage.beliefs[session].shown.get(&object);
                let must = stage.sees(eye, there, 0.0) && away_m < self.enter_m[a] - 0.3;
                let may = stage.sees(eye, there, 1.2);
                prop_assert!(shown.is_some() || !must, "{a} at {eye} misses {b} at {there}");
                prop_assert!(shown.is_none() || may, "{a} at {eye} hears of {b} at {there}");
                if let Some(pose) = shown {
                    let wrong_m = distance_m(pose.position_at(self.house.now_ms()), [there, 0.5, 0.5]);
                    let most_m = 2.0 * pace::tolerance_m(away_m) + slack_m;
                    prop_assert!(wrong_m <= most_m, "{b} is believed {wrong_m} m away from where it is");
                }
            }
        }
        Ok(())
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn while_all_is_well_everybody_hears_of_what_they_can_see_and_of_nothing_else(steps in steps()) {
        let mut play = Play::new(1);
        for step in steps {
            play.act(step);
            play.check(2.0 * 0.2 + SPEED_MPS * 0.2)?;
        }
    }

    #[test]
    fn after_bad_weather_all_is_as_on_one_node(
        steps in steps(),
        dice in any::<u64>(),
        lost_percent in 0..60u64,
        twice_percent in 0..60u64,
        longest_ms in 0..400i64,
    ) {
        let mut play = Play::new(dice);
        play.house.weather = Weather { lost_percent, twice_percent, longest_ms };
        steps.into_iter().for_each(|step| play.act(step));
        play.house.weather = CALM;
        (0..40).for_each(|_| play.pass());
        // Of words that were lost or overtaken it depends on the weather which one counts, and all believe the same.
        let closed: Vec<_> = play.house.nodes.iter().map(|node| node.stage.world.closed()).collect();
        prop_assert_eq!(&closed[0], &closed[1]);
        for border in 1..CELLS {
            let open = !closed[0].contains(&ObjectId(1_000 + border));
            play.house.nodes.iter_mut().for_each(|node| node.stage.know_gate(border, open));
        }
        play.check(0.0)?;
        let (one, people) = play.on_one();
        for (a, (node, session)) in play.people.iter().enumerate() {
            for (b, (home, other)) in play.people.iter().enumerate().filter(|(b, _)| *b != a) {
                let away_m = (play.said(a) - play.said(b)).abs();
                // Between the two radii it depends on what was before.
                if (0.99..1.21).contains(&(away_m / play.enter_m[a])) {
                    continue;
                }
                let (here, theirs) = (&play.house.nodes[*node].stage, &play.house.nodes[*home].stage);
                let told = here.beliefs[session].shown.contains_key(&theirs.avatar(*other));
                let on_one = one.beliefs[&people[a]].shown.contains_key(&one.avatar(people[b]));
                prop_assert_eq!(told, on_one, "{} at {} of {} at {}", a, play.said(a), b, play.said(b));
            }
        }
    }
}
