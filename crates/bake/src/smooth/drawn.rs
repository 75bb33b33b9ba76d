//! What is drawn of a stream's beginning? A primitive for each material, over the vertices that it uses, all numbers as the decoder gives them.

use belvedere_scene::smooth::Snapshot;

use crate::source::Primitive;

/// The primitives of a decoded mesh. `materials` says which of the source's materials each of the stream's is.
#[must_use]
pub fn primitives(snapshot: Snapshot, materials: &[Option<usize>]) -> Vec<Primitive> {
    let all = Primitive {
        positions: snapshot.positions,
        normals: snapshot.normals,
        uvs: snapshot.uvs,
        colors: snapshot.colours,
        ..Primitive::default()
    };
    let parts = snapshot.indices.into_iter().zip(materials);
    let drawn = parts.filter(|(corners, _)| !corners.is_empty());
    let part = |(corners, &material)| Primitive {
        material,
        ..all.subset(corners)
    };
    drawn.map(part).collect()
}
