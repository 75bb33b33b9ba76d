//! A box along the axes.

use glam::DVec3;

/// A box.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Block {
    pub(crate) min: DVec3,
    pub(crate) max: DVec3,
}

impl Block {
    pub(crate) fn around(points: impl Iterator<Item = DVec3>) -> Self {
        let none = Self {
            min: DVec3::INFINITY,
            max: DVec3::NEG_INFINITY,
        };
        points.fold(none, |all, point| Self {
            min: all.min.min(point),
            max: all.max.max(point),
        })
    }

    pub(crate) fn at(point: DVec3) -> Self {
        Self { min: point, max: point }
    }

    pub(crate) fn union(&self, other: &Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    pub(crate) fn meets(&self, other: &Self) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    /// Whether a straight way meets it.
    pub(crate) fn is_passed(&self, from: DVec3, way: DVec3) -> bool {
        let (a, b) = ((self.min - from) / way, (self.max - from) / way);
        // Where the way runs along a side, 0 / 0 is no number, which `min` and `max` leave out.
        let (mut enter, mut leave) = (0.0f64, 1.0f64);
        for axis in 0..3 {
            enter = enter.max(a[axis].min(b[axis]));
            leave = leave.min(a[axis].max(b[axis]));
        }
        enter <= leave
    }

    pub(crate) fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| {
            DVec3::new(
                if i & 1 == 0 { self.min.x } else { self.max.x },
                if i & 2 == 0 { self.min.y } else { self.max.y },
                if i & 4 == 0 { self.min.z } else { self.max.z },
            )
        })
    }

    pub(crate) fn middle(&self) -> DVec3 {
        self.min.midpoint(self.max)
    }

    pub(crate) fn longest_m(&self) -> f64 {
        (self.max - self.min).max_element()
    }

    pub(crate) fn halves(&self) -> [Self; 2] {
        let axis = (self.max - self.min).max_position();
        let mut halves = [*self, *self];
        halves[0].max[axis] = self.middle()[axis];
        halves[1].min[axis] = self.middle()[axis];
        halves
    }
}
