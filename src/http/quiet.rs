//! When has a connection gone quiet? When no byte has moved in either direction for a while, when the peer has been
//! talking for long without having said enough for an answer, or, sooner, when the head of a request does not get whole: the
//! first one from the start on, since who connects wants something and half a head costs its sender nothing.
//!
//! So it covers a client that connects and says nothing, one that says its head or its body byte by byte, and one that
//! stops reading in the middle of an answer. Progress only notes the time; the timer is re-armed when it fires, not on
//! every byte or request, so a limit may be overrun by the shorter one of `quiet` and `answer`.

use std::{
    io,
    pin::Pin,
    task::{Context, Poll},
    time::Duration,
};

use tokio::{
    io::{AsyncRead, AsyncWrite, ReadBuf},
    time::{Instant, Sleep},
};

use super::peer::Requests;

/// How long a peer is waited for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patience {
    /// While no byte moves.
    pub(super) quiet: Duration,
    /// From the first byte read after the last one written to the next one written.
    pub(super) answer: Duration,
    /// From the start until a head is whole; in front of hyper, from the first byte of each later one as well. hyper does not say
    /// when a later one begins: that has `answer`.
    pub(super) head: Duration,
}

impl Patience {
    fn shorter(&self) -> Duration {
        self.quiet.min(self.answer)
    }
}

/// Something over which bytes may move that do not come past here.
pub(super) trait Moves {
    /// Whether some have since the last call.
    fn take_moved(&self) -> bool {
        false
    }
}

/// Fails with `TimedOut` when patience has ended.
#[derive(Debug)]
pub(super) struct Quiet<T> {
    io: T,
    patience: Patience,
    last_progress: Instant,
    /// Whether it was waited since.
    waited: bool,
    asked_since: Option<Instant>,
    /// Since when a head is waited for.
    head_since: Option<Instant>,
    timer: Pin<Box<Sleep>>,
    requests: Requests,
}

impl<T: Moves> Quiet<T> {
    pub(super) fn new(io: T, patience: Patience, requests: Requests) -> Self {
        let now = Instant::now();
        Self {
            io,
            patience,
            last_progress: now,
            waited: false,
            asked_since: None,
            head_since: Some(now),
            timer: Box::pin(tokio::time::sleep(patience.shorter().min(patience.head))),
            requests,
        }
    }

    /// The same on the runtime of whoever calls this.
    pub(super) fn moved(self, io: impl FnOnce(T) -> io::Result<T>) -> io::Result<Self> {
        Ok(Self {
            io: io(self.io)?,
            timer: Box::pin(tokio::time::sleep_until(self.timer.deadline())),
            ..self
        })
    }

    /// Some of a head is here.
    pub(super) fn head_has_begun(&mut self) {
        if self.head_since.is_none() {
            let now = Instant::now();
            self.head_since = Some(now);
            let due = now + self.patience.head;
            if due < self.timer.deadline() {
                self.timer.as_mut().reset(due);
            }
        }
    }

    /// All of a head is here.
    pub(super) fn head_is_whole(&mut self) {
        self.head_since = None;
    }

    /// Waits for something as patiently as for bytes.
    pub(super) fn poll_ready(
        &mut self,
        cx: &mut Context<'_>,
        ready: impl FnOnce(&T, &mut Context<'_>) -> Poll<io::Result<()>>,
    ) -> Poll<io::Result<()>> {
        match ready(&self.io, cx) {
            Poll::Pending => self.wait(cx),
            ready => ready,
        }
    }

    /// Writes what goes without waiting, which may be nothing.
    pub(super) fn write_now(&mut self, write: impl FnOnce(&T) -> io::Result<usize>) -> io::Result<usize> {
        match write(&self.io) {
            Ok(written) => {
                self.has_written();
                Ok(written)
            }
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => Ok(0),
            Err(error) => Err(error),
        }
    }

    pub(super) fn get_ref(&self) -> &T {
        &self.io
    }

    fn has_read(&mut self) {
        self.has_moved();
        self.asked_since.get_or_insert(self.last_progress);
    }

    fn has_written(&mut self) {
        // An answer that was ready at once is written when its request was read, as far as seconds go.
        if self.waited || self.asked_since.is_none() {
            self.has_moved();
        }
        self.asked_since = None;
    }

    fn has_moved(&mut self) {
        self.last_progress = Instant::now();
        self.waited = false;
    }

    /// Fails when there has been no progress for too long.
    fn wait<R>(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<R>> {
        self.waited = true;
        if self.io.take_moved() {
            self.has_written();
        }
        if self.requests.have_come() {
            self.head_since = None;
        }
        if self.requests.going_on() {
            // Whoever takes the upload counts for itself; its answer has its time from here on.
            self.asked_since = Some(Instant::now());
        }
        if self.requests.all_here() {
            // What was uploaded is on its way into a bucket, say.
            self.last_progress = Instant::now();
        }
        while self.timer.as_mut().poll(cx).is_ready() {
            let now = Instant::now();
            let ends = [
                Some(self.last_progress + self.patience.quiet),
                self.asked_since.map(|since| since + self.patience.answer),
                self.head_since.map(|since| since + self.patience.head),
            ];
            let due = ends
                .into_iter()
                .flatten()
                .fold(now + self.patience.shorter(), Instant::min);
            if due <= now {
                return Poll::Ready(Err(io::ErrorKind::TimedOut.into()));
            }
            self.timer.as_mut().reset(due);
        }
        Poll::Pending
    }
}

impl<T: AsyncRead + Moves + Unpin> AsyncRead for Quiet<T> {
    fn poll_read(mut self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        let polled = Pin::new(&mut self.io).poll_read(cx, buf);
        if polled.is_pending() {
            return self.wait(cx);
        }
        self.has_read();
        polled
    }
}

impl<T: AsyncWrite + Moves + Unpin> AsyncWrite for Quiet<T> {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        let polled = Pin::new(&mut self.io).poll_write(cx, bytes);
        if polled.is_pending() {
            return self.wait(cx);
        }
        self.has_written();
        polled
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        slices: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let polled = Pin::new(&mut self.io).poll_write_vectored(cx, slices);
        if polled.is_pending() {
            return self.wait(cx);
        }
        self.has_written();
        polled
    }

    fn is_write_vectored(&self) -> bool {
        self.io.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let polled = Pin::new(&mut self.io).poll_flush(cx);
        if polled.is_pending() {
            return self.wait(cx);
        }
        polled
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let polled = Pin::new(&mut self.io).poll_shutdown(cx);
        if polled.is_pending() {
            return self.wait(cx);
        }
        polled
    }
}

#[cfg(test)]
mod tests {
    use tokio::io::{AsyncReadExt, AsyncWriteExt, BufWriter, DuplexStream};

    use super::*;
    use crate::http::peer::Peer;

    impl Moves for DuplexStream {}
    impl<T> Moves for BufWriter<T> {}

    const LIMIT: Duration = Duration::from_secs(1);
    const PATIENCE: Patience = Patience {
        quiet: LIMIT,
        answer: Duration::from_secs(10),
        head: Duration::from_secs(10),
    };

    #[tokio::test]
    async fn silence_ends_the_connection_and_progress_keeps_it() {
        let (mut far, near) = tokio::io::duplex(16);
        let mut near = Quiet::new(near, PATIENCE, Requests::default());
        for _ in 0..15 {
            tokio::time::sleep(LIMIT / 10).await;
            far.write_all(b"x").await.unwrap();
            assert_eq!(near.read_u8().await.unwrap(), b'x');
        }
        let silent = near.read_u8().await.unwrap_err();
        assert_eq!(silent.kind(), io::ErrorKind::TimedOut);
    }

    #[tokio::test]
    async fn a_reader_that_stops_reading_is_given_up() {
        let (_far, near) = tokio::io::duplex(16);
        let mut near = Quiet::new(near, PATIENCE, Requests::default());
        let stuck = near.write_all(&[0; 64]).await.unwrap_err();
        assert_eq!(stuck.kind(), io::ErrorKind::TimedOut);
    }

    #[tokio::test]
    async fn a_reader_that_leaves_the_rest_in_a_buffer_is_given_up() {
        for ending in [false, true] {
            let (_far, near) = tokio::io::duplex(16);
            // It takes bytes before they are sent, as TLS does.
            let buffered = BufWriter::new(near);
            let mut near = Quiet::new(buffered, PATIENCE, Requests::default());
            near.write_all(&[0; 64]).await.unwrap();
            let stuck = if ending {
                near.shutdown().await
            } else {
                near.flush().await
            };
            assert_eq!(stuck.unwrap_err().kind(), io::ErrorKind::TimedOut);
        }
    }

    #[tokio::test]
    async fn a_peer_that_talks_without_end_and_never_gets_an_answer_is_given_up() {
        let (mut far, near) = tokio::io::duplex(16);
        let patience = Patience {
            quiet: Duration::from_secs(60),
            answer: LIMIT,
            head: Duration::from_secs(60),
        };
        let mut near = Quiet::new(near, patience, Requests::default());
        let talking = tokio::spawn(async move {
            while far.write_all(b"x").await.is_ok() {
                tokio::time::sleep(LIMIT / 50).await;
            }
        });
        let ended = loop {
            if let Err(error) = near.read_u8().await {
                break error;
            }
            tokio::time::sleep(LIMIT / 100).await;
        };
        assert_eq!(ended.kind(), io::ErrorKind::TimedOut);
        drop(near);
        talking.await.unwrap();
    }

    #[tokio::test]
    async fn an_upload_may_talk_for_longer_than_an_answer_may_take() {
        let (mut far, near) = tokio::io::duplex(16);
        let patience = Patience {
            quiet: Duration::from_secs(60),
            answer: LIMIT,
            head: Duration::from_secs(60),
        };
        let requests = Requests::default();
        let peer = Peer::new(([127, 0, 0, 1], 1).into(), requests.clone());
        let upload = peer.take_time();
        let mut near = Quiet::new(near, patience, requests);
        let talking = tokio::spawn(async move {
            for _ in 0..30 {
                tokio::time::sleep(LIMIT / 20).await;
                far.write_all(b"x").await.unwrap();
            }
            far
        });
        for _ in 0..30 {
            assert_eq!(near.read_u8().await.unwrap(), b'x');
        }
        drop(upload);
        let _far = talking.await.unwrap();
        let ended = near.read_u8().await.unwrap_err();
        assert_eq!(
            ended.kind(),
            io::ErrorKind::TimedOut,
            "it has said all and gets no answer"
        );
    }

    #[tokio::test]
    async fn who_has_sent_all_of_an_upload_may_wait_in_silence() {
        let (_far, near) = tokio::io::duplex(16);
        let requests = Requests::default();
        let peer = Peer::new(([127, 0, 0, 1], 1).into(), requests.clone());
        let mut upload = peer.take_time();
        upload.all_here();
        let mut near = Quiet::new(near, PATIENCE, requests);
        let waits = tokio::time::timeout(3 * LIMIT, near.read_u8()).await;
        assert!(waits.is_err(), "it was given up while the server worked");
        drop(upload);
        assert_eq!(near.read_u8().await.unwrap_err().kind(), io::ErrorKind::TimedOut);
    }

    #[tokio::test]
    async fn half_a_head_ends_the_connection_and_a_whole_one_keeps_it() {
        let patience = Patience {
            quiet: Duration::from_secs(60),
            answer: Duration::from_secs(60),
            head: LIMIT,
        };
        let (_far, near) = tokio::io::duplex(16);
        let mut silent = Quiet::new(near, patience, Requests::default());
        assert_eq!(silent.read_u8().await.unwrap_err().kind(), io::ErrorKind::TimedOut);

        let waits = async |near: &mut Quiet<_>| tokio::time::timeout(3 * LIMIT, near.read_u8()).await;
        let (mut far, near) = tokio::io::duplex(16);
        let mut near = Quiet::new(near, patience, Requests::default());
        far.write_all(b"xx").await.unwrap();
        near.read_u8().await.unwrap();
        near.head_is_whole();
        near.read_u8().await.unwrap();
        assert!(waits(&mut near).await.is_err(), "it may be silent between two heads");
        near.head_has_begun();
        assert_eq!(near.read_u8().await.unwrap_err().kind(), io::ErrorKind::TimedOut);

        let (_far, near) = tokio::io::duplex(16);
        let requests = Requests::default();
        let mut near = Quiet::new(near, patience, requests.clone());
        Peer::new(([127, 0, 0, 1], 1).into(), requests).has_asked();
        assert!(waits(&mut near).await.is_err(), "it has asked");
    }
}
