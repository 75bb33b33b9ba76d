//! Why is a live request not answered as asked?

use belvedere_live::{Ms, event::SessionId, motion::TrajectoryError, world::Refusal};

use belvedere_scene::Revision;

use crate::published::ReadError;

/// Why a live request is not answered as asked.
#[derive(Debug, thiserror::Error)]
pub enum LiveError {
    /// No such session, mover or door; what was looked for.
    #[error("there is no {0}")]
    NotFound(String),
    /// It is on another node, which lives.
    #[error("{0} is on another node; send each client's requests to one node, or open a new session")]
    Elsewhere(SessionId),
    /// No token was given.
    #[error("a token is needed")]
    NoToken,
    /// No token was given where only the operator's will do.
    #[error("the operator's token is needed")]
    NoOperator,
    /// The token is another one.
    #[error("the token is not that of {0}")]
    WrongToken(String),
    /// The rules refuse it.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// The keys make no trajectory.
    #[error(transparent)]
    Trajectory(#[from] TrajectoryError),
    /// Too many poses; the newest is kept.
    #[error("too many poses; the newest is kept and taken in the next tick")]
    Flooded {
        /// When the next one is welcome.
        retry_ms: Ms,
    },
    /// Doors are moved too often.
    #[error("this token moves doors too often; this one stays as it is")]
    Rattled {
        /// When it may be moved.
        retry_ms: Ms,
    },
    /// So many doors wait for the catalogue that this one would not be kept.
    #[error("the catalogue does not keep up with the doors; this one stays as it is")]
    Behind,
    /// The revision that was asked about is not the one that visitors are in.
    #[error("the scene has another revision than the one that was looked at")]
    Moved {
        /// That one.
        current: Revision,
    },
    /// The revision that was asked about cannot be read.
    #[error("the revision that was published last cannot be read; its doors stay as they are")]
    Unreadable,
    /// No room.
    #[error("there are {most} {what} already, as many as this server takes")]
    Full {
        /// Of what.
        what: &'static str,
        /// How many there may be.
        most: usize,
    },
    /// One address has its share.
    #[error(
        "this address has {most} {what} here already, as many as one may; end some, or come again when they have ended. Behind a \
         proxy all visitors have its address: let the server's settings give it all"
    )]
    Crowded {
        /// Of what.
        what: &'static str,
        /// How many there may be of one address.
        most: usize,
    },
    /// The server is about to stop, or the scene cannot be read.
    #[error("the scene's live part is not running")]
    Stopped,
    /// It was not written down that something stays, or does not any more, or cannot be read.
    #[error("the catalogue does not answer as it should: {0:#}")]
    Unkept(anyhow::Error),
    /// The published scene cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
}
