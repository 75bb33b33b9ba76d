//! How large is what a cell sees of each object, and how much of it?

use super::{
    sampler::{Sampler, Uniform},
    targets::facing,
};

/// Rays per object that measure its fraction.
const FRACTION_RAYS: u32 = 32;
/// All directions, in steradians.
const ALL_AROUND_SR: f32 = 4.0 * std::f32::consts::PI;
/// No solid angle is taken to be smaller, in steradians.
pub(super) const LEAST_SR: f32 = 1e-9;

/// What is seen of an object.
#[derive(Debug, Clone, Copy)]
pub(super) struct Measured {
    pub(super) object: u32,
    /// Share of sight lines from the cell to its surface that nothing else blocks, in (0, 1].
    pub(super) fraction: f32,
    /// Mean solid angle over all eyes in the cell, in steradians, above 0.
    pub(super) solid_angle_sr: f32,
}

/// Measures everything that was seen, in order of discovery, with sight lines from eyes that are uniform in the cell.
pub(super) fn measure(sampler: &mut Sampler<'_>, uniform: &Uniform) -> Vec<Measured> {
    let per_ray_sr = ALL_AROUND_SR / uniform.rays.max(1) as f32;
    let mut measured = Vec::with_capacity(sampler.state.seen.len());
    // What is discovered on the way is measured too.
    while let Some(sighting) = sampler.state.seen.get(measured.len()).copied() {
        let hits = uniform.hits.get(measured.len()).copied().unwrap_or(0);
        let fraction = fraction(sampler, sighting.object);
        let floor_sr = (fraction * covered_sr(sampler, sighting.object)).clamp(LEAST_SR, 0.5 * per_ray_sr);
        measured.push(Measured {
            object: sighting.object,
            fraction,
            solid_angle_sr: (per_ray_sr * hits as f32).max(floor_sr),
        });
        if measured.len() == sampler.state.seen.len() {
            sampler.follow();
        }
    }
    measured
}

fn fraction(sampler: &mut Sampler<'_>, object: u32) -> f32 {
    let (lookout, world) = (sampler.lookout(), sampler.sights.world);
    let mut arrived = 0;
    for _ in 0..FRACTION_RAYS {
        let eye = lookout.uniform(&mut sampler.state.random);
        let Some(target) = facing(world, object, eye, &mut sampler.state.random) else {
            break;
        };
        if let Some(aimed) = sampler.aim(eye, target) {
            let mut met = sampler.scratch.passed.iter().chain(&aimed.end);
            arrived += u32::from(aimed.arrived() || met.any(|hit| hit.object == object));
        }
    }
    (arrived as f32).max(0.5) / FRACTION_RAYS as f32
}

/// Too small for random rays: what its box would cover.
fn covered_sr(sampler: &Sampler<'_>, object: u32) -> f32 {
    let world = sampler.sights.world;
    let bounds = world.object_bounds()[object as usize];
    let away_m = sampler.lookout().distance_m(world.relative(bounds.center()));
    let size = bounds.diagonal_m() as f32 / away_m.max(f32::MIN_POSITIVE);
    (size * size).min(ALL_AROUND_SR)
}
