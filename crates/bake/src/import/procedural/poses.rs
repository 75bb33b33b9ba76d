//! How does a part move whose impostor has frames? It is grown anew for each of them, with another `phase`. All are grown once, to say
//! what is wrong with them before anything else is done; where all together are large, again when they are drawn.

use std::collections::BTreeSet;
use std::sync::Arc;

use belvedere_scene::procedural::{DcgError, PHASE, Part, Recipe, Surface, Value, grow_part};

use super::alone::{Alone, drawn};
use crate::defect::Defects;
use crate::import::{ImportError, large};
use crate::source::{Frames, Primitive, SourceModel, SourceScene};

const NOT_ALONE: &str =
    "`frames` for a part that cannot be grown alone, as one that places others or takes on paint: one pose drawn";
const ALIKE: &str = "`frames` for a part that looks the same at each `phase`: all frames drawn alike; let `phase` move it, or leave `frames` out";

const TOO_LARGE: &str = "`impostor` of a part of which a frame has more than 1048576 triangles: no pictures; let it have fewer at that `phase`";

/// Most shapes of all poses of a source that are held at once.
const MOST_HELD: usize = large::MOST_PICTURED;

/// Gives a model the poses of its part, if that asks for frames. What cannot be grown alone has none, which is counted; what is too
/// large for pictures in one of them loses its wish.
pub(super) fn pose(
    model: &mut SourceModel,
    (part, recipe): (&Part, Option<&Recipe>),
    alone: &mut Alone<'_>,
    (scene, defects): (&mut SourceScene, &mut Defects),
) -> Result<(), ImportError> {
    let frames = part.impostor.map_or(1, |wish| wish.frames);
    // Those that are too large are told together.
    if frames < 2 || large::is_too_large(&model.primitives) {
        return Ok(());
    }
    let Some(recipe) = recipe else {
        defects.note(NOT_ALONE, 1, || part.name.clone());
        return Ok(());
    };
    let (mut poses, mut shapes, mut is_alike): (Vec<Vec<Primitive>>, _, _) = (Vec::new(), 0, true);
    let mut materials = BTreeSet::new();
    let room = MOST_HELD.saturating_sub(alone.budget.held_shapes());
    for frame in 0..frames {
        if alone.progress.cancelled() {
            return Err(ImportError::Cancelled);
        }
        let posed = at_phase(recipe, (frame, frames));
        let pose = alone.posed((&posed, part.asked), scene);
        let pose = pose.map_err(|error| in_frame(error, (frame, frames)))?;
        if large::is_too_large(&pose) {
            model.impostor = None;
            defects.note(TOO_LARGE, 1, || {
                format!("{}, frame {} of {frames}", part.name, frame + 1)
            });
            return Ok(());
        }
        shapes += large::shapes(&pose);
        materials.extend(pose.iter().filter_map(|primitive| primitive.material));
        is_alike &= poses.first().is_none_or(|first| *first == pose);
        if shapes > room {
            poses.truncate(1);
        }
        if shapes <= room || poses.is_empty() {
            poses.push(pose);
        }
    }
    if is_alike {
        defects.note(ALIKE, 1, || part.name.clone());
    }
    if shapes <= room {
        alone.budget.hold(shapes);
        model.poses = poses;
    } else {
        model.frames = Some(grown_later(recipe.clone(), frames, (alone, &materials)));
    }
    Ok(())
}

/// Frames that have grown once and grow again when they are drawn; their materials are these of the scene.
fn grown_later(recipe: Recipe, count: u32, (alone, materials): (&Alone<'_>, &BTreeSet<usize>)) -> Frames {
    let materials = alone.materials().filter(|(_, index)| materials.contains(index));
    let (surfaces, looks): (Vec<Surface>, Vec<Primitive>) = materials
        .map(|(surface, index)| {
            let look = Primitive {
                material: Some(index),
                ..Primitive::default()
            };
            (surface.clone(), look)
        })
        .unzip();
    let (program, settings) = (alone.program.clone(), alone.settings_alone());
    let grow = move |frame: u32| {
        let posed = at_phase(&recipe, (frame, count));
        let look = |surface: &Surface| surfaces.iter().position(|known| known == surface).unwrap_or_default();
        // It grew when it was read.
        grow_part(&program, (&posed, None), &settings).map_or_else(|_| Vec::new(), |grown| drawn(&grown, look))
    };
    Frames {
        count,
        grow: Arc::new(grow),
        looks,
    }
}

fn in_frame(mut error: Box<DcgError>, (frame, frames): (u32, u32)) -> Box<DcgError> {
    let (number, phase) = (frame + 1, phase(frame, frames));
    error.given = Some(format!(
        "this is frame {number} of {frames} of an impostor: `phase` is {phase} in it"
    ));
    error
}

fn phase(frame: u32, frames: u32) -> f64 {
    f64::from(frame) / f64::from(frames)
}

fn at_phase(recipe: &Recipe, (frame, frames): (u32, u32)) -> Recipe {
    let parameters = recipe.parameters.iter().map(|(name, value)| {
        let value = if name == PHASE {
            Value::Number(phase(frame, frames))
        } else {
            value.clone()
        };
        (name.clone(), value)
    });
    Recipe {
        parameters: parameters.collect(),
        ..recipe.clone()
    }
}
