//! Through which openings do cells touch?
//!
//! Unblocked grid faces between reached voxels of two boxes, merged greedily to rectangles for each plane.

use glam::Vec3;

use super::{grid::IndexBox, voxels::Voxels};

/// An opening of more rectangles than this between two cells in one plane, as in foliage, becomes their bounding
/// rectangle.
const MAX_RECTANGLES: usize = 24;

/// A rectangle between two cells.
pub(super) struct Opening {
    pub(super) cells: [u32; 2],
    /// In order around it.
    pub(super) corners: [Vec3; 4],
}

/// A voxel face between two cells. Sorts so that faces of one plane and pair stand together, row by row.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Face {
    cells: [u32; 2],
    axis: usize,
    plane: usize,
    v: usize,
    u: usize,
}

/// A rectangle of faces: rows `v[0]..v[1]`, columns `u[0]..u[1]`.
#[derive(Clone, Copy)]
struct Rectangle {
    u: [usize; 2],
    v: [usize; 2],
}

/// All openings, rising by pair of cells.
pub(super) fn openings(voxels: &Voxels, leaves: &[IndexBox]) -> Vec<Opening> {
    let mut faces = faces(voxels, leaves);
    faces.sort_unstable();
    let plane_of = |face: &Face| (face.cells, face.axis, face.plane);
    faces
        .chunk_by(|a, b| plane_of(a) == plane_of(b))
        .flat_map(|faces| {
            let first = faces[0];
            rectangles(faces).into_iter().map(move |rectangle| Opening {
                cells: first.cells,
                corners: corners(voxels, &first, &rectangle),
            })
        })
        .collect()
}

fn faces(voxels: &Voxels, leaves: &[IndexBox]) -> Vec<Face> {
    const NONE: u32 = u32::MAX;
    let [nx, ny, nz] = voxels.grid.size();
    let mut owner = vec![NONE; nx * ny * nz];
    let index = |[x, y, z]: [usize; 3]| (z * ny + y) * nx + x;
    let each = |leaf: &IndexBox| {
        let (min, max) = (leaf.min, leaf.max);
        (min[2]..max[2]).flat_map(move |z| (min[1]..max[1]).flat_map(move |y| (min[0]..max[0]).map(move |x| [x, y, z])))
    };
    for (id, leaf) in leaves.iter().enumerate() {
        for voxel in each(leaf).filter(|voxel| voxels.reached(*voxel)) {
            owner[index(voxel)] = id as u32;
        }
    }
    let mut faces = Vec::new();
    for (id, leaf) in leaves.iter().enumerate() {
        for axis in 0..3 {
            // Cells are boxes, but a neighbour may touch anywhere that a shrunk box ends, so look at the low layers.
            let mut layer = *leaf;
            layer.max[axis] = (leaf.min[axis] + 2).min(leaf.max[axis]);
            for voxel in each(&layer).filter(|voxel| voxel[axis] > 0) {
                let mut before = voxel;
                before[axis] -= 1;
                let (here, there) = (owner[index(voxel)], owner[index(before)]);
                let apart = here == id as u32 && there != NONE && there != here;
                if apart && !voxels.wall_below(voxel, axis) {
                    faces.push(Face {
                        cells: [here.min(there), here.max(there)],
                        axis,
                        plane: voxel[axis],
                        v: voxel[(axis + 2) % 3],
                        u: voxel[(axis + 1) % 3],
                    });
                }
            }
        }
    }
    faces
}

/// Merges sorted faces of one plane.
fn rectangles(faces: &[Face]) -> Vec<Rectangle> {
    let mut done = vec![false; faces.len()];
    let find = |u: usize, v: usize| faces.binary_search_by_key(&(v, u), |face| (face.v, face.u)).ok();
    let mut rectangles = Vec::new();
    for start in 0..faces.len() {
        if done[start] {
            continue;
        }
        let Face { u, v, .. } = faces[start];
        let open = |done: &[bool], u: usize, v: usize| find(u, v).filter(|i| !done[*i]);
        let mut u_end = u + 1;
        while open(&done, u_end, v).is_some() {
            u_end += 1;
        }
        let mut v_end = v + 1;
        while (u..u_end).all(|u| open(&done, u, v_end).is_some()) {
            v_end += 1;
        }
        for row in v..v_end {
            for column in u..u_end {
                if let Some(index) = find(column, row) {
                    done[index] = true;
                }
            }
        }
        rectangles.push(Rectangle {
            u: [u, u_end],
            v: [v, v_end],
        });
    }
    if rectangles.len() > MAX_RECTANGLES {
        let around = |a: [usize; 2], b: [usize; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        let whole = rectangles.iter().copied().reduce(|a, b| Rectangle {
            u: around(a.u, b.u),
            v: around(a.v, b.v),
        });
        rectangles = whole.into_iter().collect();
    }
    rectangles
}

fn corners(voxels: &Voxels, face: &Face, rectangle: &Rectangle) -> [Vec3; 4] {
    let (u, v) = ((face.axis + 1) % 3, (face.axis + 2) % 3);
    [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| {
        let mut corner = Vec3::ZERO;
        corner[face.axis] = voxels.grid.lines(face.axis)[face.plane];
        corner[u] = voxels.grid.lines(u)[rectangle.u[i]];
        corner[v] = voxels.grid.lines(v)[rectangle.v[j]];
        corner
    })
}
