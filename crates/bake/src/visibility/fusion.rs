//! Do several bodies together hide something that none of them hides alone?
//!
//! Follows the occluder shrinking of Wonka, Wimmer & Schmalstieg, *Visibility preprocessing with occluder fusion for
//! urban walkthroughs* (2000), with a box in place of their sphere: if a segment from the middle of the eye box meets a
//! body eroded by the eye box's half extents, then the same segment moved to start at any other eye of the box meets the
//! body itself. So what is hidden behind eroded bodies from *one* point, for a target grown by the half extents, is
//! hidden from the *whole* box, and any number of bodies hide together.
//!
//! Departures: in space instead of above a ground plan; visibility from the point is found on the six faces of a cube
//! around it. A square of a face is covered when its four corner rays meet one body, which by convexity covers all rays
//! between, at the depth of the furthest of the four entries: what one over the depth of an entry is, is the least of
//! linear functions of the place on the face, so nowhere less than at a corner. Squares that no body covers alone stay open.
//!
//! Guarantee: conservative. Cost: squares that the bodies cover, plus squares that the targets cover.

use glam::{Vec3, Vec4};

use crate::occluders::{Body, Region, is_bottom};

/// Squares along an edge of the cube's faces.
const SIZE: usize = 192;
/// Depths compare with this much slack, a share of the depth, against rounding.
const SLACK: f32 = 1e-4;

/// Depth of the nearest cover on the faces of a cube around one point.
pub struct Shadows {
    eye: Vec3,
    /// Half extents of the eye box.
    half: Vec3,
    floor_m: f32,
    /// For each square of the six faces the depth along the face's axis behind which everything is hidden.
    cover: Vec<f32>,
}

/// Squares of a face: `[from, to)` along both axes.
type Squares = [[usize; 2]; 2];

impl Default for Shadows {
    fn default() -> Self {
        Self {
            eye: Vec3::ZERO,
            half: Vec3::ZERO,
            floor_m: 0.0,
            cover: vec![f32::INFINITY; 6 * SIZE * SIZE],
        }
    }
}

/// A face of the cube: its axis, and the direction along it.
fn face(index: usize) -> (usize, f32) {
    (index / 2, if index.is_multiple_of(2) { 1.0 } else { -1.0 })
}

/// Lattice line to the tangent of its angle, −1 to 1.
fn tangent(line: usize) -> f32 {
    line as f32 * (2.0 / SIZE as f32) - 1.0
}

impl Shadows {
    /// Starts anew for an eye box and targets that lie at or above `floor_m`, as the eye box must. A sight line between
    /// two places above a height stays above it, so what stands on the floor may as well reach below it; eroded from
    /// below, it would let sight lines through under it.
    pub fn begin(&mut self, eye: &Region, floor_m: f32) {
        self.eye = eye.center();
        self.half = 0.5 * (eye.max - eye.min);
        self.floor_m = floor_m;
        self.cover.fill(f32::INFINITY);
    }

    /// Whether they were begun for this eye box and floor.
    #[must_use]
    pub fn are_of(&self, eye: &Region, floor_m: f32) -> bool {
        let half = 0.5 * (eye.max - eye.min);
        self.eye == eye.center() && self.half == half && self.floor_m == floor_m
    }

    /// Draws the shadow of a body. One that reaches into the eye box or is thinner than it casts none.
    pub fn add(&mut self, body: &Body) {
        let stands = body.stands_m <= self.floor_m;
        if body.open_below && !stands {
            return;
        }
        let (mut min, max) = (body.min + self.half - self.eye, body.max - self.half - self.eye);
        if stands {
            // As far down as any target shows, and a square more.
            let furthest_m = min.abs().max(max.abs()).length();
            let lowest_m = self.floor_m - self.half.y - self.eye.y - 4.0 / SIZE as f32 * furthest_m;
            min.y = min.y.min(lowest_m);
        }
        let meets_eye = min.cmple(Vec3::ZERO).all() && max.cmpge(Vec3::ZERO).all();
        if min.cmplt(max).all() && !meets_eye && may_cover(min, max) {
            let planes: Vec<Vec4> = body
                .planes
                .iter()
                .map(|plane| (plane.truncate(), plane.w))
                .filter(|(normal, _)| !(stands && is_bottom(*normal)))
                .map(|(normal, w)| normal.extend(w - normal.dot(self.eye) - normal.abs().dot(self.half)))
                .collect();
            for index in 0..6 {
                self.cast(index, min, max, &planes);
            }
        }
    }

    /// Covers the squares of a face that lie behind a box cut by planes.
    fn cast(&mut self, index: usize, min: Vec3, max: Vec3, planes: &[Vec4]) {
        let (axis, sign) = face(index);
        let Some([[u0, u1], [v0, v1]]) = squares(axis, sign, min, max) else {
            return;
        };
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let [near, far] = if sign > 0.0 {
            [min[axis], max[axis]]
        } else {
            [-max[axis], -min[axis]]
        };
        if far <= 0.0 {
            return;
        }
        // Depths at which a ray with this tangent is between two sides.
        let span = |tangent: f32, low: f32, high: f32| {
            if tangent == 0.0 {
                return if low <= 0.0 && high >= 0.0 {
                    [f32::NEG_INFINITY, f32::INFINITY]
                } else {
                    [1.0, 0.0]
                };
            }
            let (a, b) = (low / tangent, high / tangent);
            [a.min(b), a.max(b)]
        };
        let mut columns = [[0.0f32; 2]; SIZE + 1];
        for (line, column) in columns.iter_mut().enumerate().take(u1 + 1).skip(u0) {
            *column = span(tangent(line), min[u], max[u]);
        }
        let entries = |line: usize, row: &mut [f32; SIZE + 1]| {
            let [enter_v, leave_v] = span(tangent(line), min[v], max[v]);
            let (enter_v, leave_v) = (enter_v.max(near).max(0.0), leave_v.min(far));
            for column in u0..=u1 {
                let [enter_u, leave_u] = columns[column];
                let (mut enter, mut leave) = (enter_v.max(enter_u), leave_v.min(leave_u));
                if !planes.is_empty() && enter <= leave {
                    let mut ray = Vec3::ZERO;
                    (ray[axis], ray[u], ray[v]) = (sign, tangent(column), tangent(line));
                    (enter, leave) = between(planes, ray, enter, leave);
                }
                row[column] = if enter <= leave && enter > 0.0 {
                    enter
                } else {
                    f32::INFINITY
                };
            }
        };
        let mut below = [f32::INFINITY; SIZE + 1];
        let mut above = [f32::INFINITY; SIZE + 1];
        entries(v0, &mut below);
        for row in v0..v1 {
            entries(row + 1, &mut above);
            let cover = &mut self.cover[(index * SIZE + row) * SIZE..][..SIZE];
            for column in u0..u1 {
                let furthest = below[column]
                    .max(below[column + 1])
                    .max(above[column])
                    .max(above[column + 1]);
                cover[column] = cover[column].min(furthest);
            }
            std::mem::swap(&mut below, &mut above);
        }
    }

    /// Whether a target is hidden from the whole eye box.
    #[must_use]
    pub fn hide(&self, target: &Region) -> bool {
        if target.min.y < self.floor_m {
            return false;
        }
        let (min, max) = (target.min - self.half - self.eye, target.max + self.half - self.eye);
        if min.cmple(Vec3::ZERO).all() && max.cmpge(Vec3::ZERO).all() {
            return false;
        }
        (0..6).all(|index| self.hides_on(index, min, max))
    }

    fn hides_on(&self, index: usize, min: Vec3, max: Vec3) -> bool {
        let (axis, sign) = face(index);
        let Some([[u0, u1], [v0, v1]]) = squares(axis, sign, min, max) else {
            return true;
        };
        let near = if sign > 0.0 { min[axis] } else { -max[axis] };
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        // No point of the target that shows in the square is nearer than this.
        let least = |line: usize, low: f32, high: f32| {
            let steepest = tangent(line).abs().max(tangent(line + 1).abs());
            if low > 0.0 {
                low / steepest.max(f32::MIN_POSITIVE)
            } else if high < 0.0 {
                -high / steepest.max(f32::MIN_POSITIVE)
            } else {
                0.0
            }
        };
        (v0..v1).all(|row| {
            let at_row = near.max(least(row, min[v], max[v]));
            let cover = &self.cover[(index * SIZE + row) * SIZE..][..SIZE];
            (u0..u1).all(|column| {
                let depth = at_row.max(least(column, min[u], max[u]));
                cover[column] * (1.0 + SLACK) <= depth
            })
        })
    }
}

/// Whether a box around the eye's surroundings is near enough to cover a square. It lies in a cylinder about its longest edge,
/// and all of that shows in a strip of a face. There depths are not less than the distance over √3, and nothing shows larger
/// than twice its size over its depth.
fn may_cover(min: Vec3, max: Vec3) -> bool {
    let edges = max - min;
    let longest = edges.max_element();
    let thickness_m = (edges.length_squared() - longest * longest).max(0.0).sqrt();
    let distance_m = min.max(-max).max(Vec3::ZERO).length();
    // A little more than √3, against rounding.
    1.74 * SIZE as f32 * thickness_m >= distance_m
}

/// Where a ray from the eye, already cut to some lengths of its direction, is behind all planes.
fn between(planes: &[Vec4], ray: Vec3, mut enter: f32, mut leave: f32) -> (f32, f32) {
    for plane in planes {
        let rise = plane.truncate().dot(ray);
        if rise < 0.0 {
            enter = enter.max(plane.w / rise);
        } else if rise > 0.0 {
            leave = leave.min(plane.w / rise);
        } else if plane.w < 0.0 {
            return (f32::INFINITY, 0.0);
        }
    }
    (enter, leave)
}

/// The squares of a face that a box around the eye's surroundings shows in; `None` when it does not.
fn squares(axis: usize, sign: f32, min: Vec3, max: Vec3) -> Option<Squares> {
    let [near, far] = if sign > 0.0 {
        [min[axis], max[axis]]
    } else {
        [-max[axis], -min[axis]]
    };
    if far <= 0.0 {
        return None;
    }
    let mut squares = [[0; 2]; 2];
    for (squares, across) in squares.iter_mut().zip([(axis + 1) % 3, (axis + 2) % 3]) {
        let (low, high) = (min[across], max[across]);
        let steepest = |side: f32, depth: f32| {
            if depth > 0.0 {
                side / depth
            } else {
                side.signum() * f32::INFINITY
            }
        };
        let from = if low > 0.0 {
            low / far
        } else if low < 0.0 {
            steepest(low, near)
        } else {
            0.0
        };
        let to = if high < 0.0 {
            high / far
        } else if high > 0.0 {
            steepest(high, near)
        } else {
            0.0
        };
        if from > 1.0 || to < -1.0 {
            return None;
        }
        let line = |tangent: f32| (tangent.clamp(-1.0, 1.0) + 1.0) * (0.5 * SIZE as f32);
        let (first, end) = (line(from).floor() as usize, line(to).ceil() as usize);
        *squares = [first.min(SIZE - 1), end.clamp(first.min(SIZE - 1) + 1, SIZE)];
    }
    Some(squares)
}
