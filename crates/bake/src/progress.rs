//! How far is the bake? The bake says what it does; whoever called it shows that, times it, or stops it.

use std::fmt;

/// The stages of a bake, in order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Reading the source.
    Import,
    /// Finding what hides.
    Occluders,
    /// Cutting free space into view cells.
    Cells,
    /// Looking from each of them, to see which are worth having.
    Glance,
    /// Making levels of detail.
    Lod,
    /// A first look at what each cell sees.
    Preview,
    /// Looking from some cells, to see where proofs hide anything.
    Trial,
    /// Making smooth levels of detail.
    Smooth,
    /// Drawing pictures for far away.
    Impostors,
    /// Computing each cell's visible set.
    Visibility,
    /// Writing records and storing everything.
    Publish,
}

impl Stage {
    /// Its name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Import => "import",
            Self::Occluders => "occluders",
            Self::Cells => "cells",
            Self::Glance => "glance",
            Self::Lod => "lod",
            Self::Preview => "preview",
            Self::Trial => "trial",
            Self::Smooth => "smooth",
            Self::Impostors => "impostors",
            Self::Visibility => "visibility",
            Self::Publish => "publish",
        }
    }
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Hears how far the bake is. Called from many threads.
pub trait Progress: Sync {
    /// A stage starts and has this many steps of about equal cost.
    fn start(&self, stage: Stage, steps: u64);
    /// Some steps are done.
    fn advance(&self, steps: u64);
    /// A stage to come will have this many steps.
    fn expect(&self, _stage: Stage, _steps: u64) {}
    /// Whether the caller wants to stop. Asked before each step.
    fn cancelled(&self) -> bool {
        false
    }
}

/// Hears nothing.
#[derive(Debug, Clone, Copy)]
pub struct Silent;

impl Progress for Silent {
    fn start(&self, _: Stage, _: u64) {}
    fn advance(&self, _: u64) {}
}

/// Hears nothing of what is done within a step, but whether the caller wants to stop.
#[derive(Clone, Copy)]
pub(crate) struct Within<'a>(pub(crate) &'a dyn Progress);

impl Progress for Within<'_> {
    fn start(&self, _: Stage, _: u64) {}
    fn advance(&self, _: u64) {}
    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}

/// Counts the steps that are announced, and those that are made.
#[cfg(test)]
#[derive(Default)]
pub(crate) struct Counted {
    pub(crate) announced: std::sync::atomic::AtomicU64,
    pub(crate) made: std::sync::atomic::AtomicU64,
}

#[cfg(test)]
impl Progress for Counted {
    fn start(&self, _: Stage, steps: u64) {
        self.announced.fetch_add(steps, std::sync::atomic::Ordering::Relaxed);
    }
    fn advance(&self, steps: u64) {
        self.made.fetch_add(steps, std::sync::atomic::Ordering::Relaxed);
    }
}

/// The caller asked to stop, so there is no result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;
