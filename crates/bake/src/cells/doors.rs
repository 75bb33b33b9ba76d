//! Which door closes an opening? The one whose box covers it.

use belvedere_scene::Bounds;

use super::CellGraph;
use crate::{occluders::DOOR_GAP, world::World};

impl CellGraph {
    /// Names with each opening the door that closes it, if there is one: a door whose box, grown by the gap that a leaf
    /// may leave and across its leaf by a voxel, holds the whole opening.
    pub(super) fn name_doors(&mut self, world: &World) {
        let grown = |door: &u32| {
            let bounds = world.object_bounds()[*door as usize];
            let size = bounds.size_m();
            let gap_m = f64::from(DOOR_GAP) * size.into_iter().fold(0.0, f64::max);
            let thin = (0..3).min_by(|a, b| size[*a].total_cmp(&size[*b])).unwrap_or(0);
            let reach = |axis: usize| if axis == thin { gap_m.max(self.voxel_m) } else { gap_m };
            let covered = Bounds {
                min: [0, 1, 2].map(|axis| bounds.min[axis] - reach(axis)),
                max: [0, 1, 2].map(|axis| bounds.max[axis] + reach(axis)),
            };
            (*door, covered)
        };
        let doors: Vec<_> = world.doors().iter().map(grown).collect();
        for portal in self.cells.iter_mut().flat_map(|cell| &mut cell.portals) {
            let covers = |(_, covered): &&(u32, Bounds)| portal.polygon.iter().all(|corner| covered.contains(*corner));
            portal.door = doors.iter().find(covers).map(|(door, _)| *door);
        }
    }
}
