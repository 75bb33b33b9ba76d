//! How is a reader told without waking its task? Its connection lays a line: whoever has something to say writes it there.

use std::{
    fmt, io,
    sync::{
        MutexGuard,
        atomic::{AtomicBool, Ordering},
    },
};

use socket2::SockRef;

/// Bytes of a stream in, and none of them waits.
pub trait Line: fmt::Debug + Send + Sync {
    /// The way into the connection, for whoever wants to write a chunk; none while it is not free.
    fn hold(&self) -> Option<Held<'_>>;

    /// Appends a piece of the stream, given in parts, as a chunk of what goes over the wire.
    fn frame(&self, piece: &[&[u8]], wire: &mut Vec<u8>);
}

/// Whose turn it is to write to a connection.
#[derive(Debug)]
pub enum Turn {
    /// The task's.
    Task,
    /// Anybody's.
    Free,
    /// The task's, as soon as it hears of it, with this before all else.
    Rest(Vec<u8>),
}

/// A free way into a connection: nobody else writes while it is held.
#[derive(Debug)]
pub struct Held<'a> {
    turn: MutexGuard<'a, Turn>,
    socket: SockRef<'a>,
    others_wrote: &'a AtomicBool,
}

/// How much of a chunk a line has taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Taken {
    /// All of it.
    All,
    /// It has a part still to be written, by the task that reads the stream: that is to be woken.
    Begun,
    /// None of it, and nothing is known of it.
    Nothing,
}

impl<'a> Held<'a> {
    /// None when the turn is not free. `others_wrote` is set as soon as something has been written.
    #[must_use]
    pub fn if_free(turn: MutexGuard<'a, Turn>, socket: SockRef<'a>, others_wrote: &'a AtomicBool) -> Option<Self> {
        matches!(*turn, Turn::Free).then_some(Self {
            turn,
            socket,
            others_wrote,
        })
    }

    pub(crate) fn socket(&self) -> &SockRef<'a> {
        &self.socket
    }

    /// Takes note of how much of a chunk was sent. Whatever went wrong, the task finds it too.
    pub(crate) fn has_sent(mut self, sent: &io::Result<usize>, chunk: &[u8]) -> Taken {
        let Ok(sent) = *sent else {
            return Taken::Nothing;
        };
        self.others_wrote.store(true, Ordering::Relaxed);
        if sent == chunk.len() {
            return Taken::All;
        }
        *self.turn = Turn::Rest(chunk[sent..].to_vec());
        Taken::Begun
    }
}
