//! What does a glTF primitive draw? Checked geometry: unrolled, in range, finite, compact.
//!
//! Only the vertices that shapes use are read. Whatever is wrong with an optional attribute costs that attribute;
//! whatever is wrong with a shape costs that shape.

use glam::DVec3;

use super::ImportError;
use super::accessors::{Accessor, Component};
use super::attributes;
use super::compression::DracoMesh;
use super::document::Item;
use super::error::{Read, flaw};
use super::reader::Reader;
use super::topology::{compact, unroll, unrolled};
use crate::source::{Primitive, Topology};

/// Texture coordinate sets that are kept.
pub(super) const MAX_UV_SETS: usize = 8;

/// The joints that move a vertex, with their weights: four for each set.
pub(super) type Influences = Vec<[(u32, f32); 4]>;

/// A primitive as read, with what skinning needs.
#[derive(Debug, Default)]
pub(super) struct ReadPrimitive {
    /// The geometry. Its material is an index into the document's list.
    pub(super) primitive: Primitive,
    /// One entry for each set (`JOINTS_n`, `WEIGHTS_n`); in it one for each vertex.
    pub(super) influences: Vec<Influences>,
}

/// What a mesh is read for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wanted<'a> {
    /// Default weights of its morph targets.
    pub(super) morph_weights: &'a [f64],
    /// Whether joints and weights are wanted.
    pub(super) influences: bool,
}

/// An attribute with the morph targets that change it.
struct Morphed {
    base: Accessor,
    targets: Vec<(f32, Accessor)>,
}

impl Morphed {
    fn value(&self, vertex: usize) -> [f32; 3] {
        let mut value = self.base.floats::<3>(vertex);
        for (weight, target) in &self.targets {
            let offset = target.floats::<3>(vertex);
            value = std::array::from_fn(|a| value[a] + weight * offset[a]);
        }
        value
    }
}

/// Where the attributes of a primitive come from.
struct Attributes<'r, 'a> {
    reader: &'r mut Reader<'a>,
    item: Item<'a>,
    draco: Option<(DracoMesh, Item<'a>)>,
    targets: Vec<(f32, Item<'a>)>,
    /// How many vertices there are; shorter attributes are refused.
    vertex_count: usize,
}

impl<'a> Attributes<'_, 'a> {
    fn open(&mut self, attributes: &Item<'a>, key: &str, components: &[usize]) -> Read<Option<Accessor>> {
        let Some(index) = attributes.index(key)? else {
            return Ok(None);
        };
        let accessor = match &self.draco {
            Some((mesh, extension)) if attributes.place == self.item.place => match extension.index(key)? {
                Some(id) => mesh.attribute(id, &self.reader.root.listed("accessors", index)?)?,
                None => self.reader.accessor(index)?,
            },
            _ => self.reader.accessor(index)?,
        };
        let place = || format!("{}/{key}", attributes.place);
        if !components.contains(&accessor.layout.components) {
            return flaw("attribute of the wrong type: left out", place());
        }
        if accessor.count < self.vertex_count {
            let facts = format!("{}: {} for {} vertices", place(), accessor.count, self.vertex_count);
            return flaw(
                "attribute with fewer elements than there are positions: left out",
                facts,
            );
        }
        Ok(Some(accessor))
    }

    /// An optional attribute; what is wrong with it is counted.
    fn optional(&mut self, key: &str, components: &[usize]) -> Result<Option<Accessor>, ImportError> {
        let item = self.item.clone();
        let opened = self.open(&item, key, components);
        Ok(self.reader.settle(opened)?.flatten())
    }

    /// An attribute with its morph targets.
    fn morphed(&mut self, key: &str, base: Accessor) -> Result<Morphed, ImportError> {
        let mut targets = Vec::new();
        for (weight, item) in self.targets.clone() {
            let opened = self.open(&item, key, &[3]);
            if let Some(accessor) = self.reader.settle(opened)?.flatten() {
                targets.push((weight, accessor));
            }
        }
        Ok(Morphed { base, targets })
    }
}

/// Reads one primitive; `None` when nothing of it is left.
pub(super) fn read<'a>(reader: &mut Reader<'a>, item: &Item<'a>, wanted: Wanted) -> Read<Option<ReadPrimitive>> {
    let attributes = item.needed("attributes")?;
    let draco = open_draco(reader, item, &attributes)?;
    let targets = morph_targets(reader, item, wanted.morph_weights)?;
    let mut from = Attributes {
        reader,
        item: attributes.clone(),
        draco,
        targets,
        vertex_count: 0,
    };
    let Some(positions) = from.open(&attributes, "POSITION", &[3])? else {
        return flaw("primitive without positions: dropped", item.place.clone());
    };
    from.vertex_count = positions.count;
    let positions = from.morphed("POSITION", positions)?;
    let (topology, mut indices) = shapes(&mut from, item, &positions)?;
    let used = compact(&mut indices);
    if used.is_empty() {
        return Ok(None);
    }
    let place = || item.place.clone();
    from.reader.budget.claim(used.len(), 12, place)?;
    let mut primitive = Primitive {
        topology,
        material: from.reader.settle(item.index("material"))?.flatten(),
        positions: used.iter().map(|&i| positions.value(i as usize)).collect(),
        indices,
        ..Primitive::default()
    };
    if let Some(normals) = from.optional("NORMAL", &[3])? {
        let normals = from.morphed("NORMAL", normals)?;
        from.reader.budget.claim(used.len(), 12, place)?;
        let raw = used.iter().map(|&i| normals.value(i as usize)).collect();
        primitive.normals = attributes::normals(raw, &primitive, (&mut from.reader.defects, &item.place));
    }
    if let Some(tangents) = from.optional("TANGENT", &[4])? {
        let directions = from.morphed("TANGENT", tangents.clone())?;
        from.reader.budget.claim(used.len(), 16, place)?;
        let tangent = |i: usize| {
            let [x, y, z] = directions.value(i);
            [x, y, z, tangents.floats::<4>(i)[3]]
        };
        let raw = used.iter().map(|&i| tangent(i as usize)).collect();
        primitive.tangents = attributes::tangents(raw, (&mut from.reader.defects, &item.place));
    }
    read_uvs(&mut from, &used, &mut primitive)?;
    if let Some(mut colors) = from.optional("COLOR_0", &[3, 4])? {
        // Integer colours are always normalised, whether or not the file says so.
        colors.layout.normalized = colors.layout.component != Component::F32;
        from.reader.budget.claim(used.len(), 16, place)?;
        let opaque = colors.layout.components == 3;
        let color = |i: usize| {
            let [r, g, b, a] = colors.floats::<4>(i);
            [r, g, b, if opaque { 1.0 } else { a }]
        };
        let raw = used.iter().map(|&i| color(i as usize)).collect();
        primitive.colors = attributes::colors(raw, (&mut from.reader.defects, &item.place));
    }
    let influences = if wanted.influences {
        read_influences(&mut from, &used)?
    } else {
        Vec::new()
    };
    Ok(Some(ReadPrimitive { primitive, influences }))
}

/// The shapes of a primitive as indices of its vertices, without those that cannot be drawn.
fn shapes(from: &mut Attributes, item: &Item, positions: &Morphed) -> Read<(Topology, Vec<u32>)> {
    let mode = item.index("mode")?.unwrap_or(4);
    let vertex_count = from.vertex_count;
    let indices = match &from.draco {
        Some((mesh, _)) => {
            let numbers = mesh.indices();
            Some(Indices::Decoded(numbers))
        }
        None => match item.index("indices")? {
            Some(index) => Some(Indices::Stored(from.reader.accessor(index)?)),
            None => None,
        },
    };
    // Draco data holds triangles, whatever strip the primitive was before.
    let mode = if from.draco.is_some() { 4 } else { mode };
    let len = match &indices {
        Some(Indices::Stored(accessor)) => accessor.count,
        Some(Indices::Decoded(numbers)) => numbers.len(),
        None => vertex_count,
    };
    if len == 0 {
        let kind = match &indices {
            Some(_) => "primitive without indices in its list: dropped",
            None => "primitive without vertices: dropped",
        };
        return flaw(kind, item.place.clone());
    }
    let Some((topology, unrolled_len)) = unrolled(mode, len) else {
        return flaw(
            "primitive of unknown mode: dropped",
            format!("{}/mode = {mode}", item.place),
        );
    };
    from.reader.budget.claim(unrolled_len, 4, || item.place.clone())?;
    let vertex = |at: usize| {
        let vertex = match &indices {
            Some(Indices::Stored(accessor)) => accessor
                .integer(at)
                .ok_or("index that is no unsigned integer: its shape dropped")?,
            Some(Indices::Decoded(numbers)) => numbers[at],
            None => at as u32,
        };
        if vertex as usize >= vertex_count {
            return Err("index past the last vertex: its shape dropped");
        }
        if !positions.value(vertex as usize).iter().all(|x| x.is_finite()) {
            return Err("position that is not finite: its shape dropped");
        }
        Ok(vertex)
    };
    let mut indices = unroll(mode, len, vertex, (&mut from.reader.defects, &item.place));
    if topology == Topology::Triangles {
        let corner = |i: u32| positions.value(i as usize);
        drop_degenerate(&mut indices, corner, (&mut from.reader.defects, &item.place));
    }
    Ok((topology, indices))
}

/// Indices as stored, or as a decoder gave them.
enum Indices {
    Stored(Accessor),
    Decoded(Vec<u32>),
}

/// Leaves out triangles that repeat a vertex or have exactly no area, and counts them.
pub(super) fn drop_degenerate(
    indices: &mut Vec<u32>,
    position: impl Fn(u32) -> [f32; 3],
    (defects, place): (&mut crate::defect::Defects, &str),
) {
    let mut kept = 0;
    let (mut dropped, mut first) = (0, 0);
    for triangle in 0..indices.len() / 3 {
        let at = 3 * triangle;
        let [a, b, c] = [indices[at], indices[at + 1], indices[at + 2]];
        let corner = |i: u32| DVec3::from_array(position(i).map(f64::from));
        let has_area = a != b && b != c && c != a && {
            let (origin, u, v) = (corner(a), corner(b), corner(c));
            (u - origin).cross(v - origin) != DVec3::ZERO
        };
        if has_area {
            indices.copy_within(at..at + 3, kept);
            kept += 3;
        } else {
            first = if dropped == 0 { triangle } else { first };
            dropped += 1;
        }
    }
    indices.truncate(kept);
    defects.note("degenerate triangle: dropped", dropped, || {
        format!("{place}, triangle {first}")
    });
}

/// Decodes Draco data. Where that fails and the primitive has a fallback, the fallback is taken.
fn open_draco<'a>(
    reader: &mut Reader<'a>,
    item: &Item<'a>,
    attributes: &Item<'a>,
) -> Read<Option<(DracoMesh, Item<'a>)>> {
    let Some(extension) = item.extension("KHR_draco_mesh_compression") else {
        return Ok(None);
    };
    let ids = extension.needed("attributes")?;
    match DracoMesh::decode(reader, &extension) {
        Ok(mesh) => Ok(Some((mesh, ids))),
        Err(trouble) => {
            let accessor = attributes
                .index("POSITION")?
                .map(|i| reader.root.listed("accessors", i));
            let has_fallback = accessor.transpose()?.is_some_and(|a| a.member("bufferView").is_some());
            if !has_fallback {
                return Err(trouble);
            }
            reader.settle::<()>(Err(trouble))?;
            Ok(None)
        }
    }
}

/// The morph targets whose default weight is not zero.
fn morph_targets<'a>(
    reader: &mut Reader<'a>,
    item: &Item<'a>,
    weights: &[f64],
) -> Result<Vec<(f32, Item<'a>)>, ImportError> {
    let targets = reader.settle(item.elements("targets"))?.unwrap_or_default();
    reader
        .defects
        .note("morph target: default weight applied", targets.len() as u64, || {
            item.place.clone()
        });
    let weighted = weights.iter().map(|w| *w as f32).zip(targets);
    Ok(weighted
        .filter(|(weight, _)| *weight != 0.0 && weight.is_finite())
        .collect())
}

fn read_uvs(from: &mut Attributes, used: &[u32], primitive: &mut Primitive) -> Result<(), ImportError> {
    let place = from.item.place.clone();
    for set in 0..MAX_UV_SETS {
        let Some(uvs) = from.optional(&format!("TEXCOORD_{set}"), &[2])? else {
            continue;
        };
        // A set that is missing below one that is there is zero, so that later sets keep their number.
        from.reader
            .budget
            .claim(used.len(), 8 * (set + 1 - primitive.uvs.len()), || place.clone())?;
        primitive.uvs.resize_with(set, || vec![[0.0; 2]; used.len()]);
        let raw = used.iter().map(|&i| uvs.floats::<2>(i as usize)).collect();
        primitive
            .uvs
            .push(attributes::uvs(raw, (&mut from.reader.defects, &place)));
    }
    Ok(())
}

fn read_influences(from: &mut Attributes, used: &[u32]) -> Result<Vec<Influences>, ImportError> {
    let mut sets = Vec::new();
    for set in 0.. {
        let joints = from.optional(&format!("JOINTS_{set}"), &[4])?;
        let weights = from.optional(&format!("WEIGHTS_{set}"), &[4])?;
        let (Some(joints), Some(weights)) = (joints, weights) else {
            break;
        };
        let place = from.item.place.clone();
        from.reader
            .budget
            .claim(used.len(), size_of::<[(u32, f32); 4]>(), || place)?;
        let influence = |&vertex: &u32| {
            let joints = joints.floats::<4>(vertex as usize);
            let weights = weights.floats::<4>(vertex as usize);
            std::array::from_fn(|i| (joints[i] as u32, weights[i]))
        };
        sets.push(used.iter().map(influence).collect());
    }
    Ok(sets)
}
