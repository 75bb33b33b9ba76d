//! Participants and movers in a row of cells, each seeing three cells far.

use std::time::Duration;

use belvedere::config::{LiveArgs, Settings};
use serde_json::{Value, json};

use crate::{
    live_wire::{Person, ask, json},
    scene::{Server, publish},
    wire::{get, metric, parse, raw},
};

#[tokio::test]
async fn two_in_one_place_hear_of_each_other_until_something_hides_one() {
    let server = Server::start().await;
    let a = Person::enter(server.address, 0.5).await;
    let b = Person::enter(server.address, 0.9).await;
    let (mut hears_a, mut hears_b) = (a.listen().await, b.listen().await);
    let hello = hears_a.next().await;
    assert_eq!((hello.name.as_str(), hello.id), ("hello", 1));
    assert_eq!(hello.data["object"], a.object);
    let info = hears_a.wait("object-info").await.data;
    assert_eq!((&info["object"], &info["mover"]), (&json!(b.object), &json!(true)));
    assert_eq!(info["pose"]["position"], json!([0.9, 0.5, 0.5]));
    assert_eq!(hears_b.wait("object-info").await.data["object"], a.object);

    let away = b.stand_at(7.5).await;
    assert_eq!((&away["cell"], &away["teleported"]), (&json!("c7"), &json!(true)));
    let gone = hears_a.wait("object-gone").await.data;
    assert_eq!(gone, json!({"objects": [b.object], "reason": "hidden"}));
    // From the second pose on, at the latest, nobody wants to hear of it.
    let hush = b.stand_at(7.5).await["hush"].clone();
    assert!(hush["until_ms"].is_i64() && hush["tbv"]["radius_m"].is_f64(), "{hush}");

    a.stand_at(5.5).await;
    assert_eq!(hears_a.wait("cell").await.data["cell"], "c5");
    assert_eq!(hears_b.wait("wake").await.data["object"], b.object);
    assert!(b.stand_at(7.4).await["hush"].is_null());
    let back = hears_a.wait("object-pos").await.data;
    assert_eq!(back["objects"][0]["object"], b.object, "its info was kept");

    assert_eq!(b.leave().await, 204);
    assert_eq!(hears_a.wait("object-gone").await.data["reason"], "destroyed");
    hears_b.ends().await;
    assert_eq!(b.put("/pose", &json!({"position": [1, 0.5, 0.5]})).await.status, 404);
}

#[tokio::test]
async fn the_stream_has_what_proxies_and_browsers_need() {
    let server = Server::start().await;
    let a = Person::enter(server.address, 0.5).await;
    let mut stream = a.listen().await;
    stream.next().await;
    let head = stream.text.split("\r\n\r\n").next().unwrap().to_ascii_lowercase();
    for line in [
        "content-type: text/event-stream",
        "cache-control: no-store",
        "x-accel-buffering: no",
    ] {
        assert!(head.contains(line), "no {line} in {head}");
    }
    assert!(stream.text.contains("retry: 1000\n\n"));
}

#[tokio::test]
async fn who_has_heard_all_is_told_of_poses_without_being_woken() {
    let server = Server::start().await;
    let (a, b) = (
        Person::enter(server.address, 0.5).await,
        Person::enter(server.address, 0.9).await,
    );
    let mut stream = a.listen().await;
    stream.wait("object-info").await;
    let mut at_once = 0;
    // Whether its task has come to rest when the pose comes is the machine's affair.
    for step in 1..100 {
        let x = 0.9 - f64::from(step % 2) * 0.3;
        b.stand_at(x).await;
        stream.wait_for(&b.object, x).await;
        let counted = metric(server.address, "belvedere_live_events_at_once_total").await;
        at_once = counted.parse().unwrap();
        if at_once > 2 {
            break;
        }
    }
    assert!(at_once > 2, "{at_once} of 99");
}

#[tokio::test]
async fn who_comes_back_hears_what_was_missed_or_everything() {
    let server = Server::start().await;
    let a = Person::enter(server.address, 0.5).await;
    let b = Person::enter(server.address, 0.9).await;
    let mut stream = a.listen().await;
    let info = stream.wait("object-info").await;
    drop(stream);
    b.stand_at(7.5).await;
    let mut stream = a.listen_after(&format!("Last-Event-ID: {}\r\n", info.id)).await;
    let gone = stream.next().await;
    assert_eq!((gone.name.as_str(), gone.id), ("object-gone", info.id + 1));
    let mut again = a.listen_after(&format!("Last-Event-ID: {}\r\n", info.id)).await;
    assert_eq!(again.next().await, gone, "the same once more");
    stream.ends().await;
    b.stand_at(0.9).await;
    again.wait("object-pos").await;
    for (header, reason) in [
        ("", "unknown"),
        ("Last-Event-ID: 999\r\n", "missed"),
        ("Last-Event-ID: x\r\n", "missed"),
    ] {
        let mut stream = a.listen_after(header).await;
        let resync = stream.next().await;
        assert_eq!(
            (resync.name.as_str(), &resync.data["reason"]),
            ("resync", &json!(reason))
        );
        assert_eq!(stream.wait("object-info").await.data["object"], b.object);
    }
}

#[tokio::test]
async fn who_opens_no_stream_is_told_nothing_and_everybody_is_told_of_its_avatar() {
    let server = Server::start().await;
    let deaf = Person::enter(server.address, 0.5).await;
    let b = Person::enter(server.address, 0.9).await;
    let mut hears_b = b.listen().await;
    assert_eq!(hears_b.wait("object-info").await.data["object"], deaf.object);
    let before = metric(server.address, "belvedere_live_events_total").await;
    for _ in 0..5 {
        deaf.stand_at(0.5).await;
        assert!(!b.stand_at(0.9).await["hush"].is_null(), "nobody is told of it");
    }
    assert_eq!(metric(server.address, "belvedere_live_events_total").await, before);
    deaf.stand_at(0.7).await;
    hears_b.wait_for(&deaf.object, 0.7).await;

    let mut hears = deaf.listen().await;
    assert_eq!(hears.next().await.name, "hello");
    assert_eq!(hears.wait("object-info").await.data["object"], b.object);
    assert!(!hears.text.contains("event: resync"), "{}", hears.text);
    assert!(b.stand_at(0.9).await["hush"].is_null());
}

#[tokio::test]
async fn a_stream_begins_with_its_own_time_and_where_one_stands_by_then() {
    let server = Server::start().await;
    let person = Person::enter(server.address, 0.5).await;
    assert_eq!(person.stand_at(2.5).await["cell"], "c2");
    let body = json!({"position": [0.5, 0.5, 0.5]});
    let later = json(server.address, ("POST", "/v1/scenes/row/sessions"), None, &body).await;
    let mut hears = person.listen().await;
    let hello = hears.next().await;
    assert_eq!((hello.name.as_str(), &hello.data["cell"]), ("hello", &json!("c2")));
    let (now_ms, later_ms) = (hello.data["now_ms"].as_i64(), later.json()["now_ms"].as_i64());
    assert!(now_ms >= later_ms, "{now_ms:?} is before {later_ms:?}");
    person.stand_at(3.5).await;
    assert_eq!(
        hears.wait("cell").await.data["cell"],
        "c3",
        "where one stood before is not told after that"
    );
}

#[tokio::test]
async fn whoever_says_its_velocity_at_the_door_may_be_put_away_in_a_smaller_volume() {
    let server = Server::start().await;
    let radius_m = async |velocity: Value| {
        let promises = json!({"max_speed_mps": 3, "max_acceleration_mps2": 0.5, "velocity": velocity});
        let person = Person::enter_with(server.address, 0.5, promises.clone()).await;
        let mut body = promises;
        body["position"] = json!([0.5, 0.5, 0.5]);
        let answer = json(server.address, ("POST", "/v1/scenes/row/movers"), None, &body).await;
        [&person.hush, &answer.json()["hush"]].map(|hush| hush["tbv"]["radius_m"].as_f64().unwrap())
    };
    // Half of 0.5 m/s² for two seconds, squared; 3 m/s for two seconds.
    assert_eq!(radius_m(json!([0, 0, 0])).await, [1.0, 1.0]);
    assert_eq!(radius_m(json!(null)).await, [6.0, 6.0]);
}

#[tokio::test]
async fn a_reader_that_does_not_read_costs_nobody_anything() {
    let server = Server::start().await;
    let stuck = Person::enter(server.address, 0.5).await;
    let reader = Person::enter(server.address, 0.6).await;
    let walker = Person::enter(server.address, 0.7).await;
    let _never_read = stuck.listen().await;
    let mut stream = reader.listen().await;
    for _ in 0..2 {
        stream.wait("object-info").await;
    }
    for step in 0..40 {
        let x = 0.7 + 0.2 * f64::from(step % 2);
        walker.stand_at(x).await;
        if step > 0 {
            stream.wait_for(&walker.object, x).await;
        }
    }
}

#[tokio::test]
async fn open_streams_end_cleanly_when_the_server_stops() {
    let mut server = Server::start().await;
    let a = Person::enter(server.address, 0.5).await;
    let mut stream = a.listen().await;
    stream.next().await;
    server.stopping.cancel();
    stream.ends().await;
    let ended = tokio::time::timeout(Duration::from_secs(1), &mut server.running).await;
    assert!(ended.is_ok(), "an open stream holds up the end");
}

#[tokio::test]
async fn a_silent_session_ends_with_its_lease() {
    let server = Server::start_with(Settings {
        live: LiveArgs {
            lease_s: Some(1),
            ..LiveArgs::default()
        },
        ..Settings::default()
    })
    .await;
    let listening = Person::enter(server.address, 0.5).await;
    let silent = Person::enter(server.address, 0.7).await;
    let mut stream = listening.listen().await;
    assert_eq!(
        stream.wait("object-gone").await.data,
        json!({"objects": [silent.object], "reason": "destroyed"})
    );
    assert_eq!(
        silent.put("/pose", &json!({"position": [1, 0.5, 0.5]})).await.status,
        404
    );
    listening.stand_at(0.6).await;
}

#[tokio::test]
async fn a_batch_is_applied_but_for_its_bad_lines() {
    let server = Server::start().await;
    let simulator = Person::enter(server.address, 7.5).await;
    let visitor = Person::enter(server.address, 0.5).await;
    let mut movers = Vec::new();
    for x in [0.3, 0.6] {
        let body =
            json!({"position": [x, 0.5, 0.5], "radius_m": 0.1, "max_speed_mps": 1, "avatar": "o3", "name": "a cart"});
        let answer = json(
            server.address,
            ("POST", "/v1/scenes/row/movers"),
            Some(&simulator.token),
            &body,
        )
        .await;
        assert_eq!(answer.status, 201, "{:?}", answer.json());
        assert_eq!(
            answer.json()["token"],
            simulator.token,
            "they are driven by the session"
        );
        movers.push(answer.json()["object"].as_str().unwrap().to_owned());
    }
    let mut stream = visitor.listen().await;
    for _ in 0..2 {
        let info = stream.wait("object-info").await.data;
        assert_eq!((&info["source_node"], &info["model"]), (&json!("a cart"), &json!("m0")));
        assert_eq!(info["levels"].as_array().unwrap().len(), 1);
    }
    let stolen = visitor.token.clone();
    let lines = [
        format!("\u{feff}{}", json!({"object": movers[0], "position": [0.5, 0.5, 0.5]})),
        "{\"object\": oops".to_owned(),
        json!({"object": movers[1], "position": [0.5, 0.5, 0.5], "token": stolen}).to_string(),
        json!({"object": movers[1], "position": [1e8, 0.5, 0.5]}).to_string(),
        json!({"object": "o400000000", "position": [0.5, 0.5, 0.5]}).to_string(),
        json!({"object": movers[1], "position": [0.55, 0.5, 0.5]}).to_string(),
        String::new(),
    ];
    let what = ("POST", "/v1/scenes/row/movers/poses");
    let body = ("application/x-ndjson", lines.join("\n"));
    let answer = ask(server.address, what, Some(&simulator.token), (body.0, &body.1)).await;
    let batch = answer.json();
    assert_eq!((answer.status, &batch["accepted"]), (200, &json!(2)), "{batch}");
    let refused: Vec<_> = batch["refused"]
        .as_array()
        .unwrap()
        .iter()
        .map(|r| (r["line"].clone(), r["status"].clone()))
        .collect();
    let expected = [(2, 400), (3, 403), (4, 400), (5, 404)].map(|(line, status)| (json!(line), json!(status)));
    assert_eq!(refused, expected);
    assert_eq!(batch["refused"][2]["pointer"], "/position");
    assert_eq!(batch["more_unreadable"], 0);
    let nonsense = ask(server.address, what, None, (body.0, &"x\n".repeat(50_000))).await;
    let batch = nonsense.json();
    assert_eq!(batch["refused"].as_array().unwrap().len(), 100);
    assert_eq!(batch["more_unreadable"], 49_900);
    let told = stream.wait("object-pos").await.data;
    assert_eq!(
        told["objects"].as_array().unwrap().len(),
        2,
        "one event for both: {told}"
    );

    let path = format!("/v1/movers/{}", movers[0]);
    let none = ("application/json", "");
    assert_eq!(ask(server.address, ("DELETE", &path), None, none).await.status, 401);
    assert_eq!(
        ask(server.address, ("DELETE", &path), Some(&stolen), none).await.status,
        403
    );
    assert_eq!(
        ask(server.address, ("DELETE", &path), Some(&simulator.token), none)
            .await
            .status,
        204
    );
    assert_eq!(stream.wait("object-gone").await.data["reason"], "destroyed");
    let pose = json!({"position": [0.5, 0.5, 0.5]});
    let path = format!("/v1/movers/{}/pose", visitor.object);
    assert_eq!(
        json(server.address, ("PUT", &path), Some(&stolen), &pose).await.status,
        404,
        "an avatar is no mover"
    );
}

#[tokio::test]
async fn a_trajectory_is_given_once_and_followed() {
    let server = Server::start().await;
    let visitor = Person::enter(server.address, 0.5).await;
    let mut stream = visitor.listen().await;
    let keys = json!([{"t_ms": 0, "position": [0.2, 0.5, 0.5]}, {"t_ms": 300, "position": [1.2, 0.5, 0.5]},
                      {"t_ms": 600, "position": [0.2, 0.5, 0.5]}]);
    let body = json!({"trajectory": {"keys": keys, "repeat": true}, "radius_m": 0.1});
    let answer = json(server.address, ("POST", "/v1/scenes/row/movers"), None, &body).await;
    let (object, token) = (
        answer.json()["object"].clone(),
        answer.json()["token"].as_str().unwrap().to_owned(),
    );
    assert_eq!(stream.wait("object-info").await.data["object"], object);
    for _ in 0..4 {
        let told = stream.wait("object-pos").await.data;
        let speed = told["objects"][0]["velocity"][0].as_f64().unwrap();
        assert!((speed.abs() - 1.0 / 0.3).abs() < 1e-6, "{told}");
    }
    let path = format!("/v1/movers/{}/pose", object.as_str().unwrap());
    let pose = json!({"position": [0.5, 0.5, 0.5]});
    assert_eq!(
        json(server.address, ("PUT", &path), Some(&token), &pose).await.status,
        400
    );
}

#[tokio::test]
async fn doors_are_opened_by_whoever_is_there_and_seen_by_whoever_may() {
    let server = Server::start().await;
    let near = Person::enter(server.address, 5.5).await;
    let far = Person::enter(server.address, 0.5).await;
    let (mut near_hears, mut far_hears) = (near.listen().await, far.listen().await);
    let door = "/v1/scenes/row/doors/o6";
    let stands = get(server.address, door).await;
    assert_eq!(
        (stands.status, stands.json(), stands.header("cache-control")),
        (200, json!({"object": "o6", "open": true}), Some("no-store"))
    );
    let body = json!({"open": false});
    assert_eq!(json(server.address, ("PUT", door), None, &body).await.status, 401);
    let wrong = "0".repeat(32);
    assert_eq!(
        json(server.address, ("PUT", door), Some(&wrong), &body).await.status,
        403
    );
    let no_door = "/v1/scenes/row/doors/o1";
    assert_eq!(
        json(server.address, ("PUT", no_door), Some(&far.token), &body)
            .await
            .status,
        404
    );
    let answer = json(server.address, ("PUT", door), Some(&far.token), &body).await;
    assert_eq!(
        (answer.status, answer.json()),
        (200, json!({"object": "o6", "open": false}))
    );
    assert_eq!(get(server.address, door).await.json()["open"], false);
    assert_eq!(get(server.address, no_door).await.status, 404);
    assert_eq!(
        near_hears.wait("door").await.data,
        json!({"object": "o6", "open": false})
    );
    far.stand_at(4.5).await;
    assert_eq!(
        far_hears.wait("door").await.data,
        json!({"object": "o6", "open": false})
    );
}

#[tokio::test]
async fn who_rattles_at_a_door_is_held_up() {
    let server = Server::start().await;
    let [one, other] = [0.5, 1.5].map(|x| Person::enter(server.address, x));
    let (one, other) = (one.await, other.await);
    let door = "/v1/scenes/row/doors/o6";
    let set = |person: &Person, open: bool| {
        let token = person.token.clone();
        async move { json(server.address, ("PUT", door), Some(&token), &json!({"open": open})).await }
    };
    for i in 0..100 {
        let answer = set(&one, i % 2 == 0).await;
        if answer.status == 200 {
            continue;
        }
        assert_eq!((answer.status, answer.header("retry-after")), (429, Some("1")));
        assert_eq!(
            get(server.address, door).await.json()["open"],
            i % 2 == 1,
            "nothing has changed"
        );
        assert_eq!(set(&other, true).await.status, 200, "nobody else is held up");
        return;
    }
    panic!("one may set a door as often as one likes");
}

#[tokio::test]
async fn a_session_may_keep_its_token_in_a_cookie_of_pages_of_this_origin() {
    let server = Server::start().await;
    let person = Person::enter(server.address, 0.5).await;
    let body = r#"{"position": [0.5, 0.5, 0.5]}"#;
    let put = |path: String, fields: &str| {
        let (token, fields) = (person.token.clone(), fields.to_owned());
        async move {
            let request = format!(
                "PUT {path} HTTP/1.1\r\nHost: test\r\nConnection: close\r\nCookie: belvedere_token={token}\r\n{fields}Content-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
                body.len()
            );
            parse(&raw(server.address, request.as_bytes()).await)
        }
    };
    for (fields, status) in [
        ("", 200),
        ("Origin: http://test\r\n", 200),
        ("Sec-Fetch-Site: same-origin\r\n", 200),
        ("Origin: http://evil.example\r\n", 401),
        ("Sec-Fetch-Site: cross-site\r\n", 401),
    ] {
        let answer = put(person.path("/pose"), fields).await;
        assert_eq!(answer.status, status, "{fields}");
        assert_eq!(answer.header("access-control-allow-origin"), Some("*"));
        assert_eq!(answer.header("access-control-allow-credentials"), None);
    }
    let other = Person::enter(server.address, 1.5).await;
    assert_eq!(
        put(other.path("/pose"), "").await.status,
        403,
        "it is that of one session"
    );
    let mover = put(format!("/v1/movers/{}/pose", person.object), "").await.status;
    assert!([401, 404].contains(&mover), "nothing else takes it: {mover}");
    let request = |token: &str| {
        format!(
            "HEAD {} HTTP/1.1\r\nHost: test\r\nConnection: close\r\nCookie: belvedere_token={token}\r\n\r\n",
            person.path("/events")
        )
    };
    let head = parse(&raw(server.address, request(&person.token).as_bytes()).await);
    assert_eq!(
        (head.status, head.header("content-type")),
        (200, Some("text/event-stream"))
    );
    let wrong = parse(&raw(server.address, request(&"0".repeat(32)).as_bytes()).await);
    assert_eq!(wrong.status, 403);
}

#[tokio::test]
async fn static_objects_are_told_of_as_they_come_into_view_each_once() {
    let server = Server::start().await;
    let more = json!({"include": ["static"], "aoi": {"enter_m": 1.0, "leave_m": 1.2}});
    let person = Person::enter_with(server.address, 0.5, more).await;
    let _unseen = Person::enter(server.address, 0.6).await;
    let mut stream = person.listen().await;
    let mut told = Vec::new();
    for x in [0.5, 1.5, 2.5, 0.5] {
        person.stand_at(x).await;
        while told.len() < 2 + (x - 0.5) as usize {
            told.push(
                stream.wait("object-info").await.data["object"]
                    .as_str()
                    .unwrap()
                    .to_owned(),
            );
        }
    }
    told.sort();
    assert_eq!(told, ["o0", "o1", "o2", "o3"]);
}

#[tokio::test]
async fn a_new_revision_is_told_and_lived_in() {
    let server = Server::start().await;
    let a = Person::enter(server.address, 0.5).await;
    let mut stream = a.listen().await;
    stream.next().await;
    let pointer = publish(&server.catalogue, &server.blobs, "Another row").await;
    let told = stream.wait("revision").await.data;
    assert_eq!(told["revision"], pointer.revision.to_string());
    assert_eq!(told["manifest"], pointer.manifest.url());
    assert_eq!(
        get(server.address, told["manifest"].as_str().unwrap()).await.status,
        200
    );
    let b = Person::enter(server.address, 0.9).await;
    assert_eq!(stream.wait("object-info").await.data["object"], b.object);
}

#[tokio::test]
async fn metrics_say_who_is_there() {
    let server = Server::start().await;
    let _a = Person::enter(server.address, 0.5).await;
    let _b = Person::enter(server.address, 7.5).await;
    let metrics = get(server.address, "/metrics").await;
    let text = String::from_utf8(metrics.body).unwrap();
    for line in [
        "belvedere_live_sessions 2",
        "belvedere_live_movers 2",
        "belvedere_live_hushed_movers 2",
    ] {
        assert!(text.contains(line), "no {line} in {text}");
    }
}

#[tokio::test]
async fn who_likes_to_says_how_much_it_has_of_what_it_sees() {
    let server = Server::start().await;
    let address = server.address;
    let metric = async |name: &str| metric(address, &format!("belvedere_live_quality_{name}")).await;
    assert_eq!(metric("sessions").await, "0");
    for shares in [&[0.25, 1.0][..], &[0.5]] {
        let opened = json(
            address,
            ("POST", "/v1/scenes/row/sessions"),
            None,
            &json!({"position": [0.5, 0.5, 0.5]}),
        )
        .await;
        let opened = opened.json();
        let path = format!("/v1/sessions/{}/quality", opened["session"].as_str().unwrap());
        for share in shares {
            let told = json(
                address,
                ("PUT", &path),
                opened["token"].as_str(),
                &json!({"quality": share}),
            )
            .await;
            assert_eq!(told.status, 204);
        }
        let wrong = json(
            address,
            ("PUT", &path),
            opened["token"].as_str(),
            &json!({"quality": 1.5}),
        )
        .await;
        assert_eq!(
            (wrong.status, wrong.problem()["pointer"].clone()),
            (400, "/quality".into())
        );
        let stranger = json(address, ("PUT", &path), None, &json!({"quality": 0.1})).await;
        assert_eq!(stranger.status, 401);
    }
    assert_eq!(
        (metric("sessions").await, metric("mean").await, metric("worst").await),
        ("2".to_owned(), "0.75".to_owned(), "0.5".to_owned())
    );
}
