//! What exactly does a smooth LOD hold? Triangles over welded vertices on a lattice.
//!
//! Positions are rounded to a lattice of 2^bits places along the longest side of the model's box; those that fall
//! together become one vertex. Triangles that lose their area in that, by having a corner twice, are left out and
//! counted. Lines and points have no smooth LOD.

use std::collections::HashMap;

use crate::source::{SourceModel, Topology};

/// Triangles on a lattice.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct QuantisedMesh {
    /// Bits of a coordinate.
    pub bits: u32,
    /// Each once.
    pub positions: Vec<[i32; 3]>,
    /// Corners, all different; the same triangle may stand here several times.
    pub triangles: Vec<[u32; 3]>,
    /// Triangles of the source that had a corner twice.
    pub degenerate: usize,
}

impl QuantisedMesh {
    /// Rounds a model's triangles.
    #[must_use]
    pub fn new(model: &SourceModel, bits: u32) -> Self {
        let triangles = || model.primitives.iter().filter(|p| p.topology == Topology::Triangles);
        let points = || triangles().flat_map(|p| &p.positions);
        let low = points().fold([f32::INFINITY; 3], |low, p| std::array::from_fn(|i| low[i].min(p[i])));
        let high = points().fold([f32::NEG_INFINITY; 3], |high, p| std::array::from_fn(|i| high[i].max(p[i])));
        let extent = (0..3).map(|i| f64::from(high[i]) - f64::from(low[i])).fold(0.0, f64::max);
        let last = f64::from((1u32 << bits) - 1);
        let scale = if extent > 0.0 { last / extent } else { 0.0 };
        let mut mesh = Self {
            bits,
            ..Self::default()
        };
        let mut known: HashMap<[i32; 3], u32> = HashMap::new();
        for primitive in triangles() {
            let vertices: Vec<u32> = primitive
                .positions
                .iter()
                .map(|p| {
                    let at = std::array::from_fn(|i| ((f64::from(p[i]) - f64::from(low[i])) * scale).round() as i32);
                    *known.entry(at).or_insert_with(|| {
                        mesh.positions.push(at);
                        mesh.positions.len() as u32 - 1
                    })
                })
                .collect();
            for corners in primitive.indices.as_chunks::<3>().0 {
                let [a, b, c] = corners.map(|i| vertices[i as usize]);
                if a == b || b == c || c == a {
                    mesh.degenerate += 1;
                } else {
                    mesh.triangles.push([a, b, c]);
                }
            }
        }
        mesh
    }
}
