//! How does a part move whose impostor has frames? It is grown anew for each of them, with another `phase`.

use std::collections::BTreeMap;

use belvedere_scene::procedural::{Loader, PHASE, Part, Program, Recipe, Settings, Surface, Value, grow};

use super::scene::{Rules, material, primitive};
use crate::defect::Defects;
use crate::import::ImportError;
use crate::source::{Primitive, SourceScene};

/// The materials of the whole model, and where the scene has them.
pub(super) struct Palette<'g> {
    pub(super) surfaces: &'g [Surface],
    pub(super) material_of: &'g BTreeMap<usize, usize>,
}

/// The poses of a part that asks for frames; none for one that does not, or cannot be grown alone, which is counted.
pub(super) fn poses(
    scene: &mut SourceScene,
    part: &Part,
    palette: &Palette<'_>,
    (rules, settings, defects): (&Rules, &Settings, &mut Defects),
) -> Result<Vec<Vec<Primitive>>, ImportError> {
    let frames = part.impostor.map_or(1, |wish| wish.frames);
    if frames < 2 {
        return Ok(Vec::new());
    }
    let Some(recipe) = &part.recipe else {
        let kind = "`frames` for a part that places others or takes on paint, so that it cannot be grown alone: one pose drawn";
        defects.note(kind, 1, || part.name.clone());
        return Ok(Vec::new());
    };
    let mut added: Vec<(Surface, usize)> = Vec::new();
    let pose = |frame: u32| {
        let phase = Value::Number(f64::from(frame) / f64::from(frames));
        let program = Program::read("frames", at_phase(recipe, &phase).text(), &Known(&rules.0))?;
        let settings = Settings {
            parameters: BTreeMap::new(),
            ..settings.clone()
        };
        let grown = grow(&program, &settings)?;
        let meshes = grown.parts.get(1).map_or(&[][..], |part| part.meshes.as_slice());
        let mut primitives = Vec::new();
        for mesh in meshes {
            let surface = &grown.materials[mesh.material];
            let known = palette.surfaces.iter().position(|known| known == surface);
            let known = known.and_then(|index| palette.material_of.get(&index).copied());
            let again = || {
                added
                    .iter()
                    .find(|(known, _)| known == surface)
                    .map(|(_, index)| *index)
            };
            let index = known.or_else(again).unwrap_or_else(|| {
                scene.materials.push(material(surface));
                added.push((surface.clone(), scene.materials.len() - 1));
                scene.materials.len() - 1
            });
            let drawn = primitive(mesh, Some(index));
            primitives.extend((!drawn.indices.is_empty()).then_some(drawn));
        }
        Ok(primitives)
    };
    (0..frames).map(pose).collect()
}

fn at_phase(recipe: &Recipe, phase: &Value) -> Recipe {
    let parameters = recipe.parameters.iter().map(|(name, value)| {
        let value = if name == PHASE { phase } else { value };
        (name.clone(), value.clone())
    });
    Recipe {
        parameters: parameters.collect(),
        ..recipe.clone()
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
