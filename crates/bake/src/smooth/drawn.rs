//! What is drawn of a stream's beginning? A primitive for each material, over the vertices that it uses, all numbers as the decoder gives them.

use belvedere_scene::smooth::Snapshot;

use crate::source::Primitive;

/// The primitives of a decoded mesh. `materials` says which of the source's materials each of the stream's is.
#[must_use]
pub fn primitives(snapshot: &Snapshot, materials: &[Option<usize>]) -> Vec<Primitive> {
    let mut new_of = vec![u32::MAX; snapshot.positions.len()];
    let parts = snapshot.indices.iter().zip(materials);
    let drawn = parts.filter(|(corners, _)| !corners.is_empty());
    drawn
        .map(|(corners, &material)| {
            let (indices, used) = compact(corners, &mut new_of);
            Primitive {
                indices,
                material,
                positions: pick(&snapshot.positions, &used),
                normals: pick(&snapshot.normals, &used),
                uvs: snapshot.uvs.iter().map(|set| pick(set, &used)).collect(),
                colors: pick(&snapshot.colours, &used),
                ..Primitive::default()
            }
        })
        .collect()
}

/// Corners over the vertices that are used, and which these are. `new_of` holds no numbers before and after.
fn compact(corners: &[u32], new_of: &mut [u32]) -> (Vec<u32>, Vec<u32>) {
    let mut used = Vec::new();
    let indices = corners.iter().map(|&corner| {
        let new = &mut new_of[corner as usize];
        if *new == u32::MAX {
            *new = used.len() as u32;
            used.push(corner);
        }
        *new
    });
    let indices = indices.collect();
    used.iter().for_each(|&corner| new_of[corner as usize] = u32::MAX);
    (indices, used)
}

/// The rows of these vertices; nothing of nothing.
fn pick<T: Copy>(rows: &[T], used: &[u32]) -> Vec<T> {
    used.iter().filter_map(|&i| rows.get(i as usize).copied()).collect()
}
