//! How are connections taken, limited and let go?
//!
//! `axum::serve` sets no timer and no limit, so this is an own loop over hyper: HTTP/1.1 and HTTP/2 without TLS on one
//! port. Beyond the limit of connections, new ones wait in the kernel's queue. At the end no new connection is taken,
//! open ones finish the request that they are in, and what is left after the drain time is cut.

use std::{sync::Arc, time::Duration};

use axum::Router;
use hyper_util::{
    rt::{TokioExecutor, TokioIo, TokioTimer},
    server::conn::auto::Builder,
    service::TowerToHyperService,
};
use tokio::{
    net::{TcpListener, TcpStream},
    sync::Semaphore,
};
use tokio_util::{sync::CancellationToken, task::TaskTracker};

use super::{Metrics, quiet::Quiet};

/// Limits on connections.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConnectionLimits {
    /// How many may be open.
    pub connections: usize,
    /// From the end of one request (or the connection) to the whole head of the next, HTTP/1.1.
    pub head: Duration,
    /// A connection on which no byte moves for this long is closed.
    pub quiet: Duration,
    /// How long open requests may take to finish at the end.
    pub drain: Duration,
}

impl Default for ConnectionLimits {
    fn default() -> Self {
        Self {
            connections: 10_000,
            head: Duration::from_secs(30),
            quiet: Duration::from_secs(75),
            drain: Duration::from_secs(10),
        }
    }
}

/// The largest head that hyper reads; larger ones get its bare 431.
const MAX_HEAD_BYTES: usize = 64 << 10;
const MAX_STREAMS: u32 = 200;

/// Takes connections until `stopping`, then lets them go.
pub async fn serve_connections(
    listener: TcpListener,
    router: Router,
    metrics: Metrics,
    limits: ConnectionLimits,
    stopping: CancellationToken,
) {
    let permits = Arc::new(Semaphore::new(limits.connections));
    let builder = Arc::new(builder(&limits));
    let (tasks, cutting) = (TaskTracker::new(), CancellationToken::new());
    let accepting = async {
        loop {
            let permit = permits
                .clone()
                .acquire_owned()
                .await
                .expect("the semaphore is never closed");
            let stream = match listener.accept().await {
                Ok((stream, _)) => stream,
                Err(error) => {
                    pause_after(&error).await;
                    continue;
                }
            };
            let connection = Connection {
                builder: builder.clone(),
                router: router.clone(),
                quiet: limits.quiet,
                stopping: stopping.clone(),
            };
            let (open, cut) = (metrics.connection(), cutting.clone());
            tasks.spawn(async move {
                cut.run_until_cancelled(connection.run(stream)).await;
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

fn builder(limits: &ConnectionLimits) -> Builder<TokioExecutor> {
    let mut builder = Builder::new(TokioExecutor::new());
    builder
        .http1()
        .timer(TokioTimer::new())
        .header_read_timeout(limits.head)
        .max_buf_size(MAX_HEAD_BYTES);
    builder
        .http2()
        .timer(TokioTimer::new())
        .max_concurrent_streams(MAX_STREAMS)
        .max_header_list_size(MAX_HEAD_BYTES as u32)
        .keep_alive_interval(limits.head)
        .keep_alive_timeout(limits.head);
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
    router: Router,
    quiet: Duration,
    stopping: CancellationToken,
}

impl Connection {
    async fn run(self, stream: TcpStream) {
        // Without it small answers wait for the peer's delayed acknowledgements.
        let _ = stream.set_nodelay(true);
        let io = TokioIo::new(Quiet::new(stream, self.quiet));
        let serving = self.builder.serve_connection(io, TowerToHyperService::new(self.router));
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
