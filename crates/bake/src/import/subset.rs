//! What is a part of a primitive? Some of its shapes, with the vertices that they use and all attributes of these.

use super::topology::compact;
use crate::source::Primitive;

impl Primitive {
    /// The primitive that draws only the given shapes (whole groups of indices), in that order. Vertices keep their
    /// order; unused ones are left out. Cost: linear in the shapes, whatever the size of the whole.
    #[must_use]
    pub fn subset(&self, mut indices: Vec<u32>) -> Self {
        let used = compact(&mut indices);
        self.picked(&used, indices)
    }

    /// The primitive of these vertices, each as often as it is named, with indices of its own.
    #[must_use]
    pub(crate) fn picked(&self, used: &[u32], indices: Vec<u32>) -> Self {
        Self {
            topology: self.topology,
            material: self.material,
            positions: pick(&self.positions, used),
            normals: pick(&self.normals, used),
            tangents: pick(&self.tangents, used),
            uvs: self.uvs.iter().map(|set| pick(set, used)).collect(),
            colors: pick(&self.colors, used),
            indices,
        }
    }
}

/// The used elements of an attribute that may be empty.
fn pick<T: Copy>(all: &[T], used: &[u32]) -> Vec<T> {
    if all.is_empty() {
        return Vec::new();
    }
    used.iter().map(|&vertex| all[vertex as usize]).collect()
}
