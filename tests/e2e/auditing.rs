//! Is a recording of live sessions right, and does an audit notice when it is not?

use std::path::Path;

use belvedere::live::{Block, Recording};
use belvedere_client::HttpSource;
use serde_json::{Value, json};

use crate::{
    boxes::two_rooms,
    doors::{document, names},
    live::address,
    live_wire::{Person, json as ask},
    program::{Data, Server, THREE_ROOMS, text},
};

/// People go round in circles for a while, each 100 ms a step, at about a metre a second.
async fn wander(people: &[(&Person, [f64; 2])], steps: std::ops::Range<u32>) {
    for step in steps {
        for (person, [x, z]) in people {
            let angle = 0.15 * f64::from(step);
            let body = json!({"position": [x + 0.6 * angle.cos(), 1.5, z + 0.6 * angle.sin()], "t_ms": 100 * step});
            assert_eq!(person.put("/pose", &body).await.status, 200);
        }
        tokio::time::sleep(std::time::Duration::from_millis(100)).await;
    }
}

pub(crate) async fn enter(server: &Server, scene: &str, [x, z]: [f64; 2]) -> Person {
    let body = json!({"position": [x + 0.6, 1.5, z], "max_speed_mps": 1.5, "radius_m": 0.3, "t_ms": 0});
    Person::enter_scene(address(server), scene, &body).await
}

/// An hour in two houses, in short; gives the object that nobody could see.
async fn live_through(data: &Data) -> String {
    let server = data.serve_with(&["--record", "live.rec"]);
    let [west, east, cell] = [[2.5, 2.5], [6.5, 2.5], [10.5, 2.5]];
    let a = enter(&server, "rooms", west).await;
    let b = enter(&server, "rooms", east).await;
    let hidden = enter(&server, "rooms", cell).await;
    let c = enter(&server, "doors", [2.5, 2.5]).await;
    let d = enter(&server, "doors", [7.5, 2.5]).await;
    // Nobody is told anything who does not listen.
    let mut hears = Vec::new();
    for person in [&a, &b, &hidden, &c, &d] {
        hears.push(person.listen().await);
    }
    let key = |t_ms: u32, x: f64| json!({"t_ms": t_ms, "position": [x, 0.5, 2.5]});
    let tram = json!({"trajectory": {"keys": [key(0, 2.0), key(3000, 8.0), key(6000, 2.0)], "repeat": true}});
    let path = "/v1/scenes/doors/movers";
    assert_eq!(ask(address(&server), ("POST", path), None, &tram).await.status, 201);
    let people = [
        (&a, west),
        (&b, east),
        (&hidden, cell),
        (&c, [2.5, 2.5]),
        (&d, [7.5, 2.5]),
    ];
    wander(&people, 0..15).await;
    let source = HttpSource::new(&server.base).expect("an address");
    let around = document(&source, "/v1/scenes/doors/objects?bbox=5,0,2,5.2,2.2,3").await;
    let door = names(&around)
        .into_iter()
        .find(|(node, _)| node == "door:between")
        .expect("a door")
        .1;
    for (open, steps) in [(false, 15..40), (true, 40..55)] {
        let path = format!("/v1/scenes/doors/doors/{door}");
        ask(address(&server), ("PUT", &path), Some(&c.token), &json!({"open": open})).await;
        for (person, _) in &people {
            person.put("/aoi", &json!({"enter_m": 40, "leave_m": 50})).await;
        }
        wander(&people, steps).await;
    }
    server.kill();
    hidden.object.clone()
}

pub(crate) fn audit(data: &Data, file: &str) -> (bool, Value) {
    let output = data.run(&["audit", file, "--json", "--every", "1"]);
    let report = serde_json::from_str(&text(&output.stdout));
    (
        output.status.success(),
        report.unwrap_or_else(|_| panic!("{}", text(&output.stderr))),
    )
}

pub(crate) fn sum(report: &Value, what: &str) -> u64 {
    let scenes = report["scenes"].as_array().expect("scenes").iter();
    scenes
        .map(|scene| scene[what]["count"].as_u64().or(scene[what].as_u64()).expect(what))
        .sum()
}

fn blocks(file: &Path) -> Vec<Block> {
    let mut recording = Recording::open(std::fs::File::open(file).expect("a file")).expect("a recording");
    std::iter::from_fn(|| recording.next_block().expect("a block")).collect()
}

/// A recording with other entries in it; `tamper` is given what comes in and what goes out.
pub(crate) fn tampered(data: &Data, name: &str, tamper: impl Fn(&str, &mut Value)) {
    let original = data.folder("live.rec");
    let mut bytes = std::fs::read(&original).expect("a file")[..6].to_vec();
    for block in blocks(&original) {
        let mut text = format!("{}\n", block.scene);
        let lines: Vec<_> = block.entries.lines().collect();
        for entry in lines.chunks(2) {
            let written: Value = serde_json::from_str(entry[1]).expect("an output");
            let mut output = written.clone();
            if block.scene == "rooms" {
                tamper(entry[0], &mut output);
            }
            // What is not touched stays as it is, to the last byte.
            let output = if output == written {
                entry[1].to_owned()
            } else {
                output.to_string()
            };
            text += &format!("{}\n{output}\n", entry[0]);
        }
        let frame = zstd::bulk::compress(text.as_bytes(), 1).expect("a frame");
        bytes.extend((frame.len() as u32).to_le_bytes());
        bytes.extend(frame);
    }
    data.write(name, bytes);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_recording_survives_a_kill_and_an_audit_finds_what_was_tampered_with() {
    let data = Data::new();
    data.bake(&data.write("rooms.plan", THREE_ROOMS), "rooms");
    data.bake(&data.write("doors.glb", two_rooms()), "doors");
    let hidden = live_through(&data).await;

    let (clean, report) = audit(&data, "live.rec");
    assert!(clean, "{report:#}");
    assert_eq!(sum(&report, "undecided"), 0, "{report:#}");
    assert!(sum(&report, "told") > 50 && sum(&report, "untold") > 50, "{report:#}");
    assert_eq!(sum(&report, "sessions"), 5);

    // The last block is damaged: what is before it counts.
    let whole = std::fs::read(data.folder("live.rec")).expect("a file");
    data.write("cut.rec", &whole[..whole.len() - 3]);
    let (clean, cut) = audit(&data, "cut.rec");
    assert!(clean && sum(&cut, "entries") < sum(&report, "entries"), "{cut:#}");

    tampered(&data, "leak.rec", |input, output| {
        if input.ends_with("\"tick\"]") {
            let pose = json!({"t_ms": 0, "objects": [{"object": hidden, "position": [10.5, 1.5, 2.5]}]});
            output["told"]
                .as_array_mut()
                .expect("a list")
                .push(json!(["s0", "object-pos", pose]));
        }
    });
    let (clean, report) = audit(&data, "leak.rec");
    assert!(!clean);
    assert!(
        sum(&report, "leaks") > 0 && sum(&report, "differences") > 0,
        "{report:#}"
    );
    assert_eq!(report["scenes"][1]["leaks"]["first"][0]["object"], *hidden);

    tampered(&data, "others.rec", |input, output| {
        if input.ends_with("\"tick\"]") {
            let told = output["told"].as_array_mut().expect("a list");
            told.push(json!(["s0", "wake", {"object": hidden}]));
            told.push(json!(["s0", "rate", {"objects": [{"object": hidden, "period_ms": 100}]}]));
            told.push(json!(["s77", "wake", {"object": hidden}]));
        }
    });
    let (clean, report) = audit(&data, "others.rec");
    let rooms = &report["scenes"][1];
    assert!(
        !clean && sum(&report, "astray") > 0 && sum(&report, "misses") == 0,
        "{report:#}"
    );
    let leaks = [0, 1].map(|i| rooms["leaks"]["first"][i].clone());
    assert_eq!(leaks.each_ref().map(|leak| &leak["event"]), ["wake", "rate"]);
    assert!(leaks.iter().all(|leak| leak["object"] == *hidden), "{leaks:?}");
    let astray = rooms["astray"]["first"].as_array().expect("a list").iter();
    assert!(astray.clone().any(|astray| astray["session"] == "s77"), "{report:#}");
    let message = data.fails(&["audit", "others.rec"]);
    assert!(message.contains("tellings astray"), "{message}");

    tampered(&data, "miss.rec", |_, output| {
        let told = output["told"].as_array_mut().expect("a list");
        told.retain(|told| told[0] != "s0" || !told[1].as_str().is_some_and(|event| event.starts_with("object-")));
    });
    let (clean, report) = audit(&data, "miss.rec");
    assert!(!clean);
    assert!(
        sum(&report, "misses") > 0 && sum(&report, "differences") > 0,
        "{report:#}"
    );
    assert_eq!(sum(&report, "leaks"), 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn who_is_silent_is_missed_where_it_was_heard_of_last() {
    let data = Data::new();
    data.bake(&data.write("rooms.plan", THREE_ROOMS), "rooms");
    let server = data.serve_with(&["--record", "live.rec"]);
    let (a, b) = (
        enter(&server, "rooms", [2.5, 2.5]).await,
        enter(&server, "rooms", [6.5, 2.5]).await,
    );
    let (mut hears, _hears) = (a.listen().await, b.listen().await);
    assert_eq!(hears.wait("object-info").await.data["object"], b.object);
    // All are silent for longer than anything is extrapolated.
    tokio::time::sleep(std::time::Duration::from_millis(3_500)).await;
    server.kill();

    let (clean, report) = audit(&data, "live.rec");
    assert!(clean && sum(&report, "told") > 0, "{report:#}");
    // Somebody is told of nobody.
    tampered(&data, "miss.rec", |_, output| {
        let all = output["told"].as_array_mut().expect("a list");
        all.retain(|told| told[0] != json!(a.session));
    });
    let (_, miss) = audit(&data, "miss.rec");
    assert!(sum(&miss, "misses") > 0, "{miss:#}");
}

/// A hall of so many metres.
fn hall([width, depth]: [usize; 2]) -> String {
    let wall = "#".repeat(width + 2);
    let row = format!("#{}#\n", ".".repeat(width));
    format!("{wall}\n{}{wall}\n", row.repeat(depth))
}

#[tokio::test(flavor = "multi_thread")]
async fn whom_a_crowd_hides_is_no_miss_where_the_server_leaves_such_people_out() {
    const ROWS: usize = 8;
    const IN_A_ROW: usize = 14;
    let data = Data::new();
    data.bake(&data.write("rooms.plan", hall([18, 20])), "rooms");
    let server = data.serve_with(&["--record", "live.rec", "--cull-below-percent", "10"]);
    let eye = enter(&server, "rooms", [9.5, 18.5]).await;
    let _hears = eye.listen().await;
    let place = |i: usize| json!([2.5 + (i % IN_A_ROW) as f64, 1.5, 14.0 - 1.5 * (i / IN_A_ROW) as f64]);
    let mut movers = Vec::new();
    for i in 0..ROWS * IN_A_ROW {
        let body = json!({"position": place(i), "radius_m": 0.5, "max_speed_mps": 1});
        let answer = ask(address(&server), ("POST", "/v1/scenes/rooms/movers"), None, &body).await;
        assert_eq!(answer.status, 201);
        movers.push(answer.json());
    }
    for _ in 0..40 {
        for i in [0, ROWS * IN_A_ROW - 1] {
            let body = json!({"position": place(i)});
            let (path, token) = (
                format!("/v1/movers/{}/pose", movers[i]["object"].as_str().expect("an id")),
                &movers[i]["token"],
            );
            assert_eq!(
                ask(address(&server), ("PUT", &path), token.as_str(), &body)
                    .await
                    .status,
                200
            );
        }
        tokio::time::sleep(std::time::Duration::from_millis(100)).await;
    }
    server.kill();

    let (clean, report) = audit(&data, "live.rec");
    assert!(clean && sum(&report, "told") > 0, "{report:#}");
    assert!(sum(&report, "culled") > 0, "nobody was left out: {report:#}");
    // Who stands in front is not hidden by anybody.
    let front = movers[IN_A_ROW / 2]["object"].clone();
    tampered(&data, "miss.rec", |_, output| {
        let all = output["told"].as_array_mut().expect("a list");
        all.retain(|told| told[2]["object"] != front);
        for told in all {
            if let Some(objects) = told[2]["objects"].as_array_mut() {
                objects.retain(|told| told["object"] != front);
            }
        }
    });
    let (_, miss) = audit(&data, "miss.rec");
    assert!(sum(&miss, "misses") > 0, "{miss:#}");
    assert_eq!(miss["scenes"][0]["misses"]["first"][0]["object"], front);
}

#[test]
fn what_is_no_recording_is_refused() {
    let data = Data::new();
    data.bake(&data.write("rooms.plan", THREE_ROOMS), "rooms");
    data.write("a.txt", "no recording at all");
    let message = data.fails(&["audit", "a.txt"]);
    assert!(
        message.contains("a.txt") && message.contains("no recording"),
        "{message}"
    );
    let message = data.fails(&["audit", "none.rec"]);
    assert!(message.contains("none.rec"), "{message}");
}

#[tokio::test(flavor = "multi_thread")]
async fn what_was_recorded_is_judged_by_its_own_revision_as_long_as_that_is_kept() {
    let data = Data::new();
    data.bake(&data.write("rooms.plan", THREE_ROOMS), "rooms");
    let server = data.serve_with(&["--record", "live.rec"]);
    let [west, east] = [[2.5, 2.5], [6.5, 2.5]];
    let (a, b) = (enter(&server, "rooms", west).await, enter(&server, "rooms", east).await);
    let mut hears = a.listen().await;
    hears.wait("object-info").await;
    wander(&[(&a, west), (&b, east)], 0..10).await;
    server.kill();
    // There is other geometry by now.
    data.bake(&data.write("rooms.glb", two_rooms()), "rooms");
    let (clean, report) = audit(&data, "live.rec");
    assert!(clean, "{report:#}");
    assert!(sum(&report, "told") > 0 && sum(&report, "cells") > 0, "{report:#}");
    assert_eq!(sum(&report, "ticks_not_looked_at"), 0, "{report:#}");

    data.ok(&["gc", "--keep", "1"]);
    let (clean, report) = audit(&data, "live.rec");
    assert!(clean, "{report:#}");
    assert!(sum(&report, "ticks") > 0);
    assert_eq!(sum(&report, "ticks_not_looked_at"), sum(&report, "ticks"));
    let said = data.ok(&["audit", "live.rec"]);
    let last = said.trim_end().lines().last().expect("a line");
    assert!(last.starts_with("nothing was judged"), "{said}");
    let message = data.fails(&["audit", "live.rec", "--fail-on-undecided"]);
    assert!(message.contains("nothing was judged"), "{message}");

    data.ok(&["remove", "rooms"]);
    let (clean, without_scene) = audit(&data, "live.rec");
    assert!(clean, "{without_scene:#}");
    assert_eq!(without_scene, report, "it is replayed as before");
}
