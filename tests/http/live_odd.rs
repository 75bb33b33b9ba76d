//! Odd, hostile and unlucky participants.

use belvedere::{
    config::{LiveArgs, Settings},
    db::KeptMover,
};
use belvedere_scene::ObjectId;
use serde_json::{Value, json};

use crate::{
    live_wire::{Person, ask, json},
    scene::Server,
    wire::{metric, send},
};

/// A body, and where the answer says that it is wrong.
async fn refused(person: &Person, rest: &str, body: &Value) -> String {
    let answer = person.put(rest, body).await;
    assert_eq!(answer.status, 400, "{body}: {answer:?}");
    answer.problem()["pointer"].as_str().unwrap().to_owned()
}

#[tokio::test]
async fn what_is_no_pose_is_refused_with_its_place() {
    let server = Server::start().await;
    let a = Person::enter(server.address, 0.5).await;
    for (body, pointer) in [
        (json!({}), ""),
        (json!({"position": [1, 2]}), "/position"),
        (json!({"position": ["NaN", 0, 0]}), "/position/0"),
        (json!({"position": [null, 0, 0]}), "/position/0"),
        (json!({"position": [1e12, 0, 0]}), "/position"),
        (json!({"position": [1000, 0, 0]}), "/position"),
        (
            json!({"position": [0.5, 0.5, 0.5], "orientation": [0, 0, 0, 0]}),
            "/orientation",
        ),
        (
            json!({"position": [0.5, 0.5, 0.5], "velocity": [0, 1e10, 0]}),
            "/velocity",
        ),
        (json!({"position": [0.5, 0.5, 0.5], "t_ms": -5}), "/t_ms"),
        (json!({"position": [0.5, 0.5, 0.5], "t_ms": 0.5}), "/t_ms"),
        (json!({"position": [0.5, 0.5, 0.5], "post/ion": 0}), "/post~1ion"),
    ] {
        assert_eq!(refused(&a, "/pose", &body).await, pointer, "{body}");
    }
    let infinite = ("application/json", r#"{"position": [1e999, 0, 0]}"#);
    assert_eq!(
        ask(server.address, ("PUT", &a.path("/pose")), Some(&a.token), infinite)
            .await
            .status,
        400
    );
    for (body, pointer) in [
        (json!({"enter_m": 5, "leave_m": 5}), "/leave_m"),
        (json!({"enter_m": -1, "leave_m": 5}), "/enter_m"),
        (json!({"enter_m": 1, "leave_m": 1e300}), "/leave_m"),
        (json!({"enter_m": "far", "leave_m": 1}), "/enter_m"),
    ] {
        assert_eq!(refused(&a, "/aoi", &body).await, pointer, "{body}");
    }
    let aoi = json!({"enter_m": 5, "leave_m": 6});
    assert_eq!(a.put("/aoi", &aoi).await.status, 200);
}

#[tokio::test]
async fn what_is_no_session_is_refused() {
    let server = Server::start().await;
    let at = [0.5, 0.5, 0.5];
    for (body, pointer) in [
        (json!({"position": at, "max_speed_mps": -1}), "/max_speed_mps"),
        (json!({"position": at, "radius_m": 0}), "/radius_m"),
        (json!({"position": at, "avatar": "o77"}), "/avatar"),
        (json!({"position": at, "avatar": 7}), "/avatar"),
        (json!({"position": at, "avatar": {"object": "o77"}}), "/avatar"),
        (
            json!({"position": at, "avatar": {"scene": "row", "object": "o77"}}),
            "/avatar/object",
        ),
        (
            json!({"position": at, "avatar": {"scene": "people", "object": "o1"}}),
            "/avatar/scene",
        ),
        (
            json!({"position": at, "avatar": {"scene": "?", "object": "o1"}}),
            "/avatar/scene",
        ),
        (json!({"position": at, "avatar": {"scene": "row"}}), "/avatar"),
        (
            json!({"position": at, "avatar": {"object": "o1", "hat": 1}}),
            "/avatar/hat",
        ),
        (json!({"position": at, "include": ["everything"]}), "/include/0"),
        (
            json!({"position": at, "aoi": {"enter_m": 2, "leave_m": 1}}),
            "/aoi/leave_m",
        ),
        (json!({"position": at, "aoi": {"enter_m": 2}}), "/aoi"),
    ] {
        let answer = json(server.address, ("POST", "/v1/scenes/row/sessions"), None, &body).await;
        assert_eq!(
            (answer.status, &answer.problem()["pointer"]),
            (400, &json!(pointer)),
            "{body}"
        );
    }
    let body = json!({"position": at});
    let answer = json(server.address, ("POST", "/v1/scenes/nowhere/sessions"), None, &body).await;
    assert_eq!(answer.problem()["status"], 404);
    let text = ("text/plain", "{}");
    assert_eq!(
        ask(server.address, ("POST", "/v1/scenes/row/sessions"), None, text)
            .await
            .status,
        415
    );
    let large = format!("{{\"name\": \"{}\"}}", "x".repeat(70_000));
    let large = ("application/json", large.as_str());
    assert_eq!(
        ask(server.address, ("POST", "/v1/scenes/row/sessions"), None, large)
            .await
            .status,
        413
    );
}

#[tokio::test]
async fn what_is_no_mover_is_refused_by_what_was_sent() {
    let server = Server::start().await;
    let key = |t_ms: i64, x: f64| json!({"t_ms": t_ms, "position": [x, 0.5, 0.5]});
    let way = |keys: Value| json!({"trajectory": {"keys": keys}});
    let with = |name: &str, value: Value| {
        let mut body = way(json!([key(0, 0.5)]));
        body[name] = value;
        body
    };
    for (body, pointer) in [
        (way(json!([])), "/trajectory/keys"),
        (way(json!([key(0, 1e300)])), "/trajectory/keys/0/position"),
        (way(json!([key(0, 0.5), key(100, 1e5)])), "/trajectory/keys/1/position"),
        (
            way(json!([{"t_ms": 0, "position": [0, 0, 0], "orientation": [0, 0, 0, 0]}])),
            "/trajectory/keys/0/orientation",
        ),
        (way(json!([key(0, 0.5), key(0, 1.0)])), "/trajectory/keys/1/t_ms"),
        (way(json!([key(0, 0.5), key(1, 2.0)])), "/trajectory/keys/1/t_ms"),
        (way(json!([key(0, 0.5), {"t_ms": 5}])), "/trajectory/keys/1"),
        (with("position", json!([0.5, 0.5, 0.5])), "/position"),
        (with("orientation", json!([0, 0, 0, 1])), "/orientation"),
        (with("t_ms", json!(0)), "/t_ms"),
        (with("max_speed_mps", json!(5)), "/max_speed_mps"),
        (json!({"max_speed_mps": 5}), ""),
    ] {
        let answer = json(server.address, ("POST", "/v1/scenes/row/movers"), None, &body).await;
        let problem = answer.problem();
        assert_eq!((answer.status, &problem["pointer"]), (400, &json!(pointer)), "{body}");
    }
}

#[tokio::test]
async fn what_is_no_token_is_not_called_a_missing_one() {
    let server = Server::start().await;
    let a = Person::enter(server.address, 0.5).await;
    let events = a.path("/events");
    let kind = |answer: &crate::wire::Answer| answer.problem()["type"].as_str().unwrap().to_owned();
    assert_eq!(
        kind(&send(server.address, "GET", &events, &[]).await),
        "/problems/no-token"
    );
    let malformed = [
        send(server.address, "GET", &format!("{events}?token=guess"), &[]).await,
        send(server.address, "GET", &events, &[("Authorization", "Bearer ABC")]).await,
        send(
            server.address,
            "GET",
            &events,
            &[("Authorization", "Basic Zm9vOmJhcg==")],
        )
        .await,
    ];
    for answer in malformed {
        assert_eq!(
            (answer.status, kind(&answer).as_str(), answer.header("www-authenticate")),
            (401, "/problems/bad-token", Some("Bearer"))
        );
    }
    let line = (
        "application/x-ndjson",
        r#"{"object": "o100000000", "token": "guess", "position": [0, 0, 0]}"#,
    );
    let batch = ask(server.address, ("POST", "/v1/scenes/row/movers/poses"), None, line).await;
    let refused = &batch.json()["refused"][0];
    assert_eq!(
        (&refused["status"], &refused["pointer"]),
        (&json!(401), &json!("/token"))
    );
}

/// By itself serde takes an array for an object whose members have these values.
#[tokio::test]
async fn an_array_is_no_object_however_deep_it_stands() {
    let server = Server::start().await;
    let a = Person::enter(server.address, 0.5).await;
    let pose = a.put("/pose", &json!([100, [0.5, 0.5, 0.5], null, null, null])).await;
    let detail = pose.problem()["detail"].as_str().unwrap().to_owned();
    assert!(pose.status == 400 && detail.contains("expected an object"), "{detail}");
    let ask = async |path: &str, body: Value| {
        let answer = json(server.address, ("POST", path), None, &body).await;
        (answer.status, answer.problem()["pointer"].clone())
    };
    let session = json!({"position": [0.5, 0.5, 0.5], "aoi": [50, 60]});
    assert_eq!(ask("/v1/scenes/row/sessions", session).await, (400, json!("/aoi")));
    let mover = json!({"trajectory": {"keys": [[0, [0.5, 0.5, 0.5], null]]}});
    let key = "/trajectory/keys/0";
    assert_eq!(ask("/v1/scenes/row/movers", mover).await, (400, json!(key)));
    assert_eq!(ask("/v1/scenes/row/visible", json!([])).await.0, 400);
}

#[tokio::test]
async fn nobody_speaks_for_somebody_else() {
    let server = Server::start().await;
    let a = Person::enter(server.address, 0.5).await;
    let b = Person::enter(server.address, 0.9).await;
    let pose = json!({"position": [0.5, 0.5, 0.5]});
    let path = a.path("/pose");
    let no_token = json(server.address, ("PUT", &path), None, &pose).await;
    assert_eq!(
        (no_token.status, no_token.header("www-authenticate")),
        (401, Some("Bearer"))
    );
    assert_eq!(
        json(server.address, ("PUT", &path), Some(&b.token), &pose)
            .await
            .problem()["status"],
        403
    );
    assert_eq!(
        json(server.address, ("PUT", &path), Some("guess"), &pose).await.status,
        401
    );
    let events = a.path("/events");
    assert_eq!(send(server.address, "GET", &events, &[]).await.problem()["status"], 401);
    let stolen = format!("{events}?token={}", b.token);
    assert_eq!(send(server.address, "GET", &stolen, &[]).await.status, 403);
    assert_eq!(
        send(server.address, "GET", "/v1/sessions/s999/events", &[])
            .await
            .status,
        404
    );
    assert_eq!(
        send(server.address, "GET", "/v1/sessions/me/events", &[]).await.status,
        400
    );
    let basic = [("Authorization", "Basic Zm9vOmJhcg==")];
    assert_eq!(send(server.address, "GET", &events, &basic).await.status, 401);
}

#[tokio::test]
async fn time_does_not_run_backwards() {
    let server = Server::start().await;
    let a = Person::enter(server.address, 0.5).await;
    let at = |t_ms: i64| json!({"t_ms": t_ms, "position": [0.5, 0.5, 0.5]});
    assert_eq!(a.put("/pose", &at(1_000)).await.status, 200);
    assert_eq!(
        a.put("/pose", &at(1_000)).await.status,
        200,
        "the same again does no harm"
    );
    assert_eq!(refused(&a, "/pose", &at(999)).await, "/t_ms");
    let body = json!({"position": [0.5, 0.5, 0.5]});
    let late = Person::enter_scene(server.address, "row", &body).await;
    assert_eq!(
        late.put("/pose", &at(100)).await.status,
        200,
        "a clock may be shown late"
    );
    let far_ahead = a.put("/pose", &at(4_000_000_000_000)).await;
    assert_eq!(far_ahead.status, 200, "whose clock is wrong has one nevertheless");
}

#[tokio::test]
async fn a_flood_is_told_to_wait_and_its_newest_pose_is_kept() {
    let server = Server::start().await;
    let a = Person::enter(server.address, 0.5).await;
    let b = Person::enter(server.address, 0.6).await;
    let mut stream = b.listen().await;
    stream.wait("object-info").await;
    let mut flooded = false;
    let mut last = 0.0;
    for step in 0..2_000 {
        last = 0.5 + f64::from(step) * 1e-4;
        let answer = a.put("/pose", &json!({"position": [last, 0.5, 0.5]})).await;
        flooded = answer.status == 429;
        if flooded {
            assert_eq!(answer.header("retry-after"), Some("1"));
            answer.problem();
            break;
        }
    }
    if !flooded {
        // A machine this slow cannot flood anybody.
        return;
    }
    stream.wait_for(&a.object, last).await;
}

#[tokio::test]
async fn beyond_the_limits_there_is_no_room() {
    let server = Server::start_with(Settings {
        live: LiveArgs {
            max_sessions: Some(1),
            max_movers: Some(0),
            ..LiveArgs::default()
        },
        ..Settings::default()
    })
    .await;
    let a = Person::enter(server.address, 0.5).await;
    let body = json!({"position": [0.5, 0.5, 0.5]});
    for path in ["/v1/scenes/row/sessions", "/v1/scenes/row/movers"] {
        let answer = json(server.address, ("POST", path), None, &body).await;
        assert_eq!((answer.status, answer.header("retry-after")), (503, Some("10")));
        answer.problem();
    }
    assert_eq!(a.leave().await, 204);
    Person::enter(server.address, 0.5).await;
}

#[tokio::test]
async fn a_flood_of_sessions_takes_no_more_room_than_there_is_and_goes_with_its_leases() {
    const ROOM: usize = 5;
    let server = Server::start_with(Settings {
        live: LiveArgs {
            max_sessions: Some(ROOM),
            max_sessions_per_address: Some(ROOM),
            lease_s: Some(1),
            ..LiveArgs::default()
        },
        ..Settings::default()
    })
    .await;
    let body = json!({"position": [0.5, 0.5, 0.5]});
    let knock = || json(server.address, ("POST", "/v1/scenes/row/sessions"), None, &body);
    let number = |answer: Value| -> u32 { answer["object"].as_str().unwrap()[1..].parse().unwrap() };
    let mut objects = Vec::new();
    for _ in 0..200 {
        let answer = knock().await;
        match answer.status {
            201 => objects.push(number(answer.json())),
            status => assert_eq!((status, answer.header("retry-after")), (503, Some("10"))),
        }
    }
    assert!(objects.len() >= ROOM && objects.is_sorted(), "{objects:?}");
    let sessions = metric(server.address, "belvedere_live_sessions").await;
    let open: usize = sessions.parse().unwrap();
    assert!(open <= ROOM, "{open} of {ROOM}");
    // Who was sent away has taken no id, of which there are so many and no more.
    let last = loop {
        let answer = knock().await;
        if answer.status == 201 {
            break number(answer.json());
        }
        tokio::time::sleep(std::time::Duration::from_millis(100)).await;
    };
    assert_eq!(last - objects[0], objects.len() as u32, "{objects:?}, then {last}");
}

#[tokio::test]
async fn movers_that_stay_are_few_and_the_operators() {
    let operator = "0123456789abcdef0123456789abcdef";
    let server = Server::start_with(Settings {
        live: LiveArgs {
            max_persistent: Some(1),
            operator_token: Some(operator.to_owned()),
            ..LiveArgs::default()
        },
        ..Settings::default()
    })
    .await;
    let path = "/v1/scenes/row/movers";
    let stays = json!({"position": [0.5, 0.5, 0.5], "persistent": true});
    let passes = json!({"position": [0.5, 0.5, 0.5]});
    let a = Person::enter(server.address, 0.5).await;
    let make = |token: Option<String>, body: Value| async move {
        json(server.address, ("POST", path), token.as_deref(), &body).await
    };
    assert_eq!(make(None, stays.clone()).await.status, 401);
    assert_eq!(make(Some(a.token.clone()), stays.clone()).await.status, 403);
    let kept = make(Some(operator.to_owned()), stays.clone()).await;
    assert_eq!(kept.status, 201);
    assert_eq!(make(Some(operator.to_owned()), stays.clone()).await.status, 503);
    let stranger = make(None, passes).await;
    assert_eq!(stranger.status, 201, "others may pass through");
    for mover in [kept, stranger] {
        let path = format!("/v1/movers/{}", mover.json()["object"].as_str().unwrap());
        let bearer = format!("Bearer {operator}");
        let gone = send(server.address, "DELETE", &path, &[("Authorization", &bearer)]).await;
        assert_eq!(gone.status, 204);
    }
    assert_eq!(
        make(Some(operator.to_owned()), stays).await.status,
        201,
        "there is room again"
    );
}

/// Ids are drawn from the catalogue, so this never happens; if it did, nobody's mover may be lost.
#[tokio::test]
async fn a_mover_of_another_server_of_the_catalogue_keeps_its_id() {
    let server = Server::start().await;
    let make = async |body: Value| {
        let answer = json(server.address, ("POST", "/v1/scenes/row/movers"), None, &body).await;
        assert!(answer.status == 201 || answer.status == 503, "{answer:?}");
        (
            answer.status,
            answer.json()["object"].as_str().unwrap_or_default().to_owned(),
        )
    };
    let (_, last) = make(json!({"position": [0.5, 0.5, 0.5]})).await;
    let last: ObjectId = last.parse().unwrap();
    let theirs = KeptMover {
        object: ObjectId(last.0 + 1),
        token: "f".repeat(32),
        mover: "{}".to_owned(),
        pose: None,
    };
    let scene = "row".parse().unwrap();
    server.catalogue.keep_mover(&scene, &theirs).await.unwrap();
    let stays = json!({"position": [0.5, 0.5, 0.5], "persistent": true});
    assert_eq!(make(stays.clone()).await.0, 503);
    assert_eq!(make(stays).await, (201, ObjectId(last.0 + 2).to_string()));
    let kept = server.catalogue.kept_movers(&scene).await.unwrap();
    assert_eq!((kept.len(), &kept[0]), (2, &theirs));
}

#[tokio::test]
async fn movers_whose_senders_are_silent_end_unless_they_are_to_stay() {
    let server = Server::start_with(Settings {
        live: LiveArgs {
            mover_lease_s: Some(1),
            ..LiveArgs::default()
        },
        ..Settings::default()
    })
    .await;
    let a = Person::enter(server.address, 0.5).await;
    let mut stream = a.listen().await;
    let path = "/v1/scenes/row/movers";
    let body = json!({"position": [0.6, 0.5, 0.5], "persistent": true});
    let stays = json(server.address, ("POST", path), None, &body).await.json()["object"].clone();
    let body = json!({"position": [0.4, 0.5, 0.5]});
    let driven = json(server.address, ("POST", path), Some(&a.token), &body).await.json()["object"].clone();
    let silent = json(server.address, ("POST", path), None, &body).await.json()["object"].clone();
    let gone = stream.wait("object-gone").await.data;
    assert_eq!(
        (&gone["objects"], &gone["reason"]),
        (&json!([silent]), &json!("destroyed"))
    );
    for (object, token, status) in [
        (&stays, None, 401),
        (&driven, Some(&a.token), 200),
        (&silent, None, 404),
    ] {
        let path = format!("/v1/movers/{}/pose", object.as_str().unwrap());
        let answer = json(server.address, ("PUT", &path), token.map(String::as_str), &body).await;
        assert_eq!(answer.status, status, "{object}");
    }
}
