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
/// Furniture is lower than this, in the same.
const OVER_FURNITURE_M: f32 = 2.0;
/// Less of a plane than this is no floor but tables.
const LEAST_FLOOR: f64 = 0.3;
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

/// Whether a box is one place for people: nearly all of its floor lies about as high, and little of it is rock or masonry. Over
/// people's heads only the latter counts.
pub(super) fn is_one_place(voxels: &Voxels, within: &IndexBox, over_heads: bool) -> bool {
    let grid = &voxels.grid;
    let lines = grid.lines(1);
    let highest = if over_heads {
        f32::INFINITY
    } else {
        lines[within.min[1]] + UNEVEN * HEADROOM_M * grid.metre()
    };
    let (mut all_m2, mut level_m2) = (0.0, 0.0);
    for z in within.min[2]..within.max[2] {
        for x in within.min[0]..within.max[0] {
            let area_m2 = f64::from(grid.width_m(0, x)) * f64::from(grid.width_m(2, z));
            all_m2 += area_m2;
            let lowest = (within.min[1]..within.max[1]).find(|y| voxels.reached([x, *y, z]));
            level_m2 += if lowest.is_some_and(|y| lines[y] <= highest) {
                area_m2
            } else {
                0.0
            };
        }
    }
    level_m2 >= OPEN_SHARE * all_m2
}

/// How much of a plane through a box is built, in m²: faces that lie in it, as those of walls and floors do and those of ground, rock
/// and leaves do not. What people see over, or walk around as around a table, is no wall and no floor; over their heads all counts.
pub(super) fn built_m2(voxels: &Voxels, within: &IndexBox, over_heads: bool, (axis, index): (usize, usize)) -> f64 {
    let grid = &voxels.grid;
    let lines = grid.lines(1);
    let over = lines[within.min[1]] + OVER_FURNITURE_M * grid.metre();
    let layer = lines.partition_point(|line| *line < over).min(within.max[1] - 1);
    let rows = match axis {
        1 => within.min[0]..within.max[0],
        _ if over_heads => within.min[1]..within.max[1],
        _ => layer..layer + 1,
    };
    let (u, v) = if axis == 1 { (2, 0) } else { (2 - axis, 1) };
    let (mut built_m2, mut all_m2) = (0.0, 0.0);
    for row in rows {
        for column in within.min[u]..within.max[u] {
            let mut voxel = [index; 3];
            (voxel[u], voxel[v]) = (column, row);
            let mut before = voxel;
            before[axis] -= 1;
            let area_m2 = f64::from(grid.width_m(u, column)) * f64::from(grid.width_m(v, row));
            if voxels.reached(voxel) || voxels.reached(before) {
                all_m2 += area_m2;
                built_m2 += if voxels.wall_below(voxel, axis) { area_m2 } else { 0.0 };
            }
        }
    }
    match axis {
        1 if built_m2 < LEAST_FLOOR * all_m2 => 0.0,
        1 => built_m2,
        _ if over_heads => built_m2,
        // As high as the box.
        _ => built_m2 * f64::from((lines[within.max[1]] - lines[within.min[1]]) / grid.width_m(1, layer)),
    }
}

/// Whether what lies below a plane is mostly a place to stand that is open above.
fn opens_at(voxels: &Voxels, within: &IndexBox, plane: usize, headroom: f32) -> bool {
    let grid = &voxels.grid;
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
