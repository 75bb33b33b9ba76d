//! What does a part look like that is grown anew, by itself? In another pose, or with less detail.

use std::collections::BTreeMap;

use belvedere_scene::procedural::{Loader, Program, Recipe, Settings, Surface, grow};

use super::scene::{Rules, material, primitive};
use crate::import::ImportError;
use crate::source::{Primitive, SourceScene};

/// Grows parts of one model by themselves, with the materials of its scene.
pub(super) struct Alone<'a> {
    pub(super) rules: &'a Rules,
    pub(super) settings: &'a Settings,
    /// The materials of the whole model.
    pub(super) surfaces: &'a [Surface],
    /// Where the scene has them.
    pub(super) material_of: &'a BTreeMap<usize, usize>,
    /// Materials that the whole model has not, and where they were added.
    pub(super) added: Vec<(Surface, usize)>,
}

impl Alone<'_> {
    /// The rules of nothing but a part.
    pub(super) fn program(&self, recipe: &Recipe) -> Result<Program, ImportError> {
        Ok(Program::read("alone", recipe.text(), &Known(&self.rules.0))?)
    }

    /// Its triangles.
    pub(super) fn grow(
        &mut self,
        program: &Program,
        detail: u32,
        scene: &mut SourceScene,
    ) -> Result<Vec<Primitive>, ImportError> {
        let settings = Settings {
            parameters: BTreeMap::new(),
            detail,
            ..self.settings.clone()
        };
        let grown = grow(program, &settings)?;
        let meshes = grown.parts.get(1).map_or(&[][..], |part| part.meshes.as_slice());
        let drawn = meshes.iter().map(|mesh| {
            let material = self.material(&grown.materials[mesh.material], scene);
            primitive(mesh, Some(material))
        });
        Ok(drawn.filter(|primitive| !primitive.indices.is_empty()).collect())
    }

    fn material(&mut self, surface: &Surface, scene: &mut SourceScene) -> usize {
        let known = self.surfaces.iter().position(|known| known == surface);
        let known = known.and_then(|index| self.material_of.get(&index).copied());
        let again = || {
            self.added
                .iter()
                .find(|(known, _)| known == surface)
                .map(|(_, index)| *index)
        };
        known.or_else(again).unwrap_or_else(|| {
            scene.materials.push(material(surface));
            self.added.push((surface.clone(), scene.materials.len() - 1));
            scene.materials.len() - 1
        })
    }
}

/// Files that were read already.
struct Known<'t>(&'t BTreeMap<String, String>);

impl Loader for Known<'_> {
    fn load(&self, path: &str) -> Result<String, String> {
        self.0
            .get(path)
            .cloned()
            .ok_or_else(|| "it was not read before".to_owned())
    }
}
