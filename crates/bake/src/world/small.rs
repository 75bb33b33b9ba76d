//! What is small in a world? A share of its width, or of the width of what it is of, where a plain or a few things far out make it far
//! wider than that.

use super::main_part::MainPart;

/// What is less than this share of the diagonal is always small: what hides is known to a fiftieth of that.
pub(super) const LEAST: f32 = 1e-4;
/// What is small is narrower than this share of the width.
const SHARE: f32 = 1e-3;
/// The scene is far wider than what it is of when it is so many times as wide.
const FAR: f64 = 4.0;
/// Widths are rounded down to so many steps for each doubling.
const STEPS: f64 = 4.0;

/// See [`World::small_m`](super::World::small_m).
pub(super) fn small_m(scale_m: f32, part: Option<&MainPart>) -> f32 {
    let Some(MainPart { width_m: most_m, .. }) = part.filter(|part| f64::from(scale_m) > FAR * part.width_m) else {
        return SHARE * scale_m;
    };
    // Rounded, so that one object more or less hardly ever changes it.
    let rounded_m = ((STEPS * most_m.log2()).floor() / STEPS).exp2() as f32;
    (SHARE * rounded_m).max(LEAST * scale_m)
}
