//! What of a square lies in the shadow of another, seen from a point?
//!
//! The shadow is the wedge between the two lines from the eye that touch the occluder, beyond it. A square counts only where a
//! line along an axis parts it from the occluder and the eye: then all of it that is in the wedge is in the shadow. The share is
//! that of areas (§4).

use super::Square;

/// The shadow of a square.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shadow {
    eye: [f64; 2],
    occluder: Square,
    /// Points on the left and the right line of touch, seen from the eye.
    left: [f64; 2],
    right: [f64; 2],
    pub(super) solidity: f64,
    /// Heights that all of what stands there has.
    pub(super) heights: [f64; 2],
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn from(eye: [f64; 2], point: [f64; 2]) -> [f64; 2] {
    [point[0] - eye[0], point[1] - eye[1]]
}

impl Shadow {
    /// None when the eye is in the square, or on its border: then it hides nothing.
    pub(super) fn of(eye: [f64; 2], square: &Square, solidity: f64, heights: [f64; 2]) -> Option<Self> {
        if square.distance_m(eye) <= 1e-9 * square.side_m {
            return None;
        }
        let corners = square.corners().map(|corner| from(eye, corner));
        let leftmost = |a: [f64; 2], b: [f64; 2]| if cross(a, b) > 0.0 { b } else { a };
        let rightmost = |a: [f64; 2], b: [f64; 2]| if cross(a, b) < 0.0 { b } else { a };
        Some(Self {
            eye,
            occluder: *square,
            left: corners.into_iter().reduce(leftmost)?,
            right: corners.into_iter().reduce(rightmost)?,
            solidity,
            heights,
        })
    }

    /// The share of a square that lies in the wedge.
    pub(super) fn share(&self, square: &Square) -> f64 {
        if !self.is_beyond(square) {
            return 0.0;
        }
        let corners = square.corners().map(|corner| from(self.eye, corner));
        // Most squares lie wholly beyond one of the lines, or between them.
        let inside = [
            corners.map(|corner| cross(self.right, corner)),
            corners.map(|corner| cross(corner, self.left)),
        ];
        if inside.iter().any(|of_line| of_line.iter().all(|depth| *depth <= 0.0)) {
            return 0.0;
        }
        if inside.iter().flatten().all(|depth| *depth >= 0.0) {
            return 1.0;
        }
        let inside = clip(corners.to_vec(), |p| cross(self.right, p));
        let inside = clip(inside, |p| cross(p, self.left));
        (area(&inside) / (square.side_m * square.side_m)).clamp(0.0, 1.0)
    }
}

impl Shadow {
    /// Whether a line along an axis has the occluder and the eye on one side and a square on the other.
    fn is_beyond(&self, square: &Square) -> bool {
        let (occluder, end) = (self.occluder.max(), square.max());
        (0..2).any(|axis| {
            let above = occluder[axis].max(self.eye[axis]) <= square.min[axis];
            let below = self.occluder.min[axis].min(self.eye[axis]) >= end[axis];
            above || below
        })
    }
}

/// The part of a convex polygon where a linear function is not negative.
fn clip(polygon: Vec<[f64; 2]>, height: impl Fn([f64; 2]) -> f64) -> Vec<[f64; 2]> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (at_a, at_b) = (height(*a), height(b));
        if at_a >= 0.0 {
            kept.push(*a);
        }
        if (at_a > 0.0 && at_b < 0.0) || (at_a < 0.0 && at_b > 0.0) {
            let share = at_a / (at_a - at_b);
            kept.push([a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])]);
        }
    }
    kept
}

fn area(polygon: &[[f64; 2]]) -> f64 {
    let twice: f64 = (0..polygon.len())
        .map(|i| cross(polygon[i], polygon[(i + 1) % polygon.len()]))
        .sum();
    0.5 * twice.abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(x: f64, z: f64, side_m: f64) -> Square {
        Square { min: [x, z], side_m }
    }

    fn share(eye: [f64; 2], occluder: &Square, target: &Square) -> f64 {
        let shadow = Shadow::of(eye, occluder, 1.0, [0.0, 1.0]).unwrap();
        shadow.share(target)
    }

    #[test]
    fn a_shadow_covers_what_is_behind_and_nothing_beside() {
        let occluder = square(2.0, -1.0, 2.0);
        assert!((share([0.0, 0.0], &occluder, &square(6.0, -0.5, 1.0)) - 1.0).abs() < 1e-12);
        assert_eq!(share([0.0, 0.0], &occluder, &square(6.0, 4.0, 1.0)), 0.0);
        assert_eq!(
            share([0.0, 0.0], &occluder, &square(-6.0, -0.5, 1.0)),
            0.0,
            "behind the eye"
        );
        // The edge of the shadow is z = x / 2: it halves a square that stands across it point to point.
        let half = share([0.0, 0.0], &square(1.0, -1.0, 1.0), &square(4.0, -0.5, 1.0));
        assert!((half - 0.5).abs() < 1e-12, "{half}");
        assert!(Shadow::of([2.5, 0.0], &occluder, 1.0, [0.0, 1.0]).is_none());
    }
}
