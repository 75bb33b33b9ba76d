//! Which models get a smooth LOD, how fine, and how far is each of its rungs from the source?
//!
//! * **Which**: triangles only, and at least [`LEAST_TRIANGLES`] of them: fewer cost about as much as the request that
//!   fetches them. The stream must hold all that is drawn, so there is none where only some primitives have normals
//!   (the others are drawn flat) or where there are more sets of texture coordinates than it has room for; and it must
//!   be smaller than a plain file of the same triangles. Parts of a mesh that was cut are each coarsened by themselves and on a
//!   lattice of their own: where they meet they gape by what both are off.
//! * **How fine**: 14 bits, and up to 16 where the lattice's step would be above [`STEP_M`] in the world; texture
//!   coordinates 12 bits, and more where a step would be above 1/4096 of a picture that is repeated; colours 8 bits where they are
//!   bytes, else 12, and more where a step would be above 1/4096 of white. Where [`MOST_ATTRIBUTE_BITS`] are too few, there is none.
//! * **How far**: measured as levels are ([`crate::lod`]): the same upper bound of the two-sided Hausdorff distance between the source
//!   and what a decoder draws after the rung's last byte or, where that is more, how far off is what is painted on it.

use belvedere_scene::smooth::{Decoder, Header, SmoothError};

use super::drawn;
use super::quantise::{MOST_ATTRIBUTE_BITS, MOST_UV_SETS, Precision, QuantisedMesh, materials as used_materials};
use crate::lod::error::{HausdorffLimits, hausdorff_bound_of};
use crate::lod::{LodSettings, looks::Looks, proximity::ShapeTree};
use crate::pictures::texels::pictures_a_unit;
use crate::source::{Material, Primitive, SourceModel, Topology};

/// Models with fewer triangles get none.
pub const LEAST_TRIANGLES: usize = 500;
/// The lattice is at least so fine, in metres in the world, where 16 bits are enough for that.
pub const STEP_M: f64 = 0.001;
/// Texture coordinates and colours are told in steps of at most this, of a picture and of white: half of one moves what is dark
/// by less than half a step of 255 in sRGB.
const ATTRIBUTE_STEP: f64 = 1.0 / 4095.0;

/// Whether a smooth LOD can hold this model and is worth having.
#[must_use]
pub fn is_worthwhile(model: &SourceModel, materials: &[Material]) -> bool {
    let drawn = || model.primitives.iter().filter(|p| !p.indices.is_empty());
    let with_normals = drawn().filter(|p| !p.normals.is_empty()).count();
    model.triangle_count() >= LEAST_TRIANGLES
        && drawn().all(|p| p.topology == Topology::Triangles && p.uvs.len() <= MOST_UV_SETS)
        && (with_normals == 0 || with_normals == drawn().count())
        && used_materials(model).len() <= usize::from(u16::MAX)
        && tells_attributes(model, materials)
}

/// Whether a stream has bits enough for texture coordinates and colours.
#[must_use]
pub fn tells_attributes(model: &SourceModel, materials: &[Material]) -> bool {
    let most = ATTRIBUTE_STEP * steps(MOST_ATTRIBUTE_BITS);
    reach(model, materials).into_iter().all(|reach| reach <= most)
}

/// How many pictures texture coordinates go over, and how many times as bright as white colours are.
fn reach(model: &SourceModel, materials: &[Material]) -> [f64; 2] {
    let sets = told(model).map(|p| p.uvs.len()).max().unwrap_or(0);
    let pictures = (0..sets).map(|set| {
        let units = longest(told(model).filter_map(|p| p.uvs.get(set)).flatten());
        let shown = told(model).map(|p| pictures_a_unit(p.material.and_then(|m| materials.get(m)), set));
        units * shown.fold(1.0, f64::max)
    });
    let colours = told(model).flat_map(|p| p.colors.as_flattened());
    [
        pictures.fold(0.0, f64::max),
        colours.fold(1.0, |most, x| most.max(f64::from(*x))),
    ]
}

fn steps(bits: u32) -> f64 {
    f64::from((1u32 << bits) - 1)
}

/// How finely a model is rounded of which the largest instance is scaled by `scale`.
#[must_use]
pub fn precision(model: &SourceModel, materials: &[Material], scale: f64) -> Precision {
    let usual = Precision::default();
    let fitting = |(usual, most): (u32, u32), extent: f64, most_step: f64| {
        let is_fine = |bits: &u32| extent <= most_step * steps(*bits);
        (usual..most).find(is_fine).unwrap_or(most)
    };
    let of_attribute = |usual, reach| fitting((usual, MOST_ATTRIBUTE_BITS), reach, ATTRIBUTE_STEP);
    let [pictures, whites] = reach(model, materials);
    Precision {
        position_bits: fitting((usual.position_bits, 16), scale * longest(positions(model)), STEP_M),
        uv_bits: of_attribute(usual.uv_bits, pictures),
        colour_bits: of_attribute(usual.colour_bits, whites),
        ..usual
    }
}

/// Bytes of the vertices and indices in a plain GLB.
#[must_use]
pub fn plain_bytes(model: &SourceModel) -> usize {
    crate::lod::geometry_bytes(&model.primitives)
}

/// What a stream holds of a model: neither lines nor points.
fn told(model: &SourceModel) -> impl Iterator<Item = &Primitive> {
    model.primitives.iter().filter(|p| p.topology == Topology::Triangles)
}

fn positions(model: &SourceModel) -> impl Iterator<Item = &[f32; 3]> {
    told(model).flat_map(|p| &p.positions)
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

/// For each cut of a smooth LOD: no point of the model's triangles is farther from the mesh that those bytes give, nor
/// the reverse; more where what is painted is farther off. In model-space units; never rises from cut to cut. Of the whole stream it
/// is the distance alone: what is painted there is the source's but for rounding.
///
/// # Errors
/// When the bytes are not a smooth LOD.
pub fn geometric_errors(
    model: &SourceModel,
    mesh: &QuantisedMesh,
    bytes: &[u8],
    settings: &LodSettings,
) -> Result<Vec<f64>, SmoothError> {
    let mut decoder = Decoder::new(u64::MAX);
    let source = ShapeTree::of(told(model));
    let looks = Looks::of(&model.primitives, &settings.pictured);
    let materials = used_materials(model);
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
        let drawn = drawn::primitives(decoder.snapshot(), &materials);
        let tree = ShapeTree::of(&drawn);
        let distance = hausdorff_bound_of(&source, &tree, settings.error_limits);
        let looks = looks.as_ref().filter(|_| end < bytes.len());
        errors.push(looks.map_or(distance, |looks| distance.max(looks.error_of(&drawn, &tree))));
    }
    let mut worst = 0.0;
    for error in errors.iter_mut().rev() {
        worst = f64::max(worst, *error);
        *error = worst;
    }
    Ok(errors)
}

/// Whether the whole stream, of this error, is as near to the model as rounding leaves it. It is not where a triangle that rounding
/// left without area, such as a thin rod's, was all that stood in its place.
#[must_use]
pub fn is_whole(model: &SourceModel, mesh: &QuantisedMesh, error: f64, limits: HausdorffLimits) -> bool {
    // Measured errors are above the true ones by as much as this.
    let slack = limits.of_diagonal * longest(positions(model));
    error <= 4.0 * rounding(model, mesh).max(slack)
}

/// How far a corner may be from where it was: half a step on each axis, and what f32 cannot say.
fn rounding(model: &SourceModel, mesh: &QuantisedMesh) -> f64 {
    let farthest = positions(model)
        .flatten()
        .fold(0.0, |far, x| f64::max(far, f64::from(*x).abs()));
    3f64.sqrt() * (0.5 * f64::from(mesh.step) * (1.0 + 1e-6) + farthest * f64::from(f32::EPSILON))
}
