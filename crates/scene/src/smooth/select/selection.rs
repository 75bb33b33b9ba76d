//! How does a cut follow the eye from frame to frame? A round over its clusters, in which each is split once or undone if the
//! view says so; a frame does a part of a round, and the next goes on there.

use super::super::{Decoder, Snapshot};
use super::front::Front;
use super::tree::ClusterTree;
use super::view::View;

/// What one call did.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Progress {
    /// Splits that were made.
    pub splits: usize,
    /// Splits that were undone.
    pub merges: usize,
    /// Clusters and corners that were looked at.
    pub work: usize,
    /// Whether the cut is as the view wants it: further calls with the same view do nothing.
    pub is_settled: bool,
}

/// A cut of a smooth LOD that follows an eye. Always a valid mesh without cracks: corners that the whole mesh shares, it
/// shares.
#[derive(Debug)]
pub struct Selection {
    pub(super) tree: ClusterTree,
    pub(super) front: Front,
    least_triangles: usize,
    /// Splits that are never undone: those before this vertex.
    pub(super) base: u32,
    view: Option<View>,
    /// Where the round is, and how many clusters were left as they are since the last change.
    at: usize,
    calm: usize,
}

impl Selection {
    /// Starts with the finest beginning of the stream that has no more triangles than this, and never has less: those of
    /// a [`super::super::Cut`] for a first picture, or 0 for nothing at all.
    #[must_use]
    pub fn new(tree: ClusterTree, least_triangles: usize) -> Self {
        let mut selection = Self {
            front: Front::new(&tree),
            tree,
            least_triangles,
            base: 0,
            view: None,
            at: 0,
            calm: 0,
        };
        selection.make(|_| false);
        selection
    }

    /// Goes on with what was decoded since: the tree of a longer beginning of the same stream. The cut stays, and what is
    /// new is found by the next [`Selection::update`]. The order of triangles changes.
    pub fn grow(&mut self, tree: ClusterTree) {
        let old = std::mem::replace(&mut self.front, Front::new(&tree));
        let known = self.tree.vertices() as u32;
        self.tree = tree;
        self.make(|vertex| vertex < known && old.is_made(vertex));
        self.view = None;
    }

    /// Makes the base, and these splits.
    fn make(&mut self, is_made: impl Fn(u32) -> bool) {
        let ends = &self.tree.born;
        self.base = ends.partition_point(|&end| end as usize <= self.least_triangles).max(1) as u32 - 1;
        self.base = self.base.min(self.tree.vertices() as u32);
        for vertex in 1..self.tree.vertices() as u32 {
            if vertex < self.base || is_made(vertex) {
                self.front.split(&self.tree, vertex);
            }
        }
    }

    /// Splits and merges towards what a view wants, until that is reached or so much work is done (at most the last step
    /// goes beyond it). The parts of the object take turns, so that none waits for ever while the eye moves on.
    pub fn update(&mut self, view: &View, most_work: usize) -> Progress {
        if self.view.as_ref() != Some(view) {
            self.view = Some(view.clone());
            self.calm = 0;
        }
        let mut progress = Progress::default();
        while self.calm < self.front.active.len() && progress.work < most_work {
            if self.at >= self.front.active.len() {
                self.at = 0;
            }
            let vertex = self.front.active[self.at];
            let next = self.front.next[vertex as usize];
            progress.work += 1;
            self.calm += 1;
            if next != super::super::mesh::NONE && view.wants(&self.tree, next) {
                progress.work += self.front.split(&self.tree, next);
                progress.splits += 1;
                self.calm = 0;
            } else if vertex >= self.base.max(1)
                && self.front.is_last(&self.tree, vertex)
                && !view.keeps(&self.tree, vertex)
            {
                progress.work += self.front.merge(&self.tree, vertex);
                progress.merges += 1;
                self.calm = 0;
                // The last cluster has its place now.
                continue;
            }
            self.at += 1;
        }
        progress.is_settled = self.calm >= self.front.active.len();
        progress
    }

    /// How many clusters and triangles are drawn.
    #[must_use]
    pub fn counts(&self) -> (usize, usize) {
        (self.front.active.len(), self.front.drawn.len())
    }

    /// Numbers of the triangles that are drawn, in no particular order, but the same after the same calls.
    #[must_use]
    pub fn drawn(&self) -> &[u32] {
        &self.front.drawn
    }

    /// Vertices at the corners of a drawn triangle.
    #[must_use]
    pub fn triangle(&self, triangle: u32) -> [u32; 3] {
        self.front.corners[triangle as usize]
    }

    /// Wedges at the corners of a drawn triangle; `None` without attributes.
    #[must_use]
    pub fn wedges(&self, triangle: u32) -> Option<[u32; 3]> {
        self.front.wedges.get(triangle as usize).copied()
    }

    /// The mesh to draw. The decoder is the one that the tree is of.
    #[must_use]
    pub fn snapshot(&self, decoder: &Decoder) -> Snapshot {
        let drawn = self.front.drawn.iter();
        decoder.snapshot_of(drawn.map(|&t| (t as usize, self.triangle(t), self.wedges(t))))
    }

    /// The tree that is cut.
    #[must_use]
    pub fn tree(&self) -> &ClusterTree {
        &self.tree
    }
}
