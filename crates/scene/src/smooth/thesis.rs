//! What do the packets of Schmalstieg, *The Remote Rendering Pipeline* (1997), §7.4–7.5, say? A smooth LOD exactly as the
//! thesis writes it, to compare with: `docs/SLOD.md` has what the thesis leaves open. Scenes are published as `.slod`.
//!
//! Any beginning decodes: a packet that is not all there is left out. Time and memory are linear in the bytes, whatever
//! they claim.

use super::{SmoothError, Snapshot};

/// What a stream begins with.
pub const MAGIC: [u8; 4] = *b"SLTH";
/// Bytes before the packets: the magic and three extents, f32.
pub const HEADER_BYTES: usize = 16;
/// Parts of an extent that an offset counts: a quarter of it has 2¹⁶.
pub const OFFSET_PARTS: f64 = 262_144.0;

/// Triangles over vertices, each with a material.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ThesisMesh {
    /// In the order in which they were told.
    pub positions: Vec<[f32; 3]>,
    /// Corners.
    pub triangles: Vec<[u32; 3]>,
    /// Of each triangle.
    pub materials: Vec<u8>,
}

impl From<ThesisMesh> for Snapshot {
    fn from(mesh: ThesisMesh) -> Self {
        let materials = mesh.materials.iter().max().map_or(0, |most| usize::from(*most) + 1);
        let mut indices = vec![Vec::new(); materials];
        for (corners, material) in mesh.triangles.iter().zip(&mesh.materials) {
            indices[usize::from(*material)].extend(corners);
        }
        Self {
            positions: mesh.positions,
            indices,
            ..Self::default()
        }
    }
}

/// The length of one part of an offset along each axis.
#[must_use]
pub fn offset_units(extents: [f32; 3]) -> [f64; 3] {
    extents.map(|extent| f64::from(extent) / OFFSET_PARTS)
}

/// How many bits tell one of so many things.
#[must_use]
pub fn index_bits(count: usize) -> u32 {
    count.saturating_sub(1).checked_ilog2().map_or(0, |bits| bits + 1)
}

/// Decodes a stream or any beginning of one.
///
/// # Errors
/// When it is something else, or a packet names what is not there.
pub fn decode(bytes: &[u8]) -> Result<ThesisMesh, SmoothError> {
    let header = bytes.first_chunk::<HEADER_BYTES>().ok_or(SmoothError::NotThesis)?;
    if header[..4] != MAGIC {
        return Err(SmoothError::NotThesis);
    }
    let extent = |i: usize| f32::from_le_bytes([0, 1, 2, 3].map(|byte| header[4 + 4 * i + byte]));
    let mut state = State {
        units: offset_units([0, 1, 2].map(extent)),
        ..State::default()
    };
    let mut bits = Bits {
        bytes: &bytes[HEADER_BYTES..],
        at: 0,
    };
    while let Some(packet) = Packet::read(&mut bits, &state)? {
        state.apply(packet)?;
    }
    Ok(state.mesh)
}

enum Packet {
    Vertex {
        parent: usize,
        position: [f32; 3],
        moves: Vec<bool>,
    },
    Triangles {
        third: usize,
        /// Of either orientation: (new, parent, third) and (parent, new, third).
        counts: [u8; 2],
    },
    Material(u8),
}

#[derive(Default)]
struct State {
    units: [f64; 3],
    mesh: ThesisMesh,
    /// The triangles of each vertex, rising.
    around: Vec<Vec<u32>>,
    parent: usize,
    material: u8,
}

impl Packet {
    /// The next packet; `None` when it is not all there.
    fn read(bits: &mut Bits<'_>, state: &State) -> Result<Option<Self>, SmoothError> {
        match Self::whole(bits, state) {
            Ok(packet) => Ok(Some(packet)),
            Err(Stop::End) => Ok(None),
            Err(Stop::Damaged(what)) => Err(SmoothError::Damaged(what)),
        }
    }

    fn whole(bits: &mut Bits<'_>, state: &State) -> Result<Self, Stop> {
        let count = state.mesh.positions.len();
        if !bits.bit()? {
            return Self::vertex(bits, state);
        }
        let is_triangle = !bits.bit()?;
        if !is_triangle && bits.bit()? {
            return Ok(Self::Material(bits.number(8)? as u8));
        }
        if count < 2 {
            return Err(Stop::Damaged("a triangle before its vertices"));
        }
        let (third, counts) = if is_triangle {
            let third = bits.number(index_bits(count))? as usize;
            (third, if bits.bit()? { [0, 1] } else { [1, 0] })
        } else {
            let doublets = if bits.bit()? { 2 } else { 1 };
            (bits.number(index_bits(count))? as usize, [doublets; 2])
        };
        if third >= count - 1 || third == state.parent {
            return Err(Stop::Damaged("a triangle has no third corner"));
        }
        Ok(Self::Triangles { third, counts })
    }

    fn vertex(bits: &mut Bits<'_>, state: &State) -> Result<Self, Stop> {
        let positions = &state.mesh.positions;
        let parent = bits.number(index_bits(positions.len()))? as usize;
        let at = match positions.get(parent) {
            Some(at) => *at,
            None if positions.is_empty() => [0.0; 3],
            None => return Err(Stop::Damaged("a vertex has no parent")),
        };
        let mut position = [0.0; 3];
        for axis in 0..3 {
            position[axis] = bits.ordinate(at[axis], state.units[axis])?;
            if !position[axis].is_finite() {
                return Err(Stop::Damaged("a vertex is nowhere"));
            }
        }
        let around = state.around.get(parent).map_or(0, Vec::len);
        let moves = (0..around).map(|_| bits.bit()).collect::<Result<_, _>>()?;
        Ok(Self::Vertex {
            parent,
            position,
            moves,
        })
    }
}

impl State {
    fn apply(&mut self, packet: Packet) -> Result<(), SmoothError> {
        match packet {
            Packet::Material(material) => self.material = material,
            Packet::Vertex {
                parent,
                position,
                moves,
            } => self.split(parent, position, &moves),
            Packet::Triangles { third, counts } => {
                let (new, parent) = (self.mesh.positions.len() - 1, self.parent);
                for _ in 0..counts[0] {
                    self.add([new, parent, third])?;
                }
                for _ in 0..counts[1] {
                    self.add([parent, new, third])?;
                }
            }
        }
        Ok(())
    }

    /// A new vertex takes over those triangles of its parent that move.
    fn split(&mut self, parent: usize, position: [f32; 3], moves: &[bool]) {
        let new = self.mesh.positions.len() as u32;
        self.mesh.positions.push(position);
        self.parent = parent;
        let all = self.around.get_mut(parent).map(std::mem::take).unwrap_or_default();
        let (mut stay, mut go) = (Vec::new(), Vec::new());
        for (triangle, moves) in all.into_iter().zip(moves) {
            if *moves {
                let corners = &mut self.mesh.triangles[triangle as usize];
                *corners = corners.map(|corner| if corner == parent as u32 { new } else { corner });
                go.push(triangle);
            } else {
                stay.push(triangle);
            }
        }
        if let Some(around) = self.around.get_mut(parent) {
            *around = stay;
        }
        self.around.push(go);
    }

    fn add(&mut self, corners: [usize; 3]) -> Result<(), SmoothError> {
        let number =
            u32::try_from(self.mesh.triangles.len()).map_err(|_| SmoothError::Damaged("too many triangles"))?;
        for corner in corners {
            self.around[corner].push(number);
        }
        self.mesh.triangles.push(corners.map(|corner| corner as u32));
        self.mesh.materials.push(self.material);
        Ok(())
    }
}

enum Stop {
    /// There are no more bits.
    End,
    Damaged(&'static str),
}

/// Bits, the highest of each byte first.
struct Bits<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Bits<'_> {
    fn bit(&mut self) -> Result<bool, Stop> {
        let byte = self.bytes.get(self.at / 8).ok_or(Stop::End)?;
        let bit = byte >> (7 - self.at % 8) & 1;
        self.at += 1;
        Ok(bit == 1)
    }

    fn number(&mut self, bits: u32) -> Result<u32, Stop> {
        (0..bits).try_fold(0, |number, _| Ok(number << 1 | u32::from(self.bit()?)))
    }

    fn ordinate(&mut self, parent: f32, unit: f64) -> Result<f32, Stop> {
        let moved = |parts: i16| (f64::from(parent) + f64::from(parts) * unit) as f32;
        if !self.bit()? {
            return Ok(moved(self.number(16)? as u16 as i16));
        }
        if !self.bit()? {
            return Ok(moved(i16::from(self.number(8)? as u8 as i8)));
        }
        if !self.bit()? {
            return Ok(parent);
        }
        Ok(f32::from_bits(self.number(32)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_index_takes_as_many_bits_as_the_count_needs() {
        assert_eq!([0, 1, 2, 3, 4, 5, 256, 257].map(index_bits), [0, 0, 1, 2, 2, 3, 8, 9]);
    }

    /// Written by hand after the tables 5 and 6: two vertices, a third, a triangle.
    #[test]
    fn packets_are_read_as_the_thesis_writes_them() {
        let mut bits = String::new();
        let absolute = |x: f32| format!("111{:032b}", x.to_bits());
        // VERTEX without a parent, absolute.
        bits += &format!("0{}{}{}", absolute(1.0), absolute(2.0), absolute(3.0));
        // VERTEX of parent 0 (no bits): x by 8 bits, y the same, z by 16 bits.
        bits += &format!("0{}{}{}", "1011111111", "110", format_args!("0{:016b}", 0x0100));
        // VERTEX of parent 1 (1 bit): all the same.
        bits += "01110110110";
        // MATERIAL 7; TRIANGLE with vertex 0 (2 bits), (parent, new, third).
        bits += "11100000111";
        bits += "10001";
        let mut bytes = MAGIC.to_vec();
        for extent in [262_144.0f32, 1.0, 262_144.0] {
            bytes.extend(extent.to_le_bytes());
        }
        for chunk in bits.as_bytes().chunks(8) {
            let text = format!("{:0<8}", std::str::from_utf8(chunk).unwrap());
            bytes.push(u8::from_str_radix(&text, 2).unwrap());
        }
        let mesh = decode(&bytes).unwrap();
        assert_eq!(mesh.positions, [[1.0, 2.0, 3.0], [0.0, 2.0, 259.0], [0.0, 2.0, 259.0]]);
        assert_eq!((mesh.triangles, mesh.materials), (vec![[1, 2, 0]], vec![7]));
    }

    #[test]
    fn what_is_damaged_or_something_else_is_refused() {
        assert_eq!(decode(b"SLOD"), Err(SmoothError::NotThesis));
        let mut bytes = [&MAGIC[..], &[0; 12]].concat();
        assert_eq!(decode(&bytes), Ok(ThesisMesh::default()));
        bytes.push(0b1000_0000);
        assert!(matches!(decode(&bytes), Err(SmoothError::Damaged(_))));
    }

    #[test]
    fn a_vertex_is_somewhere() {
        let nowhere = Err(SmoothError::Damaged("a vertex is nowhere"));
        for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            // VERTEX without a parent, absolute.
            let packets = (0b0111u64 << 60 | u64::from(x.to_bits()) << 28).to_be_bytes();
            assert_eq!(decode(&[&MAGIC[..], &[0; 12], &packets].concat()), nowhere);
        }
        // Extents that no file has: the offset leads out of what numbers can say.
        let far = [f32::INFINITY; 3].map(f32::to_le_bytes).concat();
        assert_eq!(decode(&[&MAGIC[..], &far, &[0, 1, 0, 1, 0, 1]].concat()), nowhere);
    }
}
