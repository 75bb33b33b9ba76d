//! Does one sight line really arrive?
//!
//! A plain ray in `f64` against every triangle whose box it meets: the distance to the triangle's plane, then the side
//! of each edge. A rasteriser errs at edges and where surfaces touch; this says how clearly something is seen. Shares
//! nothing with the item buffer but the scene.
//!
//! What is published is rounded, and every object states by how much, so a slit between two of them may be as wide as both
//! errors and not be there in the source: both count, and those of no other object. What is nearer than [`slack_m`] to being hidden cannot be decided, and counts as
//! not confirmed. With doors closed, what passes a strip beside what ends in the plane of a leaf cannot be decided either.

use glam::DVec3;

use crate::scene::{Scene, Surface};

/// Of a distance, what counts as no difference.
const RELATIVE: f64 = 1e-5;
/// Of the scene's diagonal, what counts as no difference: eight times the rounding of an f32.
const ROUNDING: f64 = 8.0 / (1 << 24) as f64;
/// … and of what stands beside a closed door: an edge counts so much further out (`docs/VISIBILITY.md`, Doors).
const STRIP: f64 = 4.5e-6;

/// How far apart two things must be at some distance from the eye to be told apart, in metres; `errors_m` are both of theirs.
#[must_use]
pub fn slack_m(scene: &Scene, distance_m: f64, errors_m: f64) -> f64 {
    let strip = if scene.closed().is_empty() { 0.0 } else { STRIP };
    RELATIVE * distance_m + (ROUNDING + strip) * scene.bounds().diagonal_m() + errors_m
}

/// How undecidable cases count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Doubt {
    /// What is almost hidden is hidden: hiding faces are larger and nearer by the slack.
    Hides,
    /// What is almost seen is seen: hiding faces are smaller and farther by the slack, the object is larger.
    Shows,
}

/// Whether an object is seen in a direction: the ray meets a side of it that shows, and no other object hides that.
#[must_use]
pub fn sees(scene: &Scene, eye: DVec3, direction: DVec3, object: u32, doubt: Doubt) -> bool {
    face_seen(scene, eye, direction, object, doubt).is_some()
}

/// The point of an object that is seen in a direction, in world space: on a face, or else on a line or a point of it, of which the
/// item buffer draws more than there is: there the place nearest to the direction counts.
#[must_use]
pub fn point_seen(scene: &Scene, eye: DVec3, direction: DVec3, object: u32, doubt: Doubt) -> Option<DVec3> {
    let from_eye = face_seen(scene, eye, direction, object, doubt);
    let from_eye = from_eye.or_else(|| thin_seen(scene, eye, direction, object, doubt));
    from_eye.map(|point| eye + point)
}

/// The nearest face that shows, unless something hides it, relative to the eye.
fn face_seen(scene: &Scene, eye: DVec3, direction: DVec3, object: u32, doubt: Doubt) -> Option<DVec3> {
    let direction = direction.normalize();
    let grown = match doubt {
        Doubt::Hides => 0.0,
        Doubt::Shows => 1.0,
    };
    let mut nearest = f64::INFINITY;
    let margin = Margin {
        grown,
        errors_m: scene.objects[object as usize].error_m,
    };
    meet(scene, eye, direction, object as usize, margin, &mut |hit| {
        if hit.shows {
            nearest = nearest.min(hit.distance_m);
        }
    });
    let seen = nearest.is_finite() && !hidden(scene, eye, direction, nearest, object, doubt);
    seen.then(|| nearest * direction)
}

/// The point or place on a line that is nearest to the direction, unless something hides it, relative to the eye.
fn thin_seen(scene: &Scene, eye: DVec3, direction: DVec3, object: u32, doubt: Doubt) -> Option<DVec3> {
    let direction = direction.normalize();
    let model = scene.model_of(object as usize);
    let place = scene.eye_from_object(object as usize, eye);
    let at = |i: u32| place.transform_point3(model.position(i));
    let on_lines = model
        .lines
        .iter()
        .map(|[a, b]| nearest_to_ray(at(*a), at(*b), direction));
    let all = on_lines.chain(model.points.iter().map(|p| at(*p)));
    let off = |p: &DVec3| 1.0 - p.normalize_or_zero().dot(direction);
    let target = all.min_by(|a, b| off(a).total_cmp(&off(b)))?;
    let distance_m = target.length();
    let seen = distance_m > 0.0 && !hidden(scene, eye, target / distance_m, distance_m, object, doubt);
    seen.then_some(target)
}

/// The point of a line from `a` to `b` that is nearest to a ray from the origin.
fn nearest_to_ray(a: DVec3, b: DVec3, direction: DVec3) -> DVec3 {
    let across = |v: DVec3| v - v.dot(direction) * direction;
    let (from, along) = (across(a), across(b - a));
    let share = -from.dot(along) / along.length_squared();
    if share.is_finite() {
        a.lerp(b, share.clamp(0.0, 1.0))
    } else {
        a
    }
}

fn hidden(scene: &Scene, eye: DVec3, direction: DVec3, distance_m: f64, object: u32, doubt: Doubt) -> bool {
    let sign = match doubt {
        Doubt::Hides => 1.0,
        Doubt::Shows => -1.0,
    };
    let own_m = scene.objects[object as usize].error_m;
    (0..scene.objects.len())
        .filter(|other| *other != object as usize)
        .any(|other| {
            let mut hides = false;
            let margin = Margin {
                grown: sign,
                errors_m: own_m + scene.objects[other].error_m,
            };
            let limit = distance_m + margin.at(scene, distance_m);
            meet(scene, eye, direction, other, margin, &mut |hit| {
                hides |= hit.hides && hit.distance_m < limit;
            });
            hides
        })
}

struct Hit {
    distance_m: f64,
    shows: bool,
    hides: bool,
}

/// How much larger faces count than they are.
#[derive(Clone, Copy)]
struct Margin {
    /// By so many times the slack.
    grown: f64,
    errors_m: f64,
}

impl Margin {
    fn at(&self, scene: &Scene, distance_m: f64) -> f64 {
        self.grown * slack_m(scene, distance_m, self.errors_m)
    }
}

/// Calls with every face of an object that a ray meets, faces being larger by a margin.
fn meet(scene: &Scene, eye: DVec3, direction: DVec3, object: usize, margin: Margin, found: &mut dyn FnMut(&Hit)) {
    let bounds = scene.bounds_of(object);
    let (min, max) = (DVec3::from(bounds.min) - eye, DVec3::from(bounds.max) - eye);
    let slack = |min: DVec3, max: DVec3| slack_m(scene, min.abs().max(max.abs()).length(), margin.errors_m);
    if bounds.is_empty() || !meets_box(min, max, slack(min, max), direction) {
        return;
    }
    let place = scene.eye_from_object(object, eye);
    let (mirrored, open) = (scene.objects[object].mirrored(), scene.is_open(object));
    let model = scene.model_of(object);
    for patch in &model.patches {
        let (min, max) = patch.bounds(&place);
        if !meets_box(min, max, slack(min, max), direction) {
            continue;
        }
        for triangle in &patch.triangles {
            let corners = triangle.map(|i| place.transform_point3(model.position(i)));
            let Some((distance_m, towards)) = meet_triangle(corners, direction, |away_m| margin.at(scene, away_m))
            else {
                continue;
            };
            let Surface {
                double_sided,
                see_through,
            } = patch.surface;
            let shows = double_sided || towards != mirrored;
            found(&Hit {
                distance_m,
                shows,
                hides: shows && !see_through && !open,
            });
        }
    }
}

/// Distance to a triangle along a ray from the origin, and whether its counter-clockwise side faces the origin.
fn meet_triangle([a, b, c]: [DVec3; 3], direction: DVec3, margin_m: impl Fn(f64) -> f64) -> Option<(f64, bool)> {
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let approach = normal.dot(direction);
    let distance_m = normal.dot(a) / approach;
    // A face that is degenerate or seen edge on gives no finite distance.
    if !distance_m.is_finite() || distance_m <= 0.0 {
        return None;
    }
    let point = distance_m * direction;
    let margin = margin_m(distance_m);
    let inside = [(a, b), (b, c), (c, a)].iter().all(|(from, to)| {
        let edge = *to - *from;
        // The distance of the point from the edge, in the plane, positive inside.
        normal.cross(edge).dot(point - *from) >= -margin * edge.length()
    });
    inside.then_some((distance_m, approach < 0.0))
}

/// Whether a ray from the origin meets a box that is larger by `slack`.
fn meets_box(min: DVec3, max: DVec3, slack: f64, direction: DVec3) -> bool {
    let (mut enter, mut leave) = (0.0f64, f64::INFINITY);
    for axis in 0..3 {
        let (low, high) = (min[axis] - slack, max[axis] + slack);
        if direction[axis] == 0.0 {
            if low > 0.0 || high < 0.0 {
                return false;
            }
            continue;
        }
        let (a, b) = (low / direction[axis], high / direction[axis]);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    enter <= leave
}
