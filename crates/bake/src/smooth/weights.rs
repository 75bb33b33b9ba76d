//! Which weights predict this mesh's vertices best? Least absolute residuals, for each kind of neighbourhood.
//!
//! Iteratively reweighted least squares (Lawson 1961): what is far off counts less in the next round, because the
//! bits of a residual grow with its logarithm only.

use belvedere_scene::smooth::geometry::{FEATURES, HOODS, Hood, USUAL_WEIGHTS, Weights};

/// What was seen of one new vertex: along each axis, the features and the truth, in steps of the lattice.
#[derive(Debug, Clone, Copy)]
struct Sample {
    features: [[f32; 3]; FEATURES],
    truth: [f32; 3],
}

/// Gathers samples.
#[derive(Debug)]
pub(super) struct Fit {
    samples: [Vec<Sample>; HOODS],
    seen: [usize; HOODS],
}

/// So many samples of one kind suffice.
const MOST_SAMPLES: usize = 4000;
/// Kinds with fewer samples keep the usual weights.
const LEAST_SAMPLES: usize = 24;
const ROUNDS: usize = 6;
/// Pulls weights towards 0 where samples say nothing.
const RIDGE: f64 = 1e-3;

impl Fit {
    pub(super) fn new() -> Self {
        Self {
            samples: Default::default(),
            seen: [0; HOODS],
        }
    }

    /// Takes in where a vertex is, from the one it was split from. Late vertices replace early ones: they are the most.
    pub(super) fn add(&mut self, hood: &Hood, truth: [i32; 3]) {
        let sample = Sample {
            features: hood.features.map(|f| f.map(|x| x as f32 / 16.0)),
            truth: truth.map(|x| x as f32),
        };
        let seen = &mut self.seen[hood.kind];
        let samples = &mut self.samples[hood.kind];
        if samples.len() < MOST_SAMPLES {
            samples.push(sample);
        } else {
            // A step that shares no divisor with the size spreads them evenly.
            samples[*seen * 1597 % MOST_SAMPLES] = sample;
        }
        *seen += 1;
    }

    pub(super) fn weights(&self) -> Weights {
        let mut weights = USUAL_WEIGHTS;
        for (weights, samples) in weights.iter_mut().zip(&self.samples) {
            if samples.len() >= LEAST_SAMPLES {
                *weights = fit(samples).map(|x| (x * 64.0).round().clamp(-127.0, 127.0) as i8);
            }
        }
        weights
    }
}

fn fit(samples: &[Sample]) -> [f64; FEATURES] {
    let mut weights = [0.0; FEATURES];
    for round in 0..ROUNDS {
        let mut matrix = [[0.0; FEATURES]; FEATURES];
        let mut right = [0.0; FEATURES];
        for sample in samples {
            let reach: f64 = sample.features.iter().flatten().map(|x| f64::from(x.abs())).sum();
            for axis in 0..3 {
                let features = sample.features.map(|f| f64::from(f[axis]));
                let truth = f64::from(sample.truth[axis]);
                let said: f64 = (0..FEATURES).map(|i| weights[i] * features[i]).sum();
                let counts = if round == 0 {
                    1.0 / (1.0 + reach * reach)
                } else {
                    let off = truth - said;
                    1.0 / (off * off + 0.25 + 1e-4 * reach * reach)
                };
                for i in 0..FEATURES {
                    let counted = counts * features[i];
                    right[i] += counted * truth;
                    for j in i..FEATURES {
                        matrix[i][j] += counted * features[j];
                    }
                }
            }
        }
        let half = matrix;
        matrix = std::array::from_fn(|i: usize| std::array::from_fn(|j: usize| half[i.min(j)][i.max(j)]));
        let ridge = RIDGE * (0..FEATURES).map(|i| matrix[i][i]).sum::<f64>() / FEATURES as f64 + 1e-9;
        for (i, row) in matrix.iter_mut().enumerate() {
            row[i] += ridge;
        }
        weights = solve(matrix, right);
    }
    weights
}

/// Gaussian elimination; the matrix is symmetric and positive definite.
fn solve(mut matrix: [[f64; FEATURES]; FEATURES], mut right: [f64; FEATURES]) -> [f64; FEATURES] {
    for i in 0..FEATURES {
        let pivot = matrix[i];
        for row in i + 1..FEATURES {
            let factor = matrix[row][i] / pivot[i];
            for (own, pivot) in matrix[row].iter_mut().zip(&pivot).skip(i) {
                *own -= factor * pivot;
            }
            right[row] -= factor * right[i];
        }
    }
    for i in (0..FEATURES).rev() {
        let known: f64 = (i + 1..FEATURES).map(|j| matrix[i][j] * right[j]).sum();
        right[i] = (right[i] - known) / matrix[i][i];
    }
    right
}
