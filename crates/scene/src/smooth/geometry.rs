//! Where is a new vertex? A prediction from what surrounds it, and what is missing from it.
//!
//! The prediction is a weighted sum in the spirit of Pajarola & Rossignac, *Compressed progressive meshes* (2000): the
//! mean of the vertices where edges open, the mean of the other new neighbours, and how far each of them, and the old
//! vertex, lies from the mean of its own neighbours. The residual is coded along lattice axes, that along which the
//! surface is steepest last: what the surface's plane says of it, given the other two, is taken off first. This parts
//! what lies in the surface from what sticks out of it, as Alliez & Desbrun (2001) do, but without rounding.

use super::change::Change;
use super::fan::Star;
use super::mesh::Mesh;
use super::model::{Nibble, gamma};
use super::rans::Coder;
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
    normal: [i64; 3],
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

impl Hood {
    /// Looks around, before the split is made.
    #[inline(always)]
    pub(super) fn around(mesh: &Mesh, star: &Star, split: &Split, change: &Change, old: u32) -> Self {
        let origin = mesh.points[old as usize].at;
        let mut hood = Self::default();
        hood.add_near([0; 3]);
        let mut distance = 0u64;
        let mut lap_cut = [0i64; 3];
        let mut lap_arc = [0i64; 3];
        let mut cut = [0i64; 3];
        let mut arc = [0i64; 3];
        let relative = |vertex: u32| -> [i32; 3] {
            let at = mesh.points[vertex as usize].at;
            std::array::from_fn(|axis| at[axis] - origin[axis])
        };
        // From a vertex to the middle of its neighbours, in 1/16.
        let lap = |vertex: u32| -> [i64; 3] {
            let point = &mesh.points[vertex as usize];
            let share = share_of(2 * mesh.valence(vertex));
            if share == 0 {
                return [0; 3];
            }
            std::array::from_fn(|axis| ((i64::from(point.around[axis]) * share) >> 12) - 16 * i64::from(point.at[axis]))
        };
        let reach = |v: [i32; 3]| v.iter().map(|&x| u64::from(x.unsigned_abs())).sum::<u64>();
        let look = |hood: &mut Self, vertex: u32| {
            let at = relative(vertex);
            hood.add_near(at);
            (vertex, at, lap(vertex))
        };
        let mut cuts = 0;
        let opened = change.opened.iter().map(|opened| opened.born.third);
        for third in opened.chain(split.extra.iter().map(|born| born.third)) {
            let (_, at, own) = look(&mut hood, third);
            for axis in 0..3 {
                cut[axis] += i64::from(at[axis]);
                lap_cut[axis] += own[axis];
            }
            distance += reach(at);
            cuts += 1;
        }
        // Rows of triangles share their spokes: most need only be looked at once.
        let mut last = (old, [0; 3], [0; 3]);
        for &i in &change.moved {
            let spoke = star.spokes[i as usize];
            let (_, from, lap_from) = if spoke.from == last.0 {
                last
            } else {
                look(&mut hood, spoke.from)
            };
            last = look(&mut hood, spoke.to);
            let (_, to, lap_to) = last;
            for axis in 0..3 {
                arc[axis] += i64::from(from[axis]) + i64::from(to[axis]);
                lap_arc[axis] += lap_from[axis] + lap_to[axis];
            }
            add_cross(&mut hood.normal, from, to);
            distance += reach(from);
        }
        if hood.normal == [0; 3] {
            for spoke in &star.spokes {
                add_cross(&mut hood.normal, relative(spoke.from), relative(spoke.to));
            }
        }
        shorten(&mut hood.normal);
        hood.features[2] = lap(old).map(|x| x as i32);
        if cuts > 0 {
            let share = share_of(cuts);
            hood.features[0] = cut.map(|x| ((x * share) >> 12) as i32);
            hood.features[3] = lap_cut.map(|x| ((x * share) >> 16) as i32);
        }
        // Neighbours between two moved triangles count twice, and those at edges that open are not meant.
        let twice = 2 * change.moved.len();
        let mut arcs = 0;
        if twice > cuts {
            let share = share_of(twice - cuts);
            hood.features[1] = std::array::from_fn(|axis| (((arc[axis] - cut[axis]) * share) >> 12) as i32);
            hood.features[4] = std::array::from_fn(|axis| (((lap_arc[axis] - lap_cut[axis]) * share) >> 16) as i32);
            arcs = (twice - cuts).div_ceil(2).min(3);
        }
        hood.kind = cuts.min(2) * 4 + arcs;
        hood.size = size_class((distance * share_of(cuts + change.moved.len()) as u64) >> 16);
        hood
    }

    #[inline(always)]
    fn add_near(&mut self, at: [i32; 3]) {
        if self.near_count < MOST_NEAR {
            self.near[self.near_count] = at;
            self.near_count += 1;
        }
    }

    /// The coordinates of vertices nearby that are nearest to what is expected.
    #[inline(always)]
    fn nearest(&self, expected: [i32; 3]) -> [i32; 3] {
        let mut best = [u32::MAX; 3];
        let mut found = [0; 3];
        for at in &self.near[..self.near_count] {
            for axis in 0..3 {
                let distance = at[axis].wrapping_mul(16).wrapping_sub(expected[axis]).unsigned_abs();
                let nearer = distance < best[axis];
                best[axis] = if nearer { distance } else { best[axis] };
                found[axis] = if nearer { at[axis] } else { found[axis] };
            }
        }
        found
    }

    /// Where the new vertex is expected, from the old one, in 1/16 of a step.
    #[inline(always)]
    fn expected(&self, weights: &Weights) -> [i32; 3] {
        let weights = &weights[self.kind];
        std::array::from_fn(|axis| {
            let terms = (0..FEATURES).map(|i| i32::from(weights[i]).wrapping_mul(self.features[i][axis]));
            terms.fold(32, i32::wrapping_add) >> 6
        })
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

/// Models of residuals.
#[derive(Debug, Clone)]
pub(super) struct ResidualModels {
    shared: [[Nibble; 3]; 8],
    first: [Nibble; 32],
    second: Box<[[Nibble; 8]; 16]>,
    third: Box<[[Nibble; 8]; 16]>,
}

impl Default for ResidualModels {
    fn default() -> Self {
        let table = || Box::new(std::array::from_fn(|_| std::array::from_fn(|_| Nibble::default())));
        Self {
            shared: std::array::from_fn(|_| std::array::from_fn(|_| Nibble::default())),
            first: std::array::from_fn(|_| Nibble::default()),
            second: table(),
            third: table(),
        }
    }
}

impl ResidualModels {
    /// Where the new vertex is, from the old one.
    #[inline(always)]
    pub(super) fn code<C: Coder>(
        &mut self,
        coder: &mut C,
        hood: &Hood,
        weights: &Weights,
        before: usize,
        given: [i32; 3],
    ) -> ([i32; 3], usize) {
        let expected = hood.expected(weights);
        let [low, middle, top] = by_steepness(hood.normal);
        let mut found = [0; 3];
        let size = usize::from(hood.size);
        let round = |sixteenths: i32| sixteenths.wrapping_add(8) >> 4;

        let nearest = hood.nearest(expected);
        let given_shared = (0..3)
            .map(|axis| usize::from(given[axis] == nearest[axis]) << axis)
            .sum();
        let shared = coder.symbol(&mut self.shared[before & 7][hood.kind / 4], given_shared);
        let is_shared = |axis: usize| shared >> axis & 1 == 1;

        let mut classes = [0; 2];
        for (i, axis) in [low, middle].into_iter().enumerate() {
            if is_shared(axis) {
                found[axis] = nearest[axis];
                continue;
            }
            let model = if i == 0 {
                &mut self.first[size]
            } else {
                &mut self.second[size / 2][classes[0] / 2]
            };
            let (value, class) = residual(coder, model, given[axis].wrapping_sub(round(expected[axis])));
            found[axis] = value.wrapping_add(round(expected[axis]));
            classes[i] = class;
        }
        if is_shared(top) {
            found[top] = nearest[top];
            return (found, shared);
        }
        let normal = hood.normal;
        let mut on_plane = i64::from(expected[top]);
        if normal[top] != 0 {
            let off = |axis: usize| normal[axis] * (16 * i64::from(found[axis]) - i64::from(expected[axis]));
            on_plane -= (off(low) + off(middle)) / normal[top];
        }
        let on_plane = round(on_plane as i32);
        let model = &mut self.third[size / 2][classes[0].max(classes[1]) / 2];
        let (value, _) = residual(coder, model, given[top].wrapping_sub(on_plane));
        found[top] = value.wrapping_add(on_plane);
        (found, shared)
    }
}

/// The axes, that of the normal's largest component last.
#[inline(always)]
fn by_steepness(normal: [i64; 3]) -> [usize; 3] {
    let [x, y, z] = normal.map(i64::abs);
    let top = if x > y {
        if x > z { 0 } else { 2 }
    } else if y > z {
        1
    } else {
        2
    };
    [(top + 1) % 3, (top + 2) % 3, top]
}

/// A number around 0 and the class of its size: in halves of powers of two, what is below that raw.
#[inline(always)]
pub(super) fn residual<C: Coder>(coder: &mut C, model: &mut Nibble, value: i32) -> (i32, usize) {
    let size = value.unsigned_abs();
    let class = coder.symbol(model, class_of(size));
    if class == 0 {
        return (0, 0);
    }
    let negative = u32::from(value < 0);
    let (size, negative) = if class < 4 {
        (class as u32, coder.raw(1, negative))
    } else if class < 15 {
        let bits = class as u32 / 2 - 1;
        let base = (2 + (class as u32 & 1)) << bits;
        let raw = coder.raw(bits + 1, size.wrapping_sub(base) << 1 & ((2 << bits) - 1) | negative);
        (base + (raw >> 1), raw & 1)
    } else {
        let more = gamma(coder, size.wrapping_sub(LARGE));
        (LARGE.wrapping_add(more), coder.raw(1, negative))
    };
    let value = size as i32;
    (if negative == 1 { value.wrapping_neg() } else { value }, class)
}

/// From here on sizes are in class 15.
const LARGE: u32 = 192;

fn class_of(size: u32) -> usize {
    if size < 4 {
        return size as usize;
    }
    let log = size.ilog2();
    ((2 * log + (size >> (log - 1) & 1)) as usize).min(15)
}
