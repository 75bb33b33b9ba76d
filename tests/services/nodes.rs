//! Do two servers with folders of their own serve the same, and share the work?

use std::{
    io::{BufRead, BufReader},
    process::Stdio,
};

use belvedere_scene::BlobHash;
use serde_json::Value;

use crate::{
    faulty::{Fault, Faulty},
    live_wire::ask,
    program::{Data, Server, THREE_ROOMS},
    shared::{Database, PASSWORD, bucket, s3},
    wire::{get, send},
};

const ROOMS: &str = "/v1/scenes/rooms";

/// What several nodes share, as arguments.
pub(crate) struct Shared {
    pub(crate) database: Database,
    bucket: String,
    endpoint: String,
}

impl Shared {
    pub(crate) async fn new() -> Self {
        Self {
            database: Database::new().await,
            bucket: bucket().await,
            endpoint: format!("http://{}", s3()),
        }
    }

    pub(crate) fn args<'a>(&'a self, args: &[&'a str]) -> Vec<&'a str> {
        let place = [
            "--database",
            &self.database.url,
            "--store",
            &self.bucket,
            "--store-endpoint",
            &self.endpoint,
        ];
        [args, &place].concat()
    }

    fn node(&self, data: &Data, args: &[&str]) -> Server {
        data.serve_with(&self.args(&[args, &["--poll-ms", "50"]].concat()))
    }

    fn ok(&self, data: &Data, args: &[&str]) -> String {
        data.ok(&self.args(args))
    }

    fn bake(&self, data: &Data, plan: &str) -> Value {
        let file = data.write("rooms.plan", plan);
        let said = self.ok(data, &["bake", file.to_str().unwrap(), "--scene", "rooms", "--json"]);
        serde_json::from_str(&said).unwrap()
    }
}

fn without_secrets(server: Server) -> String {
    let (_, log) = server.stop();
    assert!(!log.contains(PASSWORD) && !log.contains("not-a-secret"), "{log}");
    log
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "needs PostgreSQL and an S3 server: make test-services"]
async fn what_one_node_publishes_another_one_serves() {
    let shared = Shared::new().await;
    let (here, there) = (Data::new(), Data::new());
    let first = shared.bake(&here, THREE_ROOMS);
    assert_eq!(
        shared.bake(&there, THREE_ROOMS)["unchanged"],
        true,
        "another node knows it"
    );
    let (a, b) = (shared.node(&here, &[]), shared.node(&there, &[]));
    let pointer = get(b.address(), ROOMS).await.json();
    assert_eq!(pointer["revision"], first["revision"]);
    let manifest = pointer["manifest"].as_str().unwrap().to_owned();
    let (from_a, from_b) = (get(a.address(), &manifest).await, get(b.address(), &manifest).await);
    assert!(from_a.status == 200 && from_a.body == from_b.body);
    assert_eq!(from_a.header("etag"), from_b.header("etag"));
    let part = send(b.address(), "GET", &manifest, &[("Range", "bytes=2-9")]).await;
    assert_eq!((part.status, &part.body[..]), (206, &from_a.body[2..10]));
    let zstd = send(b.address(), "GET", &manifest, &[("Accept-Encoding", "zstd")]).await;
    assert_eq!(zstd::decode_all(&zstd.body[..]).unwrap(), from_a.body);

    let second = shared.bake(&here, &THREE_ROOMS.replace('c', "."));
    assert_ne!(first["revision"], second["revision"]);
    b.until_shown(ROOMS, |shown| shown["revision"] == second["revision"])
        .await;
    shared.ok(&there, &["rollback", "rooms"]);
    a.until_shown(ROOMS, |shown| shown["revision"] == first["revision"])
        .await;
    assert!(
        shared
            .ok(&there, &["gc", "--keep", "1"])
            .contains("removed 0 revisions"),
        "the newest and the current one"
    );
    shared.ok(&there, &["inspect", "rooms"]);
    let tree = there.folder("tree");
    shared.ok(&there, &["publish", "rooms", "--to", tree.to_str().unwrap()]);
    assert_eq!(
        std::fs::read(tree.join(manifest.trim_start_matches('/'))).unwrap(),
        from_a.body
    );
    // The same tree in a bucket, which says of each file what a server would.
    let site = bucket().await;
    shared.ok(&there, &["publish", "rooms", "--to", &site]);
    let site = site.trim_start_matches("s3:/");
    for (path, kind, life) in [
        (
            manifest.as_str(),
            "application/json",
            "public, max-age=31536000, immutable",
        ),
        (
            "/v1/scenes/rooms/index.json",
            "application/json",
            "public, max-age=2, stale-while-revalidate=30",
        ),
        (
            "/v1/scenes/index.json",
            "application/json",
            "public, max-age=2, stale-while-revalidate=30",
        ),
    ] {
        // The test server wants a key, and takes any.
        let somebody = [("Authorization", "AWS belvedere:")];
        let object = send(s3(), "GET", &format!("{site}{path}"), &somebody).await;
        let served = get(a.address(), path).await;
        assert!(object.status == 200 && object.body == served.body, "{path}: {object:?}");
        assert_eq!(
            (object.header("content-type"), object.header("cache-control")),
            (Some(kind), Some(life))
        );
        assert_eq!(served.header("cache-control"), Some(life));
    }
    let checked = shared.ok(&here, &["serve", "--listen", "127.0.0.1:0", "--check-config"]);
    assert!(!checked.contains(PASSWORD), "{checked}");
    without_secrets(a);
    without_secrets(b);
    shared.database.drop().await;
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "needs PostgreSQL and an S3 server: make test-services"]
async fn while_the_store_fails_nobody_is_told_wrong_bytes_and_no_cache_keeps_the_error() {
    let mut shared = Shared::new().await;
    let data = Data::new();
    shared.bake(&data, THREE_ROOMS);
    let faulty = Faulty::before(s3()).await;
    shared.endpoint = format!("http://{}", faulty.address);
    let server = shared.node(&data, &[]).may_warn();
    let pointer = get(server.address(), ROOMS).await.json();
    let manifest = pointer["manifest"].as_str().unwrap();
    for (fault, status) in [
        (Fault::Fails, 503),
        (Fault::CutsBodies, 503),
        (Fault::ChangesBodies, 500),
    ] {
        faulty.set(fault);
        let answer = get(server.address(), manifest).await;
        assert_eq!(
            (answer.status, answer.header("cache-control")),
            (status, Some("no-store")),
            "{fault:?}"
        );
        answer.problem();
    }
    assert_eq!(get(server.address(), "/healthz").await.status, 200);
    faulty.set(Fault::None);
    let answer = get(server.address(), manifest).await;
    let hash = manifest.trim_start_matches("/o/").trim_end_matches(".json");
    assert_eq!(
        (answer.status, BlobHash::of(&answer.body).to_string()),
        (200, hash.to_owned())
    );
    faulty.set(Fault::Fails);
    assert_eq!(get(server.address(), manifest).await.status, 200, "it is in memory");
    without_secrets(server);
    shared.database.drop().await;
}

async fn upload(server: &Server, key: &str, plan: &str) -> String {
    let answer = ask(
        server.address(),
        ("PUT", ROOMS),
        Some(key),
        ("application/octet-stream", plan),
    )
    .await;
    assert_eq!(answer.status, 202, "{}", String::from_utf8_lossy(&answer.body));
    answer.header("location").unwrap().to_owned()
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "needs PostgreSQL and an S3 server: make test-services"]
async fn what_is_baked_while_the_store_takes_nothing_waits_and_is_published_when_it_does() {
    let mut shared = Shared::new().await;
    let data = Data::new();
    let key = shared.ok(&data, &["keys", "create"]).trim().to_owned();
    let faulty = Faulty::before(s3()).await;
    shared.endpoint = format!("http://{}", faulty.address);
    let server = shared.node(&data, &[]).may_warn();
    // All else it takes: what is uploaded, too.
    faulty.set(Fault::TakesNoBlobs);
    let job = upload(&server, &key, THREE_ROOMS).await;
    server
        .until_it_says("the store does not answer; the bake waits for it")
        .await;
    let waiting = get(server.address(), &job).await.json();
    assert_eq!(
        (&waiting["state"], &waiting["error"]),
        (&"running".into(), &Value::Null)
    );
    faulty.set(Fault::None);
    let ended = server.until_shown(&job, |job| !job["ended_at"].is_null()).await;
    assert_eq!((&ended["state"], &ended["error"]), (&"done".into(), &Value::Null));

    // A bake of a person waits as well, and says so.
    faulty.set(Fault::TakesNoBlobs);
    let file = data.write("other.plan", many_rooms(2));
    let args = ["bake", file.to_str().unwrap(), "--scene", "other"];
    let mut bake = data
        .command(&shared.args(&args))
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut said = BufReader::new(bake.stderr.take().unwrap()).lines().map(Result::unwrap);
    assert!(said.any(|line| line.contains("the store does not answer; the bake waits for it")));
    faulty.set(Fault::None);
    assert!(said.any(|line| line == "the bake goes on"));
    assert!(bake.wait().unwrap().success());
    without_secrets(server);
    shared.database.drop().await;
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "needs PostgreSQL and an S3 server: make test-services"]
async fn an_upload_is_baked_once_by_whoever_is_free() {
    let shared = Shared::new().await;
    let data = [Data::new(), Data::new(), Data::new()];
    let key = shared.ok(&data[0], &["keys", "create"]).trim().to_owned();
    let taking = shared.node(&data[0], &["--max-bakes", "0"]);
    let baking = [shared.node(&data[1], &[]), shared.node(&data[2], &[])];
    let mut jobs = Vec::new();
    for i in 0..3 {
        jobs.push(upload(&taking, &key, &THREE_ROOMS.replace('a', &"a.".repeat(i + 1)[..1])).await);
        assert_eq!(
            std::fs::read_dir(data[0].path().join("uploads")).map_or(0, Iterator::count),
            0
        );
    }
    for job in &jobs {
        let ended = taking.until_shown(job, |job| !job["ended_at"].is_null()).await;
        assert_eq!((&ended["state"], &ended["error"]), (&"done".into(), &Value::Null));
    }
    let logs = baking.map(without_secrets);
    for job in &jobs {
        let line = format!("a bake starts job={}", job.trim_start_matches("/v1/jobs/"));
        let starts: usize = logs.iter().map(|log| log.matches(&line).count()).sum();
        assert_eq!(starts, 1, "{logs:?}");
    }
    for data in &data {
        assert_eq!(
            std::fs::read_dir(data.path().join("uploads")).map_or(0, Iterator::count),
            0
        );
    }
    let bucket = shared.bucket.trim_start_matches("s3://").trim_end_matches("/worlds");
    let left = get(s3(), &format!("/{bucket}?list-type=2&prefix=worlds/uploads/")).await;
    assert!(!String::from_utf8_lossy(&left.body).contains("<Contents>"), "{left:?}");
    without_secrets(taking);
    shared.database.drop().await;
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "needs PostgreSQL and an S3 server: make test-services"]
async fn a_bake_on_another_node_can_be_cancelled_and_keeps_gc_away() {
    let shared = Shared::new().await;
    let (here, there) = (Data::new(), Data::new());
    let key = shared.ok(&here, &["keys", "create"]).trim().to_owned();
    let taking = shared.node(&here, &["--max-bakes", "0"]);
    let baking = shared.node(&there, &[]);
    let job = upload(&taking, &key, &many_rooms(12)).await;
    baking
        .until_shown(&job, |job| job["progress"]["stage"] == "visibility")
        .await;
    // The node that took it knows from the catalogue how far it is, and tells whoever follows it.
    taking
        .until_shown(&job, |job| job["progress"]["stage"] == "visibility")
        .await;
    let refused = here.fails(&shared.args(&["gc"]));
    assert!(refused.contains("by another node"), "{refused}");
    let answer = ask(taking.address(), ("DELETE", &job), Some(&key), ("application/json", "")).await;
    assert_eq!((answer.status, &answer.json()["state"]), (200, &"cancelled".into()));
    assert_eq!(get(taking.address(), ROOMS).await.status, 404);
    without_secrets(taking);
    without_secrets(baking);
    shared.database.drop().await;
}

/// A square of closed rooms.
pub(crate) fn many_rooms(side: usize) -> String {
    let wall = "#".repeat(4 * side + 1);
    let row = format!("#{}", "a..#".repeat(side));
    let mut plan = format!("{wall}\n");
    for _ in 0..side {
        plan += &format!("{row}\n{}\n{wall}\n", row.replace('a', "."));
    }
    plan
}
