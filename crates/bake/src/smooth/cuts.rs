//! Where is it good to stop? Cuts of the stream at which the error has halved.
//!
//! Schmalstieg's thesis, §7.8: a few points of the stream are asked for like levels of detail. Candidates are the ends of
//! passes; where one pass takes much of the error away, as where many small parts come with it, points inside of it as well. What a
//! cut gives is found out by decoding just its bytes.

use std::ops::Range;

use belvedere_scene::smooth::{Cut, Decoder, Header, SmoothError};

use super::error::{Ruler, Surface};
use super::quantise::QuantisedMesh;

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
/// Such a part of the pass's bytes is near enough to where the error falls below what is wanted.
const INSIDE: usize = 32;
/// More cuts are not worth their bytes in the header.
const MOST_CUTS: usize = 32;
/// A decoder lags behind by what one step may take; this lets it make nearly all steps before the cut.
const LAG_BYTES: usize = 64;

/// Chooses cuts of a stream, of which `ends` has the bytes of passes. The last is the whole stream. `ruler` measures from
/// `source`, the whole mesh, at [`SAMPLES`] points.
///
/// # Errors
/// When the stream cannot be decoded.
pub(super) fn choose(
    mesh: &QuantisedMesh,
    header: &Header,
    (stream, ends): (&[u8], &[usize]),
    (source, ruler): (&Surface, &Ruler<'_>),
) -> Result<Vec<Cut>, SmoothError> {
    let mut search = Search {
        header,
        stream,
        rough_ruler: Ruler::new(source, FEW_SAMPLES),
        ruler,
        wanted: FIRST_ERROR * source.diagonal(),
        least: LEAST_ERROR * source.diagonal(),
        cuts: Vec::new(),
    };
    let mut decoder = search.decoded(0)?;
    let (mut pushed, mut looked_at) = (0, 0);
    let mut triangles = 0.0;
    for &end in ends {
        let bytes = end + LAG_BYTES;
        if bytes >= stream.len() {
            break;
        }
        decoder.push(&stream[pushed..bytes])?;
        pushed = bytes;
        if (decoder.counts().1 as f64) < triangles * NEXT_LOOK {
            continue;
        }
        triangles = decoder.counts().1 as f64;
        if let Some(error) = search.look(&decoder) {
            search.cut_inside(looked_at..bytes, error)?;
            search.cut(bytes, &decoder, error);
        }
        looked_at = bytes;
    }
    search.cut_inside(looked_at..stream.len(), 0.0)?;
    search.cuts.push(Cut {
        bytes: stream.len() as u32,
        triangles: mesh.triangles.len() as u32,
        rms_error: 0.0,
    });
    Ok(search.cuts)
}

/// The cuts so far, and what the next one must be.
struct Search<'a> {
    header: &'a Header,
    stream: &'a [u8],
    rough_ruler: Ruler<'a>,
    ruler: &'a Ruler<'a>,
    /// The most that its error may be, in steps of the lattice.
    wanted: f64,
    /// What is less is not worth cuts inside of a pass.
    least: f64,
    cuts: Vec<Cut>,
}

impl Search<'_> {
    /// What so many bytes give.
    fn decoded(&self, bytes: usize) -> Result<Decoder, SmoothError> {
        let mut decoder = Decoder::new(u64::MAX);
        decoder.push(&self.header.to_bytes())?;
        decoder.push(&self.stream[..bytes])?;
        Ok(decoder)
    }

    /// The error of a mesh if it may be that of the next cut.
    fn look(&self, decoder: &Decoder) -> Option<f64> {
        if self.cuts.len() >= MOST_CUTS {
            return None;
        }
        let (twice_positions, triangles) = decoder.geometry();
        let drawn = Surface::new(&twice_positions, triangles);
        self.rough_ruler.rms_within(&drawn, ROUGHLY * self.wanted)?;
        self.ruler.rms_within(&drawn, self.wanted)
    }

    fn cut(&mut self, bytes: usize, decoder: &Decoder, error: f64) {
        self.wanted = error / 2.0;
        self.cuts.push(Cut {
            bytes: bytes as u32,
            triangles: decoder.counts().1 as u32,
            rms_error: (error * f64::from(self.header.step)) as f32,
        });
    }

    /// Cuts wherever the error has halved before some bytes have all come, whose own error is known and stays that of a cut.
    fn cut_inside(&mut self, bytes: Range<usize>, last_error: f64) -> Result<(), SmoothError> {
        let last_error = last_error.max(self.least);
        if GAP * last_error > self.wanted {
            return Ok(());
        }
        let near = (bytes.len() / INSIDE).max(LAG_BYTES);
        let mut decoder = self.decoded(bytes.start)?;
        let mut low = bytes.start;
        while GAP * last_error <= self.wanted {
            let (mut high, mut found) = (bytes.end, None);
            while high - low > near {
                let middle = low.midpoint(high);
                let mut next = decoder.clone();
                next.push(&self.stream[low..middle])?;
                if let Some(error) = self.look(&next) {
                    (high, found) = (middle, Some((next, error)));
                } else {
                    (low, decoder) = (middle, next);
                }
            }
            let Some((next, error)) = found.filter(|(_, error)| *error >= 2.0 * last_error) else {
                break;
            };
            self.cut(high, &next, error);
            (low, decoder) = (high, next);
        }
        Ok(())
    }
}
