//! Odd, hostile and unlucky clients.

use std::time::Duration;

use belvedere::config::Settings;
use http_body_util::{BodyExt, Empty};
use hyper_util::rt::{TokioExecutor, TokioIo};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::TcpStream,
};

use crate::{
    scene::Server,
    wire::{get, parse, raw, send},
};

#[tokio::test]
async fn a_method_that_is_not_taken_is_told_which_are() {
    let server = Server::start().await;
    for method in ["POST", "PUT", "DELETE", "PATCH", "TRACE", "OPTIONS", "BREW"] {
        for path in ["/v1/scenes", "/v1/scenes/row", "/o/x", "/"] {
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

#[tokio::test]
async fn connections_over_the_limit_wait_their_turn() {
    let server = Server::start_with(Settings {
        max_connections: Some(1),
        ..Settings::default()
    })
    .await;
    let mut first = TcpStream::connect(server.address).await.unwrap();
    first
        .write_all(b"GET /healthz HTTP/1.1\r\nHost: t\r\n\r\n")
        .await
        .unwrap();
    let mut some = [0; 64];
    assert!(first.read(&mut some).await.unwrap() > 0);
    let address = server.address;
    let second = tokio::spawn(async move { get(address, "/healthz").await.status });
    tokio::time::sleep(Duration::from_millis(100)).await;
    assert!(!second.is_finished());
    drop(first);
    assert_eq!(second.await.unwrap(), 200);
}
