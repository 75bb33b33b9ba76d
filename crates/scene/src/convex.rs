//! Does a point lie in a convex cell, and does it surely lie in no other?
//!
//! A cell is a box, or where a box and some half-spaces meet. Half-spaces are `[nx, ny, nz, d]` with a normal of length
//! 1: points with n · p ≤ d. Every reader computes `nx·x + ny·y + nz·z − d` in this order in f64 without fused
//! operations, so that all of them agree to the last bit.

use crate::Bounds;

/// A half-space: points with `[0]·x + [1]·y + [2]·z ≤ [3]`.
pub type HalfSpace = [f64; 4];

/// A point no further outside a half-space than this is inside: rounding must leave no gaps between cells.
pub const TOUCH_M: f64 = 1e-6;
/// Published cells overlap by less than this, so a point that lies deeper than this in one lies in no other.
pub const SURE_M: f64 = 2e-3;

/// How far a point lies outside a half-space in metres, negative inside.
#[must_use]
pub fn outside_m(half: &HalfSpace, point: [f64; 3]) -> f64 {
    half[0] * point[0] + half[1] * point[1] + half[2] * point[2] - half[3]
}

/// Zero when a point lies in a cell, else the largest of its distances in metres to the cell's box and to its planes.
/// That is at most the distance to the cell, and at least that to its box.
#[must_use]
pub fn distance_m(bounds: &Bounds, planes: &[HalfSpace], point: [f64; 3]) -> f64 {
    let beyond = |half| Some(outside_m(half, point)).filter(|outside_m| *outside_m > TOUCH_M);
    planes
        .iter()
        .filter_map(beyond)
        .fold(bounds.distance_m(point), f64::max)
}

/// Whether a point lies so deep in a cell that it lies in no other.
#[must_use]
pub fn holds_alone(bounds: &Bounds, planes: &[HalfSpace], point: [f64; 3]) -> bool {
    let deep = |a: usize| bounds.min[a] + SURE_M < point[a] && point[a] < bounds.max[a] - SURE_M;
    (0..3).all(deep) && planes.iter().all(|half| outside_m(half, point) < -SURE_M)
}
