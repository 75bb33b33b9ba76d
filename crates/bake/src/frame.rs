//! Which way do the walls of a world look?
//!
//! Cells are boxes, and proofs are tightest between boxes. A town whose streets run askew is baked in a frame that is turned
//! about the vertical until most of its walls stand along the axes; what is published is turned back.
//!
//! The direction is that in which most of the area of upright opaque faces looks (a weighted median, so that a house that
//! moves changes nothing), and counts only when it holds clearly more of it than the axes of the source do. It is rounded, and
//! turning takes no more than the four basic operations, so every machine finds the same frame.

use glam::{DMat4, DVec3, Vec3};

use crate::{
    cells::{CellGraph, CellHull, ViewCell},
    source::{Role, SourceScene},
};
use belvedere_scene::{Bounds, convex::HalfSpace, record::Hull};

/// Upright faces are counted by their direction in so many sectors of a right angle.
const SECTORS: usize = 1800;
/// Walls look one way when they differ by no more than this many sectors.
const WIDE: usize = 2;
/// A direction counts when so many times as much area looks that way as along the axes of the source …
const CLEARLY: f64 = 1.5;
/// … and at least this share of all that is upright.
const SHARE: f64 = 0.1;
/// A face is upright when its normal rises no more than this.
const UPRIGHT: f64 = 0.02;
/// The tangent of half the angle is rounded to multiples of this.
const STEP: f64 = 1.0 / (1u64 << 20) as f64;

/// A turn about +Y through the origin of world space: the space in which a world is baked, in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// The tangent of half the angle.
    half_tangent: f64,
}

/// What a scene was before it was turned.
pub(crate) struct Unturned {
    objects: Vec<DMat4>,
    viewpoints: Vec<DMat4>,
}

impl Frame {
    /// That of the source.
    pub const SOURCE: Self = Self { half_tangent: 0.0 };

    /// The frame of which the tangent of half the angle is this; `None` for what is more than a quarter turn.
    #[must_use]
    pub fn of_half_tangent(half_tangent: f64) -> Option<Self> {
        (half_tangent.abs() < 1.0).then_some(Self { half_tangent })
    }

    /// The tangent of half the angle by which it is turned, in (−1, 1).
    #[must_use]
    pub fn half_tangent(&self) -> f64 {
        self.half_tangent
    }

    /// Whether it is that of the source.
    #[must_use]
    pub fn is_source(&self) -> bool {
        self.half_tangent == 0.0
    }

    /// The angle in degrees, from −45 to 45.
    #[must_use]
    pub fn degrees(&self) -> f64 {
        2.0 * self.half_tangent.atan().to_degrees()
    }

    /// The frame along whose axes most walls of a scene stand.
    #[must_use]
    pub fn of(scene: &SourceScene) -> Self {
        let mut area_m2 = vec![0.0; SECTORS];
        each_upright_face(scene, &mut |angle, area| area_m2[sector(angle)] += area);
        let total_m2: f64 = area_m2.iter().sum();
        let window_m2 = |first: usize| -> f64 { (first..first + WIDE).map(|at| area_m2[at % SECTORS]).sum() };
        let best = (0..SECTORS).max_by(|a, b| window_m2(*a).total_cmp(&window_m2(*b)).then(b.cmp(a)));
        let Some(first) = best else {
            return Self::SOURCE;
        };
        let along_axes_m2 = window_m2(SECTORS - WIDE / 2);
        if window_m2(first) <= CLEARLY * along_axes_m2 || window_m2(first) <= SHARE * total_m2 {
            return Self::SOURCE;
        }
        let mut faces: Vec<(f64, f64)> = Vec::new();
        let start = first as f64 / SECTORS as f64;
        each_upright_face(scene, &mut |angle, area| {
            if (first..first + WIDE).any(|at| at % SECTORS == sector(angle)) {
                // Relative to the first sector, so that none of them is cut by the end of the right angle.
                faces.push(((angle - start).rem_euclid(1.0), area));
            }
        });
        faces.sort_by(|a, b| a.0.total_cmp(&b.0));
        let half_m2 = 0.5 * faces.iter().map(|(_, area)| area).sum::<f64>();
        let mut sum_m2 = 0.0;
        let median = faces.iter().find(|(_, area)| {
            sum_m2 += area;
            sum_m2 >= half_m2
        });
        let angle = (start + median.map_or(0.0, |(angle, _)| *angle)).rem_euclid(1.0);
        let least = if angle > 0.5 { angle - 1.0 } else { angle };
        let half_tangent = (least * std::f64::consts::FRAC_PI_4).tan();
        Self {
            half_tangent: (half_tangent / STEP).round() * STEP,
        }
    }

    fn cos_sin(&self) -> [f64; 2] {
        let t = self.half_tangent;
        let length = 1.0 + t * t;
        [(1.0 - t * t) / length, 2.0 * t / length]
    }

    /// A point or direction of world space, in this frame.
    #[must_use]
    pub fn enter(&self, p: DVec3) -> DVec3 {
        let [c, s] = self.cos_sin();
        DVec3::new(c * p.x + s * p.z, p.y, c * p.z - s * p.x)
    }

    /// A point or direction of this frame, in world space.
    #[must_use]
    pub fn leave(&self, p: DVec3) -> DVec3 {
        let [c, s] = self.cos_sin();
        DVec3::new(c * p.x - s * p.z, p.y, c * p.z + s * p.x)
    }

    /// The box of this frame that holds a convex part of world space: what half-spaces leave of a box. It is tight for
    /// cells that were cut in this frame.
    #[must_use]
    pub fn box_around(&self, bounds: &Bounds, planes: &[HalfSpace]) -> Bounds {
        if self.is_source() {
            return *bounds;
        }
        let corners = bounds.corners().map(|p| self.enter(DVec3::from(p)).to_array());
        let mut around = Bounds::around(corners);
        for half in planes {
            let normal = self.enter(DVec3::new(half[0], half[1], half[2]));
            for axis in 0..3 {
                if normal[axis] > 1.0 - 1e-12 {
                    around.max[axis] = around.max[axis].min(half[3]);
                } else if normal[axis] < -1.0 + 1e-12 {
                    around.min[axis] = around.min[axis].max(-half[3]);
                }
            }
        }
        around
    }

    /// Turns a scene into this frame. What its author drew for the bake is turned for good, since nothing reads it in world
    /// space; the rest is put back by [`Unturned::put_back`].
    pub(crate) fn turn(&self, scene: &mut SourceScene) -> Unturned {
        let unturned = Unturned {
            objects: scene.objects.iter().map(|object| object.world_from_object).collect(),
            viewpoints: scene.viewpoints.iter().map(|v| v.world_from_camera).collect(),
        };
        if self.is_source() {
            return unturned;
        }
        let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| self.enter(axis).extend(0.0));
        let turn = DMat4::from_cols(x, y, z, DVec3::ZERO.extend(1.0));
        for object in &mut scene.objects {
            object.world_from_object = turn * object.world_from_object;
        }
        for viewpoint in &mut scene.viewpoints {
            viewpoint.world_from_camera = turn * viewpoint.world_from_camera;
        }
        let authored = &mut scene.authored;
        let shapes = [&mut authored.cells, &mut authored.portals, &mut authored.occluders];
        for corner in shapes
            .into_iter()
            .flatten()
            .flat_map(|shape| &mut shape.triangles)
            .flatten()
        {
            *corner = self.enter(*corner);
        }
        unturned
    }

    /// Cells that were cut in this frame, in world space. Neighbours share their corners to the last bit still.
    pub(crate) fn leave_with(&self, mut graph: CellGraph) -> CellGraph {
        if self.is_source() {
            return graph;
        }
        for cell in &mut graph.cells {
            for corner in cell.portals.iter_mut().flat_map(|portal| &mut portal.polygon) {
                *corner = self.leave(DVec3::from(*corner)).to_array();
            }
            let hull = self.turned_box(&cell.bounds);
            *cell = ViewCell {
                portals: std::mem::take(&mut cell.portals),
                adjacent: std::mem::take(&mut cell.adjacent),
                ..ViewCell::of_hull(hull)
            };
        }
        graph.reason += &format!(
            " in a frame turned by {:.1}°, along which most walls stand",
            self.degrees()
        );
        graph
    }

    /// A box of this frame, in world space.
    fn turned_box(&self, bounds: &Bounds) -> CellHull {
        let mut shape = Hull::of_box(bounds);
        for point in &mut shape.points {
            *point = self.leave(DVec3::from(*point)).to_array();
        }
        // In the order of the faces of a box: the lower side of each axis, then the upper.
        let sides = (0..3).flat_map(|axis| [(axis, -1.0, -bounds.min[axis]), (axis, 1.0, bounds.max[axis])]);
        let planes = sides.map(|(axis, side, offset)| {
            let mut normal = DVec3::ZERO;
            normal[axis] = side;
            let normal = self.leave(normal);
            [normal.x, normal.y, normal.z, offset]
        });
        CellHull {
            planes: planes.collect(),
            shape,
        }
    }
}

impl Unturned {
    /// Puts objects and viewpoints back where they were.
    pub(crate) fn put_back(self, scene: &mut SourceScene) {
        for (object, matrix) in scene.objects.iter_mut().zip(self.objects) {
            object.world_from_object = matrix;
        }
        for (viewpoint, matrix) in scene.viewpoints.iter_mut().zip(self.viewpoints) {
            viewpoint.world_from_camera = matrix;
        }
    }
}

/// Calls with the direction, as a share of a right angle, and the area of each upright opaque face.
fn each_upright_face(scene: &SourceScene, visit: &mut dyn FnMut(f64, f64)) {
    let opaque = |material: Option<usize>| material.is_none_or(|m| !scene.materials[m].see_through);
    let ordinary = scene.objects.iter().filter(|object| object.role == Role::Ordinary);
    for object in ordinary {
        let matrix = &object.world_from_object;
        let primitives = &scene.models[object.model].primitives;
        for corners in primitives
            .iter()
            .filter(|p| opaque(p.material))
            .flat_map(|p| p.triangles())
        {
            let [a, b, c] = corners.map(|p| matrix.transform_point3(Vec3::from(p).as_dvec3()));
            let doubled = (b - a).cross(c - a);
            let area_m2 = 0.5 * doubled.length();
            if area_m2 > 0.0 && area_m2.is_finite() && doubled.y.abs() <= UPRIGHT * 2.0 * area_m2 {
                let right_angles = doubled.z.atan2(doubled.x) / std::f64::consts::FRAC_PI_2;
                visit(right_angles.rem_euclid(1.0), area_m2);
            }
        }
    }
}

fn sector(angle: f64) -> usize {
    ((angle * SECTORS as f64) as usize).min(SECTORS - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::city::City;

    const CITY: City = City {
        blocks: [4, 3],
        ..City::DENSE
    };

    fn turned_by(degrees: f64) -> SourceScene {
        let mut scene = CITY.scene();
        let turn = DMat4::from_rotation_y(degrees.to_radians());
        for object in &mut scene.objects {
            object.world_from_object = turn * object.world_from_object;
        }
        scene
    }

    #[test]
    fn a_turned_city_is_found_whichever_way_it_is_turned() {
        for degrees in [-44.0, -17.0, 0.4, 30.0, 44.9, 60.0, 107.0] {
            let frame = Frame::of(&turned_by(degrees));
            // About +Y, so that z becomes x; a quarter turn more or less is the same.
            let wanted = (-degrees + 45.0).rem_euclid(90.0) - 45.0;
            assert!(
                (frame.degrees() - wanted).abs() < 1e-3,
                "{degrees}: {}",
                frame.degrees()
            );
        }
    }

    #[test]
    fn a_world_along_the_axes_and_one_without_walls_stay_as_they_are() {
        assert_eq!(Frame::of(&CITY.scene()), Frame::SOURCE);
        assert_eq!(Frame::of(&SourceScene::default()), Frame::SOURCE);
        assert!(Frame::of(&turned_by(90.0)).degrees().abs() < 1e-3);
    }

    #[test]
    fn a_house_that_moves_or_turns_changes_no_frame() {
        let mut scene = turned_by(17.0);
        let before = Frame::of(&scene);
        let house = &mut scene.objects[5].world_from_object;
        *house = DMat4::from_translation(DVec3::new(3.0, 0.0, 1.0)) * *house * DMat4::from_rotation_y(0.01);
        assert_eq!(Frame::of(&scene), before);
    }

    #[test]
    fn cells_come_back_as_hulls_that_meet_to_the_last_bit() {
        let frame = Frame::of(&turned_by(17.0));
        let [left, right] = [[-3.25, 1.0], [1.0, 7.75]].map(|[low, high]| Bounds {
            min: [low, 0.0, -1.5],
            max: [high, 3.0, 2.25],
        });
        let [a, b] = [left, right].map(|bounds| frame.turned_box(&bounds));
        let (upper, lower) = (a.planes[1], b.planes[0]);
        assert_eq!(upper, lower.map(|x| -x), "the same plane from both sides");
        let shared = |hull: &CellHull, face: usize| -> Vec<[f64; 3]> {
            let mut corners: Vec<_> = hull.corners_of(face).map(|p| p.to_array()).collect();
            corners.sort_by(|a, b| a.partial_cmp(b).unwrap());
            corners
        };
        assert_eq!(shared(&a, 1), shared(&b, 0));
        for hull in [&a, &b] {
            let middle: DVec3 = hull.shape.points.iter().map(|p| DVec3::from(*p)).sum::<DVec3>() / 8.0;
            for (face, half) in hull.planes.iter().enumerate() {
                let normal = DVec3::new(half[0], half[1], half[2]);
                assert!(normal.dot(middle) < half[3], "it looks outwards");
                assert!(hull.corners_of(face).all(|p| (normal.dot(p) - half[3]).abs() < 1e-12));
            }
        }
        let back = frame.box_around(&a.bounds(), &a.planes);
        let off = (0..3).map(|i| (back.min[i] - left.min[i]).abs() + (back.max[i] - left.max[i]).abs());
        assert!(off.sum::<f64>() < 1e-12, "{back:?}");
        let loose = frame.box_around(&a.bounds(), &[]);
        assert!(loose.contains(back.min) && loose.contains(back.max));
    }
}
