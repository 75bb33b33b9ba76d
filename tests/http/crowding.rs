//! Who takes up connections: how many, from where, and for how long.

use std::{net::SocketAddr, time::Duration};

use belvedere::{config::Settings, http::accept::ConnectionLimits};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::{TcpSocket, TcpStream},
    time::timeout,
};

use crate::{
    scene::Server,
    wire::{get, parse},
};

const HALF_A_HEAD: &[u8] = b"GET /healthz HTTP/1.1\r\nHost: ";
const REST_OF_IT: &[u8] = b"t\r\n\r\n";
/// Whatever takes longer never ends.
const NEVER: Duration = Duration::from_secs(20);

/// A connection from another address of this machine.
async fn connect_from(own: [u8; 4], server: SocketAddr) -> TcpStream {
    let socket = TcpSocket::new_v4().unwrap();
    socket.bind(SocketAddr::from((own, 0))).unwrap();
    socket.connect(server).await.unwrap()
}

async fn answer(stream: &mut TcpStream) -> u16 {
    let mut some = [0; 1024];
    let read = timeout(NEVER, stream.read(&mut some)).await.expect("no answer");
    parse(&some[..read.unwrap()]).status
}

/// Whether the other side has closed, without a word.
async fn is_closed(stream: &mut TcpStream) -> bool {
    let read = timeout(NEVER, stream.read_u8()).await.expect("it is open");
    read.is_err()
}

#[tokio::test]
async fn connections_over_the_limit_wait_their_turn() {
    let server = Server::start_with(Settings {
        max_connections: Some(1),
        ..Settings::default()
    })
    .await;
    let mut first = TcpStream::connect(server.address).await.unwrap();
    first.write_all(&[HALF_A_HEAD, REST_OF_IT].concat()).await.unwrap();
    let mut some = [0; 64];
    assert!(first.read(&mut some).await.unwrap() > 0);
    let address = server.address;
    let second = tokio::spawn(async move { get(address, "/healthz").await.status });
    tokio::time::sleep(Duration::from_millis(100)).await;
    assert!(!second.is_finished());
    drop(first);
    assert_eq!(second.await.unwrap(), 200);
}

#[tokio::test]
async fn many_silent_connections_do_not_keep_others_out() {
    let server = Server::start().await;
    let mut silent = vec![];
    for i in 0..400 {
        let mut stream = TcpStream::connect(server.address).await.unwrap();
        if i % 2 == 0 {
            stream.write_all(HALF_A_HEAD).await.unwrap();
        }
        silent.push(stream);
    }
    assert_eq!(get(server.address, "/healthz").await.status, 200);
    drop(silent);
}

#[tokio::test]
async fn names_of_objects_that_are_not_there_are_tried_only_so_often() {
    let server = Server::start_with(Settings {
        max_requests_per_s: Some(1),
        ..Settings::default()
    })
    .await;
    let there = get(server.address, "/v1/scenes/row").await.json()["manifest"]
        .as_str()
        .unwrap()
        .to_owned();
    let mut statuses = vec![];
    for i in 0..40 {
        assert_eq!(get(server.address, &there).await.status, 200, "what is there is");
        let unknown = format!("/o/{i:064x}.glb");
        statuses.push(get(server.address, &unknown).await.status);
        if statuses.ends_with(&[429]) {
            break;
        }
    }
    assert!(
        statuses.starts_with(&[404]) && statuses.ends_with(&[429]),
        "{statuses:?}"
    );
}

/// Loopback has many addresses on Linux alone.
#[cfg(target_os = "linux")]
#[tokio::test]
async fn half_heads_of_one_address_keep_no_other_one_waiting() {
    let server = Server::start_with(Settings {
        max_connections: Some(8),
        ..Settings::default()
    })
    .await;
    let (they, visitor) = ([127, 0, 0, 1], [127, 0, 0, 2]);
    let mut half = vec![];
    for _ in 0..32 {
        let mut stream = connect_from(they, server.address).await;
        // It may be closed already.
        let _ = stream.write_all(HALF_A_HEAD).await;
        half.push(stream);
    }
    let mut other = connect_from(visitor, server.address).await;
    other.write_all(&[HALF_A_HEAD, REST_OF_IT].concat()).await.unwrap();
    assert_eq!(answer(&mut other).await, 200);
    let (first, more) = half.split_at_mut(4);
    for stream in more {
        assert!(is_closed(stream).await, "half of all are the share of one");
    }
    for stream in first {
        stream.write_all(REST_OF_IT).await.unwrap();
        assert_eq!(answer(stream).await, 200, "those within its share are served");
    }
    let mut metrics = connect_from(visitor, server.address).await;
    metrics
        .write_all(b"GET /metrics HTTP/1.1\r\nHost: t\r\nConnection: close\r\n\r\n")
        .await
        .unwrap();
    let mut text = String::new();
    metrics.read_to_string(&mut text).await.unwrap();
    assert!(text.contains("belvedere_http_connections_refused_total 28\n"), "{text}");
}

#[tokio::test]
async fn a_share_that_is_set_holds_and_comes_back() {
    let server = Server::start_with(Settings {
        max_connections: Some(8),
        max_connections_per_address: Some(1),
        ..Settings::default()
    })
    .await;
    let mut first = TcpStream::connect(server.address).await.unwrap();
    first.write_all(&[HALF_A_HEAD, REST_OF_IT].concat()).await.unwrap();
    assert_eq!(answer(&mut first).await, 200);
    assert!(is_closed(&mut TcpStream::connect(server.address).await.unwrap()).await);
    drop(first);
    // The server hears of its end when it does.
    let mut tries = 0;
    loop {
        let mut next = TcpStream::connect(server.address).await.unwrap();
        next.write_all(&[HALF_A_HEAD, REST_OF_IT].concat()).await.unwrap();
        let mut some = [0; 64];
        if let Ok(1..) = next.read(&mut some).await {
            break;
        }
        tries += 1;
        assert!(tries < 1000, "its place was not given back");
        tokio::time::sleep(NEVER / 1000).await;
    }
}

#[tokio::test]
async fn half_a_head_is_waited_for_a_while_and_between_heads_one_may_be_silent() {
    let server = Server::start_changed(Settings::default(), |config| {
        // Nothing but half a head ends a connection.
        config.connections = ConnectionLimits {
            head: Duration::from_millis(200),
            answer: 10 * NEVER,
            quiet: 10 * NEVER,
            ..config.connections
        };
    })
    .await;
    let mut silent = TcpStream::connect(server.address).await.unwrap();
    assert!(is_closed(&mut silent).await);
    for start in [HALF_A_HEAD, b"POST /v1/scenes HTTP/1.1\r\nHost: ", b"PRI * HTTP/2"] {
        let mut half = TcpStream::connect(server.address).await.unwrap();
        half.write_all(start).await.unwrap();
        assert!(is_closed(&mut half).await, "{start:?}");
    }
    let mut asked = TcpStream::connect(server.address).await.unwrap();
    for next in [[HALF_A_HEAD, REST_OF_IT].concat(), HALF_A_HEAD.to_vec()] {
        asked.write_all(&next).await.unwrap();
        if next.ends_with(REST_OF_IT) {
            assert_eq!(answer(&mut asked).await, 200);
            tokio::time::sleep(Duration::from_secs(1)).await;
        }
    }
    assert!(is_closed(&mut asked).await, "a later head is waited for no longer");
}
