//! How does a mesh become packets of Schmalstieg, *The Remote Rendering Pipeline* (1997), chapter 7?
//!
//! 1. [`tree`]: clusters of vertices, the two closest joined again and again (§7.2);
//! 2. here: the joints undone from the last, as packets (§7.3–7.5, tables 5 and 6).
//!
//! What the thesis leaves open, and what we chose, stands in `docs/SLOD.md`. It is there to be compared with.

mod tree;

use belvedere_scene::smooth::thesis::{MAGIC, index_bits, offset_units};

use super::quantise::QuantisedMesh;
use tree::{ClusterTree, Joint};

/// A packet names materials with 8 bits.
pub const MOST_MATERIALS: usize = 256;

/// Writes a mesh's positions, triangles and materials; `None` for one with more than [`MOST_MATERIALS`].
#[must_use]
pub fn encode(mesh: &QuantisedMesh) -> Option<Vec<u8>> {
    if mesh
        .materials
        .iter()
        .any(|material| usize::from(*material) >= MOST_MATERIALS)
    {
        return None;
    }
    let place =
        |p: &[i32; 3]| [0, 1, 2].map(|i| (f64::from(mesh.origin[i]) + f64::from(p[i]) * f64::from(mesh.step)) as f32);
    let positions: Vec<[f32; 3]> = mesh.positions.iter().map(place).collect();
    let extents = [0, 1, 2].map(|axis| {
        let ordinates = positions.iter().map(|p| p[axis]);
        let (low, high) = ordinates.fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        if low <= high { high - low } else { 0.0 }
    });
    let mut bytes = MAGIC.to_vec();
    extents.iter().for_each(|extent| bytes.extend(extent.to_le_bytes()));
    if positions.is_empty() {
        return Some(bytes);
    }
    let mut writer = Writer {
        bits: Bits::default(),
        units: offset_units(extents),
        told: vec![0; positions.len()],
        decoded: Vec::with_capacity(positions.len()),
        around: vec![Vec::new(); positions.len()],
        triangles: 0,
        material: 0,
    };
    let tree = ClusterTree::of(&positions, &mesh.triangles);
    writer.vertex(None, positions[tree.root as usize], &[]);
    for joint in tree.joints.iter().rev() {
        writer.undo(joint, &positions, mesh);
    }
    bytes.extend(writer.bits.bytes);
    Some(bytes)
}

struct Writer {
    bits: Bits,
    units: [f64; 3],
    /// The number that a reader knows a vertex of the source by.
    told: Vec<u32>,
    /// Where a reader has the vertices that were told.
    decoded: Vec<[f32; 3]>,
    /// For each vertex of the source its triangles in the order in which they were told, with their source's number.
    around: Vec<Vec<(u32, u32)>>,
    /// Triangles that were told.
    triangles: u32,
    material: u16,
}

impl Writer {
    /// A node of the tree becomes its two children: a new vertex, and the triangles that had collapsed.
    fn undo(&mut self, joint: &Joint, positions: &[[f32; 3]], mesh: &QuantisedMesh) {
        let (kept, gone) = (joint.kept as usize, joint.gone as usize);
        let all = std::mem::take(&mut self.around[kept]);
        let moves: Vec<bool> = all
            .iter()
            .map(|(_, t)| joint.updated.binary_search(t).is_ok())
            .collect();
        self.told[gone] = self.decoded.len() as u32;
        self.vertex(Some(self.told[kept]), positions[gone], &moves);
        for (triangle, moves) in all.into_iter().zip(moves) {
            self.around[if moves { gone } else { kept }].push(triangle);
        }
        let mut collapsed = joint.collapsed.clone();
        let material = |triangle: u32| mesh.materials[triangle as usize];
        // The current material first, so that it need not be told.
        collapsed.sort_by_key(|c| {
            (
                material(c.triangle) != self.material,
                material(c.triangle),
                c.third,
                c.turned,
            )
        });
        for alike in collapsed.chunk_by(|a, b| material(a.triangle) == material(b.triangle)) {
            self.set_material(material(alike[0].triangle));
            for group in alike.chunk_by(|a, b| a.third == b.third) {
                let split = group.partition_point(|c| !c.turned);
                self.add(joint, [&group[..split], &group[split..]]);
            }
        }
    }

    /// Triangles with one third corner, of either orientation.
    fn add(&mut self, joint: &Joint, orientations: [&[tree::Collapsed]; 2]) {
        let third = self.told[orientations[0]
            .iter()
            .chain(orientations[1])
            .next()
            .map_or(0, |c| c.third as usize)];
        let id_bits = index_bits(self.decoded.len());
        let [mut straight, mut turned] = orientations;
        loop {
            let doublets = straight.len().min(turned.len()).min(2);
            if doublets == 0 {
                break;
            }
            self.bits.put(0b110, 3);
            self.bits.put(u32::from(doublets == 2), 1);
            self.bits.put(third, id_bits);
            for side in [&mut straight, &mut turned] {
                let (now, later) = side.split_at(doublets);
                self.enter(joint, now);
                *side = later;
            }
        }
        for (side, orientation) in [(straight, 0), (turned, 1)] {
            for triangle in side {
                self.bits.put(0b10, 2);
                self.bits.put(third, id_bits);
                self.bits.put(orientation, 1);
                self.enter(joint, std::slice::from_ref(triangle));
            }
        }
    }

    /// A reader has numbered these.
    fn enter(&mut self, joint: &Joint, triangles: &[tree::Collapsed]) {
        for collapsed in triangles {
            for corner in [joint.kept, joint.gone, collapsed.third] {
                self.around[corner as usize].push((self.triangles, collapsed.triangle));
            }
            self.triangles += 1;
        }
    }

    fn set_material(&mut self, material: u16) {
        if self.material != material {
            self.material = material;
            self.bits.put(0b111, 3);
            self.bits.put(u32::from(material), 8);
        }
    }

    fn vertex(&mut self, parent: Option<u32>, at: [f32; 3], moves: &[bool]) {
        self.bits.put(0, 1);
        let from = parent.map(|parent| {
            self.bits.put(parent, index_bits(self.decoded.len()));
            self.decoded[parent as usize]
        });
        let position = [0, 1, 2].map(|axis| self.ordinate(from.map(|from| from[axis]), at[axis], self.units[axis]));
        self.decoded.push(position);
        moves.iter().for_each(|moves| self.bits.put(u32::from(*moves), 1));
    }

    /// Writes an ordinate, by the shortest code that holds it; gives what a reader makes of it.
    fn ordinate(&mut self, from: Option<f32>, at: f32, unit: f64) -> f32 {
        let near = from.and_then(|from| {
            let parts = if unit > 0.0 {
                ((f64::from(at) - f64::from(from)) / unit).round()
            } else {
                0.0
            };
            let fits = parts >= f64::from(i16::MIN) && parts <= f64::from(i16::MAX) && (unit > 0.0 || at == from);
            fits.then_some((from, parts as i16))
        });
        let Some((from, parts)) = near else {
            self.bits.put(0b111, 3);
            self.bits.put(at.to_bits(), 32);
            return at;
        };
        if parts == 0 {
            self.bits.put(0b110, 3);
            return from;
        }
        match i8::try_from(parts) {
            Ok(few) => {
                self.bits.put(0b10, 2);
                self.bits.put(u32::from(few as u8), 8);
            }
            Err(_) => {
                self.bits.put(0, 1);
                self.bits.put(u32::from(parts as u16), 16);
            }
        }
        (f64::from(from) + f64::from(parts) * unit) as f32
    }
}

/// Bits, the highest of each byte first.
#[derive(Default)]
struct Bits {
    bytes: Vec<u8>,
    count: usize,
}

impl Bits {
    fn put(&mut self, number: u32, bits: u32) {
        for bit in (0..bits).rev() {
            if self.count.is_multiple_of(8) {
                self.bytes.push(0);
            }
            let last = self.bytes.len() - 1;
            self.bytes[last] |= ((number >> bit & 1) as u8) << (7 - self.count % 8);
            self.count += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use belvedere_scene::smooth::thesis::{ThesisMesh, decode};
    use proptest::prelude::*;

    use super::*;

    fn mesh(positions: Vec<[i32; 3]>, triangles: Vec<[u32; 3]>, materials: Vec<u16>) -> QuantisedMesh {
        QuantisedMesh {
            bits: 14,
            origin: [-3.0, 0.0, 5.0],
            step: 0.01,
            positions,
            triangles,
            materials,
            ..QuantisedMesh::default()
        }
    }

    /// Triangles by the places of their corners, turned so that the smallest comes first.
    fn shapes(corners: impl Iterator<Item = ([[i64; 3]; 3], u16)>) -> Vec<([[i64; 3]; 3], u16)> {
        let mut shapes: Vec<_> = corners
            .map(|(mut corners, material)| {
                let first = (0..3).min_by_key(|i| corners[*i]).unwrap_or(0);
                corners.rotate_left(first);
                (corners, material)
            })
            .collect();
        shapes.sort_unstable();
        shapes
    }

    fn shapes_of(mesh: &QuantisedMesh) -> Vec<([[i64; 3]; 3], u16)> {
        let place = |v: u32| mesh.positions[v as usize].map(i64::from);
        shapes(
            mesh.triangles
                .iter()
                .zip(&mesh.materials)
                .map(|(t, m)| (t.map(place), *m)),
        )
    }

    fn shapes_told(told: &ThesisMesh, mesh: &QuantisedMesh) -> Vec<([[i64; 3]; 3], u16)> {
        let place = |v: u32| {
            let at = told.positions[v as usize];
            [0, 1, 2].map(|i| ((f64::from(at[i]) - f64::from(mesh.origin[i])) / f64::from(mesh.step)).round() as i64)
        };
        let triangles = told.triangles.iter().zip(&told.materials);
        shapes(triangles.map(|(t, m)| (t.map(place), u16::from(*m))))
    }

    /// Any triangles over places of a small lattice, doublets and edges of many triangles among them.
    fn any_mesh() -> impl Strategy<Value = QuantisedMesh> {
        let places = prop::collection::hash_set([0i32..40, 0i32..40, 0i32..40], 3..40);
        (
            places,
            prop::collection::vec(([any::<u32>(), any::<u32>(), any::<u32>()], 0u16..3), 1..120),
        )
            .prop_map(|(places, triangles)| {
                let count = places.len() as u32;
                let corners = triangles
                    .into_iter()
                    .map(|(t, material)| (t.map(|v| v % count), material));
                let proper = corners.filter(|([a, b, c], _)| a != b && b != c && c != a);
                let (triangles, materials) = proper.unzip();
                let mut places: Vec<_> = places.into_iter().collect();
                places.sort_unstable();
                mesh(places, triangles, materials)
            })
    }

    proptest! {
        #[test]
        fn all_of_it_is_the_mesh_and_any_beginning_is_one(mesh in any_mesh()) {
            let bytes = encode(&mesh).unwrap();
            let told = decode(&bytes).unwrap();
            prop_assert_eq!(told.positions.len(), mesh.positions.len());
            prop_assert_eq!(shapes_told(&told, &mesh), shapes_of(&mesh));
            let mut triangles = 0;
            for end in 16..bytes.len() {
                let told = decode(&bytes[..end]).unwrap();
                prop_assert!(told.triangles.len() >= triangles);
                triangles = told.triangles.len();
            }
        }

        #[test]
        fn flipped_bits_are_an_error_or_some_mesh(mesh in any_mesh(), place in any::<usize>(), bit in 0u8..8) {
            let mut bytes = encode(&mesh).unwrap();
            let place = place % bytes.len();
            bytes[place] ^= 1 << bit;
            if let Ok(told) = decode(&bytes) {
                prop_assert!(told.triangles.iter().flatten().all(|v| (*v as usize) < told.positions.len()));
            }
        }
    }

    #[test]
    fn a_mesh_of_too_many_materials_has_no_packets() {
        assert_eq!(encode(&mesh(vec![[0; 3]], Vec::new(), vec![256])), None);
    }
}
