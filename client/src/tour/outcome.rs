//! What became of a tour? Frame by frame, and in sum over many visitors.

use belvedere_scene::{CellId, Revision};
use serde::Serialize;

use crate::{Error, strategy::residency::Residency, whereabouts::NOWHERE};

/// A moment of a tour.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Frame {
    /// Scripted time, milliseconds.
    pub t_ms: f64,
    /// The share of the objects that can be seen from the visitor's cell of which a level is there (download quality).
    pub quality: f64,
    /// How many of them have nothing there.
    pub missing: u32,
    /// Whether some of these found no room in memory.
    pub is_short: bool,
    /// Whether nobody knows what can be seen. What counts is then all that is around, and one more.
    pub unknown: bool,
    /// Bytes that have come so far.
    pub bytes: u64,
    /// The share of these objects that are as sharp as the eye can tell.
    pub sharp: f64,
    /// The share that is drawn by rungs of smooth LODs; what else is there is drawn by levels.
    pub rungs: f64,
}

/// What became of one visitor.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Tour {
    /// In order of time.
    pub frames: Vec<Frame>,
    /// When all that can be seen from where one was had come for the first time, if it did: from the first cell, or from a later one.
    pub converged_ms: Option<f64>,
    /// Why bytes came.
    pub bytes: Causes,
    /// How bytes came.
    pub ways: Ways,
    /// What memory did.
    pub memory: Memory,
    /// Requests.
    pub requests: u64,
    /// Files that could not be had or read, documents included, each once however often it was asked for.
    pub lost_files: u64,
    /// What went wrong first, with reasons.
    pub first_failures: Vec<String>,
    /// The revision that took the place of this one meanwhile, as was found when something of this one was gone.
    pub newer_revision: Option<Revision>,
    /// What requests really took, in milliseconds.
    pub latencies_ms: Vec<f64>,
}

/// So many failures are told with their reasons.
const TOLD: usize = 5;

impl Tour {
    /// Tells what went wrong, unless that was told before.
    pub(super) fn tell(&mut self, cause: &Error) {
        if !matches!(cause, Error::GivenUp { .. }) && self.first_failures.len() < TOLD {
            self.first_failures.push(cause.to_string());
        }
    }
}

/// Why bytes came.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Causes {
    /// For what could be seen when they were asked for, and documents.
    pub needed: u64,
    /// Ahead, and seen later.
    pub prefetched_used: u64,
    /// Ahead, and never seen.
    pub prefetched_wasted: u64,
    /// In vain: cut, damaged, of another length than they should have, or not asked for and without use.
    pub failed: u64,
}

/// Requests and the bytes that came with them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Way {
    /// Requests.
    pub requests: u64,
    /// Bytes of their answers, as they travelled.
    pub bytes: u64,
}

/// How bytes came.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Ways {
    /// Documents: where cells and objects are, and what there is of them.
    pub document_bytes: u64,
    /// Files alone.
    pub alone: Way,
    /// Coarsest levels in packs.
    pub packs: Way,
    /// Small files together.
    pub bundles: Way,
    /// How many files came in bundles.
    pub bundled_files: u64,
}

impl Ways {
    fn and(self, other: Self) -> Self {
        let both = |of: fn(&Self) -> Way| Way {
            requests: of(&self).requests + of(&other).requests,
            bytes: of(&self).bytes + of(&other).bytes,
        };
        Self {
            document_bytes: self.document_bytes + other.document_bytes,
            alone: both(|ways| ways.alone),
            packs: both(|ways| ways.packs),
            bundles: both(|ways| ways.bundles),
            bundled_files: self.bundled_files + other.bundled_files,
        }
    }
}

/// What memory did; of all visitors, the most of each, or the sum of what went.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Memory {
    /// The most that was held and on its way at once, bytes.
    pub peak_bytes: u64,
    /// What the coarsest of all that can be seen from a cell and from its known neighbours takes at most, bytes.
    pub needed_bytes: u64,
    /// The cell of which that is so; none where nobody knows the cell.
    pub needed_in: Option<CellId>,
    /// Bytes that went for want of memory …
    pub evicted_bytes: u64,
    /// … and were fetched again.
    pub again_bytes: u64,
    /// Bytes of these that went although the cell or one adjacent to it saw what they were drawn with, and has seen it since.
    pub cycle_bytes: u64,
    /// Cells for which memory does not suffice.
    pub short_cells: u64,
    /// Objects in sight of which nothing was there in frames in which some of them found no room, summed over all frames.
    pub missing: u64,
}

impl Memory {
    /// Takes note of what a cell and its neighbours take.
    pub(super) fn needs(&mut self, cell: CellId, bytes: u64) {
        if bytes > self.needed_bytes {
            (self.needed_bytes, self.needed_in) = (bytes, Some(cell).filter(|cell| *cell != NOWHERE));
        }
    }

    pub(super) fn of(residency: &Residency, needed: Self, short_cells: u64, frames: &[Frame]) -> Self {
        let short = frames.iter().filter(|frame| frame.is_short);
        let evictions = residency.evictions();
        Self {
            peak_bytes: residency.peak_bytes(),
            needed_bytes: needed.needed_bytes,
            needed_in: needed.needed_in,
            evicted_bytes: evictions.bytes,
            again_bytes: evictions.again_bytes,
            cycle_bytes: evictions.cycle_bytes,
            short_cells,
            missing: short.map(|frame| u64::from(frame.missing)).sum(),
        }
    }

    fn and(self, other: Self) -> Self {
        let needs_most = if other.needed_bytes > self.needed_bytes {
            other
        } else {
            self
        };
        Self {
            peak_bytes: self.peak_bytes.max(other.peak_bytes),
            needed_bytes: needs_most.needed_bytes,
            needed_in: needs_most.needed_in,
            evicted_bytes: self.evicted_bytes + other.evicted_bytes,
            again_bytes: self.again_bytes + other.again_bytes,
            cycle_bytes: self.cycle_bytes + other.cycle_bytes,
            short_cells: self.short_cells + other.short_cells,
            missing: self.missing + other.missing,
        }
    }
}

/// Download quality over frames, 0 to 1; null where there is no frame.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Quality {
    /// The worst frame.
    pub min: Option<f64>,
    /// The mean of all frames.
    pub mean: Option<f64>,
    /// One frame of twenty is worse.
    pub p5: Option<f64>,
}

/// Milliseconds of real requests.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Latency {
    /// Half of them took less.
    pub p50: f64,
    /// One of a hundred took more.
    pub p99: f64,
}

/// What became of all visitors.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outcome {
    /// Visitors.
    pub sessions: u64,
    /// Frames of all of them.
    pub frames: u64,
    /// Over the frames after each visitor's convergence.
    pub quality: Quality,
    /// The share of objects that are as sharp as the eye can tell, mean over those frames; null where there is none.
    pub sharp: Option<f64>,
    /// The share that is drawn by rungs of smooth LODs, likewise; what else is there is drawn by levels.
    pub drawn_by_rungs: Option<f64>,
    /// Objects in sight of which nothing was there, summed over those frames.
    pub holes: u64,
    /// Frames of which nobody knows what can be seen.
    pub unknown_frames: u64,
    /// Of all visitors.
    pub bytes: Causes,
    /// How bytes came, of all visitors.
    pub came: Ways,
    /// What memory did.
    pub memory: Memory,
    /// The mean over visitors of how long it took until all in sight was there for the first time; null when one never had it.
    pub convergence_s: Option<f64>,
    /// Of all visitors.
    pub requests: u64,
    /// Files that could not be had or read, documents included, each once for each visitor.
    pub lost_files: u64,
    /// What went wrong first, with reasons.
    pub first_failures: Vec<String>,
    /// The revision that took the place of the one that was walked through, as a visitor found who missed something of it.
    pub newer_revision: Option<Revision>,
    /// Of all requests.
    pub latency_ms: Latency,
}

impl Outcome {
    /// Sums up.
    #[must_use]
    pub fn of(tours: &[Tour]) -> Self {
        let settled = |tour: &Tour| {
            let from_ms = tour.converged_ms.unwrap_or(f64::INFINITY);
            let frames = tour.frames.iter().filter(move |frame| frame.t_ms >= from_ms);
            frames.copied().collect::<Vec<_>>()
        };
        let mut frames: Vec<Frame> = tours.iter().flat_map(settled).collect();
        frames.sort_by(|a, b| a.quality.total_cmp(&b.quality));
        let sum = |of: fn(&Tour) -> u64| tours.iter().map(of).sum::<u64>();
        let converged: Option<Vec<f64>> = tours.iter().map(|tour| tour.converged_ms).collect();
        let mut latencies_ms: Vec<f64> = tours
            .iter()
            .flat_map(|tour| tour.latencies_ms.iter().copied())
            .collect();
        latencies_ms.sort_by(f64::total_cmp);
        Self {
            sessions: tours.len() as u64,
            frames: sum(|tour| tour.frames.len() as u64),
            quality: Quality {
                min: frames.first().map(|frame| frame.quality),
                mean: mean(frames.iter().map(|frame| frame.quality)),
                p5: at_share(&frames, 0.05).map(|frame| frame.quality),
            },
            sharp: mean(frames.iter().map(|frame| frame.sharp)),
            drawn_by_rungs: mean(frames.iter().map(|frame| frame.rungs)),
            came: tours.iter().fold(Ways::default(), |all, tour| all.and(tour.ways)),
            memory: tours.iter().fold(Memory::default(), |all, tour| all.and(tour.memory)),
            unknown_frames: sum(|tour| tour.frames.iter().filter(|frame| frame.unknown).count() as u64),
            holes: frames.iter().map(|frame| u64::from(frame.missing)).sum(),
            bytes: Causes {
                needed: sum(|tour| tour.bytes.needed),
                prefetched_used: sum(|tour| tour.bytes.prefetched_used),
                prefetched_wasted: sum(|tour| tour.bytes.prefetched_wasted),
                failed: sum(|tour| tour.bytes.failed),
            },
            convergence_s: converged
                .and_then(|all| mean(all.into_iter()))
                .map(|mean_ms| mean_ms / 1000.0),
            requests: sum(|tour| tour.requests),
            lost_files: sum(|tour| tour.lost_files),
            newer_revision: tours.iter().find_map(|tour| tour.newer_revision),
            first_failures: tours
                .iter()
                .flat_map(|tour| &tour.first_failures)
                .take(TOLD)
                .cloned()
                .collect(),
            latency_ms: Latency {
                p50: at_share(&latencies_ms, 0.5).unwrap_or(0.0),
                p99: at_share(&latencies_ms, 0.99).unwrap_or(0.0),
            },
        }
    }
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> Option<f64> {
    let count = values.len();
    (count > 0).then(|| values.sum::<f64>() / count as f64)
}

/// What such a share of sorted things is below of.
fn at_share<T: Copy>(sorted: &[T], share: f64) -> Option<T> {
    let last = sorted.len().checked_sub(1)?;
    sorted.get((share * last as f64).round() as usize).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_before_convergence_do_not_count_and_who_never_converges_is_told() {
        let frame = |t_ms: f64, quality: f64, missing: u32| Frame {
            t_ms,
            quality,
            missing,
            is_short: false,
            unknown: false,
            bytes: 0,
            sharp: 0.0,
            rungs: 0.0,
        };
        let tour = Tour {
            frames: vec![frame(0.0, 0.0, 9), frame(100.0, 1.0, 0), frame(200.0, 0.5, 2)],
            converged_ms: Some(60.0),
            latencies_ms: vec![3.0, 1.0],
            ..Tour::default()
        };
        let outcome = Outcome::of(std::slice::from_ref(&tour));
        assert_eq!((outcome.frames, outcome.holes), (3, 2));
        assert_eq!((outcome.quality.min, outcome.quality.mean), (Some(0.5), Some(0.75)));
        assert_eq!(outcome.convergence_s, Some(0.06));
        let never = Tour {
            converged_ms: None,
            ..tour.clone()
        };
        assert_eq!(Outcome::of(&[tour, never]).convergence_s, None);
    }
}
