//! How does a client get a mesh out of a stream while it arrives?

use super::geometry::USUAL_WEIGHTS;
use super::rans::{Place, Reader, STATE_BYTES};
use super::replay::{Nothing, Phase, Replay};

/// Why a stream cannot be decoded.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SmoothError {
    /// The stream cannot be right.
    #[error("this smooth LOD is damaged: {0}; fetch it again")]
    Damaged(&'static str),
}

/// Bytes in, triangles out.
#[derive(Debug)]
pub struct Decoder {
    replay: Replay,
    bytes: Vec<u8>,
    place: Option<Place>,
}

impl Decoder {
    /// A decoder.
    pub fn new(bits: u32, most: (usize, usize), w: &[u8]) -> Self {
        let mut weights = USUAL_WEIGHTS; for (a, b) in weights.iter_mut().flatten().zip(w) { *a = *b as i8; }
        Self { replay: Replay::new(bits, weights, most), bytes: Vec::new(), place: None }
    }
    /// Takes in the next bytes and refines the mesh as far as they go.
    pub fn push(&mut self, bytes: &[u8]) -> Result<(), SmoothError> {
        self.bytes.extend_from_slice(bytes);
        let place = match self.place {
            Some(place) => place,
            None => match self.bytes.first_chunk::<STATE_BYTES>() {
                Some(first) => Place::start(first),
                None => return Ok(()),
            },
        };
        let mut reader = Reader::new(&self.bytes, place);
        let result = run(&mut self.replay, &mut reader, true);
        self.place = Some(reader.place());
        result
    }
    /// Vertices and triangles so far.
    pub fn counts(&self) -> (usize, usize) {
        (self.replay.mesh.points.len(), self.replay.mesh.triangles.len())
    }
    /// Whether the mesh is complete.
    pub fn is_complete(&self) -> bool {
        self.replay.phase == Phase::End
    }
    /// Positions on the finest lattice.
    pub fn positions(&self) -> Vec<[i32; 3]> {
        let l = self.replay.coarse_bits;
        let middle = if l > 0 { (1 << (l - 1)) - 1 } else { 0 };
        self.replay.mesh.points.iter().map(|p| p.at.map(|x| (x << l) + middle)).collect()
    }
    /// Triangles.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.replay.mesh.triangles
    }
}

fn run(replay: &mut Replay, reader: &mut Reader<'_>, is_whole: bool) -> Result<(), SmoothError> {
    while replay.phase != Phase::End && (is_whole || reader.left() >= replay.step_bytes()) {
        replay.advance::<_, Nothing>(reader, None).map_err(SmoothError::Damaged)?;
    }
    Ok(())
}
