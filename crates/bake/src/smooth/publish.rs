//! Which models get a smooth LOD, how fine, and how far is each of its rungs from the source?
//!
//! * **Which**: triangles only, and at least [`LEAST_TRIANGLES`] of them: fewer cost about as much as the request that
//!   fetches them. The stream must hold all that is drawn, so there is none where only some primitives have normals
//!   (the others are drawn flat) or where there are more sets of texture coordinates than it has room for; and it must
//!   be smaller than a plain file of the same triangles.
//! * **How fine**: 14 bits, and up to 16 where the lattice's step would be above [`STEP_M`] in the world; texture
//!   coordinates 12 bits, and up to 16 where a step would be above 1/4096 of a picture that is repeated.
//! * **How far**: the same upper bound of the two-sided Hausdorff distance as that of levels ([`crate::lod::error`]),
//!   between the source and what a decoder draws after the rung's last byte.

use belvedere_scene::smooth::{Decoder, Header, SmoothError, Snapshot};
use glam::DVec3;

use super::quantise::{MOST_UV_SETS, Precision, QuantisedMesh, materials};
use crate::lod::error::{HausdorffLimits, hausdorff_bound_of};
use crate::lod::proximity::{Corners, ShapeTree};
use crate::source::{Primitive, SourceModel, Topology};

/// Models with fewer triangles get none.
pub const LEAST_TRIANGLES: usize = 500;
/// The lattice is at least so fine, in metres in the world, where 16 bits are enough for that.
pub const STEP_M: f64 = 0.001;

/// Whether a smooth LOD can hold this model and is worth having.
#[must_use]
pub fn is_worthwhile(model: &SourceModel) -> bool {
    let drawn = || model.primitives.iter().filter(|p| !p.indices.is_empty());
    let with_normals = drawn().filter(|p| !p.normals.is_empty()).count();
    model.triangle_count() >= LEAST_TRIANGLES
        && drawn().all(|p| p.topology == Topology::Triangles && p.uvs.len() <= MOST_UV_SETS)
        && (with_normals == 0 || with_normals == drawn().count())
        && materials(model).len() <= usize::from(u16::MAX)
}

/// How finely a model is rounded of which the largest instance is scaled by `scale`.
#[must_use]
pub fn precision(model: &SourceModel, scale: f64) -> Precision {
    let usual = Precision::default();
    let fitting = |usual: u32, extent: f64, most_step: f64| {
        let is_fine = |bits: &u32| extent <= most_step * f64::from((1u32 << bits) - 1);
        (usual..16).find(is_fine).unwrap_or(16)
    };
    let uvs = model.primitives.iter().flat_map(|p| p.uvs.iter().flatten());
    Precision {
        position_bits: fitting(
            usual.position_bits,
            scale * longest(positions(&model.primitives)),
            STEP_M,
        ),
        uv_bits: fitting(usual.uv_bits, longest(uvs), 1.0 / 4095.0),
        ..usual
    }
}

/// Bytes of the vertices and indices in a plain GLB.
#[must_use]
pub fn plain_bytes(model: &SourceModel) -> usize {
    crate::lod::geometry_bytes(&model.primitives)
}

fn positions(primitives: &[Primitive]) -> impl Iterator<Item = &[f32; 3]> {
    primitives.iter().flat_map(|p| &p.positions)
}

/// The longest side of the box around some points.
fn longest<'a, const N: usize>(points: impl Iterator<Item = &'a [f32; N]>) -> f64 {
    let nothing = ([f64::INFINITY; N], [f64::NEG_INFINITY; N]);
    let (low, high) = points.fold(nothing, |(low, high), p| {
        let p = p.map(f64::from);
        (
            std::array::from_fn(|i| low[i].min(p[i])),
            std::array::from_fn(|i| high[i].max(p[i])),
        )
    });
    (0..N).map(|i| high[i] - low[i]).fold(0.0, f64::max)
}

/// For each cut of a smooth LOD: no point of the model's surface is farther from the mesh that those bytes give, nor
/// the reverse. In model-space units; never rises from cut to cut.
///
/// # Errors
/// When the bytes are not a smooth LOD.
pub fn geometric_errors(
    model: &SourceModel,
    mesh: &QuantisedMesh,
    bytes: &[u8],
    limits: HausdorffLimits,
) -> Result<Vec<f64>, SmoothError> {
    let mut decoder = Decoder::new(u64::MAX);
    let source = ShapeTree::of(&model.primitives);
    let cuts = Header::read(bytes)?.map_or(Vec::new(), |(header, _)| header.cuts);
    let mut errors = Vec::with_capacity(cuts.len());
    let mut pushed = 0;
    for cut in &cuts {
        let end = cut.bytes as usize;
        if end == bytes.len() && mesh.degenerate == 0 {
            // All that differs is that corners were rounded, and triangles move less than their corners.
            errors.push(rounding(model, mesh));
            break;
        }
        decoder.push(&bytes[pushed..end])?;
        pushed = end;
        errors.push(distance(&source, decoder.snapshot(), limits));
    }
    let mut worst = 0.0;
    for error in errors.iter_mut().rev() {
        worst = f64::max(worst, *error);
        *error = worst;
    }
    Ok(errors)
}

/// How far a corner may be from where it was: half a step on each axis, and what f32 cannot say.
fn rounding(model: &SourceModel, mesh: &QuantisedMesh) -> f64 {
    let farthest = positions(&model.primitives)
        .flatten()
        .fold(0.0, |far, x| f64::max(far, f64::from(*x).abs()));
    3f64.sqrt() * (0.5 * f64::from(mesh.step) * (1.0 + 1e-6) + farthest * f64::from(f32::EPSILON))
}

fn distance(source: &ShapeTree, drawn: Snapshot, limits: HausdorffLimits) -> f64 {
    let corner = |i: u32| DVec3::from_array(drawn.positions[i as usize].map(f64::from));
    let triangles = drawn.indices.iter().flat_map(|corners| corners.as_chunks::<3>().0);
    let shapes: Vec<Corners> = triangles.map(|t| t.map(corner)).collect();
    hausdorff_bound_of(source, &ShapeTree::new(shapes), limits)
}
