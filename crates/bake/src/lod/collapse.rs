//! What is left of a mesh when vertices fall together?
//!
//! D. Schmalstieg, *The Remote Rendering Pipeline* (1997), §6.2, "Computing the reduced triangle set": each corner moves
//! to the representative of its cluster. Doublets are removed; a triangle that becomes a line is kept as one unless a
//! triangle that is left has this edge; one that becomes a point is dropped.
//!
//! *Positions* come from the cluster alone, which is the same for all primitives of a model: so there are no cracks
//! between parts with different normals, texture charts or materials. *Attributes* come from one source vertex for each
//! attribute group: vertices of one cluster, one primitive and one main direction of the normal that are connected by
//! edges inside the cluster. Both sides of a seam or of a hard edge thus keep their own values, and nothing is averaged:
//! every normal, texture coordinate and colour is one that the source has.

use std::collections::BTreeSet;

use glam::Vec3;

use crate::groups::Groups;
use crate::lod::equal::{digest, first_equal, first_equal_vertices};
use crate::lod::octree::Clusters;
use crate::radix;
use crate::source::{Primitive, Topology};

/// A mesh and where it comes from.
#[derive(Debug, Clone, Default)]
pub(super) struct Collapsed {
    /// Its geometry.
    pub(super) primitives: Vec<Primitive>,
    /// For each shape of all primitives in their order, the shape of the source that it is an image of, or one that it
    /// touches.
    pub(super) origins: Vec<u32>,
}

/// The shapes of a model, ready to be collapsed again and again.
pub(super) struct SourceShapes<'a> {
    primitives: &'a [Primitive],
    double_sided: &'a BTreeSet<usize>,
    /// For each primitive, for each vertex, the first vertex that is equal in everything.
    equal_vertex: Vec<Vec<u32>>,
}

/// A shape after its corners moved, so that doublets are equal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Key {
    topology: Topology,
    /// Clusters in rising order; short ones repeat the last.
    corners: [u32; 3],
    /// Primitives of different materials have no doublets in common.
    material: Option<usize>,
    mirrored: bool,
}

impl Key {
    fn digest(&self) -> u64 {
        let [a, b, c] = self.corners;
        let material = self.material.map_or(0, |material| material as u32 + 1);
        digest(&[a, b, c, material, self.topology as u32, u32::from(self.mirrored)])
    }
}

/// One shape of the source and what it became.
struct Image {
    key: Key,
    primitive: u32,
    /// Index of the shape in its primitive.
    shape: u32,
    /// Index of the shape among all.
    origin: u32,
    /// The corners of the shape, as indices into its `indices`, that stand for the image's corners.
    corners: [u8; 3],
}

impl Image {
    /// The edges of a triangle.
    fn edges(&self) -> impl Iterator<Item = u64> {
        let [a, b, c] = self.key.corners;
        let is_triangle = self.key.topology == Topology::Triangles;
        [edge(a, b), edge(b, c), edge(a, c)]
            .into_iter()
            .filter(move |_| is_triangle)
    }
}

/// Two clusters in rising order.
fn edge(a: u32, b: u32) -> u64 {
    u64::from(a) << 32 | u64::from(b)
}

impl<'a> SourceShapes<'a> {
    pub(super) fn new(primitives: &'a [Primitive], double_sided: &'a BTreeSet<usize>) -> Self {
        Self {
            primitives,
            double_sided,
            equal_vertex: primitives.iter().map(first_equal_vertices).collect(),
        }
    }

    /// Materials that are drawn from both sides.
    pub(super) fn double_sided(&self) -> &'a BTreeSet<usize> {
        self.double_sided
    }

    /// For each vertex of a primitive the first one that is equal in everything.
    pub(super) fn equal_vertex(&self, primitive: usize) -> &[u32] {
        &self.equal_vertex[primitive]
    }

    /// What is left when each vertex moves to its cluster's representative.
    pub(super) fn collapse(&self, clusters: &Clusters) -> Collapsed {
        let kept = self.kept_images(clusters);
        let mut collapsed = Collapsed::default();
        for (p, source) in self.primitives.iter().enumerate() {
            let images = &kept[kept.partition_point(|i| (i.primitive as usize) < p)..];
            let images = &images[..images.partition_point(|i| i.primitive as usize == p)];
            if images.is_empty() {
                continue;
            }
            let givers = self.attribute_givers(p, clusters);
            for topology in [Topology::Points, Topology::Lines, Topology::Triangles] {
                let images: Vec<&Image> = images.iter().filter(|i| i.key.topology == topology).collect();
                if !images.is_empty() {
                    collapsed.origins.extend(images.iter().map(|i| i.origin));
                    collapsed
                        .primitives
                        .push(assemble(source, clusters, p, &givers, &images));
                }
            }
        }
        collapsed
    }

    /// The images that stay, in source order.
    fn kept_images(&self, clusters: &Clusters) -> Vec<Image> {
        let mut images = Vec::new();
        let mut reduced = Vec::new();
        let mut origin = 0;
        for (p, primitive) in self.primitives.iter().enumerate() {
            let double_sided = primitive.material.is_some_and(|m| self.double_sided.contains(&m));
            for (s, shape) in primitive.indices.chunks_exact(primitive.topology.arity()).enumerate() {
                if let Some((mut key, corners)) = image_of(primitive, shape, clusters, p) {
                    key.mirrored &= !double_sided;
                    let image = Image {
                        key,
                        primitive: p as u32,
                        shape: s as u32,
                        origin,
                        corners,
                    };
                    let images = if key.topology == primitive.topology {
                        &mut images
                    } else {
                        &mut reduced
                    };
                    images.push(image);
                }
                origin += 1;
            }
        }
        // A line of the source that is there anyway comes first.
        images.extend(without_edges(reduced, &images));
        let key = |image: u32| images[image as usize].key;
        let first = first_equal(images.len(), |image| key(image).digest(), key);
        let kept = images.into_iter().zip(first).zip(0..);
        let kept = kept.filter_map(|((image, first), number)| (first == number).then_some(image));
        let mut kept: Vec<Image> = kept.collect();
        kept.sort_by_key(|i| i.origin);
        kept
    }

    /// For each vertex of a primitive, the vertex whose attributes it takes: of its attribute group the one nearest to
    /// the cluster's representative.
    fn attribute_givers(&self, p: usize, clusters: &Clusters) -> Vec<u32> {
        let primitive = &self.primitives[p];
        let cluster = &clusters.of_vertex[p];
        let mut groups = Groups::joined_with(self.equal_vertex[p].clone());
        let direction = |v: u32| primitive.normals.get(v as usize).map(|n| main_direction(*n));
        for shape in primitive.indices.chunks_exact(primitive.topology.arity()) {
            for (&a, &b) in shape.iter().zip(shape.iter().cycle().skip(1)) {
                if cluster[a as usize] == cluster[b as usize] && direction(a) == direction(b) {
                    groups.join(a, b);
                }
            }
        }
        let away = |v: u32| {
            let representative = clusters.representatives[cluster[v as usize] as usize];
            Vec3::from(primitive.positions[v as usize])
                .as_dvec3()
                .distance_squared(Vec3::from(representative).as_dvec3())
        };
        let mut givers: Vec<Option<(f64, u32)>> = vec![None; cluster.len()];
        let mut group_of = vec![0; cluster.len()];
        for v in 0..cluster.len() as u32 {
            // A vertex that no shape uses has no cluster.
            if (cluster[v as usize] as usize) < clusters.representatives.len() {
                let group = groups.root(v);
                group_of[v as usize] = group;
                let giver = &mut givers[group as usize];
                let candidate = (away(v), v);
                if giver.is_none_or(|best| candidate.0 < best.0) {
                    *giver = Some(candidate);
                }
            }
        }
        let giver = |&group: &u32| givers[group as usize].map_or(group, |(_, v)| v);
        group_of.iter().map(giver).collect()
    }
}

/// The lines and points that are no edges of triangles that stay.
fn without_edges(thin: Vec<Image>, images: &[Image]) -> Vec<Image> {
    let mut edges: Vec<(u64, u32)> = images.iter().flat_map(Image::edges).map(|edge| (edge, 0)).collect();
    radix::sort(&mut edges);
    let ends = |image: &Image| edge(image.key.corners[0], image.key.corners[1]);
    let mut rows: Vec<(u64, u32)> = thin.iter().map(ends).zip(0..).collect();
    radix::sort(&mut rows);
    let mut is_edge = vec![false; thin.len()];
    let mut edges = edges.iter().peekable();
    for (ends, i) in rows {
        while edges.next_if(|(edge, _)| *edge < ends).is_some() {}
        is_edge[i as usize] = edges.peek().is_some_and(|(edge, _)| *edge == ends);
    }
    let kept = thin.into_iter().zip(is_edge).filter(|(_, is_edge)| !is_edge);
    kept.map(|(image, _)| image).collect()
}

/// What a shape becomes, and which of its corners stand for the image's. `None` when it falls to a point.
fn image_of(primitive: &Primitive, shape: &[u32], clusters: &Clusters, p: usize) -> Option<(Key, [u8; 3])> {
    let at = |i: usize| clusters.of_vertex[p][shape[i] as usize];
    let line = |a: usize, b: usize| {
        let (first, last) = if at(a) < at(b) { (a, b) } else { (b, a) };
        (
            Topology::Lines,
            [at(first), at(last), at(last)],
            false,
            [a as u8, b as u8, b as u8],
        )
    };
    let image = match primitive.topology {
        Topology::Points => (Topology::Points, [at(0); 3], false, [0; 3]),
        Topology::Lines if at(0) == at(1) => return None,
        Topology::Lines => line(0, 1),
        Topology::Triangles => match (at(0) == at(1), at(1) == at(2), at(2) == at(0)) {
            (true, true, _) => return None,
            (true, false, _) => line(1, 2),
            (false, true, _) => line(0, 1),
            (false, false, true) => line(0, 1),
            (false, false, false) => {
                let corners = [at(0), at(1), at(2)];
                if let Some((a, b)) = longest_edge_of_flat(corners.map(|c| clusters.representatives[c as usize])) {
                    return Some(named(primitive, line(a, b)));
                }
                let mut sorted = corners;
                sorted.sort_unstable();
                let turned = [[0, 1, 2], [1, 2, 0], [2, 0, 1]].map(|order| order.map(|i: usize| sorted[i]));
                (Topology::Triangles, sorted, !turned.contains(&corners), [0, 1, 2])
            }
        },
    };
    Some(named(primitive, image))
}

fn named(primitive: &Primitive, (topology, corners, mirrored, from): Unnamed) -> (Key, [u8; 3]) {
    let key = Key {
        topology,
        corners,
        material: primitive.material,
        mirrored,
    };
    (key, from)
}

/// Topology, corners and winding of a [`Key`], and which corners of the shape stand for them.
type Unnamed = (Topology, [u32; 3], bool, [u8; 3]);

/// The ends of a triangle without area, whose corners lie on one line.
pub(super) fn longest_edge_of_flat(corners: [[f32; 3]; 3]) -> Option<(usize, usize)> {
    let [a, b, c] = corners.map(|p| Vec3::from(p).as_dvec3());
    let (ab, ac) = (b - a, c - a);
    // Products of differences of f32 are exact in f64 but for the last bits.
    let is_flat = ab.cross(ac).length_squared() <= 1e-24 * ab.length_squared() * ac.length_squared();
    let lengths = [ab.length_squared(), (c - b).length_squared(), ac.length_squared()];
    let longest = (1..3).fold(0, |best, i| if lengths[i] > lengths[best] { i } else { best });
    is_flat.then_some([(0, 1), (1, 2), (2, 0)][longest])
}

/// Writes the images of one primitive that have the same topology.
fn assemble(source: &Primitive, clusters: &Clusters, p: usize, givers: &[u32], images: &[&Image]) -> Primitive {
    let arity = source.topology.arity();
    let topology = images.first().map_or(source.topology, |i| i.key.topology);
    let corners = images.iter().flat_map(|image| {
        let shape = &source.indices[image.shape as usize * arity..][..arity];
        image.corners[..topology.arity()].iter().map(|&i| shape[usize::from(i)])
    });
    // A giver stands for one cluster and one set of attributes.
    let corners: Vec<u32> = corners.map(|v| givers[v as usize]).collect();
    let position = |v: u32| clusters.representatives[clusters.of_vertex[p][v as usize] as usize];
    let mut is_giver = vec![false; source.positions.len()];
    corners.iter().for_each(|&v| is_giver[v as usize] = true);
    let vertices: Vec<u32> = (0..).zip(is_giver).filter_map(|(v, is)| is.then_some(v)).collect();
    let loose = gather(source, topology, &vertices, position);
    let equal = first_equal_vertices(&loose);
    let unique: Vec<u32> = (0..vertices.len() as u32).filter(|&v| equal[v as usize] == v).collect();
    let mut primitive = gather(&loose, topology, &unique, |v| loose.positions[v as usize]);
    let mut numbers = vec![0; source.positions.len()];
    for (number, &first) in (0..).zip(&unique) {
        numbers[vertices[first as usize] as usize] = number;
    }
    for (&vertex, &first) in vertices.iter().zip(&equal) {
        numbers[vertex as usize] = numbers[vertices[first as usize] as usize];
    }
    primitive.indices = corners.iter().map(|&v| numbers[v as usize]).collect();
    primitive
}

/// Some vertices of a primitive, without indices, with other positions.
fn gather(source: &Primitive, topology: Topology, vertices: &[u32], position: impl Fn(u32) -> [f32; 3]) -> Primitive {
    fn pick<T: Copy>(from: &[T], vertices: &[u32]) -> Vec<T> {
        vertices.iter().filter_map(|&v| from.get(v as usize).copied()).collect()
    }
    Primitive {
        topology,
        material: source.material,
        positions: vertices.iter().map(|&v| position(v)).collect(),
        normals: pick(&source.normals, vertices),
        // Tangents shade surfaces only.
        tangents: if topology == Topology::Triangles {
            pick(&source.tangents, vertices)
        } else {
            Vec::new()
        },
        uvs: source.uvs.iter().map(|set| pick(set, vertices)).collect(),
        colors: pick(&source.colors, vertices),
        indices: Vec::new(),
    }
}

/// The axis and sign of the largest component: one of six, stable under noise for walls and floors.
fn main_direction(normal: [f32; 3]) -> u8 {
    let axis = (0..3u8).fold(0, |best, axis| {
        if normal[usize::from(axis)].abs() > normal[usize::from(best)].abs() {
            axis
        } else {
            best
        }
    });
    2 * axis + u8::from(normal[usize::from(axis)] < 0.0)
}
