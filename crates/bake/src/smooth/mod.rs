//! How does a model become a smooth LOD?
//!
//! 1. [`quantise`]: what exactly it will hold;
//! 2. `collapse` over `quadric`: in what order it is coarsened;
//! 3. `lattices`: on how fine a lattice each pass stands;
//! 4. `script`: the collapses, undone from the last, told to `belvedere_scene::smooth::replay`;
//!    `weights` finds out first how this mesh's positions are predicted best;
//! 5. `cuts` over `prefix`, [`mod@error`] and `surface`: where it is good to stop.
//!
//! [`thesis`] writes the packets of the thesis, to compare with. [`publish`] says which models of a scene get one, how fine, and how far each rung is from the source.

pub mod canonical;
mod collapse;
mod cuts;
pub mod drawn;
pub mod error;
mod lattices;
mod planes;
mod prefix;
pub mod publish;
#[cfg(test)]
mod publish_tests;
pub(crate) mod quadric;
pub mod quantise;
mod script;
mod surface;
#[cfg(test)]
mod tests;
pub mod thesis;
mod weights;

use belvedere_scene::smooth::Header;
use belvedere_scene::smooth::course::Course;
use belvedere_scene::smooth::geometry::USUAL_WEIGHTS;
use belvedere_scene::smooth::replay::Replay;

use cuts::Written;
use error::{Ruler, Surface};
use prefix::Prefix;
use quantise::QuantisedMesh;
use script::Undo;

/// Meshes with fewer vertices are not worth weights of their own.
const LEAST_FITTED: u32 = 600;

/// Writes a smooth LOD; `None` when readers would refuse it, since a number in its header is too large or so many triangles meet at
/// so few vertices, or when it would take too long.
#[must_use]
pub fn encode(mesh: &QuantisedMesh) -> Option<Vec<u8>> {
    let mut header = header_of(mesh);
    if !is_readable(&header) {
        return None;
    }
    if mesh.triangles.is_empty() {
        header.wedges = 0;
        header.total_bytes = header.to_bytes().len() as u32;
        return Some(header.to_bytes());
    }
    let tree = collapse::cluster(mesh)?;
    let source = Surface::of(mesh);
    let ruler = Ruler::new(&source, cuts::SAMPLES);
    let lacking = lattices::choose(mesh, &tree, &ruler);
    let mut undo = Undo::new(mesh, &tree, &lacking);
    let (stream, course) = tell(&mut header, &mut undo)?;
    let written = Written {
        bytes: stream.len(),
        course: &course,
        beginning: Prefix::new(mesh, &undo),
        step: mesh.step,
    };
    header.cuts = cuts::choose(&written, (&source, &ruler));
    let header_bytes = header.to_bytes().len() as u32;
    for cut in &mut header.cuts {
        cut.bytes += header_bytes;
    }
    header.total_bytes = header_bytes + stream.len() as u32;
    let mut bytes = header.to_bytes();
    bytes.extend(stream);
    Some(bytes)
}

/// What is known before the story is told.
fn header_of(mesh: &QuantisedMesh) -> Header {
    Header {
        total_bytes: 0,
        bits: mesh.bits,
        vertices: mesh.positions.len() as u32,
        triangles: mesh.triangles.len() as u32,
        wedges: u32::MAX,
        materials: mesh.materials.iter().max().map_or(1, |most| most + 1),
        origin: mesh.origin,
        step: mesh.step,
        channels: mesh.channels.clone(),
        weights: USUAL_WEIGHTS,
        cuts: Vec::new(),
    }
}

/// The stream and what of it decides what; completes the header but for cuts. `None` when it would take readers too long.
fn tell(header: &mut Header, undo: &mut Undo<'_>) -> Option<(Vec<u8>, Course)> {
    let draft = Replay::new(header).draft(undo)?;
    header.wedges = undo.source_wedge.len() as u32;
    if header.vertices >= LEAST_FITTED {
        header.weights = undo.fit.weights();
    }
    Some(draft.finish(&header.weights))
}

/// Whether readers take what the header says of lattice and attributes, whatever the stream then has.
fn is_readable(header: &Header) -> bool {
    let bare = Header {
        total_bytes: u32::MAX,
        wedges: 0,
        ..header.clone()
    };
    matches!(Header::read(&bare.to_bytes()), Ok(Some(_)))
}
