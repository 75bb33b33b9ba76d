//! Why can an object not be seen from a view cell? The proof, in terms of what is published.
//!
//! A cell too large for one proof is halved, and at last cut into parts together with the object, as the bake does: an object
//! whose parts are all hidden from every part is hidden.

use belvedere_bake::{
    occluders::{Region, Wall},
    visibility::{
        conservative::{ConservativeSettings, Observer},
        narrow::Scout,
        prover::Witness,
        surface::Surface,
    },
};
use belvedere_scene::{Bounds, ObjectId};
use glam::{DVec3, Vec3};
use serde::Serialize;

use super::Blockers;

/// How hard a proof is tried.
const SETTINGS: ConservativeSettings = ConservativeSettings {
    halvings: 5,
    cuts: 1 << 14,
    steps: u32::MAX,
    ..ConservativeSettings::ON_LINE
};

/// Knows the faces of one object.
struct Faces(Option<Surface>);

impl Scout for Faces {
    fn glances(&mut self, _: u32, _: &Region) -> bool {
        false
    }

    fn surface(&self, _: u32) -> Option<Surface> {
        self.0.clone()
    }

    fn looks(&mut self, _: u32, _: &Region, _: &Surface, _: &[Region]) -> bool {
        false
    }
}

/// What blocks every sight line from a part of a cell to the box around an object. All lengths in world space, metres.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "by", rename_all = "lowercase")]
pub enum Hiding {
    /// One convex body.
    Body {
        /// The object that it lies in.
        object: ObjectId,
        /// The box around it.
        bounds: Bounds,
    },
    /// Walls one after the other: what an opening of one lets through, another stops.
    Walls {
        /// At least one.
        walls: Vec<Plane>,
    },
    /// Bodies of several nearer objects together.
    Bodies,
}

/// The plane of a wall: where `normal · p = offset_m`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plane {
    /// A unit vector.
    pub normal: [f32; 3],
    /// How far it is from the origin of the world along the normal.
    pub offset_m: f64,
    /// The box around the wall, its openings included.
    pub bounds: Bounds,
}

impl Blockers {
    /// What hides an object from all of a region while all doors are open, each reason once; `None` when
    /// that cannot be proved, or there is no such object. Of an object whose triangles are not known, in world space, the box
    /// around it is looked at.
    #[must_use]
    pub fn hiding(&self, eye: &Region, object: ObjectId, triangles: &[[DVec3; 3]]) -> Option<Vec<Hiding>> {
        // An object without geometry is seen by nobody, but there is nothing that hides it.
        self.scenery.targets.get(object.0 as usize)?.as_ref()?;
        let relative = |p: DVec3| (self.frame.enter(p) - self.origin).as_vec3();
        let faces = Surface::of_triangles(triangles.iter().map(|corners| corners.map(relative)));
        let mut observer = Observer::new(&self.scenery, SETTINGS);
        let found = observer.reasons(eye, object.0, &mut Faces(faces))?;
        let mut told: Vec<Hiding> = Vec::new();
        for witness in found {
            let hiding = self.told(&witness);
            if !told.contains(&hiding) {
                told.push(hiding);
            }
        }
        Some(told)
    }

    fn told(&self, witness: &Witness) -> Hiding {
        let occluders = &self.scenery.blocker.occluders;
        match witness {
            Witness::Body(index) => {
                let body = &occluders.bodies[*index as usize];
                Hiding::Body {
                    object: ObjectId(body.object),
                    bounds: self.absolute([body.min, body.max]),
                }
            }
            Witness::Walls(walls) => Hiding::Walls {
                walls: walls
                    .iter()
                    .map(|index| self.plane(&occluders.walls[*index as usize]))
                    .collect(),
            },
            Witness::Fused => Hiding::Bodies,
        }
    }

    fn plane(&self, wall: &Wall) -> Plane {
        let normal = wall.normal.as_dvec3();
        Plane {
            normal: self.frame.leave(normal).as_vec3().to_array(),
            offset_m: f64::from(wall.offset) + normal.dot(self.origin),
            bounds: self.absolute(wall.around()),
        }
    }

    /// The box in world space around a box of the frame.
    pub(super) fn absolute(&self, [min, max]: [Vec3; 2]) -> Bounds {
        let [min, max] = [min, max].map(|p| (self.origin + p.as_dvec3()).to_array());
        let in_frame = Bounds { min, max };
        if self.frame.is_source() {
            return in_frame;
        }
        let corners = in_frame.corners().map(|p| self.frame.leave(DVec3::from(p)).to_array());
        Bounds::around(corners)
    }
}
