//! What does an eye see of an object? Where it stands, what it is, how large it looks, and how many pixels an error covers
//! (thesis on walkthroughs, §6.3): `e` metres at distance `d` are `e · h / (2 d tan(α/2))` of `h` pixels under the vertical
//! view angle `α`.

use std::sync::Arc;

use belvedere_scene::{
    Bounds, ModelId, ObjectId,
    object::{Model, ObjectEntry, SCREEN_HEIGHT_PX, VIEW_ANGLE_DEG},
    population::Member,
};

/// Who looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Eye {
    /// World space, metres.
    pub position: [f64; 3],
    /// Vertical view angle, radians.
    pub view_angle_rad: f64,
    /// Height of the picture in device pixels.
    pub height_px: f64,
}

impl Eye {
    /// An eye with the picture that the published switching distances are made for.
    #[must_use]
    pub fn at(position: [f64; 3]) -> Self {
        Self {
            position,
            view_angle_rad: VIEW_ANGLE_DEG.to_radians(),
            height_px: SCREEN_HEIGHT_PX,
        }
    }

    /// How many pixels a metre covers at a distance.
    #[must_use]
    pub fn px_per_m(&self, distance_m: f64) -> f64 {
        self.height_px / (2.0 * distance_m.max(0.05) * (self.view_angle_rad / 2.0).tan())
    }
}

/// An object that can be seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    /// The object.
    pub object: ObjectId,
    /// Its box in the world, metres; where it stands, while nobody knows how far it reaches.
    pub bounds: Bounds,
    /// `world_from_object`, column-major.
    pub transform: [f64; 16],
    /// What its model's errors are multiplied with to be metres.
    pub scale: f64,
    /// What is visible of it fills this solid angle, steradians.
    pub solid_angle_sr: f64,
    /// Its model …
    pub model: ModelId,
    /// … and what there is of that, shared by all objects that use it.
    pub geometry: Arc<Model>,
}

impl Seen {
    /// An object of the index that fills so many steradians.
    #[must_use]
    pub fn new(entry: &ObjectEntry, geometry: Arc<Model>, solid_angle_sr: f64) -> Self {
        Self {
            object: entry.object,
            bounds: entry.bounds,
            transform: entry.transform,
            scale: entry.scale,
            solid_angle_sr,
            model: entry.model,
            geometry,
        }
    }

    /// What stands for an object whose entry nobody has read: one of a population, with a model that can only be grown. It is
    /// drawn at its finest, so nothing depends on how far it reaches.
    #[must_use]
    pub fn stand_in(member: &Member, model: ModelId, geometry: Arc<Model>, solid_angle_sr: f64) -> Self {
        Self {
            object: member.object,
            bounds: Bounds {
                min: member.position,
                max: member.position,
            },
            transform: member.transform(),
            scale: member.scale,
            solid_angle_sr,
            model,
            geometry,
        }
    }

    /// Whether it stands for an object whose entry nobody has read.
    #[must_use]
    pub fn is_stand_in(&self) -> bool {
        self.geometry.levels.is_empty()
    }

    /// How many pixels an error in the model's space covers.
    #[must_use]
    pub fn error_px(&self, error: f64, eye: &Eye) -> f64 {
        error * self.scale * eye.px_per_m(self.bounds.distance_m(eye.position))
    }

    /// The error in the model's space that covers so many pixels.
    #[must_use]
    pub fn error_of_px(&self, px: f64, eye: &Eye) -> f64 {
        px / (self.scale * eye.px_per_m(self.bounds.distance_m(eye.position)))
    }
}
