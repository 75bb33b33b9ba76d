//! Which convex bodies hide what is behind them? Found inside the closed parts of each object.
//!
//! Follows Cohen-Or & Zadicario 1998, *Discussion*: a union of few convex shapes, included in the object and as large
//! as possible; where an object is not convex, coarse boxes inside it.
//!
//! 1. Triangles that hang together by their edges make a part ([`super::parts`]). A part counts when every edge is met by as
//!    many faces in one direction as in the other (it is closed), or when the loose edges all lie in its lowest plane (a house
//!    without a floor; its bodies block only what stays above that, [`Body::open_below`]), and when its faces look outwards.
//! 2. A convex part is a body as it is. Any other is filled with boxes of a small grid snapped to its large faces.
//! 3. What holds geometry of others is hollow there: a house may have rooms, and a roof may reach into it. Its bodies keep
//!    clear of that.
//! 4. A body that stands on another one has no gap below it: it takes over the other's floor.
//! 5. What the boxes leave of a part's inside is noted too, as bodies that hide nothing ([`super::rest`]).
//!
//! Guarantee: a segment that meets a body and starts outside the part crosses a face that hides, seen from its front
//! (or from any side if the part hides from both). Bodies are smaller by a margin, which turns rounding into
//! overestimate. Eyes inside a part are no business of its bodies: see `visibility/within.rs`.

use std::collections::{BTreeMap, BTreeSet};

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::{
    Body,
    body::highest_bottom_m,
    fill,
    parts::{Part, bits, parts},
    rest,
};
use crate::{cells::meets_box, world::World};

/// Parts of more triangles than this are not searched for boxes.
const MAX_FILLED_TRIANGLES: usize = 20_000;
/// A convex part with more faces than this is filled with boxes instead.
const MAX_PLANES: usize = 20;
/// A part that is not convex is worth filling only when its box is not smaller than so many times what is small.
const MIN_FILLED: f32 = 4.0;
/// What a body stands on counts as so many margins lower than it is.
const STANDS_MARGINS: f32 = 4.0;
/// A body is a box when its faces stand less than this share of a margin off the sides of one.
const BOX_MARGINS: f32 = 0.25;
/// Corners may stand this share of a part's size outside its faces for it to count as convex.
const CONVEX: f32 = 1e-5;

/// The bodies of all objects, by object. They are `margin_m` smaller than the geometry on every side.
pub(super) fn bodies(world: &World, margin_m: f32) -> Vec<Body> {
    let min_size_m = world.small_m();
    let of_object = |object: u32| -> Vec<Body> {
        let bounds = &world.object_bounds()[object as usize];
        if bounds.is_empty() || (bounds.diagonal_m() as f32) < min_size_m {
            return Vec::new();
        }
        let triangles = world.triangles_of(object);
        let parts = parts(&triangles);
        let large = parts.par_iter().filter(|part| part.width_m() >= min_size_m);
        let bodies = large.map(|part| part.bodies(world, object, &parts, margin_m));
        bodies.collect::<Vec<_>>().concat()
    };
    let objects = (0..world.object_bounds().len() as u32).into_par_iter();
    let mut bodies = objects.map(of_object).collect::<Vec<_>>().concat();
    stand_on_each_other(&mut bodies, margin_m);
    bodies
}

impl Part<'_> {
    fn size_m(&self) -> f32 {
        (self.max - self.min).length()
    }

    /// The middle one of the edges of its box, in m: nothing it hides is seen past a narrower strip than this.
    fn width_m(&self) -> f32 {
        let mut edges = (self.max - self.min).to_array();
        edges.sort_by(f32::total_cmp);
        edges[1]
    }

    /// Its bodies; `parts` are all parts of its object.
    fn bodies(&self, world: &World, object: u32, parts: &[Part<'_>], margin_m: f32) -> Vec<Body> {
        let Some(open_below) = self.open_below() else {
            return Vec::new();
        };
        let body = |min: Vec3, max: Vec3, planes: Vec<Vec4>| Body {
            min: min + margin_m,
            max: max - margin_m,
            planes: planes.iter().map(|p| *p - margin_m * Vec4::W).collect(),
            // What rounding puts just below it counts as on it.
            stands_m: highest_bottom_m(min, max, &planes) - STANDS_MARGINS * margin_m,
            open_below,
            hides: true,
            object,
        };
        let mut foreign = self.foreign(world, object, 4.0 * margin_m);
        let convex = self
            .convex_planes(open_below, 0.5 * margin_m)
            .filter(|planes| planes.len() <= MAX_PLANES);
        let whole = convex.map(|planes| {
            let is_box = self.is_box(BOX_MARGINS * margin_m);
            body(self.min, self.max, if is_box { Vec::new() } else { planes })
        });
        let has_volume = |body: &Body| body.min.cmplt(body.max).all();
        match whole {
            Some(whole) if foreign.is_empty() => return Some(whole).into_iter().filter(has_volume).collect(),
            _ if self.size_m() < MIN_FILLED * world.small_m() => return Vec::new(),
            _ if self.triangles.len() + foreign.len() > MAX_FILLED_TRIANGLES => return Vec::new(),
            _ => {}
        }
        let shape = self.shape(parts);
        let own: BTreeSet<_> = shape.cavities.iter().map(|corners| corners.map(bits)).collect();
        foreign.retain(|corners| !own.contains(&corners.map(bits)));
        let boxes = fill::boxes(&shape, &foreign, [self.min, self.max], margin_m);
        let filled = boxes.iter().map(|[a, b]| body(*a, *b, Vec::new()));
        let mut bodies: Vec<Body> = filled.filter(has_volume).collect();
        if !bodies.is_empty() {
            let rest = match whole {
                Some(whole) if shape.cavities.is_empty() => vec![whole],
                _ => {
                    let pieces = self.rest(&shape, &boxes, margin_m).into_iter();
                    pieces.map(|piece| body(piece.min, piece.max, piece.planes)).collect()
                }
            };
            let rest = rest.into_iter().map(|body| Body { hides: false, ..body });
            bodies.extend(rest.filter(has_volume));
        }
        bodies
    }

    fn surface(&self) -> Vec<[Vec3; 3]> {
        self.triangles.iter().map(|triangle| triangle.corners).collect()
    }

    /// Its surface, and those of what is hollow inside it, which are parts of their own. An eye in there is outside of it, so
    /// none of its bodies may be; a cavity that is not found counts as its inside, for eyes and bodies alike.
    fn shape(&self, parts: &[Part<'_>]) -> fill::Shape {
        let cavities = parts.iter().filter(|part| {
            let is_inside = part.min.cmpge(self.min).all() && part.max.cmple(self.max).all();
            is_inside && part.min != self.min && part.triangles.len() <= MAX_FILLED_TRIANGLES && part.looks_inwards()
        });
        fill::Shape {
            surface: self.surface(),
            hides_both_ways: self.triangles.iter().all(|triangle| triangle.hides_from_back()),
            cavities: cavities.flat_map(Part::surface).collect(),
        }
    }

    /// What boxes leave of its inside.
    fn rest(&self, shape: &fill::Shape, boxes: &[[Vec3; 2]], slack_m: f32) -> Vec<rest::Piece> {
        let in_a_box = |piece: &rest::Piece| {
            let holds = |[low, high]: &[Vec3; 2]| piece.min.cmpge(*low).all() && piece.max.cmple(*high).all();
            boxes.iter().any(holds)
        };
        let mut pieces = rest::pieces(&shape.faces(), self.min, self.max, slack_m);
        pieces.retain(|piece| !in_a_box(piece));
        pieces
    }

    /// Triangles of others that reach further than a margin into its box.
    fn foreign(&self, world: &World, object: u32, margin_m: f32) -> Vec<[Vec3; 3]> {
        let own: BTreeSet<_> = self.triangles.iter().map(|t| t.corners.map(bits)).collect();
        let mut foreign = Vec::new();
        let (middle, half) = (0.5 * (self.min + self.max), 0.5 * (self.max - self.min) - margin_m);
        world.near(self.min, self.max, &mut |triangle| {
            let inside = || meets_box(&triangle.corners.map(|p| p - middle), half);
            if half.cmpgt(Vec3::ZERO).all()
                && (triangle.object != object || !own.contains(&triangle.corners.map(bits)))
                && foreign.len() <= MAX_FILLED_TRIANGLES
                && inside()
            {
                foreign.push(triangle.corners);
            }
        });
        foreign
    }

    /// Whether it is closed and hides from outside; then 1 where its faces look outwards, and −1 where they look inwards and hide from
    /// both sides.
    pub(super) fn encloses(&self) -> Option<i32> {
        let both_sides = self.triangles.iter().all(|triangle| triangle.hides_from_back());
        let (volume_m3, loose) = self.volume_and_loose_edges();
        let hides = self.triangles.iter().all(|triangle| triangle.hides_from_front());
        let sign = if volume_m3 > 0.0 { 1 } else { -1 };
        (hides && loose.is_empty() && volume_m3 != 0.0 && (sign > 0 || both_sides)).then_some(sign)
    }

    /// Whether it has no bottom; `None` when it is open elsewhere or does not hide from outside.
    fn open_below(&self) -> Option<bool> {
        if !self.triangles.iter().all(|triangle| triangle.hides_from_front()) {
            return None;
        }
        let both_sides = self.triangles.iter().all(|triangle| triangle.hides_from_back());
        let (volume_m3, loose) = self.volume_and_loose_edges();
        if volume_m3 <= 0.0 && !both_sides {
            return None;
        }
        let bottom = (self.min.y + 0.0).to_bits();
        let at_bottom = |corner: &[u32; 3]| corner[1] == bottom;
        loose.iter().flatten().all(at_bottom).then_some(!loose.is_empty())
    }

    /// Whether it is closed, and its faces look into it and hide, as around a cavity.
    fn looks_inwards(&self) -> bool {
        let (volume_m3, loose) = self.volume_and_loose_edges();
        let hides = self.triangles.iter().all(|triangle| triangle.hides_from_front());
        volume_m3 < 0.0 && loose.is_empty() && hides
    }

    /// Six times the volume that its faces look out of, and the edges that more faces meet in one direction than in the other.
    fn volume_and_loose_edges(&self) -> (f64, Vec<[[u32; 3]; 2]>) {
        let mut edges: BTreeMap<[[u32; 3]; 2], i32> = BTreeMap::new();
        let mut volume_m3 = 0.0;
        let base = self.min.as_dvec3();
        for triangle in &self.triangles {
            let [a, b, c] = triangle.corners.map(|p| p.as_dvec3() - base);
            volume_m3 += a.dot(b.cross(c));
            let keys = triangle.corners.map(bits);
            for i in 0..3 {
                let (from, to) = (keys[i], keys[(i + 1) % 3]);
                if from < to {
                    *edges.entry([from, to]).or_default() += 1;
                } else if to < from {
                    *edges.entry([to, from]).or_default() -= 1;
                }
            }
        }
        let loose = edges.into_iter().filter(|(_, balance)| *balance != 0);
        (volume_m3, loose.map(|(edge, _)| edge).collect())
    }

    /// Whether its faces lie on the sides of the box around it, but for so much.
    fn is_box(&self, slack_m: f32) -> bool {
        self.triangles.iter().all(|triangle| {
            let [a, b, c] = triangle.corners;
            let normal = (b - a).cross(c - a);
            let axis = normal.abs().max_position();
            let side = if normal[axis] > 0.0 { self.max } else { self.min };
            let lies_on = |corner: &Vec3| (corner[axis] - side[axis]).abs() <= slack_m;
            normal == Vec3::ZERO || triangle.corners.iter().all(lies_on)
        })
    }

    /// The planes of its faces and of a missing bottom, when it is convex. No face stands further out of its plane than `slack_m`.
    fn convex_planes(&self, open_below: bool, slack_m: f32) -> Option<Vec<Vec4>> {
        let tolerance_m = CONVEX * self.size_m();
        let mut planes: Vec<Vec4> = Vec::new();
        if open_below {
            planes.push(Vec4::new(0.0, -1.0, 0.0, -self.min.y));
        }
        for triangle in &self.triangles {
            let [a, b, c] = triangle.corners;
            let Some(normal) = (b - a).cross(c - a).try_normalize() else {
                continue;
            };
            let plane = normal.extend(normal.dot(a).max(normal.dot(b)).max(normal.dot(c)));
            // Where the face is, and not at the origin, which may be far off.
            let lies_in = |p: &Vec4| {
                [a, b, c]
                    .iter()
                    .all(|corner| (p.truncate().dot(*corner) - p.w).abs() <= slack_m)
            };
            let same = |p: &Vec4| p.truncate().dot(normal) > 1.0 - 1e-6 && lies_in(p);
            if planes.iter().any(same) {
                continue;
            }
            if planes.len() > 4 * MAX_PLANES {
                return None;
            }
            let mut corners = self.triangles.iter().flat_map(|t| t.corners);
            if corners.any(|p| normal.dot(p) > plane.w + tolerance_m) {
                return None;
            }
            planes.push(plane);
        }
        Some(planes)
    }
}

/// Lets a body that stands on top of another one of its object stand where that one does: who would pass below it meets
/// the other.
fn stand_on_each_other(bodies: &mut [Body], margin_m: f32) {
    // From the ground up, so that a tower stands on what its storeys stand on.
    let mut order: Vec<_> = (0..bodies.len()).collect();
    order.sort_by(|a, b| bodies[*a].min.y.total_cmp(&bodies[*b].min.y).then(a.cmp(b)));
    let mut by_object: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for upper in order {
        let body = &bodies[upper];
        let others = by_object.entry(body.object).or_default();
        // As high as any of its bottom: one that leans stands on nothing beside its lowest edge.
        let bottom_m = body.stands_m + (STANDS_MARGINS + 1.0) * margin_m;
        let below = others.iter().map(|i| &bodies[*i]).find(|lower| {
            lower.hides
                && lower.planes.is_empty()
                && lower.max.y + STANDS_MARGINS * margin_m >= bottom_m
                && lower.min.x <= body.min.x
                && lower.min.z <= body.min.z
                && lower.max.x >= body.max.x
                && lower.max.z >= body.max.z
        });
        let below = below.map(|lower| lower.stands_m);
        others.push(upper);
        if let Some(stands_m) = below {
            bodies[upper].stands_m = bodies[upper].stands_m.min(stands_m);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cells::plan::Builder;

    /// The body of a block of 100 × 30 × 20 m that is turned by this, beside a plain.
    fn body(turned: f64) -> (Body, f32) {
        let mut builder = Builder::default();
        let block = builder.block("block", [-50.0, 0.0, -10.0], [50.0, 30.0, 10.0]);
        builder.scene.objects[block as usize].world_from_object = glam::DMat4::from_rotation_y(turned);
        builder.quad(
            "plain",
            [
                [-100., 0., -100.],
                [-100., 0., 100.],
                [100., 0., 100.],
                [100., 0., -100.],
            ],
        );
        let world = World::new(&builder.scene).unwrap();
        let margin_m = 2e-6 * world.scale_m();
        let mut bodies = bodies(&world, margin_m);
        assert_eq!(bodies.len(), 1);
        (bodies.remove(0), margin_m)
    }

    #[test]
    fn a_block_that_hardly_stands_askew_is_no_box() {
        assert!(body(0.0).0.planes.is_empty());
        let (askew, margin_m) = body(8.7e-4);
        let beside = Vec3::new(askew.min.x, 0.5 * (askew.min.y + askew.max.y), askew.max.z);
        let out_m = askew.planes.iter().map(|plane| plane.dot(beside.extend(-1.0)));
        assert!(out_m.fold(0.0, f32::max) > margin_m, "{askew:?}");
    }
}
