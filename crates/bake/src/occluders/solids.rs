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
//! 4. A body that stands on another one has no gap below it: it takes over the other's floor. Who comes into a part without a bottom
//!    from below crosses no face of it, wherever its boxes are: these stand on what is below all of its opening, or on each other.
//! 5. What the boxes leave of a part's inside is noted too, as bodies that hide nothing ([`super::rest`]).
//!
//! Guarantee: a segment that meets a body and starts outside the part crosses a face that hides, seen from its front
//! (or from any side if the part hides from both). Bodies are smaller by a margin, which turns rounding into
//! overestimate. Eyes inside a part are no business of its bodies: see `visibility/within.rs`.

use std::collections::{BTreeMap, BTreeSet};

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::{
    Body, Tolerance, fill,
    parts::{Part, bits, parts},
    rest,
};
use crate::{
    cells::meets_box,
    progress::{Cancelled, Portion, Progress},
    world::World,
};

/// Steps of progress that finding bodies takes.
pub(super) const STEPS: u64 = 5000;
/// Parts of more triangles than this are not searched for boxes.
const MAX_FILLED_TRIANGLES: usize = 20_000;
/// A convex part with more faces than this is filled with boxes instead.
const MAX_PLANES: usize = 20;
/// A part that is not convex is worth filling only when its box is not smaller than so many times what is small.
const MIN_FILLED: f32 = 4.0;
/// A body is a box when its faces stand less than this share of a margin off the sides of one.
const BOX_MARGINS: f32 = 0.25;
/// Corners may stand this share of a part's size outside its faces for it to count as convex.
const CONVEX: f32 = 1e-5;

/// A body, and what it was found in.
#[derive(Clone)]
struct Found {
    body: Body,
    /// The part that it lies in, of those of its object.
    part: usize,
    /// The lowest and the highest corner of what something must be below of for nobody to get below the body: of itself, or of the
    /// whole part where that has no bottom.
    above: [Vec3; 2],
}

/// The bodies of all objects, by object. On every side they are as much smaller than the geometry as holes are closed.
///
/// # Errors
/// When cancelled.
pub(super) fn bodies(world: &World, tolerance: Tolerance, progress: &dyn Progress) -> Result<Vec<Body>, Cancelled> {
    let min_size_m = world.small_m();
    let portion = Portion::of(progress, STEPS, world.triangle_count() as u64);
    let of_object = |object: u32| -> Vec<Found> {
        let bounds = &world.object_bounds()[object as usize];
        if bounds.is_empty() || (bounds.diagonal_m() as f32) < min_size_m {
            return Vec::new();
        }
        let triangles = world.triangles_of(object);
        let parts = parts(&triangles);
        let large = parts
            .par_iter()
            .enumerate()
            .filter(|(_, part)| part.width_m() >= min_size_m);
        let found = large.map(|(number, part)| {
            let bodies = part.bodies(world, object, &parts, tolerance);
            part.found(number, bodies, tolerance)
        });
        let mut found = found.collect::<Vec<_>>().concat();
        stand_on_each_other(&mut found, tolerance);
        found
    };
    let objects = (0..world.object_bounds().len() as u32).into_par_iter();
    let found = objects.map(|object| {
        if portion.cancelled() {
            return Err(Cancelled);
        }
        let found = of_object(object);
        portion.advance(world.triangle_count_of(object) as u64);
        Ok(found)
    });
    let found = found.collect::<Result<Vec<_>, _>>()?.concat();
    Ok(found.into_iter().map(|found| found.body).collect())
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

    /// Its bodies, for who asks what they stand on; it is the part of that number.
    fn found(&self, part: usize, bodies: Vec<Body>, tolerance: Tolerance) -> Vec<Found> {
        let opening = [self.min + tolerance.hole_m, self.max - tolerance.hole_m];
        let found = bodies.into_iter().map(|body| Found {
            part,
            above: if body.open_below { opening } else { [body.min, body.max] },
            body,
        });
        found.collect()
    }

    /// Its bodies; `parts` are all parts of its object.
    fn bodies(&self, world: &World, object: u32, parts: &[Part<'_>], tolerance: Tolerance) -> Vec<Body> {
        let Some(open_below) = self.open_below() else {
            return Vec::new();
        };
        let margin_m = tolerance.hole_m;
        let body = |sides: [Vec3; 2], planes: &[Vec4]| {
            let body = Body::inside(sides, planes, object, tolerance)?;
            Some(Body { open_below, ..body })
        };
        let mut foreign = self.foreign(world, object, 4.0 * margin_m);
        let convex = self
            .convex_planes(open_below, 0.5 * margin_m)
            .filter(|planes| planes.len() <= MAX_PLANES);
        let whole = convex.map(|planes| {
            let is_box = self.is_box(BOX_MARGINS * margin_m);
            body([self.min, self.max], if is_box { &[] } else { &planes })
        });
        match whole {
            Some(whole) if foreign.is_empty() => return Vec::from_iter(whole),
            _ if self.size_m() < MIN_FILLED * world.small_m() => return Vec::new(),
            _ if self.triangles.len() + foreign.len() > MAX_FILLED_TRIANGLES => return Vec::new(),
            _ => {}
        }
        let shape = self.shape(parts);
        let own: BTreeSet<_> = shape.cavities.iter().map(|corners| corners.map(bits)).collect();
        foreign.retain(|corners| !own.contains(&corners.map(bits)));
        let boxes = fill::boxes(&shape, &foreign, [self.min, self.max], margin_m);
        let mut bodies: Vec<Body> = boxes.iter().filter_map(|sides| body(*sides, &[])).collect();
        if !bodies.is_empty() {
            let rest: Vec<Body> = match whole {
                Some(whole) if shape.cavities.is_empty() => Vec::from_iter(whole),
                _ => {
                    let pieces = self.rest(&shape, &boxes, margin_m);
                    let inside = |piece: &rest::Piece| body([piece.min, piece.max], &piece.planes);
                    pieces.iter().filter_map(inside).collect()
                }
            };
            bodies.extend(rest.into_iter().map(|body| Body { hides: false, ..body }));
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

    /// The planes of its faces and of a missing bottom, when it is convex and has any. No face stands further out of its plane than `slack_m`.
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
        (!planes.is_empty()).then_some(planes)
    }
}

/// Lets a body that stands on top of another one of its object, all bodies of which these are, stand where that one does: who would pass
/// below it meets the other.
fn stand_on_each_other(found: &mut [Found], tolerance: Tolerance) {
    // From the ground up, so that a tower stands on what its storeys stand on.
    let mut order: Vec<_> = (0..found.len()).collect();
    order.sort_by(|a, b| found[*a].body.min.y.total_cmp(&found[*b].body.min.y).then(a.cmp(b)));
    for (rank, upper) in order.iter().enumerate() {
        let Found { body, part, above } = &found[*upper];
        // As high as any of its bottom, but for rounding: one that leans stands on nothing beside its lowest edge.
        let bottom_m = body.stands_m;
        let below = order[..rank].iter().map(|i| &found[*i]).find(|lower| {
            // Of two in one part, who is in between is in that part.
            let [low, high] = if lower.part == *part {
                [body.min, body.max]
            } else {
                *above
            };
            let lower = &lower.body;
            lower.hides
                && lower.planes.is_empty()
                && lower.max.y + tolerance.hole_m >= bottom_m
                && lower.min.x <= low.x
                && lower.min.z <= low.z
                && lower.max.x >= high.x
                && lower.max.z >= high.z
        });
        if let Some(stands_m) = below.map(|lower| lower.body.stands_m) {
            let body = &mut found[*upper].body;
            body.stands_m = body.stands_m.min(stands_m);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::{Region, tolerance_of},
        *,
    };
    use crate::{cells::plan::Builder, progress::Silent};

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
        let tolerance = tolerance_of(&world);
        let mut bodies = bodies(&world, tolerance, &Silent).unwrap();
        assert_eq!(bodies.len(), 1);
        (bodies.remove(0), tolerance.hole_m)
    }

    /// A block with a pyramid on it, of which each side reaches so much further out, and two far things that make the scene as wide.
    fn tower(eaves_m: f32, width_m: f32) -> World {
        let mut builder = Builder::default();
        let tower = builder.block("tower", [-0.8, 0.0, -0.8], [0.8, 10.0, 0.8]);
        let out_m = 0.8 + eaves_m;
        let mut positions: Vec<[f32; 3]> = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
            .map(|[x, z]| [out_m * x, 10.0, out_m * z])
            .to_vec();
        positions.push([0.0, 14.0, 0.0]);
        let roof = builder.mesh(
            "roof",
            positions,
            vec![0, 1, 2, 0, 2, 3, 0, 4, 1, 1, 4, 2, 2, 4, 3, 3, 4, 0],
        );
        let roof = builder.scene.models[roof as usize].primitives.remove(0);
        builder.scene.models[tower as usize].primitives.push(roof);
        builder.scene.objects.pop();
        for side in [-1.0, 1.0] {
            let x = 0.5 * side * width_m;
            builder.block("far", [x - 0.5, 0.0, -0.5], [x + 0.5, 1.0, 0.5]);
        }
        World::new(&builder.scene).unwrap()
    }

    fn region(world: &World, min: [f64; 3], max: [f64; 3]) -> Region {
        Region::of_box(world.relative(min), world.relative(max))
    }

    #[test]
    fn below_a_roof_its_house_hides_and_nothing_beside_that() {
        let roof_hides = |eaves_m: f32, z: f64| {
            let world = tower(eaves_m, 100.0);
            let bodies = bodies(&world, tolerance_of(&world), &Silent).unwrap();
            let roof = bodies.iter().find(|body| !body.planes.is_empty()).expect("a roof");
            let eye = region(&world, [-21.0, 0.8, -0.1], [-20.0, 0.9, 0.1]);
            let thing = region(&world, [40.0, 0.0, z - 0.1], [40.5, 1.5, z + 0.1]);
            roof.separates(&eye, &thing, true)
        };
        assert!(roof_hides(0.0, 0.0), "the tower is below all of it");
        assert!(!roof_hides(0.0, 3.9), "beside the tower one sees on");
        assert!(
            !roof_hides(0.3, 0.0),
            "below eaves one sees on, so it stands on nothing"
        );
    }

    /// A block with a hipped roof that has no underside, of which each side reaches so much further out, and a cube beside its ridge, for
    /// which the roof is filled with boxes.
    fn open_roofed(eaves_m: f32) -> World {
        let mut builder = Builder::default();
        let house = builder.block("house", [-5.0, 0.0, -3.0], [5.0, 6.0, 3.0]);
        let (x, z) = (5.0 + eaves_m, 3.0 + eaves_m);
        let positions = vec![
            [-x, 6., -z],
            [x, 6., -z],
            [x, 6., z],
            [-x, 6., z],
            [-2., 8.25, 0.],
            [2., 8.25, 0.],
        ];
        let slopes = vec![0, 4, 5, 0, 5, 1, 1, 5, 2, 2, 5, 4, 2, 4, 3, 3, 4, 0];
        let roof = builder.mesh("roof", positions, slopes);
        let roof = builder.scene.models[roof as usize].primitives.remove(0);
        builder.scene.models[house as usize].primitives.push(roof);
        builder.scene.objects.pop();
        builder.block("cube", [4.1, 7.6, -0.3], [4.7, 8.2, 0.3]);
        builder.block("ground", [-30.0, -1.0, -20.0], [30.0, 0.0, 20.0]);
        World::new(&builder.scene).unwrap()
    }

    #[test]
    fn below_eaves_without_an_underside_one_looks_out_through_the_roof() {
        let hide = |eaves_m: f32, eye: [f64; 3], thing: [f64; 3]| {
            let world = open_roofed(eaves_m);
            let at =
                |[x, y, z]: [f64; 3]| region(&world, [x - 0.01, y - 0.01, z - 0.01], [x + 0.01, y + 0.01, z + 0.01]);
            let bodies = bodies(&world, tolerance_of(&world), &Silent).unwrap();
            let of_roof = |body: &&Body| body.object == 0 && body.open_below && body.hides;
            assert!(bodies.iter().filter(of_roof).count() > 1, "it is filled with boxes");
            let (eye, thing) = (at(eye), at(thing));
            let of_house = |body: &&Body| body.object == 0;
            bodies
                .iter()
                .filter(of_house)
                .any(|body| body.separates(&eye, &thing, false))
        };
        let (street, beside_the_ridge) = ([-8.45, 5.45, -2.8], [4.15, 8.05, 0.25]);
        assert!(!hide(1.0, street, beside_the_ridge));
        let (low, high) = ([-20.0, 5.5, 0.0], [20.0, 7.5, 0.0]);
        assert!(
            hide(0.0, low, high),
            "where the block is below all of it, it hides from below too"
        );
    }

    #[test]
    fn one_sees_on_below_what_hangs_close_to_the_ground() {
        let mut builder = Builder::default();
        let panel = builder.block("panel", [10.0, 0.02, -100.0], [11.0, 30.0, 100.0]);
        for x in [-1500.0, 1500.0] {
            builder.block("far", [x, 0.0, 0.0], [x + 1.0, 1.0, 1.0]);
        }
        let world = World::new(&builder.scene).unwrap();
        let bodies = bodies(&world, tolerance_of(&world), &Silent).unwrap();
        let panel = bodies.iter().find(|body| body.object == panel).unwrap();
        let hides = |bottom_m: f64, top_m: f64| {
            let eye = region(&world, [0.0, bottom_m, -1.0], [2.0, 1.0, 1.0]);
            panel.separates(&eye, &region(&world, [20.0, bottom_m, -0.5], [21.0, top_m, 0.5]), true)
        };
        assert!(!hides(0.0, 0.015));
        assert!(hides(0.02, 0.2), "nobody passes below who stays above its bottom");
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
