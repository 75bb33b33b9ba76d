//! Scenes that are not for everybody: what strangers are told, what links and keys open, and what caches may keep.

use std::{
    net::SocketAddr,
    time::{Duration, SystemTime},
};

use belvedere::{
    config::Settings,
    keys::{Keys, Scope, Wanted},
    links::LinkKey,
};
use belvedere_scene::{SceneName, pointer::Pointer};
use serde_json::json;
use sqlx::{Connection, Executor, SqliteConnection};

use crate::{
    live_wire::{Person, ask},
    scene::{Server, publish_as},
    wire::{Answer, get, send},
};

const POSITION: &str = r#"{"position": [0.5, 0.5, 0.5]}"#;
const JSON: (&str, &str) = ("application/json", POSITION);
const FAR: u64 = 4_000_000_000;

/// A server with the public scene `row` and the private scene `cellar`, which have everything in common but manifests.
struct Cellar {
    server: Server,
    key: LinkKey,
    pointer: Pointer,
}

/// Waits until a server has heard of a change.
async fn until(address: SocketAddr, path: &str, status: u16) {
    for _ in 0..500 {
        if get(address, path).await.status == status {
            return;
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    panic!("{path} never became {status}");
}

fn cellar() -> SceneName {
    "cellar".parse().unwrap()
}

impl Cellar {
    async fn start() -> Self {
        let server = Server::start_with(Settings {
            max_bakes: Some(0),
            ..Settings::default()
        })
        .await;
        let key = LinkKey::random().unwrap();
        server.catalogue.make_private(&cellar(), key.secret()).await.unwrap();
        let pointer = publish_as(&server.catalogue, &server.blobs, "cellar", "A cellar").await;
        let cellar = Self { server, key, pointer };
        cellar.until(&cellar.inside("/v1/scenes/cellar"), 200).await;
        cellar
    }

    /// A path below a link that holds.
    fn inside(&self, path: &str) -> String {
        format!("{}{}", self.key.sign(&cellar(), FAR).trim_end_matches('/'), path)
    }

    async fn get(&self, path: &str) -> Answer {
        get(self.server.address, path).await
    }

    async fn until(&self, path: &str, status: u16) {
        until(self.server.address, path, status).await;
    }

    async fn key(&self, scopes: &[Scope], scene: &str) -> String {
        let wanted = Wanted {
            name: "test".into(),
            scopes: scopes.to_vec(),
            scenes: Some(vec![scene.parse().unwrap()]),
            days: None,
        };
        let keys = Keys::new(self.server.catalogue.clone());
        keys.create(&wanted).await.unwrap().reveal()
    }

    async fn get_with(&self, path: &str, key: &str) -> Answer {
        let bearer = format!("Bearer {key}");
        send(self.server.address, "GET", path, &[("Authorization", &bearer)]).await
    }

    fn manifest(&self) -> String {
        self.pointer.manifest.url()
    }
}

/// An answer with one name in the place of another.
fn told(answer: &Answer, from: &str, to: &str) -> (u16, String, Vec<(String, String)>) {
    let fields = answer
        .fields()
        .map(|(name, value)| (name.to_lowercase(), value.replace(from, to)));
    let fields = fields.filter(|(name, _)| !["date", "x-request-id", "content-length"].contains(&name.as_str()));
    let body = String::from_utf8(answer.body.clone()).unwrap();
    (answer.status, body.replace(from, to), fields.collect())
}

#[tokio::test]
async fn to_strangers_a_private_scene_is_not_there() {
    let town = Cellar::start().await;
    let address = town.server.address;
    // Now it is in the memory of the server.
    assert_eq!(town.get(&town.inside(&town.manifest())).await.status, 200);
    let list = town.get("/v1/scenes").await.json();
    assert_eq!(list["scenes"].as_array().unwrap().len(), 1, "{list}");
    for path in [
        "",
        "/index.json",
        "/cells?at=0,0,0",
        "/cells/c0",
        "/cells/c0/visible",
        "/objects?bbox=0,0,0,1,1,1",
        "/objects/o0",
        "/objects/o0/lods/0",
        "/objects/o0/lods/0?form=plain",
    ] {
        let (there, nowhere) = (format!("/v1/scenes/cellar{path}"), format!("/v1/scenes/nowhr{path}"));
        let (there, nowhere) = (town.get(&there).await, town.get(&nowhere).await);
        assert_eq!(there.status, 404, "{path}");
        assert_eq!(
            told(&there, "cellar", "nowhr"),
            told(&nowhere, "cellar", "nowhr"),
            "{path}"
        );
        assert_eq!(there.header("cache-control"), Some("no-store"), "{path}");
    }
    let token = "0".repeat(32);
    for (method, path, body) in [
        ("POST", "visible", POSITION),
        ("POST", "sessions", POSITION),
        ("POST", "movers", POSITION),
        ("POST", "movers/poses", ""),
        ("PUT", "doors/o6", r#"{"open": true}"#),
    ] {
        let kind = if body.is_empty() {
            "application/x-ndjson"
        } else {
            "application/json"
        };
        let (there, nowhere) = (format!("/v1/scenes/cellar/{path}"), format!("/v1/scenes/nowhr/{path}"));
        let there = ask(address, (method, &there), Some(&token), (kind, body)).await;
        let nowhere = ask(address, (method, &nowhere), Some(&token), (kind, body)).await;
        assert_eq!(there.status, 404, "{path}");
        assert_eq!(
            told(&there, "cellar", "nowhr"),
            told(&nowhere, "cellar", "nowhr"),
            "{path}"
        );
    }
}

#[tokio::test]
async fn a_hash_opens_nothing_that_only_private_scenes_need() {
    let town = Cellar::start().await;
    let (manifest, unknown) = (town.manifest(), format!("/o/{}.json", "0".repeat(64)));
    assert_eq!(town.get(&town.inside(&manifest)).await.status, 200);
    let bundle = |path: &str| format!("/o/bundle/{}", path.trim_start_matches("/o/"));
    for (there, nowhere) in [
        (manifest.clone(), unknown.clone()),
        (bundle(&manifest), bundle(&unknown)),
    ] {
        let (answer, unknown) = (town.get(&there).await, town.get(&nowhere).await);
        let hash = &manifest[3..67];
        assert_eq!(answer.status, 404);
        assert_eq!(told(&answer, hash, &"0".repeat(64)), told(&unknown, "", ""));
    }
    let object = town.get("/v1/scenes/row/objects/o0").await.json();
    let shared = object["levels"][0]["url"].as_str().unwrap();
    assert_eq!(town.get(shared).await.status, 200, "a public scene needs it, too");

    // What was public and is not any more, is not read from memory either.
    let row: SceneName = "row".parse().unwrap();
    town.server
        .catalogue
        .make_private(&row, town.key.secret())
        .await
        .unwrap();
    town.until("/v1/scenes/row", 404).await;
    assert_eq!(town.get(shared).await.status, 404);
    assert_eq!(
        town.get(&town.inside(shared)).await.status,
        200,
        "the cellar needs it still"
    );
    town.server.catalogue.make_public(&row).await.unwrap();
    town.until(shared, 200).await;
}

#[tokio::test]
async fn who_may_read_a_private_scene_wears_from_it_and_others_are_told_that_there_is_none() {
    let town = Cellar::start().await;
    let address = town.server.address;
    let asked = |scene: &str| json!({"position": [0.5, 0.5, 0.5], "avatar": {"scene": scene, "object": "o1"}});
    let path = ("POST", "/v1/scenes/row/sessions");
    let there = crate::live_wire::json(address, path, None, &asked("cellar")).await;
    let nowhere = crate::live_wire::json(address, path, None, &asked("nowhr")).await;
    assert_eq!(
        (there.status, &there.problem()["pointer"]),
        (400, &json!("/avatar/scene"))
    );
    assert_eq!(told(&there, "cellar", "nowhr"), told(&nowhere, "cellar", "nowhr"));
    let key = town.key(&[Scope::Read], "cellar").await;
    let wearer = Person::enter_as(address, "", Some(&key), "row", &asked("cellar")).await;
    let watcher = Person::enter(address, 0.6).await;
    let info = watcher.listen().await.wait("object-info").await.data;
    assert_eq!((&info["object"], &info["model"]), (&json!(wearer.object), &json!("m0")));
    // From the folder of its link as well, and from there a public scene's.
    let link = town.inside("");
    let inside = format!("{link}/v1/scenes/cellar/sessions");
    for scene in ["cellar", "row"] {
        let opened = crate::live_wire::json(address, ("POST", &inside), None, &asked(scene)).await;
        assert_eq!(opened.status, 201, "{scene}: {:?}", opened.json());
    }
}

#[tokio::test]
async fn what_no_scene_needs_is_for_nobody_where_something_is_private() {
    let town = Cellar::start().await;
    let stray = belvedere_scene::BlobName::of(b"stray", "txt").unwrap();
    town.server
        .blobs
        .put(&stray, bytes::Bytes::from_static(b"stray"))
        .await
        .unwrap();
    assert_eq!(town.get(&stray.url()).await.status, 404);
    assert_eq!(town.get(&town.inside(&stray.url())).await.status, 404);
}

#[tokio::test]
async fn a_link_opens_its_scene_and_its_caches_end_with_it() {
    let town = Cellar::start().await;
    let list = town.get(&town.inside("/v1/scenes/index.json")).await.json();
    assert_eq!(list["scenes"][0]["scene"], "cellar");
    assert_eq!(list["scenes"].as_array().unwrap().len(), 1);
    let bundle = format!("/o/bundle/{}", &town.manifest()[3..]);
    for path in [
        "/v1/scenes/cellar",
        &town.manifest(),
        &bundle,
        "/v1/scenes/cellar/cells/c0/visible",
        "/",
    ] {
        assert_eq!(town.get(&town.inside(path)).await.status, 200, "{path}");
    }
    let level = town.get(&town.inside("/v1/scenes/cellar/objects/o0/lods/0")).await;
    let place = level.header("content-location").unwrap();
    assert_eq!(town.get(place).await.body, level.body, "{place}");

    let soon = std::time::SystemTime::now()
        .duration_since(std::time::UNIX_EPOCH)
        .unwrap()
        .as_secs()
        + 1_000;
    let link = town.key.sign(&cellar(), soon);
    let answer = town.get(&format!("{link}{}", &town.manifest()[1..])).await;
    let kept = answer.header("cache-control").unwrap();
    let seconds = kept
        .strip_prefix("public, max-age=")
        .unwrap()
        .strip_suffix(", immutable")
        .unwrap();
    assert!((1..=1_000).contains(&seconds.parse::<u64>().unwrap()), "{kept}");

    for path in ["/metrics", "/healthz", "/openapi.json", "/v1/jobs/j0", ""] {
        let answer = town.get(&town.inside(path)).await;
        assert_eq!(answer.status, 404, "{path}");
        let text = String::from_utf8(answer.body).unwrap();
        assert!(!text.contains(&town.key.sign(&cellar(), FAR)[20..60]), "{text}");
    }
}

#[tokio::test]
async fn a_link_that_nobody_signed_leads_nowhere_and_an_expired_one_says_so() {
    let town = Cellar::start().await;
    let other = "other".parse().unwrap();
    let others = LinkKey::random().unwrap();
    town.server
        .catalogue
        .make_private(&other, others.secret())
        .await
        .unwrap();
    publish_as(&town.server.catalogue, &town.server.blobs, "other", "Another").await;
    town.until(&format!("{}v1/scenes/other", others.sign(&other, FAR)), 200)
        .await;
    let expired = town
        .get(&format!("{}v1/scenes/cellar", town.key.sign(&cellar(), 1)))
        .await;
    assert_eq!(
        (expired.status, expired.problem()["type"].clone()),
        (403, "/problems/link-expired".into())
    );
    assert_eq!(expired.header("cache-control"), Some("no-store"));

    let forged = LinkKey::random().unwrap();
    let nowhere = town
        .get(&format!(
            "{}v1/scenes/cellar",
            forged.sign(&"nowhere".parse().unwrap(), FAR)
        ))
        .await;
    assert_eq!(nowhere.status, 404);
    for (key, scene, until_s) in [
        (&forged, cellar(), FAR),
        (&forged, cellar(), 1),
        (&town.key, other.clone(), FAR),
    ] {
        let answer = town
            .get(&format!("{}v1/scenes/cellar", key.sign(&scene, until_s)))
            .await;
        assert_eq!(told(&answer, "", ""), told(&nowhere, "", ""), "{scene} {until_s}");
    }
    assert_eq!(
        town.get(&town.inside("/v1/scenes/other")).await.status,
        404,
        "it opens its own scene alone"
    );
    assert_eq!(
        town.get(&town.inside("/v1/scenes/row")).await.status,
        200,
        "what is public is public here as well"
    );

    let new = LinkKey::random().unwrap();
    assert!(
        town.server
            .catalogue
            .replace_link_key(&cellar(), new.secret())
            .await
            .unwrap()
    );
    town.until(&town.inside("/v1/scenes/cellar"), 404).await;
}

#[tokio::test]
async fn a_key_that_may_read_opens_a_scene_and_no_cache_shares_its_answers() {
    let town = Cellar::start().await;
    let reader = town.key(&[Scope::Read], "cellar").await;
    for path in ["/v1/scenes/cellar", &town.manifest(), "/v1/scenes/cellar/cells/c0"] {
        let answer = town.get_with(path, &reader).await;
        assert_eq!(answer.status, 200, "{path}");
        let kept = answer.header("cache-control").unwrap();
        assert!(kept.starts_with("private, max-age="), "{path}: {kept}");
    }
    assert_eq!(
        town.get_with("/v1/scenes", &reader).await.json()["scenes"]
            .as_array()
            .unwrap()
            .len(),
        2
    );
    let elsewhere = town.key(&[Scope::Read], "row").await;
    let publisher = town.key(&[Scope::Publish, Scope::Rollback], "cellar").await;
    let unknown = format!("bvk_{}_{}", "0".repeat(16), "0".repeat(64));
    for (key, status) in [(&elsewhere, 404), (&publisher, 404), (&unknown, 401)] {
        for path in ["/v1/scenes/cellar", "/v1/scenes/nowhere", &town.manifest()] {
            assert_eq!(town.get_with(path, key).await.status, status, "{path}");
        }
    }
}

#[tokio::test]
async fn a_session_needs_its_link_for_as_long_as_it_lasts() {
    let town = Cellar::start().await;
    let address = town.server.address;
    let opened = ask(
        address,
        ("POST", &town.inside("/v1/scenes/cellar/sessions")),
        None,
        JSON,
    )
    .await;
    assert_eq!(opened.status, 201);
    let (opened, token) = (opened.json(), opened.json()["token"].as_str().unwrap().to_owned());
    let pose = format!("/v1/sessions/{}/pose", opened["session"].as_str().unwrap());
    let inside = town.inside(&pose);
    assert_eq!(ask(address, ("PUT", &inside), Some(&token), JSON).await.status, 200);
    assert_eq!(ask(address, ("PUT", &pose), Some(&token), JSON).await.status, 404);
    let reader = town.key(&[Scope::Read], "cellar").await;
    let with_key = format!("{pose}?token={token}");
    assert_eq!(ask(address, ("PUT", &with_key), Some(&reader), JSON).await.status, 200);
    // A public scene asks for nothing but the token.
    let opened = ask(address, ("POST", "/v1/scenes/row/sessions"), None, JSON)
        .await
        .json();
    let pose = format!("/v1/sessions/{}/pose", opened["session"].as_str().unwrap());
    assert_eq!(
        ask(address, ("PUT", &pose), opened["token"].as_str(), JSON)
            .await
            .status,
        200
    );
}

#[tokio::test]
async fn an_upload_may_make_its_scene_private_before_it_is_baked() {
    let town = Cellar::start().await;
    let publisher = town.key(&[Scope::Publish], "row").await;
    let put = async |scene: &str, query: &str, key: &str| {
        let path = format!("/v1/scenes/{scene}{query}");
        let source = ("application/octet-stream", "x");
        ask(town.server.address, ("PUT", &path), Some(key), source).await
    };
    let wrong = put("row", "?private=no", &publisher).await;
    assert_eq!(wrong.problem()["parameter"], "private");
    // What everybody sees is hidden by whoever runs the server alone.
    let refused = put("row", "?private=true", &publisher).await;
    assert_eq!(
        (refused.status, refused.problem()["type"].clone()),
        (409, "/problems/conflict".into())
    );
    assert_eq!(town.get("/v1/scenes/row").await.status, 200);

    let publisher = town.key(&[Scope::Publish], "attic").await;
    assert_eq!(put("attic", "?private=true", &publisher).await.status, 202);
    publish_as(&town.server.catalogue, &town.server.blobs, "attic", "An attic").await;
    let reader = town.key(&[Scope::Read], "attic").await;
    for _ in 0..500 {
        if town.get_with("/v1/scenes/attic", &reader).await.status == 200 {
            break;
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    assert_eq!(town.get_with("/v1/scenes/attic", &reader).await.status, 200);
    assert_eq!(town.get("/v1/scenes/attic").await.status, 404);
    assert_eq!(
        town.get("/v1/scenes").await.json()["scenes"].as_array().unwrap().len(),
        1
    );
}

#[tokio::test]
async fn what_a_session_hears_ends_with_what_has_opened_it() {
    let town = Cellar::start().await;
    let address = town.server.address;
    let body = json!({"position": [0.5, 0.5, 0.5]});
    let enter = async |link: &str, scene: &str| {
        let visitor = Person::enter_below(address, link.trim_end_matches('/'), scene, &body).await;
        visitor.listen().await
    };
    let now_s = SystemTime::UNIX_EPOCH.elapsed().unwrap().as_secs();
    let mut until_expiry = enter(&town.key.sign(&cellar(), now_s + 3), "cellar").await;
    let mut until_new_key = enter(&town.inside(""), "cellar").await;
    let mut until_private = enter("", "row").await;
    for stream in [&mut until_expiry, &mut until_new_key, &mut until_private] {
        stream.begins().await;
    }
    until_expiry.ends().await;

    let new = LinkKey::random().unwrap();
    let replaced = town.server.catalogue.replace_link_key(&cellar(), new.secret()).await;
    assert!(replaced.unwrap());
    until_new_key.ends().await;

    let row = "row".parse().unwrap();
    assert!(town.server.catalogue.make_private(&row, new.secret()).await.unwrap());
    until_private.ends().await;
}

#[tokio::test]
async fn a_stream_ends_with_its_key_also_where_too_many_wrong_ones_were_shown() {
    let town = Cellar::start().await;
    let address = town.server.address;
    let reader = town.key(&[Scope::Read], "cellar").await;
    let body = json!({"position": [0.5, 0.5, 0.5]});
    let visitor = Person::enter_as(address, "", Some(&reader), "cellar", &body).await;
    let mut stream = visitor
        .listen_after(&format!("Authorization: Bearer {reader}\r\n"))
        .await;
    stream.begins().await;

    let unknown = format!("bvk_{}_{}", "0".repeat(16), "0".repeat(64));
    let mut statuses = vec![];
    for _ in 0..25 {
        statuses.push(town.get_with("/v1/scenes/cellar", &unknown).await.status);
    }
    assert_eq!(statuses.last(), Some(&429), "{statuses:?}");
    let id = reader.split('_').nth(1).unwrap();
    assert!(Keys::new(town.server.catalogue.clone()).revoke(id).await.unwrap());
    // Whatever is published, who may see what is asked anew.
    publish_as(&town.server.catalogue, &town.server.blobs, "attic", "An attic").await;
    // Half of the time after which it would be asked for anyway.
    let ended = tokio::time::timeout(Duration::from_secs(30), stream.ends());
    ended.await.expect("whoever shows it is told that it is revoked");
}

#[tokio::test]
async fn an_upload_that_is_refused_leaves_its_scene_as_it_was() {
    let town = Cellar::start().await;
    let publisher = town.key(&[Scope::Publish], "attic").await;
    let put = async |query: &str, body: &str| {
        let path = format!("/v1/scenes/attic{query}");
        let source = ("application/octet-stream", body);
        ask(town.server.address, ("PUT", &path), Some(&publisher), source).await
    };
    let private = async || {
        let all = town.server.catalogue.private_scenes().await.unwrap();
        all.into_iter().map(|one| one.scene.to_string()).collect::<Vec<_>>()
    };
    assert_eq!(put("?private=true", "").await.problem()["status"], 400);
    assert_eq!(private().await, ["cellar"]);
    assert_eq!(put("?private=true", "x").await.status, 202);
    assert_eq!(private().await, ["attic", "cellar"]);
}

#[tokio::test]
async fn what_an_upload_does_not_know_it_refuses_and_says_what_was_meant() {
    let town = Cellar::start().await;
    let publisher = town.key(&[Scope::Publish], "attic").await;
    for (query, parameter, meant) in [
        ("privat=true", "privat", Some("`private`")),
        ("Private=true", "Private", Some("`private`")),
        ("PRIVATE=true", "PRIVATE", Some("`private`")),
        ("title=a&titel=b", "titel", Some("`title`")),
        ("secret=yes", "secret", None),
        ("private=true&private=true", "private", None),
        ("title=a&title=b", "title", None),
    ] {
        let path = format!("/v1/scenes/attic?{query}");
        let source = ("application/octet-stream", "x");
        let answer = ask(town.server.address, ("PUT", &path), Some(&publisher), source).await;
        assert_eq!(answer.status, 400, "{query}");
        let problem = answer.problem();
        assert_eq!(problem["parameter"], parameter, "{query}");
        let detail = problem["detail"].as_str().unwrap();
        assert!(meant.is_none_or(|meant| detail.contains(meant)), "{detail}");
    }
    assert!(town.server.catalogue.unfinished_jobs().await.unwrap().is_empty());
}

#[tokio::test]
async fn a_scene_is_private_before_it_is_known_what_it_needs() {
    let server = Server::start_with(Settings {
        max_bakes: Some(0),
        request_timeout_s: Some(1),
        ..Settings::default()
    })
    .await;
    let address = server.address;
    let attic = publish_as(&server.catalogue, &server.blobs, "attic", "An attic").await;
    until(address, "/v1/scenes/attic", 200).await;
    let manifest = attic.manifest.url();
    let public = get(address, "/v1/scenes/row").await.json()["manifest"]
        .as_str()
        .unwrap()
        .to_owned();
    for object in [&manifest, &public] {
        assert_eq!(get(address, object).await.status, 200);
    }
    let file = server.data.path().join(belvedere::db::FILE_NAME);
    let mut sqlite = SqliteConnection::connect(&format!("sqlite:{}", file.display()))
        .await
        .unwrap();
    sqlite
        .execute("ALTER TABLE revision_blobs RENAME TO away")
        .await
        .unwrap();
    let key = LinkKey::random().unwrap();
    let made = server.catalogue.make_private(&attic.scene, key.secret()).await;
    assert!(made.unwrap());
    until(address, "/v1/scenes/attic", 404).await;
    assert_eq!(get(address, "/v1/scenes/row").await.status, 200);
    for object in [&manifest, &public] {
        assert_eq!(
            get(address, object).await.status,
            503,
            "either may be the attic's alone"
        );
    }
    sqlite
        .execute("ALTER TABLE away RENAME TO revision_blobs")
        .await
        .unwrap();
    until(address, &manifest, 404).await;
    until(address, &public, 200).await;
    let inside = key.sign(&attic.scene, FAR);
    let inside = format!("{}{manifest}", inside.trim_end_matches('/'));
    until(address, &inside, 200).await;
}
