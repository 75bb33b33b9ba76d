//! How far is a point from a surface?
//!
//! A bounding-volume tree in which a node has four children: shapes are halved, and halved again, across where they spread
//! widest; very many are put in Morton order, which takes less time than half as many looks then save. Their boxes lie side by side, so one look
//! at all four is a few vector instructions (Dammertz, Hanika, Keller, *Shallow bounding volume hierarchies for fast SIMD ray
//! tracing of incoherent rays*, 2008), and shapes are looked at like nodes: by their boxes first, the nearest first. Boxes are of
//! single precision, rounded outwards, so that they leave out nothing; distances of shapes are of double precision. It knows
//! points only; [`ShapeTree`](crate::lod::proximity::ShapeTree) tells what is near to all of a piece of surface.

use glam::{DVec3, Vec3, Vec4};

use super::quantise::QuantisedMesh;
use crate::lod::{
    octree::morton_order,
    proximity::{Corners, bounds, point_distance_squared},
};

/// Children of a node.
const CHILDREN: usize = 4;
/// More shapes are put in Morton order.
const MOST_HALVED: usize = 1 << 14;
/// More entries than a search has at once: all but one child of each node on the way down to one of 2³² shapes, and that one's.
const STACK: usize = 64;

/// Shapes, mostly a mesh's triangles, from which distances are measured. Coordinates must be below 10¹⁸, so that their squares
/// are numbers of single precision.
pub struct Surface {
    /// In the order in which they were given.
    pub(super) shapes: Vec<Corners>,
    /// The same as they stand below the nodes, each of which but the last is full.
    order: Vec<u32>,
    /// Nodes; first those over shapes, last the root.
    levels: Vec<Vec<Node>>,
}

/// A shape and the square of its distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Nearest {
    /// Index into [`Surface::shapes`].
    pub(super) shape: u32,
    pub(super) squared: f64,
}

impl Surface {
    /// Of a mesh that is given by twice its positions, in steps of the lattice.
    #[must_use]
    pub fn new(twice_positions: &[[i32; 3]], triangles: &[[u32; 3]]) -> Self {
        let corner = |v: u32| DVec3::from_array(twice_positions[v as usize].map(|x| 0.5 * f64::from(x)));
        Self::of_shapes(triangles.iter().map(|t| t.map(corner)).collect())
    }

    /// Of the whole mesh, in steps of the lattice.
    #[must_use]
    pub fn of(mesh: &QuantisedMesh) -> Self {
        Self::new(&mesh.twice_positions(), &mesh.triangles)
    }

    /// Of shapes one by one.
    pub(crate) fn of_shapes(shapes: Vec<Corners>) -> Self {
        let order = if shapes.len() > MOST_HALVED {
            let middles: Vec<DVec3> = shapes.iter().map(|[a, b, c]| (a + b + c) / 3.0).collect();
            morton_order(&middles)
        } else {
            halved(&shapes)
        };
        let mut boxes: Vec<(DVec3, DVec3)> = order.iter().map(|&shape| bounds(&shapes[shape as usize])).collect();
        let mut levels = Vec::new();
        while boxes.len() > 1 || levels.is_empty() {
            let nodes: Vec<Node> = boxes.chunks(CHILDREN).map(Node::over).collect();
            boxes = boxes.chunks(CHILDREN).map(around).collect();
            levels.push(nodes);
        }
        Self { shapes, order, levels }
    }

    /// Whether there is nothing to measure from.
    pub(crate) fn is_empty(&self) -> bool {
        self.shapes.is_empty()
    }

    /// The diagonal of its box.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        let corners = self.shapes.iter().map(bounds);
        let (min, max) = corners.fold(NOTHING, joined);
        (max - min).max(DVec3::ZERO).length()
    }

    /// What is nearest to a point; the search starts from a shape that may be near.
    pub(super) fn nearest(&self, point: DVec3, known: Option<u32>) -> Nearest {
        let nothing = Nearest {
            shape: 0,
            squared: f64::INFINITY,
        };
        let mut best = known.map_or(nothing, |shape| self.distance(point, shape));
        let mut limit = limit_of(best.squared);
        let at = Bounded::of(point);
        // What is to be looked at, nearest last: how far at least, how many levels above the shapes, which there.
        let mut stack = [(0.0, 0, 0); STACK];
        stack[0] = (0.0, self.levels.len() as u32, 0);
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let (squared, level, place) = stack[height];
            if squared >= limit {
                continue;
            }
            let Some(below) = level.checked_sub(1) else {
                let found = self.distance(point, self.order[place as usize]);
                if found.squared < best.squared {
                    best = found;
                    limit = limit_of(best.squared);
                }
                continue;
            };
            let Some(node) = self.levels[below as usize].get(place as usize) else {
                continue;
            };
            let first = height;
            let squared = node.squared_to(&at);
            let mut near = squared.cmplt(Vec4::splat(limit)).bitmask();
            let squared = squared.to_array();
            while near != 0 {
                let child = near.trailing_zeros();
                near &= near - 1;
                let entry = (squared[child as usize], below, CHILDREN as u32 * place + child);
                let mut at = height;
                while at > first && stack[at - 1].0 < entry.0 {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
                stack[at] = entry;
                height += 1;
            }
        }
        best
    }

    fn distance(&self, point: DVec3, shape: u32) -> Nearest {
        let squared = point_distance_squared(point, &self.shapes[shape as usize]);
        Nearest { shape, squared }
    }
}

/// An order of shapes in which those of a node, of its children and so on are near each other.
fn halved(shapes: &[Corners]) -> Vec<u32> {
    let middles = shapes.iter().map(|[a, b, c]| (a + b + c).as_vec3());
    let mut members: Vec<(Vec3, u32)> = middles.zip(0..).collect();
    let mut below_child = 1;
    while below_child < members.len() {
        below_child *= CHILDREN;
    }
    arrange(&mut members, below_child);
    members.into_iter().map(|(_, shape)| shape).collect()
}

/// Puts shapes, with their middles, in order for nodes of which each child but the last has so many below it.
fn arrange(members: &mut [(Vec3, u32)], below_child: usize) {
    if members.len() <= CHILDREN {
        return;
    }
    if members.len() <= below_child {
        arrange(members, below_child / CHILDREN);
        return;
    }
    let nothing = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let middles = members.iter().map(|(middle, _)| *middle);
    let (low, high) = middles.fold(nothing, |(low, high), middle| (low.min(middle), high.max(middle)));
    let axis = (high - low).max_position();
    let half = members.len().div_ceil(below_child).div_ceil(2) * below_child;
    members.select_nth_unstable_by(half, |a, b| a.0[axis].total_cmp(&b.0[axis]));
    let (before, behind) = members.split_at_mut(half);
    arrange(before, below_child);
    arrange(behind, below_child);
}

/// What is in a box that is so far or farther is not nearer than so much, whatever was rounded: a few parts in 2²⁴.
fn limit_of(squared: f64) -> f32 {
    above(squared * (1.0 + 1e-6))
}

/// The nearest number of single precision that is not larger.
fn below(x: f64) -> f32 {
    let rounded = x as f32;
    if f64::from(rounded) > x {
        rounded.next_down()
    } else {
        rounded
    }
}

/// The nearest number of single precision that is not smaller.
fn above(x: f64) -> f32 {
    -below(-x)
}

/// A point between two of single precision.
struct Bounded {
    low: Vec3,
    high: Vec3,
}

impl Bounded {
    fn of(point: DVec3) -> Self {
        Self {
            low: Vec3::from_array(point.to_array().map(below)),
            high: Vec3::from_array(point.to_array().map(above)),
        }
    }
}

/// The boxes of a node's children, axis by axis.
struct Node {
    low: [Vec4; 3],
    high: [Vec4; 3],
}

impl Node {
    /// Over up to four boxes; nothing is near to those that are missing.
    fn over(boxes: &[(DVec3, DVec3)]) -> Self {
        let side = |i: usize| boxes.get(i).copied().unwrap_or(NOTHING);
        let sides: [(DVec3, DVec3); CHILDREN] = std::array::from_fn(side);
        Self {
            low: std::array::from_fn(|axis| Vec4::from_array(sides.map(|side| below(side.0[axis])))),
            high: std::array::from_fn(|axis| Vec4::from_array(sides.map(|side| above(side.1[axis])))),
        }
    }

    /// No shape in a child is nearer to a point than the root of this, but for what is rounded in the last few operations.
    #[inline(always)]
    fn squared_to(&self, point: &Bounded) -> Vec4 {
        let mut squared = Vec4::ZERO;
        for axis in 0..3 {
            let (low, high) = (Vec4::splat(point.low[axis]), Vec4::splat(point.high[axis]));
            let gap = (self.low[axis] - high).max(low - self.high[axis]).max(Vec4::ZERO);
            squared += gap * gap;
        }
        squared
    }
}

/// The box around nothing.
const NOTHING: (DVec3, DVec3) = (DVec3::INFINITY, DVec3::NEG_INFINITY);

fn joined(a: (DVec3, DVec3), b: (DVec3, DVec3)) -> (DVec3, DVec3) {
    (a.0.min(b.0), a.1.max(b.1))
}

fn around(boxes: &[(DVec3, DVec3)]) -> (DVec3, DVec3) {
    boxes.iter().copied().fold(NOTHING, joined)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_is_that_of_looking_at_all() {
        let mut state = 1u32;
        let mut random = |below: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 16) % below
        };
        for count in [1, 2, 4, 5, 17, 300] {
            let mut point = |below| DVec3::from_array([0; 3].map(|_| f64::from(random(below))));
            // Some without area.
            let shapes: Vec<Corners> = (0..count)
                .map(|_| {
                    let at = point(90);
                    [at, at + point(9), at + point(3)]
                })
                .collect();
            let surface = Surface::of_shapes(shapes.clone());
            for i in 0..100 {
                let point = point(100);
                let squared = shapes
                    .iter()
                    .map(|shape| point_distance_squared(point, shape))
                    .fold(f64::INFINITY, f64::min);
                for known in [None, Some(i % count)] {
                    let nearest = surface.nearest(point, known);
                    assert_eq!(nearest.squared, squared);
                    assert_eq!(point_distance_squared(point, &shapes[nearest.shape as usize]), squared);
                }
            }
        }
    }

    #[test]
    fn nothing_is_infinitely_far() {
        let nothing = Surface::of_shapes(Vec::new());
        assert_eq!(
            (nothing.nearest(DVec3::ZERO, None).squared, nothing.diagonal()),
            (f64::INFINITY, 0.0)
        );
    }
}
