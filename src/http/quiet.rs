//! When has a connection gone quiet? When no byte has moved in either direction for a while, or when the peer has been
//! talking for long without having said enough for an answer.
//!
//! So it covers a client that connects and says nothing, one that says its head or its body byte by byte, and one that
//! stops reading in the middle of an answer. Progress only notes the time; the timer is re-armed when it fires, not on
//! every byte or request, so a limit may be overrun by the shorter of the two.

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

use super::peer::Uploads;

/// How long a peer is waited for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patience {
    /// While no byte moves.
    pub(super) quiet: Duration,
    /// From the first byte read after the last one written to the next one written.
    pub(super) answer: Duration,
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
    asked_since: Option<Instant>,
    timer: Pin<Box<Sleep>>,
    uploads: Uploads,
}

impl<T: Moves> Quiet<T> {
    pub(super) fn new(io: T, patience: Patience, uploads: Uploads) -> Self {
        Self {
            io,
            patience,
            last_progress: Instant::now(),
            asked_since: None,
            timer: Box::pin(tokio::time::sleep(patience.shorter())),
            uploads,
        }
    }

    pub(super) fn get_ref(&self) -> &T {
        &self.io
    }

    fn has_read(&mut self) {
        self.last_progress = Instant::now();
        self.asked_since.get_or_insert(self.last_progress);
    }

    fn has_written(&mut self) {
        self.last_progress = Instant::now();
        self.asked_since = None;
    }

    /// Fails when there has been no progress for too long.
    fn wait<R>(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<R>> {
        if self.io.take_moved() {
            self.has_written();
        }
        if self.uploads.going_on() {
            // Whoever takes the upload counts for itself; its answer has its time from here on.
            self.asked_since = Some(Instant::now());
        }
        if self.uploads.all_here() {
            // What was uploaded is on its way into a bucket, say.
            self.last_progress = Instant::now();
        }
        while self.timer.as_mut().poll(cx).is_ready() {
            let (now, quiet) = (Instant::now(), self.last_progress + self.patience.quiet);
            let due = match self.asked_since {
                Some(since) => quiet.min(since + self.patience.answer),
                None => quiet,
            };
            if due <= now {
                return Poll::Ready(Err(io::ErrorKind::TimedOut.into()));
            }
            self.timer.as_mut().reset(due.min(now + self.patience.shorter()));
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
    };

    #[tokio::test]
    async fn silence_ends_the_connection_and_progress_keeps_it() {
        let (mut far, near) = tokio::io::duplex(16);
        let mut near = Quiet::new(near, PATIENCE, Uploads::default());
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
        let mut near = Quiet::new(near, PATIENCE, Uploads::default());
        let stuck = near.write_all(&[0; 64]).await.unwrap_err();
        assert_eq!(stuck.kind(), io::ErrorKind::TimedOut);
    }

    #[tokio::test]
    async fn a_reader_that_leaves_the_rest_in_a_buffer_is_given_up() {
        for ending in [false, true] {
            let (_far, near) = tokio::io::duplex(16);
            // It takes bytes before they are sent, as TLS does.
            let buffered = BufWriter::new(near);
            let mut near = Quiet::new(buffered, PATIENCE, Uploads::default());
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
        };
        let mut near = Quiet::new(near, patience, Uploads::default());
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
        };
        let uploads = Uploads::default();
        let peer = Peer::new(([127, 0, 0, 1], 1).into(), uploads.clone());
        let upload = peer.take_time();
        let mut near = Quiet::new(near, patience, uploads);
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
        let uploads = Uploads::default();
        let peer = Peer::new(([127, 0, 0, 1], 1).into(), uploads.clone());
        let mut upload = peer.take_time();
        upload.all_here();
        let mut near = Quiet::new(near, PATIENCE, uploads);
        let waits = tokio::time::timeout(3 * LIMIT, near.read_u8()).await;
        assert!(waits.is_err(), "it was given up while the server worked");
        drop(upload);
        assert_eq!(near.read_u8().await.unwrap_err().kind(), io::ErrorKind::TimedOut);
    }
}
