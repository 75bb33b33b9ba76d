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
use tokio::{
    io::{AsyncRead, ReadBuf},
    runtime::Handle,
};

pub(super) use self::{
    body::Answer,
    head::Simple,
    rewind::Rewind,
    socket::Socket,
    wire::{Ready, head_lines},
};
use self::{
    head::{Head, MAX_HEAD_BYTES},
    wire::Unsent,
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
    /// Where the router answers.
    shared: Handle,
    first: bool,
}

/// What is to be done next.
enum Next {
    /// Write the rest of an object.
    Write(Box<Unsent>),
    /// Ask the router.
    Ask(Box<Request<Body>>),
    /// Leave it to hyper.
    Leave,
    /// The peer, or the server, has come to an end.
    End,
    /// The peer does not take what is written.
    Broken(io::Error),
}

/// What has come of what was said.
enum Taken {
    /// An object, which has been written.
    Written,
    /// Half a head.
    Partial,
    Next(Next),
}

impl Direct {
    pub(super) fn new(io: Quiet<Socket>, front: Front, peer: Peer, stopping: Heard, shared: Handle) -> Self {
        Self {
            io,
            said: Vec::new(),
            pieces: 0,
            front,
            peer,
            stopping,
            shared,
            first: true,
        }
    }

    /// Answers until the connection ends, something is not simple, or an answer may take long.
    pub(super) async fn talk(&mut self) -> io::Result<Outcome> {
        loop {
            match poll_fn(|cx| self.poll_next(cx)).await? {
                Next::Write(rest) => rest.write(&mut self.io).await?,
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
                Next::Broken(error) => return Err(error),
            }
            self.first = false;
        }
    }

    /// The connection for whoever goes on with it, on the runtime where this is called, and who is at its other end.
    pub(super) async fn leave(self) -> io::Result<(Rewind<Quiet<Socket>>, Peer)> {
        let mut io = self.io.moved(Socket::moved)?;
        // That it can be written to is told anew, and hyper gives up on some requests when it must wait for that.
        poll_fn(|cx| io.poll_ready(cx, Socket::poll_writable)).await?;
        Ok((Rewind::new(io, self.said), self.peer))
    }

    /// The next request. Nothing is kept meanwhile: bytes are read into the stack, and moved only when they are more or less
    /// than one head.
    fn poll_next(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<Next>> {
        loop {
            let taken = if self.said.is_empty() || self.pieces > 0 {
                ready!(self.poll_said(cx))?
            } else {
                let said = std::mem::take(&mut self.said);
                self.take(&said)
            };
            match taken {
                Taken::Written => self.first = false,
                Taken::Partial => {}
                Taken::Next(next) => return Poll::Ready(Ok(next)),
            }
        }
    }

    /// What comes of the next bytes.
    fn poll_said(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<Taken>> {
        let mut room = [MaybeUninit::uninit(); MAX_HEAD_BYTES];
        let mut read = ReadBuf::uninit(&mut room);
        if Pin::new(&mut self.io).poll_read(cx, &mut read)?.is_pending() {
            ready!(self.stopping.poll(cx));
            return Poll::Ready(Ok(Taken::Next(Next::End)));
        }
        if read.filled().is_empty() {
            return Poll::Ready(Ok(Taken::Next(Next::End)));
        }
        if self.said.is_empty() {
            return Poll::Ready(Ok(self.take(read.filled())));
        }
        let mut said = std::mem::take(&mut self.said);
        said.extend_from_slice(read.filled());
        Poll::Ready(Ok(self.take(&said)))
    }

    /// Takes the first request of what was said, and keeps the rest.
    fn take(&mut self, said: &[u8]) -> Taken {
        let (taken, length) = match head::read(said, |simple| self.answer_now(simple)) {
            Head::Simple(taken, length) => {
                self.io.head_is_whole();
                (taken, length)
            }
            Head::Partial if said.len() < MAX_HEAD_BYTES && self.pieces < MOST_PIECES => {
                self.pieces += 1;
                self.said = said.to_vec();
                self.io.head_has_begun();
                return Taken::Partial;
            }
            Head::Partial | Head::NotSimple => (Taken::Next(Next::Leave), 0),
        };
        self.pieces = 0;
        if length < said.len() {
            self.said = said[length..].to_vec();
        }
        taken
    }

    /// Answers a request, if that needs no waiting; none when it cannot be handed to the router.
    fn answer_now(&mut self, simple: &Simple) -> Option<Taken> {
        if self.stopping.given() {
            return Some(Taken::Next(Next::End));
        }
        let io = &mut self.io;
        let written = self.front.ready(simple, &self.peer, |ready| {
            ready.write(|slices| io.write_now(|socket| socket.write_now(slices)))
        });
        let next = match written {
            Some(Ok(None)) => return Some(Taken::Written),
            Some(Ok(Some(rest))) => Next::Write(rest),
            Some(Err(error)) => Next::Broken(error),
            None => Next::Ask(Box::new(simple.request()?)),
        };
        Some(Taken::Next(next))
    }
}
