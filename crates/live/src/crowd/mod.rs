//! Who is hidden among many? Partial visibility in crowds: cells of the ground hide a share of what is behind them (partial
//! occluders with solidity and visibility values, a poster on output-sensitive rendering of crowds; its sections stand below).
//!
//! * [`quadtree`]: the ground is cut into cells until few movers stand in each; what stands in one covers a share of its
//!   border, its *solidity* (§3.1.1).
//! * [`solidity`]: that share. [`foliage`]: that of leaves, which are published and never move.
//! * [`shadow`]: what of a cell lies behind another, seen from a point.
//! * [`visibility`]: from cell to cell along their borders, front to back, each cell keeps the share that the shadows met so far
//!   leave of it (§4).
//!
//! Seen from above: everything is a disc on the ground. A crowd hides only at its own height: eyes, occluders and targets must
//! have a height in common, else nothing is hidden. There is no view frustum, since people turn faster than they are told.
//! Guarantee: never hides more than the paper's rule does. Cost: for each observer, cells times partial occluders, within
//! its area of interest.

mod foliage;
mod node;
mod quadtree;
mod shadow;
mod solidity;
mod visibility;

use serde::{Deserialize, Serialize};

pub use self::{quadtree::Crowd, visibility::View};

/// When crowds count, and how much.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Crowding {
    /// Who is told of fewer movers sees each of them in full.
    pub least: usize,
    /// A view is found anew when the observer has moved so far …
    pub moved_m: f64,
    /// … or is so old.
    pub lasts_ms: crate::Ms,
    /// Movers of which a smaller share is visible are not told of; zero culls nobody.
    pub cull_below: f64,
}

impl Default for Crowding {
    fn default() -> Self {
        Self {
            least: 48,
            moved_m: 0.5,
            lasts_ms: 1_000,
            cull_below: 0.0,
        }
    }
}

/// A square on the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Square {
    /// The lowest corner, x and z.
    pub(crate) min: [f64; 2],
    pub(crate) side_m: f64,
}

/// Where somebody is in a crowd: found once for all who look.
#[derive(Debug, Clone, Copy)]
pub struct Spot {
    leaf: node::Leaf,
    /// Of the leaf.
    square: Square,
    height_m: f64,
}

/// A mover seen from above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Disc {
    /// x and z.
    pub(crate) middle: [f64; 2],
    pub(crate) radius_m: f64,
    /// From its lowest to its highest point.
    pub(crate) heights: [f64; 2],
}

impl Disc {
    pub(crate) fn of(position: [f64; 3], radius_m: f64) -> Self {
        Self {
            middle: [position[0], position[2]],
            radius_m,
            heights: [position[1] - radius_m, position[1] + radius_m],
        }
    }
}

impl Square {
    pub(crate) fn max(&self) -> [f64; 2] {
        self.min.map(|x| x + self.side_m)
    }

    #[cfg(test)]
    pub(crate) fn holds(&self, point: [f64; 2]) -> bool {
        let max = self.max();
        (0..2).all(|axis| self.min[axis] <= point[axis] && point[axis] <= max[axis])
    }

    /// Corners, once around.
    pub(crate) fn corners(&self) -> [[f64; 2]; 4] {
        let ([a, b], [c, d]) = (self.min, self.max());
        [[a, b], [c, b], [c, d], [a, d]]
    }

    pub(crate) fn distance_m(&self, point: [f64; 2]) -> f64 {
        let max = self.max();
        let off = |axis: usize| (self.min[axis] - point[axis]).max(point[axis] - max[axis]).max(0.0);
        off(0).hypot(off(1))
    }

    /// Whether the two share a stretch of border.
    pub(crate) fn borders(&self, other: &Self) -> bool {
        let (max, others) = (self.max(), other.max());
        let overlap = |axis: usize| max[axis].min(others[axis]) - self.min[axis].max(other.min[axis]);
        let (x, z) = (overlap(0), overlap(1));
        (x == 0.0 && z > 0.0) || (z == 0.0 && x > 0.0)
    }
}
