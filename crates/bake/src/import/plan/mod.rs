//! What world does a floor plan describe?
//!
//! A `.plan` is a drawing in characters with a legend (`docs/PLAN.md`). [`parse()`] reads it once and checks all of it;
//! [`Plan::to_scene`] then cannot fail. The world is in metres, +Y is up, x grows to the right of the drawing (east), z
//! downwards (south); the drawing's upper left corner is the origin.
//!
//! Guarantee: the same text gives the same scene, byte for byte. Each room's floor, ceiling and four sides are objects of
//! their own, faces look only into the room, and no two faces of the building lie in each other. Equal furniture shares
//! one model. Cost: linear in tiles plus the triangles made.

mod drawing;
mod error;
mod finish;
mod headers;
mod kinds;
mod layout;
mod legend;
mod mesh;
mod opening;
mod outside;
mod parse;
mod place;
mod rng;
mod run;
mod shell;
#[cfg(test)]
mod tests;

pub use error::{PlanError, Problem};
pub use finish::Rgb;
pub use parse::{has_headers, parse};

use crate::source::{Role, SourceModel, SourceObject, SourceScene, SourceViewpoint};
use finish::Palette;
use glam::DMat4;
use layout::Layout;
use legend::RoomStyle;
use mesh::Mesh;
use place::Piece;
use std::collections::BTreeMap;

/// Most tiles on one side of a drawing.
pub const MAX_SIDE_TILES: usize = 1_024;
/// Most rooms of a plan.
pub const MAX_ROOMS: usize = 4_096;
/// Most pieces of furniture of a plan.
pub const MAX_PIECES: usize = 32_768;
/// Height of the eye at a viewpoint, metres.
pub const EYE_HEIGHT_M: f32 = 1.65;

/// A floor plan that was read and found sound.
#[derive(Debug, Clone)]
pub struct Plan {
    title: Option<String>,
    layout: Layout,
    rooms: Vec<Room>,
    pieces: Vec<Piece>,
    viewpoints: Vec<place::Viewpoint>,
}

/// A room: tiles that touch each other, walled off from all others.
#[derive(Debug, Clone)]
pub(crate) struct Room {
    name: String,
    style: RoomStyle,
}

/// A scene under construction: models are shared by key, object names are unique.
#[derive(Debug, Default)]
struct SceneBuilder {
    scene: SourceScene,
    palette: Palette,
    model_of: BTreeMap<String, usize>,
    used_names: BTreeMap<String, usize>,
}

impl SceneBuilder {
    /// The model called `key`, drawn on first use.
    fn model(&mut self, key: String, draw: impl FnOnce(&mut Mesh)) -> usize {
        if let Some(&model) = self.model_of.get(&key) {
            return model;
        }
        let mut mesh = Mesh::new();
        draw(&mut mesh);
        let model = mesh.into_model(key.clone(), &mut self.palette);
        self.scene.models.push(model);
        self.model_of.insert(key, self.scene.models.len() - 1);
        self.scene.models.len() - 1
    }

    /// A model used once, in place; nothing when it is empty.
    fn place_once(&mut self, name: String, mesh: Mesh) {
        let model: SourceModel = mesh.into_model(name.clone(), &mut self.palette);
        if !model.primitives.is_empty() {
            self.scene.models.push(model);
            self.place(name, self.scene.models.len() - 1, DMat4::IDENTITY);
        }
    }

    fn place(&mut self, name: String, model: usize, world_from_object: DMat4) {
        self.scene.objects.push(SourceObject {
            source_node: name,
            part: 0,
            model,
            world_from_object,
            role: Role::Ordinary,
        });
    }

    /// `Hall/bench 1`, `Hall/bench 2` …
    fn numbered(&mut self, stem: String) -> String {
        let count = self.used_names.entry(stem.clone()).or_insert(0);
        *count += 1;
        format!("{stem} {count}")
    }
}

impl Plan {
    /// The world that the plan describes.
    #[must_use]
    pub fn to_scene(&self) -> SourceScene {
        let mut builder = SceneBuilder::default();
        for index in 0..self.rooms.len() {
            shell::build_room(self, index, &mut builder);
        }
        opening::build_openings(self, &mut builder);
        outside::build_outside(self, &mut builder);
        for piece in &self.pieces {
            place::place_piece(self, piece, &mut builder);
        }
        let viewpoints = self.viewpoints.iter().map(|v| SourceViewpoint {
            name: v.name.clone(),
            world_from_camera: v.world_from_camera(),
        });
        let mut scene = builder.scene;
        scene.title.clone_from(&self.title);
        scene.materials = builder.palette.into_materials();
        scene.viewpoints = viewpoints.collect();
        scene
    }

    /// Names of the rooms, in reading order of the drawing.
    pub fn room_names(&self) -> impl Iterator<Item = &str> {
        self.rooms.iter().map(|room| room.name.as_str())
    }
}
