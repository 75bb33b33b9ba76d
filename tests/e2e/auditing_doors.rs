//! Does an audit notice what is wrong with what was told of doors and of places, and nothing where nothing is?

use std::time::{Duration, Instant};

use belvedere_client::HttpSource;
use serde_json::{Value, json};

use crate::{
    auditing::{audit, sum, tampered},
    boxes::{Named, boxes},
    doors::{document, names},
    live::address,
    live_wire::{Person, json as ask},
    program::{Data, Server},
};

/// Three rooms in a row, each 5 m wide, and a door between each two of them.
const ROOMS: [Named; 14] = [
    ("floor", [-0.2, -0.2, -0.2], [15.6, 0.0, 5.2]),
    ("ceiling", [-0.2, 3.0, -0.2], [15.6, 3.2, 5.2]),
    ("west", [-0.2, 0.0, -0.2], [0.0, 3.0, 5.2]),
    ("east", [15.4, 0.0, -0.2], [15.6, 3.0, 5.2]),
    ("south", [0.0, 0.0, -0.2], [15.4, 3.0, 0.0]),
    ("north", [0.0, 0.0, 5.0], [15.4, 3.0, 5.2]),
    ("left of the first", [5.0, 0.0, 0.0], [5.2, 3.0, 2.0]),
    ("right of the first", [5.0, 0.0, 3.0], [5.2, 3.0, 5.0]),
    ("lintel of the first", [5.0, 2.2, 2.0], [5.2, 3.0, 3.0]),
    ("door:first", [5.0, 0.0, 2.0], [5.2, 2.2, 3.0]),
    ("left of the second", [10.2, 0.0, 0.0], [10.4, 3.0, 2.0]),
    ("right of the second", [10.2, 0.0, 3.0], [10.4, 3.0, 5.0]),
    ("lintel of the second", [10.2, 2.2, 2.0], [10.4, 3.0, 3.0]),
    ("door:second", [10.2, 0.0, 2.0], [10.4, 2.2, 3.0]),
];
/// In each room.
const PEOPLE: usize = 18;
/// Where they are, from its western wall, and how far they go round.
const PLACES: [[f64; 2]; 9] = [
    [0.9, 0.9],
    [2.4, 0.9],
    [4.1, 0.9],
    [0.9, 2.5],
    [2.4, 2.5],
    [4.1, 2.5],
    [0.9, 4.1],
    [2.4, 4.1],
    [4.1, 4.1],
];
const CIRCLE_M: f64 = 0.4;
const TURN_RAD_PER_S: f64 = 2.0;

/// Somebody who goes round and round.
struct Walker {
    person: Person,
    middle: [f64; 2],
    phase: f64,
}

impl Walker {
    async fn enter(server: &Server, room: usize, i: usize, since: Instant) -> Self {
        let [x, z] = PLACES[i % PLACES.len()];
        let (middle, phase) = ([5.2 * room as f64 + x, z], i as f64);
        let t_ms = since.elapsed().as_millis() as u64;
        let mut body = json!({"max_speed_mps": 1.5, "radius_m": 0.3, "t_ms": t_ms});
        body["position"] = place(middle, phase + TURN_RAD_PER_S * t_ms as f64 * 1e-3);
        let person = Person::enter_scene(address(server), "rooms", &body).await;
        Self { person, middle, phase }
    }

    async fn step(&self, since: Instant) {
        let t_ms = since.elapsed().as_millis() as u64;
        let phase = self.phase + TURN_RAD_PER_S * t_ms as f64 * 1e-3;
        let mut body = json!({"position": place(self.middle, phase), "t_ms": t_ms});
        if (self.phase as usize).is_multiple_of(3) {
            // Some say how they move.
            let speed = CIRCLE_M * TURN_RAD_PER_S;
            body["velocity"] = json!([-speed * phase.sin(), 0.0, speed * phase.cos()]);
        }
        assert_eq!(self.person.put("/pose", &body).await.status, 200);
    }
}

fn place([x, z]: [f64; 2], phase: f64) -> Value {
    json!([x + CIRCLE_M * phase.cos(), 1.5, z + CIRCLE_M * phase.sin()])
}

async fn walk(walkers: &[Walker], since: Instant, time: Duration) {
    let until = Instant::now() + time;
    while Instant::now() < until {
        for walker in walkers {
            walker.step(since).await;
        }
        tokio::time::sleep(Duration::from_millis(60)).await;
    }
}

/// Who was there, and which doors.
struct Story {
    first: String,
    /// In the first room, and in the last, which the second door closes for most of the time.
    near: String,
    beyond: String,
    /// One of the first room, too.
    object: String,
}

async fn live_through(data: &Data) -> Story {
    let server = data.serve_with(&["--record", "live.rec", "--session-bytes-per-s", "1000000"]);
    let source = HttpSource::new(&server.base).expect("an address");
    let around = document(&source, "/v1/scenes/rooms/objects?bbox=5,0,2,10.4,2.2,3").await;
    let doors = ["door:first", "door:second"].map(|name| {
        let found = names(&around).into_iter().find(|(node, _)| node == name);
        found.expect("a door").1
    });
    let [first, second] = doors.clone();
    let since = Instant::now();
    let mut walkers = Vec::new();
    for room in 0..3 {
        for i in 0..PEOPLE {
            walkers.push(Walker::enter(&server, room, i, since).await);
        }
    }
    let mut hears = Vec::new();
    for walker in &walkers {
        hears.push(walker.person.listen().await);
    }
    let token = walkers[0].person.token.clone();
    let moves = async |door: &str, open: bool| {
        let path = format!("/v1/scenes/rooms/doors/{door}");
        let body = json!({"open": open});
        let answer = ask(address(&server), ("PUT", &path), Some(&token), &body).await;
        assert_eq!(answer.status, 200);
    };
    moves(&second, false).await;
    // It has hidden the first door long enough.
    walk(&walkers, since, Duration::from_millis(4_000)).await;
    for open in [false, true, false] {
        moves(&first, open).await;
        walk(&walkers, since, Duration::from_millis(700)).await;
    }
    // Somebody comes who takes it to be open.
    let late = Walker::enter(&server, 0, 4, since).await;
    hears.push(late.person.listen().await);
    walkers.push(late);
    walk(&walkers, since, Duration::from_millis(700)).await;
    // Now the others come to see it.
    moves(&second, true).await;
    walk(&walkers, since, Duration::from_millis(1_500)).await;
    server.kill();
    Story {
        first,
        near: walkers[0].person.session.clone(),
        beyond: walkers[2 * PEOPLE + 2].person.session.clone(),
        object: walkers[1].person.object.clone(),
    }
}

fn told(output: &mut Value) -> &mut Vec<Value> {
    output["told"].as_array_mut().expect("a list")
}

/// The first findings of a kind.
fn first<'a>(report: &'a Value, kind: &str) -> &'a [Value] {
    report["scenes"][0][kind]["first"].as_array().expect(kind)
}

/// Whether an event is one of a door that a session is told of.
fn is_of(event: &Value, session: &str, door: &str) -> bool {
    event[0] == session && event[1] == "door" && event[2]["object"] == door
}

#[tokio::test(flavor = "multi_thread")]
async fn doors_and_places_that_were_told_wrong_are_found_and_none_among_many_people() {
    let data = Data::new();
    data.bake(&data.write("rooms.glb", boxes(&ROOMS)), "rooms");
    let story = live_through(&data).await;
    let Story {
        first: door,
        near,
        beyond,
        object,
    } = &story;

    let (clean, report) = audit(&data, "live.rec");
    assert!(clean, "{report:#}");
    assert_eq!(sum(&report, "undecided"), 0, "{report:#}");
    assert_eq!(sum(&report, "sessions"), 3 * PEOPLE as u64 + 1);
    // The second door twice to nearly everybody, the first to who is not behind it, and at last to all.
    assert!(sum(&report, "doors") > 5 * PEOPLE as u64, "{report:#}");
    assert!(sum(&report, "told") > 5_000, "{report:#}");

    // Somebody does not hear of a door.
    tampered(&data, "deaf.rec", |_, output| {
        told(output).retain(|told| !is_of(told, near, door))
    });
    let (_, deaf) = audit(&data, "deaf.rec");
    let misses = first(&deaf, "misses");
    assert!(
        misses
            .iter()
            .any(|miss| miss["session"] == *near && miss["object"] == *door),
        "{deaf:#}"
    );
    assert!(misses.iter().all(|miss| miss["session"] == *near), "{deaf:#}");
    assert_eq!(sum(&deaf, "leaks") + sum(&deaf, "untrue"), 0, "{deaf:#}");

    // Somebody behind a closed door hears of another.
    tampered(&data, "gossip.rec", |_, output| {
        let heard = told(output).iter().find(|told| is_of(told, near, door)).cloned();
        told(output).extend(heard.map(|mut heard| {
            heard[0] = json!(beyond);
            heard
        }));
    });
    let (_, gossip) = audit(&data, "gossip.rec");
    let leak = &first(&gossip, "leaks")[0];
    assert_eq!(
        [&leak["session"], &leak["object"], &leak["event"]],
        [beyond.as_str(), door, "door"]
    );

    // A door is told to stand as it does not.
    tampered(&data, "lie.rec", |_, output| {
        for told in told(output).iter_mut().filter(|told| is_of(told, near, door)) {
            told[2]["open"] = json!(!told[2]["open"].as_bool().expect("a state"));
        }
    });
    let (_, lie) = audit(&data, "lie.rec");
    let untrue = &first(&lie, "untrue")[0];
    assert_eq!(
        [&untrue["session"], &untrue["object"], &untrue["event"]],
        [near.as_str(), door, "door"]
    );
    assert!(
        sum(&lie, "misses") > 0,
        "who is told a lie does not know better: {lie:#}"
    );

    // Somebody is told to be a metre from where it is.
    tampered(&data, "aside.rec", |_, output| {
        for told in told(output)
            .iter_mut()
            .filter(|told| told[0] == *near && told[1] == "object-pos")
        {
            let objects = told[2]["objects"].as_array_mut().expect("a list");
            for of in objects.iter_mut().filter(|of| of["object"] == *object) {
                let x = of["position"][0].as_f64().expect("a number");
                of["position"][0] = json!(x + 1.0);
            }
        }
    });
    let (_, aside) = audit(&data, "aside.rec");
    let untrue = &first(&aside, "untrue")[0];
    assert_eq!([&untrue["session"], &untrue["object"]], [near, object], "{aside:#}");
    assert!(
        (untrue["off_m"].as_f64().expect("a distance") - 1.0).abs() < 1e-6,
        "{untrue}"
    );

    // Nothing more is told of somebody who goes on.
    tampered(&data, "silent.rec", |_, output| {
        for told in told(output)
            .iter_mut()
            .filter(|told| told[0] == *near && told[1] == "object-pos")
        {
            let objects = told[2]["objects"].as_array_mut().expect("a list");
            objects.retain(|of| of["object"] != *object);
        }
    });
    let (_, silent) = audit(&data, "silent.rec");
    let untrue = first(&silent, "untrue");
    assert!(!untrue.is_empty(), "{silent:#}");
    for untrue in untrue {
        assert_eq!([&untrue["session"], &untrue["object"]], [near, object], "{silent:#}");
        assert!(untrue["event"].is_null() && untrue["off_m"].as_f64().expect("a distance") > 0.005);
    }
    let message = data.fails(&["audit", "silent.rec"]);
    assert!(message.contains("untrue"), "{message}");
}
