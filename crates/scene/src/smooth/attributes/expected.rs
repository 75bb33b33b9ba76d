//! What values has a new wedge likely?
//!
//! A normal is expected to be that of the triangles around it, with some regard to normals beside it. All else goes on
//! evenly over the triangle that was there before the split, as far as there was one with all its values.

use std::ops::Range;

use super::super::geometry::shorten;
use super::super::mesh::{Mesh, NONE};
use super::super::octahedron;
use super::super::quotient::quotient;
use super::ChannelKind;
use super::wedges::Corner;

/// What surrounds a new wedge.
#[derive(Clone, Copy)]
pub(super) struct Beside<'a> {
    pub(super) mesh: &'a Mesh,
    /// Wedges of all triangles' corners.
    pub(super) corners: &'a [[u32; 3]],
    /// Numbers of the wedges that have been told.
    pub(super) values: &'a [i32],
    /// Numbers of a wedge.
    pub(super) stride: usize,
    /// The corners that have the new wedge.
    pub(super) pending: &'a [Corner],
    /// The old vertex and the new one.
    pub(super) split: (u32, u32),
}

impl<'a> Beside<'a> {
    /// The numbers of a wedge, if it has been told.
    pub(super) fn value(&self, wedge: u32) -> Option<&'a [i32]> {
        let first = (wedge as usize).checked_mul(self.stride)?;
        self.values.get(first..first.checked_add(self.stride)?)
    }

    /// What a new wedge's channel likely is.
    pub(super) fn expected(&self, kind: ChannelKind, numbers: &Range<usize>) -> [i32; 4] {
        let Self { mesh, pending, .. } = *self;
        let of = |wedge: u32| Some(&self.value(wedge)?[numbers.clone()]);
        if kind == ChannelKind::Normal {
            let mut face = [0i64; 3];
            let mut around = [0i64; 3];
            // Triangles beside each other share corners, and moved ones had the same wedge: most need only be looked at once.
            let direction = |wedge: u32| {
                let of = of(wedge).map(|value| octahedron::direction([value[0], value[1]]));
                (wedge, of.unwrap_or_default().map(i64::from))
            };
            let (mut beside, mut before) = ((NONE, [0; 3]), (NONE, [0; 3]));
            for &(triangle, side, was) in pending {
                add_face(&mut face, mesh, triangle);
                let corners = self.corners[triangle as usize];
                for wedge in [corners[(side + 1) % 3], corners[(side + 2) % 3]] {
                    if wedge != beside.0 {
                        beside = direction(wedge);
                    }
                    add(&mut around, beside.1);
                }
                if was != before.0 {
                    before = direction(was);
                }
                add(&mut around, before.1);
            }
            shorten(&mut face);
            let reach = |v: [i64; 3]| v.iter().map(|x| x.abs()).sum::<i64>();
            // What the triangles say counts eight times as much as the normals around.
            let counts = 8 * reach(around).max(127);
            let of_face = reach(face).max(1);
            let sum = [0, 1, 2].map(|axis| (around[axis] + quotient(face[axis] * counts, of_face)) as i32);
            let [x, y] = octahedron::nearest(sum);
            return [x, y, 0, 0];
        }
        let mut sum = [0i64; 4];
        let mut count = 0;
        for &(triangle, side, was) in pending {
            let corners = self.corners[triangle as usize];
            let [next, before] = [corners[(side + 1) % 3], corners[(side + 2) % 3]].map(of);
            if let (Some(was), Some(next), Some(before)) = (of(was), next, before) {
                let [a, b] = shares(mesh, triangle, side, self.split);
                for k in 0..was.len() {
                    let [p, q, r] = [was[k], next[k], before[k]].map(i64::from);
                    sum[k] += 256 * p + a * (q - p) + b * (r - p);
                }
                count += 1;
            }
        }
        if count == 0 {
            for &(triangle, side, was) in pending {
                let corners = self.corners[triangle as usize];
                for value in [corners[(side + 1) % 3], corners[(side + 2) % 3], was]
                    .into_iter()
                    .filter_map(of)
                {
                    for k in 0..value.len() {
                        sum[k] += 256 * i64::from(value[k]);
                    }
                    count += 1;
                }
            }
        }
        sum.map(|sum| {
            if count > 0 {
                ((sum / count + 128) >> 8) as i32
            } else {
                0
            }
        })
    }
}

fn add(sum: &mut [i64; 3], more: [i64; 3]) {
    for axis in 0..3 {
        sum[axis] += more[axis];
    }
}

/// Adds a triangle's normal, as long as twice its area.
fn add_face(sum: &mut [i64; 3], mesh: &Mesh, triangle: u32) {
    let [a, b, c] = mesh.triangles[triangle as usize].map(|v| mesh.points[v as usize].at());
    let from_a = |p: [i32; 3]| [0, 1, 2].map(|axis| i64::from(p[axis] - a[axis]));
    let (p, q) = (from_a(b), from_a(c));
    for (axis, sum) in sum.iter_mut().enumerate() {
        let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
        *sum += p[i] * q[j] - p[j] * q[i];
    }
}

/// Where the new vertex lies on the triangle that was there before the split, in 1/256 of its two edges from the old one.
fn shares(mesh: &Mesh, triangle: u32, side: usize, (old, new): (u32, u32)) -> [i64; 2] {
    let corners = mesh.triangles[triangle as usize];
    let [from, to, at] = [corners[(side + 1) % 3], corners[(side + 2) % 3], new].map(|v| {
        let (p, q) = (mesh.points[v as usize].at(), mesh.points[old as usize].at());
        [0, 1, 2].map(|axis| i64::from(p[axis]) - i64::from(q[axis]))
    });
    // Ten bits are enough, and keep products small.
    let longest = from
        .iter()
        .chain(&to)
        .chain(&at)
        .fold(0, |all, x| all | x.unsigned_abs());
    let shift = (u64::BITS - longest.leading_zeros()).saturating_sub(10);
    let [from, to, at] = [from, to, at].map(|v| v.map(|x| x >> shift));
    let dot = |a: [i64; 3], b: [i64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (ff, ft, tt, fa, ta) = (dot(from, from), dot(from, to), dot(to, to), dot(from, at), dot(to, at));
    let area = ff * tt - ft * ft;
    if area == 0 {
        return [0; 2];
    }
    [tt * fa - ft * ta, ff * ta - ft * fa].map(|part| quotient(part * 256, area).clamp(-1024, 1024))
}
