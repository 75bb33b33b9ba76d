//! What does a part look like that is grown anew, by itself? In another pose, or with less detail.

use std::collections::BTreeMap;

use belvedere_scene::procedural::{
    DcgError, Grown, Program, Recipe, SaidInFile, Settings, Surface, Watch, grow_part, grow_part_watched,
};

use super::scene::{material, primitive};
use crate::import::limits::Budget;
use crate::progress::Progress;
use crate::source::{Primitive, SourceScene};

/// Grows parts of one model by themselves, with the materials of its scene.
pub(super) struct Alone<'a> {
    pub(super) program: &'a Program,
    pub(super) settings: &'a Settings,
    /// The materials of the whole model.
    pub(super) surfaces: &'a [Surface],
    /// Where the scene has them.
    pub(super) material_of: &'a BTreeMap<usize, usize>,
    /// Materials that the whole model has not, and where they were added.
    pub(super) added: Vec<(Surface, usize)>,
    /// Counts the poses of the whole source that are held.
    pub(super) budget: &'a Budget,
    /// Who looks on.
    pub(super) progress: &'a dyn Progress,
    /// Hears of steps, and those that were taken so far.
    pub(super) watch: Watch<'a>,
    pub(super) steps: u64,
}

impl Alone<'_> {
    /// The triangles of a part with other detail.
    pub(super) fn coarser(
        &mut self,
        recipe: &Recipe,
        detail: u32,
        scene: &mut SourceScene,
    ) -> Result<Vec<Primitive>, Box<DcgError>> {
        let settings = Settings {
            detail,
            ..self.settings_alone()
        };
        let grown = grow_part(self.program, (recipe, None), &settings)?;
        Ok(drawn(&grown, |surface| self.material(surface, scene)))
    }

    /// The triangles of a part that was asked for where that is said, while its steps are told as more of the model's.
    pub(super) fn posed(
        &mut self,
        (recipe, asked): (&Recipe, Option<SaidInFile>),
        scene: &mut SourceScene,
    ) -> Result<Vec<Primitive>, Box<DcgError>> {
        let most = self.settings.limits.steps;
        let tell = |steps: u64| (self.watch)(self.steps.saturating_add(steps).min(most));
        let grown = grow_part_watched(self.program, (recipe, asked), &self.settings_alone(), &tell)?;
        self.steps = self.steps.saturating_add(grown.usage.steps).min(most);
        (self.watch)(self.steps);
        Ok(drawn(&grown, |surface| self.material(surface, scene)))
    }

    /// Its recipe says what it is given.
    pub(super) fn settings_alone(&self) -> Settings {
        Settings {
            parameters: BTreeMap::new(),
            ..self.settings.clone()
        }
    }

    /// The materials that there are so far, and where the scene has them.
    pub(super) fn materials(&self) -> impl Iterator<Item = (&Surface, usize)> {
        let own = self.surfaces.iter().enumerate();
        let own = own.filter_map(|(index, surface)| Some((surface, *self.material_of.get(&index)?)));
        own.chain(self.added.iter().map(|(surface, index)| (surface, *index)))
    }

    fn material(&mut self, surface: &Surface, scene: &mut SourceScene) -> usize {
        let known = self.materials().find(|(known, _)| *known == surface);
        if let Some((_, index)) = known {
            return index;
        }
        scene.materials.push(material(surface));
        self.added.push((surface.clone(), scene.materials.len() - 1));
        scene.materials.len() - 1
    }
}

/// The triangles of a part that has grown alone.
pub(super) fn drawn(grown: &Grown, mut material: impl FnMut(&Surface) -> usize) -> Vec<Primitive> {
    let meshes = grown.parts.get(1).map_or(&[][..], |part| part.meshes.as_slice());
    let drawn = meshes
        .iter()
        .map(|mesh| primitive(mesh, Some(material(&grown.materials[mesh.material]))));
    drawn.filter(|primitive| !primitive.indices.is_empty()).collect()
}
