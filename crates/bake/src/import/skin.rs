//! Where does geometry stand whose vertices do not follow their node? Skins in their rest pose, flattened objects.
//!
//! glTF 2.0 §3.7.3: a skinned vertex stands at the sum of weight × joint's world transform × inverse bind matrix; the
//! transform of the node that holds the mesh is ignored. The result is geometry of its own, placed by a translation so
//! that f32 positions keep their precision far from the origin.

use glam::{DMat3, DMat4, DVec3};

use super::attributes::direction;
use super::error::{Read, flaw};
use super::nodes::Hierarchy;
use super::primitives::{Influences, ReadPrimitive, drop_degenerate};
use super::reader::Reader;
use crate::defect::Defects;
use crate::source::{Primitive, Topology};

/// A skin's joints in one pose.
#[derive(Debug)]
pub(super) struct Skin {
    /// For each joint: places bound geometry in the world.
    world_from_bind: Vec<DMat4>,
}

/// Geometry that stands in the world, relative to a point.
#[derive(Debug)]
pub(super) struct Placed {
    pub(super) primitives: Vec<Primitive>,
    /// Places it; a translation.
    pub(super) world_from_object: DMat4,
}

impl Skin {
    /// Opens a skin of the document. `world_from_node` says where a node stands, by its position in the hierarchy.
    pub(super) fn open(
        reader: &mut Reader,
        (hierarchy, world_from_node): (&Hierarchy, &dyn Fn(usize) -> DMat4),
        index: usize,
    ) -> Read<Self> {
        let skin = reader.root.listed("skins", index)?;
        let inverse_bind = match skin.index("inverseBindMatrices")? {
            Some(accessor) => Some(reader.accessor(accessor)?),
            None => None,
        };
        let joints = skin.elements("joints")?;
        if joints.is_empty() {
            return flaw("skin without joints: drawn unskinned", skin.place);
        }
        if let Some(matrices) = &inverse_bind
            && (matrices.layout.components != 16 || matrices.count < joints.len())
        {
            return flaw("skin with bad inverse bind matrices: drawn unskinned", skin.place);
        }
        reader
            .budget
            .claim(joints.len(), size_of::<DMat4>(), || skin.place.clone())?;
        let mut world_from_bind = Vec::with_capacity(joints.len());
        for (i, joint) in joints.iter().enumerate() {
            let Some(position) = hierarchy.position(joint.as_index()?) else {
                return flaw(
                    "skin with a joint outside of the scene: drawn unskinned",
                    joint.place.clone(),
                );
            };
            let joint_from_bind = inverse_bind.as_ref().map_or(DMat4::IDENTITY, |m| {
                DMat4::from_cols_array(&m.floats::<16>(i).map(f64::from))
            });
            let matrix = world_from_node(position) * joint_from_bind;
            if !matrix.is_finite() {
                return flaw(
                    "skin with a transform that is not finite: drawn unskinned",
                    joint.place.clone(),
                );
            }
            world_from_bind.push(matrix);
        }
        Ok(Self { world_from_bind })
    }

    /// Poses primitives, relative to `origin` or else to their first vertex. `place` names the node.
    pub(super) fn pose(
        &self,
        read: &[ReadPrimitive],
        origin: Option<DVec3>,
        (defects, place): (&mut Defects, &str),
    ) -> Read<Placed> {
        let mut posed = Vec::new();
        for ReadPrimitive { primitive, influences } in read {
            let matrices = (0..primitive.positions.len()).map(|vertex| self.blend(influences, vertex));
            let Some(matrices) = matrices.collect::<Option<Vec<DMat4>>>() else {
                return flaw(
                    "skin with joints or weights that are out of range: drawn unskinned",
                    place,
                );
            };
            posed.push((primitive, matrices));
        }
        place_vertices(&posed, origin, (defects, place)).map_or_else(
            || flaw("skin with a transform that is not finite: drawn unskinned", place),
            Ok,
        )
    }

    /// The matrix of one vertex; `None` when there is none.
    fn blend(&self, influences: &[Influences], vertex: usize) -> Option<DMat4> {
        let (mut sum, mut weights) = (DMat4::ZERO, 0.0);
        for &(joint, weight) in influences.iter().flat_map(|set| &set[vertex]) {
            if weight != 0.0 {
                sum += *self.world_from_bind.get(joint as usize)? * f64::from(weight);
                weights += f64::from(weight);
            }
        }
        if weights == 0.0 {
            // A vertex that nothing holds follows the first joint it names, as viewers have it.
            let first = influences.first()?[vertex][0].0;
            return self.world_from_bind.get(first as usize).copied();
        }
        // Weights should add up to one; where they do not, only their ratio counts.
        let matrix = sum * weights.recip();
        matrix.is_finite().then_some(matrix)
    }
}

/// Places primitives by a transform that cannot be undone, such as one that flattens them.
pub(super) fn flatten(
    primitives: &[Primitive],
    world_from_object: DMat4,
    report: (&mut Defects, &str),
) -> Option<Placed> {
    let placed: Vec<_> = primitives
        .iter()
        .map(|p| (p, vec![world_from_object; p.positions.len()]))
        .collect();
    place_vertices(&placed, None, report)
}

/// Moves every vertex by its own matrix; `None` when a position does not stay finite.
fn place_vertices(
    primitives: &[(&Primitive, Vec<DMat4>)],
    origin: Option<DVec3>,
    (defects, place): (&mut Defects, &str),
) -> Option<Placed> {
    let moved = |p: &Primitive, m: &[DMat4]| -> Vec<DVec3> {
        let position = |(p, m): (&[f32; 3], &DMat4)| m.transform_point3(DVec3::from_array(p.map(f64::from)));
        p.positions.iter().zip(m).map(position).collect()
    };
    let worlds: Vec<Vec<DVec3>> = primitives.iter().map(|(p, m)| moved(p, m)).collect();
    let first = worlds.iter().flatten().next().copied();
    let anchor = origin.or(first).unwrap_or(DVec3::ZERO);
    let mut result = Vec::new();
    for ((primitive, matrices), world) in primitives.iter().zip(worlds) {
        let positions: Vec<[f32; 3]> = world.iter().map(|p| (*p - anchor).as_vec3().to_array()).collect();
        if !anchor.is_finite() || positions.iter().flatten().any(|x| !x.is_finite()) {
            return None;
        }
        let mirrored = matrices.iter().all(|m| m.determinant() < 0.0);
        let mut primitive = Primitive {
            positions,
            ..(*primitive).clone()
        };
        turn_directions(&mut primitive, matrices);
        if primitive.topology == Topology::Triangles {
            if mirrored {
                primitive
                    .indices
                    .as_chunks_mut::<3>()
                    .0
                    .iter_mut()
                    .for_each(|t| t.swap(1, 2));
            }
            let mut indices = std::mem::take(&mut primitive.indices);
            drop_degenerate(&mut indices, |i| primitive.positions[i as usize], (defects, place));
            primitive = primitive.subset(indices);
        }
        if !primitive.indices.is_empty() {
            result.push(primitive);
        }
    }
    Some(Placed {
        primitives: result,
        world_from_object: DMat4::from_translation(anchor),
    })
}

/// Turns normals (by the cofactor matrix, which is right for scales and defined for flattening ones) and tangents.
fn turn_directions(primitive: &mut Primitive, matrices: &[DMat4]) {
    let turned = |v: DVec3, keep: [f32; 3]| direction(v.as_vec3().to_array()).map_or(keep, |(unit, _)| unit);
    for (normal, matrix) in primitive.normals.iter_mut().zip(matrices) {
        let [x, y, z] = DMat3::from_mat4(*matrix).to_cols_array_2d().map(DVec3::from_array);
        let sign = if matrix.determinant() < 0.0 { -1.0 } else { 1.0 };
        let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
        *normal = turned(cofactors * DVec3::from_array(normal.map(f64::from)) * sign, *normal);
    }
    for (tangent, matrix) in primitive.tangents.iter_mut().zip(matrices) {
        let [x, y, z, w] = *tangent;
        let along = matrix.transform_vector3(DVec3::from_array([x, y, z].map(f64::from)));
        let [x, y, z] = turned(along, [x, y, z]);
        *tangent = [x, y, z, if matrix.determinant() < 0.0 { -w } else { w }];
    }
}
