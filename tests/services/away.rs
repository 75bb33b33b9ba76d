//! What is served while the database is away, and does everything go on when it is back? With a PostgreSQL of its own, that
//! is ended as a crash would.

use std::{
    io::{BufRead, BufReader},
    path::PathBuf,
    process::{Command, Stdio},
    time::Duration,
};

use serde_json::Value;

use crate::{
    live_wire::ask,
    nodes::many_rooms,
    program::{Data, THREE_ROOMS},
    wire::{Answer, get},
};

/// A PostgreSQL that can be ended and started again.
pub(crate) struct Postgres {
    folder: PathBuf,
    port: u16,
}

impl Postgres {
    pub(crate) fn start(name: &str) -> Self {
        let folder = std::env::var("BELVEDERE_TEST_FOLDER").expect("run `make test-services`");
        let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let postgres = Self {
            folder: PathBuf::from(folder).join(name),
            port: free.local_addr().unwrap().port(),
        };
        drop(free);
        postgres.again();
        postgres
    }

    pub(crate) fn again(&self) {
        self.script("start", &[&self.port.to_string()]);
    }

    pub(crate) fn kill(&self) {
        self.script("kill", &[]);
    }

    fn script(&self, what: &str, args: &[&str]) {
        let mut script = Command::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/services/postgres.sh"));
        assert!(
            script
                .arg(what)
                .arg(&self.folder)
                .args(args)
                .status()
                .unwrap()
                .success()
        );
    }

    pub(crate) fn url(&self) -> String {
        format!("postgres://belvedere@127.0.0.1:{}/postgres", self.port)
    }
}

fn says(answer: &Answer, line: &str) -> bool {
    String::from_utf8_lossy(&answer.body).lines().any(|said| said == line)
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "needs PostgreSQL: make test-services"]
async fn what_is_known_is_served_while_the_database_is_away_and_all_goes_on_when_it_is_back() {
    let postgres = Postgres::start("away");
    let (data, url) = (Data::new(), postgres.url());
    let bake = |plan: &str| -> Value {
        let file = data.write("rooms.plan", plan);
        let file = file.to_str().unwrap();
        let said = data.ok(&["bake", file, "--scene", "rooms", "--json", "--database", &url]);
        serde_json::from_str(&said).unwrap()
    };
    let first = bake(THREE_ROOMS);
    let key = data.ok(&["keys", "create", "--database", &url]).trim().to_owned();
    let server = data.serve_with(&["--database", &url, "--poll-ms", "50"]).may_warn();
    assert_eq!(get(server.address(), "/readyz").await.status, 200);
    let upload = async || {
        let body = ("application/octet-stream", THREE_ROOMS);
        ask(server.address(), ("PUT", "/v1/scenes/other"), Some(&key), body).await
    };

    postgres.kill();
    server
        .until("/metrics", |metrics| says(metrics, "belvedere_catalogue_up 0"))
        .await;
    server.until("/readyz", |ready| ready.status == 503).await;
    let ready = get(server.address(), "/readyz").await;
    assert_eq!(ready.status, 503);
    assert!(
        ready.problem()["detail"]
            .as_str()
            .unwrap()
            .contains("the catalogue does not answer")
    );
    assert_eq!(get(server.address(), "/healthz").await.status, 200);
    let pointer = get(server.address(), "/v1/scenes/rooms").await.json();
    assert_eq!(pointer["revision"], first["revision"]);
    let manifest = pointer["manifest"].as_str().unwrap().to_owned();
    assert_eq!(get(server.address(), &manifest).await.status, 200);
    assert_eq!(
        get(server.address(), "/v1/scenes/rooms/cells/c0/visible").await.status,
        200
    );
    let refused = upload().await;
    assert_eq!((refused.status, refused.header("retry-after")), (503, Some("1")));
    assert_eq!(refused.problem()["type"], "/problems/unavailable");
    let told = data.fails(&["serve", "--listen", "127.0.0.1:0", "--database", &url]);
    assert!(
        told.contains("cannot open the catalogue in PostgreSQL at 127.0.0.1"),
        "{told}"
    );

    postgres.again();
    server.until("/readyz", |ready| ready.status == 200).await;
    server
        .until("/metrics", |metrics| says(metrics, "belvedere_catalogue_up 1"))
        .await;
    let second = bake(&THREE_ROOMS.replace('c', "."));
    server
        .until("/v1/scenes/rooms", |shown| {
            shown.json()["revision"] == second["revision"]
        })
        .await;
    let taken = upload().await;
    assert_eq!(taken.status, 202, "{taken:?}");
    let job = taken.header("location").unwrap().to_owned();
    let ended = server.until(&job, |job| !job.json()["ended_at"].is_null()).await;
    assert_eq!(ended.json()["state"], "done", "{ended:?}");
    let (_, log) = server.stop();
    assert!(
        log.contains("cannot read the catalogue") && log.contains("the catalogue answers again"),
        "{log}"
    );
    postgres.kill();
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "needs PostgreSQL: make test-services"]
async fn a_bake_outlives_the_database_and_publishes_when_it_is_back() {
    let postgres = Postgres::start("bake");
    let (data, url) = (Data::new(), postgres.url());
    let file = data.write("rooms.plan", many_rooms(3));
    let begin = async |scene: &str| {
        let args = ["bake", file.to_str().unwrap(), "--scene", scene, "--database", &url];
        let mut bake = data.command(&args).stderr(Stdio::piped()).spawn().unwrap();
        let found = data.path().join(format!("bakes/{scene}.found"));
        while std::fs::read(&found).unwrap_or_default().len() < 100 {
            assert_eq!(bake.try_wait().unwrap(), None);
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
        postgres.kill();
        let mut said = BufReader::new(bake.stderr.take().unwrap()).lines().map(Result::unwrap);
        assert!(
            said.any(|line| line.contains("the catalogue does not answer; the bake waits")),
            "it did not wait"
        );
        (bake, said)
    };
    let (mut bake, said) = begin("rooms").await;
    postgres.again();
    let rest: Vec<_> = said.collect();
    assert!(bake.wait().unwrap().success(), "{rest:?}");
    data.ok(&["inspect", "rooms", "--database", &url]);

    // What somebody has collected meanwhile is missed before anything is published.
    let (mut bake, said) = begin("other").await;
    for blob in std::fs::read_dir(data.path().join("o")).unwrap() {
        std::fs::remove_file(blob.unwrap().path()).unwrap();
    }
    postgres.again();
    let rest: Vec<_> = said.collect();
    assert!(!bake.wait().unwrap().success());
    assert!(
        rest.last()
            .unwrap()
            .contains("blobs were collected while the catalogue was away"),
        "{rest:?}"
    );
    postgres.kill();
}
