//! From an upload to a published scene: jobs, what goes wrong with them, and what survives a kill.

use serde_json::Value;

use crate::{
    live::address,
    live_wire::ask,
    program::{Data, Server, THREE_ROOMS},
    publishing::many_rooms,
    wire::{Answer, get, raw},
};

const ROOMS: &str = "/v1/scenes/rooms";

/// A key for everything.
pub(crate) fn key(data: &Data) -> String {
    data.ok(&["keys", "create", "--new", "--name", "test"])
        .trim()
        .to_owned()
}

async fn put(server: &Server, scene: &str, key: &str, text: &str) -> Answer {
    let body = ("application/octet-stream", text);
    ask(address(server), ("PUT", scene), Some(key), body).await
}

/// Uploads what must be taken; gives the job's address.
async fn upload(server: &Server, key: &str, text: &str) -> String {
    upload_to(server, ROOMS, key, text).await
}

/// The same to the address of any scene.
pub(crate) async fn upload_to(server: &Server, scene: &str, key: &str, text: &str) -> String {
    let answer = put(server, scene, key, text).await;
    assert_eq!(answer.status, 202, "{}", String::from_utf8_lossy(&answer.body));
    let url = answer.header("location").expect("where the job is").to_owned();
    assert_eq!(answer.json()["url"], url.as_str());
    url
}

pub(crate) async fn ended(server: &Server, url: &str) -> Value {
    server.until_shown(url, |job| !job["ended_at"].is_null()).await
}

#[tokio::test(flavor = "multi_thread")]
async fn an_uploaded_scene_is_baked_and_served() {
    let data = Data::new();
    let key = key(&data);
    // It need not be looked for: who is told that it is done finds it.
    let server = data.serve_with(&["--poll-ms", "3600000"]);
    let url = upload(&server, &key, THREE_ROOMS).await;
    // Reads until the server ends the stream.
    let request = format!("GET {url}/events HTTP/1.1\r\nHost: t\r\nConnection: close\r\n\r\n");
    let events = String::from_utf8(raw(address(&server), request.as_bytes()).await).expect("UTF-8");
    assert!(events.contains("event: running\ndata: {"), "{events}");
    assert!(events.contains("\"progress\":{\"stage\":\"visibility\""), "{events}");
    assert_eq!(events.matches("event: done\n").count(), 1, "{events}");

    let job = get(address(&server), &url).await.json();
    assert_eq!((&job["state"], &job["error"]), (&"done".into(), &Value::Null));
    assert_eq!(job["report"]["revision"], job["revision"]);
    let shown = get(address(&server), ROOMS).await.json();
    assert_eq!(shown["revision"], job["revision"]);
    assert_eq!(shown["title"], "rooms", "the scene's name, where the source has none");
    assert!(
        !data
            .path()
            .join("uploads")
            .join(url.trim_start_matches("/v1/jobs/"))
            .exists()
    );

    let again = upload(&server, &key, THREE_ROOMS).await;
    assert_eq!(ended(&server, &again).await["report"]["unchanged"], true);
    let (_, log) = server.stop();
    assert!(log.contains("a scene was uploaded") && !log.contains(&key), "{log}");
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_wrong_with_a_scene_is_the_error_of_its_job() {
    let data = Data::new();
    let key = key(&data);
    let server = data.serve();
    let url = upload(&server, &key, "glTF, but not really").await;
    let job = ended(&server, &url).await;
    assert_eq!((&job["state"], &job["revision"]), (&"failed".into(), &Value::Null));
    assert_eq!(job["error"]["type"], "/problems/bake-failed");
    let detail = job["error"]["detail"].as_str().expect("a sentence");
    assert!(detail.starts_with("cannot import rooms"), "{detail}");
    assert!(!detail.contains("uploads"), "it shows a path of the server: {detail}");
    assert_eq!(get(address(&server), ROOMS).await.status, 404);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_bake_that_needs_too_much_memory_ends_alone() {
    let data = Data::new();
    let key = key(&data);
    let server = data.serve_with(&["--bake-memory-mib", "256"]);
    let url = upload(&server, &key, &many_rooms(20, 20)).await;
    let job = ended(&server, &url).await;
    assert_eq!(
        (&job["state"], &job["error"]["type"]),
        (&"failed".into(), &"/problems/bake-limit".into())
    );
    assert!(
        job["error"]["detail"].as_str().expect("a sentence").contains("256 MiB"),
        "{job}"
    );
    assert_eq!(get(address(&server), "/readyz").await.status, 200);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_whose_server_is_killed_goes_on_with_the_next_one() {
    let plan = many_rooms(4, 4);
    let data = Data::new();
    let key = key(&data);
    let server = data.serve();
    let url = upload(&server, &key, &plan).await;
    let found = data.path().join("bakes/rooms.found");
    server
        .until_shown(&url, |_| {
            std::fs::read(&found).is_ok_and(|text| text.iter().filter(|byte| **byte == b'\n').count() > 5)
        })
        .await;
    server.kill();
    // The child is tied to its server: it lets go of what it holds, and has published nothing.
    let held = std::fs::File::open(data.path().join("bakes/rooms.lock")).expect("the child's lock");
    held.lock().expect("the child ends");
    drop(held);
    assert!(data.fails(&["inspect", "rooms"]).contains("no scene `rooms`"));

    let server = data.serve();
    let job = ended(&server, &url).await;
    assert_eq!((&job["state"], &job["error"]), (&"done".into(), &Value::Null));
    let known = job["report"]["visibility"]["remembered_cells"]
        .as_u64()
        .expect("a count");
    assert!(known >= 5, "it began anew: {known}");
    server
        .until_shown(ROOMS, |shown| shown["revision"] == job["revision"])
        .await;

    let whole = Data::new();
    let alone = whole.bake(&whole.write("rooms", &plan), "rooms");
    assert_eq!(alone["revision"], job["revision"], "another world came out");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_that_is_cancelled_publishes_nothing_and_the_next_one_has_its_turn() {
    let data = Data::new();
    let key = key(&data);
    let server = data.serve();
    let first = upload(&server, &key, &many_rooms(8, 8)).await;
    let second = upload(&server, &key, THREE_ROOMS).await;
    let third = upload(&server, &key, THREE_ROOMS).await;
    server
        .until_shown(&first, |job| job["progress"]["stage"] == "visibility")
        .await;
    assert!(data.fails(&["gc"]).contains("is being baked"), "gc ran beside a bake");
    assert_eq!(
        get(address(&server), &second).await.json()["state"],
        "queued",
        "two of one scene at once"
    );
    let nobody = ask(address(&server), ("DELETE", &first), None, ("application/json", "")).await;
    assert_eq!(nobody.problem()["status"], 401);
    for waiting_or_running in [&third, &first] {
        let gone = ask(
            address(&server),
            ("DELETE", waiting_or_running),
            Some(&key),
            ("application/json", ""),
        )
        .await;
        assert_eq!((gone.status, &gone.json()["state"]), (200, &"cancelled".into()));
    }
    let job = ended(&server, &second).await;
    assert_eq!(job["state"], "done");
    server
        .until_shown(ROOMS, |shown| shown["revision"] == job["revision"])
        .await;
    let late = ask(
        address(&server),
        ("DELETE", &second),
        Some(&key),
        ("application/json", ""),
    )
    .await;
    assert_eq!(late.json()["state"], "done", "what is published stays");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scene_goes_back_to_an_earlier_revision_and_gc_keeps_what_is_shown() {
    let data = Data::new();
    let key = key(&data);
    let reader = data.ok(&["keys", "create", "--scope", "publish"]);
    let first = data.bake(&data.write("a.plan", THREE_ROOMS), "rooms");
    let server = data.serve_with(&["--poll-ms", "3600000"]);
    let rollback = async |key: &str, body: &str| {
        ask(
            address(&server),
            ("POST", "/v1/scenes/rooms/rollback"),
            Some(key),
            ("application/json", body),
        )
        .await
    };
    assert_eq!(
        rollback(&key, "").await.problem()["status"],
        409,
        "there is nothing before"
    );
    let second = data.bake(&data.write("b.plan", "#####\n#a.b#\n#...#\n#####\n"), "rooms");
    assert_eq!(rollback(reader.trim(), "").await.problem()["status"], 403);
    let moved = rollback(&key, "").await;
    assert_eq!(
        (moved.status, &moved.json()["revision"], &moved.json()["from"]),
        (200, &first["revision"], &second["revision"])
    );
    let shown = get(address(&server), ROOMS).await.json();
    assert_eq!(shown["revision"], first["revision"]);

    data.ok(&["gc", "--keep", "1"]);
    let wrong = rollback(&key, r#"{"revision": "0000000000000000"}"#).await.problem();
    assert_eq!(
        (&wrong["status"], &wrong["pointer"]),
        (&400.into(), &"/revision".into())
    );
    let there = format!(r#"{{"revision": {}}}"#, second["revision"]);
    assert_eq!(rollback(&key, &there).await.status, 200, "the newest one is kept too");
    data.ok(&["gc", "--keep", "1"]);
    assert_eq!(rollback(&key, "{}").await.status, 409, "gc has taken the other one");
    let listed: Value = serde_json::from_str(&data.ok(&["rollback", "rooms", "--list", "--json"])).expect("JSON");
    assert_eq!(listed.as_array().expect("a list").len(), 1);
    assert_eq!(
        (&listed[0]["revision"], &listed[0]["current"]),
        (&second["revision"], &true.into())
    );
}
