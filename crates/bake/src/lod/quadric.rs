//! How far can triangles be merged along the surface?
//!
//! Edge collapses by quadric error (Garland & Heckbert, *Surface simplification using quadric error metrics*, 1997) with
//! normals, colours and texture coordinates as part of the error (Hoppe, *New quadric metric for simplifying meshes with
//! appearance attributes*, 1999), as meshoptimizer implements them. A vertex that is left moves to where the quadric of all
//! that fell on it is least, with attributes to match; on the rims of surfaces and along cuts it stays.
//!
//! A model is simplified as a whole, so that its primitives stay together: vertices in one place move to one place. Seams
//! of normals, colours and texture coordinates may be crossed at the price of the error, and so may borders between materials,
//! whose number counts as an attribute: if they were kept, what lies between them would vanish to meet the target, or it
//! could not be met. A target that is missed even so is left to the octree: taking small parts away would meet it at a much
//! larger error.

mod parts;

use std::collections::BTreeSet;
use std::ops::Range;

use glam::DVec3;
use meshopt::{SimplifyOptions, SimplifyVertex};

use crate::lod::attributes::{Allowed, Attributes};
use crate::lod::collapse::{Collapsed, SourceShapes};
use crate::lod::cube::RootCube;
use crate::lod::octree::{Locked, position_bits, to_f64, used_positions};
use crate::source::{Primitive, Topology};

/// What has more triangles does not move: each way to move it would be tried on all of them.
const MOST_AROUND: u32 = 1000;
/// A target is met with so many times the triangles.
const NEARLY: f64 = 1.1;

/// The triangles of a model, ready to be simplified again and again.
pub(super) struct QuadricSource<'a> {
    primitives: &'a [Primitive],
    /// Which of all vertices are those of each primitive.
    vertices_of: Vec<Range<u32>>,
    /// The smallest cube around all triangles.
    root: RootCube,
    /// All vertices in that cube, as one of side 1: so nothing overflows, and what does not move keeps every bit.
    positions: Vec<[f32; 3]>,
    attributes: Attributes,
    /// What the attributes of each primitive may be.
    allowed: Vec<Allowed>,
    /// What must not move.
    flags: Vec<SimplifyVertex>,
    /// All vertices of triangles by their places in the cube.
    places: Vec<([u32; 3], u32)>,
    indices: Vec<u32>,
    double_sided: &'a BTreeSet<usize>,
    /// For each vertex, a shape of the model that has it.
    shape_at: Vec<u32>,
}

/// What is left of a model.
struct Simplified {
    indices: Vec<u32>,
    /// In the cube of side 1.
    positions: Vec<[f32; 3]>,
    /// Rows of attributes.
    rows: Vec<f32>,
}

impl<'a> QuadricSource<'a> {
    pub(super) fn new(primitives: &'a [Primitive], shapes: &SourceShapes<'a>, locked: &Locked) -> Self {
        let triangles = primitives.iter().filter(|p| p.topology == Topology::Triangles);
        let root = RootCube::around(triangles.flat_map(used_positions));
        let all = primitives.iter().flat_map(|p| &p.positions);
        // What no triangle uses may be anywhere.
        let in_cube = |p: &[f32; 3]| {
            root.unit(to_f64(*p))
                .clamp(DVec3::ZERO, DVec3::ONE)
                .as_vec3()
                .to_array()
        };
        let mut source = Self {
            primitives,
            vertices_of: Vec::new(),
            positions: all.map(in_cube).collect(),
            root,
            attributes: Attributes::of(primitives),
            allowed: primitives.iter().map(Allowed::of).collect(),
            flags: Vec::new(),
            places: Vec::new(),
            indices: Vec::new(),
            double_sided: shapes.double_sided(),
            shape_at: Vec::new(),
        };
        let mut first_shape = 0;
        for (p, primitive) in primitives.iter().enumerate() {
            let first = source.shape_at.len() as u32;
            source.vertices_of.push(first..first + primitive.positions.len() as u32);
            source
                .shape_at
                .resize(source.shape_at.len() + primitive.positions.len(), 0);
            if primitive.topology == Topology::Triangles {
                let equal = shapes.equal_vertex(p);
                for (i, &vertex) in primitive.indices.iter().enumerate() {
                    let vertex = first + equal[vertex as usize];
                    source.indices.push(vertex);
                    source.shape_at[vertex as usize] = first_shape + i as u32 / 3;
                }
            }
            first_shape += primitive.count() as u32;
        }
        source.flag_vertices(locked);
        source
    }

    /// Marks what must not move. What is one place in the cube is one to the simplifier.
    fn flag_vertices(&mut self, locked: &Locked) {
        let mut around = vec![0u32; self.positions.len()];
        self.indices.iter().for_each(|&v| around[v as usize] += 1);
        let used = (0..).zip(&around).filter(|(_, around)| **around > 0);
        self.places = used
            .map(|(v, _)| (position_bits(self.positions[v as usize]), v))
            .collect();
        self.places.sort_unstable();
        self.flags = vec![SimplifyVertex::None; self.positions.len()];
        for here in self.places.chunk_by(|a, b| a.0 == b.0) {
            let is_hub = here.iter().map(|(_, v)| around[*v as usize]).sum::<u32>() > MOST_AROUND;
            if is_hub || here.iter().any(|(_, v)| locked.contains(self.position(*v))) {
                here.iter()
                    .for_each(|(_, v)| self.flags[*v as usize] = SimplifyVertex::Lock);
            }
        }
    }

    fn primitive_of(&self, vertex: u32) -> usize {
        self.vertices_of.partition_point(|vertices| vertices.end <= vertex)
    }

    fn position(&self, vertex: u32) -> [f32; 3] {
        let p = self.primitive_of(vertex);
        self.primitives[p].positions[(vertex - self.vertices_of[p].start) as usize]
    }

    /// How many triangles there are.
    pub(super) fn triangles(&self) -> usize {
        self.indices.len() / 3
    }

    /// At most about so many of them; `None` when that cannot be, or when nothing would be left.
    pub(super) fn simplify(&self, target: usize) -> Option<Collapsed> {
        let most = (NEARLY * target as f64) as usize;
        let simplified = self.simplified(target);
        let is_met = simplified.indices.len() / 3 <= most;
        let mesh = is_met.then(|| self.mesh(&simplified))?;
        (!mesh.origins.is_empty()).then_some(mesh)
    }

    fn simplified(&self, target: usize) -> Simplified {
        let (mut indices, mut positions) = (self.indices.clone(), self.positions.clone());
        let mut rows = self.attributes.rows.clone();
        let left = meshopt::simplify_with_update(
            &mut indices,
            &mut positions,
            &mut rows,
            &self.attributes.weights,
            size_of::<f32>() * self.attributes.width(),
            Some(&self.flags),
            3 * target,
            f32::MAX,
            SimplifyOptions::Permissive,
            None,
        );
        indices.truncate(left);
        Simplified {
            indices,
            positions,
            rows,
        }
    }
}
