//! How are connections taken, limited and let go?
//!
//! `axum::serve` sets no timer and no limit, so this is an own loop over hyper: HTTP/1.1 and HTTP/2 on one port,
//! with TLS or without. A peer counts as a connection from its first packet on, before it has shaken hands. Beyond the limit of
//! connections, new ones wait in the kernel's queue; beyond that of one address, new ones of it are closed, so that nobody
//! takes all of them. At the end no new connection is taken, open ones finish the request that they are in, and what is left
//! after the drain time is cut.

use std::{
    future::poll_fn,
    io,
    net::SocketAddr,
    pin::{Pin, pin},
    sync::Arc,
    task::Poll,
    time::Duration,
};

use hyper::{Request, body::Incoming, service::service_fn};
use hyper_util::{
    rt::{TokioIo, TokioTimer},
    server::conn::auto::Builder,
};
use tokio::{
    io::{AsyncRead, AsyncWrite},
    net::{TcpListener, TcpStream},
    runtime::Handle,
    sync::Semaphore,
};
use tokio_util::{sync::CancellationToken, task::TaskTracker};

use super::{
    addresses::Addresses,
    cork::Cork,
    date,
    direct::{Answer, Direct, Outcome, Socket},
    ending::{Ending, Heard},
    event_loops::EventLoops,
    front::Front,
    peer::{Peer, Requests, household},
    quiet::{Moves, Patience, Quiet},
    streams::AtOnce,
    tls::Tls,
};

/// Limits on connections.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConnectionLimits {
    /// How many may be open.
    pub connections: usize,
    /// How many of them from one address; half of all when it is not said.
    pub of_an_address: Option<usize>,
    /// Until the head of a request is whole.
    pub head: Duration,
    /// From the first byte of a request to the first byte of its answer.
    pub answer: Duration,
    /// A connection on which no byte moves for this long is closed.
    pub quiet: Duration,
    /// How long open requests may take to finish at the end.
    pub drain: Duration,
}

impl ConnectionLimits {
    /// How many connections one address may have.
    #[must_use]
    pub fn most_of_an_address(&self) -> usize {
        self.of_an_address.unwrap_or_else(|| self.connections.div_ceil(2))
    }
}

impl Default for ConnectionLimits {
    fn default() -> Self {
        Self {
            connections: 10_000,
            of_an_address: None,
            head: Duration::from_secs(10),
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

/// So much of an answer waits in the system beside what is on its way. More would wait outside the processor's cache, and be
/// memory that everybody holds who reads slowly.
#[cfg(any(target_os = "linux", target_os = "android"))]
const UNSENT_BYTES: u32 = 512 << 10;

/// Takes connections until `stopping`, then lets them go.
pub async fn serve_connections(
    listener: TcpListener,
    front: Front,
    limits: ConnectionLimits,
    tls: Option<Tls>,
    stopping: CancellationToken,
) {
    limit_unsent(&listener);
    let permits = Arc::new(Semaphore::new(limits.connections));
    let builders = Arc::new(Builders::new());
    let shared = Handle::current();
    let loops = EventLoops::start().expect("the system has room for threads");
    let addresses = Addresses::new(limits.most_of_an_address());
    let (tasks, ending, cutting) = (TaskTracker::new(), Ending::default(), Ending::default());
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
            let Some(place) = addresses.enter(household(address)) else {
                front.state().metrics.connection_refused();
                continue;
            };
            let connection = Connection {
                builders: builders.clone(),
                front: front.clone(),
                patience: Patience {
                    quiet: limits.quiet,
                    answer: limits.answer,
                    head: limits.head,
                },
                stopping: ending.heard(),
                shared: shared.clone(),
            };
            let open = front.state().metrics.connection();
            let mut cut = cutting.heard();
            // The permit last: whoever is let in by it finds the place free and the file closed.
            let held = (place, open, permit);
            // Without it small answers wait for the peer's delayed acknowledgements.
            let _ = stream.set_nodelay(true);
            let (handle, load) = loops.least_busy();
            // Boxed: what is there until a connection is known to be of one kind takes no room after that.
            let running: io::Result<Running> = {
                let _within = handle.enter();
                let stream = stream.into_std().and_then(TcpStream::from_std);
                stream.map(|stream| match &tls {
                    Some(tls) => Box::pin(connection.shake_hands(tls.clone(), stream, address)) as Running,
                    None => connection.talk(stream, address),
                })
            };
            let running = match running {
                Ok(running) => running,
                Err(error) => {
                    pause_after(&error).await;
                    continue;
                }
            };
            // To agree on keys takes long.
            let (here, elsewhere, load_here, load_elsewhere) = match tls {
                Some(_) => (&shared, handle, None, Some(load)),
                None => (handle, &shared, Some(load), None),
            };
            let (going_on, elsewhere) = (tasks.clone(), elsewhere.clone());
            let answering = async move {
                let left = attend(running, &mut cut).await;
                drop(load_here);
                if let Some(left) = left {
                    let left = async move {
                        attend(left, &mut cut).await;
                        drop((load_elsewhere, held));
                    };
                    going_on.spawn_on(left, &elsewhere);
                }
            };
            tasks.spawn_on(answering, here);
        }
    };
    let _: Option<()> = stopping.run_until_cancelled(accepting).await;
    drop(listener);
    ending.give();
    tasks.close();
    if tokio::time::timeout(limits.drain, tasks.wait()).await.is_err() {
        tracing::warn!(open = tasks.len(), "cutting connections that did not finish in time");
        cutting.give();
        tasks.wait().await;
    }
}

/// For all connections that are taken from there.
#[cfg(any(target_os = "linux", target_os = "android"))]
fn limit_unsent(listener: &TcpListener) {
    let limited = socket2::SockRef::from(listener).set_tcp_notsent_lowat(UNSENT_BYTES);
    if let Err(error) = limited {
        tracing::debug!(%error, "cannot limit what waits to be sent");
    }
}

/// Elsewhere as much waits as the system likes.
#[cfg(not(any(target_os = "linux", target_os = "android")))]
fn limit_unsent(_: &TcpListener) {}

fn builder() -> Builder<AtOnce> {
    let mut builder = Builder::new(AtOnce);
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
async fn pause_after(error: &io::Error) {
    use io::ErrorKind::{ConnectionAborted, ConnectionRefused, ConnectionReset};
    if !matches!(error.kind(), ConnectionAborted | ConnectionRefused | ConnectionReset) {
        tracing::warn!(%error, "cannot accept a connection");
        tokio::time::sleep(Duration::from_millis(200)).await;
    }
}

/// hyper, for connections of which nothing has been read, and for those that have spoken HTTP/1.1 and can speak nothing else.
struct Builders {
    any: Builder<AtOnce>,
    http1: Builder<AtOnce>,
}

impl Builders {
    fn new() -> Self {
        Self {
            any: builder(),
            http1: builder().http1_only(),
        }
    }
}

/// What is left to be done for a connection. So what it took to get as far takes no room any more, which counts while a
/// stream is quiet.
enum GoesOn {
    /// Nothing.
    Over,
    /// This, where it is.
    Here(Running),
    /// This, elsewhere: from an event loop on the runtime that all else shares, or the reverse.
    Elsewhere(Running),
}

type Running = Pin<Box<dyn Future<Output = GoesOn> + Send>>;

/// Goes on with a connection until it is over or is cut, or the rest that this gives is to be gone on with elsewhere.
async fn attend(mut running: Running, cut: &mut Heard) -> Option<Running> {
    poll_fn(|cx| {
        loop {
            match running.as_mut().poll(cx) {
                Poll::Ready(GoesOn::Here(next)) => running = next,
                Poll::Ready(GoesOn::Elsewhere(next)) => return Poll::Ready(Some(next)),
                Poll::Ready(GoesOn::Over) => return Poll::Ready(None),
                Poll::Pending => return cut.poll(cx).map(|()| None),
            }
        }
    })
    .await
}

struct Connection {
    builders: Arc<Builders>,
    front: Front,
    patience: Patience,
    stopping: Heard,
    shared: Handle,
}

impl Connection {
    /// Without TLS.
    fn talk(self, stream: TcpStream, address: SocketAddr) -> Running {
        let (io, peer) = self.watched(Socket::new(stream), address);
        let direct = Direct::new(io, self.front.clone(), peer, self.stopping.again(), self.shared.clone());
        Box::new(self).talk_plainly(Box::new(direct))
    }

    /// A connection whose patience is counted, and who is at its other end.
    fn watched<S: Moves>(&self, stream: S, address: SocketAddr) -> (Quiet<S>, Peer) {
        let requests = Requests::default();
        let peer = Peer::new(address, requests.clone());
        (Quiet::new(stream, self.patience, requests), peer)
    }

    async fn shake_hands(mut self, tls: Tls, stream: TcpStream, address: SocketAddr) -> GoesOn {
        let mut shaking = Box::pin(tls.shake_hands(stream));
        let shaken = poll_fn(|cx| match shaking.as_mut().poll(cx) {
            Poll::Ready(shaken) => Poll::Ready(Some(shaken)),
            Poll::Pending => self.stopping.poll(cx).map(|()| None),
        });
        match shaken.await {
            Some(Ok(stream)) => {
                drop(shaking);
                return GoesOn::Elsewhere(Box::pin(async move {
                    let (talk, cork) = stream;
                    let (io, peer) = self.watched(talk, address);
                    self.ask_hyper(io, peer, (true, cork), true).await;
                    GoesOn::Over
                }));
            }
            Some(Err(error)) => tracing::debug!(%error, "a peer did not shake hands"),
            None => {}
        }
        GoesOn::Over
    }

    fn talk_plainly(self: Box<Self>, mut direct: Box<Direct>) -> Running {
        Box::pin(async move {
            match direct.talk().await {
                Ok(Outcome::Ended) => {}
                Ok(Outcome::NotSimple { first }) => {
                    return GoesOn::Elsewhere(Box::pin(async move {
                        match direct.leave().await {
                            Ok((io, peer)) => self.ask_hyper(io, peer, (first, None), false).await,
                            Err(error) => tracing::debug!(%error, "a connection ended early"),
                        }
                        GoesOn::Over
                    }));
                }
                Ok(Outcome::Stream(answer)) => return GoesOn::Here(Box::pin(self.stream(direct, answer))),
                Err(error) => tracing::debug!(%error, "a connection ended early"),
            }
            GoesOn::Over
        })
    }

    async fn stream(self: Box<Self>, mut direct: Box<Direct>, answer: Box<Answer>) -> GoesOn {
        match direct.write(answer).await {
            Ok(true) => GoesOn::Here(self.talk_plainly(direct)),
            Ok(false) => GoesOn::Over,
            Err(error) => {
                tracing::debug!(%error, "a connection ended early");
                GoesOn::Over
            }
        }
    }

    /// Leaves a connection to hyper, given whether nothing has been read of it, by what its frames are held back, and whether it is
    /// on an event loop.
    async fn ask_hyper<S>(mut self, stream: S, peer: Peer, (first, cork): (bool, Option<Cork>), on_a_loop: bool)
    where
        S: AsyncRead + AsyncWrite + Unpin + Send + 'static,
    {
        let builders = self.builders.clone();
        let builder = if first { &builders.any } else { &builders.http1 };
        let turns = cork.clone();
        let answer = service_fn(move |request: Request<Incoming>| {
            peer.has_asked();
            if let Some(cork) = &turns {
                cork.begin();
            }
            let (front, peer, shared) = (self.front.clone(), peer.clone(), self.shared.clone());
            async move {
                let answer = if on_a_loop {
                    front.answer_beside(request, peer, &shared).await
                } else {
                    let Ok(answer) = front.answer(request, &peer).await;
                    Ok(answer)
                };
                answer.map(date::dated)
            }
        });
        let mut serving = pin!(builder.serve_connection(TokioIo::new(stream), answer));
        let mut stopped = false;
        let ended = poll_fn(|cx| {
            loop {
                let polled = match &cork {
                    Some(cork) => cork.poll(serving.as_mut(), cx),
                    None => serving.as_mut().poll(cx),
                };
                if polled.is_ready() {
                    return polled;
                }
                if stopped || self.stopping.poll(cx).is_pending() {
                    return Poll::Pending;
                }
                stopped = true;
                serving.as_mut().graceful_shutdown();
            }
        });
        if let Err(error) = ended.await {
            tracing::debug!(%error, "a connection ended early");
        }
    }
}

#[cfg(all(test, any(target_os = "linux", target_os = "android")))]
mod tests {
    use super::*;

    #[tokio::test]
    async fn what_waits_to_be_sent_is_limited_for_every_connection() {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        limit_unsent(&listener);
        let _far = TcpStream::connect(listener.local_addr().unwrap()).await.unwrap();
        let (near, _) = listener.accept().await.unwrap();
        let limit = socket2::SockRef::from(&near).tcp_notsent_lowat().unwrap();
        assert_eq!(limit, UNSENT_BYTES);
    }
}
