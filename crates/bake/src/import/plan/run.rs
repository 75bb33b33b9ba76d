//! Where are the straight faces of a region's boundary? Runs of tiles along one wall, as seen from inside the region.

use super::finish::Finish;
use super::layout::{Layout, Opening, Tile};
use super::legend::Facing;
use super::mesh::Mesh;
use glam::Vec3;

/// A straight stretch of boundary. `u` runs to the right for someone who looks at it from inside the region; `y` up;
/// `out` towards the viewer. All in metres.
#[derive(Debug, Clone)]
pub(super) struct Run {
    /// Where someone inside looks to see it.
    pub(super) towards: Facing,
    /// Its plane: z for north and south, x for east and west, metres.
    plane_m: f32,
    /// First and last u.
    pub(super) start_m: f32,
    pub(super) end_m: f32,
    /// Whether the region's corner at that end is an inner one.
    pub(super) inner_start: bool,
    pub(super) inner_end: bool,
    /// Tiles behind the face, from left to right, each a tile wide.
    pub(super) behind: Vec<(isize, isize)>,
    pub(super) tile_m: f32,
}

/// The boundary of `inside` towards one side, within `extent` (first column and row, last column and row).
pub(super) fn runs_towards(
    layout: &Layout,
    [c0, r0, c1, r1]: [isize; 4],
    towards: Facing,
    inside: impl Fn(isize, isize) -> bool,
) -> Vec<Run> {
    let along_x = matches!(towards, Facing::North | Facing::South);
    let reversed = matches!(towards, Facing::South | Facing::West);
    let (dx, dy) = towards.step();
    let (lines, across) = if along_x {
        (r0..=r1, c0..=c1)
    } else {
        (c0..=c1, r0..=r1)
    };
    let tile_at = |line: isize, i: isize| if along_x { (i, line) } else { (line, i) };
    let is_face = |line: isize, i: isize| {
        let (c, r) = tile_at(line, i);
        inside(c, r) && !inside(c + dx, r + dy)
    };
    let is_inner = |line: isize, beyond: isize| {
        let (c, r) = tile_at(line, beyond);
        !inside(c, r)
    };
    let mut runs = Vec::new();
    for line in lines {
        let mut i = *across.start();
        while i <= *across.end() {
            let from = i;
            while i <= *across.end() && is_face(line, i) {
                i += 1;
            }
            if i == from {
                i += 1;
                continue;
            }
            let mut behind: Vec<_> = (from..i)
                .map(|k| {
                    let (c, r) = tile_at(line, k);
                    (c + dx, r + dy)
                })
                .collect();
            let (mut start, mut end) = (from as f32 * layout.tile_m, i as f32 * layout.tile_m);
            let (mut inner_start, mut inner_end) = (is_inner(line, from - 1), is_inner(line, i));
            if reversed {
                behind.reverse();
                (start, end) = (-end, -start);
                (inner_start, inner_end) = (inner_end, inner_start);
            }
            let edge = if matches!(towards, Facing::South | Facing::East) {
                line + 1
            } else {
                line
            };
            runs.push(Run {
                towards,
                plane_m: edge as f32 * layout.tile_m,
                start_m: start,
                end_m: end,
                inner_start,
                inner_end,
                behind,
                tile_m: layout.tile_m,
            });
        }
    }
    runs
}

impl Run {
    /// From u, height and distance in front of the face to the world.
    pub(super) fn point(&self, u: f32, y: f32, out: f32) -> Vec3 {
        match self.towards {
            Facing::North => Vec3::new(u, y, self.plane_m + out),
            Facing::South => Vec3::new(-u, y, self.plane_m - out),
            Facing::East => Vec3::new(self.plane_m - out, y, u),
            Facing::West => Vec3::new(self.plane_m + out, y, -u),
        }
    }

    /// First and last u of a group of tiles `from..to` of [`Self::behind`].
    pub(super) fn span(&self, from: usize, to: usize) -> (f32, f32) {
        let u = |i: usize| {
            if i == self.behind.len() {
                self.end_m
            } else {
                self.start_m + i as f32 * self.tile_m
            }
        };
        (u(from), u(to))
    }

    /// Openings behind the face, each with its first and last u.
    pub(super) fn openings<'a>(&self, layout: &'a Layout) -> Vec<(&'a Opening, f32, f32)> {
        self.grouped(|c, r| match layout.tile(c, r) {
            Tile::Opening(opening) => Some(opening),
            _ => None,
        })
        .into_iter()
        .filter_map(|(opening, from, to)| {
            let (start, end) = self.span(from, to);
            opening.map(|opening| (&layout.openings[opening], start, end))
        })
        .collect()
    }

    /// Neighbouring tiles with equal keys: key, first tile, one past the last tile.
    pub(super) fn grouped<K: PartialEq>(&self, key: impl Fn(isize, isize) -> K) -> Vec<(K, usize, usize)> {
        let mut groups: Vec<(K, usize, usize)> = Vec::new();
        for (i, &(c, r)) in self.behind.iter().enumerate() {
            let k = key(c, r);
            match groups.last_mut() {
                Some((last, _, to)) if *last == k => *to = i + 1,
                _ => groups.push((k, i, i + 1)),
            }
        }
        groups
    }

    /// A moulding with the given profile of (out, y) points from bottom to top, mitred at the corners and interrupted by
    /// openings that reach below `clear_above_m`.
    pub(super) fn moulding(&self, mesh: &mut Mesh, finish: &Finish, layout: &Layout, moulding: &Moulding<'_>) {
        let mut pieces = vec![(self.start_m, true)];
        let mut spans = Vec::new();
        for (opening, start, end) in self.openings(layout) {
            if opening.bottom_m < moulding.to_m && opening.top_m > moulding.from_m {
                if let Some((from, corner)) = pieces.pop() {
                    spans.push((from, corner, start, false));
                }
                pieces.push((end, false));
            }
        }
        if let Some((from, corner)) = pieces.pop() {
            spans.push((from, corner, self.end_m, true));
        }
        mesh.tint(Some(moulding.colour));
        let mitre = |inner: bool, out: f32| if inner { out } else { -out };
        for (start, corner_start, end, corner_end) in spans {
            let at = |out: f32| {
                (
                    start
                        + if corner_start {
                            mitre(self.inner_start, out)
                        } else {
                            0.0
                        },
                    end - if corner_end { mitre(self.inner_end, out) } else { 0.0 },
                )
            };
            if at(0.0).1 - at(0.0).0 < 1e-4 {
                continue;
            }
            for pair in moulding.profile.windows(2) {
                let [(out_low, low), (out_high, high)] = [pair[0], pair[1]];
                let ((a, b), (c, d)) = (at(out_low), at(out_high));
                let corners = [
                    self.point(a, low, out_low),
                    self.point(b, low, out_low),
                    self.point(d, high, out_high),
                    self.point(c, high, out_high),
                ];
                mesh.polygon(finish, &corners);
            }
        }
        mesh.tint(None);
    }
}

/// A profile drawn along a wall.
pub(super) struct Moulding<'a> {
    /// (out, y) points from bottom to top, metres.
    pub(super) profile: &'a [(f32, f32)],
    /// Heights between which it interrupts for an opening.
    pub(super) from_m: f32,
    pub(super) to_m: f32,
    /// Linear.
    pub(super) colour: [f32; 3],
}

/// Sorted coordinates from `fixed`, with further ones so that no gap is wider than `step`, and one near both ends of each
/// wide gap, where the soft shadow of a corner falls.
pub(super) fn subdivided(mut fixed: Vec<f32>, step: f32, inset: f32) -> Vec<f32> {
    fixed.sort_by(f32::total_cmp);
    fixed.dedup_by(|a, b| (*a - *b).abs() < 1e-3);
    let mut lines = Vec::new();
    for pair in fixed.windows(2) {
        let [a, b] = [pair[0], pair[1]];
        let (mut from, mut to) = (a, b);
        lines.push(a);
        if inset > 0.0 && b - a > inset * 3.0 {
            (from, to) = (a + inset, b - inset);
            lines.push(from);
        }
        let count = ((to - from) / step).ceil().max(1.0) as usize;
        lines.extend((1..count).map(|i| from + (to - from) * i as f32 / count as f32));
        if to < b {
            lines.push(to);
        }
    }
    lines.extend(fixed.last());
    lines
}
