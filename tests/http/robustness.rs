//! Odd, hostile and unlucky clients.

use std::time::Duration;

use belvedere::config::Settings;
use belvedere_scene::BlobName;
use http_body_util::{BodyExt, Empty};
use hyper_util::rt::{TokioExecutor, TokioIo};
use sqlx::Connection;
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::TcpStream,
};

use crate::{
    scene::{Server, glb},
    wire::{Answer, get, parse, raw, send},
};

#[tokio::test]
async fn a_method_that_is_not_taken_is_told_which_are() {
    let server = Server::start().await;
    for method in ["POST", "PUT", "DELETE", "PATCH", "TRACE", "OPTIONS", "BREW"] {
        for path in ["/v1/scenes", "/v1/scenes/row/index.json", "/o/x", "/"] {
            let answer = send(server.address, method, path, &[("Content-Length", "0")]).await;
            assert_eq!(
                (answer.status, answer.header("allow")),
                (405, Some("GET,HEAD")),
                "{method} {path}"
            );
            answer.problem();
        }
    }
}

#[tokio::test]
async fn a_preflight_is_answered_for_a_day() {
    let server = Server::start().await;
    let headers = [
        ("Origin", "https://elsewhere"),
        ("Access-Control-Request-Method", "GET"),
    ];
    let answer = send(server.address, "OPTIONS", "/o/x", &headers).await;
    assert_eq!(
        (answer.status, answer.header("access-control-max-age")),
        (204, Some("86400"))
    );
    assert!(answer.header("access-control-allow-headers").unwrap().contains("Range"));
}

#[tokio::test]
async fn too_much_of_anything_is_refused() {
    let server = Server::start().await;
    let long = format!("/v1/scenes?x={}", "x".repeat(9000));
    assert_eq!(get(server.address, &long).await.problem()["status"], 414);
    let padding = "x".repeat(17_000);
    assert_eq!(
        send(server.address, "GET", "/v1/scenes", &[("X-Pad", &padding)])
            .await
            .problem()["status"],
        431
    );
    let body = send(server.address, "GET", "/v1/scenes", &[("Content-Length", "99999999")]).await;
    assert_eq!(body.problem()["status"], 413);
    let many: String = (0..500).map(|i| format!("x-{i}: 1\r\n")).collect();
    let answer = raw(
        server.address,
        format!("GET / HTTP/1.1\r\nHost: t\r\n{many}\r\n").as_bytes(),
    )
    .await;
    assert_eq!(parse(&answer).status, 431);
}

#[tokio::test]
async fn a_body_that_is_not_one_is_no_large_one() {
    let server = Server::start().await;
    let asked = |body: &str| format!("POST /v1/scenes/row/visible HTTP/1.1\r\nHost: t\r\nConnection: close\r\n{body}");
    for (body, status) in [
        ("Transfer-Encoding: chunked\r\n\r\nzz\r\nabc\r\n0\r\n\r\n", 400),
        ("Content-Length: 2000000\r\nExpect: 100-continue\r\n\r\n", 413),
    ] {
        let answer = parse(&raw(server.address, asked(body).as_bytes()).await);
        assert_eq!(answer.status, status, "{body:?}");
        answer.problem();
    }
}

#[tokio::test]
async fn a_small_body_on_a_get_is_ignored() {
    let server = Server::start().await;
    let request = b"GET /healthz HTTP/1.1\r\nHost: t\r\nConnection: close\r\nContent-Length: 5\r\n\r\nhello";
    assert_eq!(parse(&raw(server.address, request).await).status, 200);
}

#[tokio::test]
async fn heads_that_are_not_http_end_the_connection_and_nothing_else() {
    let server = Server::start().await;
    for request in [
        b"GET / HTTP/1.1\r\nHost: t\r\nBad Header\x01: x\r\n\r\n".as_slice(),
        b"GET /\x00 HTTP/1.1\r\nHost: t\r\n\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: t\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: t\r\nContent-Length: -1\r\n\r\n",
    ] {
        let answer = raw(server.address, request).await;
        assert!(answer.is_empty() || parse(&answer).status == 400, "{answer:?}");
    }
    let odd_value = b"GET /healthz HTTP/1.1\r\nHost: t\r\nConnection: close\r\nAccept-Encoding: \xff\xfe\r\n\r\n";
    assert_eq!(parse(&raw(server.address, odd_value).await).status, 200);
    assert_eq!(get(server.address, "/healthz").await.status, 200);
}

#[tokio::test]
async fn who_names_no_host_or_two_is_refused() {
    let server = Server::start().await;
    for host in [
        "",
        "Host: a\r\nHost: b\r\n",
        "Host: t\r\nHost: t\r\n",
        "Host: a b\r\n",
        "Host: me@t\r\n",
    ] {
        let request = format!("GET /healthz HTTP/1.1\r\n{host}Connection: close\r\n\r\n");
        let answer = parse(&raw(server.address, request.as_bytes()).await);
        assert_eq!(answer.status, 400, "{host:?}");
        answer.problem();
    }
    let old = b"GET /healthz HTTP/1.0\r\n\r\n";
    assert_eq!(parse(&raw(server.address, old).await).status, 200);
}

#[tokio::test]
async fn pipelined_requests_are_answered_in_order() {
    let server = Server::start().await;
    let request =
        b"GET /healthz HTTP/1.1\r\nHost: t\r\n\r\nGET /readyz HTTP/1.1\r\nHost: t\r\nConnection: close\r\n\r\n";
    let answer = String::from_utf8(raw(server.address, request).await).unwrap();
    let (ok, ready) = (
        answer.find("\r\n\r\nok\n").unwrap(),
        answer.find("\r\n\r\nready\n").unwrap(),
    );
    assert!(ok < ready);
}

#[tokio::test]
async fn an_address_that_asks_too_often_must_wait_but_not_for_objects_and_probes() {
    let server = Server::start_with(Settings {
        max_requests_per_s: Some(1),
        ..Settings::default()
    })
    .await;
    let mut last = get(server.address, "/v1/scenes").await;
    for _ in 0..20 {
        last = get(server.address, "/v1/scenes").await;
    }
    assert_eq!((last.status, last.header("retry-after")), (429, Some("1")));
    last.problem();
    let url = BlobName::of(&glb(), "glb").unwrap().url();
    for path in [&url, &url, "/healthz", "/readyz"] {
        assert_eq!(get(server.address, path).await.status, 200, "{path}");
    }
}

#[tokio::test]
async fn http2_without_tls_is_spoken_on_the_same_port() {
    let server = Server::start().await;
    let stream = TokioIo::new(TcpStream::connect(server.address).await.unwrap());
    let (mut sender, connection) = hyper::client::conn::http2::handshake(TokioExecutor::new(), stream)
        .await
        .unwrap();
    let connection = tokio::spawn(connection);
    let request = hyper::Request::get(format!("http://{}/v1/scenes", server.address));
    let answer = sender
        .send_request(request.body(Empty::<bytes::Bytes>::new()).unwrap())
        .await
        .unwrap();
    assert_eq!(
        (answer.status().as_u16(), answer.version()),
        (200, hyper::Version::HTTP_2)
    );
    assert!(!answer.into_body().collect().await.unwrap().to_bytes().is_empty());
    connection.abort();
}

#[tokio::test]
async fn stopping_waits_for_nobody_who_is_idle_or_half_said() {
    let mut server = Server::start().await;
    let mut idle = TcpStream::connect(server.address).await.unwrap();
    idle.write_all(b"GET /healthz HTTP/1.1\r\nHost: t\r\n\r\n")
        .await
        .unwrap();
    let mut some = [0; 64];
    assert!(idle.read(&mut some).await.unwrap() > 0);
    let mut half = TcpStream::connect(server.address).await.unwrap();
    half.write_all(b"GET /healthz HT").await.unwrap();
    let silent = TcpStream::connect(server.address).await.unwrap();
    server.stopping.cancel();
    let ended = tokio::time::timeout(Duration::from_secs(20), &mut server.running).await;
    ended.expect("still running").unwrap().unwrap();
    drop(silent);
    assert!(TcpStream::connect(server.address).await.is_err());
}

/// Addresses of immutable objects, spelt in ways that must not lead anywhere else.
#[tokio::test]
async fn escapes_in_the_name_of_an_object_lead_nowhere() {
    let server = Server::start().await;
    let name = BlobName::of(&glb(), "glb").unwrap().to_string();
    let escaped = name.replace('.', "%2e");
    for path in [
        "/o/..%2f..%2fetc%2fpasswd",
        "/o/%2e%2e/%2e%2e/catalogue.db",
        "/o/../catalogue.db",
        "/o/belvedere-store",
        "/o/%00",
        "/o/",
        &format!("/o//{name}"),
        &format!("/o/{name}/"),
        &format!("/o/{name}%00"),
        &format!("/o/{}", name.to_uppercase()),
    ] {
        assert_eq!(get(server.address, path).await.problem()["status"], 404, "{path}");
    }
    assert_eq!(get(server.address, "/o/%ff").await.problem()["status"], 400);
    assert_eq!(get(server.address, &format!("/o/{escaped}")).await.body, glb());
}

#[tokio::test]
async fn old_and_absolute_forms_of_a_request_are_understood() {
    let server = Server::start().await;
    let name = BlobName::of(&glb(), "glb").unwrap();
    for request in [
        format!("GET {} HTTP/1.0\r\n\r\n", name.url()),
        format!(
            "GET http://elsewhere{} HTTP/1.1\r\nHost: t\r\nConnection: close\r\n\r\n",
            name.url()
        ),
    ] {
        // Once from the store, once from memory.
        for _ in 0..2 {
            let answer = parse(&raw(server.address, request.as_bytes()).await);
            assert_eq!((answer.status, answer.body), (200, glb()), "{request}");
        }
    }
}

#[tokio::test]
async fn a_head_has_the_fields_of_the_get_and_no_body() {
    let server = Server::start().await;
    let url = BlobName::of(&glb(), "glb").unwrap().url();
    for headers in [[("Range", "bytes=0-9")], [("Accept-Encoding", "zstd")]] {
        let whole = send(
            server.address,
            "GET",
            &url,
            &headers[..usize::from(headers[0].0 != "Range")],
        )
        .await;
        for _ in 0..2 {
            let head = send(server.address, "HEAD", &url, &headers).await;
            assert_eq!((head.status, head.body.len()), (200, 0));
            for field in [
                "content-length",
                "etag",
                "content-type",
                "cache-control",
                "content-encoding",
            ] {
                assert_eq!(head.header(field), whole.header(field), "{field}");
            }
        }
    }
}

#[tokio::test]
async fn endless_lists_in_fields_are_answered_or_refused_at_once() {
    let server = Server::start().await;
    let url = BlobName::of(&glb(), "glb").unwrap().url();
    let ranges = |n: usize| format!("bytes={}", vec!["0-0"; n].join(","));
    let tags = |n: usize| vec!["\"x\""; n].join(", ");
    let accept = |n: usize| vec!["gzip;q=0.5"; n].join(",");
    for (field, value, expected) in [
        ("Range", ranges(3_000), 200),
        ("Range", ranges(1_000_000), 431),
        ("If-None-Match", tags(2_000), 200),
        ("If-None-Match", tags(100_000), 431),
        ("Accept-Encoding", accept(1_000), 200),
    ] {
        let answer = send(server.address, "GET", &url, &[(field, &value)]).await;
        assert_eq!(answer.status, expected, "{field} with {} bytes", value.len());
    }
    let query = format!("{url}?{}", "x".repeat(1 << 20));
    let answer = get(server.address, &query).await;
    assert!((400..500).contains(&answer.status), "{}", answer.status);
    assert_eq!(get(server.address, "/healthz").await.status, 200);
}

#[tokio::test]
async fn queries_that_cannot_be_read_are_told_what_is_wrong() {
    let server = Server::start().await;
    for (path, detail) in [
        ("/v1/scenes/row/cells", "`at`"),
        ("/v1/scenes/row/cells?at=%ff%fe", "UTF-8"),
        ("/v1/scenes/row/cells?at=1,2,3&at=1,2,3", "more than once"),
        ("/v1/scenes/row/cells/c0/visible?limit=0", "1 to 1000"),
        ("/v1/scenes/row/objects", "`bbox`"),
    ] {
        let problem = get(server.address, path).await.problem();
        assert_eq!(problem["status"], 400, "{path}");
        assert!(problem["detail"].as_str().unwrap().contains(detail), "{problem}");
    }
}

#[tokio::test]
async fn a_request_id_comes_back_and_an_error_always_has_one() {
    let server = Server::start().await;
    let url = BlobName::of(&glb(), "glb").unwrap().url();
    for path in ["/v1/scenes", &url, &url, "/v1/scenes/none"] {
        let answer = send(server.address, "GET", path, &[("X-Request-Id", "walk-7")]).await;
        assert_eq!(answer.header("x-request-id"), Some("walk-7"), "{path}");
    }
    let longest = "x".repeat(128);
    let kept = send(server.address, "GET", &url, &[("X-Request-Id", &longest)]).await;
    assert_eq!(kept.header("x-request-id"), Some(longest.as_str()));
    for odd in [&"x".repeat(129), "two words", "caf\u{e9}", ""] {
        let answer = send(server.address, "GET", &url, &[("X-Request-Id", odd)]).await;
        let ours = answer.header("x-request-id").expect("one of our own");
        assert!(answer.status == 200 && ours != odd && ours.len() < 40, "{ours}");
    }
    assert!(
        get(server.address, "/v1/scenes/none")
            .await
            .header("x-request-id")
            .is_some()
    );
    assert!(get(server.address, &url).await.header("x-request-id").is_none());
}

#[tokio::test]
async fn an_object_from_memory_is_answered_like_one_from_the_store() {
    let server = Server::start().await;
    let url = BlobName::of(&glb(), "glb").unwrap().url();
    let etag = format!("\"{}\"", BlobName::of(&glb(), "glb").unwrap().hash());
    for headers in [
        vec![],
        vec![("Range", "bytes=1-2")],
        vec![("Range", "bytes=1-2,5-6")],
        vec![("If-None-Match", etag.as_str())],
    ] {
        // A request id takes the long way.
        let traced: Vec<_> = headers.iter().copied().chain([("X-Request-Id", "1")]).collect();
        let long = send(server.address, "GET", &url, &traced).await;
        let short = send(server.address, "GET", &url, &headers).await;
        assert_eq!((long.status, &long.body), (short.status, &short.body));
        let fields = |answer: &Answer| {
            let mut fields: Vec<_> = answer
                .fields()
                .filter(|(n, _)| !["date", "x-request-id"].contains(n))
                .collect();
            fields.sort_unstable();
            fields
                .into_iter()
                .map(|(n, v)| (n.to_owned(), v.to_owned()))
                .collect::<Vec<_>>()
        };
        assert_eq!(fields(&long), fields(&short));
    }
    let metrics = String::from_utf8(get(server.address, "/metrics").await.body).unwrap();
    for (status, count) in [(200, 2), (206, 4), (304, 2)] {
        let line = format!("belvedere_http_requests_total{{route=\"/o/{{name}}\",status=\"{status}\"}} {count}\n");
        assert!(metrics.contains(&line), "no {line} in {metrics}");
    }
}

#[tokio::test]
async fn a_catalogue_that_can_only_be_read_is_not_ready() {
    let server = Server::start().await;
    let file = server.data.path().join("catalogue.sqlite");
    let sql = |text: &'static str| {
        let url = format!("sqlite:{}", file.display());
        async move {
            let mut beside = sqlx::SqliteConnection::connect(&url).await.unwrap();
            sqlx::Executor::execute(&mut beside, text).await.unwrap();
        }
    };
    sql("CREATE TRIGGER full BEFORE UPDATE ON mover_ids BEGIN SELECT RAISE(ABORT, 'no room'); END").await;
    let answer = get(server.address, "/readyz").await;
    let problem = answer.problem();
    assert_eq!(answer.status, 503);
    assert!(
        problem["detail"]
            .as_str()
            .unwrap()
            .starts_with("the catalogue cannot be written;"),
        "{problem}"
    );
    let metrics = String::from_utf8(get(server.address, "/metrics").await.body).unwrap();
    assert!(metrics.contains("\nbelvedere_catalogue_up 0\n"), "{metrics}");
    assert_eq!(
        get(server.address, "/v1/scenes/row/index.json").await.status,
        200,
        "what is known is served"
    );
}

#[tokio::test]
async fn who_is_answered_by_the_router_hears_the_date_once() {
    let server = Server::start().await;
    let body = "POST /v1/scenes/row/visible HTTP/1.1\r\nHost: t\r\nConnection: close\r\nContent-Length: 2\r\n\r\n{}";
    for request in [body, "GET /healthz HTTP/1.1\r\nHost: t\r\nConnection: close\r\n\r\n"] {
        let answer = String::from_utf8(raw(server.address, request.as_bytes()).await).unwrap();
        let head = answer.split_once("\r\n\r\n").unwrap().0.to_ascii_lowercase();
        assert_eq!(head.matches("\r\ndate: ").count(), 1, "{head}");
    }
}
