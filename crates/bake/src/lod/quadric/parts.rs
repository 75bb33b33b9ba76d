//! Which triangles that are left are whose?
//!
//! A simplified model goes back to its primitives: vertices that moved with their new attributes, all others bit for bit
//! as they were. Where a collapse has crossed the border between two primitives, a triangle has corners of both. It belongs
//! to the one that has most of them, which has a vertex of its own, with attributes of its own, in the place of the other's.

use std::collections::BTreeSet;

use glam::DVec3;

use super::{QuadricSource, Simplified};
use crate::lod::collapse::Collapsed;
use crate::lod::octree::{position_bits, to_f64};
use crate::source::Primitive;

/// A vertex whose attributes a corner has, and one that tells where it is.
type Corner = [u32; 2];

impl QuadricSource<'_> {
    /// Gives triangles back to their primitives, each once.
    pub(super) fn mesh(&self, simplified: &Simplified) -> Collapsed {
        let mut of_primitive = vec![(Vec::new(), Vec::new()); self.primitives.len()];
        let mut seen = BTreeSet::new();
        for triangle in simplified.indices.as_chunks::<3>().0 {
            let p = self.owner(*triangle);
            let places = triangle.map(|v| self.place(simplified, v));
            if has_area(places.map(to_f64)) && seen.insert(self.key(p, places)) {
                let (corners, origins) = &mut of_primitive[p];
                corners.extend(triangle.map(|v| [self.giver(p, v, *triangle), v]));
                origins.push(self.shape_at[triangle[0] as usize]);
            }
        }
        let mut mesh = Collapsed::default();
        for (p, (corners, origins)) in of_primitive.into_iter().enumerate() {
            if !corners.is_empty() {
                mesh.primitives.push(self.primitive(p, &corners, simplified));
                mesh.origins.extend(origins);
            }
        }
        mesh
    }

    /// The primitive of most corners, or of the first.
    fn owner(&self, triangle: [u32; 3]) -> usize {
        let [a, b, c] = triangle.map(|v| self.primitive_of(v));
        if b == c { b } else { a }
    }

    /// The vertex of a primitive that a corner gets its attributes from: the corner itself, one in its place, or else another
    /// corner.
    fn giver(&self, p: usize, corner: u32, triangle: [u32; 3]) -> u32 {
        let own = &self.vertices_of[p];
        if own.contains(&corner) {
            return corner;
        }
        let place = position_bits(self.positions[corner as usize]);
        let first = self.places.partition_point(|here| *here < (place, own.start));
        let here = self.places.get(first).filter(|here| here.0 == place);
        let candidates = here.map(|here| here.1).into_iter().chain(triangle);
        candidates.into_iter().find(|v| own.contains(v)).unwrap_or(own.start)
    }

    /// Some triangles of a primitive with their vertices where they are now.
    fn primitive(&self, p: usize, corners: &[Corner], simplified: &Simplified) -> Primitive {
        let mut vertices = corners.to_vec();
        vertices.sort_unstable();
        vertices.dedup();
        let indices = corners
            .iter()
            .map(|corner| vertices.partition_point(|v| v < corner) as u32);
        let givers: Vec<u32> = vertices
            .iter()
            .map(|[giver, _]| giver - self.vertices_of[p].start)
            .collect();
        let mut part = self.primitives[p].picked(&givers, indices.collect());
        for (v, [giver, at]) in vertices.into_iter().enumerate() {
            part.positions[v] = self.place(simplified, at);
            if giver == at && self.is_moved(simplified, at) {
                let width = self.attributes.width();
                let row = &simplified.rows[at as usize * width..][..width];
                self.allowed[p].write(row, &mut part, v);
            }
        }
        part
    }

    /// Where a vertex is now.
    fn place(&self, simplified: &Simplified, vertex: u32) -> [f32; 3] {
        if self.is_moved(simplified, vertex) {
            self.root.position(simplified.positions[vertex as usize])
        } else {
            self.position(vertex)
        }
    }

    fn is_moved(&self, simplified: &Simplified, vertex: u32) -> bool {
        let now = simplified.positions[vertex as usize];
        now != self.positions[vertex as usize] && now.iter().all(|x| x.is_finite())
    }

    /// Equal for doublets: corners from the first on, or in any order when both sides are drawn.
    fn key(&self, primitive: usize, places: [[f32; 3]; 3]) -> (Option<usize>, [[u32; 3]; 3]) {
        let material = self.primitives[primitive].material;
        let mut places = places.map(position_bits);
        if material.is_some_and(|m| self.double_sided.contains(&m)) {
            places.sort_unstable();
        } else {
            let first = (0..3).min_by_key(|&corner| places[corner]).unwrap_or_default();
            places.rotate_left(first);
        }
        (material, places)
    }
}

fn has_area([a, b, c]: [DVec3; 3]) -> bool {
    (b - a).cross(c - a) != DVec3::ZERO
}
