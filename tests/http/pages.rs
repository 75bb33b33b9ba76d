//! Documents and queries.

use std::time::Duration;

use belvedere::http::Metrics;
use sqlx::{Connection, Executor, SqliteConnection};

use crate::{
    scene::{CELLS, Server, glb, publish},
    wire::{get, send},
};

#[tokio::test]
async fn dashboards_and_alerts_ask_for_metrics_that_there_are() {
    let server = Server::start().await;
    get(server.address, "/healthz").await;
    let mut metrics = String::from_utf8(get(server.address, "/metrics").await.body).unwrap();
    // What only nodes have.
    metrics.push_str(&Metrics::new(true).text().unwrap());
    let mut asked = 0;
    for text in [
        include_str!("../../deploy/compose/grafana/belvedere.json"),
        include_str!("../../deploy/compose/alerts.yml"),
    ] {
        for name in text.split(|c: char| !(c.is_ascii_lowercase() || c == '_')) {
            if name.starts_with("belvedere_") {
                let there = metrics
                    .lines()
                    .any(|line| line.starts_with(&format!("{name}{{")) || line.starts_with(&format!("{name} ")));
                assert!(there, "{name} is not in {metrics}");
                asked += 1;
            }
        }
    }
    assert!(asked > 15, "only {asked}");
}

/// The image's variables go before the file, so such a line would do nothing.
#[test]
fn settings_for_kubernetes_say_nothing_that_the_image_has_said() {
    let image = include_str!("../../Dockerfile");
    let said = image.lines().find_map(|line| line.strip_prefix("ENV BELVEDERE_"));
    let said = said.expect("the image sets some").split_whitespace();
    let manifest = include_str!("../../deploy/kubernetes/belvedere.yaml");
    for variable in said {
        let (name, _) = variable.split_once('=').expect("a value");
        let name = name.trim_start_matches("BELVEDERE_").to_lowercase();
        let line = format!("    {name} = ");
        assert!(!manifest.lines().any(|l| l.starts_with(&line)), "{name}");
    }
}

#[test]
fn pods_go_on_serving_until_all_have_heard_that_they_go() {
    for manifest in [
        include_str!("../../deploy/kubernetes/belvedere.yaml"),
        include_str!("../../deploy/kubernetes/nodes.yaml"),
    ] {
        assert!(manifest.contains("preStop: {exec: {command: [sleep, "));
    }
}

#[test]
fn systemd_never_gives_the_server_up() {
    let unit = include_str!("../../deploy/belvedere.service");
    let (of_the_unit, _) = unit.split_once("[Service]").expect("a service");
    assert!(of_the_unit.contains("\nStartLimitIntervalSec=0\n") && unit.contains("\nRestart=on-failure\n"));
}

#[tokio::test]
async fn a_server_that_is_alone_says_nothing_of_nodes() {
    let server = Server::start().await;
    let metrics = String::from_utf8(get(server.address, "/metrics").await.body).unwrap();
    assert!(metrics.contains("belvedere_live_sessions"));
    assert!(!metrics.contains("belvedere_node_"), "{metrics}");
}

#[tokio::test]
async fn the_list_and_the_pointer_have_the_same_bytes_at_both_addresses() {
    let server = Server::start().await;
    for (short, long) in [
        ("/v1/scenes", "/v1/scenes/index.json"),
        ("/v1/scenes/row", "/v1/scenes/row/index.json"),
    ] {
        let (a, b) = (get(server.address, short).await, get(server.address, long).await);
        assert_eq!((a.status, &a.body), (200, &b.body));
        assert!(a.header("cache-control").unwrap().contains("stale-while-revalidate"));
        let etag = a.header("etag").unwrap();
        let unchanged = send(server.address, "GET", long, &[("If-None-Match", etag)]).await;
        assert_eq!(unchanged.status, 304);
        assert_eq!(unchanged.header("access-control-expose-headers"), Some("*"));
    }
    assert_eq!(
        get(server.address, "/v1/scenes").await.json()["scenes"][0]["scene"],
        "row"
    );
}

#[tokio::test]
async fn a_pointer_says_where_sessions_are_opened() {
    let server = Server::start().await;
    for path in ["/v1/scenes/row", "/v1/scenes/row/index.json"] {
        let answer = get(server.address, path).await;
        assert_eq!(
            answer.header("link"),
            Some("</v1/scenes/row/sessions>; rel=\"sessions\", </o/bundle/>; rel=\"bundles\"")
        );
        assert_eq!(answer.header("access-control-expose-headers"), Some("*"));
    }
    assert_eq!(get(server.address, "/v1/scenes").await.header("link"), None);
}

#[tokio::test]
async fn a_new_revision_appears_without_a_restart() {
    let server = Server::start().await;
    let before = get(server.address, "/v1/scenes/row").await;
    let pointer = publish(&server.catalogue, &server.blobs, "Another row").await;
    let moved = async {
        loop {
            let now = get(server.address, "/v1/scenes/row").await;
            if now.body != before.body {
                return now;
            }
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
    };
    let now = tokio::time::timeout(Duration::from_secs(20), moved).await.unwrap();
    assert_eq!(now.json()["revision"], pointer.revision.to_string());
    assert_ne!(now.header("etag"), before.header("etag"));
    let old = before.json()["revision"].as_str().unwrap().to_owned();
    let stale = get(
        server.address,
        &format!("/v1/scenes/row/cells/c0/visible?revision={old}"),
    )
    .await;
    assert_eq!(stale.status, 409);
    stale.problem();
}

#[tokio::test]
async fn a_revision_is_newer_than_those_before_also_where_the_clock_was_set_back() {
    let server = Server::start().await;
    let file = server.data.path().join(belvedere::db::FILE_NAME);
    let mut sqlite = SqliteConnection::connect(&format!("sqlite:{}", file.display()))
        .await
        .unwrap();
    let later = "UPDATE revisions SET published_at = '2999-12-31T23:59:59.999Z'";
    sqlite.execute(later).await.unwrap();
    let newer = publish(&server.catalogue, &server.blobs, "Another row").await;
    let kept = server.catalogue.kept_revisions(&newer.scene).await.unwrap();
    assert_eq!(kept.iter().map(|kept| kept.current).collect::<Vec<_>>(), [true, false]);
    assert_eq!(kept[0].published_at, "3000-01-01T00:00:00.000Z");
}

#[tokio::test]
async fn a_point_finds_its_cell_or_the_nearest() {
    let server = Server::start().await;
    let inside = get(server.address, "/v1/scenes/row/cells?at=3.5,0.5,0.5").await.json();
    assert_eq!(
        inside,
        serde_json::json!({"cell": "c3", "contains": true, "distance_m": 0.0})
    );
    let outside = get(server.address, "/v1/scenes/row/cells?at=10,0.5,0.5").await.json();
    assert_eq!(
        outside,
        serde_json::json!({"cell": "c7", "contains": false, "distance_m": 2.0})
    );
}

#[tokio::test]
async fn a_cell_is_answered_by_its_published_record() {
    let server = Server::start().await;
    let answer = get(server.address, "/v1/scenes/row/cells/c3").await;
    assert_eq!(
        (
            answer.json()["cell"].as_str(),
            answer.json()["opvs"].as_array().unwrap().len()
        ),
        (Some("c3"), 7)
    );
    let same = get(server.address, answer.header("content-location").unwrap()).await;
    assert_eq!(same.body, answer.body);
    assert!(answer.header("cache-control").unwrap().contains("max-age=2,"));
}

#[tokio::test]
async fn a_level_is_answered_with_where_it_stands_for_ever() {
    let server = Server::start().await;
    let answer = get(server.address, "/v1/scenes/row/objects/o2/lods/0").await;
    assert_eq!(answer.body, glb());
    let info = get(server.address, "/v1/scenes/row/objects/o2").await.json();
    assert_eq!(info["levels"][0]["url"], answer.header("content-location").unwrap());
    assert_eq!(
        get(server.address, "/v1/scenes/row/objects/o2/lods/1").await.status,
        404
    );
}

/// Follows `next` to the end.
async fn all_pages(server: &Server, first: &str) -> Vec<String> {
    let (mut path, mut ids) = (first.to_owned(), vec![]);
    loop {
        let page = get(server.address, &path).await;
        assert_eq!(page.status, 200, "{path}: {page:?}");
        let page = page.json();
        ids.extend(
            page["objects"]
                .as_array()
                .unwrap()
                .iter()
                .map(|o| o["object"].as_str().unwrap().to_owned()),
        );
        match page["next"].as_str() {
            Some(next) => path = next.to_owned(),
            None => return ids,
        }
    }
}

#[tokio::test]
async fn pages_of_any_size_lead_through_everything_once_and_in_order() {
    let server = Server::start().await;
    for limit in 1..=CELLS + 1 {
        let seen = all_pages(&server, &format!("/v1/scenes/row/cells/c3/visible?limit={limit}")).await;
        assert_eq!(seen, ["o3", "o0", "o1", "o2", "o4", "o5", "o6", "o7"], "limit {limit}");
        let boxed = all_pages(
            &server,
            &format!("/v1/scenes/row/objects?bbox=2.5,0,0,6.0,1,1&limit={limit}"),
        )
        .await;
        assert_eq!(boxed, ["o2", "o3", "o4", "o5"], "limit {limit}");
    }
    let nothing = all_pages(&server, "/v1/scenes/row/objects?bbox=0,7,0,9,9,9").await;
    assert!(nothing.is_empty());
}

#[tokio::test]
async fn a_closed_door_leaves_out_what_is_seen_through_it_alone() {
    let server = Server::start().await;
    for limit in [1, 3, 100] {
        let before = all_pages(
            &server,
            &format!("/v1/scenes/row/cells/c3/visible?limit={limit}&closed=o6"),
        )
        .await;
        assert_eq!(before, ["o3", "o0", "o1", "o2", "o4", "o5", "o6"], "limit {limit}");
        let behind = all_pages(
            &server,
            &format!("/v1/scenes/row/cells/c7/visible?limit={limit}&closed=o6%2Co6"),
        )
        .await;
        assert_eq!(behind.len(), CELLS as usize, "limit {limit}");
    }
}

#[tokio::test]
async fn what_cannot_be_read_is_told_with_its_parameter() {
    let server = Server::start().await;
    for (path, status, parameter) in [
        ("/v1/scenes/row/cells", 400, Some("at")),
        ("/v1/scenes/row/cells?at=1,2", 400, Some("at")),
        ("/v1/scenes/row/cells?at=NaN,0,0", 400, Some("at")),
        ("/v1/scenes/row/cells?at=1,2,3,", 400, Some("at")),
        ("/v1/scenes/row/cells?at=1e999,2,3", 400, Some("at")),
        ("/v1/scenes/row/cells?at=%ff", 400, None),
        ("/v1/scenes/row/objects?bbox=Infinity,0,0,1,1,1", 400, Some("bbox")),
        ("/v1/scenes/row/objects", 400, Some("bbox")),
        ("/v1/scenes/row/cells/c0/visible?limit=0", 400, Some("limit")),
        ("/v1/scenes/row/cells/c0/visible?after=x", 400, Some("after")),
        ("/v1/scenes/row/cells/c0/visible?after=o99", 404, None),
        ("/v1/scenes/row/cells/c0/visible?closed=", 400, Some("closed")),
        ("/v1/scenes/row/cells/c0/visible?closed=o6,", 400, Some("closed")),
        ("/v1/scenes/row/cells/c0/visible?closed=c6", 400, Some("closed")),
        ("/v1/scenes/row/cells/c0/visible?closed=o5", 400, Some("closed")),
        ("/v1/scenes/row/cells/c0/visible?closed=o6,o99", 400, Some("closed")),
        ("/v1/scenes/row/cells/c0/visible?after=o7&closed=o6", 404, None),
        ("/v1/scenes/row/cells/12", 400, None),
        ("/v1/scenes/row/cells/c%ff", 400, None),
        ("/v1/scenes/row/cells/c99", 404, None),
        ("/v1/scenes/row/objects/o99", 404, None),
        ("/v1/scenes/row/objects/o0/lods/-1", 400, None),
        ("/v1/scenes/row/objects/o0/lods/0?form=obj", 400, Some("form")),
        (
            "/v1/scenes/row/objects/o0/lods/0?form=plain&form=plain",
            400,
            Some("form"),
        ),
        ("/v1/scenes/ROW", 400, None),
        ("/v1/scenes/%2e%2e", 400, None),
        ("/v1/scenes/nowhere", 404, None),
        ("/v1/scenes/nowhere/cells/c0", 404, None),
        ("/v2", 404, None),
        ("//", 404, None),
    ] {
        let answer = get(server.address, path).await;
        assert_eq!(answer.status, status, "{path}: {answer:?}");
        let problem = answer.problem();
        assert_eq!(problem["parameter"].as_str(), parameter, "{path}");
        assert_eq!(problem["instance"], path.split('?').next().unwrap());
    }
    let ignored = get(server.address, "/v1/scenes/row?anything=goes&&=").await;
    assert_eq!(ignored.status, 200);
}

#[tokio::test]
async fn a_plain_level_that_one_has_is_not_made_again() {
    let server = Server::start().await;
    let info = get(server.address, "/v1/scenes/row/objects/o2").await.json();
    let url = info["levels"][0]["url"].as_str().unwrap();
    let hash = url.strip_prefix("/o/").unwrap().strip_suffix(".glb").unwrap();
    let tag = format!("\"{hash}-plain-{}\"", env!("CARGO_PKG_VERSION"));
    let path = "/v1/scenes/row/objects/o2/lods/0?form=plain";
    // Of what stands for a level here none can be made.
    assert_eq!(get(server.address, path).await.status, 500);
    let unchanged = send(server.address, "GET", path, &[("If-None-Match", &tag)]).await;
    assert_eq!((unchanged.status, unchanged.header("etag")), (304, Some(tag.as_str())));
}

#[tokio::test]
async fn operations_see_what_happens() {
    let server = Server::start().await;
    assert_eq!(get(server.address, "/healthz").await.body, b"ok\n");
    assert_eq!(get(server.address, "/readyz").await.status, 200);
    get(server.address, "/v1/scenes/nowhere").await;
    let metrics = String::from_utf8(get(server.address, "/metrics").await.body).unwrap();
    assert!(
        metrics.contains("belvedere_http_requests_total{route=\"/v1/scenes/{scene}\",status=\"404\"} 1"),
        "{metrics}"
    );
    assert_eq!(get(server.address, "/openapi.json").await.json()["openapi"], "3.1.0");
    std::fs::remove_dir_all(server.data.path().join("o")).unwrap();
    // What was found holds for a second.
    let mut broken = get(server.address, "/readyz").await;
    for _ in 0..200 {
        if broken.status == 503 {
            break;
        }
        tokio::time::sleep(Duration::from_millis(50)).await;
        broken = get(server.address, "/readyz").await;
    }
    assert_eq!(broken.status, 503, "{broken:?}");
    broken.problem();
}

#[tokio::test]
async fn the_front_page_is_a_page_with_a_policy() {
    let server = Server::start().await;
    let page = get(server.address, "/").await;
    assert_eq!(
        (page.status, page.header("content-type")),
        (200, Some("text/html; charset=utf-8"))
    );
    assert_eq!(page.header("cache-control"), Some("no-cache"));
    let policy = page.header("content-security-policy").unwrap();
    for directive in [
        "default-src 'self'",
        "script-src 'self' 'wasm-unsafe-eval'",
        "style-src 'self'",
        "worker-src 'self'",
    ] {
        assert!(policy.contains(directive), "{policy}");
    }
}

#[tokio::test]
async fn files_of_the_page_come_compressed_to_whoever_takes_that() {
    let server = Server::start().await;
    let page = get(server.address, "/").await;
    let text = String::from_utf8(page.body.clone()).unwrap();
    let script = text.split('"').find(|part| part.ends_with(".js"));
    let script = script.expect("this program was built without its viewer: make viewer");
    let script = script.trim_start_matches("./");
    for path in ["/".to_owned(), format!("/{script}")] {
        let plain = get(server.address, &path).await;
        assert_eq!((plain.status, plain.header("content-encoding")), (200, None), "{path}");
        assert_eq!(plain.header("vary"), Some("Accept-Encoding"), "{path}");
        for coding in ["gzip", "zstd"] {
            let accept = ("Accept-Encoding", coding);
            let coded = send(server.address, "GET", &path, &[accept]).await;
            assert_eq!(coded.header("content-encoding"), Some(coding), "{path}");
            assert!(2 * coded.body.len() < plain.body.len(), "{path}: {}", coded.body.len());
            let etag = coded.header("etag").unwrap();
            assert_ne!(Some(etag), plain.header("etag"));
            let again = send(server.address, "GET", &path, &[accept, ("If-None-Match", etag)]).await;
            assert_eq!((again.status, again.header("etag")), (304, Some(etag)), "{path}");
            let decoded = match coding {
                "zstd" => zstd::decode_all(&coded.body[..]).unwrap(),
                _ => {
                    let mut decoded = Vec::new();
                    std::io::Read::read_to_end(&mut flate2::read::GzDecoder::new(&coded.body[..]), &mut decoded)
                        .unwrap();
                    decoded
                }
            };
            assert_eq!(decoded, plain.body, "{path}");
        }
        let none = send(server.address, "GET", &path, &[("Accept-Encoding", "identity;q=0, br")]).await;
        assert_eq!(none.status, 406, "{path}");
    }
}
