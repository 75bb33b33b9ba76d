//! What is small in a world? A share of its width, or of the width of what it is of, where a plain or a few things far out make it far
//! wider than that.

use belvedere_scene::Bounds;

/// What is less than this share of the diagonal is always small: what hides is known to a fiftieth of that.
pub(super) const LEAST: f32 = 1e-4;
/// What is small is narrower than this share of the width.
const SHARE: f32 = 1e-3;
/// The scene is far wider than what it is of when it is so many times as wide.
const FAR: f64 = 4.0;
/// The share of objects that count as outliers at each end of each axis.
const OUTLIERS: f64 = 0.05;
/// Widths are rounded down to so many steps for each doubling.
const STEPS: f64 = 4.0;

/// See [`World::small_m`](super::World::small_m).
pub(super) fn small_m(scale_m: f32, object_bounds: &[Bounds]) -> f32 {
    let drawn: Vec<&Bounds> = object_bounds.iter().filter(|bounds| !bounds.is_empty()).collect();
    if drawn.is_empty() {
        return SHARE * scale_m;
    }
    let quantile = |mut of: Vec<f64>, share: f64| {
        let at = ((of.len() - 1) as f64 * share).round() as usize;
        *of.select_nth_unstable_by(at, f64::total_cmp).1
    };
    let spread = |axis: usize| {
        let middles: Vec<f64> = drawn.iter().map(|bounds| bounds.center()[axis]).collect();
        quantile(middles.clone(), 1.0 - OUTLIERS) - quantile(middles, OUTLIERS)
    };
    let apart_m = [0, 1, 2].map(spread).into_iter().fold(0.0, f64::hypot) / (1.0 - 2.0 * OUTLIERS);
    let most_m = apart_m + quantile(drawn.iter().map(|bounds| bounds.diagonal_m()).collect(), 0.5);
    if f64::from(scale_m) <= FAR * most_m {
        return SHARE * scale_m;
    }
    // Rounded, so that one object more or less hardly ever changes it.
    let rounded_m = ((STEPS * most_m.log2()).floor() / STEPS).exp2() as f32;
    (SHARE * rounded_m).max(LEAST * scale_m)
}
