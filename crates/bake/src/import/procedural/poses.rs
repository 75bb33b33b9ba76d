//! How does a part move whose impostor has frames? It is grown anew for each of them, with another `phase`.

use belvedere_scene::procedural::{PHASE, Part, Recipe, Value};

use super::alone::Alone;
use crate::defect::Defects;
use crate::import::ImportError;
use crate::source::{Primitive, SourceScene};

/// The poses of a part that asks for frames; none for one that does not, or cannot be grown alone, which is counted.
pub(super) fn poses(
    part: &Part,
    alone: &mut Alone<'_>,
    scene: &mut SourceScene,
    defects: &mut Defects,
) -> Result<Vec<Vec<Primitive>>, ImportError> {
    let frames = part.impostor.map_or(1, |wish| wish.frames);
    if frames < 2 {
        return Ok(Vec::new());
    }
    let Some(recipe) = &part.recipe else {
        let kind = "`frames` for a part that cannot be grown alone, as one that places others or takes on paint: one pose drawn";
        defects.note(kind, 1, || part.name.clone());
        return Ok(Vec::new());
    };
    let pose = |frame: u32| {
        let phase = Value::Number(f64::from(frame) / f64::from(frames));
        let program = alone.program(&at_phase(recipe, &phase))?;
        alone.grow(&program, alone.settings.detail, scene)
    };
    let poses: Vec<Vec<Primitive>> = (0..frames).map(pose).collect::<Result<_, ImportError>>()?;
    if poses.iter().all(|pose| *pose == poses[0]) {
        let kind = "`frames` for a part that looks the same at each `phase`: all frames drawn alike; let `phase` move it, or leave `frames` out";
        defects.note(kind, 1, || part.name.clone());
    }
    Ok(poses)
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
