//! Where may one start? The author's viewpoints with their cells, or one that we make up.

use belvedere_scene::{CellId, pointer::Viewpoint};
use glam::{DMat3, DQuat, DVec3};

use super::Input;
use crate::{cells::ViewCell, source::SourceViewpoint};

/// Eye height over the floor where a cell is about as high as a room.
const EYE_HEIGHT_M: f64 = 1.65;

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

/// From a cell with a floor below it, if there is one, and of these the one that sees most objects (of equals the
/// largest), at eye height, looking level at the middle of what it sees.
fn made_up(input: Input<'_>) -> Viewpoint {
    let cells = input.graph.cells.iter().enumerate();
    let ranked = cells.map(|(id, cell)| {
        let volume: f64 = cell.bounds.size_m().iter().product();
        let floor_m = floor_below(cell, input);
        (
            floor_m.is_some(),
            input.visibility.cells[id].objects.len(),
            volume,
            id,
            floor_m,
        )
    });
    let best = ranked.max_by(|a, b| (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.total_cmp(&b.2)));
    let (_, _, _, id, floor_m) = best.expect("a graph has at least one cell");
    let cell = &input.graph.cells[id];
    let mut eye = DVec3::from(cell.center());
    if let Some(floor_m) = floor_m {
        let height_m = cell.bounds.max[1] - floor_m;
        eye.y = floor_m + EYE_HEIGHT_M.min(0.6 * height_m);
    }
    let bounds = input.bounds;
    let seen = &input.visibility.cells[id].objects;
    let weight: f64 = seen.iter().map(|s| f64::from(s.solid_angle)).sum();
    let middle: DVec3 = seen
        .iter()
        .map(|s| f64::from(s.solid_angle) * DVec3::from(bounds[s.object as usize].center()))
        .sum();
    let towards = if weight > 0.0 {
        middle / weight - eye
    } else {
        DVec3::NEG_Z
    };
    at("start".to_owned(), eye, looking(level(towards, eye, input)), input)
}

/// Where one would stand below the middle of a cell: the height of the first face that is seen from above.
fn floor_below(cell: &ViewCell, input: Input<'_>) -> Option<f64> {
    let eye = input.frame.enter(DVec3::from(cell.center()));
    let eye = input.world.relative(eye.to_array());
    let mut passed = Vec::new();
    let floor = input.world.cast(eye, glam::Vec3::NEG_Y, f32::INFINITY, &mut passed)?;
    let from_behind = passed.iter().any(|hit| input.world.triangle(hit.triangle).hides());
    let height_m = cell.center()[1] - f64::from(floor.t);
    (!from_behind && height_m < cell.bounds.max[1]).then_some(height_m)
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
    }
}
