//! Where may the vertices of a published level stand?
//!
//! On a *lattice*: multiples of a power of two in model space, counted from the model's origin. Halves of a mesh that
//! was cut share their lattice, so a vertex on the cut moves the same way in both and no crack opens; lattices of
//! different steps nest. The step of level 0 is the longest side of the model's box, or of the largest part's, over
//! 2¹⁵ to 2¹⁶, so that 16 bits hold a coordinate and rounding moves it by at most 2⁻¹⁶ of that side; but nowhere in
//! the world is the step longer than [`LONGEST_STEP_M`]. What is too long for both has floats on the same lattice.
//! Coarser levels stand on coarser lattices, in proportion to their error.

use std::collections::BTreeMap;

use belvedere_scene::Bounds;

use crate::source::{Primitive, SourceObject, SourceScene};

/// Rounding moves no coordinate of a level 0 by more than half of this, in metres of the world.
pub const LONGEST_STEP_M: f64 = 1.0 / 1024.0;
/// The longest side of a model has at most so many steps, one less at either end than 16 bits can count.
const MOST_STEPS: f64 = 65_534.0;
/// Rounding adds to the error of a coarser level at most the diagonal of half a step: about 5 % of it.
const STEPS_AN_ERROR: f64 = 16.0;
/// The largest whole number of a filtered float: 24 bits, sign included.
const MOST_MANTISSA: f64 = ((1 << 23) - 1) as f64;
/// Steps are no smaller or larger than two to the power of this: f32 ends soon after.
const FURTHEST_EXPONENT: f64 = 100.0;

/// Multiples of a power of two.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Lattice {
    exponent: i32,
}

impl Lattice {
    /// The lattice of a level 0 whose longest side is given in model units; `metres` is how many of them one is, in
    /// the largest instance.
    #[must_use]
    pub fn of_size(longest_side: f64, metres: f64) -> Self {
        let by_size = (longest_side / MOST_STEPS).log2().ceil();
        let by_world = (LONGEST_STEP_M / metres).log2().floor();
        Self::of_exponent(if by_size.is_finite() {
            by_size.min(by_world)
        } else {
            by_world
        })
    }

    /// The lattice of a level with an error, in model units: this one or a coarser one.
    #[must_use]
    pub fn of_error(self, geometric_error: f64) -> Self {
        self.max(Self::of_exponent((geometric_error / STEPS_AN_ERROR).log2().floor()))
    }

    fn of_exponent(exponent: f64) -> Self {
        // A NaN, from a model that stands nowhere, becomes 0.
        Self {
            exponent: exponent.clamp(-FURTHEST_EXPONENT, FURTHEST_EXPONENT) as i32,
        }
    }

    /// The lattice of a level 0 that is in no scene; its units are metres.
    #[must_use]
    pub fn alone(primitives: &[Primitive]) -> Self {
        Self::of_size(longest_side(primitives), 1.0)
    }

    /// The finest lattice on which floats of 24 bits, sign included, reach as far as these primitives: no coordinate moves by more than
    /// 2⁻²³ of the largest.
    #[must_use]
    pub fn finest(primitives: &[Primitive]) -> Self {
        let coordinates = primitives.iter().flat_map(|p| &p.positions).flatten();
        let furthest = coordinates.fold(0.0f64, |far, x| far.max(f64::from(x.abs())));
        Self::of_exponent(bits_beyond_a_float(furthest))
    }

    /// The lattices of all models' level 0.
    #[must_use]
    pub fn of_models(scene: &SourceScene) -> Vec<Self> {
        let mut sides: Vec<f64> = scene
            .models
            .iter()
            .map(|model| longest_side(&model.primitives))
            .collect();
        let mut metres = vec![0.0f64; scene.models.len()];
        // Parts of one mesh stand in one place under one name.
        let mut parts: BTreeMap<_, Vec<usize>> = BTreeMap::new();
        for object in &scene.objects {
            let scale = &mut metres[object.model];
            *scale = scale.max(object.largest_scale());
            parts.entry(place(object)).or_default().push(object.model);
        }
        let largest = |models: &Vec<usize>| models.iter().map(|m| sides[*m]).fold(0.0, f64::max);
        let shared: Vec<(Vec<usize>, f64)> = parts.into_values().map(|m| (m.clone(), largest(&m))).collect();
        for (models, side) in shared {
            for model in models {
                sides[model] = sides[model].max(side);
            }
        }
        sides
            .into_iter()
            .zip(metres)
            .map(|(s, m)| Self::of_size(s, m))
            .collect()
    }

    /// The distance between neighbours along an axis, in model units; exact.
    #[must_use]
    pub fn step(self) -> f64 {
        f64::from_bits(((1023 + i64::from(self.exponent)) as u64) << 52)
    }

    /// Moves vertices to where a GLB on this lattice has them; tells how far the one moves that moves farthest, in model units.
    pub fn round(self, primitives: &mut [Primitive]) -> f64 {
        let frame = Frame::of(super::drawn(primitives), self);
        let moved = frame.rounding(super::drawn(primitives));
        for position in primitives.iter_mut().flat_map(|p| &mut p.positions) {
            // Exact where anything is drawn: an f32 has more bits than what is left of it.
            *position = frame.nearest(*position).map(|x| x as f32);
        }
        moved
    }

    /// The step is two to the power of this.
    pub(super) fn exponent(self) -> i32 {
        self.exponent
    }

    /// The nearest multiple, counted in steps.
    fn steps(self, coordinate: f32) -> f64 {
        (f64::from(coordinate) / self.step()).round_ties_even()
    }
}

/// How the positions of a level are written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Frame {
    /// As u16, counted in steps of a lattice from a corner.
    Words { lattice: Lattice, corner: [f64; 3] },
    /// As floats on a lattice.
    Floats { lattice: Lattice },
}

impl Frame {
    /// 16 bits when they reach from one end of the level to the other, else floats of 24 bits, if need be on a coarser
    /// lattice.
    pub(super) fn of<'a>(primitives: impl Iterator<Item = &'a Primitive> + Clone, lattice: Lattice) -> Self {
        let steps = primitives
            .flat_map(|p| &p.positions)
            .map(|p| p.map(|x| lattice.steps(x)));
        let bounds = Bounds::around(steps);
        if (0..3).all(|axis| bounds.max[axis] - bounds.min[axis] <= f64::from(u16::MAX)) {
            let corner = bounds.min;
            return Self::Words { lattice, corner };
        }
        let furthest = bounds
            .min
            .iter()
            .chain(&bounds.max)
            .fold(0.0f64, |far, x| far.max(x.abs()));
        Self::Floats {
            lattice: Lattice::of_exponent(f64::from(lattice.exponent) + excess_bits(furthest)),
        }
    }

    /// A position in steps: from the corner, or from the model's origin.
    pub(super) fn steps(&self, position: [f32; 3]) -> [f64; 3] {
        match self {
            Self::Words { lattice, corner } => std::array::from_fn(|a| lattice.steps(position[a]) - corner[a]),
            Self::Floats { lattice } => position.map(|x| lattice.steps(x)),
        }
    }

    /// Where a position is on the lattice, in model units.
    fn nearest(&self, position: [f32; 3]) -> [f64; 3] {
        let (Self::Words { lattice, .. } | Self::Floats { lattice }) = *self;
        position.map(|x| lattice.steps(x) * lattice.step())
    }

    /// How far the vertex moves that moves farthest, in model units.
    pub(super) fn rounding<'a>(&self, primitives: impl Iterator<Item = &'a Primitive>) -> f64 {
        let moved = |p: &[f32; 3]| -> f64 {
            let to = self.nearest(*p);
            (0..3).map(|axis| (to[axis] - f64::from(p[axis])).powi(2)).sum()
        };
        let positions = primitives.flat_map(|p| &p.positions);
        positions.map(moved).fold(0.0, f64::max).sqrt()
    }
}

/// By how many bits a whole number is too long for the 24 bits, sign included, of a filtered float.
pub(super) fn excess_bits(furthest: f64) -> f64 {
    bits_beyond_a_float(furthest).max(0.0)
}

/// Negative where there is room for more.
fn bits_beyond_a_float(furthest: f64) -> f64 {
    (furthest / MOST_MANTISSA).log2().ceil()
}

fn place(object: &SourceObject) -> (&str, [u64; 16]) {
    let transform = object.world_from_object.to_cols_array();
    (&object.source_node, transform.map(f64::to_bits))
}

fn longest_side(primitives: &[Primitive]) -> f64 {
    let positions = primitives.iter().flat_map(|p| &p.positions);
    let bounds = Bounds::around(positions.map(|p| p.map(f64::from)));
    bounds.size_m().into_iter().fold(0.0, f64::max)
}
