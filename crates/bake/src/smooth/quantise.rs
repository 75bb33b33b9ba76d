//! What exactly does a smooth LOD hold? Triangles over welded vertices on a lattice, and wedges at their corners.
//!
//! Positions are rounded to a lattice of 2^bits places along the longest side of the model's box; those that fall
//! together become one vertex. Attributes are rounded too; corners of one vertex with the same values share a wedge.
//! Triangles that lose their area in that, by having a corner twice, are left out and counted. Lines and points have no
//! smooth LOD; tangents are left to whoever draws.

use std::collections::BTreeMap;

use belvedere_scene::smooth::attributes::{Channel, ChannelKind};
use belvedere_scene::smooth::octahedron;

use crate::source::{Primitive, SourceModel, Topology};

/// More sets of texture coordinates are left out.
pub const MOST_UV_SETS: usize = 4;
/// Most bits of a texture coordinate or a colour: with 24, single precision would end.
pub const MOST_ATTRIBUTE_BITS: u32 = 20;

/// How finely a model is rounded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Precision {
    /// Bits of a coordinate, 1 to 16.
    pub position_bits: u32,
    /// Bits of a texture coordinate, 1 to [`MOST_ATTRIBUTE_BITS`].
    pub uv_bits: u32,
    /// Bits of a colour's part, 1 to [`MOST_ATTRIBUTE_BITS`]; 8 where all colours are exactly bytes.
    pub colour_bits: u32,
    /// Whether there shall be normals, texture coordinates and colours.
    pub with_attributes: bool,
}

impl Default for Precision {
    fn default() -> Self {
        Self {
            position_bits: 14,
            uv_bits: 12,
            colour_bits: 12,
            with_attributes: true,
        }
    }
}

/// Triangles on a lattice.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct QuantisedMesh {
    /// Bits of a coordinate.
    pub bits: u32,
    /// Where the lattice begins, in model space.
    pub origin: [f32; 3],
    /// Its step, in model-space units.
    pub step: f32,
    /// Each once.
    pub positions: Vec<[i32; 3]>,
    /// Corners, all different; the same triangle may stand here several times.
    pub triangles: Vec<[u32; 3]>,
    /// Of each triangle.
    pub materials: Vec<u16>,
    /// What the numbers of a wedge are; none without attributes.
    pub channels: Vec<Channel>,
    /// Numbers of wedges, one wedge after the other.
    pub values: Vec<i32>,
    /// Wedges of the triangles' corners; empty without attributes.
    pub corners: Vec<[u32; 3]>,
    /// Triangles of the source that had a corner twice.
    pub degenerate: usize,
}

impl QuantisedMesh {
    /// Twice its positions, as a decoder gives them.
    #[must_use]
    pub fn twice_positions(&self) -> Vec<[i32; 3]> {
        self.positions.iter().map(|p| p.map(|x| 2 * x)).collect()
    }

    /// Rounds a model's triangles. A triangle's material is a position in [`materials`].
    #[must_use]
    pub fn new(model: &SourceModel, precision: Precision) -> Self {
        let primitives: Vec<&Primitive> = model
            .primitives
            .iter()
            .filter(|p| p.topology == Topology::Triangles)
            .collect();
        let (low, high) = range(primitives.iter().flat_map(|p| &p.positions));
        let extent = (0..3)
            .map(|i| f64::from(high[i]) - f64::from(low[i]))
            .fold(0.0, f64::max);
        let last = f64::from((1u32 << precision.position_bits) - 1);
        let step = if extent > 0.0 { (extent / last) as f32 } else { 0.0 };
        let channels = if precision.with_attributes {
            channels(&primitives, precision)
        } else {
            Vec::new()
        };
        let mut mesh = Self {
            bits: precision.position_bits,
            origin: if low[0].is_finite() { low } else { [0.0; 3] },
            step,
            channels,
            ..Self::default()
        };
        let mut vertices: BTreeMap<[i32; 3], u32> = BTreeMap::new();
        let mut wedges: BTreeMap<(u32, Vec<i32>), u32> = BTreeMap::new();
        let materials = materials(model);
        for primitive in primitives {
            let material = materials.iter().position(|m| *m == primitive.material).unwrap_or(0);
            let rounded: Vec<(u32, u32)> = (0..primitive.positions.len())
                .map(|i| {
                    let vertex = mesh.vertex(&mut vertices, primitive.positions[i], last as i32);
                    let values = mesh.values_of(primitive, i);
                    let next = wedges.len() as u32;
                    let wedge = *wedges.entry((vertex, values)).or_insert_with_key(|(_, values)| {
                        mesh.values.extend(values);
                        next
                    });
                    (vertex, wedge)
                })
                .collect();
            for &corners in primitive.indices.as_chunks::<3>().0 {
                let corners = corners.map(|i| rounded[i as usize]);
                let [a, b, c] = corners.map(|(vertex, _)| vertex);
                if a == b || b == c || c == a {
                    mesh.degenerate += 1;
                    continue;
                }
                mesh.triangles.push([a, b, c]);
                mesh.materials.push(material.min(usize::from(u16::MAX)) as u16);
                if !mesh.channels.is_empty() {
                    mesh.corners.push(corners.map(|(_, wedge)| wedge));
                }
            }
        }
        mesh.drop_unused();
        mesh
    }

    fn vertex(&mut self, known: &mut BTreeMap<[i32; 3], u32>, at: [f32; 3], last: i32) -> u32 {
        let round = |i: usize| {
            let steps = (f64::from(at[i]) - f64::from(self.origin[i])) / f64::from(self.step);
            if self.step > 0.0 {
                (steps.round() as i32).clamp(0, last)
            } else {
                0
            }
        };
        let at = [round(0), round(1), round(2)];
        *known.entry(at).or_insert_with(|| {
            self.positions.push(at);
            self.positions.len() as u32 - 1
        })
    }

    fn values_of(&self, primitive: &Primitive, i: usize) -> Vec<i32> {
        let mut values = Vec::new();
        let mut set = 0;
        let round = |x: f32, low: f32, step: f32| {
            if step > 0.0 {
                ((f64::from(x) - f64::from(low)) / f64::from(step)).round() as i32
            } else {
                0
            }
        };
        for channel in &self.channels {
            match channel.kind {
                ChannelKind::Normal => {
                    let normal = primitive.normals.get(i).copied().unwrap_or([0.0, 0.0, 1.0]);
                    values.extend(octahedron::nearest(normal.map(|x| (x * 65536.0) as i32)));
                }
                ChannelKind::Uv => {
                    let uv = primitive
                        .uvs
                        .get(set)
                        .and_then(|uvs| uvs.get(i))
                        .copied()
                        .unwrap_or_default();
                    values.extend((0..2).map(|k| round(uv[k], channel.low[k], channel.step[k])));
                    set += 1;
                }
                ChannelKind::Colour => {
                    let colour = primitive.colors.get(i).copied().unwrap_or([1.0; 4]);
                    values.extend(colour.map(|x| round(x, channel.low[0], channel.step[0])));
                }
            }
        }
        values
    }

    /// Vertices that no triangle has left would never be told.
    fn drop_unused(&mut self) {
        let mut kept = vec![u32::MAX; self.positions.len()];
        let mut positions = Vec::new();
        for corner in self.triangles.iter_mut().flatten() {
            let new = &mut kept[*corner as usize];
            if *new == u32::MAX {
                *new = positions.len() as u32;
                positions.push(self.positions[*corner as usize]);
            }
            *corner = *new;
        }
        self.positions = positions;
    }

    /// Numbers of a wedge.
    #[must_use]
    pub fn stride(&self) -> usize {
        self.channels.iter().map(|channel| channel.kind.numbers()).sum()
    }
}

/// The materials of a model's triangles, each once, in order of first use.
#[must_use]
pub fn materials(model: &SourceModel) -> Vec<Option<usize>> {
    let mut materials = Vec::new();
    for primitive in model.primitives.iter().filter(|p| !p.indices.is_empty()) {
        if primitive.topology == Topology::Triangles && !materials.contains(&primitive.material) {
            materials.push(primitive.material);
        }
    }
    materials
}

/// What the primitives have, each at least one of them.
fn channels(primitives: &[&Primitive], precision: Precision) -> Vec<Channel> {
    let steps = |bits: u32| ((1u32 << bits) - 1) as f32;
    let mut channels = Vec::new();
    let mut add = |kind, low: [f32; 2], high: [f32; 2], last: f32| {
        channels.push(Channel {
            kind,
            low,
            step: [0, 1].map(|i| (high[i] - low[i]) / last),
        });
    };
    if primitives.iter().any(|p| !p.normals.is_empty()) {
        add(ChannelKind::Normal, [0.0; 2], [0.0; 2], 1.0);
    }
    let sets = primitives.iter().map(|p| p.uvs.len()).max().unwrap_or(0);
    for set in 0..sets.min(MOST_UV_SETS) {
        let (low, high) = range(primitives.iter().filter_map(|p| p.uvs.get(set)).flatten());
        if low[0] <= high[0] {
            add(ChannelKind::Uv, low, high, steps(precision.uv_bits));
        }
    }
    if primitives.iter().any(|p| !p.colors.is_empty()) {
        let colors = || primitives.iter().flat_map(|p| &p.colors);
        let (_, high) = range(colors());
        let most = high.into_iter().fold(1.0, f32::max);
        let is_byte = |x: &f32| (0.0..=1.0).contains(x) && (x * 255.0).round() / 255.0 == *x;
        let bits = if colors().flatten().all(is_byte) {
            8
        } else {
            precision.colour_bits
        };
        add(ChannelKind::Colour, [0.0; 2], [most; 2], steps(bits));
    }
    channels
}

fn range<'a, const N: usize>(values: impl Iterator<Item = &'a [f32; N]>) -> ([f32; N], [f32; N]) {
    values.fold(([f32::INFINITY; N], [f32::NEG_INFINITY; N]), |(low, high), v| {
        (
            std::array::from_fn(|i| low[i].min(v[i])),
            std::array::from_fn(|i| high[i].max(v[i])),
        )
    })
}
