//! How far is a point from a set of planes? Sums of squared distances, weighted by area.
//!
//! Garland & Heckbert, *Surface simplification using quadric error metrics* (1997).

use glam::DVec3;

/// A symmetric 4 × 4 matrix, its upper half by rows, and the sum of the weights.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Quadric {
    m: [f64; 10],
    pub(crate) weight: f64,
}

impl Quadric {
    /// Of the plane through a point with a unit normal.
    pub(crate) fn plane(normal: DVec3, point: DVec3, weight: f64) -> Self {
        let ([a, b, c], d) = (normal.to_array(), -normal.dot(point));
        let m = [a * a, a * b, a * c, a * d, b * b, b * c, b * d, c * c, c * d, d * d];
        Self {
            m: m.map(|x| x * weight),
            weight,
        }
    }

    /// Of a point: squared distances to it.
    pub(crate) fn point(point: DVec3, weight: f64) -> Self {
        let [x, y, z] = (-point).to_array();
        let m = [1.0, 0.0, 0.0, x, 1.0, 0.0, y, 1.0, z, point.length_squared()];
        Self {
            m: m.map(|x| x * weight),
            weight,
        }
    }

    pub(crate) fn add(&mut self, other: &Self) {
        for (own, other) in self.m.iter_mut().zip(&other.m) {
            *own += other;
        }
        self.weight += other.weight;
    }

    /// The weighted sum of squared distances.
    pub(crate) fn at(&self, point: DVec3) -> f64 {
        let [x, y, z] = point.to_array();
        let m = &self.m;
        let sum = x * (m[0] * x + 2.0 * (m[1] * y + m[2] * z + m[3]))
            + y * (m[4] * y + 2.0 * (m[5] * z + m[6]))
            + z * (m[7] * z + 2.0 * m[8])
            + m[9];
        sum.max(0.0)
    }
}
