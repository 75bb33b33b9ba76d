//! A participant that is as blunt as a test needs: requests with a token, and a stream of events. Also used by
//! `tests/e2e`.

#![allow(dead_code, reason = "each test binary uses a part")]
#![allow(clippy::unwrap_used, reason = "a test may fail at any step")]

use std::{net::SocketAddr, time::Duration};

use serde_json::{Value, json};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::TcpStream,
};

use crate::wire::{Answer, parse, raw};

const PATIENCE: Duration = Duration::from_secs(20);

/// One request with a body of this media type.
pub(crate) async fn ask(
    address: SocketAddr,
    (method, path): (&str, &str),
    token: Option<&str>,
    (kind, body): (&str, &str),
) -> Answer {
    let token = token.map_or_else(String::new, |token| format!("Authorization: Bearer {token}\r\n"));
    let length = body.len();
    let request = format!(
        "{method} {path} HTTP/1.1\r\nHost: test\r\nConnection: close\r\n{token}Content-Type: {kind}\r\nContent-Length: {length}\r\n\r\n{body}"
    );
    parse(&raw(address, request.as_bytes()).await)
}

/// One request with a JSON body.
pub(crate) async fn json(address: SocketAddr, what: (&str, &str), token: Option<&str>, body: &Value) -> Answer {
    ask(address, what, token, ("application/json", &body.to_string())).await
}

/// Somebody in a scene.
pub(crate) struct Person {
    /// The server that it speaks to.
    pub(crate) address: SocketAddr,
    /// The link through which it came, without its last `/`; empty where the scene is public.
    link: String,
    pub(crate) session: String,
    pub(crate) token: String,
    pub(crate) object: String,
    /// What it was told at the door.
    pub(crate) hush: Value,
}

impl Person {
    pub(crate) async fn enter(address: SocketAddr, x: f64) -> Self {
        Self::enter_with(address, x, json!({})).await
    }

    /// Slow people in a small world: a cell is a metre wide.
    pub(crate) async fn enter_with(address: SocketAddr, x: f64, more: Value) -> Self {
        let mut body = json!({"position": [x, 0.5, 0.5], "max_speed_mps": 0.2, "radius_m": 0.1, "t_ms": 0});
        for (name, value) in more.as_object().unwrap() {
            body[name] = value.clone();
        }
        Self::enter_scene(address, "row", &body).await
    }

    /// Somebody in any scene.
    pub(crate) async fn enter_scene(address: SocketAddr, scene: &str, body: &Value) -> Self {
        Self::enter_below(address, "", scene, body).await
    }

    /// The same through a link, given without its last `/`.
    pub(crate) async fn enter_below(address: SocketAddr, link: &str, scene: &str, body: &Value) -> Self {
        Self::enter_as(address, link, None, scene, body).await
    }

    /// The same with an API key.
    pub(crate) async fn enter_as(
        address: SocketAddr,
        link: &str,
        key: Option<&str>,
        scene: &str,
        body: &Value,
    ) -> Self {
        let path = format!("{link}/v1/scenes/{scene}/sessions");
        let answer = json(address, ("POST", &path), key, body).await;
        let opened = answer.json();
        assert_eq!(answer.status, 201, "{opened}");
        let text = |name: &str| opened[name].as_str().unwrap().to_owned();
        Self {
            address,
            link: link.to_owned(),
            session: text("session"),
            token: text("token"),
            object: text("object"),
            hush: opened["hush"].clone(),
        }
    }

    pub(crate) fn path(&self, rest: &str) -> String {
        format!("{}/v1/sessions/{}{rest}", self.link, self.session)
    }

    pub(crate) async fn put(&self, rest: &str, body: &Value) -> Answer {
        json(self.address, ("PUT", &self.path(rest)), Some(&self.token), body).await
    }

    pub(crate) async fn stand_at(&self, x: f64) -> Value {
        self.stand(json!([x, 0.5, 0.5])).await
    }

    pub(crate) async fn stand(&self, position: Value) -> Value {
        let answer = self.put("/pose", &json!({"position": position})).await;
        assert_eq!(answer.status, 200, "{answer:?}");
        answer.json()
    }

    pub(crate) async fn leave(&self) -> u16 {
        let none = ("application/json", "");
        ask(self.address, ("DELETE", &self.path("")), Some(&self.token), none)
            .await
            .status
    }

    pub(crate) async fn listen(&self) -> Stream {
        self.listen_after("").await
    }

    /// Opens the stream with more header lines.
    pub(crate) async fn listen_after(&self, headers: &str) -> Stream {
        let mut socket = TcpStream::connect(self.address).await.unwrap();
        let (path, token) = (self.path("/events"), &self.token);
        let request = format!("GET {path}?token={token} HTTP/1.1\r\nHost: test\r\n{headers}\r\n");
        socket.write_all(request.as_bytes()).await.unwrap();
        Stream {
            socket,
            text: String::new(),
            read: 0,
        }
    }
}

/// An event as it came.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Event {
    pub(crate) id: u64,
    pub(crate) name: String,
    pub(crate) data: Value,
}

pub(crate) struct Stream {
    socket: TcpStream,
    /// Everything that came, chunk sizes included: they stand between events.
    pub(crate) text: String,
    read: usize,
}

impl Stream {
    /// Reads more; false at the end.
    async fn more(&mut self) -> bool {
        let mut buffer = [0; 4096];
        let read = tokio::time::timeout(PATIENCE, self.socket.read(&mut buffer)).await;
        let read = read
            .unwrap_or_else(|_| panic!("nothing came after {}", self.text))
            .unwrap();
        self.text.push_str(std::str::from_utf8(&buffer[..read]).unwrap());
        read > 0
    }

    /// The next event.
    pub(crate) async fn next(&mut self) -> Event {
        loop {
            let rest = &self.text[self.read..];
            if let Some(from) = rest.find("id: ")
                && let Some(length) = rest[from..].find("\n\n")
            {
                let lines: Vec<_> = rest[from..from + length].lines().collect();
                self.read += from + length;
                let field = |i: usize, name: &str| lines[i].strip_prefix(name).unwrap().to_owned();
                return Event {
                    id: field(0, "id: ").parse().unwrap(),
                    name: field(1, "event: "),
                    data: serde_json::from_str(&field(2, "data: ")).unwrap(),
                };
            }
            assert!(self.more().await, "the stream has ended after {}", self.text);
        }
    }

    /// The next event of a kind; others are passed over.
    pub(crate) async fn wait(&mut self, name: &str) -> Event {
        loop {
            let event = self.next().await;
            if event.name == name {
                return event;
            }
        }
    }

    /// Waits until a mover is told to be at this place along the row.
    pub(crate) async fn wait_for(&mut self, mover: &str, x: f64) {
        loop {
            let told = self.wait("object-pos").await.data;
            let there = |o: &Value| (o["position"][0].as_f64().unwrap() - x).abs() < 1e-9;
            if told["objects"]
                .as_array()
                .unwrap()
                .iter()
                .any(|o| o["object"] == mover && there(o))
            {
                return;
            }
        }
    }

    /// Waits until the server has begun to answer.
    pub(crate) async fn begins(&mut self) {
        while !self.text.contains("retry: ") {
            assert!(self.more().await, "no stream: {}", self.text);
        }
    }

    /// Reads to the end of the body.
    pub(crate) async fn ends(&mut self) {
        while !self.text.ends_with("\r\n0\r\n\r\n") {
            assert!(self.more().await, "cut, not ended: {}", self.text);
        }
    }
}
