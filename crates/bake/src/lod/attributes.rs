//! What does a vertex carry besides its place, as a row of numbers?
//!
//! Normals, tangents, colours and texture coordinates of all primitives stand in rows of one width, so that a simplifier can
//! weigh them beside distances, and tell what they are where it has put a vertex. Weights are in units of the model's
//! extent. What comes back is made valid: normals and tangents are unit vectors, tangents keep their handedness and stand
//! across the normal, colours and texture coordinates stay in the box of those that the primitive has.

use std::ops::Range;

use glam::Vec3;

use crate::source::Primitive;

const NORMAL: Range<usize> = 0..3;
const TANGENT: Range<usize> = 3..6;
const COLOR: Range<usize> = 6..10;
/// The digits of a material's number, so that any two differ by at least one.
const MATERIAL: Range<usize> = 10..16;
/// Where the sets of texture coordinates begin.
const UV: usize = 16;
/// As many as fit into the 32 numbers that the simplifier takes.
const MOST_UV_SETS: usize = 8;

/// What a unit of each attribute counts beside the model's extent.
const NORMAL_WEIGHT: f32 = 0.1;
const UV_WEIGHT: f32 = 0.1;
const COLOR_WEIGHT: f32 = 0.1;
/// More, since a border between two colours is seen from farther than a crease.
const MATERIAL_WEIGHT: f32 = 0.3;
/// For what follows the others: it is told anew where a vertex moves, and is no reason to keep one.
const FOLLOWING_WEIGHT: f32 = 1e-4;

/// A row for each vertex of some primitives, one after the other.
pub(super) struct Attributes {
    pub(super) rows: Vec<f32>,
    pub(super) weights: Vec<f32>,
}

impl Attributes {
    pub(super) fn of(primitives: &[Primitive]) -> Self {
        let sets = primitives.iter().map(|p| p.uvs.len()).max().unwrap_or_default();
        let weights = weights(primitives, sets.min(MOST_UV_SETS));
        let mut rows = vec![0.0; weights.len() * primitives.iter().map(|p| p.positions.len()).sum::<usize>()];
        let materials = numbered(primitives);
        let base = digits_for(materials.len());
        let mut of_vertices = rows.chunks_exact_mut(weights.len());
        for primitive in primitives {
            let material = materials.partition_point(|m| *m < primitive.material);
            for (v, row) in (0..primitive.positions.len()).zip(&mut of_vertices) {
                read(primitive, v, row);
                let mut left = material;
                for digit in &mut row[MATERIAL] {
                    *digit = (left % base) as f32;
                    left /= base;
                }
            }
        }
        Self { rows, weights }
    }

    pub(super) fn width(&self) -> usize {
        self.weights.len()
    }
}

/// All materials, each once.
fn numbered(primitives: &[Primitive]) -> Vec<Option<usize>> {
    let mut materials: Vec<Option<usize>> = primitives.iter().map(|p| p.material).collect();
    materials.sort_unstable();
    materials.dedup();
    materials
}

/// The least base, from two on, in which so many numbers have as many digits as there is room for.
fn digits_for(materials: usize) -> usize {
    let fits = |base: &usize| base.pow(MATERIAL.len() as u32) >= materials;
    (2..).find(fits).unwrap_or(materials)
}

fn weights(primitives: &[Primitive], sets: usize) -> Vec<f32> {
    let mut weights = vec![0.0; UV + 2 * sets];
    let mut weigh = |columns: Range<usize>, is_there: fn(&Primitive) -> bool, weight: f32| {
        if primitives.iter().any(is_there) {
            weights[columns].fill(weight);
        }
    };
    weigh(NORMAL, |p| !p.normals.is_empty(), NORMAL_WEIGHT);
    weigh(TANGENT, |p| !p.tangents.is_empty(), FOLLOWING_WEIGHT);
    weigh(COLOR, |p| !p.colors.is_empty(), COLOR_WEIGHT);
    let materials = numbered(primitives).len();
    let digits = (materials.next_power_of_two().ilog2() as usize).min(MATERIAL.len());
    weights[MATERIAL][..digits].fill(MATERIAL_WEIGHT);
    for set in 0..sets {
        let uvs = primitives.iter().filter_map(|p| p.uvs.get(set)).flatten();
        let (low, high) = bounds(uvs);
        let extent = (high[0] - low[0]).max(high[1] - low[1]);
        let weight = if set == 0 { UV_WEIGHT } else { FOLLOWING_WEIGHT };
        if extent > 0.0 {
            weights[UV + 2 * set..][..2].fill(weight / extent);
        }
    }
    weights
}

fn read(primitive: &Primitive, v: usize, row: &mut [f32]) {
    if let Some(normal) = primitive.normals.get(v) {
        row[NORMAL].copy_from_slice(normal);
    }
    if let Some(tangent) = primitive.tangents.get(v) {
        row[TANGENT].copy_from_slice(&tangent[..3]);
    }
    if let Some(color) = primitive.colors.get(v) {
        row[COLOR].copy_from_slice(color);
    }
    for (uv, set) in row[UV..].as_chunks_mut::<2>().0.iter_mut().zip(&primitive.uvs) {
        if let Some(known) = set.get(v) {
            *uv = *known;
        }
    }
}

/// What the attributes of a primitive may be.
pub(super) struct Allowed {
    colors: ([f32; 4], [f32; 4]),
    uvs: Vec<([f32; 2], [f32; 2])>,
}

impl Allowed {
    pub(super) fn of(primitive: &Primitive) -> Self {
        Self {
            colors: bounds(&primitive.colors),
            uvs: primitive.uvs.iter().map(bounds).collect(),
        }
    }

    /// Gives a vertex what a row says. What no row can say stays.
    pub(super) fn write(&self, row: &[f32], primitive: &mut Primitive, v: usize) {
        if row.iter().any(|x| !x.is_finite()) {
            return;
        }
        if let Some(normal) = primitive.normals.get_mut(v) {
            *normal = unit(Vec3::from_slice(&row[NORMAL])).map_or(*normal, |n| n.to_array());
        }
        if let Some(tangent) = primitive.tangents.get_mut(v) {
            let normal = primitive.normals.get(v).copied().map(Vec3::from_array);
            let along = Vec3::from_slice(&row[TANGENT]);
            let across = normal.map_or(along, |normal| along.reject_from_normalized(normal));
            if let Some(direction) = unit(across) {
                tangent[..3].copy_from_slice(&direction.to_array());
            }
        }
        if let Some(color) = primitive.colors.get_mut(v) {
            color.copy_from_slice(&row[COLOR]);
            clamp(color, &self.colors);
        }
        let uvs = row[UV..].as_chunks::<2>().0.iter().zip(&self.uvs);
        for (set, (uv, allowed)) in primitive.uvs.iter_mut().zip(uvs) {
            if let Some(known) = set.get_mut(v) {
                *known = *uv;
                clamp(known, allowed);
            }
        }
    }
}

fn unit(v: Vec3) -> Option<Vec3> {
    v.as_dvec3().try_normalize().map(|v| v.as_vec3())
}

fn bounds<'a, const N: usize>(all: impl IntoIterator<Item = &'a [f32; N]>) -> ([f32; N], [f32; N]) {
    all.into_iter()
        .fold(([f32::MAX; N], [f32::MIN; N]), |(low, high), value| {
            let pick = |pick: fn(f32, f32) -> f32, known: [f32; N]| std::array::from_fn(|i| pick(known[i], value[i]));
            (pick(f32::min, low), pick(f32::max, high))
        })
}

fn clamp<const N: usize>(value: &mut [f32; N], (low, high): &([f32; N], [f32; N])) {
    *value = std::array::from_fn(|i| value[i].max(low[i]).min(high[i]));
}
