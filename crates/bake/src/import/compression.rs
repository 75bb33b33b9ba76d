//! What did a compressor make of the geometry? Meshopt views and Draco primitives, decoded and bounded.
//!
//! `EXT_meshopt_compression` (and its `KHR_` successor, whose bitstreams the same decoder reads) compresses buffer
//! views; `KHR_draco_mesh_compression` compresses whole primitives. Sizes are claimed before anything is decoded.

use std::panic::{AssertUnwindSafe, catch_unwind};

use draco_core::{DecodeLimits, DecoderBuffer, ErrorKind, Mesh, MeshDecoder};

use super::accessors::{Accessor, Layout, layout};
use super::document::Item;
use super::error::{Read, flaw};
use super::reader::{Bytes, Reader};

/// One element of a view: the meshopt decoder takes its stride from the size of a type.
#[derive(Clone, Copy)]
struct Row<const STRIDE: usize>([u8; STRIDE]);

impl<const STRIDE: usize> Default for Row<STRIDE> {
    fn default() -> Self {
        Self([0; STRIDE])
    }
}

fn rows<const STRIDE: usize>(encoded: &[u8], count: usize) -> Option<Vec<u8>> {
    let rows = meshopt::decode_vertex_buffer::<Row<STRIDE>>(encoded, count).ok()?;
    Some(rows.into_iter().flat_map(|row| row.0).collect())
}

/// Calls `rows` with the stride as a constant; the format allows multiples of four up to 256.
macro_rules! rows_of {
    ($stride:expr, $encoded:expr, $count:expr; $($n:literal)*) => {
        match $stride { $($n => rows::<$n>($encoded, $count),)* _ => None }
    };
}

fn attributes(encoded: &[u8], count: usize, stride: usize) -> Option<Vec<u8>> {
    rows_of!(stride, encoded, count;
        4 8 12 16 20 24 28 32 36 40 44 48 52 56 60 64 68 72 76 80 84 88 92 96 100 104 108 112 116 120 124 128
        132 136 140 144 148 152 156 160 164 168 172 176 180 184 188 192 196 200 204 208 212 216 220 224 228 232
        236 240 244 248 252 256)
}

fn indices(encoded: &[u8], count: usize, stride: usize, triangles: bool) -> Option<Vec<u8>> {
    let narrow = |v: Vec<u16>| v.into_iter().flat_map(u16::to_le_bytes).collect();
    let wide = |v: Vec<u32>| v.into_iter().flat_map(u32::to_le_bytes).collect();
    match (stride, triangles) {
        (2, true) if count.is_multiple_of(3) => meshopt::decode_index_buffer(encoded, count).ok().map(narrow),
        (4, true) if count.is_multiple_of(3) => meshopt::decode_index_buffer(encoded, count).ok().map(wide),
        (2, false) => meshopt::decode_index_sequence(encoded, count).ok().map(narrow),
        (4, false) => meshopt::decode_index_sequence(encoded, count).ok().map(wide),
        _ => None,
    }
}

/// Undoes a filter in place; `false` when it does not fit the stride.
fn undo_filter(filter: &str, bytes: &mut Vec<u8>, stride: usize) -> bool {
    let words = |bytes: &[u8]| -> Vec<[i16; 4]> {
        let word = |c: &[u8; 8], i: usize| i16::from_le_bytes([c[2 * i], c[2 * i + 1]]);
        bytes.as_chunks::<8>().0.iter().map(|c| std::array::from_fn(|i| word(c, i))).collect()
    };
    let unwords = |words: Vec<[i16; 4]>| words.into_iter().flatten().flat_map(i16::to_le_bytes).collect();
    let octets = |bytes: &[u8]| -> Vec<[i8; 4]> { bytes.as_chunks().0.iter().map(|c: &[u8; 4]| c.map(|b| b as i8)).collect() };
    let unoctets = |octets: Vec<[i8; 4]>| octets.into_iter().flatten().map(|b| b as u8).collect();
    match (filter, stride) {
        ("NONE", _) => {}
        ("OCTAHEDRAL", 4) => {
            let mut vectors = octets(bytes);
            meshopt::decode_filter_oct(&mut vectors);
            *bytes = unoctets(vectors);
        }
        ("OCTAHEDRAL", 8) => {
            let mut vectors = words(bytes);
            meshopt::decode_filter_oct(&mut vectors);
            *bytes = unwords(vectors);
        }
        ("QUATERNION", 8) => {
            let mut quaternions = words(bytes);
            meshopt::decode_filter_quat(&mut quaternions);
            *bytes = unwords(quaternions);
        }
        ("EXPONENTIAL", _) if stride.is_multiple_of(4) => {
            let mut numbers: Vec<[u32; 1]> = bytes.as_chunks().0.iter().map(|c| [u32::from_le_bytes(*c)]).collect();
            meshopt::decode_filter_exp(&mut numbers);
            *bytes = numbers.into_iter().flatten().flat_map(u32::to_le_bytes).collect();
        }
        ("COLOR", 4) => {
            let mut colors = bytes.as_chunks::<4>().0.to_vec();
            meshopt::decode_filter_color(&mut colors);
            *bytes = colors.into_flattened();
        }
        ("COLOR", 8) => {
            let mut colors: Vec<[u16; 4]> = words(bytes).into_iter().map(|c| c.map(|w| w as u16)).collect();
            meshopt::decode_filter_color(&mut colors);
            *bytes = colors.into_iter().flatten().flat_map(u16::to_le_bytes).collect();
        }
        _ => return false,
    }
    true
}

/// Decodes the view that a meshopt extension object describes.
pub(super) fn meshopt_view(reader: &mut Reader, compression: &Item) -> Read<Bytes> {
    const BROKEN: &str = "meshopt view that cannot be decoded: left out with what needs it";
    let count = compression.needed("count")?.as_index()?;
    let stride = compression.needed("byteStride")?.as_index()?;
    let mode = compression.text("mode")?.unwrap_or_default();
    let filter = compression.text("filter")?.unwrap_or("NONE");
    let encoded = reader.buffer_part(compression)?;
    // Twice: the decoder's rows and the bytes made of them.
    reader
        .budget
        .claim(count, stride.saturating_mul(2), || compression.place.clone())?;
    let encoded = encoded.as_slice();
    let decoded = match mode {
        "ATTRIBUTES" => attributes(encoded, count, stride),
        "TRIANGLES" => indices(encoded, count, stride, true),
        "INDICES" => indices(encoded, count, stride, false),
        _ => None,
    };
    let unfiltered = decoded.and_then(|mut bytes| undo_filter(filter, &mut bytes, stride).then_some(bytes));
    match unfiltered {
        Some(bytes) => Ok(Bytes::new(bytes)),
        None => flaw(
            BROKEN,
            format!("{}: {count} elements of {stride} bytes, mode {mode:?}, filter {filter:?}", compression.place),
        ),
    }
}

/// A Draco primitive, decoded.
pub(super) struct DracoMesh {
    mesh: Mesh,
}

impl DracoMesh {
    /// Decodes the primitive that a Draco extension object describes.
    pub(super) fn decode(reader: &mut Reader, compression: &Item) -> Read<Self> {
        const BROKEN: &str = "draco data that cannot be decoded: its primitive left out";
        let view = compression.needed("bufferView")?.as_index()?;
        let (bytes, _) = reader.view(view)?;
        let left = reader.budget.left_bytes();
        let limits = DecodeLimits::default()
            .with_max_points(left / 12)
            .with_max_faces(left / 12)
            .with_max_decoded_bytes(left);
        // The decoder is fuzzed upstream and free of unsafe code; a panic in it is still only this primitive's end.
        let decoded = catch_unwind(AssertUnwindSafe(|| {
            let mut mesh = Mesh::new();
            let mut buffer = DecoderBuffer::new(bytes.as_slice()).with_limits(limits);
            MeshDecoder::new().decode(&mut buffer, &mut mesh).map(|()| mesh)
        }));
        match decoded {
            Ok(Ok(mesh)) => {
                let values = (0..mesh.num_attributes()).map(|a| usize::from(mesh.attribute(a).num_components()));
                let point_bytes = 4 * values.sum::<usize>();
                reader.budget.claim(mesh.num_points(), point_bytes, || compression.place.clone())?;
                reader.budget.claim(mesh.num_faces(), 12, || compression.place.clone())?;
                Ok(Self { mesh })
            }
            Ok(Err(error)) if error.kind() == ErrorKind::LimitExceeded => {
                Err(reader.budget.refusal(compression.place.clone(), left).into())
            }
            Ok(Err(error)) => flaw(BROKEN, format!("{}: {error}", compression.place)),
            Err(_) => flaw(BROKEN, format!("{}: the decoder gave up", compression.place)),
        }
    }

    /// How many vertices there are.
    pub(super) fn vertex_count(&self) -> usize {
        self.mesh.num_points()
    }

    /// The indices of its triangles.
    pub(super) fn indices(&self) -> Vec<u32> {
        self.mesh.faces().iter().flatten().map(|point| point.0).collect()
    }

    /// The attribute that the extension object calls `id`, laid out as the primitive's own accessor says.
    pub(super) fn attribute(&self, id: usize, accessor: &Item) -> Read<Accessor> {
        let stated = layout(accessor)?;
        let Some(attribute) = u32::try_from(id).ok().and_then(|id| self.mesh.attribute_by_unique_id(id)) else {
            return flaw("draco attribute that is not in the data: left out", accessor.place.clone());
        };
        let components = stated.components.min(usize::from(attribute.num_components()));
        let numbers = attribute.read_f32s(self.mesh.num_points(), components);
        let normalized = stated.normalized && attribute.data_type().is_integral();
        Ok(Accessor::decoded(
            numbers,
            Layout {
                components,
                normalized,
                ..stated
            },
        ))
    }
}
