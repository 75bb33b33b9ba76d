//! How is a reader told without waking its task? Its connection lays a line: whoever has something to say writes it there.

use std::fmt;

/// Bytes of a stream in, and none of them waits.
pub trait Line: fmt::Debug + Send + Sync {
    /// Takes a piece of the stream, unless somebody else writes, or nothing can be written.
    fn take(&self, piece: &[u8]) -> Taken;
}

/// How much of a piece a line has taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Taken {
    /// All of it.
    All,
    /// It has a part still to be written, by the task that reads the stream: that is to be woken.
    Begun,
    /// None of it, and nothing is known of it.
    Nothing,
}
