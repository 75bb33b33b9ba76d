//! What is small in a world? A share of its width, or of the width of what it is of, where a plain or a few things far out make it far
//! wider than that.

use belvedere_scene::Bounds;

use super::main_part::{FAR, MainPart};

/// What is less than this share of the diagonal is always small: what hides is known to a fiftieth of that.
pub(super) const LEAST: f32 = 1e-4;
/// What is small is narrower than this share of the width.
const SHARE: f32 = 1e-3;
/// Widths are rounded down to so many steps for each doubling.
const STEPS: f64 = 4.0;

/// See [`World::small_m`](super::World::small_m).
pub(super) fn small_m(scale_m: f32, object_bounds: &[Bounds]) -> f32 {
    let Some(MainPart { width_m: most_m, .. }) = MainPart::of(object_bounds) else {
        return SHARE * scale_m;
    };
    if f64::from(scale_m) <= FAR * most_m {
        return SHARE * scale_m;
    }
    // Rounded, so that one object more or less hardly ever changes it.
    let rounded_m = ((STEPS * most_m.log2()).floor() / STEPS).exp2() as f32;
    (SHARE * rounded_m).max(LEAST * scale_m)
}
