//! Where can an eye be?
//!
//! Cuts the free space into view cells: disjoint boxes from all over which about the same things are visible. Each
//! knows its neighbours and the openings (portals) that it shares with them.
//!
//! Method, after Haumont, Debeir & Sillion, *Volumetric cell-and-portal generation* (2003) and the k-d partition of
//! Teller & Séquin, *Visibility preprocessing for interactive walkthroughs* (1991):
//!
//! 1. [`grid`]: a rectilinear grid over the scene and some room around it, its lines snapped to the planes of large
//!    axis-aligned faces, so that walls lie on grid faces however thin they are;
//! 2. [`voxels`]: faces block grid faces or voxels; a flood from the viewpoints finds the space that can be reached;
//! 3. [`partition`]: boxes are split where the plane is mostly wall, then where they are too large, then shrunk to the
//!    space that can be reached;
//! 4. [`portals`]: unblocked grid faces between two boxes, merged to rectangles.
//!
//! Departures: Haumont floods from a distance field and finds portals at its necks; here, as in Teller's work, large
//! planes decide, which is stable in furnished rooms. Clutter does not split: a cell may contain furniture.
//!
//! Guarantee: cells are disjoint; every voxel that can be reached lies in exactly one; voxels are closed against walls
//! to within one voxel. Cost: linear in triangles and in voxels times the depth of the partition.

mod grid;
mod partition;
mod portals;
mod voxels;

#[cfg(test)]
pub(crate) mod plan;
#[cfg(test)]
mod tests;

use belvedere_scene::Bounds;

use crate::{
    progress::{Cancelled, Progress, Stage},
    world::World,
};
use grid::Grid;
pub(crate) use voxels::meets_box;

/// How to cut.
#[derive(Debug, Clone, PartialEq)]
pub struct CellSettings {
    /// Voxels are at least this large, in metres, in a scene of a building's size or more. A door must hold three.
    pub voxel_m: f32,
    /// At most about this many voxels; larger scenes get larger voxels.
    pub max_voxels: usize,
    /// Cells without walls are cut until no horizontal edge is longer, in metres, or longer than an eighth of the
    /// scene, whichever is more.
    pub max_cell_m: f32,
    /// At most this many cells, and at most as many as there are objects where those are more than a few.
    pub max_cells: usize,
    /// A plane splits a cell when at least this share of it is wall.
    pub wall_share: f64,
    /// Without viewpoints, enclosed spaces of at least this share of the free volume, or of a small room's, are kept, unless they are the
    /// inside of something solid.
    pub min_enclosed_share: f64,
}

impl Default for CellSettings {
    fn default() -> Self {
        Self {
            voxel_m: 0.25,
            max_voxels: 8_000_000,
            max_cell_m: 12.0,
            max_cells: 4096,
            wall_share: 0.3,
            min_enclosed_share: 0.02,
        }
    }
}

/// All view cells of a scene; a cell's index is its id. Neighbours in space have near ids.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CellGraph {
    /// At least one.
    pub cells: Vec<ViewCell>,
    /// The longest edge of a voxel inside the scene, in metres: openings smaller than that may be closed.
    pub voxel_m: f64,
}

/// A region of eye positions.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewCell {
    /// The region, in world space.
    pub bounds: Bounds,
    /// Openings to neighbours, by neighbour.
    pub portals: Vec<Portal>,
    /// Cells with which it shares an opening, rising.
    pub adjacent: Vec<u32>,
}

/// A rectangular opening between two cells. Both cells know it.
#[derive(Debug, Clone, PartialEq)]
pub struct Portal {
    /// Index of the cell on the other side.
    pub to: u32,
    /// Its corners in world space, in order around it.
    pub polygon: [[f64; 3]; 4],
    /// The object that closes it, if it is a door.
    pub door: Option<u32>,
}

impl CellGraph {
    /// The cell that contains a point in world space; the one with the smallest id where two touch.
    #[must_use]
    pub fn cell_at(&self, point: [f64; 3]) -> Option<u32> {
        self.cells
            .iter()
            .position(|cell| cell.bounds.contains(point))
            .map(|index| index as u32)
    }
}

/// So many cells a scene may have however few objects it holds.
const FEW_CELLS: usize = 128;

/// Cuts the free space of a world into cells. Viewpoints are in world space; where there are none, all open space
/// and every large enclosed space counts as reachable.
///
/// # Errors
/// When cancelled.
pub fn build(
    world: &World,
    viewpoints: &[[f64; 3]],
    settings: &CellSettings,
    progress: &dyn Progress,
) -> Result<CellGraph, Cancelled> {
    const STEPS: u64 = 4;
    progress.start(Stage::Cells, STEPS);
    let step = || {
        progress.advance(1);
        if progress.cancelled() { Err(Cancelled) } else { Ok(()) }
    };
    let seeds: Vec<_> = viewpoints.iter().map(|p| world.relative(*p)).collect();
    let grid = Grid::over(world, &seeds, settings);
    step()?;
    let mut voxels = voxels::Voxels::new(&grid);
    voxels.block(world, progress)?;
    step()?;
    voxels.reach(world, &seeds, settings.min_enclosed_share);
    step()?;
    // Where a handful of objects stand, a cell more tells nobody more.
    let worthwhile = world.object_bounds().len().max(FEW_CELLS);
    let leaves = partition::leaves(&voxels, settings, settings.max_cells.min(worthwhile));
    let openings = portals::openings(&voxels, &leaves);
    let mut cells: Vec<_> = leaves
        .iter()
        .map(|leaf| ViewCell {
            bounds: absolute(world, grid.bounds(leaf)),
            portals: Vec::new(),
            adjacent: Vec::new(),
        })
        .collect();
    for opening in openings {
        let polygon = opening.corners.map(|corner| world.absolute(corner));
        let [a, b] = opening.cells;
        cells[a as usize].portals.push(Portal {
            to: b,
            polygon,
            door: None,
        });
        cells[b as usize].portals.push(Portal {
            to: a,
            polygon,
            door: None,
        });
    }
    for cell in &mut cells {
        cell.portals.sort_by_key(|portal| portal.to);
        cell.adjacent = cell.portals.iter().map(|portal| portal.to).collect();
        cell.adjacent.dedup();
    }
    step()?;
    Ok(CellGraph {
        cells,
        voxel_m: f64::from(grid.voxel_m()),
    })
}

fn absolute(world: &World, [min, max]: [glam::Vec3; 2]) -> Bounds {
    Bounds {
        min: world.absolute(min),
        max: world.absolute(max),
    }
}
