//! Which voxels can an eye get to?
//!
//! Faces on a grid plane block the voxel faces whose middle half they meet; all other faces make the voxels solid whose
//! inside they meet. Both are found with separating axes, the second by descending into boxes of voxels, so that cost
//! follows the surface. Then a flood through whatever is not blocked.

use glam::{Vec2, Vec3};

use super::grid::{Grid, IndexBox};
use crate::{
    progress::{Cancelled, Progress},
    world::World,
};

const SOLID: u8 = 1;
const REACHED: u8 = 16;
/// The face on a voxel's lower side along an axis is blocked.
const WALL: [u8; 3] = [2, 4, 8];
/// An enclosed space of fewer voxels than this is no place to stand: the inside of a thing.
const MIN_ROOM_VOXELS: u64 = 8;
/// An enclosed space of so many cubic metres is a room, however large the scene is.
const MIN_ROOM_M3: f64 = 6.0;
/// What is narrower than this, in metres, may be masonry, however long and high it is.
const NARROW_M: f32 = 1.0;
/// The share of a voxel's edge by which its inside is smaller.
const SHRINK: f32 = 0.01;
/// The share of a voxel face's edge that must stay clear of a face for it not to be blocked.
const FACE_CORE: f32 = 0.5;
/// So many places of an enclosed space are asked whether they lie behind surfaces instead of before them …
const PROBED_PLACES: u64 = 64;
/// … and with this share of looks ending on a back that is not drawn, the space is the inside of something solid.
const SOLID_SHARE: f64 = 0.8;
/// Triangles between two looks at whether to stop.
const CANCEL_EVERY: usize = 4096;

/// The state of each voxel.
pub(super) struct Voxels {
    pub(super) grid: Grid,
    size: [usize; 3],
    bits: Vec<u8>,
}

/// A connected part of free space.
struct Space {
    volume_m3: f64,
    voxels: u64,
    open: bool,
    /// The voxels at the corners of the box around it.
    corners: [[usize; 3]; 2],
}

impl Voxels {
    pub(super) fn new(grid: Grid) -> Self {
        let size = grid.size();
        Self {
            grid,
            size,
            bits: vec![0; size.iter().product()],
        }
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.size[1] + y) * self.size[0] + x
    }

    /// How far apart neighbours along an axis are in memory.
    fn stride(&self, axis: usize) -> usize {
        [1, self.size[0], self.size[0] * self.size[1]][axis]
    }

    fn voxel(&self, index: usize) -> [usize; 3] {
        let [nx, ny, _] = self.size;
        [index % nx, index / nx % ny, index / (nx * ny)]
    }

    /// Whether the flood came here.
    pub(super) fn reached(&self, voxel: [usize; 3]) -> bool {
        self.bits[self.index(voxel)] & REACHED != 0
    }

    /// Whether a face goes through its inside.
    pub(super) fn solid(&self, voxel: [usize; 3]) -> bool {
        self.bits[self.index(voxel)] & SOLID != 0
    }

    /// Whether something lies on its lower side along an axis.
    pub(super) fn wall_below(&self, voxel: [usize; 3], axis: usize) -> bool {
        self.bits[self.index(voxel)] & WALL[axis] != 0
    }

    /// Blocks what the faces of the world block. Faces that hide nothing, like glass, do not.
    pub(super) fn block(&mut self, world: &World, progress: &dyn Progress) -> Result<(), Cancelled> {
        for (count, triangle) in world.triangles().enumerate() {
            if count % CANCEL_EVERY == 0 && progress.cancelled() {
                return Err(Cancelled);
            }
            if triangle.hides() {
                match self.plane_of(&triangle.corners) {
                    Some((axis, plane)) => self.block_faces(&triangle.corners, axis, plane),
                    None => self.fill(&triangle.corners),
                }
            }
        }
        Ok(())
    }

    /// The axis and number of the grid line that a face lies on.
    fn plane_of(&self, corners: &[Vec3; 3]) -> Option<(usize, usize)> {
        let tolerance = self.grid.tolerance_m();
        (0..3).find_map(|axis| {
            let lines = self.grid.lines(axis);
            let near = lines.partition_point(|line| *line < corners[0][axis] - tolerance);
            let on = |line: &f32| corners.iter().all(|c| (c[axis] - line).abs() <= tolerance);
            lines.get(near).is_some_and(on).then_some((axis, near))
        })
    }

    fn block_faces(&mut self, corners: &[Vec3; 3], axis: usize, plane: usize) {
        if plane == self.size[axis] {
            return;
        }
        let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
        let flat = corners.map(|c| Vec2::new(c[u], c[v]));
        let min = flat[0].min(flat[1]).min(flat[2]);
        let max = flat[0].max(flat[1]).max(flat[2]);
        let [u_range, v_range] = [self.grid.range(u, min.x, max.x), self.grid.range(v, min.y, max.y)];
        for i in u_range[0]..u_range[1] {
            for j in v_range[0]..v_range[1] {
                let (du, dv) = (self.grid.width_m(u, i), self.grid.width_m(v, j));
                let center = Vec2::new(self.grid.lines(u)[i] + 0.5 * du, self.grid.lines(v)[j] + 0.5 * dv);
                if meets_rectangle(&flat.map(|c| c - center), 0.5 * FACE_CORE * Vec2::new(du, dv)) {
                    let mut voxel = [plane; 3];
                    (voxel[u], voxel[v]) = (i, j);
                    let index = self.index(voxel);
                    self.bits[index] |= WALL[axis];
                }
            }
        }
    }

    fn fill(&mut self, corners: &[Vec3; 3]) {
        let min = corners[0].min(corners[1]).min(corners[2]);
        let max = corners[0].max(corners[1]).max(corners[2]);
        let ranges = [0, 1, 2].map(|axis| self.grid.range(axis, min[axis], max[axis]));
        self.fill_box(
            corners,
            IndexBox {
                min: ranges.map(|r| r[0]),
                max: ranges.map(|r| r[1]),
            },
        );
    }

    fn fill_box(&mut self, corners: &[Vec3; 3], voxels: IndexBox) {
        let [min, max] = self.grid.bounds(&voxels);
        let (mut half, center) = (0.5 * (max - min), 0.5 * (min + max));
        let counts = [0, 1, 2].map(|axis| voxels.max[axis] - voxels.min[axis]);
        let single = counts == [1; 3];
        if single {
            half -= (SHRINK * Vec3::splat(self.grid.voxel_m())).min(0.1 * half);
        }
        if !meets_box(&corners.map(|c| c - center), half) {
            return;
        }
        if single {
            let index = self.index(voxels.min);
            self.bits[index] |= SOLID;
            return;
        }
        let axis = (0..3).max_by_key(|axis| counts[*axis]).unwrap_or(0);
        let middle = voxels.min[axis] + counts[axis] / 2;
        let (mut low, mut high) = (voxels, voxels);
        low.max[axis] = middle;
        high.min[axis] = middle;
        self.fill_box(corners, low);
        self.fill_box(corners, high);
    }

    /// Marks what can be reached: from the seeds, or, without any, all open space and large enclosed spaces that are not
    /// the inside of something solid. When nothing at all is free, everything counts as reached, so that there is always a place for an eye.
    pub(super) fn reach(&mut self, world: &World, seeds: &[Vec3], min_enclosed_share: f64) {
        let (labels, spaces) = self.spaces();
        let fits = |space: &Space| space.voxels >= MIN_ROOM_VOXELS || space.open;
        let free = |index: usize| spaces.get(labels[index] as usize).is_some_and(fits);
        let mut kept = vec![false; spaces.len()];
        let narrow_m = NARROW_M * self.grid.metre();
        let min_room_m3 = MIN_ROOM_M3 * f64::from(self.grid.metre()).powi(3);
        // The masonry of a wall is no room, even when somebody put an eye there.
        let mut masonry = vec![false; spaces.len()];
        for seed in seeds {
            let start = self.index(self.grid.voxel_at(*seed));
            while let Some(index) = self.nearest(start, |i| free(i) && !masonry[labels[i] as usize]) {
                let label = labels[index];
                let space = &spaces[label as usize];
                let small = space.volume_m3 < min_room_m3 || self.narrowest_m(space) < narrow_m;
                if small && !space.open && !kept[label as usize] && self.is_inside_a_solid(world, &labels, label, space)
                {
                    masonry[label as usize] = true;
                } else {
                    kept[label as usize] = true;
                    break;
                }
            }
        }
        if !kept.contains(&true) {
            let total: f64 = spaces.iter().map(|space| space.volume_m3).sum();
            for (label, space) in spaces.iter().enumerate() {
                let large = space.volume_m3 >= (min_enclosed_share * total).min(min_room_m3);
                kept[label] = space.open || (large && !self.is_inside_a_solid(world, &labels, label as u32, space));
            }
        }
        let nothing = !kept.contains(&true);
        for (bits, label) in self.bits.iter_mut().zip(&labels) {
            if nothing || kept.get(*label as usize) == Some(&true) {
                *bits |= REACHED;
            }
        }
    }

    /// The shortest edge of the box around a space.
    fn narrowest_m(&self, space: &Space) -> f32 {
        let [min, last] = space.corners;
        let [low, high] = self.grid.bounds(&IndexBox {
            min,
            max: last.map(|voxel| voxel + 1),
        });
        (high - low).min_element()
    }

    /// Whether looks from a space mostly end on backs of faces that are drawn from their front only: rock around a cave,
    /// masonry between rooms. Nobody stands there, and whoever did would see through everything.
    fn is_inside_a_solid(&self, world: &World, labels: &[u32], label: u32, space: &Space) -> bool {
        let every = (space.voxels / PROBED_PLACES).max(1) as usize;
        let places = (0..labels.len()).filter(|index| labels[*index] == label).step_by(every);
        let (mut looks, mut backs) = (0u32, 0u32);
        let mut passed = Vec::new();
        for index in places {
            let voxel = self.voxel(index);
            let end = [0, 1, 2].map(|axis| voxel[axis] + 1);
            let [min, max] = self.grid.bounds(&IndexBox { min: voxel, max: end });
            let eye = min.midpoint(max);
            // Off the axes, so that no look runs along a wall.
            for direction in [
                Vec3::new(1.0, 0.23, 0.37),
                Vec3::new(-0.31, 1.0, 0.19),
                Vec3::new(0.29, -0.17, 1.0),
            ] {
                for direction in [direction, -direction] {
                    let end = world.cast(eye, direction, f32::INFINITY, &mut passed);
                    let nearest = passed.iter().chain(&end).min_by(|a, b| a.t.total_cmp(&b.t));
                    if let Some(hit) = nearest {
                        let face = world.triangle(hit.triangle);
                        looks += 1;
                        backs += u32::from(face.hides() && !face.hides_from(eye));
                    }
                }
            }
        }
        f64::from(backs) > SOLID_SHARE * f64::from(looks)
    }

    /// The space each voxel belongs to, `u32::MAX` for solid ones.
    fn spaces(&self) -> (Vec<u32>, Vec<Space>) {
        const NONE: u32 = u32::MAX;
        let mut labels = vec![NONE; self.bits.len()];
        let mut spaces: Vec<Space> = Vec::new();
        let mut stack = Vec::new();
        for start in 0..self.bits.len() {
            if labels[start] != NONE || self.bits[start] & SOLID != 0 {
                continue;
            }
            let label = spaces.len() as u32;
            let mut space = Space {
                volume_m3: 0.0,
                voxels: 0,
                open: false,
                corners: [self.voxel(start); 2],
            };
            labels[start] = label;
            stack.push(start);
            while let Some(index) = stack.pop() {
                let voxel = self.voxel(index);
                space.voxels += 1;
                for (axis, at) in voxel.into_iter().enumerate() {
                    let [low, high] = [space.corners[0][axis], space.corners[1][axis]];
                    (space.corners[0][axis], space.corners[1][axis]) = (low.min(at), high.max(at));
                }
                space.volume_m3 += (0..3)
                    .map(|a| f64::from(self.grid.width_m(a, voxel[a])))
                    .product::<f64>();
                // The bottom is not open: the ground is there.
                space.open |= (0..3).any(|a| voxel[a] + 1 == self.size[a] || (a != 1 && voxel[a] == 0));
                self.each_neighbour(index, |next, blocked| {
                    if !blocked && labels[next] == NONE && self.bits[next] & SOLID == 0 {
                        labels[next] = label;
                        stack.push(next);
                    }
                });
            }
            spaces.push(space);
        }
        (labels, spaces)
    }

    /// Calls with each of up to six neighbours and whether something lies between.
    fn each_neighbour(&self, index: usize, mut visit: impl FnMut(usize, bool)) {
        let voxel = self.voxel(index);
        for axis in 0..3 {
            let stride = self.stride(axis);
            if voxel[axis] > 0 {
                visit(index - stride, self.bits[index] & WALL[axis] != 0);
            }
            if voxel[axis] + 1 < self.size[axis] {
                visit(index + stride, self.bits[index + stride] & WALL[axis] != 0);
            }
        }
    }

    /// The nearest voxel that fits, counted in steps through anything.
    fn nearest(&self, start: usize, fits: impl Fn(usize) -> bool) -> Option<usize> {
        let mut visited = vec![false; self.bits.len()];
        let mut queue = std::collections::VecDeque::from([start]);
        visited[start] = true;
        while let Some(index) = queue.pop_front() {
            if fits(index) {
                return Some(index);
            }
            self.each_neighbour(index, |next, _| {
                if !std::mem::replace(&mut visited[next], true) {
                    queue.push_back(next);
                }
            });
        }
        None
    }
}

/// Whether a triangle meets the inside of a rectangle around zero.
fn meets_rectangle(corners: &[Vec2; 3], half: Vec2) -> bool {
    let [a, b, c] = *corners;
    let axes = [Vec2::X, Vec2::Y, (b - a).perp(), (c - b).perp(), (a - c).perp()];
    axes.iter().all(|axis| {
        let [x, y, z] = corners.map(|corner| corner.dot(*axis));
        let reach = half.dot(axis.abs());
        x.min(y).min(z) < reach && x.max(y).max(z) > -reach || *axis == Vec2::ZERO
    })
}

/// Whether a triangle meets the inside of a box around zero (Akenine-Möller 2001).
pub(crate) fn meets_box(corners: &[Vec3; 3], half: Vec3) -> bool {
    let [a, b, c] = *corners;
    let edges = [b - a, c - b, a - c];
    let apart = |axis: Vec3| {
        let [x, y, z] = corners.map(|corner| corner.dot(axis));
        let reach = half.dot(axis.abs());
        axis != Vec3::ZERO && (x.min(y).min(z) >= reach || x.max(y).max(z) <= -reach)
    };
    let faces = [Vec3::X, Vec3::Y, Vec3::Z];
    !(faces.iter().any(|axis| apart(*axis))
        || apart(edges[0].cross(edges[1]))
        || edges
            .iter()
            .any(|edge| faces.iter().any(|face| apart(face.cross(*edge)))))
}
