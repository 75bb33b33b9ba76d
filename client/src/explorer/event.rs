//! How does an explorer go about it, and what does it say?

use belvedere_scene::{CellId, ModelId, Revision};

use crate::{
    Error,
    strategy::{grade::Grade, order::Budgets},
};

/// How an explorer goes about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExplorerOptions {
    /// Memory, triangles, how fine, and whether ahead.
    pub budgets: Budgets,
    /// Whether smooth LODs are used where they cost less than levels.
    pub smooth: bool,
    /// Whether models are grown here, out of rules, where that costs less than levels: for programs that draw
    /// [`crate::Geometry::Rules`]. What is in sight may then stand there before its entry was read, and is drawn at its finest.
    pub rules: bool,
    /// Whether small files come together where the server offers that.
    pub bundles: bool,
    /// Whether what failed for a reason that passes, as a server that is silent, is tried again by itself: after 5, 10, 20 … 60 s.
    /// [`crate::Explorer::advance`] then waits for that too.
    pub recovers: bool,
}

impl Default for ExplorerOptions {
    /// Everything but rules, within 256 MB.
    fn default() -> Self {
        let budgets = Budgets {
            memory_bytes: 256_000_000,
            ..Budgets::default()
        };
        Self {
            budgets,
            smooth: true,
            rules: false,
            bundles: true,
            recovers: true,
        }
    }
}

/// What has happened.
#[derive(Debug)]
pub enum Event {
    /// What can be seen from this cell is what counts now.
    Entered(CellId),
    /// A model can be drawn so from now on; [`crate::Explorer::mesh`] gives it.
    Drawn {
        /// The model.
        model: ModelId,
        /// Its level or rung.
        grade: Grade,
        /// Why it was fetched.
        why: String,
    },
    /// A model was drawn more coarsely again, for want of memory; [`crate::Explorer::mesh`] gives it.
    Blunted(ModelId),
    /// Nothing of a model is held any more.
    Dropped(ModelId),
    /// Something could not be had; the walk goes on with what is there.
    Problem(Error),
    /// The scene is published in this revision now; told once. The walk goes on with what is left of its own;
    /// [`crate::Explorer::successor`] leads to the other.
    Superseded(Revision),
}
