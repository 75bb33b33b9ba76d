//! How are connections taken, limited and let go?
//!
//! `axum::serve` sets no timer and no limit, so this is an own loop over hyper: HTTP/1.1 and HTTP/2 on one port,
//! with TLS or without. A peer counts as a connection from its first packet on, before it has shaken hands. Beyond the limit of connections, new ones wait in the kernel's queue. At the end no new connection is taken,
//! open ones finish the request that they are in, and what is left after the drain time is cut.

use std::{net::SocketAddr, sync::Arc, time::Duration};

use hyper::service::service_fn;
use hyper_util::{
    rt::{TokioExecutor, TokioIo, TokioTimer},
    server::conn::auto::Builder,
};
use tokio::{
    io::{AsyncRead, AsyncWrite},
    net::{TcpListener, TcpStream},
    sync::Semaphore,
};
use tokio_util::{sync::CancellationToken, task::TaskTracker};

use super::{
    front::Front,
    peer::{Peer, Uploads},
    quiet::{Patience, Quiet},
    tls::Tls,
};

/// Limits on connections.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConnectionLimits {
    /// How many may be open.
    pub connections: usize,
    /// From the first byte of a request to the first byte of its answer.
    pub answer: Duration,
    /// A connection on which no byte moves for this long is closed.
    pub quiet: Duration,
    /// How long open requests may take to finish at the end.
    pub drain: Duration,
}

impl Default for ConnectionLimits {
    fn default() -> Self {
        Self {
            connections: 10_000,
            answer: Duration::from_secs(30),
            quiet: Duration::from_secs(75),
            drain: Duration::from_secs(10),
        }
    }
}

/// The largest head that hyper reads; larger ones get its bare 431.
const MAX_HEAD_BYTES: usize = 64 << 10;
/// Between pings on a quiet HTTP/2 connection, and how long their answers may take.
const PING_INTERVAL: Duration = Duration::from_secs(30);
const MAX_STREAMS: u32 = 200;

/// Takes connections until `stopping`, then lets them go.
pub async fn serve_connections(
    listener: TcpListener,
    front: Front,
    limits: ConnectionLimits,
    tls: Option<Tls>,
    stopping: CancellationToken,
) {
    let permits = Arc::new(Semaphore::new(limits.connections));
    let builder = Arc::new(builder());
    let (tasks, cutting) = (TaskTracker::new(), CancellationToken::new());
    let accepting = async {
        loop {
            let permit = permits
                .clone()
                .acquire_owned()
                .await
                .expect("the semaphore is never closed");
            let (stream, address) = match listener.accept().await {
                Ok(accepted) => accepted,
                Err(error) => {
                    pause_after(&error).await;
                    continue;
                }
            };
            let connection = Connection {
                builder: builder.clone(),
                front: front.clone(),
                tls: tls.clone(),
                patience: Patience {
                    quiet: limits.quiet,
                    answer: limits.answer,
                },
                stopping: stopping.clone(),
            };
            let (open, cut) = (front.state().metrics.connection(), cutting.clone());
            tasks.spawn(async move {
                cut.run_until_cancelled(connection.run(stream, address)).await;
                drop((permit, open));
            });
        }
    };
    let _: Option<()> = stopping.run_until_cancelled(accepting).await;
    drop(listener);
    tasks.close();
    if tokio::time::timeout(limits.drain, tasks.wait()).await.is_err() {
        tracing::warn!(open = tasks.len(), "cutting connections that did not finish in time");
        cutting.cancel();
        tasks.wait().await;
    }
}

fn builder() -> Builder<TokioExecutor> {
    let mut builder = Builder::new(TokioExecutor::new());
    // Without hyper's timer for heads, which is made and dropped for each request; `Quiet` covers slow heads too.
    builder.http1().header_read_timeout(None).max_buf_size(MAX_HEAD_BYTES);
    builder
        .http2()
        .timer(TokioTimer::new())
        .max_concurrent_streams(MAX_STREAMS)
        .max_header_list_size(MAX_HEAD_BYTES as u32)
        .keep_alive_interval(PING_INTERVAL)
        .keep_alive_timeout(PING_INTERVAL);
    builder
}

/// Errors of one connection are its own; running out of files needs a moment.
async fn pause_after(error: &std::io::Error) {
    use std::io::ErrorKind::{ConnectionAborted, ConnectionRefused, ConnectionReset};
    if !matches!(error.kind(), ConnectionAborted | ConnectionRefused | ConnectionReset) {
        tracing::warn!(%error, "cannot accept a connection");
        tokio::time::sleep(Duration::from_millis(200)).await;
    }
}

struct Connection {
    builder: Arc<Builder<TokioExecutor>>,
    front: Front,
    tls: Option<Tls>,
    patience: Patience,
    stopping: CancellationToken,
}

impl Connection {
    async fn run(self, stream: TcpStream, address: SocketAddr) {
        // Without it small answers wait for the peer's delayed acknowledgements.
        let _ = stream.set_nodelay(true);
        // Boxed, so that whoever only listens to a stream takes no room for a handshake and for both kinds of connections.
        let Some(tls) = &self.tls else {
            return Box::pin(self.talk(stream, address)).await;
        };
        match self.stopping.run_until_cancelled(tls.shake_hands(stream)).await {
            Some(Ok(stream)) => Box::pin(self.talk(stream, address)).await,
            Some(Err(error)) => tracing::debug!(%error, "a peer did not shake hands"),
            None => {}
        }
    }

    async fn talk<S: AsyncRead + AsyncWrite + Unpin + Send + 'static>(self, stream: S, address: SocketAddr) {
        let uploads = Uploads::default();
        let peer = Peer::new(address, uploads.clone());
        let io = TokioIo::new(Quiet::new(stream, self.patience, uploads));
        let answer = service_fn(move |request| {
            let (front, peer) = (self.front.clone(), peer.clone());
            async move { front.answer(request, &peer).await }
        });
        let serving = self.builder.serve_connection(io, answer);
        tokio::pin!(serving);
        let ended = tokio::select! {
            ended = serving.as_mut() => ended,
            () = self.stopping.cancelled() => {
                serving.as_mut().graceful_shutdown();
                serving.await
            }
        };
        if let Err(error) = ended {
            tracing::debug!(%error, "a connection ended early");
        }
    }
}
