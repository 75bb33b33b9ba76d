//! How far is a level from its source?
//!
//! An upper bound of the two-sided Hausdorff distance between two sets of triangles, lines and points, by branch and
//! bound (as in Tang, Lee, Kim, *Interactive Hausdorff distance computation for general polygonal models*, 2009):
//!
//! * the distance to one convex shape is a convex function, so over a piece of surface it is largest at a corner. The
//!   smallest such value over all shapes is an *upper bound* for the piece;
//! * the distance of any one point of a piece is a *lower bound* for the whole;
//! * pieces whose upper bound is well above the lower bound are quartered, the worst first, until the two are close
//!   ([`HausdorffLimits`]) or the work is used up. Then the worst upper bound is the answer: it is never too small, and
//!   less work only makes it looser.
//!
//! Coarse levels of flat walls are near to many triangles of the source together and to none alone, so pieces are also judged by
//! flat patches ([`super::patches`]) and cut at their edges.
//!
//! How far vertices moved would be a bound too, but a poor one: along a smooth surface with cells of width h they move
//! by h, while the surface moves by h²/8r.
//!
//! Cost: the number of pieces times O(log n). Deterministic: pieces are judged in rounds against one fixed threshold.

use glam::DVec3;
use rayon::prelude::*;

use crate::lod::proximity::{Corners, ShapeTree, shapes_of};
use crate::smooth::error::{Ruler, Surface};
use crate::source::Primitive;

/// When the error measure is content.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HausdorffLimits {
    /// The bound may be this much above the true value, as a share of it …
    pub relative: f64,
    /// … or this much, as a share of the diagonal of the source's box. With 1e-4, an error that is too small to be told
    /// apart is good enough from a tenth of the diagonal on.
    pub of_diagonal: f64,
    /// Most pieces that one comparison looks at, for each shape of source and level …
    pub pieces_per_shape: usize,
    /// … and in addition to that.
    pub extra_pieces: usize,
}

impl Default for HausdorffLimits {
    fn default() -> Self {
        Self {
            relative: 0.4,
            of_diagonal: 2e-4,
            pieces_per_shape: 1,
            extra_pieces: 100_000,
        }
    }
}

/// The root mean square of the distances of so many points on each of two sides from the other, as METRO has it (Cignoni
/// et al. 1998): a mean and no bound, in model-space units. Infinite when a side has no shapes.
#[must_use]
pub fn rms(a: &[Primitive], b: &[Primitive], samples: usize) -> f64 {
    let [a, b] = [a, b].map(|primitives| Surface::of_shapes(shapes_of(primitives)));
    if a.is_empty() {
        return f64::INFINITY;
    }
    Ruler::new(&a, samples).rms(&b)
}

/// How many points are asked for a first lower bound, and how many for a better one in each round.
const PROBES: usize = 256;

/// A part of a shape, and the shape of the other side that is nearest to all of it.
#[derive(Debug, Clone, Copy)]
struct Piece {
    corners: Corners,
    near: Option<u32>,
    bound: f64,
}

/// No point of `source` is farther from `level`, nor the reverse. `origins` names for each shape of the level a shape of
/// the source that is near: a first guess. `None` when the distance is not below `of_interest`.
pub(crate) fn hausdorff_bound(
    source: &ShapeTree,
    level: &ShapeTree,
    origins: &[u32],
    limits: HausdorffLimits,
    of_interest: f64,
) -> Option<f64> {
    let piece = |corners: Corners, near| Piece {
        corners,
        near,
        bound: f64::INFINITY,
    };
    let mut images = vec![None; source.shapes.len()];
    for (image, &origin) in origins.iter().enumerate() {
        images[origin as usize] = Some(image as u32);
    }
    let from_source = source
        .shapes
        .iter()
        .zip(images)
        .map(|(s, image)| piece(*s, image))
        .collect();
    let from_level = level
        .shapes
        .iter()
        .zip(origins)
        .map(|(s, origin)| piece(*s, Some(*origin)))
        .collect();
    let mut search = Search {
        lower: 0.0,
        upper: 0.0,
        slack: limits.of_diagonal * source.diagonal(),
        relative: limits.relative,
        of_interest,
    };
    let allowance = limits.pieces_per_shape * (source.shapes.len() + level.shapes.len()) + limits.extra_pieces;
    search.run(from_source, level, allowance);
    search.run(from_level, source, allowance);
    // Distances are rounded; the statement must not be.
    let bound = search.upper * (1.0 + 1e-9);
    (search.lower < of_interest && bound < of_interest).then_some(bound)
}

/// The same of a level of which nobody knows what became of which shape.
pub(crate) fn hausdorff_bound_of(source: &ShapeTree, level: &ShapeTree, limits: HausdorffLimits) -> f64 {
    let near = |[a, b, c]: &Corners| source.nearest_to_all(&[(a + b + c) / 3.0], None, 0.0).shape;
    let origins: Vec<u32> = level.shapes.par_iter().map(near).collect();
    hausdorff_bound(source, level, &origins, limits, f64::INFINITY).unwrap_or(f64::INFINITY)
}

struct Search {
    /// Some point is at least so far.
    lower: f64,
    /// No point is farther, of all that was finished.
    upper: f64,
    slack: f64,
    relative: f64,
    /// Nobody wants to know how far it is when it is this far.
    of_interest: f64,
}

impl Search {
    /// A piece with no greater bound needs no closer look.
    fn enough(&self) -> f64 {
        (self.lower * (1.0 + self.relative)).max(self.lower + self.slack)
    }

    fn run(&mut self, mut pieces: Vec<Piece>, target: &ShapeTree, mut allowance: usize) {
        let step = pieces.len().div_ceil(PROBES).max(1);
        self.probe(pieces.iter().step_by(step), target);
        while !pieces.is_empty() && self.lower < self.of_interest {
            let enough = self.enough();
            pieces.par_iter_mut().for_each(|piece| piece.judge(target, enough));
            allowance = allowance.saturating_sub(pieces.len());
            self.finish(&mut pieces, enough);
            // Worst first; equal ones in the order they came.
            pieces.sort_by(|a, b| b.bound.total_cmp(&a.bound));
            self.probe(pieces.iter().take(PROBES), target);
            let enough = self.enough();
            self.finish(&mut pieces, enough);
            let left_over = pieces.split_off(pieces.len().min(allowance / 4));
            self.upper = left_over
                .first()
                .map_or(self.upper, |worst| self.upper.max(worst.bound));
            if !left_over.is_empty() {
                // What is left over already sets the bound: nothing below it matters.
                let upper = self.upper;
                self.finish(&mut pieces, upper);
            }
            pieces = pieces.iter().flat_map(|piece| piece.parts(target)).collect();
        }
    }

    /// Takes out the pieces that are good enough.
    fn finish(&mut self, pieces: &mut Vec<Piece>, enough: f64) {
        let finished = pieces.extract_if(.., |piece| piece.bound <= enough);
        self.upper = finished.fold(self.upper, |upper, piece| upper.max(piece.bound));
    }

    /// Raises the lower bound to the farthest of some points of the pieces.
    fn probe<'a>(&mut self, pieces: impl Iterator<Item = &'a Piece>, target: &ShapeTree) {
        let points: Vec<(DVec3, Option<u32>)> = pieces.flat_map(Piece::samples).collect();
        let distance = |(point, near): &(DVec3, Option<u32>)| target.nearest_to_all(&[*point], *near, 0.0).distance;
        self.lower = points.par_iter().map(distance).reduce(|| self.lower, f64::max);
    }
}

impl Piece {
    fn judge(&mut self, target: &ShapeTree, enough: f64) {
        let by_patch = |shape| target.patches().bound(shape, &self.corners).unwrap_or(f64::INFINITY);
        let mut bound = self.near.map_or(f64::INFINITY, by_patch);
        if bound > enough {
            let near = target.nearest_to_all(&self.corners, self.near, enough);
            if near.distance > enough && self.near != Some(near.shape) {
                bound = by_patch(near.shape);
            }
            bound = bound.min(near.distance);
            self.near = Some(near.shape);
        }
        self.bound = bound;
    }

    fn samples(&self) -> [(DVec3, Option<u32>); 2] {
        let [a, b, c] = self.corners;
        [((a + b + c) / 3.0, self.near), (a, self.near)]
    }

    /// Parts that cover the piece and have better bounds. When it lies over the edge of a flat patch, it is cut there; when it
    /// mostly juts out over an edge of the shape that it is near to, what juts out is cut off, and the rest needs no further look;
    /// else it is quartered.
    fn parts(&self, target: &ShapeTree) -> Vec<Self> {
        let at_patch = |shape| target.patches().cut(shape, &self.corners, 0.5 * self.bound);
        if let Some(sides) = self.near.and_then(at_patch) {
            return self.cut(sides);
        }
        let near = self.near.map(|shape| target.shapes[shape as usize]);
        let cut = near.and_then(|[a, b, c]| {
            // Of a piece that reaches over many shapes, each cut would peel off just one.
            if longest_edge(&self.corners) > 2.0 * longest_edge(&[a, b, c]) {
                return None;
            }
            let normal = (b - a).cross(c - a);
            let beyond = |from: DVec3, to: DVec3| {
                let outwards = (to - from).cross(normal).normalize_or_zero();
                self.corners.map(|p| (p - from).dot(outwards))
            };
            let sides = [beyond(a, b), beyond(b, c), beyond(c, a)];
            let farthest = |side: &[f64; 3]| side.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let side = sides.into_iter().max_by(|a, b| farthest(a).total_cmp(&farthest(b)))?;
            let juts_out = farthest(&side) > 0.25 * self.bound && side.iter().any(|&d| d < -0.01 * self.bound);
            juts_out.then(|| self.cut(side))
        });
        cut.unwrap_or_else(|| self.quarters())
    }

    /// Cuts along the plane from which the corners are so far; some are in front of it and some behind.
    fn cut(&self, sides: [f64; 3]) -> Vec<Self> {
        let is_alone = |i: usize| {
            let in_front = sides.map(|d| d > 0.0);
            in_front[i] != in_front[(i + 1) % 3] && in_front[i] != in_front[(i + 2) % 3]
        };
        let alone = (0..3).find(|&i| is_alone(i)).unwrap_or_default();
        let [i, j, k] = [alone, (alone + 1) % 3, (alone + 2) % 3];
        let [a, b, c] = [i, j, k].map(|corner| self.corners[corner]);
        let ab = a.lerp(b, sides[i] / (sides[i] - sides[j]));
        let ac = a.lerp(c, sides[i] / (sides[i] - sides[k]));
        let parts = [[a, ab, ac], [ab, b, c], [ab, c, ac]];
        parts.map(|corners| Self { corners, ..*self }).to_vec()
    }

    fn quarters(&self) -> Vec<Self> {
        let [a, b, c] = self.corners;
        let (ab, bc, ca) = (a.midpoint(b), b.midpoint(c), c.midpoint(a));
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            .map(|corners| Self { corners, ..*self })
            .to_vec()
    }
}

fn longest_edge(&[a, b, c]: &Corners) -> f64 {
    a.distance(b).max(b.distance(c)).max(c.distance(a))
}
