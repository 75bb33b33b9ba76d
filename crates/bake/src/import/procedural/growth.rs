//! What came of rules: what they grew, the scene that it makes, and what is to be said where that is none.

use belvedere_scene::procedural::{Grown, Program};

use super::scene;
use crate::defect::Defects;
use crate::source::SourceScene;

/// Rules, what grew out of them, and the scene that it makes.
#[derive(Debug)]
pub struct Growth {
    /// The rules.
    pub program: Program,
    /// What they grew.
    pub grown: Grown,
    /// The same as a source scene, with the glTF files that it places.
    pub scene: SourceScene,
    /// What its geometry and that of these files would take at 12 bytes for each vertex and 6 for each triangle.
    pub explicit_bytes: u64,
    /// What was wrong with those, and with the rules.
    pub defects: Defects,
}

impl Growth {
    /// Triangles without area, each part once: they grow and are counted, but no scene has them.
    #[must_use]
    pub fn without_area(&self) -> u64 {
        scene::without_area(&self.grown)
    }

    /// Why a scene without objects has none.
    #[must_use]
    pub fn nothing_drawn(&self) -> &'static str {
        let authored = &self.scene.authored;
        let shapes = [&authored.cells, &authored.portals, &authored.occluders];
        if shapes.iter().any(|shapes| !shapes.is_empty()) {
            "the rules draw nothing: what is called `cell:`, `portal:` or `occluder:` is for the bake and no object; draw something \
             beside it"
        } else if self.without_area() > 0 {
            "the rules draw nothing: none of their triangles has an area; give solids lengths above 0"
        } else {
            "the rules draw nothing: a rule draws when it is called, at last by a statement outside of rules"
        }
    }
}
