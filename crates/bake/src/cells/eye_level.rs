//! At which height does a street end and the air over it begin?
//!
//! Who walks in a street sees little of a town; who flies over it sees most. Cohen-Or & Zadicario, *Visibility streaming for
//! network-based walkthroughs* (1998), §4, measure cells at the height of people's eyes. So a tall free space with a floor is
//! cut by a level plane above the heads of those who stand on that floor, before it is cut any other way.

use super::{grid::IndexBox, voxels::Voxels};

/// Eyes of people who stand are lower than this, in metres; above the plane there is as much room again, or it is a room
/// like others.
const HEADROOM_M: f32 = 2.5;
/// The floor may rise so much, in the same.
const UNEVEN: f32 = 1.0;
/// Boxes that are lower than this, in the same, are rooms.
const LEAST_HEIGHT: f32 = 3.0;
/// The space above this share of the floor reaches up beyond the plane; the rest may lie under balconies and trees.
const OPEN_SHARE: f64 = 0.9;
/// This share of the bottom is floor, or nobody stands there.
const FLOOR_SHARE: f64 = 0.5;

/// The number of the layer of voxels that is the first above people's heads, in a box that is tall and open.
pub(super) fn plane_in(voxels: &Voxels, within: &IndexBox) -> Option<usize> {
    let lines = voxels.grid.lines(1);
    let (bottom, top) = (lines[within.min[1]], lines[within.max[1]]);
    let headroom = HEADROOM_M * voxels.grid.metre();
    if top - bottom < LEAST_HEIGHT * headroom {
        return None;
    }
    let from = lines.partition_point(|line| *line < bottom + headroom);
    let most = bottom + (1.0 + UNEVEN) * headroom;
    // Where voxels are taller than that, the first plane there is.
    let planes = (from..within.max[1]).take_while(|plane| *plane == from || lines[*plane] <= most);
    planes
        .filter(|plane| top - lines[*plane] >= headroom)
        .find(|plane| opens_at(voxels, within, *plane, headroom))
}

/// Whether what lies below a plane is mostly a place to stand that is open above.
fn opens_at(voxels: &Voxels, within: &IndexBox, plane: usize, headroom: f32) -> bool {
    let grid = voxels.grid;
    let lines = grid.lines(1);
    let above = lines.partition_point(|line| *line < lines[plane] + headroom);
    let (mut all_m2, mut open_m2, mut floor_m2) = (0.0, 0.0, 0.0);
    for z in within.min[2]..within.max[2] {
        for x in within.min[0]..within.max[0] {
            let Some(lowest) = (within.min[1]..plane).find(|y| voxels.reached([x, *y, z])) else {
                continue;
            };
            let area_m2 = f64::from(grid.width_m(0, x)) * f64::from(grid.width_m(2, z));
            all_m2 += area_m2;
            let column = [x, lowest, z];
            let floor = lowest == 0 || voxels.wall_below(column, 1) || voxels.solid([x, lowest - 1, z]);
            floor_m2 += if floor { area_m2 } else { 0.0 };
            let open = (lowest..above.min(within.max[1])).all(|y| {
                let voxel = [x, y, z];
                voxels.reached(voxel) && (y == lowest || !voxels.wall_below(voxel, 1))
            });
            open_m2 += if open { area_m2 } else { 0.0 };
        }
    }
    all_m2 > 0.0 && open_m2 >= OPEN_SHARE * all_m2 && floor_m2 >= FLOOR_SHARE * all_m2
}
