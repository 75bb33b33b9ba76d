//! How solid is a square of any size in which leaves stand? Foliage is published in squares of one size ([`Foliage`]); leaves
//! of the quadtree are of another.
//!
//! Leaves are taken to be spread evenly in their square: over a share *s* of its edge, they let through (1 − solidity)^*s*. Row
//! by row, straight across, what all squares let through multiplies; the mean over the rows of both ways is the
//! share of the border that is covered (§3.1.1).

use std::collections::BTreeMap;

use belvedere_scene::foliage::{Foliage, Slab, joined};

use super::Square;

/// Foliage that one can see through almost undisturbed is left out.
pub(super) const LEAST_SOLIDITY: f64 = 0.02;

/// What was published, by place.
#[derive(Debug, Default)]
pub(super) struct Plants {
    side_m: f64,
    squares: BTreeMap<[i64; 2], Vec<Slab>>,
}

/// What of a published square lies in another one: edges as shares of its own.
struct Part<'a> {
    at: [i64; 2],
    shares: [f64; 2],
    slabs: &'a [Slab],
}

impl Plants {
    pub(super) fn of(foliage: &Foliage) -> Self {
        let squares = foliage.squares.iter().map(|square| (square.at, square.slabs.clone()));
        Self {
            side_m: foliage.side_m,
            squares: squares.collect(),
        }
    }

    /// How many published squares have their middle in here.
    pub(super) fn count(&self, square: &Square) -> usize {
        let max = square.max();
        let middle = |at: i64| (at as f64 + 0.5) * self.side_m;
        let holds = |at: &[i64; 2]| (0..2).all(|i| square.min[i] <= middle(at[i]) && middle(at[i]) < max[i]);
        self.around(square).filter(|(at, _)| holds(at)).count()
    }

    /// How solid a square is at which heights, from the lowest up.
    pub(super) fn slabs(&self, square: &Square) -> Vec<Slab> {
        let parts: Vec<_> = self.parts(square).collect();
        let mut heights: Vec<f64> = parts
            .iter()
            .flat_map(|part| part.slabs)
            .flat_map(|slab| [slab.from_m, slab.to_m])
            .collect();
        heights.sort_by(f64::total_cmp);
        heights.dedup();
        let thin = heights.windows(2).map(|ends| Slab {
            from_m: ends[0],
            to_m: ends[1],
            solidity: self.solidity(square, &parts, 0.5 * (ends[0] + ends[1])),
        });
        joined(thin, LEAST_SOLIDITY)
    }

    fn solidity(&self, square: &Square, parts: &[Part<'_>], height_m: f64) -> f64 {
        let across = [0, 1].map(|along| {
            // What each row lets through, and how much of the side it is.
            let mut rows: BTreeMap<i64, (f64, f64)> = BTreeMap::new();
            for part in parts {
                let stands = |slab: &&Slab| slab.from_m <= height_m && height_m < slab.to_m;
                let solidity = part.slabs.iter().find(stands).map_or(0.0, |slab| slab.solidity);
                let row = rows.entry(part.at[1 - along]).or_insert((1.0, part.shares[1 - along]));
                row.0 *= (1.0 - solidity).powf(part.shares[along]);
            }
            let covered = rows.values().map(|(passes, share)| (1.0 - passes) * share);
            covered.sum::<f64>() * self.side_m / square.side_m
        });
        (0.5 * (across[0] + across[1])).min(1.0)
    }

    fn parts(&self, square: &Square) -> impl Iterator<Item = Part<'_>> {
        let (min, max) = (square.min, square.max());
        self.around(square).filter_map(move |(at, slabs)| {
            let shares = [0, 1].map(|i| {
                let low = at[i] as f64 * self.side_m;
                (max[i].min(low + self.side_m) - min[i].max(low)) / self.side_m
            });
            let part = Part { at: *at, shares, slabs };
            shares.iter().all(|share| *share > 0.0).then_some(part)
        })
    }

    /// Those that may touch a square, and others in the same band of x.
    fn around(&self, square: &Square) -> impl Iterator<Item = (&[i64; 2], &Vec<Slab>)> {
        let index = |x: f64| (x / self.side_m).floor() as i64;
        let band = [index(square.min[0]), i64::MIN]..=[index(square.max()[0]), i64::MAX];
        let any = (!self.squares.is_empty()).then(|| self.squares.range(band));
        any.into_iter().flatten()
    }
}

#[cfg(test)]
mod tests {
    use belvedere_scene::foliage::FoliageSquare;

    use super::*;

    /// Squares of 4 m, half solid from 0 to 3 m.
    fn hedge(at: &[[i64; 2]]) -> Plants {
        let slab = Slab {
            from_m: 0.0,
            to_m: 3.0,
            solidity: 0.5,
        };
        let squares = at.iter().map(|at| FoliageSquare {
            at: *at,
            slabs: vec![slab],
        });
        Plants::of(&Foliage {
            side_m: 4.0,
            squares: squares.collect(),
        })
    }

    fn solidity(plants: &Plants, min: [f64; 2], side_m: f64) -> f64 {
        let slabs = plants.slabs(&Square { min, side_m });
        assert!(slabs.len() <= 1, "{slabs:?}");
        slabs.first().map_or(0.0, |slab| slab.solidity)
    }

    #[test]
    fn a_square_is_as_solid_as_what_stands_in_it_seen_straight_across() {
        let one = hedge(&[[2, -1]]);
        assert_eq!(solidity(&one, [8.0, -4.0], 4.0), 0.5, "the same square");
        assert_eq!(solidity(&one, [12.0, -4.0], 4.0), 0.0, "the one beside it");
        let quarter = solidity(&one, [9.0, -3.0], 1.0);
        assert!(
            (quarter - (1.0 - 0.5f64.powf(0.25))).abs() < 1e-12,
            "{quarter}: a part of the way"
        );
        assert_eq!(solidity(&one, [8.0, -4.0], 8.0), 0.25, "half of each side is free");
        let row = hedge(&[[0, 0], [1, 0]]);
        // One behind the other hides three quarters of half the side; side by side, half of all of it.
        assert_eq!(solidity(&row, [0.0, 0.0], 8.0), 0.5 * (0.375 + 0.5));
        assert_eq!(
            Plants::default().slabs(&Square {
                min: [0.0; 2],
                side_m: 9.0
            }),
            []
        );
    }

    #[test]
    fn each_square_is_counted_once() {
        let plants = hedge(&[[0, 0], [1, 0], [2, -1]]);
        let count = |min, side_m| plants.count(&Square { min, side_m });
        assert_eq!(count([0.0, -8.0], 16.0), 3);
        let quarters = [[0.0, -8.0], [8.0, -8.0], [0.0, 0.0], [8.0, 0.0]].map(|min| count(min, 8.0));
        assert_eq!(quarters, [0, 1, 2, 0]);
    }
}
