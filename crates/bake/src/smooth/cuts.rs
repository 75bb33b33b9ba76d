//! Where is it good to stop? Cuts of the stream at which the error has halved.
//!
//! Schmalstieg's thesis, §7.8: a few points of the stream are asked for like levels of detail. Candidates are the ends of
//! passes. What a cut gives is found out by decoding just its bytes.

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
    let rough_ruler = Ruler::new(source, FEW_SAMPLES);
    let mut decoder = Decoder::new(u64::MAX);
    decoder.push(&header.to_bytes())?;
    let mut cuts: Vec<Cut> = Vec::new();
    let mut wanted = FIRST_ERROR * source.diagonal();
    let mut pushed = 0;
    let mut looked_at = 0.0;
    for &end in ends {
        let bytes = end + LAG_BYTES;
        if bytes >= stream.len() {
            break;
        }
        decoder.push(&stream[pushed..bytes])?;
        pushed = bytes;
        if (decoder.counts().1 as f64) < looked_at * NEXT_LOOK {
            continue;
        }
        looked_at = decoder.counts().1 as f64;
        let (twice_positions, triangles) = decoder.geometry();
        let drawn = Surface::new(&twice_positions, triangles);
        if rough_ruler.rms_within(&drawn, ROUGHLY * wanted).is_none() {
            continue;
        }
        let error = ruler.rms_within(&drawn, wanted);
        if let Some(error) = error.filter(|_| cuts.len() < MOST_CUTS) {
            wanted = error / 2.0;
            cuts.push(Cut {
                bytes: bytes as u32,
                triangles: triangles.len() as u32,
                rms_error: (error * f64::from(mesh.step)) as f32,
            });
        }
    }
    cuts.push(Cut {
        bytes: stream.len() as u32,
        triangles: mesh.triangles.len() as u32,
        rms_error: 0.0,
    });
    Ok(cuts)
}
