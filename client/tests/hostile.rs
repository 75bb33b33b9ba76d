//! Servers that do not keep to the protocol: what came is right, or the reason is told.

use std::{
    io::{Read, Write},
    net::{TcpListener, TcpStream},
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
        mpsc,
    },
    time::Duration,
};

use belvedere_client::{
    Ask, ByteSource, Carried, Client, Error, HttpSource, Part, Retrying,
    live::{LiveEvent, Participant, Session, SessionEvent, Stand},
};
use belvedere_scene::{BlobHash, BlobName, SceneName};
use bytes::Bytes;
use flate2::{Compression, write::GzEncoder};

const CONTENT: &[u8] = b"0123456789";

/// Answers each connection with the next of these, and the last for ever; counts connections.
fn server(answers: Vec<Vec<u8>>) -> (HttpSource, Arc<AtomicUsize>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address");
    let asked = Arc::new(AtomicUsize::new(0));
    let counted = asked.clone();
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let Ok(mut stream) = stream else { return };
            let at = counted.fetch_add(1, Ordering::Relaxed).min(answers.len() - 1);
            hear(&mut stream);
            _ = stream.write_all(&answers[at]);
        }
    });
    (
        HttpSource::new(&format!("http://{address}")).expect("an address"),
        asked,
    )
}

/// The head of a request ends before anybody answers.
fn hear(stream: &mut TcpStream) {
    let (mut head, mut byte) = (Vec::new(), [0]);
    while !head.ends_with(b"\r\n\r\n") && stream.read(&mut byte).is_ok_and(|read| read == 1) {
        head.push(byte[0]);
    }
}

fn answer(status: &str, fields: &str, body: &[u8]) -> Vec<u8> {
    let head = format!("HTTP/1.1 {status}\r\n{fields}Connection: close\r\n\r\n");
    [head.as_bytes(), body].concat()
}

fn whole(body: &[u8]) -> Vec<u8> {
    answer("200 OK", &format!("Content-Length: {}\r\n", body.len()), body)
}

fn path() -> String {
    BlobName::of(CONTENT, "slod").expect("a name").url()
}

#[tokio::test]
async fn a_server_that_ignores_ranges_is_believed_when_it_sends_all() {
    let (source, _) = server(vec![whole(CONTENT)]);
    let (part, carried) = source.get_range(Ask::of(&path()), 2..5).await.unwrap();
    assert_eq!((part, carried), (Part::Whole(Bytes::from_static(CONTENT)), 10));
    let beyond = source.get_range(Ask::of(&path()), 5..11).await.unwrap_err();
    assert!(matches!(beyond, Error::Range { .. }), "{beyond}");
}

#[tokio::test]
async fn all_of_it_that_is_damaged_is_asked_for_once_more() {
    let damaged = whole(b"0123456780");
    let (source, _) = server(vec![damaged.clone()]);
    let path = path();
    let ask = Ask::of(&path).having(Some(10));
    let error = source.get_range(ask, 2..5).await.unwrap_err();
    assert!(matches!(error, Error::Corrupt(_)), "{error}");
    let (source, asked) = server(vec![damaged, whole(CONTENT)]);
    let (part, _) = Retrying::new(source).get_range(ask, 2..5).await.unwrap();
    assert_eq!(part, Part::Whole(Bytes::from_static(CONTENT)));
    assert_eq!(asked.load(Ordering::Relaxed), 2);
}

#[tokio::test]
async fn another_part_than_was_asked_for_is_not_believed() {
    let part = |range: &str, body: &[u8]| {
        let fields = format!("Content-Range: bytes {range}/10\r\nContent-Length: {}\r\n", body.len());
        answer("206 Partial Content", &fields, body)
    };
    for wrong in [
        part("3-5", b"345"),
        part("2-4", b"23"),
        answer("206 Partial Content", "Content-Length: 3\r\n", b"234"),
        // The part as if it were all.
        whole(b"234"),
    ] {
        let (source, asked) = server(vec![wrong]);
        let source = Retrying::new(source);
        let error = source.get_range(Ask::of(&path()), 2..5).await.unwrap_err();
        assert!(matches!(error, Error::Range { .. }), "{error}");
        assert_eq!(asked.load(Ordering::Relaxed), 1, "it does so again");
    }
    let (source, _) = server(vec![part("2-4", b"234")]);
    assert_eq!(
        source.get_range(Ask::of(&path()), 2..5).await.unwrap().0,
        Part::Asked(Bytes::from_static(b"234"))
    );
}

/// Answers with a head, and zeros for as long as somebody takes them.
fn endless(head: &'static str) -> HttpSource {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address");
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let Ok(mut stream) = stream else { return };
            hear(&mut stream);
            let mut sent = stream.write_all(head.as_bytes());
            while sent.is_ok() {
                sent = stream.write_all(&[0; 1 << 16]);
            }
        }
    });
    HttpSource::new(&format!("http://{address}")).expect("an address")
}

#[tokio::test]
async fn an_answer_that_never_ends_is_not_taken() {
    let announced = "HTTP/1.1 200 OK\r\nContent-Length: 40000000000\r\n\r\n";
    let part = "HTTP/1.1 206 Partial Content\r\nContent-Range: bytes 2-4/10\r\n\r\n";
    let unannounced = "HTTP/1.1 200 OK\r\n\r\n";
    let packed = "HTTP/1.1 200 OK\r\nContent-Encoding: gzip\r\nContent-Length: 40000000000\r\n\r\n";
    for (head, known) in [
        (announced, None),
        (announced, Some(10)),
        (unannounced, Some(10)),
        (packed, Some(10)),
    ] {
        let ask = path();
        let mut watch = |so_far: &[u8]| assert!(so_far.len() <= 10, "{head}");
        let source = endless(head);
        let came = source.get_watched(Ask::of(&ask).having(known), &mut watch).await;
        let error = came.expect_err("it has no end");
        assert!(matches!(error, Error::TooLong { .. }), "{error}");
    }
    let error = endless(part)
        .get_range(Ask::of(&path()), 2..5)
        .await
        .expect_err("it has no end");
    assert!(matches!(error, Error::TooLong { .. }), "{error}");
}

#[tokio::test]
async fn who_is_told_to_come_back_in_an_hour_does_not_wait() {
    let busy = answer("429 Too Many Requests", "Retry-After: 3600\r\n", b"");
    let (source, asked) = server(vec![busy, whole(CONTENT)]);
    let error = Retrying::new(source).get(&path()).await.unwrap_err();
    assert!(matches!(error, Error::Busy { .. }) && error.is_transient(), "{error}");
    assert_eq!(asked.load(Ordering::Relaxed), 1);
}

#[tokio::test]
async fn what_has_come_of_an_answer_is_seen_before_the_rest_is_sent() {
    // It does not shrink, so that each half of it, packed, holds about half of it.
    let content: Vec<u8> = (0..64u32).flat_map(|at| BlobHash::of(&at.to_le_bytes()).0).collect();
    let mut packs = GzEncoder::new(Vec::new(), Compression::fast());
    packs.write_all(&content).expect("memory");
    let packed = packs.finish().expect("memory");
    for (field, body) in [("", content.clone()), ("Content-Encoding: gzip\r\n", packed)] {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("an address");
        let (seen, is_seen) = mpsc::channel();
        let (first, rest) = body.split_at(body.len() / 2);
        let (first, rest) = (
            answer("200 OK", &format!("{field}Content-Length: {}\r\n", body.len()), first),
            rest.to_vec(),
        );
        let sends = std::thread::spawn(move || {
            let (mut stream, _) = listener.accept().expect("a request");
            hear(&mut stream);
            stream.write_all(&first).expect("a reader");
            // Who sees nothing before all of it is here never gets the rest.
            let is_seen = is_seen.recv_timeout(Duration::from_secs(20)).is_ok();
            if is_seen {
                stream.write_all(&rest).expect("a reader");
            }
            is_seen
        });
        let source = HttpSource::new(&format!("http://{address}")).expect("an address");
        let (mut most, expected) = (0, content.clone());
        let mut watch = |so_far: &[u8]| {
            assert!(so_far.len() >= most && expected.starts_with(so_far));
            most = so_far.len();
            if most > expected.len() / 3 {
                _ = seen.send(());
            }
        };
        let came = source.get_watched(Ask::of(&path()), &mut watch).await;
        assert!(sends.join().expect("a server"), "{field:?}");
        assert_eq!(came.expect("all of it").0, content);
        assert_eq!(most, content.len());
    }
}

#[tokio::test]
async fn an_answer_that_is_cut_begins_anew() {
    let cut = answer("200 OK", "Content-Length: 10\r\n", &CONTENT[..6]);
    let (source, _) = server(vec![cut, whole(CONTENT)]);
    let mut seen = Vec::new();
    let mut watch = |so_far: &[u8]| seen.push(so_far.to_vec());
    let came = Retrying::new(source).get_watched(Ask::of(&path()), &mut watch).await;
    assert_eq!(came.unwrap().0, CONTENT);
    seen.dedup();
    assert!(seen.iter().all(|so_far| CONTENT.starts_with(so_far)));
    let again = seen.windows(2).filter(|two| two[1].len() <= two[0].len()).count();
    assert!(
        again <= 1 && seen.last().unwrap() == CONTENT && seen.contains(&CONTENT[..6].to_vec()),
        "{seen:?}"
    );
}

#[tokio::test]
async fn cut_connections_false_lengths_and_damage_cost_another_try() {
    let failures = [
        // Cut before and in the answer, and a length that is not kept.
        Vec::new(),
        b"HTTP/1.1 200 OK\r\nConte".to_vec(),
        answer("200 OK", "Content-Length: 1000\r\n", CONTENT),
        answer("200 OK", "Content-Length: 4\r\n", CONTENT),
        whole(b"0123456780"),
        answer("503 Service Unavailable", "Content-Length: 0\r\n", b""),
    ];
    for failure in failures {
        let (source, asked) = server(vec![failure.clone(), whole(CONTENT)]);
        let right = Retrying::new(source).get(&path()).await;
        assert_eq!(right.unwrap(), CONTENT, "{}", String::from_utf8_lossy(&failure));
        assert_eq!(asked.load(Ordering::Relaxed), 2);
    }
}

/// The page where one signs in to a network, whatever was asked for.
const SIGN_IN: &[u8] = b"\n<!DOCTYPE html><title>Welcome to our hotel</title>";

#[tokio::test]
async fn a_pointer_that_cannot_be_read_is_asked_for_once_more_and_then_told_with_what_came() {
    let answers = vec![whole(SIGN_IN), whole(b"{\"scenes\": []}")];
    let (source, asked) = server(answers);
    let scenes = Client::new(Retrying::new(source)).scenes().await;
    assert!(scenes.expect("a list").scenes.is_empty());
    assert_eq!(asked.load(Ordering::Relaxed), 2);

    let rooms: SceneName = "rooms".parse().expect("a name");
    for (came, told) in [
        (
            SIGN_IN,
            "probably not the root of a published tree, or somebody on the way answers for it; \
             it begins with \"<!DOCTYPE html><title>Welcome to our hotel</title>\"",
        ),
        (b"\x00\x01\xff".as_slice(), "it has 3 bytes"),
        (b"", "it has 0 bytes"),
    ] {
        let (source, asked) = server(vec![whole(came)]);
        let error = Client::new(Retrying::new(source)).open(&rooms).await.unwrap_err();
        let message = error.to_string();
        assert!(
            message.starts_with("/v1/scenes/rooms/index.json is not what"),
            "{message}"
        );
        assert!(message.ends_with(told), "{message}");
        assert_eq!(asked.load(Ordering::Relaxed), 2);
    }
}

#[tokio::test]
async fn all_that_a_line_carried_is_noted_whatever_became_of_it() {
    let cut = answer("200 OK", "Content-Length: 10\r\n", &CONTENT[..6]);
    let damaged = whole(b"0123456780");
    let fields = "Content-Encoding: gzip\r\nContent-Length: 5\r\n";
    let garbled = answer("200 OK", fields, &CONTENT[..5]);
    let busy = answer("503 Service Unavailable", "Content-Length: 10\r\n", CONTENT);
    for (vain, bytes) in [(cut.clone(), 6), (damaged.clone(), 10), (garbled, 5), (busy, 10)] {
        let (source, _) = server(vec![vain.clone(), whole(CONTENT)]);
        let (count, path) = (Carried::default(), path());
        let ask = Ask::of(&path).counting(&count);
        let came = Retrying::new(source).get_watched(ask, &mut |_| {}).await;
        assert_eq!(came.expect("the second try").1, 10);
        assert_eq!(count.bytes(), bytes + 10, "{}", String::from_utf8_lossy(&vain));
    }
    // Also where nothing comes of it in the end.
    let (source, _) = server(vec![damaged]);
    let (count, path) = (Carried::default(), path());
    let came = Retrying::new(source)
        .get_watched(Ask::of(&path).counting(&count), &mut |_| {})
        .await;
    assert!(matches!(came, Err(Error::Corrupt(_))));
    assert_eq!(count.bytes(), 20);
    // A page that says that there is nothing takes the line as long as any other; of one that has no end, a part does.
    let page = vec![b'x'; 9_000];
    let (source, _) = server(vec![answer("404 Not Found", "Content-Length: 9000\r\n", &page)]);
    for range in [None, Some(2..5)] {
        let count = Carried::default();
        let ask = Ask::of(&path).counting(&count);
        let came = match range {
            None => source.get_watched(ask, &mut |_| {}).await.map(drop),
            Some(range) => source.get_range(ask, range).await.map(drop),
        };
        assert!(matches!(came, Err(Error::Missing(_))), "{came:?}");
        assert_eq!(count.bytes(), 9_000);
    }
    let count = Carried::default();
    let came = endless("HTTP/1.1 404 Not Found\r\n\r\n")
        .get_watched(Ask::of(&path).counting(&count), &mut |_| {})
        .await;
    assert!(matches!(came, Err(Error::Missing(_))), "{came:?}");
    assert!((1 << 20..2 << 20).contains(&count.bytes()), "{}", count.bytes());
}

#[tokio::test]
async fn failures_of_the_network_are_told_in_words() {
    let told = |source: HttpSource| async move { source.get("/o/x").await.unwrap_err().to_string() };
    let half = &CONTENT[..6];
    for (cut, expected) in [
        (
            answer("200 OK", "Content-Length: 10\r\n", half),
            "the connection was cut after 6 of 10 bytes",
        ),
        (
            answer("200 OK", "Transfer-Encoding: chunked\r\n", b"6\r\n012345\r\n"),
            "the connection was cut after 6 bytes",
        ),
        (
            answer("500 Internal Server Error", "Content-Length: 0\r\n", b""),
            "the server answers with status 500 Internal Server Error",
        ),
    ] {
        assert_eq!(
            told(server(vec![cut]).0).await,
            format!("cannot fetch /o/x: {expected}")
        );
    }
    let nobody = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = nobody.local_addr().expect("an address");
    drop(nobody);
    let source = HttpSource::new(&format!("http://{address}")).expect("an address");
    assert_eq!(
        told(source).await,
        format!("cannot fetch /o/x: nobody answers at {address} (connection refused)")
    );
}

#[test]
fn files_are_named_by_their_paths() {
    let name = BlobName::of(CONTENT, "slod").expect("a name");
    for error in [
        Error::Missing(name.url()),
        Error::Corrupt(name.clone()),
        Error::Whole(name.clone()),
        Error::Stream(name.clone()),
    ] {
        assert!(
            error.to_string().contains(&format!(" {}", name.url())) || error.to_string().starts_with(&name.url()),
            "{error}"
        );
    }
}

#[tokio::test]
async fn gzip_that_does_not_unpack_is_damage() {
    let fields = "Content-Encoding: gzip\r\nContent-Length: 10\r\n";
    let (source, asked) = server(vec![answer("200 OK", fields, CONTENT), whole(CONTENT)]);
    assert_eq!(Retrying::new(source).get(&path()).await.unwrap(), CONTENT);
    assert_eq!(asked.load(Ordering::Relaxed), 2);

    let (source, asked) = server(vec![answer("200 OK", fields, CONTENT)]);
    let error = Retrying::new(source)
        .get("/v1/scenes/rooms/index.json")
        .await
        .unwrap_err();
    let message = error.to_string();
    assert!(
        message.starts_with("/v1/scenes/rooms/index.json arrived damaged: its gzip"),
        "{message}"
    );
    assert_eq!(asked.load(Ordering::Relaxed), 2);
}

#[test]
fn a_link_is_no_address_of_a_tree() {
    for link in [
        "http://127.0.0.1:8080/?scene=rooms",
        "http://127.0.0.1:8080/#p=1,2,3&yaw=0",
    ] {
        let message = HttpSource::new(link).unwrap_err().to_string();
        assert!(message.starts_with(&format!("`{link}` is a link")), "{message}");
        assert!(message.ends_with("as in http://127.0.0.1:8080/"), "{message}");
    }
}

#[tokio::test]
async fn bundles_are_offered_by_who_says_so() {
    let offer = "Link: </o/bundle/>; rel=\"bundles\"\r\nContent-Length: 2\r\n";
    let (source, _) = server(vec![whole(b"{}"), answer("200 OK", offer, b"{}")]);
    source.get("/v1/scenes/museum/index.json").await.unwrap();
    assert!(!source.offers_bundles());
    source.get("/v1/scenes/museum/index.json").await.unwrap();
    assert!(Retrying::new(source.clone()).offers_bundles());
}

#[tokio::test]
async fn a_tree_that_offers_no_sessions_is_asked_once() {
    let rooms: SceneName = "rooms".parse().expect("a name");
    let only_bundles = answer("200 OK", "Link: </o/bundle/>; rel=\"bundles\"\r\n", b"");
    let (source, asked) = server(vec![only_bundles]);
    let offered = Session::offered(source, &rooms, Participant::default()).await.unwrap();
    assert!(offered.is_none());
    assert_eq!(asked.load(Ordering::Relaxed), 1);
}

#[tokio::test]
async fn what_is_no_event_stream_ends_the_session() {
    let rooms: SceneName = "rooms".parse().expect("a name");
    let link = "Link: </o/bundle/>; rel=\"bundles\", </v1/scenes/rooms/sessions>; rel=\"sessions\"\r\n";
    let opened =
        br#"{"session": "s1", "token": "secret", "object": "o100000000", "events_url": "/v1/sessions/s1/events"}"#;
    let (source, _) = server(vec![
        answer("200 OK", link, b""),
        whole(opened),
        answer("200 OK", "Content-Type: text/html\r\n", b"data: {}\n\n"),
    ]);
    let offered = Session::offered(source, &rooms, Participant::default()).await.unwrap();
    let mut session = offered.expect("sessions");
    session.stand(Stand::upright([0.0; 3]), [0.0; 3]);
    assert!(matches!(session.advance().await, Some(SessionEvent::Opened(_))));
    assert!(!format!("{session:?}").contains("secret"), "{session:?}");
    let lost = session.advance().await;
    assert!(
        matches!(lost, Some(SessionEvent::Lost(Error::Document { .. }))),
        "{lost:?}"
    );
    assert!(
        session.advance().await.is_none(),
        "nothing happens until one stands somewhere"
    );
    assert!(!session.is_open());
}

#[tokio::test]
async fn events_that_are_damaged_are_told_and_the_others_are_not_lost() {
    let rooms: SceneName = "rooms".parse().expect("a name");
    let opened = br#"{"session": "s1", "token": "t", "object": "o100000000", "events_url": "/v1/sessions/s1/events"}"#;
    let told = b"event: door\ndata: {\n\nevent: door\ndata: {\"object\": \"o5\", \"open\": false}\n\n";
    let (source, _) = server(vec![
        answer("200 OK", "Link: </v1/scenes/rooms/sessions>; rel=sessions\r\n", b""),
        whole(opened),
        answer("200 OK", "Content-Type: text/event-stream\r\n", told),
        answer("404 Not Found", "", b""),
    ]);
    let offered = Session::offered(source, &rooms, Participant::default()).await.unwrap();
    let mut session = offered.expect("sessions");
    session.stand(Stand::upright([0.0; 3]), [0.0; 3]);
    let mut happened = Vec::new();
    while let Some(event) = session.advance().await {
        let closed = session.company().closed_doors().len();
        happened.push((event, closed));
    }
    assert!(
        matches!(
            happened[..],
            [
                (SessionEvent::Opened(_), _),
                (SessionEvent::Problem(Error::Document { .. }), _),
                (SessionEvent::Told(LiveEvent::Door { open: false, .. }), 1),
                (SessionEvent::Cut(Error::Fetch { .. }), 1),
                (SessionEvent::Lost(Error::Missing(_)), 0),
            ]
        ),
        "{happened:?}"
    );
}
