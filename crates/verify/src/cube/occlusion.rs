//! Is a box wholly behind what was drawn?
//!
//! What it may cover is projected to a rectangle on each face; when every pixel there is nearer than the nearest point
//! of the box, nothing in it can change the picture, so it need not be drawn. The rectangle is a pixel wider and the box
//! a little nearer than they are, so rounding never hides anything. Saves time only: the picture is the same.

use glam::{DVec3, Vec3};

use super::{Cube, FACES};

/// The box is taken to be nearer by this share.
const NEARER: f32 = 1.0 + 1e-4;
/// A box that begins nearer than so many near planes is not tried.
const TOO_NEAR: f32 = 16.0;

impl Cube {
    /// Whether a box around the eye is hidden on every face. Looks at no more than `effort` pixels; when that does not
    /// suffice, the box is not hidden.
    pub(super) fn hides_box(&self, min: DVec3, max: DVec3, effort: usize) -> bool {
        let (min, max) = (min.as_vec3(), max.as_vec3());
        if min.cmple(Vec3::ZERO).all() && max.cmpge(Vec3::ZERO).all() {
            return false;
        }
        let mut left = effort;
        (0..6).all(|face| self.hidden_on_face(face, min, max, &mut left))
    }

    fn hidden_on_face(&self, face: usize, min: Vec3, max: Vec3, effort: &mut usize) -> bool {
        let (a, b) = (FACES[face].view(min), FACES[face].view(max));
        let (low, high) = (a.min(b), a.max(b));
        // Beyond a side of the pyramid, or behind it.
        if high.z <= 0.0 || low.x > high.z || high.x < -high.z || low.y > high.z || high.y < -high.z {
            return true;
        }
        if low.z <= TOO_NEAR * self.near {
            return false;
        }
        // A coordinate over the depth is largest at the nearest depth when it is positive, else at the farthest.
        let least = |v: f32| v / if v < 0.0 { low.z } else { high.z };
        let most = |v: f32| v / if v > 0.0 { low.z } else { high.z };
        let half = 0.5 * self.size as f32;
        let pixel = |at: f32, aside: f32| (half + half * at + aside).clamp(0.0, self.size as f32 - 1.0) as usize;
        let (left, right) = (pixel(least(low.x), -1.0), pixel(most(high.x), 1.0));
        let (top, bottom) = (pixel(-most(high.y), -1.0), pixel(-least(low.y), 1.0));
        let Some(rest) = effort.checked_sub((right - left + 1) * (bottom - top + 1)) else {
            return false;
        };
        *effort = rest;
        let nearest = NEARER / low.z;
        (top..=bottom).all(|y| {
            let row = self.index(face, 0, y);
            self.inverse_depth[row + left..=row + right]
                .iter()
                .all(|known| *known >= nearest)
        })
    }
}
