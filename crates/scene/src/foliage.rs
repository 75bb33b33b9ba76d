//! Where do leaves hide a share of what is behind them?
//!
//! Partial occluders that never move (poster on crowds with partial visibility, §3.1.1), seen from above: squares on the ground,
//! and in each of them slabs of air with leaves in it. `docs/FORMAT.md` says how it is published.

use serde::{Deserialize, Serialize};

/// The foliage of a revision: an immutable object (`.json`).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Foliage {
    /// Edge of a square, metres; corners of squares lie at whole multiples of it.
    pub side_m: f64,
    /// Squares with foliage, each once, rising by `at`.
    pub squares: Vec<FoliageSquare>,
}

/// A square on the ground.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FoliageSquare {
    /// Its lowest corner in edges of a square, x and z.
    pub at: [i64; 2],
    /// From the lowest up; no two overlap.
    pub slabs: Vec<Slab>,
}

/// A height range in which there are leaves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Slab {
    /// Its lower end, world space, metres.
    pub from_m: f64,
    /// Its upper end.
    pub to_m: f64,
    /// The share of its sides that the projections of its leaves cover at every height of it, above 0 and up to 1.
    pub solidity: f64,
}

/// No square is larger.
const LARGEST_M: f64 = 1e6;
/// Nothing is further from zero.
const FURTHEST_M: f64 = 1e9;

impl Foliage {
    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.squares.is_empty()
    }

    /// Whether it is what its members promise: a reader relies on it.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        let side_is_sound = self.is_empty() || (self.side_m > 0.0 && self.side_m <= LARGEST_M);
        let near = |square: &FoliageSquare| square.at.iter().all(|x| (*x as f64 * self.side_m).abs() <= FURTHEST_M);
        let rising = self.squares.is_sorted_by(|a, b| a.at < b.at);
        side_is_sound
            && rising
            && self
                .squares
                .iter()
                .all(|square| near(square) && are_sound(&square.slabs))
    }
}

fn are_sound(slabs: &[Slab]) -> bool {
    let is_sound = |slab: &Slab| {
        let heights = -FURTHEST_M <= slab.from_m && slab.from_m < slab.to_m && slab.to_m <= FURTHEST_M;
        heights && slab.solidity > 0.0 && slab.solidity <= 1.0
    };
    slabs.iter().all(is_sound) && slabs.is_sorted_by(|a, b| a.to_m <= b.from_m)
}

/// Joins thin slabs, from the lowest up, that touch and are about as solid as each other; what is joined is as solid as the
/// thinnest leaves in it. What hides less than `least` is left out.
#[must_use]
pub fn joined(thin: impl IntoIterator<Item = Slab>, least: f64) -> Vec<Slab> {
    /// Slabs are joined when one is at most so many times as solid as another.
    const ALIKE: f64 = 2.0;
    let mut slabs: Vec<Slab> = Vec::new();
    let mut densest: f64 = 0.0;
    for slab in thin.into_iter().filter(|slab| slab.solidity >= least) {
        if let Some(below) = slabs.last_mut() {
            let (low, high) = (below.solidity.min(slab.solidity), densest.max(slab.solidity));
            if below.to_m == slab.from_m && high <= ALIKE * low {
                (below.to_m, below.solidity, densest) = (slab.to_m, low, high);
                continue;
            }
        }
        densest = slab.solidity;
        slabs.push(slab);
    }
    slabs
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slab(from_m: f64, to_m: f64, solidity: f64) -> Slab {
        Slab { from_m, to_m, solidity }
    }

    #[test]
    fn slabs_are_joined_where_they_are_alike_and_hide_no_more_than_before() {
        let thin = [
            slab(0.0, 1.0, 0.01),
            slab(1.0, 2.0, 0.4),
            slab(2.0, 3.0, 0.3),
            slab(3.0, 4.0, 0.9),
            slab(5.0, 6.0, 0.8),
        ];
        let expected = [slab(1.0, 3.0, 0.3), slab(3.0, 4.0, 0.9), slab(5.0, 6.0, 0.8)];
        assert_eq!(joined(thin, 0.02), expected);
        // Little by little is no way round either.
        let fading = [slab(0.0, 1.0, 0.8), slab(1.0, 2.0, 0.5), slab(2.0, 3.0, 0.3)];
        assert_eq!(joined(fading, 0.02), [slab(0.0, 2.0, 0.5), slab(2.0, 3.0, 0.3)]);
    }

    #[test]
    fn what_breaks_a_promise_is_not_sound() {
        let square = |at, slabs: &[Slab]| FoliageSquare {
            at,
            slabs: slabs.to_vec(),
        };
        let foliage = |side_m, squares: &[FoliageSquare]| Foliage {
            side_m,
            squares: squares.to_vec(),
        };
        let one = square([1, 2], &[slab(0.0, 1.0, 0.5), slab(1.0, 2.0, 0.1)]);
        assert!(foliage(4.0, &[one.clone(), square([2, -5], &[])]).is_sound() && Foliage::default().is_sound());
        for broken in [
            foliage(0.0, std::slice::from_ref(&one)),
            foliage(f64::NAN, std::slice::from_ref(&one)),
            foliage(4.0, &[one.clone(), one.clone()]),
            foliage(4.0, &[square([i64::MAX, 0], &[])]),
            foliage(4.0, &[square([0, 0], &[slab(1.0, 1.0, 0.5)])]),
            foliage(4.0, &[square([0, 0], &[slab(0.0, 2.0, 0.5), slab(1.0, 3.0, 0.5)])]),
            foliage(4.0, &[square([0, 0], &[slab(0.0, 2.0, 1.5)])]),
            foliage(4.0, &[square([0, 0], &[slab(f64::NEG_INFINITY, 2.0, 0.5)])]),
        ] {
            assert!(!broken.is_sound(), "{broken:?}");
        }
    }
}
