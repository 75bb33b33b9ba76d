//! Where do sight lines cross a wall?
//!
//! Sight lines between two regions cross the plane of a wall inside a rectangle; those that also pass openings cross it inside the
//! intersection of the rectangles of every two of the regions that lie on different sides (the separating planes of Teller &
//! Séquin, *Visibility preprocessing for interactive walkthroughs*, 1991, boxed).

use std::borrow::Borrow;

use glam::{DVec2, Vec2, Vec3};

use super::blocker::AT_FACE;
use crate::occluders::{Occluders, Rectangle, Region, Wall, Way};

/// A wall hides only what lies further behind its plane than so many times the distance within which faces lie in it.
pub(super) const BEHIND: f32 = 4.0;

/// How sight lines cross a wall.
pub(super) struct Crossing {
    pub(super) wall: u32,
    pub(super) way: Way,
    /// All of them cross inside.
    pub(super) rectangle: Rectangle,
}

impl Crossing {
    /// How sight lines that pass these regions cross a wall, if they surely do.
    pub(super) fn of<R: Borrow<Region>>(occluders: &Occluders, index: u32, passed: &[R]) -> Option<Self> {
        let wall = &occluders.walls[index as usize];
        let plane_m = occluders.tolerance.plane_m;
        let sides: Vec<i8> = passed
            .iter()
            .enumerate()
            .map(|(i, region)| {
                let [low, high] = region.borrow().heights(wall.normal, wall.offset);
                let beyond_m = if i == 1 { BEHIND * plane_m } else { -AT_FACE * plane_m };
                if low >= beyond_m {
                    1
                } else if high <= -beyond_m {
                    -1
                } else {
                    0
                }
            })
            .collect();
        // Where sight lines come from: the eye's side, or the side away from the target.
        let near = if sides[0] != 0 { sides[0] } else { -sides[1] };
        if near == 0 || sides[1] == near {
            return None;
        }
        let way = if near > 0 { Way::Against } else { Way::Along };
        if !wall.hides(way) {
            return None;
        }
        let mut rectangle = [[f32::NEG_INFINITY, f32::INFINITY]; 2];
        let mut crossed = false;
        for (a, _) in sides.iter().enumerate().filter(|(_, side)| **side == near) {
            for (b, _) in sides.iter().enumerate().filter(|(_, side)| **side == -near) {
                crossed = true;
                let between = between(wall, passed[a].borrow(), passed[b].borrow());
                for axis in 0..2 {
                    rectangle[axis][0] = rectangle[axis][0].max(between[axis][0]);
                    rectangle[axis][1] = rectangle[axis][1].min(between[axis][1]);
                }
            }
        }
        crossed.then_some(Self {
            wall: index,
            way,
            rectangle,
        })
    }

    /// Clipping left nothing, for certain.
    pub(super) fn is_empty(&self, margin_m: f32) -> bool {
        let mut axes = self.rectangle.iter();
        axes.any(|[low, high]| low - high > 0.5 * margin_m)
    }
}

/// A rectangle in which all segments between two regions on different sides cross a wall. Only segments on the convex hull
/// of both can cross at its border; for two boxes these join equal corners. In double precision: where one region is far out,
/// single precision would not tell openings apart.
pub(super) fn between(wall: &Wall, a: &Region, b: &Region) -> Rectangle {
    let mut rectangle = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    let mut include = |place: DVec2| {
        for axis in 0..2 {
            rectangle[axis][0] = rectangle[axis][0].min(place[axis]);
            rectangle[axis][1] = rectangle[axis][1].max(place[axis]);
        }
    };
    let (normal, offset, axes) = (
        wall.normal.as_dvec3(),
        f64::from(wall.offset),
        wall.axes.map(Vec3::as_dvec3),
    );
    let at = |p: Vec3| {
        let p = p.as_dvec3();
        (normal.dot(p) - offset, DVec2::new(axes[0].dot(p), axes[1].dot(p)))
    };
    let mut segment = |(height_a, place_a): (f64, DVec2), (height_b, place_b): (f64, DVec2)| {
        let drop = height_a - height_b;
        if drop.abs() <= f64::from(f32::MIN_POSITIVE) {
            include(place_a);
            include(place_b);
        } else {
            include(place_a.lerp(place_b, (height_a / drop).clamp(0.0, 1.0)));
        }
    };
    if a.points.is_empty() && b.points.is_empty() {
        for i in 0..8 {
            segment(at(a.corner(i)), at(b.corner(i)));
        }
    } else {
        for from in a.corners() {
            let from = at(from);
            for to in b.corners() {
                segment(from, at(to));
            }
        }
    }
    rectangle.map(|ends| ends.map(|end| end as f32))
}

/// An opening as a region: a flat box where the wall stands along the world's axes.
pub(super) fn region_of(wall: &Wall, opening: &Rectangle) -> Region {
    let [u, v] = *opening;
    let corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| wall.point(Vec2::new(u[i], v[j])));
    let hull = Region::hull(corners.to_vec());
    if wall.axis().is_some() {
        Region::of_box(hull.min, hull.max)
    } else {
        hull
    }
}
