//! Where is the turtle? A frame in space: three axes and an origin.

use super::arithmetic::sin_cos;
use crate::Bounds;

/// An affine map: columns x, y, z and the origin. Applied as one product and two sums for each coordinate, in this order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Affine {
    /// What the axes become.
    pub axes: [[f64; 3]; 3],
    /// What the origin becomes.
    pub origin: [f64; 3],
}

impl Affine {
    /// Leaves everything where it is.
    pub const IDENTITY: Self = Self {
        axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        origin: [0.0; 3],
    };

    /// Axes x, y and z and the origin, one after the other.
    pub(super) fn numbers(&self) -> [f64; 12] {
        let ([x, y, z], origin) = (self.axes, self.origin);
        let all = [x, y, z, origin];
        std::array::from_fn(|i| all[i / 3][i % 3])
    }

    /// The map of these [numbers](Affine::numbers).
    pub(super) fn of_numbers([a, b, c, d, e, f, g, h, i, x, y, z]: [f64; 12]) -> Self {
        Self {
            axes: [[a, b, c], [d, e, f], [g, h, i]],
            origin: [x, y, z],
        }
    }

    /// Where a direction leads.
    #[inline]
    #[must_use]
    pub fn direction(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let [a, b, c] = &self.axes;
        let along = |i: usize| a[i] * x + b[i] * y + c[i] * z;
        [along(0), along(1), along(2)]
    }

    /// Where a point comes to lie.
    #[inline]
    #[must_use]
    pub fn point(&self, p: [f64; 3]) -> [f64; 3] {
        let ([x, y, z], [dx, dy, dz]) = (self.direction(p), self.origin);
        [x + dx, y + dy, z + dz]
    }

    /// The box around the eight corners of a box. Each coordinate is a sum of one term for each axis, and rounding keeps
    /// order: so the least and the most of each term give the least and the most of all corners, to the bit.
    #[inline]
    #[must_use]
    pub fn bounds(&self, of: &Bounds) -> Bounds {
        if of.is_empty() {
            return Bounds::EMPTY;
        }
        let mut bounds = Bounds::EMPTY;
        for i in 0..3 {
            let end = |least: bool| {
                let term = |axis: usize| {
                    let factor = self.axes[axis][i];
                    let from_min = (factor >= 0.0) == least;
                    factor * if from_min { of.min[axis] } else { of.max[axis] }
                };
                term(0) + term(1) + term(2) + self.origin[i]
            };
            (bounds.min[i], bounds.max[i]) = (end(true), end(false));
        }
        bounds
    }

    /// First `inner`, then this.
    #[must_use]
    pub fn after(&self, inner: &Self) -> Self {
        Self {
            axes: [
                self.direction(inner.axes[0]),
                self.direction(inner.axes[1]),
                self.direction(inner.axes[2]),
            ],
            origin: self.point(inner.origin),
        }
    }

    /// Moved along its own axes.
    #[must_use]
    pub fn moved(&self, by: [f64; 3]) -> Self {
        Self {
            axes: self.axes,
            origin: self.point(by),
        }
    }

    /// Stretched along its own axes.
    #[must_use]
    pub fn scaled(&self, by: [f64; 3]) -> Self {
        Self {
            axes: std::array::from_fn(|a| self.axes[a].map(|v| v * by[a])),
            origin: self.origin,
        }
    }

    /// Turned about its own axis 0, 1 or 2: counter-clockwise for one who looks against it.
    #[must_use]
    pub fn turned(&self, axis: usize, degrees: f64) -> Self {
        let (sin, cos) = sin_cos(degrees);
        let (from, to) = ((axis + 1) % 3, (axis + 2) % 3);
        let (u, v) = (self.axes[from], self.axes[to]);
        let mut axes = self.axes;
        for i in 0..3 {
            axes[from][i] = u[i] * cos + v[i] * sin;
            axes[to][i] = v[i] * cos - u[i] * sin;
        }
        Self {
            axes,
            origin: self.origin,
        }
    }

    /// Whether it turns left into right.
    #[inline]
    #[must_use]
    pub fn mirrors(&self) -> bool {
        dot(self.axes[0], cross(self.axes[1], self.axes[2])) < 0.0
    }

    /// The map of normals, up to their length: outward stays outward.
    #[inline]
    #[must_use]
    pub fn normals(&self) -> Self {
        let [x, y, z] = self.axes;
        let sign = if self.mirrors() { -1.0 } else { 1.0 };
        let signed = |[x, y, z]: [f64; 3]| [x * sign, y * sign, z * sign];
        Self {
            axes: [signed(cross(y, z)), signed(cross(z, x)), signed(cross(x, y))],
            origin: [0.0; 3],
        }
    }

    /// Sixteen numbers by columns, as glTF writes matrices.
    #[must_use]
    pub fn columns(&self) -> [f64; 16] {
        let ([[a, b, c], [d, e, f], [g, h, i]], [x, y, z]) = (self.axes, self.origin);
        [a, b, c, 0.0, d, e, f, 0.0, g, h, i, 0.0, x, y, z, 1.0]
    }
}

/// The scalar product.
#[inline(always)]
pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The vector product.
#[inline(always)]
pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Of length one; upright when it has no direction.
#[inline]
pub(super) fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = dot(v, v).sqrt();
    if length > 0.0 {
        [v[0] / length, v[1] / length, v[2] / length]
    } else {
        [0.0, 1.0, 0.0]
    }
}
