//! How does a client get a mesh out of a smooth LOD while it arrives? Bytes in, triangles out.

use super::SmoothError;
use super::header::Header;
use super::rans::{Place, Reader, STATE_BYTES};
use super::replay::{Phase, Replay};
use super::script::Nothing;

/// Decodes one smooth LOD.
///
/// After any number of bytes there is a valid mesh: all indices are in range and no triangle has a corner twice. When
/// all bytes have come it is the mesh that was encoded, bit for bit. Until then it may lag behind the bytes that have
/// come by what one split takes, some dozen bytes.
///
/// Memory is bounded by [`Header::memory_bytes`], and grows only with what has been decoded.
#[derive(Debug, Clone)]
pub struct Decoder {
    most_memory_bytes: u64,
    bytes: Vec<u8>,
    begun: Option<Begun>,
    damage: Option<SmoothError>,
}

/// From when the header is known.
#[derive(Debug, Clone)]
struct Begun {
    header: Header,
    header_bytes: usize,
    place: Option<Place>,
    replay: Replay,
}

impl Decoder {
    /// A decoder that refuses what may take more memory than this.
    #[must_use]
    pub fn new(most_memory_bytes: u64) -> Self {
        Self {
            most_memory_bytes,
            bytes: Vec::new(),
            begun: None,
            damage: None,
        }
    }

    /// Takes in the next bytes and refines the mesh as far as they go.
    ///
    /// # Errors
    /// When the bytes cannot be those of a smooth LOD, or it may take too much memory. What was decoded before stays.
    pub fn push(&mut self, bytes: &[u8]) -> Result<(), SmoothError> {
        if self.damage.is_none() {
            self.damage = self.try_push(bytes).err();
        }
        self.damage.clone().map_or(Ok(()), Err)
    }

    fn try_push(&mut self, bytes: &[u8]) -> Result<(), SmoothError> {
        let most_bytes = self
            .begun
            .as_ref()
            .map_or(usize::MAX, |begun| begun.header.total_bytes as usize);
        if bytes.len() > most_bytes.saturating_sub(self.bytes.len()) {
            return Err(SmoothError::Damaged("it goes on after its end"));
        }
        self.bytes.extend_from_slice(bytes);
        if self.begun.is_none() {
            let Some((header, header_bytes)) = Header::read(&self.bytes)? else {
                return Ok(());
            };
            let needed_bytes = header.memory_bytes();
            if needed_bytes > self.most_memory_bytes {
                return Err(SmoothError::Memory {
                    needed_bytes,
                    most_bytes: self.most_memory_bytes,
                });
            }
            if self.bytes.len() > header.total_bytes as usize {
                return Err(SmoothError::Damaged("it goes on after its end"));
            }
            let replay = Replay::new(&header);
            self.begun = Some(Begun {
                header,
                header_bytes,
                place: None,
                replay,
            });
        }
        match &mut self.begun {
            Some(begun) => begun.run(&self.bytes),
            None => Ok(()),
        }
    }

    /// What the header says, as soon as it has come.
    #[must_use]
    pub fn header(&self) -> Option<&Header> {
        self.begun.as_ref().map(|begun| &begun.header)
    }

    /// Vertices and triangles of the mesh so far.
    #[must_use]
    pub fn counts(&self) -> (usize, usize) {
        let mesh = self.begun.as_ref().map(|begun| &begun.replay.mesh);
        mesh.map_or((0, 0), |mesh| (mesh.points.len(), mesh.triangles.len()))
    }

    /// Whether the mesh is whole.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.begun
            .as_ref()
            .is_some_and(|begun| begun.replay.phase == Phase::End)
    }

    /// The mesh so far.
    pub(super) fn replay(&self) -> Option<(&Header, &Replay)> {
        self.begun.as_ref().map(|begun| (&begun.header, &begun.replay))
    }
}

impl Begun {
    fn run(&mut self, bytes: &[u8]) -> Result<(), SmoothError> {
        let is_whole = bytes.len() == self.header.total_bytes as usize;
        let stream = &bytes[self.header_bytes..];
        let place = match (self.place, stream.first_chunk::<STATE_BYTES>()) {
            (Some(place), _) => place,
            (None, Some(states)) => Place::start(states),
            (None, None) if is_whole && self.header.triangles == 0 => {
                self.replay.phase = Phase::End;
                return Ok(());
            }
            (None, None) if is_whole => return Err(SmoothError::Damaged("it has no stream")),
            (None, None) => return Ok(()),
        };
        let mut reader = Reader::new(stream, is_whole, place);
        let replay = &mut self.replay;
        replay.reserve(stream.len());
        while replay.phase != Phase::End
            && replay
                .advance::<_, Nothing>(&mut reader, None)
                .map_err(SmoothError::Damaged)?
        {}
        let place = reader.place();
        self.place = Some(place);
        if is_whole {
            let is_all = replay.mesh.points.len() == self.header.vertices as usize
                && replay.mesh.triangles.len() == self.header.triangles as usize
                && replay.attributes.values().len() == self.header.wedges as usize * self.header.stride();
            if !is_all || !place.is_end() || reader.left() > 0 {
                return Err(SmoothError::Damaged("its stream does not end as its header says"));
            }
        }
        Ok(())
    }
}
