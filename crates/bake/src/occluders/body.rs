//! Which convex bodies lie inside the geometry? One body blocks every segment that meets it.
//!
//! Positions are relative to the world's origin, in metres.

use glam::{DVec3, Vec3, Vec4};

use super::{Region, Tolerance};
use crate::digest::Digester;

/// A face that looks down this much is a bottom.
const BOTTOM: f32 = -0.999_9;

/// A bottom counts as so many times the distance within which faces lie in one plane lower than it is: what stands on the same floor
/// is taken up to two of these larger when it is asked about (`visibility/narrow.rs`), and is rounded.
const ROUNDING: f32 = 4.0;

/// A convex body that lies wholly inside something opaque: no segment that starts outside gets through it. It is what of a box lies
/// behind all its planes.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// The lowest corner of the box.
    pub min: Vec3,
    /// Its highest corner.
    pub max: Vec3,
    /// What cuts the box: the body is where `xyz · p ≤ w` for each. Normals have length 1.
    pub planes: Vec<Vec4>,
    /// The height that all of its bottom stands on, less what rounding may add. A segment between places at or above it cannot pass
    /// below the body, so there all of its box that its sides leave reaches down for ever.
    pub stands_m: f32,
    /// Nothing closes it from below: it blocks only segments between places at or above [`stands_m`](Self::stands_m).
    pub open_below: bool,
    /// Whether it hides anything. What does not says where else the inside of its object is, [`super::rest`].
    pub hides: bool,
    /// The object that it lies in.
    pub object: u32,
}

/// Whether a face looks straight down.
pub(crate) fn is_bottom(normal: Vec3) -> bool {
    normal.y < BOTTOM
}

/// How high the bottom of a body reaches, whose box and faces these are: a bottom may lean by as much as still looks down.
fn highest_bottom_m(min: Vec3, max: Vec3, planes: &[Vec4]) -> f32 {
    let bottoms = planes.iter().filter(|plane| is_bottom(plane.truncate()));
    let heights = bottoms.map(|plane| {
        let uphill = |normal: f32, low: f32, high: f32| if normal > 0.0 { high } else { low };
        let [x, z] = [uphill(plane.x, min.x, max.x), uphill(plane.z, min.z, max.z)];
        (plane.x * x + plane.z * z - plane.w) / -plane.y
    });
    heights.fold(min.y, f32::max)
}

impl Body {
    /// The body inside a convex solid of an object, which is what of a box lies behind planes: on every side as much smaller as holes
    /// are closed. `None` when that leaves nothing.
    pub(crate) fn inside([min, max]: [Vec3; 2], planes: &[Vec4], object: u32, tolerance: Tolerance) -> Option<Self> {
        let margin_m = tolerance.hole_m;
        let body = Self {
            min: min + margin_m,
            max: max - margin_m,
            planes: planes.iter().map(|plane| *plane - margin_m * Vec4::W).collect(),
            stands_m: highest_bottom_m(min, max, planes) - ROUNDING * tolerance.plane_m,
            open_below: false,
            hides: true,
            object,
        };
        body.min.cmplt(body.max).all().then_some(body)
    }

    /// Hands all that it is to a digester.
    pub(super) fn feed(&self, digester: &mut Digester) {
        digester.point(self.min).point(self.max).floats(&[self.stands_m]);
        digester
            .flag(self.open_below)
            .flag(self.hides)
            .count(self.object as usize);
        digester.count(self.planes.len());
        for plane in &self.planes {
            digester.floats(&plane.to_array());
        }
    }

    /// Whether a segment meets it.
    #[must_use]
    pub fn meets(&self, from: Vec3, to: Vec3) -> bool {
        self.blocks(from, to, false)
    }

    /// Whether a segment meets it, or, when it `reaches_down`, what is below it.
    fn blocks(&self, from: Vec3, to: Vec3, reaches_down: bool) -> bool {
        self.enters(from, to, reaches_down).is_some()
    }

    /// Where a segment first meets it, or, when it `reaches_down`, what is below it, as a share of the segment. Below it means within
    /// the sides of its box too: slanted faces that go on down would lean out ever further. In double precision: of a long segment
    /// single precision tells places apart no better than a body is smaller than what it lies in.
    pub(crate) fn enters(&self, from: Vec3, to: Vec3, reaches_down: bool) -> Option<f64> {
        let (from, to) = (from.as_dvec3(), to.as_dvec3());
        let along = to - from;
        let (mut min, max) = (self.min.as_dvec3(), self.max.as_dvec3());
        if reaches_down {
            min.y = f64::from(f32::MIN);
        }
        let (mut enter, mut leave) = (0.0f64, 1.0f64);
        for axis in 0..3 {
            if along[axis] == 0.0 {
                if from[axis] < min[axis] || from[axis] > max[axis] {
                    return None;
                }
                continue;
            }
            let inverse = 1.0 / along[axis];
            let (a, b) = ((min[axis] - from[axis]) * inverse, (max[axis] - from[axis]) * inverse);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        for plane in &self.planes {
            let normal = plane.truncate();
            if reaches_down && is_bottom(normal) {
                continue;
            }
            let normal: DVec3 = normal.as_dvec3();
            let (outside, rise) = (normal.dot(from) - f64::from(plane.w), normal.dot(along));
            if rise == 0.0 {
                if outside > 0.0 {
                    return None;
                }
            } else if rise < 0.0 {
                enter = enter.max(-outside / rise);
            } else {
                leave = leave.min(-outside / rise);
            }
        }
        (enter <= leave).then_some(enter)
    }

    /// Whether all segments from one region to another meet it, so that nothing of the second is seen from the first
    /// (seed: Cohen-Or & Zadicario 1998, *Outline of the approach*): points hidden from an eye by a convex body form a
    /// convex set, and so do eyes from which a point is hidden, hence corners suffice. `hull_rays_only` leaves out the
    /// segments that do not lie on the convex hull of both; of two boxes these are all but the eight between equal
    /// corners, because a plane that touches both touches them in equal corners.
    #[must_use]
    pub fn separates(&self, eye: &Region, target: &Region, hull_rays_only: bool) -> bool {
        let reaches_down = eye.min.y.min(target.min.y) >= self.stands_m;
        if !self.hides || (self.open_below && !reaches_down) || eye.overlaps(target) {
            return false;
        }
        let blocks = |from, to| self.blocks(from, to, reaches_down);
        match (&eye.points[..], &target.points[..]) {
            ([], []) if hull_rays_only => (0..8).all(|i| blocks(eye.corner(i), target.corner(i))),
            _ => eye.corners().all(|from| target.corners().all(|to| blocks(from, to))),
        }
    }

    /// Whether some of a region may lie inside it, were its faces so much further out.
    #[must_use]
    pub fn may_hold(&self, eye: &Region, further_m: f32) -> bool {
        let boxes_meet = (self.min - further_m).cmplt(eye.max).all() && (self.max + further_m).cmpgt(eye.min).all();
        let before = |plane: &Vec4| eye.heights(plane.truncate(), plane.w)[0] >= further_m;
        boxes_meet && !self.planes.iter().any(before)
    }

    /// Whether a point lies in it.
    #[must_use]
    pub fn contains(&self, point: Vec3) -> bool {
        point.cmpge(self.min).all()
            && point.cmple(self.max).all()
            && self.planes.iter().all(|plane| plane.truncate().dot(point) <= plane.w)
    }
}
