//! How is kept what was found for a cell? In the numbers of its surroundings, so that it is true wherever these are the
//! same.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::{CellVisibility, SeenObject, look::Looked, sampler::Sighting, surroundings::Surroundings};

/// [`Looked`] in numbers of the surroundings; floats as their bits.
#[derive(Serialize, Deserialize)]
struct Kept {
    /// Object, fraction, solid angle, doors.
    objects: Vec<(u32, u32, u32, Vec<u32>)>,
    open: Vec<(u32, Vec<u32>)>,
    /// Object, eye, target.
    sightings: Vec<(u32, [u32; 3], [u32; 3])>,
    uniform_rays: u32,
    miss_bound: u64,
    rays: u64,
}

/// Writes it. `None` when it names an object outside the surroundings, which only rounding can bring about.
pub(super) fn encode(looked: &Looked, surroundings: &Surroundings) -> Option<String> {
    let number = |object: &u32| surroundings.number_of(*object);
    let numbers = |objects: &[u32]| objects.iter().map(number).collect::<Option<Vec<_>>>();
    let bits = |place: Vec3| place.to_array().map(f32::to_bits);
    let objects = looked.seen.objects.iter().map(|seen| {
        let doors = numbers(&seen.doors)?;
        Some((
            number(&seen.object)?,
            seen.fraction.to_bits(),
            seen.solid_angle.to_bits(),
            doors,
        ))
    });
    let open = looked
        .open
        .iter()
        .map(|(object, doors)| Some((number(object)?, numbers(doors)?)));
    let sightings = looked.sightings.iter();
    let sightings = sightings.map(|s| Some((number(&s.object)?, bits(s.eye), bits(s.target))));
    let kept = Kept {
        objects: objects.collect::<Option<_>>()?,
        open: open.collect::<Option<_>>()?,
        sightings: sightings.collect::<Option<_>>()?,
        uniform_rays: looked.uniform_rays,
        miss_bound: looked.seen.miss_bound.to_bits(),
        rays: looked.seen.rays,
    };
    serde_json::to_string(&kept).ok()
}

/// Reads it; `None` when it makes no sense, so that it is found anew.
pub(super) fn decode(text: &str, surroundings: &Surroundings) -> Option<Looked> {
    let kept: Kept = serde_json::from_str(text).ok()?;
    let object = |number: &u32| surroundings.objects.get(*number as usize).copied();
    let objects = |numbers: &[u32]| numbers.iter().map(object).collect::<Option<Vec<_>>>();
    let place = |bits: [u32; 3]| Vec3::from(bits.map(f32::from_bits));
    let seen = kept.objects.iter().map(|(number, fraction, solid_angle, doors)| {
        Some(SeenObject {
            object: object(number)?,
            fraction: f32::from_bits(*fraction),
            solid_angle: f32::from_bits(*solid_angle),
            doors: objects(doors)?,
        })
    });
    let open = kept
        .open
        .iter()
        .map(|(number, doors)| Some((object(number)?, objects(doors)?)));
    let sightings = kept.sightings.iter().map(|(number, eye, target)| {
        Some(Sighting {
            object: object(number)?,
            eye: place(*eye),
            target: place(*target),
            triangle: None,
        })
    });
    Some(Looked {
        seen: CellVisibility {
            objects: seen.collect::<Option<_>>()?,
            cells: Vec::new(),
            miss_bound: f64::from_bits(kept.miss_bound),
            rays: kept.rays,
        },
        open: open.collect::<Option<_>>()?,
        sightings: sightings.collect::<Option<_>>()?,
        uniform_rays: kept.uniform_rays,
    })
}
