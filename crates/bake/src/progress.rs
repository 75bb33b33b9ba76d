//! How far is the bake? The bake says what it does; whoever called it shows that, times it, or stops it.

use std::{
    fmt,
    sync::atomic::{AtomicU64, Ordering},
};

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

/// Work that is some of a stage's steps, whatever steps it takes by itself: nobody knew of these when the stage began. Where it is left,
/// all of it is done.
pub(crate) struct Portion<'a> {
    progress: &'a dyn Progress,
    /// Steps of the stage.
    share: u64,
    /// Steps of the work …
    work: u64,
    /// … and how many are done.
    done: AtomicU64,
}

impl<'a> Portion<'a> {
    /// So many steps of a stage for so many of the work.
    pub(crate) fn of(progress: &'a dyn Progress, share: u64, work: u64) -> Self {
        Self {
            progress,
            share,
            work,
            done: AtomicU64::new(0),
        }
    }

    /// Steps of the stage that are done with so many of the work.
    fn told(&self, done: u64) -> u64 {
        let told = u128::from(self.share) * u128::from(done.min(self.work)) / u128::from(self.work.max(1));
        told as u64
    }
}

impl Progress for Portion<'_> {
    fn start(&self, _: Stage, _: u64) {}

    fn advance(&self, steps: u64) {
        let before = self.done.fetch_add(steps, Ordering::Relaxed);
        let steps = self.told(before + steps) - self.told(before);
        if steps > 0 {
            self.progress.advance(steps);
        }
    }

    fn cancelled(&self) -> bool {
        self.progress.cancelled()
    }
}

impl Drop for Portion<'_> {
    fn drop(&mut self) {
        let done = self.told(self.done.load(Ordering::Relaxed));
        self.progress.advance(self.share - done);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_portion_makes_its_steps_of_the_stage_as_its_own_work_goes_on_and_the_rest_at_its_end() {
        for (share, work, steps) in [(10, 3, 1), (10, 1000, 7), (3, 1000, 1), (5, 0, 0), (7, 100, 1)] {
            let counted = Counted::default();
            let made = || counted.made.load(Ordering::Relaxed);
            let portion = Portion::of(&counted, share, work);
            for done in 1..=work / steps.max(1) / 2 {
                portion.advance(steps);
                assert_eq!(made(), share * done * steps / work);
            }
            drop(portion);
            assert_eq!(made(), share);
        }
    }
}
