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
use crate::meshopt_view;

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
    match meshopt_view::decode(mode, filter, encoded, count, stride) {
        Some(bytes) => Ok(Bytes::new(bytes)),
        None => flaw(
            BROKEN,
            format!(
                "{}: {count} elements of {stride} bytes, mode {mode:?}, filter {filter:?}",
                compression.place
            ),
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
        // The decoder works at least as long as its input is, also when it fails.
        reader
            .budget
            .claim(bytes.as_slice().len(), 1, || compression.place.clone())?;
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
                reader
                    .budget
                    .claim(mesh.num_points(), point_bytes, || compression.place.clone())?;
                reader
                    .budget
                    .claim(mesh.num_faces(), 12, || compression.place.clone())?;
                Ok(Self { mesh })
            }
            Ok(Err(error)) if error.kind() == ErrorKind::LimitExceeded => Err(reader
                .budget
                .refusal(compression.place.clone(), left.saturating_add(1))
                .into()),
            Ok(Err(error)) => flaw(BROKEN, format!("{}: {error}", compression.place)),
            Err(_) => flaw(BROKEN, format!("{}: the decoder gave up", compression.place)),
        }
    }

    /// The indices of its triangles.
    pub(super) fn indices(&self) -> Vec<u32> {
        self.mesh.faces().iter().flatten().map(|point| point.0).collect()
    }

    /// The attribute that the extension object calls `id`, laid out as the primitive's own accessor says.
    pub(super) fn attribute(&self, id: usize, accessor: &Item) -> Read<Accessor> {
        let stated = layout(accessor)?;
        let Some(attribute) = u32::try_from(id)
            .ok()
            .and_then(|id| self.mesh.attribute_by_unique_id(id))
        else {
            return flaw(
                "draco attribute that is not in the data: left out",
                accessor.place.clone(),
            );
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

#[cfg(test)]
mod tests {
    use super::super::testing::Gltf;

    /// A document whose positions (three vertices of 12 bytes) are compressed.
    fn compressed(encoded: &[u8], filter: &str) -> Gltf {
        let mut gltf = Gltf::triangle();
        let view = gltf.view(encoded);
        let mut compression = gltf.json["bufferViews"][view].clone();
        compression["count"] = 3.into();
        compression["byteStride"] = 12.into();
        compression["mode"] = "ATTRIBUTES".into();
        compression["filter"] = filter.into();
        // The fallback buffer has no data.
        gltf.json["buffers"]
            .as_array_mut()
            .unwrap()
            .push(serde_json::json!({"byteLength": 36}));
        gltf.json["bufferViews"][0]["buffer"] = 1.into();
        gltf.json["bufferViews"][0]["extensions"] = serde_json::json!({"EXT_meshopt_compression": compression});
        gltf
    }

    fn rows() -> Vec<[u8; 12]> {
        Gltf::CORNERS.iter().map(|p| row_of(*p)).collect()
    }

    fn row_of(p: [f32; 3]) -> [u8; 12] {
        let mut row = [0; 12];
        for (out, number) in row.as_chunks_mut::<4>().0.iter_mut().zip(p) {
            *out = number.to_le_bytes();
        }
        row
    }

    #[test]
    fn a_meshopt_view_decodes_to_what_was_encoded() {
        let encoded = meshopt::encode_vertex_buffer(&rows()).unwrap();
        let scene = compressed(&encoded, "NONE").import().unwrap().scene;
        assert_eq!(scene.models[0].primitives[0].positions, Gltf::CORNERS);
    }

    #[test]
    fn an_exponential_filter_is_undone() {
        let filtered = meshopt::encode_filter_exp(&Gltf::CORNERS, 24, meshopt::EncodeExpMode::Separate);
        let encoded = meshopt::encode_vertex_buffer(&filtered).unwrap();
        let scene = compressed(&encoded, "EXPONENTIAL").import().unwrap().scene;
        assert_eq!(scene.models[0].primitives[0].positions, Gltf::CORNERS);
    }

    #[test]
    fn broken_meshopt_data_leaves_nothing_to_draw_and_says_so() {
        let encoded = meshopt::encode_vertex_buffer(&rows()).unwrap();
        for end in 0..encoded.len() {
            let refused = compressed(&encoded[..end], "NONE").import().unwrap_err().to_string();
            assert!(
                refused.contains("meshopt view that cannot be decoded"),
                "{end}: {refused}"
            );
        }
        let refused = compressed(&encoded, "SEPIA").import().unwrap_err().to_string();
        assert!(refused.contains("SEPIA"), "{refused}");
    }

    #[test]
    fn a_meshopt_view_that_claims_too_much_is_refused_before_it_is_decoded() {
        let mut gltf = compressed(&[0; 8], "NONE");
        gltf.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]["count"] = 10_000_000_000u64.into();
        let refused = gltf.import().unwrap_err().to_string();
        assert!(refused.contains("bytes of memory"), "{refused}");
    }

    #[test]
    fn broken_draco_data_drops_its_primitive() {
        let mut gltf = Gltf::triangle();
        let view = gltf.view(b"DRACO\x02\x02\x01\x01\0\0\xFF\xFF\xFF\xFF\x0F");
        let primitive = &mut gltf.json["meshes"][0]["primitives"][0];
        primitive["extensions"] = serde_json::json!({"KHR_draco_mesh_compression":
            {"bufferView": view, "attributes": {"POSITION": 0}}});
        let with_fallback = gltf.import().unwrap();
        assert_eq!(
            with_fallback
                .defects
                .count("draco data that cannot be decoded: its primitive left out"),
            1
        );
        gltf.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
        let refused = gltf.import().unwrap_err().to_string();
        assert!(refused.contains("draco data"), "{refused}");
    }
}
