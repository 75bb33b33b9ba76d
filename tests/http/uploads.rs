//! Who may upload, and what is refused before anything is baked. Nothing is baked here: `max_bakes` is 0.

use std::time::Duration;

use belvedere::{
    config::Settings,
    keys::{Keys, Scope, Wanted},
};
use bytes::Bytes;
use http_body_util::StreamBody;
use hyper::body::Frame;
use hyper_util::rt::{TokioExecutor, TokioIo};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::TcpStream,
};

use crate::{
    live_wire::ask,
    scene::Server,
    wire::{Answer, get, parse, raw, send},
};

const GLB: &str = "application/octet-stream";

struct Publisher {
    server: Server,
    key: String,
}

impl Publisher {
    async fn start() -> Self {
        let server = Server::start_with(Settings {
            max_bakes: Some(0),
            max_upload_mib: Some(1),
            max_jobs_per_key: Some(2),
            max_jobs: Some(3),
            request_timeout_s: Some(1),
            ..Settings::default()
        })
        .await;
        let key = key(&server, &[Scope::Publish, Scope::Rollback], None).await;
        Self { server, key }
    }

    async fn put(&self, scene: &str, body: &str) -> Answer {
        let path = format!("/v1/scenes/{scene}");
        ask(self.server.address, ("PUT", &path), Some(&self.key), (GLB, body)).await
    }

    fn uploads(&self) -> usize {
        let folder = self.server.data.path().join("uploads");
        std::fs::read_dir(folder).map_or(0, Iterator::count)
    }
}

async fn key(server: &Server, scopes: &[Scope], scene: Option<&str>) -> String {
    let wanted = Wanted {
        name: "test".into(),
        scopes: scopes.to_vec(),
        scenes: scene.map(|scene| vec![scene.parse().unwrap()]),
        days: None,
    };
    let keys = Keys::new(server.catalogue.clone());
    keys.create(&wanted).await.unwrap().reveal()
}

#[tokio::test]
async fn only_a_key_that_covers_the_scene_opens_it() {
    let publisher = Publisher::start().await;
    let address = publisher.server.address;
    let town = key(&publisher.server, &[Scope::Publish], Some("town")).await;
    let unknown = format!("bvk_{}_{}", "0".repeat(16), "0".repeat(64));
    let forged = format!("{}{}", &publisher.key[..publisher.key.len() - 64], "0".repeat(64));
    for (shown, scene, status, kind) in [
        (None, "town", 401, "no-key"),
        (Some("x"), "town", 401, "wrong-key"),
        (Some(unknown.as_str()), "town", 401, "wrong-key"),
        (Some(forged.as_str()), "town", 401, "wrong-key"),
        (Some(town.as_str()), "row", 403, "not-granted"),
    ] {
        let answer = ask(address, ("PUT", &format!("/v1/scenes/{scene}")), shown, (GLB, "x")).await;
        assert_eq!(answer.status, status, "{shown:?}");
        assert_eq!(answer.header("www-authenticate").is_some(), status == 401);
        assert_eq!(answer.problem()["type"], format!("/problems/{kind}"));
    }
    let in_the_query = format!("/v1/scenes/town?token={town}&key={town}");
    assert_eq!(ask(address, ("PUT", &in_the_query), None, (GLB, "x")).await.status, 401);
    assert_eq!(publisher.uploads(), 0);
    assert_eq!(
        ask(address, ("PUT", "/v1/scenes/town"), Some(&town), (GLB, "x"))
            .await
            .status,
        202
    );
}

#[tokio::test]
async fn a_key_is_good_for_nothing_from_the_moment_it_is_revoked() {
    let publisher = Publisher::start().await;
    assert_eq!(publisher.put("town", "x").await.status, 202);
    let id = publisher.key.split('_').nth(1).unwrap();
    assert!(Keys::new(publisher.server.catalogue.clone()).revoke(id).await.unwrap());
    assert_eq!(
        publisher.put("town", "x").await.problem()["type"],
        "/problems/wrong-key"
    );
}

#[tokio::test]
async fn guessing_keys_is_slowed_down_and_right_ones_are_not() {
    let publisher = Publisher::start().await;
    let mut statuses = vec![];
    for _ in 0..25 {
        let answer = ask(
            publisher.server.address,
            ("PUT", "/v1/scenes/town"),
            Some("x"),
            (GLB, "x"),
        )
        .await;
        statuses.push(answer.status);
    }
    assert_eq!(statuses[..20], [401; 20]);
    assert!(statuses[20..].contains(&429), "{statuses:?}");
    assert_eq!(publisher.put("town", "x").await.status, 202);
}

#[tokio::test]
async fn what_cannot_be_a_scene_is_refused_and_leaves_nothing() {
    let publisher = Publisher::start().await;
    let (address, key) = (publisher.server.address, Some(publisher.key.as_str()));
    assert_eq!(publisher.put("town", "").await.problem()["status"], 400);
    assert_eq!(publisher.put("index", "x").await.problem()["status"], 400);
    let form = ask(
        address,
        ("PUT", "/v1/scenes/town"),
        key,
        ("multipart/form-data; boundary=x", "x"),
    )
    .await;
    assert_eq!(form.problem()["status"], 415);
    let title = ask(address, ("PUT", "/v1/scenes/town?title=a%0Ab"), key, (GLB, "x")).await;
    assert_eq!(title.problem()["parameter"], "title");
    let format = ask(address, ("PUT", "/v1/scenes/town?format=obj"), key, (GLB, "x")).await;
    assert_eq!(format.problem()["parameter"], "format");
    // Once as announced, once as it comes.
    let large = publisher.put("town", &"x".repeat((1 << 20) + 1)).await;
    assert_eq!(large.problem()["type"], "/problems/body-too-large");
    let chunk = format!("{:x}\r\n{}\r\n", (1 << 20) + 1, "x".repeat((1 << 20) + 1));
    let head = format!(
        "PUT /v1/scenes/town HTTP/1.1\r\nHost: t\r\nConnection: close\r\nAuthorization: Bearer {}\r\nTransfer-Encoding: chunked\r\n\r\n",
        publisher.key
    );
    let answer = raw(address, format!("{head}{chunk}0\r\n\r\n").as_bytes()).await;
    assert_eq!(parse(&answer).status, 413);
    assert_eq!(publisher.uploads(), 0);
}

#[cfg(unix)]
#[tokio::test]
async fn what_is_uploaded_is_its_servers_alone_also_where_the_data_folder_is_not() {
    use std::os::unix::fs::PermissionsExt;
    let publisher = Publisher::start().await;
    let data = publisher.server.data.path();
    std::fs::set_permissions(data, std::fs::Permissions::from_mode(0o755)).unwrap();
    let job = publisher.put("town", "x").await.json()["job"]
        .as_str()
        .unwrap()
        .to_owned();
    let mode = |path: &str| std::fs::metadata(data.join(path)).unwrap().permissions().mode() & 0o777;
    assert_eq!(mode("uploads"), 0o700);
    assert_eq!(mode(&format!("uploads/{job}")), 0o700);
}

#[tokio::test]
async fn an_upload_that_breaks_off_leaves_nothing() {
    let publisher = Publisher::start().await;
    let half = [
        "Content-Length: 100000\r\n\r\nhalf",
        // Inside a chunk, between two, and before the last one, which has nothing in it.
        "Transfer-Encoding: chunked\r\n\r\n4\r\nhalf\r\n64\r\nhalf",
        "Transfer-Encoding: chunked\r\n\r\n4\r\nhalf\r\n",
        "Transfer-Encoding: chunked\r\n\r\n4\r\nhalf\r\n0\r\n",
    ];
    // Whoever sends no more may still read.
    for (half, reads) in half.into_iter().flat_map(|half| [(half, false), (half, true)]) {
        let mut stream = TcpStream::connect(publisher.server.address).await.unwrap();
        let head = format!(
            "PUT /v1/scenes/town HTTP/1.1\r\nHost: t\r\nAuthorization: Bearer {}\r\n{half}",
            publisher.key
        );
        stream.write_all(head.as_bytes()).await.unwrap();
        while publisher.uploads() == 0 {
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
        if reads {
            stream.shutdown().await.unwrap();
            let mut answer = vec![];
            stream.read_to_end(&mut answer).await.unwrap();
            let answer = parse(&answer);
            assert_eq!(answer.status, 400, "{half:?}");
            let told = answer.json()["detail"].as_str().unwrap().to_owned();
            assert!(told.contains("broke off"), "{told}");
        }
        drop(stream);
        while publisher.uploads() > 0 {
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
    }
}

#[tokio::test]
async fn an_upload_over_http2_that_is_shorter_than_it_says_is_no_job() {
    let publisher = Publisher::start().await;
    let address = publisher.server.address;
    let stream = TokioIo::new(TcpStream::connect(address).await.unwrap());
    let (mut sender, connection) = hyper::client::conn::http2::handshake(TokioExecutor::new(), stream)
        .await
        .unwrap();
    tokio::spawn(connection);
    let request = hyper::Request::put(format!("http://{address}/v1/scenes/town"))
        .header("authorization", format!("Bearer {}", publisher.key))
        .header("content-length", "100000");
    // What comes piece by piece is sent as it comes, whatever was announced.
    let frames = futures_util::stream::iter([Ok::<_, std::io::Error>(Frame::data(Bytes::from_static(b"half")))]);
    let answer = sender
        .send_request(request.body(StreamBody::new(frames)).unwrap())
        .await;
    assert!(answer.is_err() || answer.unwrap().status() == 400);
    while publisher.uploads() > 0 {
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
}

/// A handler has a second here, and a connection that much more for an answer.
#[tokio::test]
async fn an_upload_may_take_longer_than_other_requests() {
    let publisher = Publisher::start().await;
    let mut stream = TcpStream::connect(publisher.server.address).await.unwrap();
    let head = format!(
        "PUT /v1/scenes/town HTTP/1.1\r\nHost: t\r\nConnection: close\r\nAuthorization: Bearer {}\r\nContent-Length: 20\r\n\r\n",
        publisher.key
    );
    stream.write_all(head.as_bytes()).await.unwrap();
    for _ in 0..20 {
        stream.write_all(b"x").await.unwrap();
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    let mut answer = vec![];
    stream.read_to_end(&mut answer).await.unwrap();
    assert_eq!(parse(&answer).status, 202);
}

#[tokio::test]
async fn each_key_has_a_quota_and_what_waits_can_be_followed_and_cancelled() {
    let publisher = Publisher::start().await;
    let address = publisher.server.address;
    let (first, second) = (
        publisher.put("a", "x").await.json(),
        publisher.put("b", "x").await.json(),
    );
    assert_eq!((&first["state"], &first["scene"]), (&"queued".into(), &"a".into()));
    let refused = |full: &Answer, status, kind: &str, why: &str| {
        assert_eq!((full.status, full.header("retry-after")), (status, Some("10")));
        let problem = full.problem();
        assert_eq!(problem["type"], kind);
        assert!(problem["detail"].as_str().unwrap().starts_with(why), "{problem}");
    };
    let full = publisher.put("c", "x").await;
    refused(&full, 429, "/problems/quota-met", "2 jobs of one key");
    let others = key(&publisher.server, &[Scope::Publish], None).await;
    let put = async |scene: &str| ask(address, ("PUT", scene), Some(&others), (GLB, "x")).await;
    let third = put("/v1/scenes/d").await;
    assert_eq!(third.status, 202);
    let full = put("/v1/scenes/e").await;
    refused(&full, 503, "/problems/full", "3 jobs of all keys");
    let third = third.json()["url"].as_str().unwrap().to_owned();
    assert_eq!(
        ask(address, ("DELETE", &third), Some(&others), (GLB, "")).await.status,
        200
    );
    assert_eq!(publisher.uploads(), 2);

    let url = second["url"].as_str().unwrap();
    let shown = get(address, url).await;
    assert_eq!(
        (shown.header("cache-control"), &shown.json()["job"]),
        (Some("no-store"), &second["job"])
    );
    assert_eq!(
        get(address, "/v1/jobs/j00000000000000000000000000000000")
            .await
            .problem()["status"],
        404
    );
    assert_eq!(get(address, "/v1/jobs/j1").await.problem()["status"], 400);
    let head = send(address, "HEAD", &format!("{url}/events"), &[]).await;
    assert_eq!(
        (head.status, head.header("content-type")),
        (200, Some("text/event-stream"))
    );
    let other = key(&publisher.server, &[Scope::Publish], Some("a")).await;
    assert_eq!(ask(address, ("DELETE", url), Some(&other), (GLB, "")).await.status, 403);
    let gone = ask(address, ("DELETE", url), Some(&publisher.key), (GLB, "")).await;
    assert_eq!((gone.status, &gone.json()["state"]), (200, &"cancelled".into()));
    let events = get(address, &format!("{url}/events")).await;
    assert!(String::from_utf8(events.body).unwrap().contains("event: cancelled\n"));
    assert_eq!((publisher.uploads(), publisher.put("c", "x").await.status), (1, 202));
}
