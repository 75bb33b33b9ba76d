//! What is answered in front of hyper, and what is left to it? Whichever way a request takes, however it is cut into pieces
//! and whatever its head tries to hide, the answers are the same, byte for byte.

use std::{net::SocketAddr, time::Duration};

use belvedere_scene::BlobName;
use proptest::{prelude::*, test_runner::TestRunner};
use serde_json::json;
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::TcpStream,
};

use crate::{
    live_wire::Person,
    scene::{Server, glb},
    wire::{Answer, get, metric, send},
};

const PATIENCE: Duration = Duration::from_secs(20);
/// Nobody is thinking any more after this.
const SILENCE: Duration = Duration::from_millis(500);
/// After a simple request a connection is still in front of hyper …
const SIMPLE: &str = "GET /healthz HTTP/1.1\r\nHost: t\r\n\r\n";
/// … and after this one, which is odd in several ways, it is hyper's for good.
const NOT_SIMPLE: &str = "GET /healthz HTTP/1.1\r\nHost: t\r\nContent-Length: 0\r\nX: é\r\n\r\n";
const LAST: &str = "GET /healthz HTTP/1.1\r\nHost: t\r\nConnection: close\r\n\r\n";

fn glb_url() -> String {
    BlobName::of(&glb(), "glb").unwrap().url()
}

/// Says all that, in pieces of so many bytes; gives what was answered, without what differs from moment to moment.
async fn said(address: SocketAddr, bytes: &[u8], piece: usize) -> Vec<u8> {
    let mut stream = TcpStream::connect(address).await.unwrap();
    stream.set_nodelay(true).unwrap();
    for piece in bytes.chunks(piece) {
        // The other side may have heard enough.
        if stream.write_all(piece).await.is_err() {
            break;
        }
        tokio::task::yield_now().await;
    }
    let (mut answer, mut waited) = (vec![], 0);
    loop {
        match tokio::time::timeout(SILENCE, stream.read_buf(&mut answer)).await {
            // A peer that closes with unread input may reset the connection after its answer.
            Ok(Ok(0) | Err(_)) => break,
            Ok(Ok(_)) => {}
            // It waits for more, which does not come.
            Err(_) if waited < 40 => {
                let _ = stream.shutdown().await;
                waited += 1;
            }
            Err(_) => panic!("no end of the answer to {:?}", String::from_utf8_lossy(bytes)),
        }
    }
    let mut kept = vec![];
    for line in answer.split_inclusive(|byte| *byte == b'\n') {
        if !line.starts_with(b"date: ") && !line.starts_with(b"x-request-id: ") {
            kept.extend_from_slice(line);
        }
    }
    kept
}

/// Asks in front of hyper, whole and in pieces, and hyper itself. Of a request with a body hyper lets a connection go when the
/// body is not there with its head, so in pieces one of these may hear less than the other, but nothing else. Of a body that is
/// not what its head says it finds out before it answers, and says that it will close, or afterwards.
async fn is_the_same_both_ways(address: SocketAddr, head: &[u8], may_have_bodies: bool) {
    let after = |before: &str| [before.as_bytes(), head, LAST.as_bytes()].concat();
    let said = async |bytes: Vec<u8>, piece: usize| {
        let answer = said(address, &bytes, piece).await;
        if !may_have_bodies {
            return answer;
        }
        let lines = answer.split_inclusive(|byte| *byte == b'\n');
        lines
            .filter(|line| *line != b"connection: close\r\n")
            .flatten()
            .copied()
            .collect()
    };
    let shown = String::from_utf8_lossy(head).into_owned();
    let hyper = said(after(NOT_SIMPLE), usize::MAX).await;
    for piece in [usize::MAX, 700, 11] {
        let direct = said(after(SIMPLE), piece).await;
        let both = direct.len().min(hyper.len());
        let as_far = may_have_bodies && piece < after(SIMPLE).len();
        let [direct, hyper] = if as_far {
            [&direct[..both], &hyper[..both]]
        } else {
            [&direct[..], &hyper]
        };
        let [direct, hyper] = [direct, hyper].map(|answer| String::from_utf8_lossy(answer).replace('\0', ""));
        assert_eq!(direct, hyper, "in pieces of {piece}: {shown:?}");
    }
}

/// Requests that somebody may make.
fn usual() -> Vec<String> {
    let (url, absent) = (glb_url(), BlobName::of(b"absent", "glb").unwrap().url());
    let etag = format!("\"{}\"", BlobName::of(&glb(), "glb").unwrap().hash());
    let fields = [
        String::new(),
        "If-None-Match: *\r\n".to_owned(),
        "Connection: keep-alive\r\n".to_owned(),
        "Accept-Encoding: gzip, zstd\r\n".to_owned(),
        "accept-encoding: gzip;q=0.5\r\nAccept-Encoding: zstd;q=0.1\r\n".to_owned(),
        "Accept-Encoding: *;q=0\r\n".to_owned(),
        "Range: bytes=5-10\r\n".to_owned(),
        "Range: bytes=-3\r\nAccept-Encoding: gzip\r\n".to_owned(),
        "Range: bytes=0-3,10-12\r\n".to_owned(),
        "Range: bytes=0-3\r\nRange: bytes=4-5\r\n".to_owned(),
        "Range: bytes=99999-\r\n".to_owned(),
        "Range: bytes=0-3\r\nIf-Range: \"x\"\r\n".to_owned(),
        format!("Range: bytes=0-3\r\nIf-Range: {etag}\r\n"),
        format!("If-None-Match: {etag}\r\n"),
        format!("If-None-Match: \"x\", W/{etag}\r\nRange: bytes=0-3\r\n"),
        "If-Match: \"x\"\r\n".to_owned(),
        "Authorization: Bearer x\r\n".to_owned(),
        "X-Request-Id: mine\r\n".to_owned(),
    ];
    let bundle = format!("/o/bundle/{0}@0-9+{0}+{0}@20-30", &url[3..]);
    let disguised = bundle.replace('+', "%2B");
    let paths = [
        url.as_str(),
        &absent,
        &bundle,
        "/o/x",
        "/o/%2e%2e/x",
        &disguised,
        "/v1/scenes",
        "/v1/scenes/row/index.json",
        "/v1/scenes/none",
        "/v1/sessions/1/events",
        "/v1/jobs/j0/events",
        "/readyz",
        "/openapi.json",
        "/",
    ];
    let mut all = vec![];
    for method in ["GET", "HEAD"] {
        for (i, path) in paths.iter().enumerate() {
            // Of what is no object, a few are enough.
            for fields in fields.iter().take(if i < 3 { usize::MAX } else { 4 }) {
                all.push(format!("{method} {path} HTTP/1.1\r\nHost: t\r\n{fields}\r\n"));
            }
        }
        all.push(format!("{method} {url}?x=1 HTTP/1.1\r\nHost: t\r\n\r\n"));
        all.push(format!("{method} {url}#x HTTP/1.1\r\nHost: t\r\n\r\n"));
    }
    all
}

/// Requests that try to be read in two ways.
fn hostile() -> Vec<Vec<u8>> {
    let url = glb_url();
    let inner = format!("GET {url} HTTP/1.1\r\nHost: inner\r\nRange: bytes=0-0\r\n\r\n");
    let (length, hex) = (inner.len(), format!("{:x}", inner.len()));
    let with = |fields: &str| format!("GET {url} HTTP/1.1\r\nHost: t\r\n{fields}\r\n");
    let mut all: Vec<Vec<u8>> = vec![];
    // Bodies that look like requests, announced in all ways.
    for fields in [
        format!("Content-Length: {length}\r\n"),
        format!("content-length:{length}\r\n"),
        format!("Content-Length: {length}\r\nContent-Length: {length}\r\n"),
        format!("Content-Length: {length}\r\nContent-Length: 0\r\n"),
        format!("Content-Length: 0\r\nContent-Length: {length}\r\n"),
        format!("Content-Length: +{length}\r\n"),
        format!("Content-Length: 0{length}\r\n"),
        format!("Content-Length: {length}, {length}\r\n"),
        format!("Content-Length : {length}\r\n"),
        format!(" Content-Length: {length}\r\n"),
        format!("X: y\r\n Content-Length: {length}\r\n"),
        format!("X: y\r\n\tContent-Length: {length}\r\n"),
        format!("Content-Length:\r\n {length}\r\n"),
        format!("Content_Length: {length}\r\n"),
        format!("X: y\nContent-Length: {length}\r\n"),
        format!("X: y\rContent-Length: {length}\r\n"),
        format!("X: y\r\r\nContent-Length: {length}\r\n"),
        format!("X: y\0\r\nContent-Length: {length}\r\n"),
        "Content-Length: \r\n".to_owned(),
        "Content-Length: -1\r\n".to_owned(),
        "Content-Length: 0\r\n".to_owned(),
    ] {
        all.push((with(&fields) + &inner).into());
    }
    for fields in [
        "Transfer-Encoding: chunked\r\n",
        "transfer-encoding:chunked\r\n",
        "Transfer-Encoding: CHUNKED\r\n",
        "Transfer-Encoding: chunked\r\nContent-Length: 5\r\n",
        "Content-Length: 5\r\nTransfer-Encoding: chunked\r\n",
        "Transfer-Encoding: chunked\r\nTransfer-Encoding: identity\r\n",
        "Transfer-Encoding: identity\r\n",
        "Transfer-Encoding: xchunked\r\n",
        "Transfer-Encoding: gzip, chunked\r\n",
        "Transfer-Encoding: chunked, gzip\r\n",
        "Transfer-Encoding : chunked\r\n",
        "Transfer-Encoding:\x0bchunked\r\n",
        "X: y\nTransfer-Encoding: chunked\r\n",
        "X: y\r\n Transfer-Encoding: chunked\r\n",
    ] {
        for body in [format!("{hex}\r\n{inner}\r\n0\r\n\r\n"), format!("0\r\n\r\n{inner}")] {
            all.push((with(fields) + &body).into());
        }
    }
    // Lines, spaces and bytes that do not belong there.
    for head in [
        format!("GET {url} HTTP/1.1\nHost: t\n\n"),
        format!("GET {url} HTTP/1.1\r\nHost: t\n\r\n"),
        format!("GET {url} HTTP/1.1\r\nHost: t\r\n\n"),
        format!("\r\n\r\nGET {url} HTTP/1.1\r\nHost: t\r\n\r\n"),
        format!("\nGET {url} HTTP/1.1\r\nHost: t\r\n\r\n"),
        format!(" GET {url} HTTP/1.1\r\nHost: t\r\n\r\n"),
        format!("GET  {url} HTTP/1.1\r\nHost: t\r\n\r\n"),
        format!("GET\t{url}\tHTTP/1.1\r\nHost: t\r\n\r\n"),
        format!("GET {url} HTTP/1.1 \r\nHost: t\r\n\r\n"),
        format!("GET {url}  HTTP/1.1\r\nHost: t\r\n\r\n"),
        format!("GET {url} x HTTP/1.1\r\nHost: t\r\n\r\n"),
        format!("GET {url}\r\nHost: t\r\n\r\n"),
        format!("get {url} HTTP/1.1\r\nHost: t\r\n\r\n"),
        format!("GETS {url} HTTP/1.1\r\nHost: t\r\n\r\n"),
        format!("GET {url} HTTP/1.0\r\nHost: t\r\n\r\n"),
        format!("GET {url} HTTP/1.0\r\nConnection: keep-alive\r\n\r\n"),
        format!("GET {url} HTTP/1.2\r\nHost: t\r\n\r\n"),
        format!("GET {url} HTTP/2.0\r\nHost: t\r\n\r\n"),
        format!("GET {url} http/1.1\r\nHost: t\r\n\r\n"),
        format!("GET http://t{url} HTTP/1.1\r\nHost: t\r\n\r\n"),
        format!("GET http://other{url} HTTP/1.1\r\nHost: t\r\n\r\n"),
        "GET t:80 HTTP/1.1\r\nHost: t\r\n\r\n".to_owned(),
        "GET * HTTP/1.1\r\nHost: t\r\n\r\n".to_owned(),
        format!("GET /{url} HTTP/1.1\r\nHost: t\r\n\r\n"),
        format!("GET /.{url} HTTP/1.1\r\nHost: t\r\n\r\n"),
        format!("GET {url}\x7f HTTP/1.1\r\nHost: t\r\n\r\n"),
        format!("GET {url}é HTTP/1.1\r\nHost: t\r\n\r\n"),
        format!("GET {url}\" HTTP/1.1\r\nHost: t\r\n\r\n"),
        format!("GET {url} HTTP/1.1\r\n\r\n"),
        format!("GET {url} HTTP/1.1\r\nHost:\r\n\r\n"),
        format!("GET {url} HTTP/1.1\r\nHost: t\r\nHost: t\r\n\r\n"),
        format!("GET {url} HTTP/1.1\r\nHost: t\r\nHost: u\r\n\r\n"),
        format!("GET {url} HTTP/1.1\r\nHost: a b\r\n\r\n"),
        format!("GET {url} HTTP/1.1\r\nHost: a,b\r\n\r\n"),
        format!("GET {url} HTTP/1.1\r\nHost: a@b/c\r\n\r\n"),
        "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n".to_owned(),
        format!("POST /v1/scenes HTTP/1.1\r\nHost: t\r\nContent-Length: {length}\r\n\r\n{inner}"),
        format!("POST {url} HTTP/1.1\r\nHost: t\r\n\r\n{inner}"),
        "GET".to_owned(),
        String::new(),
    ] {
        all.push(head.into());
    }
    for fields in [
        "Connection: close\r\n".to_owned(),
        "Connection: keep-alive, close\r\n".to_owned(),
        "Connection: keep-alive\r\nConnection: close\r\n".to_owned(),
        "Connection: \r\n".to_owned(),
        "Expect: 100-continue\r\n".to_owned(),
        "Connection: Upgrade, HTTP2-Settings\r\nUpgrade: h2c\r\nHTTP2-Settings: AAMAAABkAARAAAAAAAIAAAAA\r\n"
            .to_owned(),
        "Upgrade: websocket\r\n".to_owned(),
        "Bad Field: x\r\n".to_owned(),
        ": x\r\n".to_owned(),
        "x\r\n".to_owned(),
        "X: \x01\r\n".to_owned(),
        "X: é\r\n".to_owned(),
        "X-A: 1\r\n".repeat(60),
        "X-A: 1\r\n".repeat(120),
        format!("X-A: {}\r\n", "1".repeat(9_000)),
        format!("X-A: {}\r\n", "1".repeat(17_000)),
    ] {
        all.push((with(&fields) + &inner).into());
    }
    all.push(format!("GET /{} HTTP/1.1\r\nHost: t\r\n\r\n{inner}", "x".repeat(9_000)).into());
    all.push([with("X: ").as_bytes(), b"\xff\xfe\r\n\r\n"].concat());
    all.push(b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n".to_vec());
    all
}

#[tokio::test]
async fn usual_requests_are_answered_alike_both_ways() {
    let server = Server::start().await;
    assert_eq!(get(server.address, &glb_url()).await.status, 200);
    for head in usual() {
        is_the_same_both_ways(server.address, head.as_bytes(), false).await;
    }
    let all = usual().concat();
    is_the_same_both_ways(server.address, all.as_bytes(), false).await;
}

#[tokio::test]
async fn hostile_heads_are_answered_alike_both_ways() {
    let server = Server::start().await;
    assert_eq!(get(server.address, &glb_url()).await.status, 200);
    for head in hostile() {
        is_the_same_both_ways(server.address, &head, true).await;
    }
}

#[test]
fn heads_with_anything_done_to_them_are_answered_alike_both_ways() {
    let runtime = tokio::runtime::Runtime::new().unwrap();
    let server = runtime.block_on(Server::start());
    assert_eq!(runtime.block_on(get(server.address, &glb_url())).status, 200);
    let seeds: Vec<Vec<u8>> = usual().into_iter().map(String::into_bytes).chain(hostile()).collect();
    let bytes = prop::sample::select(b"\r\n\t :,;/\0\x7f\xffGHx01".to_vec());
    let change = (any::<prop::sample::Index>(), bytes, 0..3u8);
    let changed = (prop::sample::select(seeds), prop::collection::vec(change, 1..4)).prop_map(|(mut head, changes)| {
        for (at, byte, how) in changes {
            let at = at.index(head.len() + 1).min(head.len().saturating_sub(1));
            match how {
                0 => head.insert(at, byte),
                1 if !head.is_empty() => head[at] = byte,
                _ if !head.is_empty() => _ = head.remove(at),
                _ => {}
            }
        }
        head
    });
    let mut runner = TestRunner::new(ProptestConfig {
        cases: 100,
        failure_persistence: None,
        max_shrink_iters: 200,
        ..ProptestConfig::default()
    });
    let ran = runner.run(&changed, |head| {
        runtime.block_on(is_the_same_both_ways(server.address, &head, true));
        Ok(())
    });
    ran.unwrap();
}

async fn connections(address: SocketAddr) -> u64 {
    metric(address, "belvedere_http_connections").await.parse().unwrap()
}

#[tokio::test]
async fn objects_answered_in_front_of_hyper_are_counted_like_all_others() {
    let server = Server::start().await;
    let counted = async |status: u16| -> u64 {
        let metrics = String::from_utf8(get(server.address, "/metrics").await.body).unwrap();
        let start = format!("belvedere_http_requests_total{{route=\"/o/{{name}}\",status=\"{status}\"}} ");
        metrics
            .lines()
            .find_map(|line| line.strip_prefix(&start))
            .unwrap()
            .parse()
            .unwrap()
    };
    let head = |fields: &str| format!("GET {} HTTP/1.1\r\nHost: t\r\n{fields}\r\n", glb_url());
    let requests = [
        head(""),
        head("Range: bytes=0-0\r\n"),
        head("If-None-Match: *\r\n"),
        head(""),
    ]
    .concat();
    said(server.address, requests.as_bytes(), usize::MAX).await;
    assert_eq!((counted(200).await, counted(206).await, counted(304).await), (2, 1, 1));
}

#[tokio::test]
async fn who_leaves_a_quiet_stream_is_noticed() {
    let server = Server::start().await;
    let person = Person::enter(server.address, 0.5).await;
    let mut stream = person.listen().await;
    stream.wait("hello").await;
    let during = connections(server.address).await;
    drop(stream);
    let waited = tokio::time::timeout(PATIENCE, async {
        while connections(server.address).await >= during {
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    });
    waited.await.expect("it is still there");
}

#[tokio::test]
async fn a_connection_goes_on_after_its_stream_with_what_was_asked_meanwhile() {
    let server = Server::start().await;
    let person = Person::enter_with(server.address, 0.5, json!({})).await;
    let mut stream = TcpStream::connect(server.address).await.unwrap();
    let (path, token) = (person.path("/events"), &person.token);
    let requests = format!("GET {path}?token={token} HTTP/1.1\r\nHost: t\r\n\r\n{SIMPLE}");
    stream.write_all(requests.as_bytes()).await.unwrap();
    let mut text = String::new();
    let mut room = [0; 4096];
    while !text.contains("event: hello") {
        let read = stream.read(&mut room).await.unwrap();
        text.push_str(std::str::from_utf8(&room[..read]).unwrap());
    }
    assert!(text.to_lowercase().contains("transfer-encoding: chunked"), "{text}");
    stream.write_all(LAST.as_bytes()).await.unwrap();
    assert_eq!(person.leave().await, 204);
    stream.read_to_string(&mut text).await.unwrap();
    let (stream, after) = text.split_once("\r\n0\r\n\r\n").expect("the end of the stream");
    assert!(!stream.contains("\nok\n"), "{stream}");
    assert_eq!(after.matches("\r\n\r\nok\n").count(), 2, "{after}");
}

#[tokio::test]
async fn a_reader_that_is_slow_gets_all_of_a_large_answer() {
    let server = Server::start().await;
    let large: Vec<u8> = (0..900_000u32)
        .map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8)
        .collect();
    let name = BlobName::of(&large, "bin").unwrap();
    server.blobs.put(&name, large.clone().into()).await.unwrap();
    let first: Answer = send(server.address, "GET", &name.url(), &[]).await;
    assert_eq!((first.status, first.body.len()), (200, large.len()));
    let mut stream = TcpStream::connect(server.address).await.unwrap();
    let head = format!("GET {} HTTP/1.1\r\nHost: t\r\n\r\n", name.url());
    stream.write_all((head.repeat(3) + LAST).as_bytes()).await.unwrap();
    let (mut all, mut room) = (vec![], vec![0; 5_000]);
    loop {
        let read = tokio::time::timeout(PATIENCE, stream.read(&mut room))
            .await
            .unwrap()
            .unwrap();
        if read == 0 {
            break;
        }
        all.extend_from_slice(&room[..read]);
        tokio::task::yield_now().await;
    }
    let whole = all.windows(large.len()).filter(|window| *window == large).count();
    assert_eq!(whole, 3);
    assert!(all.ends_with(b"\r\n\r\nok\n"));
}
