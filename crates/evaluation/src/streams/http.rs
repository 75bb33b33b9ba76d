//! A request that waits for its answer, over a connection that stays.

use std::{
    io::{Read, Write},
    net::{SocketAddr, TcpStream},
};

use anyhow::Context;
use serde_json::Value;

pub(super) struct Asking {
    stream: TcpStream,
}

impl Asking {
    pub(super) fn connect(address: SocketAddr) -> anyhow::Result<Self> {
        let stream = TcpStream::connect(address)?;
        stream.set_nodelay(true)?;
        Ok(Self { stream })
    }

    /// Posts JSON and gives the JSON that is answered.
    pub(super) fn post(&mut self, path: &str, token: Option<&str>, body: &Value) -> anyhow::Result<Value> {
        let request = request(path, token, "application/json", body.to_string().as_bytes());
        self.stream.write_all(&request)?;
        let (mut said, mut room) = (Vec::new(), [0; 8 << 10]);
        loop {
            if let Some(whole) = whole(&said) {
                let (status, body) = whole?;
                anyhow::ensure!(status.starts_with('2'), "{path}: {status} {body}");
                return serde_json::from_str(&body).with_context(|| format!("{path}: no JSON"));
            }
            let read = self.stream.read(&mut room)?;
            anyhow::ensure!(read > 0, "{path}: the connection ended");
            said.extend_from_slice(&room[..read]);
        }
    }
}

/// A POST.
pub(super) fn request(path: &str, token: Option<&str>, kind: &str, body: &[u8]) -> Vec<u8> {
    let token = token.map_or_else(String::new, |token| format!("Authorization: Bearer {token}\r\n"));
    let length = body.len();
    let head =
        format!("POST {path} HTTP/1.1\r\nHost: t\r\n{token}Content-Type: {kind}\r\nContent-Length: {length}\r\n\r\n");
    [head.as_bytes(), body].concat()
}

/// Status and body of an answer, once it is whole.
fn whole(said: &[u8]) -> Option<anyhow::Result<(String, String)>> {
    let text = String::from_utf8_lossy(said);
    let (head, body) = text.split_once("\r\n\r\n")?;
    let status = head.split(' ').nth(1).unwrap_or_default().to_owned();
    let length = head.lines().find_map(|line| {
        let (name, value) = line.split_once(':')?;
        name.eq_ignore_ascii_case("content-length")
            .then(|| value.trim().parse::<usize>())
    });
    match length {
        Some(Ok(length)) => (body.len() >= length).then(|| Ok((status, body.to_owned()))),
        _ => Some(Err(anyhow::anyhow!("an answer without its length: {head}"))),
    }
}
