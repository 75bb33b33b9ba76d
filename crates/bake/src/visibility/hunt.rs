//! Is there a sight line to an object that nobody has seen and nobody can prove hidden?
//!
//! Sight lines are drawn between places on the border of the cell and places on the object; out of the object in any direction;
//! and, again and again, beside those that got nearest to it, each time changed a little less (Wonka et al., *Guided
//! visibility sampling*, 2006); between parts of both that no proof separates ([`super::narrow`]); and through the openings
//! that proofs could not close, which are as narrow as what can be seen through them: proofs say where to look.
//!
//! Guarantee: none; what is found was seen by a ray.

use glam::Vec3;

use super::{
    random::Random,
    sampler::Sampler,
    surface::Surface,
    targets::{Lookout, on_object},
};
use crate::occluders::Region;

/// The share of coordinates that lie on a border, where views begin and end.
const CORNERS: f32 = 0.35;
/// The share of eyes that stand in corners besides …
const IN_CORNERS: f32 = 0.3;
/// … and in openings.
const IN_OPENINGS: f32 = 0.3;
/// So many attempts are tried again.
const KEPT: usize = 16;
/// They are changed by halves of the cell and the object, then by quarters, and so on.
const WIDTHS: f32 = 8.0;

/// A sight line that did not arrive.
struct Attempt {
    eye: Vec3,
    target: Vec3,
    /// The share of it behind where it was blocked.
    left: f32,
}

/// Casts up to so many rays at an object from a part of the cell, `ways` being openings that may lead to it. Whether a
/// sight line to it is known now.
pub(super) fn hunt(sampler: &mut Sampler<'_>, part: &Region, object: u32, ways: &[Region], rays: u32) -> bool {
    let lookout = sampler.lookout();
    let world = sampler.sights.world;
    let bounds = world.object_bounds()[object as usize];
    let (min, max) = (world.relative(bounds.min), world.relative(bounds.max));
    let mut best: Vec<Attempt> = Vec::with_capacity(KEPT);
    let fresh = rays / 3 * 2;
    for i in 0..rays {
        if sampler.knows(object) {
            break;
        }
        let random = &mut sampler.state.random;
        let (eye, target, aimed) = if i >= fresh && !best.is_empty() {
            let from = &best[random.below(best.len())];
            let share = (i - fresh) as f32 / (rays - fresh) as f32;
            let width = 0.5f32.powi(1 + (share * WIDTHS) as i32);
            let eye = from.eye + width * random.around_zero() * (part.max - part.min);
            let target = from.target + width * random.around_zero() * (max - min);
            let eye = lookout.clamp(eye);
            (eye, target, sampler.aim(eye, target))
        } else {
            let Some(target) = on_object(world, object, random) else {
                break;
            };
            let out_of_it = i % 8 == 3;
            if ways.is_empty() || i % 2 == 0 || out_of_it {
                let out = out_of_it.then(|| outward(part, target, random)).flatten();
                let eye = out.map_or_else(|| eye_in(part, lookout, random), |eye| lookout.clamp(eye));
                (eye, target, sampler.look_at(object, eye, target))
            } else {
                let line = if i % 4 == 1 {
                    across(part, ways, [min, max], random)
                } else {
                    let [near, far] = through(ways, target, random);
                    meeting(part, near, far, random).map(|eye| [eye, eye + (far - near)])
                };
                let Some([eye, towards]) = line else {
                    continue;
                };
                let eye = lookout.clamp(eye);
                let target = eye + (towards - eye).normalize_or_zero() * (target - eye).length();
                (eye, target, sampler.aim(eye, target))
            }
        };
        let Some(left) = aimed.map(|aimed| aimed.left()) else {
            continue;
        };
        let place = best.partition_point(|other| other.left <= left);
        if place < KEPT {
            best.truncate(KEPT - 1);
            best.insert(place, Attempt { eye, target, left });
        }
    }
    sampler.knows(object)
}

/// Casts so many rays between a part of the cell and a part of an object, every other one through openings that may lie on the
/// way. Whether a sight line to the object is known now.
pub(super) fn look_between(
    sampler: &mut Sampler<'_>,
    object: u32,
    from: &Region,
    part: &Surface,
    ways: &[Region],
    rays: u32,
) -> bool {
    let lookout = sampler.lookout();
    for i in 0..rays {
        if sampler.knows(object) {
            break;
        }
        let random = &mut sampler.state.random;
        let target = part.point(random);
        if ways.is_empty() || i % 2 == 0 {
            let eye = lookout.clamp(place_in(from, random));
            sampler.look_at(object, eye, target);
        } else {
            let [near, far] = through(ways, target, random);
            if let Some(eye) = meeting(from, near, far, random) {
                let eye = lookout.clamp(eye);
                sampler.aim(eye, eye + (far - near));
            }
        }
    }
    sampler.knows(object)
}

/// An eye in a part of the cell, often in a corner: what a single body hides from all corners it hides from all of the box, so
/// that more is seen from them than from elsewhere; or in an opening of the cell, often on its border, as far as that lies there.
fn eye_in(part: &Region, lookout: &Lookout, random: &mut Random) -> Vec3 {
    let place = random.unit();
    let opening = (place < IN_OPENINGS).then(|| lookout.in_portal(random));
    if let Some(eye) = opening.filter(|eye| eye.clamp(part.min, part.max) == *eye) {
        eye
    } else if place > 1.0 - IN_CORNERS {
        let share = random.cube().round();
        lookout.clamp(part.min + share * (part.max - part.min))
    } else {
        lookout.clamp(place_in(part, random))
    }
}

/// A place inside a box, on a face, on an edge or in a corner.
fn place_in(region: &Region, random: &mut Random) -> Vec3 {
    let mut share = random.cube();
    for axis in 0..3 {
        if random.unit() < CORNERS {
            share[axis] = share[axis].round();
        }
    }
    region.min + share * (region.max - region.min)
}

/// Two places on a line towards the target that passes one opening, or two.
fn through(ways: &[Region], target: Vec3, random: &mut Random) -> [Vec3; 2] {
    let first = random.below(ways.len());
    let near = place_in(&ways[first], random);
    let second = random.below(ways.len());
    if second == first {
        return [near, target];
    }
    let far = place_in(&ways[second], random);
    if (far - target).length() <= (near - target).length() {
        [near, far]
    } else {
        [far, near]
    }
}

/// Where one comes into a box from a place outside of it, in any direction: who is as near sees it best, however large the box.
fn outward(region: &Region, place: Vec3, random: &mut Random) -> Option<Vec3> {
    const DRAWS: usize = 8;
    (0..DRAWS).find_map(|_| {
        let way = random.direction();
        let [enter, leave] = inside(region, place, way);
        (0.0 < enter && enter <= leave).then(|| place + enter * way)
    })
}

/// A line through an opening, in any direction, that leads from the region on one side of it to a box on the other: where it leaves the
/// region, and where it passes the opening.
fn across(region: &Region, ways: &[Region], [min, max]: [Vec3; 2], random: &mut Random) -> Option<[Vec3; 2]> {
    const DRAWS: usize = 16;
    let bounds = Region::of_box(min, max);
    (0..DRAWS).find_map(|_| {
        let place = place_in(&ways[random.below(ways.len())], random);
        let way = random.direction();
        let [[enter, leave], [from, to]] = [inside(region, place, way), inside(&bounds, place, -way)];
        (0.0 < enter && enter <= leave && from <= to && to > 0.0).then(|| [place + enter * way, place])
    })
}

/// A place where the line through two places meets a box, on the side of the first.
fn meeting(region: &Region, near: Vec3, far: Vec3, random: &mut Random) -> Option<Vec3> {
    let along = (far - near).try_normalize()?;
    let [enter, leave] = inside(region, near, along);
    let leave = leave.min(0.0);
    (enter <= leave && enter.is_finite()).then(|| near + (enter + (leave - enter) * random.unit()) * along)
}

/// From where to where a line is inside of a box, in lengths of its way; the second is less where it is nowhere.
fn inside(region: &Region, place: Vec3, way: Vec3) -> [f32; 2] {
    let (mut enter, mut leave) = (f32::NEG_INFINITY, f32::INFINITY);
    for axis in 0..3 {
        let [a, b] = [region.min, region.max].map(|side| (side[axis] - place[axis]) / way[axis]);
        // A line in the plane of a side gives 0 / 0, which `min` and `max` leave out.
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    [enter, leave]
}
