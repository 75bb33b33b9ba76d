//! Two servers of one data folder that meet through NATS, and what becomes of them when one of the three is gone.

use std::{
    net::{SocketAddr, TcpListener},
    process::{Child, Command, Stdio},
    sync::atomic::{AtomicU16, Ordering},
    time::{Duration, Instant},
};

use serde_json::{Value, json};

use crate::{
    boxes::two_rooms,
    live_wire::{Person, Stream, ask, json},
    program::{Data, Server, THREE_ROOMS},
    wire::{self, get},
};

/// Longer than anything here takes.
const PATIENCE: Duration = Duration::from_secs(30);

pub(crate) async fn within<T>(what: impl Future<Output = T>) -> T {
    tokio::time::timeout(PATIENCE, what).await.expect("in time")
}

/// A port that no other test of this run gets, nor the system gives to anybody who asks for any: one that is freed for a while
/// must not be taken meanwhile.
fn free_port() -> u16 {
    static NEXT: AtomicU16 = AtomicU16::new(0);
    let first = 20_000 + (std::process::id() % 500) as u16 * 20;
    let mut ports = std::iter::repeat_with(|| first + NEXT.fetch_add(1, Ordering::Relaxed));
    let free = ports.find(|port| TcpListener::bind(("127.0.0.1", *port)).is_ok());
    free.expect("a port")
}

/// A NATS server of one test, on a port of its own.
pub(crate) struct Nats {
    port: u16,
    /// What stands before the host in its address.
    login: String,
    child: Child,
}

impl Nats {
    pub(crate) async fn start() -> Self {
        Self::start_at(free_port()).await
    }

    async fn start_at(port: u16) -> Self {
        Self::start_with(port, "", &[]).await
    }

    async fn start_with(port: u16, login: &str, args: &[&str]) -> Self {
        let program = std::env::var("BELVEDERE_TEST_NATS").unwrap_or_else(|_| "nats-server".to_owned());
        let child = Command::new(program)
            .args(["-a", "127.0.0.1", "-p", &port.to_string()])
            .args(args)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("nats-server runs; BELVEDERE_TEST_NATS may say where it is");
        let login = login.to_owned();
        let mut nats = Self { port, login, child };
        within(async {
            while tokio::net::TcpStream::connect(("127.0.0.1", port)).await.is_err() {
                assert!(
                    nats.child.try_wait().is_ok_and(|ended| ended.is_none()),
                    "nats-server has ended"
                );
                tokio::time::sleep(Duration::from_millis(10)).await;
            }
        })
        .await;
        nats
    }

    pub(crate) fn url(&self) -> String {
        format!("nats://{}127.0.0.1:{}", self.login, self.port)
    }

    /// Ends it; gives its port.
    fn stop(mut self) -> u16 {
        self.end();
        self.port
    }

    fn end(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Drop for Nats {
    fn drop(&mut self) {
        self.end();
    }
}

fn address(server: &Server) -> SocketAddr {
    server.base.trim_start_matches("http://").parse().expect("an address")
}

/// A server that hears others.
async fn node(data: &Data, nats: &Nats, name: &str) -> Server {
    let server = data.serve_with(&["--nats", &nats.url(), "--node", name]);
    ready(&server, "nats: answers").await;
    server
}

pub(crate) async fn ready(server: &Server, line: &str) {
    within(async {
        while !String::from_utf8_lossy(&get(address(server), "/readyz").await.body).contains(line) {
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
    })
    .await;
}

/// One of a server's metrics.
async fn metric(server: &Server, name: &str) -> u64 {
    wire::metric(address(server), name).await.parse().expect("a number")
}

fn rooms() -> Data {
    let data = Data::new();
    data.bake(&data.write("rooms.plan", THREE_ROOMS), "rooms");
    data
}

pub(crate) async fn enter(server: &Server, x: f64, z: f64) -> Person {
    let body = json!({"position": [x, 1.5, z], "max_speed_mps": 1.5, "radius_m": 0.3});
    Person::enter_scene(address(server), "rooms", &body).await
}

/// Waits until a session is told how it is among nodes.
async fn hears_network(stream: &mut Stream, network: &str) {
    while stream.wait("network").await.data["network"] != network {}
}

/// Has somebody speak, again and again, until a session is told that it is at this place.
async fn is_told_at(hears: &mut Stream, object: &str, x: f64, speak: impl AsyncFn()) {
    let is_there = |told: &Value| {
        let there = told["position"][0].as_f64().is_some_and(|told| (told - x).abs() < 0.02);
        there.then_some(())
    };
    within(async {
        loop {
            speak().await;
            let Ok(event) = tokio::time::timeout(Duration::from_millis(200), hears.next()).await else {
                continue;
            };
            let poses = event.data["objects"].as_array().cloned().unwrap_or_default();
            let moved = poses.iter().find(|told| told["object"] == object).and_then(is_there);
            let info = (event.data["object"] == object)
                .then(|| is_there(&event.data["pose"]))
                .flatten();
            if moved.or(info).is_some() {
                break;
            }
        }
    })
    .await;
}

/// Waits until a session is told that somebody is gone.
pub(crate) async fn hears_gone(stream: &mut Stream, object: &str) -> Value {
    loop {
        let gone = stream.wait("object-gone").await.data;
        if gone["objects"].as_array().expect("objects").contains(&json!(object)) {
            return gone["reason"].clone();
        }
    }
}

#[ignore = "needs nats-server: make test-services"]
#[tokio::test(flavor = "multi_thread")]
async fn people_on_two_servers_meet_walls_hide_them_and_a_server_that_dies_loses_only_its_own() {
    let (data, nats) = (rooms(), Nats::start().await);
    let recording = data.folder("a.rec").to_str().expect("a path in UTF-8").to_owned();
    let a = data.serve_with(&["--nats", &nats.url(), "--node", "a", "--record", &recording]);
    ready(&a, "nats: answers").await;
    let b = node(&data, &nats, "b").await;
    let west = enter(&a, 2.5, 2.5).await;
    let mut west_hears = west.listen().await;
    assert_eq!(west_hears.wait("hello").await.data["network"], "whole");
    let mut east = enter(&b, 6.5, 2.5).await;
    let mut east_hears = east.listen().await;
    assert_eq!(west_hears.wait("object-info").await.data["object"], east.object);
    west.stand(json!([2.5, 1.5, 2.5])).await;
    assert_eq!(east_hears.wait("object-info").await.data["object"], west.object);
    assert_ne!(west.session, east.session);

    let closed_in = enter(&b, 10.5, 2.5).await;
    let hush = closed_in.stand(json!([10.6, 1.5, 2.6])).await["hush"].clone();
    assert!(hush.is_object(), "nobody on any node sees it");
    east.stand(json!([6.6, 1.5, 2.5])).await;
    let moved = west_hears.wait("object-pos").await.data;
    assert_eq!(moved["objects"][0]["object"], east.object);
    assert!(!west_hears.text.contains(&closed_in.object), "{}", west_hears.text);

    // Who goes where nobody of either node sees it is silent, and so is who stays behind.
    east.stand(json!([10.5, 1.5, 1.6])).await;
    assert_eq!(hears_gone(&mut west_hears, &east.object).await, "hidden");
    let hush = west.stand(json!([2.5, 1.5, 2.5])).await["hush"].clone();
    assert!(hush.is_object(), "nobody on any node sees it");
    east.stand(json!([6.5, 1.5, 2.5])).await;
    assert_eq!(west_hears.wait("wake").await.data["object"], west.object);
    west_hears.wait("object-pos").await;

    b.kill();
    assert_eq!(hears_gone(&mut west_hears, &east.object).await, "left");
    // Its client asks the node that is left, and goes on there.
    east.address = address(&a);
    east.stand(json!([6.5, 1.5, 2.5])).await;
    assert_eq!(west_hears.wait("object-info").await.data["object"], east.object);

    // What was told of movers of the other node is as well-founded as what is told of one's own.
    assert_eq!(a.stop().0, Some(0));
    let audit: Value = serde_json::from_str(&data.ok(&["audit", &recording, "--json"])).expect("a JSON report");
    assert!(
        audit["scenes"][0]["told"].as_u64().is_some_and(|told| told > 0),
        "{audit}"
    );
}

#[ignore = "needs nats-server: make test-services"]
#[tokio::test(flavor = "multi_thread")]
async fn while_nats_is_away_sessions_go_on_within_their_node_and_say_so_and_then_all_heals() {
    let (data, nats) = (rooms(), Nats::start().await);
    let (a, b) = (node(&data, &nats, "a").await, node(&data, &nats, "b").await);
    let (west, beside) = (enter(&a, 2.5, 2.5).await, enter(&a, 2.5, 1.5).await);
    let east = enter(&b, 6.5, 2.5).await;
    let (mut west_hears, mut east_hears) = (west.listen().await, east.listen().await);
    let told = [
        west_hears.wait("object-info").await,
        west_hears.wait("object-info").await,
    ];
    assert!(told.iter().any(|info| info.data["object"] == east.object));

    let port = nats.stop();
    hears_network(&mut west_hears, "cut-off").await;
    hears_network(&mut east_hears, "cut-off").await;
    ready(&a, "nats: away").await;
    assert_eq!(
        get(address(&a), "/v1/scenes/rooms").await.status,
        200,
        "geometry is served"
    );
    assert_eq!(hears_gone(&mut west_hears, &east.object).await, "left");
    beside.stand(json!([2.6, 1.5, 1.5])).await;
    assert_eq!(
        west_hears.wait("object-pos").await.data["objects"][0]["object"],
        beside.object
    );
    east.stand(json!([6.6, 1.5, 2.5])).await;
    let late = enter(&a, 2.0, 2.5).await;
    assert_eq!(late.listen().await.wait("hello").await.data["network"], "cut-off");

    let nats = Nats::start_at(port).await;
    hears_network(&mut west_hears, "whole").await;
    hears_network(&mut east_hears, "whole").await;
    is_told_at(&mut west_hears, &east.object, 6.7, async || {
        east.stand(json!([6.7, 1.5, 2.5])).await;
    })
    .await;
    let (_, log) = a.stop();
    // A node that ends parts from NATS, too.
    assert!(log.contains("NATS is away"), "{log}");
    let reasons: Vec<_> = log
        .lines()
        .filter(|line| line.contains("NATS cannot be reached"))
        .collect();
    assert!(
        matches!(reasons[..], [one] if one.contains("Connection refused")),
        "{log}"
    );
    assert!(!log.contains("async_nats"), "{log}");
    drop(nats);
}

#[ignore = "needs nats-server: make test-services"]
#[tokio::test(flavor = "multi_thread")]
async fn movers_that_stay_outlive_their_node_and_go_to_the_one_that_is_asked_to_move_them() {
    let (data, nats) = (rooms(), Nats::start().await);
    let (a, b) = (node(&data, &nats, "a").await, node(&data, &nats, "b").await);
    let robot = json!({"position": [6.0, 1.5, 2.5], "max_speed_mps": 1, "persistent": true, "name": "Robot"});
    let made = json(address(&b), ("POST", "/v1/scenes/rooms/movers"), None, &robot)
        .await
        .json();
    let robot = made["object"].as_str().expect("an object").to_owned();
    let west = enter(&a, 2.5, 2.5).await;
    let mut west_hears = west.listen().await;
    let info = west_hears.wait("object-info").await.data;
    assert_eq!(
        (&info["object"], &info["source_node"]),
        (&json!(robot), &json!("Robot"))
    );
    let token = made["token"].as_str().expect("a token").to_owned();
    let path = format!("/v1/movers/{robot}/pose");
    let move_to = async |server: &Server, token: &str, x: f64| {
        json(
            address(server),
            ("PUT", &path),
            Some(token),
            &json!({"position": [x, 1.5, 2.5]}),
        )
        .await
        .status
    };
    assert_eq!(move_to(&a, &west.token, 6.1).await, 403, "that is no token of its");
    for (server, x) in [(&a, 6.1), (&b, 6.2), (&a, 6.3), (&b, 6.4)] {
        // What is said to a node that does not know yet that the mover has gone from there is lost; a driver speaks again.
        is_told_at(&mut west_hears, &robot, x, async || {
            assert_eq!(move_to(server, &token, x).await, 200);
        })
        .await;
    }
    let (code, _) = b.stop();
    assert_eq!(code, Some(0));
    assert_eq!(hears_gone(&mut west_hears, &robot).await, "left");
    assert_eq!(
        west_hears.wait("object-info").await.data["object"],
        robot,
        "it has another home"
    );
    assert_eq!(move_to(&a, &token, 6.2).await, 200);
}

#[ignore = "needs nats-server: make test-services"]
#[tokio::test(flavor = "multi_thread")]
async fn a_door_that_is_closed_on_one_server_hides_on_both_and_whoever_comes_later_hears_of_it() {
    let (data, nats) = (Data::new(), Nats::start().await);
    data.bake(&data.write("rooms.glb", two_rooms()), "rooms");
    let (a, b) = (node(&data, &nats, "a").await, node(&data, &nats, "b").await);
    let (west, east) = (enter(&a, 2.5, 2.5).await, enter(&b, 8.0, 2.5).await);
    let (mut west_hears, mut east_hears) = (west.listen().await, east.listen().await);
    assert_eq!(west_hears.wait("object-info").await.data["object"], east.object);
    // It was silent, since nobody saw it, and is asked to speak.
    west.stand(json!([2.5, 1.5, 2.5])).await;
    assert_eq!(east_hears.wait("object-info").await.data["object"], west.object);
    let around = get(address(&a), "/v1/scenes/rooms/objects?bbox=5,0,2,5.2,2.2,3")
        .await
        .json();
    let objects = around["objects"].as_array().expect("objects").iter();
    let door = objects
        .filter(|object| object["door"] == true)
        .map(|object| object["object"].clone())
        .next();
    let door = door.expect("a door");
    let path = format!("/v1/scenes/rooms/doors/{}", door.as_str().expect("an object"));
    let set = async |open: bool| {
        let token = Some(west.token.as_str());
        let answer = json(address(&a), ("PUT", &path), token, &json!({"open": open})).await;
        assert_eq!(answer.status, 200, "{answer:?}");
    };
    set(false).await;
    assert_eq!(
        east_hears.wait("door").await.data,
        json!({"object": door, "open": false})
    );
    assert_eq!(hears_gone(&mut east_hears, &west.object).await, "hidden");
    assert_eq!(hears_gone(&mut west_hears, &east.object).await, "hidden");
    let late = enter(&b, 8.0, 1.5).await;
    assert_eq!(late.listen().await.wait("door").await.data["open"], false);
    set(true).await;
    assert_eq!(east_hears.wait("door").await.data["open"], true);
    west.stand(json!([2.6, 1.5, 2.5])).await;
    east_hears.wait("object-pos").await;
}

#[ignore = "needs nats-server: make test-services"]
#[tokio::test(flavor = "multi_thread")]
async fn a_new_revision_parts_nobody_for_long() {
    let (data, nats) = (rooms(), Nats::start().await);
    let (a, b) = (node(&data, &nats, "a").await, node(&data, &nats, "b").await);
    let (west, east) = (enter(&a, 2.5, 2.5).await, enter(&b, 6.5, 2.5).await);
    let (mut west_hears, mut east_hears) = (west.listen().await, east.listen().await);
    assert_eq!(west_hears.wait("object-info").await.data["object"], east.object);
    // The same walls around a larger first room.
    let larger = THREE_ROOMS.replacen("#...#...#...#", "#...#...#...#\n#...#...#...#", 1);
    assert_ne!(larger, THREE_ROOMS);
    data.bake(&data.write("larger.plan", larger), "rooms");
    let revision = west_hears.wait("revision").await.data;
    assert_eq!(east_hears.wait("revision").await.data, revision);
    is_told_at(&mut west_hears, &east.object, 6.9, async || {
        east.stand(json!([6.9, 1.5, 2.5])).await;
    })
    .await;
    let hush = west.stand(json!([2.5, 1.5, 2.5])).await["hush"].clone();
    assert!(hush.is_null(), "east sees it: {hush}");
}

/// Also the source of the figures in `docs/NODES.md`: run with `--nocapture`.
#[ignore = "needs nats-server: make test-services"]
#[tokio::test(flavor = "multi_thread")]
async fn hidden_movers_cost_no_message_and_visible_ones_few() {
    const MOVERS: usize = 200;
    const PERIOD: Duration = Duration::from_millis(100);
    let (data, nats) = (rooms(), Nats::start().await);
    let (a, b) = (node(&data, &nats, "a").await, node(&data, &nats, "b").await);
    let west = enter(&a, 2.5, 2.5).await;
    let mut west_hears = west.listen().await;
    for (what, x) in [("hidden", 10.5), ("visible", 6.5)] {
        let mut movers = Vec::new();
        for number in 0..MOVERS {
            let z = 1.5 + 0.01 * number as f64;
            let body = json!({"position": [x, 1.5, z], "max_speed_mps": 3.5, "radius_m": 0.1});
            let made = json(address(&b), ("POST", "/v1/scenes/rooms/movers"), None, &body)
                .await
                .json();
            movers.push((made["object"].clone(), made["token"].clone(), z));
        }
        tokio::time::sleep(Duration::from_secs(3)).await;
        let names = ["belvedere_node_sent_total", "belvedere_node_sent_bytes_total"];
        let before = [metric(&b, names[0]).await, metric(&b, names[1]).await];
        let (began, mut ticks) = (Instant::now(), 0u32);
        while began.elapsed() < Duration::from_secs(5) {
            ticks += 1;
            let lines: Vec<_> = movers
                .iter()
                .map(|(object, token, z)| {
                    let x = x + 0.3 * f64::from(ticks).sin();
                    json!({"object": object, "token": token, "position": [x, 1.5, z]}).to_string()
                })
                .collect();
            let batch = ("application/x-ndjson", lines.join("\n"));
            let path = "/v1/scenes/rooms/movers/poses";
            let answer = ask(address(&b), ("POST", path), None, (batch.0, &batch.1)).await;
            assert_eq!(answer.json()["accepted"], MOVERS, "{answer:?}");
            tokio::time::sleep((PERIOD * ticks).saturating_sub(began.elapsed())).await;
        }
        let seconds = began.elapsed().as_secs_f64();
        let sent = metric(&b, names[0]).await - before[0];
        let bytes = metric(&b, names[1]).await - before[1];
        let (poses, rate) = (ticks as usize * MOVERS, sent as f64 / seconds);
        println!(
            "{what}: {poses} poses in {seconds:.1} s: {rate:.1} messages/s, {:.0} kB/s",
            bytes as f64 * 1e-3 / seconds
        );
        let beats = seconds.ceil() + 2.0;
        if what == "hidden" {
            assert!(sent as f64 <= beats, "{sent} messages, and {beats} beats");
        } else {
            assert!(rate < 60.0, "{rate} messages a second for {MOVERS} movers");
        }
    }
    let east = enter(&b, 6.5, 2.5).await;
    loop {
        if west_hears.wait("object-info").await.data["object"] == east.object {
            break;
        }
    }
    let mut late = Vec::new();
    for step in 0..40 {
        let x = [7.5, 5.5][step % 2];
        let said = Instant::now();
        // Faster than it has promised, so that nothing can be extrapolated.
        east.stand(json!([x, 1.5, 2.5])).await;
        west_hears.wait_for(&east.object, x).await;
        late.push(said.elapsed().as_millis());
        tokio::time::sleep(Duration::from_millis(137)).await;
    }
    late.sort_unstable();
    println!(
        "pose in on one node to event out on the other: median {} ms, worst {} ms",
        late[20], late[39]
    );
}

#[ignore = "needs nats-server: make test-services"]
#[tokio::test(flavor = "multi_thread")]
async fn nodes_log_in_with_what_stands_in_the_address_and_one_that_may_not_is_told_so() {
    let data = rooms();
    for (login, args) in [
        (
            "bel%76edere:hush%40hush%3A@",
            ["--user", "belvedere", "--pass", "hush@hush:"].as_slice(),
        ),
        ("hush%2Fhush@", &["--auth", "hush/hush"]),
    ] {
        let nats = Nats::start_with(free_port(), login, args).await;
        let (a, b) = (node(&data, &nats, "a").await, node(&data, &nats, "b").await);
        let (west, east) = (enter(&a, 2.5, 2.5).await, enter(&b, 6.5, 2.5).await);
        let mut west_hears = west.listen().await;
        is_told_at(&mut west_hears, &east.object, 6.6, async || {
            east.stand(json!([6.6, 1.5, 2.5])).await;
        })
        .await;
        let stranger = format!("nats://hush:wrong@127.0.0.1:{}", nats.port);
        let check = ["serve", "--listen", "127.0.0.1:0", "--check-config", "--nats"];
        let checked = data.ok(&[&check[..], &[&nats.url()]].concat());
        let refused = data.fails(&[&check[..], &[&stranger]].concat());
        assert!(refused.contains("look at its user and password"), "{refused}");
        assert!(
            !checked.contains("hush") && !refused.contains("hush"),
            "{checked}{refused}"
        );
        let stranger = data.serve_with(&["--nats", &stranger, "--node", "c"]).may_warn();
        stranger.until_it_says("NATS refuses this node").await;
        for server in [a, b, stranger] {
            let log = server.stop().1;
            assert!(!log.contains("hush"), "{log}");
        }
    }
}
