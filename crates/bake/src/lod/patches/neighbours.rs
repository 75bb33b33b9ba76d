//! Which triangles hang together by their edges?

use std::collections::BTreeMap;

use glam::DVec3;

use crate::lod::proximity::Corners;

/// An edge of more triangles bounds all of them.
const MOST_AT_AN_EDGE: usize = 8;

/// Which shapes share an edge.
pub(super) struct Neighbours {
    /// Numbers of the corners: equal where they stand in one place.
    pub(super) corners: Vec<[u32; 3]>,
    /// Edges of triangles, those of one place together, each with its triangle.
    edges: Vec<([u32; 2], u32)>,
    /// For each triangle and side where its edge stands there.
    at: Vec<[u32; 3]>,
}

impl Neighbours {
    pub(super) fn of(shapes: &[Corners]) -> Self {
        let mut numbers: BTreeMap<[u64; 3], u32> = BTreeMap::new();
        let mut number = |p: &DVec3| {
            let next = numbers.len() as u32;
            // Both zeros are one place.
            *numbers.entry((*p + 0.0).to_array().map(f64::to_bits)).or_insert(next)
        };
        let corners: Vec<[u32; 3]> = shapes
            .iter()
            .map(|[a, b, c]| [number(a), number(b), number(c)])
            .collect();
        let sides = |ids: &[u32; 3]| [0, 1, 2].map(|i| [ids[i].min(ids[(i + 1) % 3]), ids[i].max(ids[(i + 1) % 3])]);
        let mut edges: Vec<([u32; 2], u32)> = corners
            .iter()
            .zip(0..)
            .flat_map(|(ids, shape)| sides(ids).map(|side| (side, shape)))
            .collect();
        edges.sort_unstable();
        let place = |side: [u32; 2]| edges.partition_point(|(other, _)| *other < side) as u32;
        let at = corners.iter().map(|ids| sides(ids).map(place)).collect();
        Self { corners, edges, at }
    }

    /// Shapes that share an edge with this one, itself among them, but for edges of many.
    pub(super) fn beside(&self, shape: usize) -> impl Iterator<Item = usize> + '_ {
        self.at[shape].iter().flat_map(|first| {
            let edges = &self.edges[*first as usize..];
            let side = edges[0].0;
            let is_shared_by_many = edges.get(MOST_AT_AN_EDGE).is_some_and(|(other, _)| *other == side);
            let edges = if is_shared_by_many { &edges[..0] } else { edges };
            let same = edges.iter().take_while(move |(other, _)| *other == side);
            same.map(|(_, shape)| *shape as usize)
        })
    }
}
