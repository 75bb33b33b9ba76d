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

/// From the cell that sees most objects (of equals the largest), looking at the middle of what it sees.
fn made_up(input: Input<'_>) -> Viewpoint {
    let rank = |(id, cell): &(usize, &ViewCell)| {
        let volume: f64 = cell.bounds.size_m().iter().product();
        (input.visibility[*id].objects.len(), volume)
    };
    let best = input.graph.cells.iter().enumerate().max_by(|a, b| {
        let (a, b) = (rank(a), rank(b));
        a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    let (id, cell) = best.expect("a graph has at least one cell");
    let mut eye = DVec3::from(cell.bounds.center());
    if (2.0..8.0).contains(&cell.bounds.size_m()[1]) {
        eye.y = cell.bounds.min[1] + EYE_HEIGHT_M;
    }
    let bounds = input.world.object_bounds();
    let seen = &input.visibility[id].objects;
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
    at("start".to_owned(), eye, looking(towards), input)
}

/// The orientation that looks along a direction with +Y up.
fn looking(towards: DVec3) -> DQuat {
    let back = -towards.try_normalize().unwrap_or(DVec3::NEG_Z);
    let right = DVec3::Y.cross(back).try_normalize().unwrap_or(DVec3::X);
    DQuat::from_mat3(&DMat3::from_cols(right, back.cross(right), back))
}

fn at(name: String, position: DVec3, orientation: DQuat, input: Input<'_>) -> Viewpoint {
    let distance = |cell: &ViewCell| cell.bounds.distance_m(position.to_array());
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
