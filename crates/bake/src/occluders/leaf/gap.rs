//! On which sides does a closed door fill its opening but for a gap? Where something else stands along all of a side: a frame, a
//! floor, a wall. There the leaf is grown over the gap: up to what stands there and no further, since behind a thin floor or wall
//! is another room. Beside one of two leaves the way is open as long as the other is, and beside a door that is narrower than its
//! opening always: from there one sees past it.
//!
//! A side is looked at in strips across it. In each the leaf grows to what of a neighbour its plane meets first, so its rim follows
//! a frame that is no straight line.

use super::{
    super::{DOOR_GAP, Tolerance, squares},
    Door,
    beside::{Piece, extent, pieces, within},
};

/// Strips are no wider than this share of the widest gap.
const STRETCH: f64 = 0.25;
/// The ends of so many pieces at most are ends of strips too.
const MOST_ENDS: usize = 256;
/// The rim of a side is in so many distances from the leaf at most.
const MOST_LEVELS: u32 = 16;

/// How wide a gap may be beside a leaf whose longest edge is this long.
pub(super) fn most_m(longest_m: f32) -> f32 {
    DOOR_GAP * longest_m
}

/// A leaf as it grows: its lines, and its opaque squares by way.
pub(super) struct Grid {
    pub(super) lines: [Vec<f32>; 2],
    pub(super) opaque: [Vec<bool>; 2],
}

/// A side of a leaf: across which axis, at which end of it, and what of its neighbours lies in its plane.
struct Side<'a> {
    axis: usize,
    end: usize,
    pieces: &'a [Piece],
    gap_m: f64,
    tolerance: Tolerance,
}

/// A part of a side.
struct Strip {
    ends: [f64; 2],
    /// Which square is beside it.
    square: usize,
    is_opaque: bool,
    /// How far away something stands beside it.
    free_m: Option<f64>,
    /// Whether something reaches into the leaf here without getting out of it, and whether near this side.
    pierced: Option<bool>,
    /// How far the leaf grows.
    grown_m: f64,
}

impl Door {
    /// Grows a leaf over the gap around it, but not on sides where nothing stands, or where glass or culled faces of the door go on.
    pub(super) fn close_gap(&self, grid: &mut Grid, depth: f64, gap_m: f32, tolerance: Tolerance) {
        let open = self.sheets.iter().filter(|sheet| sheet.hides != [true; 2]);
        let corners: Vec<_> = open.flat_map(|sheet| sheet.face).collect();
        let pieces = pieces(&self.beside, depth, tolerance);
        let ends = [0, 1].map(|axis| [grid.lines[axis][0], grid.lines[axis][grid.lines[axis].len() - 1]]);
        // The second axis finds the rims that the first one grew, and so closes the corners.
        for axis in 0..2 {
            for end in 0..2 {
                let goes_on = corners.iter().any(|corner| match end {
                    0 => corner[axis] < ends[axis][0] - tolerance.hole_m,
                    _ => corner[axis] > ends[axis][1] + tolerance.hole_m,
                });
                let side = Side {
                    axis,
                    end,
                    pieces: &pieces,
                    gap_m: gap_m.into(),
                    tolerance,
                };
                if let Some(strips) = side.framed(grid, ends[1 - axis]).filter(|_| !goes_on) {
                    grid.grow((axis, end), &strips);
                }
            }
        }
    }
}

impl Side<'_> {
    /// Its strips, each with how far the leaf may grow there, if something stands along all of it between these ends.
    fn framed(&self, grid: &Grid, between: [f32; 2]) -> Option<Vec<Strip>> {
        let mut strips = self.strips(grid);
        self.end_at_floors(&mut strips);
        self.overlook_joints(&mut strips);
        let [low, high] = between.map(f64::from);
        let is_main = |strip: &&Strip| strip.is_opaque && strip.ends[0] < high && low < strip.ends[1];
        let mut main = strips.iter().filter(is_main).peekable();
        if main.peek().is_none() || !main.all(|strip| strip.free_m.is_some()) {
            return None;
        }
        let levels = self.levels(&strips);
        for strip in strips.iter_mut().filter(|strip| strip.is_opaque) {
            if let Some(free_m) = strip.free_m {
                let level = levels.partition_point(|level| *level <= free_m);
                // Rounding must not lead past what stands there.
                strip.grown_m = (levels[level - 1] - f64::from(self.tolerance.plane_m)).max(0.0);
            }
        }
        Some(strips)
    }

    /// How far strips may grow: as far as they are free but for rounding or, where those are too many, in equal steps.
    fn levels(&self, strips: &[Strip]) -> Vec<f64> {
        let mut levels: Vec<f64> = strips.iter().filter_map(|strip| strip.free_m).collect();
        levels.sort_by(f64::total_cmp);
        levels.dedup_by(|b, a| *b - *a <= self.tolerance.hole_m.into());
        if levels.len() <= MOST_LEVELS as usize {
            return levels;
        }
        let (least_m, most_m) = (levels[0], levels[levels.len() - 1]);
        let steps = (0..MOST_LEVELS).map(|step| f64::from(step) / f64::from(MOST_LEVELS));
        steps.map(|share| least_m + share * (most_m - least_m)).collect()
    }

    fn strips(&self, grid: &Grid) -> Vec<Strip> {
        let (axis, other) = (self.axis, 1 - self.axis);
        let lines = &grid.lines[axis];
        let along = &grid.lines[other];
        let counts = [0, 1].map(|axis| grid.lines[axis].len() - 1);
        let (edge, border) = match self.end {
            0 => (f64::from(lines[0]), 0),
            _ => (f64::from(lines[counts[axis]]), counts[axis] - 1),
        };
        let inside_m = 0.5 * f64::from(lines[counts[axis]] - lines[0]);
        let zone = match self.end {
            0 => [edge - self.gap_m, edge + inside_m],
            _ => [edge - inside_m, edge + self.gap_m],
        };
        let near: Vec<Piece> = self
            .pieces
            .iter()
            .map(|piece| Piece {
                polygon: within(&piece.polygon, axis, zone),
                frames: piece.frames,
            })
            .filter(|piece| !piece.polygon.is_empty())
            .collect();
        let ends = self.ends(along, &near, other);
        ends.windows(2)
            .map(|ends| {
                let ends = [ends[0], ends[1]];
                let middle = 0.5 * (ends[0] + ends[1]);
                let square = along[1..]
                    .partition_point(|line| f64::from(*line) < middle)
                    .min(counts[other] - 1);
                let number = squares::number(counts[0], axis, [border, square]);
                let mut strip = Strip {
                    ends,
                    square,
                    is_opaque: grid.opaque.iter().any(|squares| squares[number]),
                    free_m: None,
                    pierced: None,
                    grown_m: 0.0,
                };
                if strip.is_opaque {
                    self.look(&mut strip, &near, edge);
                }
                strip
            })
            .collect()
    }

    /// Where strips end: where squares do, and pieces, but for ends as near to each other as makes no difference.
    fn ends(&self, along: &[f32], near: &[Piece], other: usize) -> Vec<f64> {
        let (first, last) = (f64::from(along[0]), f64::from(along[along.len() - 1]));
        let hole_m = f64::from(self.tolerance.hole_m);
        let squares: Vec<f64> = along.iter().map(|line| f64::from(*line)).collect();
        let mut ends: Vec<f64> = near.iter().flat_map(|piece| extent(&piece.polygon, other)).collect();
        ends.sort_by(f64::total_cmp);
        ends.dedup_by(|b, a| *b - *a <= hole_m);
        ends.retain(|end| first < *end && *end < last && squares.iter().all(|line| (line - end).abs() > hole_m));
        if ends.len() > MOST_ENDS {
            ends.clear();
        }
        ends.extend(squares);
        ends.sort_by(f64::total_cmp);
        let between = ends.windows(2).flat_map(|ends| {
            let (low, high) = (ends[0], ends[1]);
            let parts = ((high - low) / (STRETCH * self.gap_m)).ceil().max(1.0);
            (0..parts as u32).map(move |part| low + (high - low) * f64::from(part) / parts)
        });
        between.chain([last]).collect()
    }

    /// What stands beside a strip.
    fn look(&self, strip: &mut Strip, near: &[Piece], edge: f64) {
        let outwards = if self.end == 0 { -1.0 } else { 1.0 };
        let hole_m = f64::from(self.tolerance.hole_m).min(0.25 * (strip.ends[1] - strip.ends[0]));
        // What only touches a strip stands beside the next one.
        let inner = [strip.ends[0] + hole_m, strip.ends[1] - hole_m];
        let mut stops_m = f64::INFINITY;
        for piece in near {
            let [low, high] = extent(&piece.polygon, 1 - self.axis);
            if high < inner[0] || inner[1] < low {
                continue;
            }
            let part = within(&piece.polygon, 1 - self.axis, inner);
            if part.is_empty() {
                continue;
            }
            let reach = extent(&part, self.axis).map(|at| outwards * (at - edge));
            let [from, to] = [reach[0].min(reach[1]), reach[0].max(reach[1])];
            if piece.frames && to < -f64::from(self.tolerance.hole_m) {
                let is_near = to >= -0.5 * self.gap_m;
                strip.pierced = Some(strip.pierced == Some(true) || is_near);
            } else if piece.frames {
                strip.free_m = Some(strip.free_m.unwrap_or(self.gap_m).min(from.max(0.0)));
            } else if to >= 0.0 {
                // Glass and other doors bound a gap as well, but do not close it.
                stops_m = stops_m.min(from.max(0.0));
            }
        }
        strip.free_m = strip.free_m.map(|free_m| free_m.min(stops_m));
    }

    /// A leaf that reaches into a floor ends with itself. A handle in it, narrower than a gap, is no floor.
    fn end_at_floors(&self, strips: &mut [Strip]) {
        let count = strips.len();
        let mut first = 0;
        for run in strips.chunk_by_mut(|a, b| a.pierced.is_some() == b.pierced.is_some()) {
            let length_m = run[run.len() - 1].ends[1] - run[0].ends[0];
            let is_handle = first > 0 && first + run.len() < count && length_m < self.gap_m;
            first += run.len();
            for strip in run.iter_mut().filter(|_| !is_handle) {
                if let Some(is_near) = strip.pierced {
                    strip.free_m = (is_near || strip.free_m.is_some()).then_some(0.0);
                }
            }
        }
    }

    /// A joint of a frame, narrower than a stretch, is passed over as the narrower of the gaps on both sides of it.
    fn overlook_joints(&self, strips: &mut [Strip]) {
        let bare = |strip: &Strip| strip.is_opaque && strip.free_m.is_none();
        let mut from = 0;
        while from < strips.len() {
            let to = from + strips[from..].iter().take_while(|strip| bare(strip)).count();
            if to > from && strips[to - 1].ends[1] - strips[from].ends[0] <= STRETCH * self.gap_m {
                let sides = [from.checked_sub(1), Some(to)].into_iter().flatten();
                let sides = sides.filter_map(|side| strips.get(side)?.free_m);
                let free_m = sides.reduce(f64::min);
                strips[from..to].iter_mut().for_each(|strip| strip.free_m = free_m);
            }
            from = to.max(from + 1);
        }
    }
}

impl Grid {
    /// Adds the rim of a side.
    fn grow(&mut self, (axis, end): (usize, usize), strips: &[Strip]) {
        let counts = [0, 1].map(|axis| self.lines[axis].len() - 1);
        let edge = f64::from(self.lines[axis][if end == 0 { 0 } else { counts[axis] }]);
        let line = |grown_m: f64| (if end == 0 { edge - grown_m } else { edge + grown_m }) as f32;
        let mut rim: Vec<f32> = strips.iter().map(|strip| line(strip.grown_m)).collect();
        rim.retain(|line| f64::from(*line) != edge);
        rim.sort_by(f32::total_cmp);
        rim.dedup();
        let alike = |a: &Strip, b: &Strip| a.square == b.square && line(a.grown_m) == line(b.grown_m);
        let runs: Vec<_> = strips.chunk_by(alike).map(|run| &run[0]).collect();
        let before = if end == 0 { rim.len() } else { 0 };
        let width = counts[axis] + rim.len();
        let is_opaque = |squares: &[bool], at: usize, strip: &Strip| {
            let old = at.saturating_sub(before).min(counts[axis] - 1);
            // Of a rim, what lies inside of where this strip grows to.
            let reaches = match (end, at) {
                (0, at) if at < before => line(strip.grown_m) <= rim[at],
                (1, at) if at >= counts[axis] => line(strip.grown_m) >= rim[at - counts[axis]],
                _ => true,
            };
            reaches && squares[squares::number(counts[0], axis, [old, strip.square])]
        };
        self.opaque = [0, 1].map(|way| {
            let squares = &self.opaque[way];
            if axis == 0 {
                let rows = runs.iter().flat_map(|strip| (0..width).map(move |at| (at, strip)));
                rows.map(|(at, strip)| is_opaque(squares, at, strip)).collect()
            } else {
                let rows = (0..width).flat_map(|at| runs.iter().map(move |strip| (at, strip)));
                rows.map(|(at, strip)| is_opaque(squares, at, strip)).collect()
            }
        });
        let last = self.lines[1 - axis][counts[1 - axis]];
        let starts = runs.iter().map(|strip| strip.ends[0] as f32);
        self.lines[1 - axis] = starts.chain([last]).collect();
        let at = if end == 0 { 0 } else { self.lines[axis].len() };
        self.lines[axis].splice(at..at, rim);
    }
}
