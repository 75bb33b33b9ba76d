//! How much of each cell does one see? Breadth first from the observer's cell to the cells beside, and on (§4).
//!
//! Each cell that is reached keeps of itself, for each shadow met so far, what lies beside it and what the occluder's gaps leave:
//! its *visibility value* is the product of 1 − share · solidity. Then it casts a shadow itself.

use std::collections::BTreeSet;

use super::{Crowd, Spot, Square, node::Leaf, shadow::Shadow};

/// A cell that is less solid casts no shadow.
const LEAST_SOLIDITY: f64 = 0.02;
/// What is hidden so far is not looked at more closely.
const HIDDEN: f64 = 1e-3;

/// What an observer sees of a crowd.
#[derive(Debug, Clone, Default)]
pub struct View {
    /// The observer's height.
    height_m: f64,
    /// Those that were reached, rising …
    leaves: Vec<Leaf>,
    /// … and what is seen of each.
    values: Vec<Value>,
}

/// What is seen of a leaf.
#[derive(Debug, Clone, Copy)]
struct Value {
    /// Where that was: leaves come and go, and another may have its number by now.
    square: Square,
    share: f64,
    /// For which it holds.
    heights: [f64; 2],
}

impl View {
    /// What is seen from a point, within a radius.
    #[must_use]
    pub fn from(crowd: &mut Crowd, eye: [f64; 3], radius_m: f64) -> Self {
        crowd.settle();
        let (point, height_m) = ([eye[0], eye[2]], eye[1]);
        let mut shadows: Vec<Shadow> = Vec::new();
        // Each with what is seen of it, as far as that is known: in the order in which they were met.
        let mut met = vec![crowd.leaf_at(point)];
        let mut is_met: BTreeSet<Leaf> = met.iter().copied().collect();
        let mut values: Vec<Value> = Vec::new();
        while let Some(leaf) = met.get(values.len()) {
            let node = &crowd.nodes[*leaf];
            let (mut value, mut heights) = (1.0, [f64::NEG_INFINITY, f64::INFINITY]);
            for shadow in &shadows {
                let share = shadow.share(&node.square);
                if share > 0.0 {
                    value *= 1.0 - share * shadow.solidity;
                    heights = [heights[0].max(shadow.heights[0]), heights[1].min(shadow.heights[1])];
                }
                if value < HIDDEN {
                    break;
                }
            }
            values.push(Value {
                square: node.square,
                share: value,
                heights,
            });
            // What is hidden itself hides little that is not.
            if let Some(hiding) = node.hides_at(height_m)
                && hiding.solidity >= LEAST_SOLIDITY
                && value >= HIDDEN
            {
                shadows.extend(Shadow::of(point, &node.square, hiding.solidity, hiding.heights));
            }
            let near = node
                .beside
                .iter()
                .filter(|other| crowd.nodes[**other].square.distance_m(point) <= radius_m);
            met.extend(near.filter(|other| is_met.insert(**other)));
        }
        let mut seen: Vec<_> = met.into_iter().zip(values).collect();
        seen.sort_unstable_by_key(|(leaf, _)| *leaf);
        let (leaves, values) = seen.into_iter().unzip();
        Self {
            height_m,
            leaves,
            values,
        }
    }

    /// The share that one sees of somebody there: 1 where nothing is known to hide, such as in leaves that are newer than the view.
    #[must_use]
    pub fn of(&self, spot: &Spot) -> f64 {
        let seen = self.leaves.binary_search(&spot.leaf).map(|at| &self.values[at]);
        let Some(seen) = seen.ok().filter(|seen| seen.square == spot.square) else {
            return 1.0;
        };
        let within = |height_m: f64| seen.heights[0] <= height_m && height_m <= seen.heights[1];
        if within(spot.height_m) && within(self.height_m) {
            seen.share
        } else {
            1.0
        }
    }

    /// How many cells were looked at.
    #[must_use]
    pub fn cells(&self) -> usize {
        self.values.len()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use belvedere_scene::{
        Bounds, ObjectId,
        foliage::{Foliage, FoliageSquare, Slab},
    };
    use proptest::prelude::*;

    use super::*;

    const GROUND: Bounds = Bounds {
        min: [0.0; 3],
        max: [128.0, 3.0, 128.0],
    };

    fn crowd(people: &[[f64; 2]]) -> Crowd {
        let mut crowd = Crowd::new(&GROUND);
        stand(&mut crowd, people);
        crowd
    }

    fn stand(crowd: &mut Crowd, people: &[[f64; 2]]) {
        for (object, [x, z]) in (0..).map(ObjectId).zip(people) {
            crowd.put(object, [*x, 1.5, *z], 0.4);
        }
    }

    /// Rows of people, shoulder to shoulder.
    fn rows(from_x: f64, rows: u32) -> Vec<[f64; 2]> {
        let at = |i: u32| [from_x + f64::from(i / 60) * 1.5, 40.0 + f64::from(i % 60) * 0.8];
        (0..60 * rows).map(at).collect()
    }

    #[test]
    fn the_deeper_in_a_crowd_the_less_is_seen_and_above_it_all() {
        let mut crowd = crowd(&rows(40.0, 20));
        let view = View::from(&mut crowd, [20.0, 1.5, 64.0], 200.0);
        let values: Vec<_> = [40.0, 50.0, 60.0, 68.0]
            .map(|x| view.of(&crowd.spot([x, 1.5, 64.0])))
            .into();
        assert!(
            values[0] > 0.9 && values[1] < 0.5 && values[2] < 0.1 && values[3] < 0.1,
            "{values:?}"
        );
        assert_eq!(view.of(&crowd.spot([60.0, 9.0, 64.0])), 1.0, "on a balcony");
        let above = View::from(&mut crowd, [20.0, 9.0, 64.0], 200.0);
        assert_eq!(above.of(&crowd.spot([68.0, 1.5, 64.0])), 1.0, "from a balcony");
        assert_eq!(view.of(&crowd.spot([20.0, 1.5, 100.0])), 1.0, "beside it");
    }

    /// Squares of 4 m that are so solid up to 3 m.
    fn hedge(at: &[[i64; 2]], solidity: f64) -> Foliage {
        let slab = Slab {
            from_m: 0.0,
            to_m: 3.0,
            solidity,
        };
        let at: BTreeSet<_> = at.iter().copied().collect();
        let squares = at.into_iter().map(|at| FoliageSquare { at, slabs: vec![slab] });
        Foliage {
            side_m: 4.0,
            squares: squares.collect(),
        }
    }

    #[test]
    fn a_hedge_hides_a_share_of_who_is_behind_it_and_of_nobody_else() {
        let mut crowd = crowd(&[]);
        crowd.plant(&hedge(&(0..32).map(|z| [10, z]).collect::<Vec<_>>(), 0.5));
        let view = View::from(&mut crowd, [20.0, 1.5, 64.0], 200.0);
        let seen = [(60.0, 1.5), (30.0, 1.5), (60.0, 4.0)].map(|(x, y)| view.of(&crowd.spot([x, y, 64.0])));
        assert!((0.3..0.8).contains(&seen[0]), "{seen:?}");
        assert_eq!(seen[1..], [1.0; 2], "before it and above");
        let above = View::from(&mut crowd, [20.0, 4.0, 64.0], 200.0);
        assert_eq!(above.of(&crowd.spot([60.0, 1.5, 64.0])), 1.0, "over it");
        let people: Vec<_> = (0..40).map(|z| [42.0, 44.0 + f64::from(z)]).collect();
        stand(&mut crowd, &people);
        let both = View::from(&mut crowd, [20.0, 1.5, 64.0], 200.0).of(&crowd.spot([60.0, 1.5, 64.0]));
        assert!(both < seen[0], "people in it hide more: {both}");
    }

    #[test]
    fn who_moves_aside_uncovers_who_is_behind() {
        let mut crowd = crowd(&rows(40.0, 8));
        let eye = [20.0, 1.5, 64.0];
        let behind = |crowd: &mut Crowd| View::from(crowd, eye, 200.0).of(&crowd.spot([60.0, 1.5, 64.0]));
        let before = behind(&mut crowd);
        (0..60 * 8).map(ObjectId).for_each(|object| crowd.take(object));
        assert!(before < 0.7 && behind(&mut crowd) == 1.0, "{before}");
    }

    #[test]
    fn a_view_says_nothing_of_leaves_that_are_newer() {
        let mut crowd = crowd(&rows(40.0, 20));
        let view = View::from(&mut crowd, [20.0, 1.5, 64.0], 200.0);
        (0..60 * 20).map(ObjectId).for_each(|object| crowd.take(object));
        // The numbers of the leaves that are gone are used again, in front of the observer.
        stand(&mut crowd, &rows(2.0, 8));
        for [x, z] in rows(2.0, 8) {
            let seen = view.of(&crowd.spot([x, 1.5, z]));
            assert!(seen == 1.0, "{seen} at {x}, {z}");
        }
    }

    /// The paper's rule with the share of a cell in a shadow counted by points, and shadows of all occluders, whenever they are
    /// met.
    fn by_the_letter(crowd: &Crowd, view: &View, eye: [f64; 2], target: Leaf) -> f64 {
        const SIDE: u32 = 24;
        let square = crowd.nodes[target].square;
        let mut value = 1.0;
        for leaf in view.leaves.iter().filter(|leaf| **leaf != target) {
            let node = &crowd.nodes[*leaf];
            let Some(hiding) = node.hides_at(1.5) else { continue };
            let Some(shadow) = Shadow::of(eye, &node.square, hiding.solidity, hiding.heights) else {
                continue;
            };
            let step_m = square.side_m / f64::from(SIDE);
            let point = |i: u32| {
                [0, 1].map(|a| square.min[a] + step_m * (0.5 + f64::from(if a == 0 { i % SIDE } else { i / SIDE })))
            };
            let tiny = |p: [f64; 2]| super::super::Square { min: p, side_m: 1e-3 };
            let inside = (0..SIDE * SIDE)
                .filter(|i| shadow.share(&tiny(point(*i))) > 0.5)
                .count();
            value *= 1.0 - f64::from(inside as u32) / f64::from(SIDE * SIDE) * hiding.solidity;
        }
        value
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 16, ..ProptestConfig::default() })]

        #[test]
        fn every_value_is_a_share_and_a_crowd_that_goes_leaves_everything_visible(
            people in prop::collection::vec([0.0..128.0f64, 0.0..128.0f64], 0..150),
            eye in [0.0..128.0f64, 0.0..128.0f64],
        ) {
            let mut crowd = crowd(&people);
            let view = View::from(&mut crowd, [eye[0], 1.5, eye[1]], 1e9);
            for (leaf, Value { share, .. }) in view.leaves.iter().zip(&view.values) {
                prop_assert!((0.0..=1.0).contains(share), "{leaf}: {share}");
            }
            let own = view.leaves.binary_search(&crowd.leaf_at(eye));
            let share = own.map(|own| view.values[own].share);
            prop_assert_eq!(share, Ok(1.0), "nothing hides the observer's own cell");
        }

        #[test]
        fn nothing_is_hidden_that_the_rule_to_the_letter_shows(
            people in prop::collection::vec([40.0..80.0f64, 40.0..80.0f64], 60..120),
            leaves in prop::collection::vec([8..24i64, 8..24i64], 0..60),
            eye in [0.0..30.0f64, 0.0..128.0f64],
        ) {
            const LAX: f64 = 0.1;
            let mut crowd = Crowd::new(&GROUND);
            crowd.plant(&hedge(&leaves, 0.3));
            stand(&mut crowd, &people);
            let view = View::from(&mut crowd, [eye[0], 1.5, eye[1]], 1e9);
            for (leaf, Value { share, .. }) in view.leaves.iter().zip(&view.values) {
                let least = by_the_letter(&crowd, &view, eye, *leaf);
                prop_assert!(*share >= least - LAX, "{leaf}: {share} where the rule says {least}");
            }
        }
    }
}
