//! Publishing adds and moves one pointer, last: a reader sees the old revision or the new one, whole.

use std::time::Duration;

use belvedere_client::HttpSource;
use belvedere_scene::{Revision, SceneName};
use serde_json::json;

use crate::{
    boxes::two_rooms,
    doors::{document, names},
    live_wire::{Person, json as ask},
    program::{Data, Server, THREE_ROOMS},
    resuming::is_kept,
    wire::{get, send},
};

const OTHER_ROOMS: &str = "#####\n#a.b#\n#...#\n#####\n";

fn revision(report: &serde_json::Value) -> Revision {
    report["revision"]
        .as_str()
        .expect("a revision")
        .parse()
        .expect("a revision")
}

/// Waits until a server shows a revision.
async fn shows(server: &Server, wanted: Revision) {
    let name: SceneName = "rooms".parse().expect("a name");
    for _ in 0..100 {
        if server.client().open(&name).await.expect("a scene").pointer().revision == wanted {
            return;
        }
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    panic!("the new revision did not appear within ten seconds");
}

async fn enter(server: &Server, x: f64, avatar: Option<&str>) -> Person {
    let body = json!({"position": [x, 1.5, 2.5], "max_speed_mps": 1.5, "radius_m": 0.3, "avatar": avatar});
    Person::enter_scene(server.address(), "rooms", &body).await
}

#[tokio::test(flavor = "multi_thread")]
async fn who_comes_where_nobody_is_comes_into_the_newest_revision() {
    let data = Data::new();
    data.bake(&data.write("rooms.plan", THREE_ROOMS), "rooms");
    let server = data.serve();
    let first = enter(&server, 2.5, None).await;
    assert_eq!(first.leave().await, 204);
    let second = data.bake(&data.write("rooms.glb", two_rooms()), "rooms");
    shows(&server, revision(&second)).await;
    // Of the old one nothing can be read any more.
    data.ok(&["gc", "--keep", "1"]);
    let (west, east) = tokio::join!(enter(&server, 2.5, None), enter(&server, 8.0, None));
    for person in [west, east] {
        let mut hears = person.listen().await;
        assert_eq!(hears.wait("hello").await.data["revision"], second["revision"]);
        hears.wait("object-info").await;
        assert!(!hears.text.contains("event: revision"), "{}", hears.text);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_worn_by_those_who_outlive_the_server_outlives_its_revision() {
    let data = Data::new();
    data.bake(&data.write("rooms.plan", THREE_ROOMS), "rooms");
    let server = data.serve();
    let source = HttpSource::new(&server.base).expect("an address");
    let all = names(&document(&source, "/v1/scenes/rooms/objects?bbox=-9,-9,-9,99,9,99&limit=1000").await);
    let models = [&all[0].1, &all[all.len() - 1].1];
    let watcher = enter(&server, 2.0, None).await;
    let mut hears = watcher.listen().await;
    hears.wait("hello").await;
    let worn = enter(&server, 2.5, Some(models[0])).await;
    let mover = json!({"position": [3.0, 1.5, 2.5], "persistent": true, "avatar": models[1]});
    let made = ask(server.address(), ("POST", "/v1/scenes/rooms/movers"), None, &mover).await;
    assert_eq!(made.status, 201, "{made:?}");
    let mut urls = Vec::new();
    while urls.len() < 2 {
        let info = hears.wait("object-info").await.data;
        urls.push(info["levels"][0]["url"].as_str().expect("a model").to_owned());
    }
    assert_ne!(urls[0], urls[1]);
    is_kept(&data, &worn.session, |_| true).await;
    server.kill();

    data.bake(&data.write("rooms.glb", two_rooms()), "rooms");
    data.ok(&["gc", "--keep", "1"]);
    let server = data.serve();
    for url in urls {
        assert_eq!(get(server.address(), &url).await.status, 200, "{url}");
    }
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
    shows(&server, revision(&second)).await;
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
fn gc_with_another_catalogue_refuses_and_removes_nothing() {
    let (ours, theirs) = (Data::new(), Data::new());
    let plan = ours.write("a.plan", THREE_ROOMS);
    ours.bake(&plan, "rooms");
    theirs.ok(&["keys", "create", "--new"]);
    let [here, there] = [&ours, &theirs].map(|data| data.path().join("o"));
    std::fs::rename(&here, &there).expect("it is moved");
    for args in [&["gc"][..], &["gc", "--dry-run"], &["gc", "--keep", "1"]] {
        let told = theirs.fails(args);
        assert!(
            told.contains("the store belongs to catalogue ") && told.contains("--adopt"),
            "{told}"
        );
    }
    // One from before stores said whose they are.
    let about = "Immutable objects, named by the SHA-256 of their content.\n";
    std::fs::write(there.join("belvedere-store"), about).expect("written");
    let told = theirs.fails(&["gc"]);
    assert!(told.contains("of which this catalogue needs 0"), "{told}");
    std::fs::rename(&there, &here).expect("it is moved back");
    let kept: serde_json::Value = serde_json::from_str(&ours.ok(&["gc", "--json"])).expect("JSON");
    assert!(kept["blobs"] == 0 && kept["kept_blobs"].as_u64() > Some(0), "{kept}");
    std::fs::rename(&here, &there).expect("it is moved");
    theirs.bake(&plan, "other");
    let told = theirs.fails(&["gc"]);
    assert!(
        told.contains("the store belongs to catalogue "),
        "the right one has taken it: {told}"
    );
    theirs.ok(&["gc", "--adopt"]);
    theirs.ok(&["gc"]);
    theirs.ok(&["inspect", "other"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scene_that_is_removed_is_no_more_and_its_space_is_freed() {
    let data = Data::new();
    let plan = data.write("a.plan", THREE_ROOMS);
    data.bake(&plan, "rooms");
    data.bake(&data.write("b.plan", OTHER_ROOMS), "others");
    let server = data.serve();
    assert!(data.fails(&["remove", "nowhere"]).contains("no scene `nowhere`"));
    let removed: serde_json::Value = serde_json::from_str(&data.ok(&["remove", "rooms", "--json"])).expect("JSON");
    assert_eq!(removed["revisions"], 1);
    let mut status = 200;
    for _ in 0..3_000 {
        status = send(server.address(), "GET", "/v1/scenes/rooms", &[]).await.status;
        if status == 404 {
            break;
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    assert_eq!(status, 404, "it is served on");
    assert_eq!(
        send(server.address(), "GET", "/v1/scenes/others", &[]).await.status,
        200
    );
    let freed: serde_json::Value = serde_json::from_str(&data.ok(&["gc", "--json"])).expect("JSON");
    assert!(freed["blobs"].as_u64() > Some(0), "{freed}");
    data.ok(&["inspect", "others"]);
    data.ok(&["remove", "others"]);
    data.ok(&["gc"]);
    assert_eq!(data.bake(&plan, "rooms")["unchanged"], false);
}

#[test]
fn who_publishes_into_a_tree_waits_for_whoever_does_so() {
    let data = Data::new();
    let names = ["a", "b", "c", "d"];
    for name in names {
        data.bake(&data.write(&format!("{name}.plan"), THREE_ROOMS), name);
    }
    let lock = std::fs::File::create(data.write("tree/.belvedere-publish.lock", "")).expect("a file");
    lock.lock().expect("nobody publishes");
    let publishing = names.map(|name| {
        let mut publish = data.command(&["publish", name, "--to", "tree"]);
        publish.stdout(std::process::Stdio::null()).spawn().expect("runs")
    });
    std::thread::sleep(Duration::from_millis(500));
    assert!(!data.folder("tree/o").exists(), "nobody has waited");
    drop(lock);
    for mut publish in publishing {
        assert!(publish.wait().expect("it ends").success());
    }
    let list = std::fs::read(data.folder("tree/v1/scenes/index.json")).expect("a list");
    let list: serde_json::Value = serde_json::from_slice(&list).expect("JSON");
    assert_eq!(list["scenes"].as_array().map(Vec::len), Some(names.len()), "{list}");
}

#[test]
fn what_a_publish_has_left_that_was_killed_is_gone_after_the_next_one() {
    let data = Data::new();
    data.bake(&data.write("a.plan", THREE_ROOMS), "rooms");
    data.ok(&["publish", "rooms", "--to", "tree"]);
    let left = [
        "index.html.71.new",
        "v1/scenes/index.json.71.new",
        "v1/scenes/rooms/index.json.71.new",
        "o/0a.slod.0.71.new",
        "o/0a.glb#3",
    ];
    let others = ["notes.2026.new", "index.html.new", "mine/index.html.71.new"];
    let write = |file: &&str| data.write(&format!("tree/{file}"), "half");
    let (left, others) = (left.each_ref().map(write), others.each_ref().map(write));
    data.ok(&["publish", "rooms", "--to", "tree"]);
    assert!(left.iter().all(|file| !file.exists()), "{left:?}");
    assert!(others.iter().all(|file| file.exists()), "they are somebody else's");
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
    let plan = many_rooms(3, 3);
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
fn going_back_leads_to_what_was_baked_before_and_not_to_the_preview_of_what_is_bad() {
    let data = Data::new();
    let good = data.bake(&data.write("good.plan", THREE_ROOMS), "rooms");
    let bad = data.write("bad.plan", many_rooms(3, 2));
    data.ok(&["bake", bad.to_str().expect("UTF-8"), "--scene", "rooms", "--preview"]);
    let listed: serde_json::Value =
        serde_json::from_str(&data.ok(&["rollback", "rooms", "--list", "--json"])).expect("JSON");
    let previews: Vec<_> = listed
        .as_array()
        .expect("a list")
        .iter()
        .map(|kept| &kept["preview"])
        .collect();
    assert_eq!(previews, [false, true, false]);
    for _ in 0..2 {
        let moved: serde_json::Value = serde_json::from_str(&data.ok(&["rollback", "rooms", "--json"])).expect("JSON");
        assert_eq!(moved["revision"], good["revision"]);
        data.ok(&["rollback", "rooms", "--to", moved["from"].as_str().expect("a revision")]);
        data.ok(&["gc", "--keep", "2"]);
    }
}

#[test]
fn a_preview_is_the_same_world_with_larger_sets_and_gives_way_to_the_whole_bake() {
    let data = Data::new();
    let file = data.write("rooms.plan", many_rooms(3, 2));
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
