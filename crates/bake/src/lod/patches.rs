//! Which triangles together are one flat patch, and does a piece of another surface lie over it?
//!
//! No single triangle of a finely divided wall is near to all of a coarse one, though the wall as a whole is. So triangles that
//! hang together by their edges and lie in one plane, but for [`FLAT`] of the diagonal, count as one *patch*. Only the edges
//! that its triangles do not share bound it, each once for every triangle that has it more often in one direction than in the
//! other. Seen along the normal, a patch covers every point around which these edges wind; how often they do changes nowhere
//! but on them. So a piece that none of them meets is covered all over if one of its points is.
//!
//! Guarantee: [`Patches::bound`] is never less than the distance of any point of the piece from the patch, but for rounding to
//! double precision. Cost: O(n log n) to make; a question looks at the bounding edges in the rows that the piece lies in, at most
//! [`MOST_LOOKED_AT`].

mod neighbours;
mod rows;

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};

use self::{
    neighbours::Neighbours,
    rows::{Edge, Rows},
};
use super::proximity::Corners;

/// Corners of a patch lie no further off its plane than this share of the diagonal.
const FLAT: f64 = 1e-5;
/// No point of a piece is further from what is looked at of it than this share of the diagonal.
const INSET: f64 = 1e-5;
/// A piece may shrink by this at most.
const MOST_INSET: f64 = 1e-2;
/// Fewer triangles are asked one by one.
const LEAST: usize = 4;
/// A piece with more edges in its rows is not known to be covered.
const MOST_LOOKED_AT: usize = 4096;
/// A piece that more edges meet is better quartered than cut.
const MOST_CUTS: usize = 8;

/// The flat patches of a surface.
pub(crate) struct Patches {
    patches: Vec<Patch>,
    /// For each shape its patch, or [`NONE`].
    of: Vec<u32>,
    diagonal: f64,
}

const NONE: u32 = u32::MAX;

/// A flat patch, seen along its normal.
struct Patch {
    origin: DVec3,
    normal: DVec3,
    axes: [DVec3; 2],
    /// No corner is further off the plane.
    off: f64,
    edges: Vec<Edge>,
    /// Rows of equal height; edge numbers by the rows that they pass.
    rows: Rows,
}

impl Patches {
    /// The patches of some shapes; `diagonal` is that of the box around them.
    pub(crate) fn of(shapes: &[Corners], diagonal: f64) -> Self {
        let flat = FLAT * diagonal;
        let neighbours = Neighbours::of(shapes);
        let mut of = vec![NONE; shapes.len()];
        let mut is_taken = vec![false; shapes.len()];
        let mut patches = Vec::new();
        for seed in 0..shapes.len() {
            let [a, b, c] = shapes[seed];
            let Some(normal) = (b - a).cross(c - a).try_normalize() else {
                continue;
            };
            if is_taken[seed] {
                continue;
            }
            let lies_in = |shape: usize| shapes[shape].iter().all(|p| (p - a).dot(normal).abs() <= flat);
            let mut members = vec![seed];
            let mut next = 0;
            is_taken[seed] = true;
            while let Some(&shape) = members.get(next) {
                for other in neighbours.beside(shape) {
                    if !is_taken[other] && lies_in(other) {
                        is_taken[other] = true;
                        members.push(other);
                    }
                }
                next += 1;
            }
            if members.len() < LEAST {
                continue;
            }
            for &member in &members {
                of[member] = patches.len() as u32;
            }
            patches.push(Patch::of(shapes, &neighbours, &members, [a, normal]));
        }
        Self { patches, of, diagonal }
    }

    /// No point of a piece is further than this from the patch that a shape is part of, if the patch covers the piece.
    pub(crate) fn bound(&self, shape: u32, piece: &Corners) -> Option<f64> {
        let patch = self.patch(shape)?;
        let (flat, inset) = patch.flattened(piece, INSET * self.diagonal);
        let middle = flat.iter().sum::<DVec2>() / 3.0;
        let is_covered = patch.meeting(&flat, 1)?.is_empty() && patch.winds_around(middle);
        is_covered.then(|| patch.off_plane(piece) + patch.off + inset)
    }

    /// How far the corners of a piece lie to the side of an edge that bounds the patch of a shape, where cutting the piece there
    /// leaves parts that the patch covers or does not; `None` where no edge or too many meet it, or it is further than
    /// this off the plane.
    pub(crate) fn cut(&self, shape: u32, piece: &Corners, within: f64) -> Option<[f64; 3]> {
        let patch = self.patch(shape)?;
        if patch.off_plane(piece) > within {
            return None;
        }
        let (flat, _) = patch.flattened(piece, INSET * self.diagonal);
        let met = patch.meeting(&flat, MOST_CUTS + 1)?;
        if met.len() > MOST_CUTS {
            return None;
        }
        let longest = met.into_iter().max_by(|a, b| a.length().total_cmp(&b.length()))?;
        let outwards = (longest.to - longest.from).perp().normalize_or_zero();
        let sides = piece.map(|p| (patch.flat(p) - longest.from).dot(outwards));
        let least = INSET * MOST_INSET * self.diagonal;
        (sides.iter().any(|d| *d > least) && sides.iter().any(|d| *d < -least)).then_some(sides)
    }

    fn patch(&self, shape: u32) -> Option<&Patch> {
        self.patches.get(self.of[shape as usize] as usize)
    }
}

impl Patch {
    fn of(shapes: &[Corners], neighbours: &Neighbours, members: &[usize], [origin, normal]: [DVec3; 2]) -> Self {
        let (u, v) = normal.any_orthonormal_pair();
        let mut patch = Self {
            origin,
            normal,
            axes: [u, v],
            off: 0.0,
            edges: Vec::new(),
            rows: Rows::of(&[]),
        };
        let mut balance: BTreeMap<[u32; 2], (i32, [DVec3; 2])> = BTreeMap::new();
        for &member in members {
            patch.off = patch.off.max(patch.off_plane(&shapes[member]));
            let ids = neighbours.corners[member];
            for i in 0..3 {
                let (from, to) = (i, (i + 1) % 3);
                let [a, b] = [from, to].map(|corner| (ids[corner], shapes[member][corner]));
                let (key, ends, times) = if a.0 <= b.0 {
                    ([a.0, b.0], [a.1, b.1], 1)
                } else {
                    ([b.0, a.0], [b.1, a.1], -1)
                };
                balance.entry(key).or_insert((0, ends)).0 += times;
            }
        }
        let loose = balance.into_iter().filter(|([a, b], (times, _))| a != b && *times != 0);
        let edge = |(_, (times, [from, to])): ([u32; 2], (i32, [DVec3; 2]))| Edge {
            from: patch.flat(from),
            to: patch.flat(to),
            times,
        };
        patch.edges = loose.map(edge).collect();
        // Rows lie along most edges: the teeth of a comb are in few rows each then.
        let along = patch
            .edges
            .iter()
            .fold(DVec2::ZERO, |sum, edge| sum + (edge.to - edge.from).abs());
        if along.y > along.x {
            // A quarter turn, which changes no winding.
            patch.axes = [v, -u];
            for edge in &mut patch.edges {
                (edge.from, edge.to) = (-edge.from.perp(), -edge.to.perp());
            }
        }
        patch.rows = Rows::of(&patch.edges);
        patch
    }

    fn flat(&self, point: DVec3) -> DVec2 {
        let [u, v] = self.axes;
        DVec2::new(u.dot(point - self.origin), v.dot(point - self.origin))
    }

    fn off_plane(&self, piece: &Corners) -> f64 {
        let off = piece.map(|p| self.normal.dot(p - self.origin).abs());
        off.into_iter().fold(0.0, f64::max)
    }

    /// A piece, a little drawn in so that edges along its own do not meet it; no point of it is further than the second from
    /// what is left.
    fn flattened(&self, piece: &Corners, inset: f64) -> ([DVec2; 3], f64) {
        let middle = piece.iter().sum::<DVec3>() / 3.0;
        let reach = piece.iter().map(|p| p.distance(middle)).fold(0.0, f64::max);
        let share = (inset / reach.max(f64::MIN_POSITIVE)).min(MOST_INSET);
        (piece.map(|p| self.flat(p.lerp(middle, share))), share * reach)
    }

    /// The bounding edges that meet a triangle, up to so many; `None` where there are too many to look at.
    fn meeting(&self, triangle: &[DVec2; 3], most: usize) -> Option<Vec<Edge>> {
        let heights = triangle.map(|p| p.y);
        let low = heights.into_iter().fold(f64::INFINITY, f64::min);
        let high = heights.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let beside = self.rows.between(low, high);
        if beside.len() > MOST_LOOKED_AT {
            return None;
        }
        let mut met: Vec<u32> = Vec::new();
        for &number in beside {
            if met.len() == most {
                break;
            }
            if !met.contains(&number) && self.edges[number as usize].meets(triangle) {
                met.push(number);
            }
        }
        Some(met.into_iter().map(|number| self.edges[number as usize]).collect())
    }

    fn winds_around(&self, point: DVec2) -> bool {
        let times = self.rows.between(point.y, point.y).iter().map(|number| {
            let Edge { from, to, times } = self.edges[*number as usize];
            if (from.y <= point.y) == (to.y <= point.y) {
                return 0;
            }
            let at = from.x + (to.x - from.x) * (point.y - from.y) / (to.y - from.y);
            if at <= point.x {
                0
            } else if to.y > from.y {
                times
            } else {
                -times
            }
        });
        times.sum::<i32>() != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lod::proximity::ShapeTree;

    /// Squares of 1 around whole numbers below `side`, two triangles each, but for those that are left out.
    fn squares(side: u32, is_left_out: impl Fn(u32, u32) -> bool) -> Vec<Corners> {
        let at = |x: u32, y: u32| DVec3::new(f64::from(x), f64::from(y), 0.0);
        let mut shapes = Vec::new();
        for (x, y) in (0..side).flat_map(|x| (0..side).map(move |y| (x, y))) {
            if !is_left_out(x, y) {
                shapes.push([at(x, y), at(x + 1, y), at(x + 1, y + 1)]);
                shapes.push([at(x, y), at(x + 1, y + 1), at(x, y + 1)]);
            }
        }
        shapes
    }

    fn patches(shapes: &[Corners]) -> Patches {
        Patches::of(shapes, 30.0)
    }

    fn piece(corners: [[f64; 2]; 3], z: f64) -> Corners {
        corners.map(|[x, y]| DVec3::new(x, y, z))
    }

    #[test]
    fn a_patch_covers_what_lies_over_it_up_to_its_own_edges() {
        let shapes = squares(20, |_, _| false);
        let patches = patches(&shapes);
        assert_eq!(patches.patches.len(), 1);
        let half = piece([[0.0, 0.0], [20.0, 0.0], [20.0, 20.0]], 0.25);
        let bound = patches.bound(7, &half).unwrap();
        assert!((0.25..0.2505).contains(&bound), "{bound}");
        let beyond = piece([[0.0, 0.0], [20.1, 0.0], [20.0, 20.0]], 0.25);
        assert_eq!(patches.bound(7, &beyond), None);
        let beside = piece([[30.0, 0.0], [31.0, 0.0], [31.0, 1.0]], 0.0);
        assert_eq!(patches.bound(7, &beside), None);
        assert_eq!(patches.cut(7, &beside, 1.0), None);
    }

    #[test]
    fn a_hole_is_not_covered_and_pieces_are_cut_at_its_edges() {
        let shapes = squares(20, |x, y| (8..10).contains(&x) && (5..9).contains(&y));
        let patches = patches(&shapes);
        let over_the_hole = piece([[0.0, 0.0], [20.0, 0.0], [20.0, 20.0]], 0.0);
        assert_eq!(patches.bound(0, &over_the_hole), None);
        let in_the_hole = piece([[8.5, 6.0], [9.0, 6.0], [9.0, 7.0]], 0.0);
        assert_eq!(patches.bound(0, &in_the_hole), None);
        let beside = piece([[10.0, 0.0], [20.0, 0.0], [20.0, 10.0]], 0.0);
        assert!(patches.bound(0, &beside).is_some());
        let across = piece([[9.5, 7.0], [10.5, 7.0], [10.5, 7.5]], 0.0);
        let sides = patches.cut(0, &across, 1e-3).unwrap();
        let mut off: Vec<f64> = sides.iter().map(|d| d.abs()).collect();
        off.sort_by(f64::total_cmp);
        assert!(off.iter().all(|d| (d - 0.5).abs() < 1e-9), "{off:?}");
        assert_eq!(
            patches.cut(0, &piece([[9.5, 7.0], [10.5, 7.0], [10.5, 7.5]], 0.1), 1e-3),
            None
        );
    }

    #[test]
    fn teeth_of_a_comb_stand_in_few_rows_whichever_way_they_stand() {
        for turned in [false, true] {
            let mut shapes = squares(40, |x, y| y > 0 && x % 2 == 1);
            if turned {
                shapes.iter_mut().flatten().for_each(|p| (p.x, p.y) = (p.y, -p.x));
            }
            let patches = Patches::of(&shapes, 60.0);
            let patch = &patches.patches[0];
            assert!(
                patch.rows.edges.len() < 4 * patch.edges.len(),
                "{}",
                patch.rows.edges.len()
            );
            let tooth = shapes
                .iter()
                .position(|[a, _, _]| a.x.abs() > 5.0 && a.y.abs() > 5.0)
                .unwrap();
            assert!(patches.bound(tooth as u32, &shapes[tooth]).is_some());
        }
    }

    #[test]
    fn no_point_is_further_than_the_bound_whatever_the_patch() {
        let mut random = crate::visibility::random::Random::stream(21, 0);
        let mut covered = 0;
        for round in 0..600 {
            let mut shapes = squares(8, |x, y| (x * 31 + y * 17 + round) % 5 == 0);
            // Some are the other way round, some twice, and all a little off the plane.
            for i in 0..shapes.len() {
                match random.below(12) {
                    0 => shapes[i].swap(0, 1),
                    1 => shapes.push(shapes[i]),
                    _ => {}
                }
            }
            for corner in shapes.iter_mut().flatten() {
                let wave = (corner.x * 0.7).sin() * (corner.y * 1.3).cos();
                corner.z = 0.9e-4 * wave;
            }
            let (patches, tree) = (Patches::of(&shapes, 12.0), ShapeTree::new(shapes.clone()));
            for _ in 0..40 {
                let middle = random.cube().as_dvec3() * 8.0;
                let corner = |random: &mut crate::visibility::random::Random| {
                    middle.with_z(0.2) + random.around_zero().as_dvec3() * DVec3::new(1.5, 1.5, 0.2)
                };
                let mut piece = [0; 3].map(|_| corner(&mut random));
                if random.unit() < 0.5 {
                    // Along the patch, and up to its border, where nothing hides what the bound forgets.
                    piece = piece.map(|p| DVec3::new(p.x.round(), p.y.round(), 0.0));
                }
                let shape = random.below(shapes.len()) as u32;
                let Some(bound) = patches.bound(shape, &piece) else {
                    continue;
                };
                covered += 1;
                let places = (0..30).map(|i| match i {
                    0..10 => random.in_triangle().map(f64::from),
                    _ => [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.0, 0.5], [0.5, 0.5]][i % 6],
                });
                for [u, v] in places.collect::<Vec<_>>() {
                    let point = piece[0] + u * (piece[1] - piece[0]) + v * (piece[2] - piece[0]);
                    let distance = tree.nearest_to_all(&[point], None, 0.0).distance;
                    assert!(distance <= bound * (1.0 + 1e-9), "{distance} > {bound}");
                }
            }
        }
        assert!(covered > 200, "{covered} pieces were covered");
    }
}
