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
//! 4. [`merge`]: cuts after which about the same is seen on both sides are taken back;
//! 5. [`mod@rejoin`]: so are those on both sides of which about the same is published;
//! 6. [`portals`]: unblocked grid faces between two boxes, merged to rectangles.
//!
//! Where an author drew cells, these are the cells instead: [`author`].
//!
//! Departures: Haumont floods from a distance field and finds portals at its necks; here, as in Teller's work, large
//! planes decide, which is stable in furnished rooms. Clutter does not split: a cell may contain furniture.
//!
//! Guarantee: cells are disjoint; every voxel that can be reached lies in exactly one; voxels are closed against walls
//! to within one voxel. Cost: linear in triangles and in voxels times the depth of the partition.

pub mod author;
mod built;
mod doors;
mod eye_level;
mod flaw;
mod grid;
mod hull;
mod merge;
mod near;
mod overlap;
mod partition;
mod portals;
mod rejoin;
mod shared_planes;
mod view_cell;
mod voxels;

#[cfg(test)]
mod author_tests;
#[cfg(test)]
pub(crate) mod plan;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use belvedere_scene::Bounds;

use crate::{
    progress::{Cancelled, Progress, Stage},
    world::World,
};
pub use flaw::{AuthorError, CellFlaw};
use grid::Grid;
pub use hull::CellHull;
pub(crate) use hull::clipped;
use partition::Tree;
pub use rejoin::{Look, Partition};
pub(crate) use view_cell::CellsByPlace;
pub use view_cell::{CellGraph, Portal, ViewCell};
use voxels::Voxels;
pub(crate) use voxels::meets_box;

/// How to cut.
#[derive(Debug, Clone, PartialEq)]
pub struct CellSettings {
    /// Voxels are at least this large, in metres, in a scene of a building's size or more. A door must hold three.
    pub voxel_m: f32,
    /// At most about this many voxels; larger scenes get larger voxels.
    pub max_voxels: usize,
    /// Cells without walls are cut until no horizontal edge is longer, in metres, or longer than the next, whichever is
    /// more.
    pub max_cell_m: f32,
    /// The same as a share of the scene's longest edge.
    pub max_cell_share: f32,
    /// At most this many cells; in a scene of few objects at most as many as there are objects, in one of many fewer.
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
            max_cell_share: 0.125,
            max_cells: 4096,
            wall_share: 0.3,
            min_enclosed_share: 0.02,
        }
    }
}

/// So many cells a scene may have however few objects it holds; where there are more, as many as objects …
const FEW_CELLS: usize = 128;
/// … and beyond so many one more for every [`SPARSE`] objects: who looks from each of them sees many of them.
const MANY_CELLS: usize = 1024;
const SPARSE: usize = 4;

/// No cell without walls is longer than so many times what a cell would be were they all of one size.
const SPREAD: f32 = 2.0;

/// Before cells are merged there may be so many times as many …
const TRIALS: usize = 2;
/// … and none is larger than this share of what it may be without an estimate.
const FINER: f32 = 0.5;

/// Estimates what each cell sees, rising.
pub type Estimate<'a> = dyn Fn(&CellGraph) -> Result<Vec<Vec<u32>>, Cancelled> + 'a;

/// Cuts the free space of a world into cells by its walls alone. Viewpoints are in world space; where there are none,
/// all open space and every large enclosed space counts as reachable.
///
/// # Errors
/// When cancelled.
pub fn build(
    world: &World,
    viewpoints: &[[f64; 3]],
    settings: &CellSettings,
    progress: &dyn Progress,
) -> Result<CellGraph, Cancelled> {
    Ok(cut(world, viewpoints, settings, None, progress)?.graph(world))
}

/// As [`build`], but cut finer where that makes visible sets smaller and less fine where it does not.
///
/// # Errors
/// When cancelled.
pub fn build_refined(
    world: &World,
    viewpoints: &[[f64; 3]],
    settings: &CellSettings,
    estimate: &Estimate,
    progress: &dyn Progress,
) -> Result<Partition, Cancelled> {
    cut(world, viewpoints, settings, Some(estimate), progress)
}

fn cut(
    world: &World,
    viewpoints: &[[f64; 3]],
    settings: &CellSettings,
    estimate: Option<&Estimate>,
    progress: &dyn Progress,
) -> Result<Partition, Cancelled> {
    const STEPS: u64 = 4;
    progress.start(Stage::Cells, STEPS);
    let step = || {
        progress.advance(1);
        if progress.cancelled() { Err(Cancelled) } else { Ok(()) }
    };
    let seeds: Vec<_> = viewpoints.iter().map(|p| world.relative(*p)).collect();
    let grid = Grid::over(world, &seeds, settings);
    step()?;
    let mut voxels = Voxels::new(grid);
    voxels.block(world, progress)?;
    step()?;
    voxels.reach(world, &seeds, settings.min_enclosed_share);
    step()?;
    let voxels = Arc::new(voxels);
    let most = settings.max_cells.min(most_cells(world.object_bounds().len()));
    let Some(estimate) = estimate else {
        let tree = Tree::cut(&voxels, settings, most);
        step()?;
        let unknown = vec![Vec::new(); tree.leaves().len()];
        return Ok(Partition::new(tree, unknown));
    };
    let settings = &CellSettings {
        max_cell_share: settings.max_cell_share.min(SPREAD / (most as f32).sqrt()),
        ..settings.clone()
    };
    let finer = CellSettings {
        max_cell_m: FINER * settings.max_cell_m,
        max_cell_share: FINER * settings.max_cell_share,
        ..settings.clone()
    };
    let mut tree = Tree::cut(&voxels, &finer, (TRIALS * most).min(settings.max_cells));
    step()?;
    let seen = estimate(&graph_of(world, &tree))?;
    // Merging: rays have been cast, and nobody takes that for a part of it.
    progress.start(Stage::Cells, 1);
    let (mut seen, few_enough) = merge::merge(&mut tree, &seen, most);
    step()?;
    if !few_enough {
        // Too many of them are held apart by walls: leave out the smallest walls.
        tree = Tree::cut(&voxels, settings, most);
        seen = estimate(&graph_of(world, &tree))?;
        progress.start(Stage::Cells, 1);
        seen = merge::merge(&mut tree, &seen, most).0;
        step()?;
    }
    Ok(Partition::new(tree, seen))
}

/// How many cells are worth it: where a handful of objects stand, a cell more tells nobody more, and looking from very many
/// costs more than they spare.
fn most_cells(objects: usize) -> usize {
    objects.clamp(FEW_CELLS, MANY_CELLS) + objects.saturating_sub(MANY_CELLS) / SPARSE
}

/// The leaves of a tree as cells, with the openings between them.
fn graph_of(world: &World, tree: &Tree) -> CellGraph {
    let grid = &tree.voxels.grid;
    let leaves: Vec<_> = tree.leaves().into_iter().map(|leaf| tree.cell(leaf)).collect();
    let mut graph = CellGraph {
        cells: leaves
            .iter()
            .map(|leaf| ViewCell::of_box(absolute(world, grid.bounds(leaf))))
            .collect(),
        voxel_m: f64::from(grid.voxel_m()),
        reason: match leaves.len() {
            1 => "one cell".to_owned(),
            cells => format!("{cells} cells cut along walls"),
        },
    };
    for opening in portals::openings(&tree.voxels, &leaves) {
        graph.join(opening.cells, &opening.corners.map(|corner| world.absolute(corner)));
    }
    graph.settle();
    graph.name_doors(world);
    graph
}

fn absolute(world: &World, [min, max]: [glam::Vec3; 2]) -> Bounds {
    Bounds {
        min: world.absolute(min),
        max: world.absolute(max),
    }
}
