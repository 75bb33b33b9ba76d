//! Publishing adds and moves one pointer, last: a reader sees the old revision or the new one, whole.

use std::time::Duration;

use belvedere_scene::{Revision, SceneName};

use crate::{
    program::{Data, THREE_ROOMS},
    wire::send,
};

const OTHER_ROOMS: &str = "#####\n#a.b#\n#...#\n#####\n";

fn revision(report: &serde_json::Value) -> Revision {
    report["revision"]
        .as_str()
        .expect("a revision")
        .parse()
        .expect("a revision")
}

#[tokio::test(flavor = "multi_thread")]
async fn a_new_revision_appears_without_a_restart_and_the_old_one_stays_readable() {
    let data = Data::new();
    let name: SceneName = "rooms".parse().expect("a name");
    let first = data.bake(&data.write("rooms.plan", THREE_ROOMS), "rooms");
    let server = data.serve();
    let old = server.client().open(&name).await.expect("a scene");
    assert_eq!(old.pointer().revision, revision(&first));

    let second = data.bake(&data.write("rooms.plan", OTHER_ROOMS), "rooms");
    assert_ne!(revision(&first), revision(&second));
    let mut seen = old.pointer().revision;
    for _ in 0..100 {
        seen = server.client().open(&name).await.expect("a scene").pointer().revision;
        if seen == revision(&second) {
            break;
        }
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    assert_eq!(
        seen,
        revision(&second),
        "the new revision did not appear within ten seconds"
    );
    let info = old
        .object(belvedere_scene::ObjectId(0))
        .await
        .expect("the old revision is still there");
    old.blob(&info.levels[0].url).await.expect("its blobs too");
}

#[test]
fn an_unchanged_source_is_not_baked_twice() {
    let data = Data::new();
    let file = data.write("rooms.plan", THREE_ROOMS);
    let first = data.bake(&file, "rooms");
    let again = data.bake(&file, "rooms");
    assert_eq!(
        (first["unchanged"].as_bool(), again["unchanged"].as_bool()),
        (Some(false), Some(true))
    );
    assert_eq!(first["revision"], again["revision"]);
}

#[test]
fn a_bake_that_is_killed_leaves_the_old_revision_and_only_garbage() {
    let data = Data::new();
    let first = data.bake(&data.write("rooms.plan", OTHER_ROOMS), "rooms");
    let next = data.write("museum.plan", include_str!("../fixtures/museum.plan"));
    let mut killed = 0;
    for wait_ms in [20, 200, 800, 2000] {
        let mut bake = data
            .command(&["bake", next.to_str().expect("UTF-8"), "--scene", "rooms"])
            .spawn()
            .expect("runs");
        std::thread::sleep(Duration::from_millis(wait_ms));
        if bake.try_wait().expect("a status").is_none() {
            bake.kill().expect("it can be killed");
            killed += 1;
        }
        bake.wait().expect("it ends");
    }
    assert!(killed > 0, "every bake was done before it could be killed");
    let shown: serde_json::Value =
        serde_json::from_str(&data.ok(&["inspect", "rooms", "--json"])).expect("the old revision is whole");
    assert_eq!(shown["report"]["revision"], first["revision"]);

    data.ok(&["gc", "--json"]);
    let shown: serde_json::Value =
        serde_json::from_str(&data.ok(&["inspect", "rooms", "--json"])).expect("still whole");
    assert_eq!(shown["report"]["revision"], first["revision"]);
    let again: serde_json::Value = serde_json::from_str(&data.ok(&["gc", "--json"])).expect("JSON");
    assert_eq!(again["blobs"], 0, "gc leaves no garbage");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_log_holds_ids_of_requests_as_they_came() {
    let data = Data::new();
    let server = data.serve_with(&["--log", "debug", "--log-format", "json"]);
    let answer = send(server.address(), "GET", "/v1/scenes", &[("X-Request-Id", "walk-7")]).await;
    assert_eq!(answer.status, 200);
    let (_, log) = server.stop();
    assert!(log.contains(r#""id":"walk-7""#), "{log}");
}

#[test]
fn gc_keeps_what_the_newest_revisions_need() {
    let data = Data::new();
    data.bake(&data.write("a.plan", THREE_ROOMS), "rooms");
    let second = data.bake(&data.write("b.plan", OTHER_ROOMS), "rooms");
    let kept: serde_json::Value = serde_json::from_str(&data.ok(&["gc", "--keep", "2", "--json"])).expect("JSON");
    assert_eq!((&kept["revisions"], &kept["blobs"]), (&0.into(), &0.into()));
    let planned: serde_json::Value =
        serde_json::from_str(&data.ok(&["gc", "--keep", "1", "--dry-run", "--json"])).expect("JSON");
    let removed: serde_json::Value = serde_json::from_str(&data.ok(&["gc", "--keep", "1", "--json"])).expect("JSON");
    assert_eq!(removed["revisions"], 1);
    assert!(removed["blobs"].as_u64() > Some(0));
    assert_eq!(
        (&planned["blobs"], &planned["bytes"]),
        (&removed["blobs"], &removed["bytes"])
    );
    let shown: serde_json::Value = serde_json::from_str(&data.ok(&["inspect", "rooms", "--json"])).expect("JSON");
    assert_eq!(shown["report"]["revision"], second["revision"]);
}

#[test]
fn a_server_that_is_asked_to_stop_ends_with_success() {
    let data = Data::new();
    data.bake(&data.write("rooms.plan", OTHER_ROOMS), "rooms");
    let (code, log) = data.serve().stop();
    assert_eq!(code, Some(0), "{log}");
}

#[test]
fn the_same_source_gives_the_same_revision_whatever_the_thread_count() {
    let revisions = ["1", "2"].map(|threads| {
        let data = Data::new();
        let file = data.write("rooms.plan", THREE_ROOMS);
        let file = file.to_str().expect("UTF-8");
        let report = data.ok(&["bake", file, "--scene", "rooms", "--threads", threads, "--json"]);
        revision(&serde_json::from_str(&report).expect("JSON"))
    });
    assert_eq!(revisions[0], revisions[1]);
}

/// Rooms on a grid, open to the next row, with something in each.
pub(crate) fn many_rooms(columns: usize, rows: usize) -> String {
    let line = |part: &str| format!("#{}\n", part.repeat(columns));
    let room = [".....#", ".a...#", "...b.#"].map(line).concat();
    let between = line("##.###");
    let outside = line("######");
    format!("{outside}{}{outside}", vec![room; rows].join(&between))
}

#[test]
fn a_bake_that_is_killed_goes_on_where_it_was() {
    let plan = many_rooms(4, 4);
    let in_one_go = {
        let data = Data::new();
        data.bake(&data.write("rooms.plan", &plan), "rooms")
    };
    assert_eq!(in_one_go["visibility"]["remembered_cells"], 0);
    let data = Data::new();
    let file = data.write("rooms.plan", &plan);
    let found = data.path().join("bakes/rooms.found");
    let lines = || {
        std::fs::read(&found).map_or(0, |text| {
            text.split(|byte| *byte == b'\n').filter(|l| !l.is_empty()).count()
        })
    };
    let mut bake = data
        .command(&[
            "bake",
            file.to_str().expect("UTF-8"),
            "--scene",
            "rooms",
            "--threads",
            "1",
        ])
        .spawn()
        .expect("runs");
    while lines() < 5 {
        assert!(
            bake.try_wait().expect("a status").is_none(),
            "done before it could be killed"
        );
        std::thread::sleep(Duration::from_millis(5));
    }
    bake.kill().expect("it can be killed");
    bake.wait().expect("it ends");
    let kept = lines();
    let cells = in_one_go["cells"].as_u64().expect("a count");
    assert!((kept as u64) < cells, "killed after {kept} of {cells} cells");
    let gone_on = data.bake(&file, "rooms");
    assert_eq!(gone_on["visibility"]["remembered_cells"], kept);
    assert_eq!(revision(&gone_on), revision(&in_one_go));
}

#[test]
fn a_preview_is_the_same_world_with_larger_sets_and_gives_way_to_the_whole_bake() {
    let data = Data::new();
    let file = data.write("rooms.plan", many_rooms(4, 3));
    let said = data.ok(&["bake", file.to_str().expect("UTF-8"), "--scene", "rooms", "--preview"]);
    let published: Vec<_> = said
        .lines()
        .filter(|line| line.contains("published: revision"))
        .collect();
    assert_eq!(published.len(), 2, "{said}");
    assert!(said.contains("a first look; smaller sets follow"), "{said}");
    let shown: serde_json::Value =
        serde_json::from_str(&data.ok(&["inspect", "rooms", "--json"])).expect("a whole revision");
    let last = shown["report"]["revision"].as_str().expect("a revision");
    assert!(published[1].contains(last), "{said}");
    // What is current is not the preview, so there is nothing to bake.
    assert_eq!(data.bake(&file, "rooms")["unchanged"], true);
}
