//! A server that stands before another one and does not always do as it should. One request a connection.

use std::{
    net::SocketAddr,
    sync::{Arc, Mutex},
};

use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::{TcpListener, TcpStream},
};
use tokio_util::sync::CancellationToken;

/// What is wrong with answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Fault {
    None,
    /// 500 for everything.
    Fails,
    /// 500 for every blob that is written.
    TakesNoBlobs,
    /// Takes connections and says nothing.
    SaysNothing,
    /// Bodies end in their middle.
    CutsBodies,
    /// A byte of each body is another one.
    ChangesBodies,
    /// So is one of the next body, and of no other.
    ChangesABody,
}

pub(crate) struct Faulty {
    pub(crate) address: SocketAddr,
    fault: Arc<Mutex<Fault>>,
}

impl Faulty {
    pub(crate) async fn before(server: SocketAddr) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let fault = Arc::new(Mutex::new(Fault::None));
        let now = fault.clone();
        tokio::spawn(async move {
            while let Ok((stream, _)) = listener.accept().await {
                let fault = {
                    let mut now = now.lock().unwrap();
                    let fault = *now;
                    if fault == Fault::ChangesABody {
                        *now = Fault::None;
                    }
                    fault
                };
                // Whoever breaks off has what it needs.
                tokio::spawn(async move { _ = pass(stream, server, fault).await });
            }
        });
        Self { address, fault }
    }

    pub(crate) fn set(&self, fault: Fault) {
        *self.fault.lock().unwrap() = fault;
    }
}

/// A way to a server that can be cut: connections break, and new ones are closed at once.
pub(crate) struct Way {
    pub(crate) address: SocketAddr,
    cut: CancellationToken,
}

impl Way {
    pub(crate) async fn to(server: SocketAddr) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let (address, cut) = (listener.local_addr().unwrap(), CancellationToken::new());
        let token = cut.clone();
        tokio::spawn(async move {
            while let Ok((mut near, _)) = listener.accept().await {
                tokio::spawn(token.clone().run_until_cancelled_owned(async move {
                    let mut far = TcpStream::connect(server).await?;
                    tokio::io::copy_bidirectional(&mut near, &mut far).await
                }));
            }
        });
        Self { address, cut }
    }

    pub(crate) fn cut(&self) {
        self.cut.cancel();
    }
}

async fn pass(mut client: TcpStream, server: SocketAddr, fault: Fault) -> std::io::Result<()> {
    let request = message(&mut client).await?;
    if fault == Fault::SaysNothing {
        // Until the other end is tired of it.
        return client.read(&mut [0]).await.map(drop);
    }
    let blob = request.starts_with(b"PUT ") && has(&request[..request.len().min(1 << 10)], b"/o/");
    if fault == Fault::Fails || (fault == Fault::TakesNoBlobs && blob) {
        let answer = b"HTTP/1.1 500 Internal Server Error\r\nContent-Length: 0\r\nConnection: close\r\n\r\n";
        return client.write_all(answer).await;
    }
    let head = head_len(&request).unwrap();
    let mut upstream = TcpStream::connect(server).await?;
    upstream.write_all(&request[..head - 2]).await?;
    upstream.write_all(b"Connection: close\r\n\r\n").await?;
    upstream.write_all(&request[head..]).await?;
    let mut answer = Vec::new();
    upstream.read_to_end(&mut answer).await?;
    let body = head_len(&answer).unwrap();
    let gives_bytes = request.starts_with(b"GET ") && answer.len() > body;
    match fault {
        Fault::CutsBodies if gives_bytes => answer.truncate(body + (answer.len() - body) / 2),
        Fault::ChangesBodies | Fault::ChangesABody if gives_bytes => {
            let middle = body + (answer.len() - body) / 2;
            answer[middle] ^= 1;
        }
        _ => {}
    }
    client.write_all(&answer).await?;
    client.shutdown().await
}

/// A head with as much body as it announces.
async fn message(stream: &mut TcpStream) -> std::io::Result<Vec<u8>> {
    let (mut read, mut buffer) = (Vec::new(), vec![0; 64 << 10]);
    loop {
        if let Some(head) = head_len(&read) {
            let text = String::from_utf8_lossy(&read[..head]).to_ascii_lowercase();
            let length = text
                .lines()
                .find_map(|line| line.strip_prefix("content-length:")?.trim().parse().ok());
            if read.len() >= head + length.unwrap_or(0) {
                return Ok(read);
            }
        }
        match stream.read(&mut buffer).await? {
            0 => return Err(std::io::ErrorKind::UnexpectedEof.into()),
            bytes => read.extend_from_slice(&buffer[..bytes]),
        }
    }
}

fn has(bytes: &[u8], part: &[u8]) -> bool {
    bytes.windows(part.len()).any(|found| found == part)
}

fn head_len(message: &[u8]) -> Option<usize> {
    Some(message.windows(4).position(|four| four == b"\r\n\r\n")? + 4)
}
