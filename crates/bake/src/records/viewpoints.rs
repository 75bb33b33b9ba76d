//! Where may one start? The author's viewpoints with their cells, or one that we make up.

use belvedere_scene::{CellId, pointer::Viewpoint};
use glam::{DMat3, DQuat, DVec3};

use super::{
    Input,
    outlook::{self, End},
    standing::{Footing, Place},
};
use crate::{cells::ViewCell, source::SourceViewpoint};

/// Of so many of the best cells one that has room is chosen.
const TRIED_CELLS: usize = 64;

/// At least one.
pub(super) fn choose(input: Input<'_>) -> Vec<Viewpoint> {
    let given: Vec<_> = input
        .scene
        .viewpoints
        .iter()
        .filter_map(|v| from_author(v, input))
        .collect();
    if given.is_empty() { vec![made_up(input)] } else { given }
}

fn from_author(viewpoint: &SourceViewpoint, input: Input<'_>) -> Option<Viewpoint> {
    let (_, orientation, position) = viewpoint.world_from_camera.to_scale_rotation_translation();
    let sound = position.is_finite() && orientation.is_finite();
    sound.then(|| at(viewpoint.name.clone(), position, orientation.normalize(), input))
}

/// From a cell in which one can stand and that one can leave, if there is one, and of these the one that sees most objects (of equals the
/// largest) and has room to stand in. Who stands looks where most can be seen; who hangs in the air, at the middle of it.
fn made_up(input: Input<'_>) -> Viewpoint {
    let [_, world_m, _] = input.around().size_m();
    let cells = input.graph.cells.iter().enumerate();
    let mut ranked: Vec<_> = cells
        .map(|(id, cell)| {
            let volume: f64 = cell.bounds.size_m().iter().product();
            // A shut-in cell may be the inside of something.
            let is_shut_in = cell.adjacent.is_empty();
            let footing = Footing::in_cell(cell, world_m, input);
            (
                (footing, !is_shut_in),
                input.visibility.cells[id].objects.len(),
                volume,
                id,
            )
        })
        .collect();
    ranked.sort_by(|a, b| {
        (b.0, b.1)
            .cmp(&(a.0, a.1))
            .then(b.2.total_cmp(&a.2))
            .then(b.3.cmp(&a.3))
    });
    let tried = ranked.iter().take(TRIED_CELLS);
    let mut places = tried
        .map(|(.., id)| (*id, Place::in_cell(&input.graph.cells[*id], input)))
        .peekable();
    let first = places.peek().copied();
    let roomy = places.find(|(_, place)| place.is_roomy());
    let (id, place) = roomy.or(first).expect("a graph has at least one cell");
    let eye = place.eye;
    let end_of = |direction: DVec3| end_of_sight(eye, direction, input);
    let outlook = place.has_floor().then(|| outlook::best(end_of)).flatten();
    let orientation = looking(outlook.unwrap_or_else(|| level(to_middle_of_seen(eye, id, input), eye, input)));
    Viewpoint {
        made_up: true,
        ..at("start".to_owned(), eye, orientation, input)
    }
}

/// What hides all behind it, level with the eye.
fn end_of_sight(eye: DVec3, direction: DVec3, input: Input<'_>) -> Option<End> {
    let eye = input.world.relative(input.frame.enter(eye).to_array());
    let direction = input.frame.enter(direction).as_vec3();
    let end = input.world.cast(eye, direction, f32::INFINITY, &mut Vec::new())?;
    let [a, b, c] = input.world.triangle(end.triangle).corners;
    let normal = (b - a).cross(c - a).normalize_or_zero();
    Some(End {
        away_m: f64::from(end.t),
        face_on: f64::from(normal.dot(direction).abs()),
    })
}

/// From an eye to the middle of what can be seen from its cell.
fn to_middle_of_seen(eye: DVec3, cell: usize, input: Input<'_>) -> DVec3 {
    let bounds = input.bounds;
    let seen = &input.visibility.cells[cell].objects;
    let weight: f64 = seen.iter().map(|s| f64::from(s.solid_angle)).sum();
    let middle: DVec3 = seen
        .iter()
        .map(|s| f64::from(s.solid_angle) * DVec3::from(bounds[s.object as usize].center()))
        .sum();
    match weight > 0.0 {
        true => middle / weight - eye,
        false => DVec3::NEG_Z,
    }
}

/// A direction with less of its up and down; straight up or down becomes towards the middle of the scene.
fn level(towards: DVec3, eye: DVec3, input: Input<'_>) -> DVec3 {
    const STEEPEST: f64 = 0.4;
    let flat = DVec3::new(towards.x, 0.0, towards.z);
    let flat = if flat.length() > 0.3 * towards.length() {
        flat
    } else {
        let to_middle = DVec3::from(input.around().center()) - eye;
        DVec3::new(to_middle.x, 0.0, to_middle.z)
    };
    let flat = flat.try_normalize().unwrap_or(DVec3::NEG_Z);
    let slope = towards.y / towards.length().max(f64::MIN_POSITIVE);
    flat + DVec3::Y * slope.clamp(-STEEPEST, STEEPEST)
}

/// The orientation that looks along a direction with +Y up.
fn looking(towards: DVec3) -> DQuat {
    let back = -towards.try_normalize().unwrap_or(DVec3::NEG_Z);
    let right = DVec3::Y.cross(back).try_normalize().unwrap_or(DVec3::X);
    DQuat::from_mat3(&DMat3::from_cols(right, back.cross(right), back))
}

fn at(name: String, position: DVec3, orientation: DQuat, input: Input<'_>) -> Viewpoint {
    let distance = |cell: &ViewCell| cell.distance_m(position.to_array());
    let nearest = input
        .graph
        .cells
        .iter()
        .enumerate()
        .min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)));
    let (cell, _) = nearest.expect("a graph has at least one cell");
    Viewpoint {
        name,
        position: position.to_array(),
        orientation: orientation.to_array(),
        cell: CellId(cell as u32),
        made_up: false,
    }
}
