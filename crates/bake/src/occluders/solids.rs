//! Which convex bodies hide what is behind them? Found inside the closed parts of each object.
//!
//! Follows Cohen-Or & Zadicario 1998, *Discussion*: a union of few convex shapes, included in the object and as large
//! as possible; where an object is not convex, coarse boxes inside it.
//!
//! 1. Triangles that share corners make a part. A part counts when every edge is met by as many faces in one direction
//!    as in the other (it is closed), or when the loose edges all lie in its lowest plane (a house without a floor; its
//!    bodies block only what stays above that, [`Body::open_below`]), and when its faces look outwards.
//! 2. A convex part is a body as it is. Any other is filled with boxes of a small grid snapped to its large faces.
//! 3. What holds geometry of others is hollow there: a house may have rooms. Its bodies keep clear of that, and a shell
//!    that one could stand in and look out of, because its backs are not drawn, has none.
//! 4. A body that stands on another one has no gap below it: it takes over the other's floor.
//! 5. What the boxes leave of a part's inside is noted too, as bodies that hide nothing ([`super::rest`]).
//!
//! Guarantee: a segment that meets a body and starts outside the part crosses a face that hides, seen from its front
//! (or from any side if the part hides from both). Bodies are smaller by a margin, which turns rounding into
//! overestimate. Eyes inside a part are no business of its bodies: see `visibility/within.rs`.

use std::collections::BTreeMap;

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::{Body, fill, rest};
use crate::{
    cells::meets_box,
    groups::Groups,
    world::{Triangle, World},
};

/// Parts of more triangles than this are not searched for boxes.
const MAX_FILLED_TRIANGLES: usize = 20_000;
/// A convex part with more faces than this is filled with boxes instead.
const MAX_PLANES: usize = 20;
/// A part whose box is smaller than this share of the scene hides too little to be worth a body.
const MIN_SIZE_SHARE: f32 = 1.0 / 1000.0;
/// … and one that is not convex is worth filling only when its box is not smaller than this share.
const MIN_FILLED_SHARE: f32 = 1.0 / 250.0;
/// What a body stands on counts as so many margins lower than it is.
const STANDS_MARGINS: f32 = 4.0;
/// Corners may stand this share of a part's size outside its faces for it to count as convex.
const CONVEX: f32 = 1e-5;

/// The bodies of all objects, by object. They are `margin_m` smaller than the geometry on every side.
pub(super) fn bodies(world: &World, margin_m: f32) -> Vec<Body> {
    let min_size_m = MIN_SIZE_SHARE * world.scale_m();
    let of_object = |object: u32| -> Vec<Body> {
        let bounds = &world.object_bounds()[object as usize];
        if bounds.is_empty() || (bounds.diagonal_m() as f32) < min_size_m {
            return Vec::new();
        }
        let triangles = world.triangles_of(object);
        let parts = parts(&triangles);
        let large = parts.par_iter().filter(|part| part.size_m() >= min_size_m);
        let bodies = large.map(|part| part.bodies(world, object, &parts, margin_m));
        bodies.collect::<Vec<_>>().concat()
    };
    let objects = (0..world.object_bounds().len() as u32).into_par_iter();
    let mut bodies = objects.map(of_object).collect::<Vec<_>>().concat();
    stand_on_each_other(&mut bodies, margin_m);
    bodies
}

/// Triangles that hang together.
struct Part<'a> {
    triangles: Vec<&'a Triangle>,
    min: Vec3,
    max: Vec3,
}

/// A part that lets nothing through.
struct Closed {
    /// But for its bottom.
    open_below: bool,
    /// Not from inside either.
    both_sides: bool,
}

fn bits(point: Vec3) -> [u32; 3] {
    // Adding zero turns −0 into 0.
    (point + Vec3::ZERO).to_array().map(f32::to_bits)
}

#[allow(
    clippy::disallowed_types,
    reason = "corners are looked up only, millions of them, and never gone through in the map's own order"
)]
fn parts(triangles: &[Triangle]) -> Vec<Part<'_>> {
    let mut ids: std::collections::HashMap<[u32; 3], u32> = std::collections::HashMap::with_capacity(triangles.len());
    let mut groups = Groups::of_one(0);
    let mut first_corner = Vec::with_capacity(triangles.len());
    for triangle in triangles {
        let corners = triangle
            .corners
            .map(|p| *ids.entry(bits(p)).or_insert_with(|| groups.add()));
        for corner in &corners[1..] {
            groups.join(corners[0], *corner);
        }
        first_corner.push(corners[0]);
    }
    let mut index_of: BTreeMap<u32, usize> = BTreeMap::new();
    let mut parts: Vec<Part<'_>> = Vec::new();
    for (triangle, corner) in triangles.iter().zip(first_corner) {
        let index = *index_of.entry(groups.root(corner)).or_insert_with(|| {
            parts.push(Part {
                triangles: Vec::new(),
                min: Vec3::INFINITY,
                max: Vec3::NEG_INFINITY,
            });
            parts.len() - 1
        });
        let part = &mut parts[index];
        for corner in triangle.corners {
            part.min = part.min.min(corner);
            part.max = part.max.max(corner);
        }
        part.triangles.push(triangle);
    }
    parts
}

impl Part<'_> {
    fn size_m(&self) -> f32 {
        (self.max - self.min).length()
    }

    /// Its bodies; `parts` are all parts of its object.
    fn bodies(&self, world: &World, object: u32, parts: &[Part<'_>], margin_m: f32) -> Vec<Body> {
        let Some(Closed { open_below, both_sides }) = self.closed() else {
            return Vec::new();
        };
        let body = |min: Vec3, max: Vec3, planes: Vec<Vec4>| Body {
            min: min + margin_m,
            max: max - margin_m,
            planes: planes.iter().map(|p| *p - margin_m * Vec4::W).collect(),
            // What rounding puts just below it counts as on it.
            stands_m: min.y - STANDS_MARGINS * margin_m,
            open_below,
            hides: true,
            object,
        };
        let foreign = self.foreign(world, object, 4.0 * margin_m);
        let convex = self.convex_planes(open_below).filter(|_| foreign.is_empty());
        let (bodies, boxes) = match convex {
            Some(planes) if planes.iter().all(|p| is_axis(p.truncate())) => {
                (vec![body(self.min, self.max, Vec::new())], Vec::new())
            }
            Some(planes) if planes.len() <= MAX_PLANES => (vec![body(self.min, self.max, planes)], Vec::new()),
            None if self.size_m() < MIN_FILLED_SHARE * world.scale_m() => return Vec::new(),
            _ if self.triangles.len() + foreign.len() > MAX_FILLED_TRIANGLES => return Vec::new(),
            _ => {
                let surface: Vec<_> = self.triangles.iter().map(|t| t.corners).collect();
                let filled = fill::boxes(&surface, &foreign, self.min, self.max);
                if filled.hollow && !both_sides {
                    return Vec::new();
                }
                let bodies = filled.boxes.iter().map(|[a, b]| body(*a, *b, Vec::new()));
                (bodies.collect(), filled.boxes)
            }
        };
        let has_volume = |body: &Body| body.min.cmplt(body.max).all();
        let mut bodies: Vec<Body> = bodies.into_iter().filter(has_volume).collect();
        if !bodies.is_empty() && !boxes.is_empty() {
            let rest = self.rest(parts, &boxes, margin_m).into_iter().map(|piece| Body {
                hides: false,
                ..body(piece.min, piece.max, piece.planes)
            });
            bodies.extend(rest.filter(has_volume));
        }
        bodies
    }

    /// What boxes leave of its inside; `parts` are all parts of its object.
    fn rest(&self, parts: &[Part<'_>], boxes: &[[Vec3; 2]], slack_m: f32) -> Vec<rest::Piece> {
        let mut surface: Vec<_> = self.triangles.iter().map(|t| t.corners).collect();
        // Cavities are parts of their own.
        let inner = parts.iter().filter(|part| {
            let is_inside = part.min.cmpge(self.min).all() && part.max.cmple(self.max).all();
            is_inside && part.min != self.min && part.triangles.len() <= MAX_FILLED_TRIANGLES && part.looks_inwards()
        });
        surface.extend(inner.flat_map(|part| part.triangles.iter().map(|t| t.corners)));
        let in_a_box = |piece: &rest::Piece| {
            let holds = |[low, high]: &[Vec3; 2]| piece.min.cmpge(*low).all() && piece.max.cmple(*high).all();
            boxes.iter().any(holds)
        };
        let mut pieces = rest::pieces(&surface, self.min, self.max, slack_m);
        pieces.retain(|piece| !in_a_box(piece));
        pieces
    }

    /// Triangles of others that reach further than a margin into its box.
    fn foreign(&self, world: &World, object: u32, margin_m: f32) -> Vec<[Vec3; 3]> {
        let own: std::collections::BTreeSet<_> = self.triangles.iter().map(|t| t.corners.map(bits)).collect();
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

    /// How it is closed, if it is and hides from outside.
    fn closed(&self) -> Option<Closed> {
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
        loose.iter().flatten().all(at_bottom).then_some(Closed {
            open_below: !loose.is_empty(),
            both_sides,
        })
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

    /// The planes of its faces and of a missing bottom, when it is convex.
    fn convex_planes(&self, open_below: bool) -> Option<Vec<Vec4>> {
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
            let same = |p: &Vec4| p.truncate().dot(normal) > 1.0 - 1e-6 && (p.w - plane.w).abs() <= tolerance_m;
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

fn is_axis(normal: Vec3) -> bool {
    normal.abs().max_element() > 1.0 - 1e-6
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
        let below = others.iter().map(|i| &bodies[*i]).find(|lower| {
            lower.hides
                && lower.planes.is_empty()
                && lower.max.y + STANDS_MARGINS * margin_m >= body.min.y
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
