//! What is a scene of, where a plain, a sky or a few things far out make it far wider than that?

use belvedere_scene::Bounds;

/// The share of objects that count as outliers at each end of each axis.
const OUTLIERS: f64 = 0.05;
/// The share of objects that are no wider than is usual: of two the smaller, as of a house and a sky.
const USUAL: f64 = 0.499;

/// Most objects of a scene, without those that are far wider than the others or stand far from them.
pub(crate) struct MainPart {
    /// About how wide it is, in metres.
    pub(crate) width_m: f64,
    /// In this box it lies, the outliers among its objects too.
    around: Bounds,
}

impl MainPart {
    /// That of objects with these boxes; `None` without any.
    pub(crate) fn of(object_bounds: &[Bounds]) -> Option<Self> {
        let drawn: Vec<&Bounds> = object_bounds.iter().filter(|bounds| !bounds.is_empty()).collect();
        if drawn.is_empty() {
            return None;
        }
        let quantile = |mut of: Vec<f64>, share: f64| {
            let at = ((of.len() - 1) as f64 * share).round() as usize;
            *of.select_nth_unstable_by(at, f64::total_cmp).1
        };
        let ends = [0, 1, 2].map(|axis| {
            let middles: Vec<f64> = drawn.iter().map(|bounds| bounds.center()[axis]).collect();
            [quantile(middles.clone(), OUTLIERS), quantile(middles, 1.0 - OUTLIERS)]
        });
        let apart_m = ends.map(|[low, high]| high - low).into_iter().fold(0.0, f64::hypot) / (1.0 - 2.0 * OUTLIERS);
        let usual_m = quantile(drawn.iter().map(|bounds| bounds.diagonal_m()).collect(), USUAL);
        let width_m = apart_m + usual_m;
        Some(Self {
            width_m,
            around: Bounds {
                min: ends.map(|[low, _]| low - width_m),
                max: ends.map(|[_, high]| high + width_m),
            },
        })
    }

    /// Whether an object with this box is of it.
    pub(crate) fn holds(&self, object: &Bounds) -> bool {
        !object.is_empty()
            && (0..3).all(|axis| self.around.min[axis] <= object.min[axis] && object.max[axis] <= self.around.max[axis])
    }
}
