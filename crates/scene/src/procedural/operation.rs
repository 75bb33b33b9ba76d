//! What do operators and functions of numbers give? What is asked of them is checked where they are visited, for the place.

use super::arithmetic::{atan2, floor, power, sin_cos};
use super::random::{fraction, noise, noise_of_each, step};

/// Beyond this a whole number is no longer told from the next in every operation.
pub(super) const MAX_NOISE: f64 = 1e9;
/// Most terms of fractal noise.
pub(super) const MAX_OCTAVES: f64 = 16.0;
/// Largest power, either way.
pub(super) const MAX_POWER: f64 = 64.0;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Operator {
    Add,
    Subtract,
    Multiply,
    Divide,
    Equal,
    Unequal,
    Less,
    AtMost,
    More,
    AtLeast,
}

/// Functions of the language.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum BuiltIn {
    Abs,
    Atan2,
    Ceil,
    Clamp,
    Cos,
    Count,
    Floor,
    Fractal,
    Max,
    Min,
    Mix,
    Mod,
    Noise,
    Power,
    Random,
    Round,
    Sin,
    Sqrt,
}

impl BuiltIn {
    /// Name, least count of arguments and the names by which documentation calls them.
    pub(super) const ALL: [(&'static str, Self, usize, &'static [&'static str]); 18] = [
        ("abs", Self::Abs, 1, &["x"]),
        ("atan2", Self::Atan2, 2, &["y", "x"]),
        ("ceil", Self::Ceil, 1, &["x"]),
        ("clamp", Self::Clamp, 3, &["x", "least", "most"]),
        ("cos", Self::Cos, 1, &["degrees"]),
        ("count", Self::Count, 1, &["list"]),
        ("floor", Self::Floor, 1, &["x"]),
        ("fractal", Self::Fractal, 3, &["x", "z", "octaves"]),
        ("max", Self::Max, 2, &["a", "b"]),
        ("min", Self::Min, 2, &["a", "b"]),
        ("mix", Self::Mix, 3, &["a", "b", "part"]),
        ("mod", Self::Mod, 2, &["a", "b"]),
        ("noise", Self::Noise, 2, &["x", "z"]),
        ("power", Self::Power, 2, &["x", "whole"]),
        ("random", Self::Random, 0, &["a", "b"]),
        ("round", Self::Round, 1, &["x"]),
        ("sin", Self::Sin, 1, &["degrees"]),
        ("sqrt", Self::Sqrt, 1, &["x"]),
    ];
}

/// The random number of a place, from 0 up to 1.
pub(super) fn random(path: u32, site: u32) -> f64 {
    fraction(step(path, site))
}

/// How far from 0 coordinates of so many octaves may be: those of the last are twice as large for each before it.
pub(super) fn farthest(octaves: u32) -> f64 {
    (1..octaves).fold(MAX_NOISE, |most, _| 0.5 * most)
}

/// Octaves of noise, each half as high and half as wide as the one before.
///
/// # Errors
/// The axis of the first coordinate that is farther than [`farthest`].
pub(super) fn fractal(seed: u32, [mut x, mut z]: [f64; 2], octaves: u32) -> Result<f64, usize> {
    let most = farthest(octaves);
    if let Some(axis) = [x, z].iter().position(|size| size.abs() > most) {
        return Err(axis);
    }
    let (mut weight, mut sum) = (1.0, 0.0);
    for octave in 0..octaves {
        sum += weight * noise(seed.wrapping_add(octave), x, z);
        (x, z, weight) = (2.0 * x, 2.0 * z, 0.5 * weight);
    }
    Ok(sum)
}

/// The same at several places side by side; nothing when a coordinate of one of them is too large.
#[inline(always)]
pub(super) fn fractal_of_each<const N: usize>(seed: u32, [x, z]: [&[f64; N]; 2], octaves: u32) -> Option<[f64; N]> {
    let (mut x, mut z) = (*x, *z);
    let (mut weight, mut sums) = (1.0, [0.0; N]);
    for octave in 0..octaves {
        let mut is_far = false;
        for i in 0..N {
            is_far |= (x[i].abs() > MAX_NOISE) | (z[i].abs() > MAX_NOISE);
        }
        if is_far {
            return None;
        }
        let noise = noise_of_each(seed.wrapping_add(octave), &x, &z);
        for i in 0..N {
            sums[i] += weight * noise[i];
            (x[i], z[i]) = (2.0 * x[i], 2.0 * z[i]);
        }
        weight *= 0.5;
    }
    Some(sums)
}

pub(super) fn truth(holds: bool) -> f64 {
    if holds { 1.0 } else { 0.0 }
}

impl Operator {
    /// Of two numbers; not finite when they have no such result.
    pub(super) fn of(self, a: f64, b: f64) -> f64 {
        match self {
            Self::Add => a + b,
            Self::Subtract => a - b,
            Self::Multiply => a * b,
            Self::Divide => a / b,
            Self::Equal => truth(a == b),
            Self::Unequal => truth(a != b),
            Self::Less => truth(a < b),
            Self::AtMost => truth(a <= b),
            Self::More => truth(a > b),
            Self::AtLeast => truth(a >= b),
        }
    }
}

impl BuiltIn {
    /// Of those that need nothing but numbers; not finite when they have no such result.
    pub(super) fn of(self, a: f64, b: f64, c: f64) -> f64 {
        match self {
            Self::Abs => a.abs(),
            Self::Atan2 => atan2(a, b),
            Self::Ceil => -floor(-a),
            Self::Clamp if a < b => b,
            Self::Clamp if a > c => c,
            Self::Clamp => a,
            Self::Cos => sin_cos(a).1,
            Self::Floor => floor(a),
            Self::Max => {
                if a > b {
                    a
                } else {
                    b
                }
            }
            Self::Min => {
                if a < b {
                    a
                } else {
                    b
                }
            }
            Self::Mod => a - b * floor(a / b),
            Self::Power => power(a, floor(b) as i32),
            Self::Round => floor(a + 0.5),
            Self::Sin => sin_cos(a).0,
            Self::Sqrt => a.sqrt(),
            Self::Count | Self::Fractal | Self::Mix | Self::Noise | Self::Random => {
                unreachable!("they need more than numbers")
            }
        }
    }
}
