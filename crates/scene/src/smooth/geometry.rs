//! Where is a new vertex? A prediction from what surrounds it, and what is missing from it.
//!
//! The prediction is a weighted sum in the spirit of Pajarola & Rossignac, *Compressed progressive meshes* (2000): the
//! mean of the vertices where edges open, the mean of the other new neighbours, and how far each of them, and the old
//! vertex, lies from the mean of its own neighbours. What is missing from it is [`super::residual`]'s.

use super::change::Change;
use super::fan::{Spoke, Star};
use super::mesh::{Mesh, NONE, Point};
use super::split::Split;

/// Directions from the old vertex, in 1/16 of the lattice's step, that are weighted and added up.
pub const FEATURES: usize = 5;
/// Kinds of neighbourhoods with weights of their own.
pub const HOODS: usize = 12;
/// Weights in 1/64 for each kind of neighbourhood.
pub type Weights = [[i8; FEATURES]; HOODS];

/// For whoever sends no weights of its own.
pub const USUAL_WEIGHTS: Weights = [[16, 16, -8, 16, 16]; HOODS];

/// What surrounds a new vertex.
#[derive(Debug, Clone, Copy, Default)]
pub struct Hood {
    /// Directions from the old vertex, in 1/16 of a step: to the middle of the vertices where edges open, to that of the
    /// other new neighbours; from the old vertex to the middle of its neighbours, and the same for the first two, in the mean.
    pub features: [[i32; 3]; FEATURES],
    /// Which weights to take, below [`HOODS`].
    pub kind: usize,
    /// Normal of the surface, not of unit length.
    pub(super) normal: [i64; 3],
    /// The old vertex and the new neighbours, as far as there is room.
    near: [[i32; 3]; MOST_NEAR],
    near_count: usize,
    /// Mean distance of the new neighbours from the old vertex.
    pub(super) size: u8,
}

const MOST_NEAR: usize = 12;

/// 2¹⁶ / n.
const SHARES: [i64; 256] = {
    let mut shares = [0; 256];
    let mut n = 1;
    while n < 256 {
        shares[n] = (65536 + n as i64 / 2) / n as i64;
        n += 1;
    }
    shares
};

#[inline(always)]
fn share_of(count: usize) -> i64 {
    if count < 256 {
        SHARES[count]
    } else {
        65536 / count as i64
    }
}

/// Twice the logarithm of a mean distance, from 0 to 31.
#[inline(always)]
pub(super) fn size_class(mean: u64) -> u8 {
    let number = mean + 1;
    let log = number.ilog2();
    let half = if log > 0 { number >> (log - 1) & 1 } else { 0 };
    (2 * u64::from(log) + half).min(31) as u8
}

/// What is seen of a neighbour.
#[derive(Clone, Copy)]
struct Seen {
    /// The way to it from the old vertex.
    way: [i32; 3],
    /// From it to the middle of its neighbours, in 1/16.
    lap: [i64; 3],
}

impl Hood {
    /// Looks around, before the split is made.
    #[inline(always)]
    pub(super) fn look_around(&mut self, mesh: &Mesh, star: &Star, split: &Split, change: &Change, old: u32) {
        let origin = mesh.points[old as usize].at();
        // The old vertex itself, which stands at the beginning for good.
        self.near_count = 1;
        let mut distance = 0u64;
        let [mut cut, mut lap_cut, mut arc, mut lap_arc] = [[0i64; 3]; 4];
        let mut cuts = 0;
        let opened = change.opened.iter().map(|opened| opened.born.third);
        for third in opened.chain(split.extra.iter().map(|born| born.third)) {
            let seen = self.see(&mesh.points[third as usize], origin);
            add(&mut cut, seen.way.map(i64::from));
            add(&mut lap_cut, seen.lap);
            distance += reach(seen.way);
            cuts += 1;
        }
        let mut normal = [0; 3];
        // Rows of triangles share their spokes: most need only be looked at once.
        let mut last = (NONE, Seen::NOTHING);
        for &i in change.moved.all() {
            let Spoke { from, to, .. } = star.spokes[i as usize];
            let before = if from == last.0 {
                last.1
            } else {
                self.see(&mesh.points[from as usize], origin)
            };
            let after = self.see(&mesh.points[to as usize], origin);
            last = (to, after);
            for seen in [before, after] {
                add(&mut arc, seen.way.map(i64::from));
                add(&mut lap_arc, seen.lap);
            }
            add_cross(&mut normal, before.way, after.way);
            distance += reach(before.way);
        }
        if normal == [0; 3] {
            for spoke in &star.spokes {
                let [from, to] = [spoke.from, spoke.to].map(|v| way(origin, &mesh.points[v as usize]));
                add_cross(&mut normal, from, to);
            }
        }
        shorten(&mut normal);
        self.normal = normal;
        // Neighbours between two moved triangles count twice, and those at edges that open are not meant.
        let arcs = (2 * change.moved.length()).saturating_sub(cuts);
        let (cut_share, arc_share) = (share_of(cuts), share_of(arcs));
        let lap = lap(&mesh.points[old as usize]);
        for axis in 0..3 {
            self.features[0][axis] = ((cut[axis] * cut_share) >> 12) as i32;
            self.features[1][axis] = (((arc[axis] - cut[axis]) * arc_share) >> 12) as i32;
            self.features[2][axis] = lap[axis] as i32;
            self.features[3][axis] = ((lap_cut[axis] * cut_share) >> 16) as i32;
            self.features[4][axis] = (((lap_arc[axis] - lap_cut[axis]) * arc_share) >> 16) as i32;
        }
        self.kind = cuts.min(2) * 4 + arcs.div_ceil(2).min(3);
        self.size = size_class((distance * share_of(cuts + change.moved.length()) as u64) >> 16);
    }

    /// Looks at a neighbour.
    #[inline(always)]
    fn see(&mut self, point: &Point, origin: [i32; 3]) -> Seen {
        let way = way(origin, point);
        if let Some(near) = self.near.get_mut(self.near_count) {
            *near = way;
            self.near_count += 1;
        }
        Seen { way, lap: lap(point) }
    }

    /// The coordinate of vertices nearby that is nearest to what is expected.
    #[inline(always)]
    pub(super) fn nearest(&self, axis: usize, expected: i32) -> i32 {
        let mut best = u32::MAX;
        let mut found = 0;
        for at in &self.near[..self.near_count] {
            let distance = at[axis].wrapping_mul(16).wrapping_sub(expected).unsigned_abs();
            let nearer = distance < best;
            best = if nearer { distance } else { best };
            found = if nearer { at[axis] } else { found };
        }
        found
    }

    /// Where the new vertex is expected, from the old one, in 1/16 of a step.
    #[inline(always)]
    pub(super) fn expected(&self, weights: &Weights) -> [i32; 3] {
        let weights = &weights[self.kind];
        std::array::from_fn(|axis| {
            let terms = (0..FEATURES).map(|i| i32::from(weights[i]).wrapping_mul(self.features[i][axis]));
            terms.fold(32, i32::wrapping_add) >> 6
        })
    }
}

impl Seen {
    const NOTHING: Self = Self {
        way: [0; 3],
        lap: [0; 3],
    };
}

#[inline(always)]
fn way(origin: [i32; 3], point: &Point) -> [i32; 3] {
    let at = point.at();
    [at[0] - origin[0], at[1] - origin[1], at[2] - origin[2]]
}

/// From a vertex to the middle of its neighbours, in 1/16.
#[inline(always)]
fn lap(point: &Point) -> [i64; 3] {
    let share = share_of(2 * point.star.length());
    if share == 0 {
        return [0; 3];
    }
    let (around, at) = (point.around, point.at());
    [0, 1, 2].map(|axis| ((i64::from(around[axis]) * share) >> 12) - i64::from(16 * at[axis]))
}

#[inline(always)]
fn reach(way: [i32; 3]) -> u64 {
    u64::from(way[0].unsigned_abs() + way[1].unsigned_abs() + way[2].unsigned_abs())
}

#[inline(always)]
fn add(sum: &mut [i64; 3], more: [i64; 3]) {
    for axis in 0..3 {
        sum[axis] += more[axis];
    }
}

#[inline(always)]
fn add_cross(sum: &mut [i64; 3], a: [i32; 3], b: [i32; 3]) {
    let [a, b] = [a, b].map(|v| v.map(i64::from));
    sum[0] += a[1] * b[2] - a[2] * b[1];
    sum[1] += a[2] * b[0] - a[0] * b[2];
    sum[2] += a[0] * b[1] - a[1] * b[0];
}

/// Leaves a direction's 15 first bits.
#[inline(always)]
pub(super) fn shorten(normal: &mut [i64; 3]) {
    let longest = normal.iter().fold(0, |longest, x| longest | x.unsigned_abs());
    let shift = (u64::BITS - longest.leading_zeros()).saturating_sub(15);
    for x in normal {
        *x >>= shift;
    }
}
