//! What may be seen from any place, asked over the wire: two rooms and a door between them.

use std::collections::BTreeMap;

use belvedere_client::HttpSource;
use belvedere_scene::{Bounds, record::CellJson};
use http_body_util::{BodyExt, Full};
use hyper::{Request, body::Bytes, client::conn::http1::handshake};
use hyper_util::rt::TokioIo;
use serde_json::{Value, json};
use tokio::net::TcpStream;

use crate::{
    boxes::two_rooms,
    doors::document,
    program::{Data, Server},
};

/// What no ray saw is listed with a fraction of 1/64 when it could not be proved hidden, which a neighbour's rounding may
/// double; what rays saw well has more.
const SURELY_SEEN: f32 = 1.0 / 32.0;
/// In the east room, level with the wall to the left of the door: all of the west room that it sees lies to the north.
const BEHIND_THE_WALL: [f64; 3] = [8.0, 1.5, 1.0];
/// In the east room, where one looks through the door at what stands in the west room.
const BEFORE_THE_DOOR: [f64; 3] = [8.0, 1.5, 4.0];

struct Reply {
    status: u16,
    kind: String,
    cache: String,
    body: Value,
}

struct Rooms {
    server: Server,
    /// Objects by their names in the source.
    ids: BTreeMap<String, String>,
    // The folder goes after the server.
    _data: Data,
}

impl Rooms {
    async fn served() -> Self {
        let data = Data::new();
        data.bake(&data.write("rooms.glb", two_rooms()), "rooms");
        let server = data.serve();
        let source = HttpSource::new(&server.base).expect("an address");
        let page = document(&source, "/v1/scenes/rooms/objects?bbox=-9,-9,-9,19,9,9&limit=1000").await;
        let text = |object: &Value, name: &str| object[name].as_str().expect(name).to_owned();
        let objects = page["objects"].as_array().expect("objects").iter();
        let ids = objects.map(|o| (text(o, "source_node"), text(o, "object"))).collect();
        Self {
            server,
            ids,
            _data: data,
        }
    }

    fn id(&self, name: &str) -> &str {
        &self.ids[name]
    }

    async fn post(&self, scene: &str, kind: Option<&str>, body: impl Into<Bytes>) -> Reply {
        let address = self.server.base.trim_start_matches("http://");
        let stream = TokioIo::new(TcpStream::connect(address).await.expect("a connection"));
        let (mut sender, connection) = handshake(stream).await.expect("a handshake");
        tokio::spawn(connection);
        let mut request = Request::post(format!("/v1/scenes/{scene}/visible")).header("host", address);
        if let Some(kind) = kind {
            request = request.header("content-type", kind);
        }
        let request = request.body(Full::new(body.into())).expect("a request");
        let response = sender.send_request(request).await.expect("an answer");
        let field = |name| {
            let value = response.headers().get(name);
            value.map_or("", |value| value.to_str().expect("text")).to_owned()
        };
        let (kind, cache) = (field("content-type"), field("cache-control"));
        let status = response.status().as_u16();
        let bytes = response.into_body().collect().await.expect("a body").to_bytes();
        Reply {
            status,
            kind,
            cache,
            body: serde_json::from_slice(&bytes).expect("JSON"),
        }
    }

    async fn ask(&self, question: Value) -> Reply {
        self.post("rooms", Some("application/json"), question.to_string()).await
    }

    /// The whole answer to a question that is answered.
    async fn answer(&self, question: Value) -> Value {
        let reply = self.ask(question).await;
        assert_eq!(reply.status, 200, "{}", reply.body);
        assert_eq!((&reply.kind[..], &reply.cache[..]), ("application/json", "no-store"));
        reply.body
    }

    async fn seen(&self, question: Value) -> Vec<String> {
        objects(&self.answer(question).await)
    }
}

fn objects(answer: &Value) -> Vec<String> {
    let objects = answer["objects"].as_array().expect("objects").iter();
    let ids = objects.map(|o| o["object"].as_str().expect("an id").to_owned());
    ids.collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_wall_hides_and_a_door_hides_when_it_is_closed() {
    let rooms = Rooms::served().await;
    let (here, beyond, door) = (rooms.id("here"), rooms.id("beyond"), rooms.id("door:between"));
    let holds = |seen: &[String], id: &str| seen.iter().any(|other| other == id);

    let question = |position| json!({"position": position, "radius_m": 0.2});
    let answer = rooms.answer(question(BEHIND_THE_WALL)).await;
    let seen = objects(&answer);
    assert!(holds(&seen, here), "{seen:?}");
    assert!(!holds(&seen, beyond), "{seen:?}");
    assert_eq!(answer["total"], seen.len());
    let largest_first = answer["objects"].as_array().expect("objects").iter();
    let angles: Vec<_> = largest_first
        .map(|o| o["solid_angle_sr"].as_f64().expect("a number"))
        .collect();
    assert!(angles.is_sorted_by(|a, b| a >= b), "{angles:?}");

    let open = rooms.seen(question(BEFORE_THE_DOOR)).await;
    assert!(
        holds(&open, here) && holds(&open, beyond) && holds(&open, door),
        "{open:?}"
    );
    let closed = rooms
        .seen(json!({"position": BEFORE_THE_DOOR, "radius_m": 0.2, "closed": [door]}))
        .await;
    assert!(holds(&closed, here) && holds(&closed, door), "{closed:?}");
    assert!(!holds(&closed, beyond), "{closed:?}");
    assert!(closed.iter().all(|id| open.contains(id)), "{closed:?} of {open:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn what_was_seen_from_a_cell_is_in_the_answer_for_its_box() {
    let rooms = Rooms::served().await;
    let source = HttpSource::new(&rooms.server.base).expect("an address");
    let pointer = document(&source, "/v1/scenes/rooms").await;
    let cells = pointer["cells"].as_u64().expect("a count");
    let mut checked = 0;
    for cell in 0..cells {
        let record = document(&source, &format!("/v1/scenes/rooms/cells/c{cell}")).await;
        let record: CellJson = serde_json::from_value(record).expect("a record");
        let bounds = Bounds::around(record.hull.points.iter().copied());
        let (min, max) = (bounds.min, bounds.max);
        let middle: [f64; 3] = std::array::from_fn(|axis| 0.5 * (min[axis] + max[axis]));
        let radius_m = (0..3).map(|axis| max[axis] - middle[axis]).fold(0.0, f64::max);
        let from_box = rooms.seen(json!({"box": bounds})).await;
        let from_ball = rooms.seen(json!({"position": middle, "radius_m": radius_m})).await;
        for visible in record
            .opvs
            .iter()
            .chain(&record.lpvs)
            .filter(|v| v.fraction > SURELY_SEEN)
        {
            let object = visible.object.to_string();
            assert!(from_box.contains(&object), "{object} from c{cell}: {from_box:?}");
            assert!(from_ball.contains(&object), "{object} around c{cell}: {from_ball:?}");
            checked += 1;
        }
    }
    assert!(checked > 0, "no cell sees anything");
}

#[tokio::test(flavor = "multi_thread")]
async fn pages_together_are_the_whole_answer() {
    let rooms = Rooms::served().await;
    let whole = rooms.answer(json!({"position": BEFORE_THE_DOOR, "after": null})).await;
    assert!(whole["next_after"].is_null() && objects(&whole).len() > 3, "{whole}");
    let mut pages = Vec::new();
    let mut question = json!({"position": BEFORE_THE_DOOR, "limit": 3.0, "revision": whole["revision"]});
    loop {
        let page = rooms.answer(question.clone()).await;
        assert_eq!(page["total"], whole["total"]);
        assert!((1..=3).contains(&objects(&page).len()), "{page}");
        pages.extend(page["objects"].as_array().expect("objects").clone());
        if page["next_after"].is_null() {
            break;
        }
        question["after"] = page["next_after"].clone();
    }
    assert_eq!(json!(pages), whole["objects"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn what_cannot_be_answered_is_refused_with_a_reason() {
    let rooms = Rooms::served().await;
    let at = json!(BEFORE_THE_DOOR);
    let too_many = vec!["o1"; 65];
    for (question, pointer) in [
        (json!([]), ""),
        (json!({}), ""),
        (json!({"position": [1, 2]}), "/position"),
        (json!({"position": at, "box": {"min": at, "max": at}}), ""),
        (json!({"position": at, "closed": ["door"]}), "/closed/0"),
        (json!({"position": [0, 0, 1e10]}), "/position"),
        (json!({"position": at, "radius_m": -1}), "/radius_m"),
        (json!({"box": {"min": [0, 0, -1e10], "max": at}}), "/box"),
        (json!({"position": at, "limit": 0}), "/limit"),
        (json!({"position": at, "limit": 2.5}), "/limit"),
        (json!({"position": at, "closed": too_many}), "/closed"),
        (json!({"position": at, "closed": [rooms.id("here")]}), "/closed"),
    ] {
        let reply = rooms.ask(question.clone()).await;
        assert_eq!(reply.status, 400, "{question}: {}", reply.body);
        assert_eq!(reply.kind, "application/problem+json", "{question}");
        assert_eq!(reply.body["pointer"], pointer, "{question}: {}", reply.body);
    }

    let question = json!({"position": at}).to_string();
    let large = format!("{question}{}", " ".repeat(1 << 17));
    for (status, scene, kind, body) in [
        (404, "elsewhere", Some("application/json"), question.clone()),
        (413, "rooms", Some("application/json"), large),
        (415, "rooms", Some("text/plain"), question.clone()),
        (200, "rooms", Some("Application/JSON; charset=utf-8"), question.clone()),
        (200, "rooms", None, question),
    ] {
        let reply = rooms.post(scene, kind, body).await;
        assert_eq!(reply.status, status, "{kind:?}: {}", reply.body);
    }
    let moved = rooms.ask(json!({"position": at, "revision": "0123456789abcdef"})).await;
    assert_eq!(moved.status, 409, "{}", moved.body);
}
