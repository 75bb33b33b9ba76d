//! Which requests need no HTTP library? Those over HTTP/1.1 without TLS that are simple beyond doubt: a GET or HEAD of a
//! plain path, with fields that say nothing of bodies or of the connection.
//!
//! Objects in memory are written straight from where they lie, behind heads that were made once. All else that is simple
//! is asked of the same router as everywhere, and its answer is written as hyper would write it, event streams too: a
//! connection that waits holds no buffers. Whatever is not simple is hyper's, with all bytes that have come, and so is the
//! connection from then on. This way needs no rule for it, and what both would read differently cannot be.
//!
//! * `head`: what is simple. `wire`: heads of answers, and how bytes are written. `body`: bodies of other answers.
//! * `socket`: a connection that others may write to beside its task. `rewind`: one whose first bytes have been read.

mod body;
mod head;
mod rewind;
mod socket;
mod wire;

use std::{
    future::poll_fn,
    io,
    mem::MaybeUninit,
    pin::Pin,
    task::{Context, Poll, ready},
};

use axum::{body::Body, http::Request};
use tokio::io::{AsyncRead, ReadBuf};

use self::head::{Head, MAX_HEAD_BYTES};
pub(super) use self::{
    body::Answer,
    head::Simple,
    rewind::Rewind,
    socket::Socket,
    wire::{Ready, head_lines},
};
use super::{ending::Heard, front::Front, peer::Peer, quiet::Quiet};

/// A head that comes in more pieces than this is hyper's.
const MOST_PIECES: u32 = 8;

/// How it went on.
#[derive(Debug)]
pub(super) enum Outcome {
    /// It is over.
    Ended,
    /// Something that is not simple has come; whether it is the first thing that the peer says.
    NotSimple { first: bool },
    /// An answer has come of which nobody knows how long it will be; it is to be written.
    Stream(Box<Answer>),
}

/// A connection that is answered without hyper.
pub(super) struct Direct {
    io: Quiet<Socket>,
    /// What has come and is not answered; without room of its own while there is nothing.
    said: Vec<u8>,
    /// How many reads it took.
    pieces: u32,
    front: Front,
    peer: Peer,
    stopping: Heard,
    first: bool,
}

/// What is to be done next.
enum Next {
    /// Write an object.
    Write(Ready),
    /// Ask the router.
    Ask(Box<Request<Body>>),
    /// Leave it to hyper.
    Leave,
    /// The peer, or the server, has come to an end.
    End,
}

impl Direct {
    pub(super) fn new(io: Quiet<Socket>, front: Front, peer: Peer, stopping: Heard) -> Self {
        Self {
            io,
            said: Vec::new(),
            pieces: 0,
            front,
            peer,
            stopping,
            first: true,
        }
    }

    /// Answers until the connection ends, something is not simple, or an answer may take long.
    pub(super) async fn talk(&mut self) -> io::Result<Outcome> {
        loop {
            match poll_fn(|cx| self.poll_next(cx)).await? {
                Next::Write(ready) => ready.write(&mut self.io).await?,
                Next::Ask(request) => {
                    // Boxed: what it takes to get an answer is over when the answer is there.
                    let answer = Box::pin(self.answered(request)).await?;
                    if answer.is_stream() {
                        self.first = false;
                        return Ok(Outcome::Stream(answer));
                    }
                    if !self.write(answer).await? {
                        return Ok(Outcome::Ended);
                    }
                }
                Next::Leave => return Ok(Outcome::NotSimple { first: self.first }),
                Next::End => return Ok(Outcome::Ended),
            }
            self.first = false;
        }
    }

    /// The connection for whoever goes on with it, and who is at its other end.
    pub(super) fn leave(self) -> (Rewind<Quiet<Socket>>, Peer) {
        (Rewind::new(self.io, self.said), self.peer)
    }

    /// The next request. Nothing is kept meanwhile: bytes are read into the stack, and moved only when they are more or less
    /// than one head.
    fn poll_next(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<Next>> {
        if !self.said.is_empty() && self.pieces == 0 {
            let said = std::mem::take(&mut self.said);
            if let Some(next) = self.take(&said) {
                return Poll::Ready(Ok(next));
            }
        }
        loop {
            let mut room = [MaybeUninit::uninit(); MAX_HEAD_BYTES];
            let mut read = ReadBuf::uninit(&mut room);
            if Pin::new(&mut self.io).poll_read(cx, &mut read)?.is_pending() {
                ready!(self.stopping.poll(cx));
                return Poll::Ready(Ok(Next::End));
            }
            if read.filled().is_empty() {
                return Poll::Ready(Ok(Next::End));
            }
            let next = if self.said.is_empty() {
                self.take(read.filled())
            } else {
                let mut said = std::mem::take(&mut self.said);
                said.extend_from_slice(read.filled());
                self.take(&said)
            };
            if let Some(next) = next {
                return Poll::Ready(Ok(next));
            }
        }
    }

    /// Takes the first request of what was said, and keeps the rest; none when more of its head must come.
    fn take(&mut self, said: &[u8]) -> Option<Next> {
        let (next, taken) = match head::read(said, |simple| self.next(simple)) {
            Head::Simple(next, taken) => {
                self.io.head_is_whole();
                (next, taken)
            }
            Head::Partial if said.len() < MAX_HEAD_BYTES && self.pieces < MOST_PIECES => {
                self.pieces += 1;
                self.said = said.to_vec();
                self.io.head_has_begun();
                return None;
            }
            Head::Partial | Head::NotSimple => (Next::Leave, 0),
        };
        self.pieces = 0;
        if taken < said.len() {
            self.said = said[taken..].to_vec();
        }
        Some(next)
    }

    fn next(&self, simple: &Simple) -> Option<Next> {
        if self.stopping.given() {
            return Some(Next::End);
        }
        if let Some(ready) = self.front.ready(simple) {
            return Some(Next::Write(ready));
        }
        simple.request().map(|request| Next::Ask(Box::new(request)))
    }
}
