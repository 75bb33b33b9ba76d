//! Which vertex was split from which, and what is lost without a split? The cluster tree of a decoded beginning, with an
//! error and a ball for each split.
//!
//! A split is named by the vertex that it brings. Two splits can only come after it: the first of that vertex, and the
//! next of the vertex that was split. So splits form a binary tree, and the splits that are made always hold its root.

use super::super::Decoder;
use super::super::mesh::NONE;
use super::around::Around;
use super::distance::{length, minus};
use super::front::Front;

/// More wedges of one vertex are not looked at.
const MOST_WEDGES: usize = 16;

/// The clusters of a smooth LOD, as far as it was decoded when this was made.
///
/// It takes some 70 bytes for each vertex, 24 for each triangle and 8 for each wedge, beside the decoder's.
#[derive(Debug, Default)]
pub struct ClusterTree {
    /// Where each vertex is, in model space. A cluster is drawn where its first vertex is.
    pub(super) positions: Vec<[f64; 3]>,
    /// The vertex that was split.
    pub(super) parent: Vec<u32>,
    /// The first split of a vertex.
    pub(super) first_child: Vec<u32>,
    /// The next split of the vertex that was split.
    pub(super) next_sibling: Vec<u32>,
    /// Place in the order of the tree, in which a vertex comes right before all that came from it …
    order: Vec<u32>,
    /// … and how many those are, itself included.
    extent: Vec<u32>,
    /// The first triangle that came with a vertex; one more at the end.
    pub(super) born: Vec<u32>,
    /// Vertices of the finest triangles, and their wedges if there are attributes.
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) corners: Vec<[u32; 3]>,
    /// The vertex of a wedge, and the wedge that stands for it when that vertex is not told from its parent.
    owner: Vec<u32>,
    above: Vec<u32>,
    /// By how much, in model-space units, the surface is off where this split and all after it are left out.
    pub(super) errors: Vec<f64>,
    /// All triangles that this split or one after it changes lie so near to the vertex that is split.
    pub(super) radii: Vec<f64>,
}

impl ClusterTree {
    /// The tree of what has been decoded so far. Takes one to two times as long as decoding it did.
    #[must_use]
    pub fn new(decoder: &Decoder) -> Self {
        let Some((header, replay)) = decoder.replay() else {
            return Self::default();
        };
        let lattice = decoder.lattice();
        let births = &replay.mesh.births;
        let half_step = f64::from(header.step) * 0.5;
        let origin = header.origin.map(f64::from);
        let position = |twice: &[i32; 3]| [0, 1, 2].map(|axis| origin[axis] + half_step * f64::from(twice[axis]));
        let mut tree = Self {
            positions: lattice.twice_positions.iter().map(position).collect(),
            parent: births.iter().map(|birth| birth.parent).collect(),
            first_child: vec![NONE; births.len()],
            next_sibling: vec![NONE; births.len()],
            order: vec![0; births.len()],
            extent: vec![1; births.len()],
            born: births.iter().map(|birth| birth.triangles).collect(),
            triangles: lattice.triangles,
            corners: lattice.corners,
            ..Self::default()
        };
        tree.born.push(tree.triangles.len() as u32);
        for vertex in (1..births.len()).rev() {
            let parent = tree.parent[vertex] as usize;
            tree.next_sibling[vertex] = tree.first_child[parent];
            tree.first_child[parent] = vertex as u32;
            tree.extent[parent] += tree.extent[vertex];
        }
        for (place, vertex) in replay.tree_order().enumerate() {
            tree.order[vertex as usize] = place as u32;
        }
        tree.find_wedges(&lattice.values, header.stride());
        tree.measure();
        tree
    }

    /// How many vertices it tells apart.
    #[must_use]
    pub fn vertices(&self) -> usize {
        self.parent.len()
    }

    /// By how much, in model-space units, the surface is off where this split, named by its vertex, and all after it are
    /// left out: how far the triangles around both vertices are from those around the old one before, both ways, at a few
    /// points, added up along the worst row of splits.
    #[must_use]
    pub fn error(&self, split: u32) -> f64 {
        self.errors[split as usize]
    }

    /// All triangles that this split or one after it changes lie so near to the vertex that is split, in model-space units.
    #[must_use]
    pub fn radius(&self, split: u32) -> f64 {
        self.radii[split as usize]
    }

    /// Whether a vertex is another, or came from it.
    #[inline]
    pub(super) fn holds(&self, cluster: u32, vertex: u32) -> bool {
        self.order[vertex as usize].wrapping_sub(self.order[cluster as usize]) < self.extent[cluster as usize]
    }

    /// The wedge that stands for another in a cluster that holds its vertex.
    #[inline]
    pub(super) fn wedge_in(&self, cluster: u32, wedge: u32) -> u32 {
        let mut wedge = wedge;
        while self.owner[wedge as usize] != cluster {
            let above = self.above[wedge as usize];
            if above == wedge || !self.holds(cluster, self.owner[above as usize]) {
                break;
            }
            wedge = above;
        }
        wedge
    }

    /// What stands for each wedge: of those that the nearest vertex above has, the one whose numbers are nearest.
    fn find_wedges(&mut self, values: &[i32], stride: usize) {
        let wedges = values.len().checked_div(stride).unwrap_or(0);
        self.owner = vec![NONE; wedges];
        for (triangle, corners) in self.triangles.iter().zip(&self.corners) {
            for (&vertex, &wedge) in triangle.iter().zip(corners) {
                self.owner[wedge as usize] = vertex;
            }
        }
        self.above = (0..wedges as u32).collect();
        if wedges == 0 {
            return;
        }
        // Wedges of each vertex, lowest first.
        let mut latest = vec![NONE; self.vertices()];
        let mut later = vec![NONE; wedges];
        for wedge in (0..wedges).rev() {
            if let Some(latest) = latest.get_mut(self.owner[wedge] as usize) {
                later[wedge] = std::mem::replace(latest, wedge as u32);
            }
        }
        let numbers = |wedge: u32| &values[wedge as usize * stride..][..stride];
        for wedge in 0..wedges as u32 {
            let mut vertex = self.owner[wedge as usize];
            if vertex == NONE {
                continue;
            }
            let mut other = NONE;
            while other == NONE && vertex > 0 {
                vertex = self.parent[vertex as usize];
                other = latest[vertex as usize];
            }
            let mut nearest = u64::MAX;
            for _ in 0..MOST_WEDGES {
                if other == NONE {
                    break;
                }
                let pairs = numbers(wedge).iter().zip(numbers(other));
                let distance = pairs.map(|(&a, &b)| u64::from(a.abs_diff(b))).sum();
                if distance < nearest {
                    nearest = distance;
                    self.above[wedge as usize] = other;
                }
                other = later[other as usize];
            }
        }
    }

    /// Makes all splits in their order, and sees how far the surface is off without each.
    fn measure(&mut self) {
        let mut front = Front::new(self);
        let mut steps = vec![0.0; self.vertices()];
        let mut around = Around::default();
        for vertex in 1..self.vertices() as u32 {
            around.read_before(&front, self.parent[vertex as usize]);
            front.split(self, vertex);
            steps[vertex as usize] = around.difference(&front, self, vertex);
        }
        let mut rings = vec![0.0f64; self.vertices()];
        for &[a, b, c] in &self.triangles {
            for [one, other] in [[a, b], [b, c], [c, a]] {
                let far = length(minus(self.positions[one as usize], self.positions[other as usize]));
                for vertex in [one, other] {
                    rings[vertex as usize] = rings[vertex as usize].max(far);
                }
            }
        }
        self.errors = vec![0.0; self.vertices()];
        self.radii = vec![0.0; self.vertices()];
        for vertex in (1..self.vertices()).rev() {
            let parent = self.parent[vertex] as usize;
            let after = |next: u32, of: usize| match next {
                NONE => (0.0, rings[of]),
                next => (self.errors[next as usize], self.radii[next as usize]),
            };
            let (old_error, old_radius) = after(self.next_sibling[vertex], parent);
            let (new_error, new_radius) = after(self.first_child[vertex], vertex);
            let way = length(minus(self.positions[vertex], self.positions[parent]));
            self.errors[vertex] = steps[vertex] + f64::max(old_error, new_error);
            self.radii[vertex] = f64::max(old_radius, way + new_radius);
        }
    }
}
