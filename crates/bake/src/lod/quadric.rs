//! How far can triangles be merged along the surface?
//!
//! Edge collapses by quadric error (Garland & Heckbert, *Surface simplification using quadric error metrics*, 1997) with
//! normals, colours and texture coordinates as part of the error (Hoppe, *New quadric metric for simplifying meshes with
//! appearance attributes*, 1999), as meshoptimizer implements them. Vertices keep their places and attributes.
//!
//! A model is simplified as a whole, so that its primitives stay together: where two of them meet, edges collapse along
//! the border only. Other seams, of normals, colours and texture coordinates, may be crossed at the price of the error: if
//! they were kept, what lies between them would vanish to meet the target. A target that is missed even so is left to the
//! octree: taking small parts away would meet it at a much larger error.

use std::collections::BTreeSet;
use std::ops::Range;

use glam::DVec3;
use meshopt::{SimplifyOptions, SimplifyVertex, VertexDataAdapter};

use crate::lod::collapse::{Collapsed, SourceShapes};
use crate::lod::octree::{Locked, RootCube, position_bits, to_f64, used_positions};
use crate::source::{Primitive, Topology};

/// Floats of attributes for each vertex: normal, texture coordinates, colour.
const ATTRIBUTES: usize = 8;
/// What a unit of each attribute counts beside the model's extent.
const NORMAL_WEIGHT: f32 = 0.1;
const UV_WEIGHT: f32 = 0.1;
const COLOR_WEIGHT: f32 = 0.1;
/// A target is met with so many times the triangles.
const NEARLY: f64 = 1.1;

/// The triangles of a model, ready to be simplified again and again.
pub(super) struct QuadricSource<'a> {
    primitives: &'a [Primitive],
    /// Which of all vertices are those of each primitive.
    vertices_of: Vec<Range<u32>>,
    /// All vertices in a cube of side 1, so that nothing overflows.
    positions: Vec<[f32; 3]>,
    attributes: Vec<[f32; ATTRIBUTES]>,
    weights: [f32; ATTRIBUTES],
    /// What must not move, and where primitives meet.
    flags: Vec<SimplifyVertex>,
    indices: Vec<u32>,
    double_sided: &'a BTreeSet<usize>,
    /// For each vertex a number that those in the same place share.
    place_of: Vec<u32>,
    /// For each vertex, a shape of the model that has it.
    shape_at: Vec<u32>,
}

impl<'a> QuadricSource<'a> {
    pub(super) fn new(primitives: &'a [Primitive], shapes: &SourceShapes<'a>, locked: &Locked) -> Self {
        let mut source = Self {
            primitives,
            vertices_of: Vec::new(),
            positions: Vec::new(),
            attributes: Vec::new(),
            weights: [0.0; ATTRIBUTES],
            flags: Vec::new(),
            indices: Vec::new(),
            double_sided: shapes.double_sided(),
            place_of: Vec::new(),
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
        source.place();
        source.dress();
        source.flag_vertices(locked);
        source
    }

    fn place(&mut self) {
        let triangles = self.primitives.iter().filter(|p| p.topology == Topology::Triangles);
        let root = RootCube::around(triangles.flat_map(used_positions));
        let all = self.primitives.iter().flat_map(|p| &p.positions);
        self.positions = all
            .map(|p| to_f64(*p))
            // What no triangle uses may be anywhere.
            .map(|p| root.unit(p).clamp(DVec3::ZERO, DVec3::ONE).as_vec3().to_array())
            .collect();
    }

    fn dress(&mut self) {
        let uvs = self.primitives.iter().filter_map(|p| p.uvs.first()).flatten();
        let (low, high) = uvs.fold(([f32::MAX; 2], [f32::MIN; 2]), |(low, high), uv| {
            ([0, 1].map(|i| low[i].min(uv[i])), [0, 1].map(|i| high[i].max(uv[i])))
        });
        let uv_extent = (high[0] - low[0]).max(high[1] - low[1]);
        let uv_weight = if uv_extent > 0.0 { UV_WEIGHT / uv_extent } else { 0.0 };
        for primitive in self.primitives {
            for v in 0..primitive.positions.len() {
                let normal = primitive.normals.get(v).copied().unwrap_or_default();
                let uv = primitive
                    .uvs
                    .first()
                    .and_then(|set| set.get(v))
                    .copied()
                    .unwrap_or_default();
                let color = primitive.colors.get(v).copied().unwrap_or_default();
                self.attributes.push([
                    normal[0], normal[1], normal[2], uv[0], uv[1], color[0], color[1], color[2],
                ]);
            }
        }
        let has = |attribute: fn(&Primitive) -> bool| self.primitives.iter().any(attribute);
        let weight = |has: bool, weight: f32| if has { weight } else { 0.0 };
        let normal = weight(has(|p| !p.normals.is_empty()), NORMAL_WEIGHT);
        let uv = weight(has(|p| p.uvs.first().is_some_and(|set| !set.is_empty())), uv_weight);
        let color = weight(has(|p| !p.colors.is_empty()), COLOR_WEIGHT);
        self.weights = [normal, normal, normal, uv, uv, color, color, color];
    }

    /// Marks where primitives meet and what must not move.
    fn flag_vertices(&mut self, locked: &Locked) {
        let mut used = vec![false; self.positions.len()];
        self.indices.iter().for_each(|&v| used[v as usize] = true);
        let used = (0..).zip(used).filter(|(_, used)| *used);
        let mut places: Vec<([u32; 3], u32)> = used.map(|(v, _)| (position_bits(self.position(v)), v)).collect();
        places.sort_unstable();
        self.flags = vec![SimplifyVertex::None; self.positions.len()];
        self.place_of = vec![0; self.positions.len()];
        for (here, number) in places.chunk_by(|a, b| a.0 == b.0).zip(0..) {
            let first = here[0].1;
            here.iter().for_each(|(_, v)| self.place_of[*v as usize] = number);
            let primitive = self.primitive_of(first);
            let flag = if locked.contains(self.position(first)) {
                SimplifyVertex::Lock
            } else if here.iter().any(|(_, v)| self.primitive_of(*v) != primitive) {
                SimplifyVertex::Protect
            } else {
                continue;
            };
            here.iter().for_each(|(_, v)| self.flags[*v as usize] = flag);
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
        let indices = self.collapsed(target);
        let mesh = self.mesh(&indices);
        (indices.len() / 3 <= most && !mesh.origins.is_empty()).then_some(mesh)
    }

    fn collapsed(&self, target: usize) -> Vec<u32> {
        let Ok(vertices) = VertexDataAdapter::new(meshopt::typed_to_bytes(&self.positions), size_of::<[f32; 3]>(), 0)
        else {
            return Vec::new();
        };
        meshopt::simplify_with_attributes_and_locks(
            &self.indices,
            &vertices,
            self.attributes.as_flattened(),
            &self.weights,
            size_of::<[f32; ATTRIBUTES]>(),
            &self.flags,
            3 * target,
            f32::MAX,
            SimplifyOptions::Permissive,
            None,
        )
    }

    /// Gives triangles back to their primitives, each once.
    fn mesh(&self, indices: &[u32]) -> Collapsed {
        let mut of_primitive = vec![(Vec::new(), Vec::new()); self.primitives.len()];
        let mut seen = BTreeSet::new();
        for triangle in indices.as_chunks::<3>().0 {
            let p = self.primitive_of(triangle[0]);
            let own = &self.vertices_of[p];
            let corners = triangle.map(|v| to_f64(self.position(v)));
            // Collapses never lead from one primitive to another. If one did, the error would tell of the hole.
            if triangle.iter().all(|v| own.contains(v)) && has_area(corners) && seen.insert(self.key(p, *triangle)) {
                let (indices, origins) = &mut of_primitive[p];
                indices.extend(triangle.map(|v| v - own.start));
                origins.push(self.shape_at[triangle[0] as usize]);
            }
        }
        let mut mesh = Collapsed::default();
        for (source, (indices, origins)) in self.primitives.iter().zip(of_primitive) {
            if !indices.is_empty() {
                mesh.primitives.push(source.subset(indices));
                mesh.origins.extend(origins);
            }
        }
        mesh
    }

    /// Equal for doublets: corners from the first on, or in any order when both sides are drawn.
    fn key(&self, primitive: usize, triangle: [u32; 3]) -> (Option<usize>, [u32; 3]) {
        let material = self.primitives[primitive].material;
        let mut places = triangle.map(|v| self.place_of[v as usize]);
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
