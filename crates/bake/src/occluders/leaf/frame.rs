//! How does a door stand? Across which direction it is thin, and along which its edges run.

use glam::{DVec3, Vec3};

use super::super::Wall;
use crate::world::Triangle;

/// So many directions are tried, those of the largest faces and the longest edges first.
const DIRECTIONS: usize = 16;
/// Directions whose angle has a smaller sine than this are the same.
const SAME: f32 = 1e-3;
/// What is smaller by less than this is no better.
const BETTER: f32 = 0.95;

/// Three directions across each other.
pub(crate) struct Frame {
    /// Through the door.
    pub(super) normal: Vec3,
    /// Along its edges.
    pub(super) axes: [Vec3; 2],
}

impl Frame {
    /// The frame of some faces, which are not none.
    pub(crate) fn of(triangles: &[Triangle]) -> Self {
        let length = |direction: Vec3| {
            let corners = triangles.iter().flat_map(|triangle| triangle.corners);
            let heights = corners.map(|corner| direction.dot(corner));
            let [low, high] = heights.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], height| {
                [low.min(height), high.max(height)]
            });
            high - low
        };
        let faces = triangles.iter().map(|triangle| {
            let [a, b, c] = triangle.corners;
            (b - a).cross(c - a)
        });
        let normal = least(Vec3::AXES.into_iter().chain(unlike(faces)), length);
        // Of an edge through the door rounding would choose the direction.
        let edges = triangles.iter().flat_map(|triangle| {
            let [a, b, c] = triangle.corners;
            let along = |edge: &Vec3| edge.dot(normal).abs() < 0.5 * edge.length();
            let edges = [b - a, c - b, a - c].into_iter().filter(along);
            edges.map(|edge| edge.reject_from_normalized(normal))
        });
        let across = |first: Vec3| [first, normal.cross(first)];
        let first = least(
            [Wall::axes_across(normal)[0]].into_iter().chain(unlike(edges)),
            |first| across(first).into_iter().map(length).product(),
        );
        Self {
            normal,
            axes: across(first),
        }
    }

    /// A point along its axes and its normal.
    pub(crate) fn place(&self, point: Vec3) -> DVec3 {
        let along = |direction: Vec3| direction.as_dvec3().dot(point.as_dvec3());
        DVec3::new(along(self.axes[0]), along(self.axes[1]), along(self.normal))
    }
}

/// The direction with the least size; of those that differ by next to nothing the first.
fn least(directions: impl Iterator<Item = Vec3>, size: impl Fn(Vec3) -> f32) -> Vec3 {
    let sized = directions.map(|direction| (direction, size(direction)));
    let least = sized.reduce(|least, next| if next.1 < BETTER * least.1 { next } else { least });
    least.map_or(Vec3::X, |(direction, _)| direction)
}

/// The directions of the longest of these, none twice.
fn unlike(vectors: impl Iterator<Item = Vec3>) -> impl Iterator<Item = Vec3> {
    let mut vectors: Vec<Vec3> = vectors.collect();
    vectors.sort_by(|a, b| b.length_squared().total_cmp(&a.length_squared()));
    let mut found: Vec<Vec3> = Vec::new();
    for direction in vectors.into_iter().filter_map(Vec3::try_normalize) {
        if found.len() == DIRECTIONS {
            break;
        }
        if found.iter().all(|known| known.cross(direction).length() > SAME) {
            found.push(direction);
        }
    }
    found.into_iter()
}
