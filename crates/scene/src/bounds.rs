//! Where does something stand? Axis-aligned boxes in world space, metres, f64 so that worlds far from the origin keep
//! their millimetres.

use serde::{Deserialize, Serialize};

/// An axis-aligned box. [`Bounds::EMPTY`] holds nothing and is the identity of [`Bounds::union`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, bincode::Encode, bincode::Decode)]
pub struct Bounds {
    /// The corner with the smallest coordinates.
    pub min: [f64; 3],
    /// The corner with the largest coordinates.
    pub max: [f64; 3],
}

impl Bounds {
    /// Holds nothing.
    pub const EMPTY: Self = Self {
        min: [f64::INFINITY; 3],
        max: [f64::NEG_INFINITY; 3],
    };

    /// The smallest box around some points.
    pub fn around(points: impl IntoIterator<Item = [f64; 3]>) -> Self {
        points
            .into_iter()
            .fold(Self::EMPTY, |bounds, p| bounds.union(&Self { min: p, max: p }))
    }

    /// The smallest box around it whose corners are in single precision: it holds what is in it when that is rounded so, too.
    #[must_use]
    pub fn in_single(&self) -> Self {
        let below = |along: f64| {
            let single = along as f32;
            f64::from(if f64::from(single) > along {
                single.next_down()
            } else {
                single
            })
        };
        Self {
            min: self.min.map(below),
            max: self.max.map(|along| -below(-along)),
        }
    }

    /// Whether there is no point in it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        (0..3).any(|a| self.min[a] > self.max[a])
    }

    /// The smallest box around both.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        let (mut min, mut max) = (self.min, self.max);
        for i in 0..3 {
            min[i] = min[i].min(other.min[i]);
            max[i] = max[i].max(other.max[i]);
        }
        Self { min, max }
    }

    /// Whether the point lies inside or on the surface.
    #[must_use]
    pub fn contains(&self, point: [f64; 3]) -> bool {
        (0..3).all(|a| self.min[a] <= point[a] && point[a] <= self.max[a])
    }

    /// Whether the boxes share a point; touching counts.
    #[must_use]
    pub fn intersects(&self, other: &Self) -> bool {
        (0..3).all(|a| self.min[a] <= other.max[a] && other.min[a] <= self.max[a])
    }

    /// Distance from a point to the box in metres, zero inside.
    #[must_use]
    pub fn distance_m(&self, point: [f64; 3]) -> f64 {
        (0..3)
            .map(|a| (self.min[a] - point[a]).max(point[a] - self.max[a]).max(0.0))
            .fold(0.0f64, f64::hypot)
    }

    /// The middle.
    #[must_use]
    pub fn center(&self) -> [f64; 3] {
        std::array::from_fn(|a| 0.5 * (self.min[a] + self.max[a]))
    }

    /// Edge lengths in metres, zero when empty.
    #[must_use]
    pub fn size_m(&self) -> [f64; 3] {
        std::array::from_fn(|a| (self.max[a] - self.min[a]).max(0.0))
    }

    /// Length of the diagonal in metres, zero when empty.
    #[must_use]
    pub fn diagonal_m(&self) -> f64 {
        self.size_m().into_iter().fold(0.0f64, f64::hypot)
    }

    /// The eight corners; bit 0 of the index picks the maximum of x, bit 1 of y, bit 2 of z.
    #[must_use]
    pub fn corners(&self) -> [[f64; 3]; 8] {
        std::array::from_fn(|i| std::array::from_fn(|a| if i >> a & 1 == 1 { self.max[a] } else { self.min[a] }))
    }
}
