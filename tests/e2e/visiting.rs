//! `belvedere walk`: visitors are sent through a scene, and what they get to see is measured.

use std::{
    io::{Read, Write},
    path::PathBuf,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use serde_json::Value;

use crate::program::{Data, THREE_ROOMS, text};

const THROUGH_THE_DOOR: &str = r#"{"t_ms": 0, "position": [2.5, 1.5, 2.5]}
{"t_ms": 20000, "position": [6.5, 1.5, 2.5]}
"#;

fn walk(data: &Data, tree: &str, more: &[&str]) -> Value {
    let script = data.write("way.jsonl", THROUGH_THE_DOOR);
    let script = script.to_str().expect("UTF-8");
    let args = ["walk", tree, "--scene", "rooms", "--script", script, "--json"];
    serde_json::from_str(&data.ok(&[&args, more].concat())).expect("JSON")
}

#[test]
fn a_slow_line_brings_things_later_and_what_lies_ahead_is_there_before_it_is_seen() {
    let data = Data::new();
    data.bake(&data.write("rooms.plan", THREE_ROOMS), "rooms");
    data.ok(&["publish", "rooms", "--to", "tree"]);
    let server = data.serve();
    let tree = data.folder("tree");
    let tree = tree.to_str().expect("UTF-8");

    let fast = walk(&data, tree, &[]);
    assert_eq!((&fast["sessions"], &fast["frames"]), (&1.into(), &201.into()), "{fast}");
    assert_eq!((&fast["holes"], &fast["lost_files"]), (&0.into(), &0.into()), "{fast}");
    assert_eq!(fast["quality"]["min"], 1.0, "{fast}");

    let slow = walk(&data, tree, &["--bandwidth", "64k", "--latency", "50ms"]);
    assert!(
        slow["convergence_s"].as_f64() > fast["convergence_s"].as_f64(),
        "{slow}"
    );
    let bytes =
        |outcome: &Value| ["needed", "prefetched_used", "prefetched_wasted"].map(|c| outcome["bytes"][c].as_u64());
    let unaided = walk(
        &data,
        tree,
        &["--bandwidth", "64k", "--latency", "50ms", "--prefetch", "off"],
    );
    assert_eq!(bytes(&unaided)[1..], [Some(0), Some(0)]);
    assert!(slow["quality"]["mean"].as_f64() >= unaided["quality"]["mean"].as_f64());
    assert_eq!(
        slow["convergence_s"], unaided["convergence_s"],
        "nothing comes ahead before the first picture"
    );

    // What the line carries does not depend on who sends it.
    let line = ["--bandwidth", "64k", "--latency", "50ms", "--bundles", "off"];
    let served = walk(&data, &server.base, &line);
    for same in ["quality", "convergence_s", "bytes", "requests", "holes"] {
        assert_eq!(slow[same], served[same], "{same}");
    }
    // Nor does it bring less where small files come together.
    let together = walk(&data, &server.base, &line[..4]);
    assert_eq!(together["holes"], slow["holes"], "{together}");
    assert!(together["requests"].as_u64() <= slow["requests"].as_u64(), "{together}");
    // Memory that does not hold a room is kept, and that is said.
    let tight_outcome = walk(&data, tree, &["--memory", "3k"]);
    let tight = &tight_outcome;
    assert!(tight["memory"]["peak_bytes"].as_u64() <= Some(3000), "{tight}");
    assert!(
        tight["holes"].as_u64() > Some(0) || tight["convergence_s"].is_null(),
        "{tight}"
    );
    let told = tight["first_failures"][0].as_str().unwrap_or_default();
    assert!(told.contains("cells next door"), "{tight}");
    // Whoever reads no JSON hears of it too, with what would do, and has not had what was asked for.
    let script = data.write("way.jsonl", THROUGH_THE_DOOR);
    let script = script.to_str().expect("UTF-8");
    let tight = ["walk", tree, "--scene", "rooms", "--script", script, "--memory", "3k"];
    let told = text(&data.run(&[&tight[..], &["--json"]].concat()).stderr);
    assert!(
        told.contains("and its neighbours take, where no rules stand in for them; give at least"),
        "{told}"
    );
    let table = data.ok(&tight);
    assert!(table.lines().all(|line| line.chars().count() <= 160), "{table}");
    let message = data.fails(&[&tight[..], &["--min-quality", "1%"]].concat());
    assert!(message.contains("memory does not suffice"), "{message}");
    assert!(tight_outcome["memory"]["missing"].as_u64() > Some(0), "{tight_outcome}");
    assert_eq!(fast["memory"]["missing"], 0, "{fast}");
    // Memory that is short by a byte, where smaller forms of things leave nothing in sight missing, is good enough.
    let almost = fast["memory"]["needed_bytes"].as_u64().expect("a number") - 1;
    let almost = almost.to_string();
    let spare = walk(&data, tree, &["--memory", &almost, "--min-quality", "100%"]);
    assert!(spare["memory"]["short_cells"].as_u64() > Some(0), "{spare}");
    assert_eq!(spare["memory"]["missing"], 0, "{spare}");
    for (option, value, told) in [
        ("--bandwidth", "-1", "expected a bandwidth in bits a second"),
        ("--duration", "-1", "expected a number of seconds above 0"),
        ("--duration", "nan", "expected a number of seconds above 0"),
        ("--memory", "1.5", "expected an amount of memory in whole bytes"),
        ("--sessions", "2.5", "expected a whole number from 1 to 10000"),
    ] {
        let message = text(&data.run(&["walk", tree, "--scene", "rooms", option, value]).stderr);
        assert!(message.contains(told), "{message}");
    }
    // What is not used is looked at nevertheless.
    let output = data.run(&["walk", tree, "--scene", "rooms", "--script", script, "--duration", "0"]);
    assert_eq!(output.status.code(), Some(2), "{}", text(&output.stderr));
    let message = data.fails(&["walk", "http://127.0.0.1:9/?scene=rooms", "--scene", "rooms"]);
    assert!(message.contains("leave out what begins with `?`"), "{message}");
    let message = data.fails(&["walk", tree, "--scene", "cellar"]);
    assert!(
        message.contains(&format!("cannot open `cellar` of {tree}: ")),
        "{message}"
    );
    let many = walk(&data, &server.base, &["--sessions", "5", "--speed", "36km/h"]);
    assert_eq!(many["sessions"], 5);
    assert!(many["requests"].as_u64() > Some(20), "{many}");
}

#[test]
fn made_up_walks_are_repeatable_and_guard_a_deployment() {
    let data = Data::new();
    data.bake(&data.write("rooms.plan", THREE_ROOMS), "rooms");
    data.ok(&["publish", "rooms", "--to", "tree"]);
    let tree = data.folder("tree");
    let tree = tree.to_str().expect("UTF-8");
    let (way, plot) = (data.folder("way.jsonl"), data.folder("plot.svg"));
    let files = [way.to_str().expect("UTF-8"), plot.to_str().expect("UTF-8")];
    let walk = ["walk", tree, "--scene", "rooms", "--duration", "30"];
    let saved = ["--save-script", files[0], "--plot", files[1], "--min-quality", "95%"];
    let table = data.ok(&[&walk[..], &saved].concat());
    assert!(table.contains("download quality since, mean"), "{table}");
    assert!(std::fs::read_to_string(&plot).expect("a plot").starts_with("<svg"));
    let first = std::fs::read_to_string(&way).expect("a script");
    assert!(first.lines().count() > 2, "{first}");
    data.ok(&[&walk[..], &saved].concat());
    assert_eq!(std::fs::read_to_string(&way).expect("a script"), first);

    let message = data.fails(&[&walk[..], &["--bandwidth", "1", "--min-quality", "95%"]].concat());
    assert!(message.contains("not every visitor ever had all"), "{message}");
    let message = data.fails(&["walk", "nowhere", "--scene", "rooms"]);
    assert!(message.contains("neither an address"), "{message}");
    let bad = data.write("bad.jsonl", "{\"t_ms\": 0}\n");
    let message = data.fails(&[&walk[..], &["--script", bad.to_str().expect("UTF-8")]].concat());
    assert!(
        message.contains("bad.jsonl is no script: line 1: missing field `position`"),
        "{message}"
    );
}

/// Loses all published files of a kind.
fn lose(data: &Data, ext: &str) {
    for entry in std::fs::read_dir(data.folder("tree/o")).expect("blobs") {
        let path = entry.expect("an entry").path();
        if path.extension().is_some_and(|found| found == ext) {
            std::fs::remove_file(path).expect("to lose it");
        }
    }
}

/// Loses all published documents that begin so.
fn lose_documents(data: &Data, beginning: &str) {
    for entry in std::fs::read_dir(data.folder("tree/o")).expect("blobs") {
        let path = entry.expect("an entry").path();
        if std::fs::read_to_string(&path).is_ok_and(|text| text.starts_with(beginning)) {
            std::fs::remove_file(path).expect("to lose it");
        }
    }
}

#[test]
fn what_is_lost_is_not_there_and_the_walk_goes_on() {
    let data = Data::new();
    data.bake(&data.write("rooms.plan", THREE_ROOMS), "rooms");
    data.ok(&["publish", "rooms", "--to", "tree"]);
    let tree = data.folder("tree");
    let tree = tree.to_str().expect("UTF-8");
    lose(&data, "pack");
    let alone = walk(&data, tree, &["--min-quality", "100%"]);
    assert!(
        alone["lost_files"].as_u64() > Some(0) && alone["quality"]["min"] == 1.0,
        "{alone}"
    );
    // A record also stands as JSON, and in the steps from the cells next door.
    lose(&data, "cell");
    let twice = walk(&data, tree, &["--min-quality", "100%"]);
    assert_eq!(
        (&twice["unknown_frames"], &twice["quality"]["min"]),
        (&0.into(), &1.0.into()),
        "{twice}"
    );
    // The JSON twins of all cell records.
    lose_documents(&data, "{\"cell\":");
    let blind = walk(&data, tree, &[]);
    assert_eq!(
        (&blind["convergence_s"], &blind["frames"]),
        (&Value::Null, &201.into()),
        "{blind}"
    );
    assert_eq!(blind["unknown_frames"], 201, "{blind}");
    assert!(
        blind["first_failures"][0]
            .as_str()
            .is_some_and(|cause| cause.contains(".cell")),
        "{blind}"
    );
    let way = data.write("way.jsonl", THROUGH_THE_DOOR);
    let way = way.to_str().expect("UTF-8");
    let message = data.fails(&["walk", tree, "--scene", "rooms", "--script", way, "--min-quality", "1%"]);
    assert!(message.contains("not every visitor ever had all"), "{message}");
}

#[test]
fn a_walk_without_a_map_of_cells_goes_on_and_does_not_count_as_whole() {
    let data = Data::new();
    data.bake(&data.write("rooms.plan", THREE_ROOMS), "rooms");
    data.ok(&["publish", "rooms", "--to", "tree"]);
    lose_documents(&data, "{\"cells\":");
    let tree = data.folder("tree");
    let lost = walk(&data, tree.to_str().expect("UTF-8"), &[]);
    assert_eq!(lost["unknown_frames"], lost["frames"], "{lost}");
    let cause = lost["first_failures"][0].as_str().expect("a failure");
    assert!(cause.contains("map of cells"), "{lost}");
    assert_eq!(lost["memory"]["needed_in"], Value::Null, "{lost}");
    // All is there, and nobody knows whether that is all.
    assert!(lost["came"]["packs"]["bytes"].as_u64() > Some(0), "{lost}");
    assert_eq!(lost["convergence_s"], Value::Null, "{lost}");
    let message = data.fails(&["walk", tree.to_str().expect("UTF-8"), "--scene", "rooms"]);
    assert!(
        message.contains("no way can be made up; give one with --script"),
        "{message}"
    );
}

#[test]
fn visitors_meet_each_other_in_real_time_where_the_scene_is_live() {
    let data = Data::new();
    data.bake(&data.write("rooms.plan", THREE_ROOMS), "rooms");
    data.ok(&["publish", "rooms", "--to", "tree"]);
    let server = data.serve();
    let way = r#"{"t_ms": 0, "position": [2, 1.5, 2], "orientation": [0, 0, 0, 1]}
{"t_ms": 8000, "position": [3, 1.5, 3], "orientation": [0, 1, 0, 0], "door": null}
"#;
    let script = data.write("way.jsonl", way);
    let script = script.to_str().expect("UTF-8");
    let walk = ["--scene", "rooms", "--script", script, "--sessions", "3"];
    let visit = |more: &[&str]| data.ok(&[&["walk", &server.base], &walk[..], more].concat());
    let outcome: Value = serde_json::from_str(&visit(&["--live", "on", "--json"])).expect("JSON");
    let live = &outcome["live"];
    let is = |name: &str, wanted: u64| assert_eq!(live[name], wanted, "{name}: {live}");
    let some = |name: &str| assert!(live[name].as_u64() > Some(0), "{name}: {live}");
    for name in ["opened", "inside"] {
        is(name, 3);
    }
    for name in ["resyncs", "lost", "failures"] {
        is(name, 0);
    }
    for name in ["movers_met", "events", "poses_told", "poses_said", "delays"] {
        some(name);
    }
    assert!(
        live["delay_ms"]["p99"].as_f64() >= live["delay_ms"]["p50"].as_f64(),
        "{live}"
    );
    let alone: Value = serde_json::from_str(&visit(&["--json"])).expect("JSON");
    assert_eq!((&alone["live"], &alone["bytes"]), (&Value::Null, &outcome["bytes"]));

    // Nobody is met in a folder, nor where plain files are served.
    let tree = data.folder("tree");
    let tree = tree.to_str().expect("UTF-8");
    let message = data.fails(&[&["walk", tree], &walk[..], &["--live", "on"]].concat());
    assert!(message.contains("a folder has no live sessions"), "{message}");
    let files = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = format!("http://{}", files.local_addr().expect("an address"));
    let over = Arc::new(AtomicBool::new(false));
    let ends = over.clone();
    let serving = std::thread::spawn(move || {
        for mut stream in files.incoming().flatten() {
            if ends.load(Ordering::Acquire) {
                return;
            }
            _ = stream.read(&mut [0; 4096]);
            _ = stream.write_all(b"HTTP/1.1 200 OK\r\nContent-Length: 0\r\nConnection: close\r\n\r\n");
        }
    });
    let message = data.fails(&[&["walk", &address], &walk[..], &["--live", "on"]].concat());
    assert!(message.contains("`rooms` offers no live sessions there"), "{message}");
    over.store(true, Ordering::Release);
    std::net::TcpStream::connect(address.trim_start_matches("http://")).expect("it listens still");
    serving.join().expect("it ends");
}

/// Answers with the files of a tree; its levels are gone, and its pointer leads to another revision when it is asked for again.
fn serves_what_was_published_anew(tree: PathBuf, later: Vec<u8>) -> String {
    let files = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = format!("http://{}", files.local_addr().expect("an address"));
    std::thread::spawn(move || {
        let mut asked_for_pointer = 0;
        for mut stream in files.incoming().flatten() {
            let mut head = [0; 4096];
            let count = stream.read(&mut head).unwrap_or_default();
            let head = String::from_utf8_lossy(&head[..count]).into_owned();
            let path = head.split(' ').nth(1).unwrap_or_default();
            let path = path.split('?').next().unwrap_or_default();
            let is_level = [".glb", ".pack", ".slod"].iter().any(|ending| path.ends_with(ending));
            let mut found = std::fs::read(tree.join(path.trim_start_matches('/')))
                .ok()
                .filter(|_| !is_level);
            if path == "/v1/scenes/rooms/index.json" {
                asked_for_pointer += 1;
                if asked_for_pointer > 1 {
                    found = Some(later.clone());
                }
            }
            let status = if found.is_some() { "200 OK" } else { "404 Not Found" };
            let body = found.unwrap_or_default();
            let head = format!(
                "HTTP/1.1 {status}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n",
                body.len()
            );
            _ = stream.write_all(head.as_bytes()).and_then(|()| stream.write_all(&body));
        }
    });
    address
}

#[test]
fn a_revision_that_has_gone_while_one_walks_is_named() {
    let data = Data::new();
    data.bake(&data.write("rooms.plan", THREE_ROOMS), "rooms");
    data.ok(&["publish", "rooms", "--to", "tree"]);
    data.bake(&data.write("rooms.plan", THREE_ROOMS.replace(".c.", "..c")), "rooms");
    data.ok(&["publish", "rooms", "--to", "later"]);
    let later = std::fs::read(data.folder("later").join("v1/scenes/rooms/index.json")).expect("a pointer");
    let told: Value = serde_json::from_slice(&later).expect("JSON");

    let address = serves_what_was_published_anew(data.folder("tree"), later);
    let outcome = walk(&data, &address, &[]);
    assert_eq!(outcome["newer_revision"], told["revision"], "{outcome}");
    assert_ne!(outcome["lost_files"], 0, "{outcome}");
    let still = walk(&data, data.folder("tree").to_str().expect("UTF-8"), &[]);
    assert_eq!(still["newer_revision"], Value::Null, "{still}");
}
