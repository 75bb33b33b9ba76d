//! Which splits does an eye need? Those without which the surface would be off by more pixels than it may.

use super::distance::{dot, length, minus};
use super::tree::ClusterTree;

/// A made split is undone only when its error on the screen is below this part of the threshold …
const KEPT: f64 = 0.75;
/// … and counts as in view until it is farther out than this many times its radius.
const KEPT_RADII: f64 = 1.5;

/// From where, and how sharply, an object is looked at.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// In model space.
    pub eye: [f64; 3],
    /// What can be seen lies on the inner side of all these: `x · p[0] + y · p[1] + z · p[2] + p[3] >= 0`, with normals of
    /// unit length, in model space. None: all around.
    pub planes: Vec<[f64; 4]>,
    /// Pixels of a thing of length 1 at distance 1, facing the eye: height of the image / (2 · tan(vertical angle / 2)).
    pub pixels: f64,
    /// So many pixels the surface may be off by. 0 gives all that is decoded.
    pub most_error_px: f64,
    /// So many times more where nothing can be seen; 1 or more. Infinite: nothing is kept there for when the eye turns.
    pub outside: f64,
}

impl View {
    /// Whether a split is to be made.
    pub(super) fn wants(&self, tree: &ClusterTree, split: u32) -> bool {
        self.needs(tree, split, 1.0, 1.0)
    }

    /// Whether a split that is made stays. So does each that is wanted.
    pub(super) fn keeps(&self, tree: &ClusterTree, split: u32) -> bool {
        self.needs(tree, split, KEPT, KEPT_RADII)
    }

    fn needs(&self, tree: &ClusterTree, split: u32, part: f64, radii: f64) -> bool {
        if self.most_error_px <= 0.0 {
            return true;
        }
        let centre = tree.positions[tree.parent[split as usize] as usize];
        let radius = tree.radii[split as usize];
        let mut most = part * self.most_error_px;
        let reach = -(radii * radius);
        if self
            .planes
            .iter()
            .any(|&[x, y, z, w]| dot([x, y, z], centre) + w < reach)
        {
            most *= self.outside;
        }
        let distance = f64::max(length(minus(self.eye, centre)) - radius, 0.0);
        tree.errors[split as usize] * self.pixels > most * distance
    }
}
