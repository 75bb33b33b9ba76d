//! What can go wrong between a client and a published scene?

use std::{path::PathBuf, time::Duration};

use belvedere_scene::{BlobName, CellId, ObjectId, SceneName, record::DecodeError};

/// Why a client cannot go on. [`Error::is_transient`] says whether trying again may help.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The base address cannot be one of a published tree.
    #[error("`{0}` is not an address of a published tree: expected http://host[:port][/path]")]
    Address(String),
    /// The address goes on after that of a tree, as a link into its viewer does.
    #[error(
        "`{address}` is a link, not the address of a published tree: leave out what begins with `?` or `#`, as in {tree}"
    )]
    Link {
        /// What was given.
        address: String,
        /// The same without what is too much.
        tree: String,
    },
    /// There is nothing at this path.
    #[error("there is nothing at {0}")]
    Missing(String),
    /// What the pointer of a scene names is gone, also past all caches that can be passed.
    #[error(
        "the pointer of `{scene}` names {path}, which is not there: a cache on the way holds an old pointer, or the tree was copied in part"
    )]
    Stale {
        /// The scene.
        scene: SceneName,
        /// Path below the base address.
        path: String,
    },
    /// The server answers, but not this request: it must not, or knows none like it.
    #[error("the server refuses {path} with status {status}")]
    Refused {
        /// Path below the base address.
        path: String,
        /// The status of HTTP, from 400 on.
        status: u16,
    },
    /// The server did not answer, or not with success.
    #[error("cannot fetch {path}: {cause}")]
    Fetch {
        /// Path below the base address.
        path: String,
        /// What happened.
        cause: String,
    },
    /// The server has no time for it, and says for how long.
    #[error("the server has no time for {path} (status {status}) before {} s have passed", after.as_secs())]
    Busy {
        /// Path below the base address.
        path: String,
        /// The status of HTTP.
        status: u16,
        /// How long to wait before it is asked again.
        after: Duration,
    },
    /// It could not be had before, and was not asked for again.
    #[error("{cause} (not asked for again)")]
    GivenUp {
        /// What happened then.
        cause: String,
        /// Whether that was for a reason that passes.
        passes: bool,
    },
    /// A folder for what was fetched cannot be used.
    #[error("cannot keep what is fetched in {}: {cause}", folder.display())]
    Cache {
        /// The folder.
        folder: PathBuf,
        /// Why not.
        cause: std::io::Error,
    },
    /// The bytes are not those that the name promises.
    #[error("{path} arrived damaged: its bytes do not have the hash in its name", path = .0.url())]
    Corrupt(BlobName),
    /// What travelled compressed cannot be unpacked.
    #[error("{path} arrived damaged: {cause}")]
    Garbled {
        /// Path below the base address.
        path: String,
        /// What does not fit.
        cause: String,
    },
    /// More came than there can be, or was announced; it was not read to its end.
    #[error("{path} was answered with more than {most_bytes} bytes, which is all that it may have")]
    TooLong {
        /// Path below the base address.
        path: String,
        /// So many it has, or no document has more.
        most_bytes: u64,
    },
    /// The server does not keep to ranges: it answers with something else than the part that was asked for.
    #[error("a part of {path} was answered {cause}, so this server is asked for no more parts")]
    Range {
        /// Path below the base address.
        path: String,
        /// What came instead.
        cause: String,
    },
    /// The server answers a part with all of it: so what is not needed whole is not asked for.
    #[error(
        "a part of {path} was answered with all of it, so this server is asked for no more parts; levels take the place of smooth LODs",
        path = .0.url()
    )]
    Whole(BlobName),
    /// A document is not of the published format.
    #[error("{path} is not what this client reads: {cause}")]
    Document {
        /// Path below the base address.
        path: String,
        /// What does not fit.
        cause: String,
    },
    /// The scene is published in another version of the format.
    #[error("the scene is of format {found}; this client reads format {known}: update the client, or bake again")]
    Format {
        /// The version in the manifest.
        found: u32,
        /// The version that this build reads.
        known: u32,
    },
    /// A cell record, or the steps from one, are damaged.
    #[error("record or steps of {cell}: {cause}")]
    Record {
        /// The cell.
        cell: CellId,
        /// What is wrong.
        cause: DecodeError,
    },
    /// The index names no chunk for an object, or the chunk lacks it.
    #[error("the scene's index does not lead to {0}")]
    NotIndexed(ObjectId),
    /// A part of the index of cells is lost: one may be in a cell of which nobody knows.
    #[error(
        "a part of the map of cells cannot be had, what can be seen from the nearest known place is shown instead: {cause}"
    )]
    Unmapped {
        /// Why it cannot be had.
        cause: String,
    },
    /// No part of the index of cells can be had, so that nobody knows where one can go.
    #[error("no part of the map of cells can be had: {cause}")]
    Uncharted {
        /// Why it cannot be had.
        cause: String,
    },
    /// Memory does not hold even the coarsest of what can be seen from a cell and from its neighbours.
    #[error(
        "the coarsest levels of {cell} and the cells next door take {needed_bytes} bytes of memory where no rules stand in for them, \
         {limit_bytes} are allowed; raise the limit"
    )]
    MemoryShort {
        /// The cell.
        cell: CellId,
        /// What that takes.
        needed_bytes: u64,
        /// What is allowed.
        limit_bytes: u64,
    },
    /// A smooth LOD is not what its name promises, as its last piece shows.
    #[error("the rungs of {path} are not the bytes that its name promises; levels take its place", path = .0.url())]
    Stream(BlobName),
    /// The server answers with another length than was asked for.
    #[error("{path} was answered with {found} bytes instead of {expected}")]
    Length {
        /// Path below the base address.
        path: String,
        /// What came.
        found: u64,
        /// What was asked for.
        expected: u64,
    },
    /// What needs a live session was asked for while none was open.
    #[error("no live session is open")]
    NoSession,
    /// The index leads to no such cell.
    #[error("the scene's index does not lead to {0}")]
    NoCell(CellId),
    /// The scene has no cells; a publisher never writes that.
    #[error("the scene has no cells")]
    NoCells,
}

impl Error {
    /// Whether the same request may succeed later.
    #[must_use]
    pub fn is_transient(&self) -> bool {
        self.passes() || self.is_damage()
    }

    /// Whether it failed for a reason that passes by itself: a server that is silent, busy or out of order. What it holds damaged
    /// stays so until somebody sees to it.
    pub(crate) fn passes(&self) -> bool {
        matches!(
            self,
            Self::Fetch { .. } | Self::Busy { .. } | Self::Length { .. } | Self::GivenUp { passes: true, .. }
        )
    }

    /// Whether something came, and not as it was sent.
    pub(crate) fn is_damage(&self) -> bool {
        matches!(self, Self::Corrupt(_) | Self::Garbled { .. } | Self::TooLong { .. })
    }
}
