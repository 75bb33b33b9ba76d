//! Where is it good to stop? Cuts of the stream at which the error has halved.
//!
//! Schmalstieg's thesis, §7.8: a few points of the stream are asked for like levels of detail. Candidates are the ends of
//! passes; where one pass takes much of the error away, as where many small parts come with it, points inside of it as well.

use std::ops::Range;

use belvedere_scene::smooth::Cut;
use belvedere_scene::smooth::course::Course;

use super::error::{Ruler, Surface, Watch};
use super::prefix::Prefix;

/// Points on each surface when errors are measured, and for a first impression.
pub(super) const SAMPLES: usize = 600;
const FEW_SAMPLES: usize = 100;
/// A first impression may be so much too large.
const ROUGHLY: f64 = 1.25;
/// No look is taken before there are so many times the triangles of the last one.
const NEXT_LOOK: f64 = 1.15;
/// The first cut has at most this error, of the box's diagonal.
const FIRST_ERROR: f64 = 0.06;
/// Cuts are looked for inside of a pass where its end has so many times less than the error that is wanted next.
const GAP: f64 = 4.0;
/// What stands for a smaller error there, of the box's diagonal: so little is not worth cuts inside of a pass.
const LEAST_ERROR: f64 = 0.002;
/// No cut comes after one with less than this, in steps of the lattice, but the whole: what is flat has none long before.
const NO_ERROR: f64 = 1e-3;
/// Such a part of the pass's bytes is near enough to where the error falls below what is wanted.
const INSIDE: usize = 32;
/// More cuts are not worth their bytes in the header.
const MOST_CUTS: usize = 32;
/// A decoder lags behind by what one step may take; this lets it make nearly all steps before the cut.
const LAG_BYTES: usize = 64;

/// A stream that was written.
pub(super) struct Written<'a> {
    pub(super) bytes: usize,
    pub(super) course: &'a Course,
    /// The mesh before anything of it has come.
    pub(super) beginning: Prefix<'a>,
    /// The lattice's step, in model-space units.
    pub(super) step: f32,
}

/// Chooses cuts of a stream. The last is the whole stream. `ruler` measures from `source`, the whole mesh, at [`SAMPLES`] points.
pub(super) fn choose(stream: &Written<'_>, (source, ruler): (&Surface, &Ruler<'_>)) -> Vec<Cut> {
    let rough = Ruler::new(source, FEW_SAMPLES);
    let mut search = Search {
        stream,
        rough: Watch::new(&rough),
        fine: Watch::new(ruler),
        wanted: FIRST_ERROR * source.diagonal(),
        least: LEAST_ERROR * source.diagonal(),
        cuts: Vec::new(),
    };
    let mut prefix = stream.beginning.clone();
    let mut looked_at = 0;
    let mut triangles = 0.0;
    for end in &stream.course.passes {
        let bytes = end + LAG_BYTES;
        if bytes >= stream.bytes {
            break;
        }
        prefix.go_on(stream.course.told(bytes));
        if (prefix.triangles() as f64) < triangles * NEXT_LOOK {
            continue;
        }
        triangles = prefix.triangles() as f64;
        if let Some(error) = search.look(&prefix) {
            search.cut_inside(looked_at..bytes, error);
            search.cut(bytes, prefix.triangles(), error);
        }
        looked_at = bytes;
    }
    search.cut_inside(looked_at..stream.bytes, 0.0);
    search.cut(stream.bytes, source.shapes.len(), 0.0);
    search.cuts
}

/// The cuts so far, and what the next one must be.
struct Search<'a> {
    stream: &'a Written<'a>,
    rough: Watch<'a>,
    fine: Watch<'a>,
    /// The most that its error may be, in steps of the lattice.
    wanted: f64,
    /// What is less is not worth cuts inside of a pass.
    least: f64,
    cuts: Vec<Cut>,
}

impl Search<'_> {
    /// The error of a mesh if it may be that of the next cut.
    fn look(&mut self, prefix: &Prefix<'_>) -> Option<f64> {
        if self.cuts.len() >= MOST_CUTS || 2.0 * self.wanted < NO_ERROR {
            return None;
        }
        let drawn = prefix.surface();
        let source_triangle = |triangle| prefix.source_triangle(triangle);
        let roughly = ROUGHLY * self.wanted;
        self.rough.rms_within(&drawn, roughly, source_triangle)?;
        self.fine.rms_within(&drawn, self.wanted, source_triangle)
    }

    fn cut(&mut self, bytes: usize, triangles: usize, error: f64) {
        self.wanted = error / 2.0;
        self.cuts.push(Cut {
            bytes: bytes as u32,
            triangles: triangles as u32,
            rms_error: (error * f64::from(self.stream.step)) as f32,
        });
    }

    /// Cuts wherever the error has halved before some bytes have all come, whose own error is known and stays that of a cut.
    fn cut_inside(&mut self, bytes: Range<usize>, last_error: f64) {
        let last_error = last_error.max(self.least);
        if GAP * last_error > self.wanted {
            return;
        }
        let near = (bytes.len() / INSIDE).max(LAG_BYTES);
        let mut prefix = self.stream.beginning.clone();
        prefix.go_on(self.stream.course.told(bytes.start));
        let mut low = bytes.start;
        while GAP * last_error <= self.wanted {
            let (mut high, mut found) = (bytes.end, None);
            while high - low > near {
                let middle = low.midpoint(high);
                let mut next = prefix.clone();
                next.go_on(self.stream.course.told(middle));
                if let Some(error) = self.look(&next) {
                    (high, found) = (middle, Some((next, error)));
                } else {
                    (low, prefix) = (middle, next);
                }
            }
            let Some((next, error)) = found.filter(|(_, error)| *error >= 2.0 * last_error) else {
                break;
            };
            self.cut(high, next.triangles(), error);
            (low, prefix) = (high, next);
        }
    }
}
