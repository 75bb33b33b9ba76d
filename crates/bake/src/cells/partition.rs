//! Which boxes is the reachable space cut into?
//!
//! A k-d partition, best first: the box with the largest wall in it is split next, along that wall. When no plane of it is
//! mostly wall, a tall box is split above people's heads ([`eye_level`]), and one that is too large or mostly unreachable
//! along whatever wall it has, or near its middle. A box without reachable voxels is dropped; what is left is shrunk to its
//! reachable voxels and then grown by one voxel where a slanted surface leaves half-filled voxels.

use std::{cmp::Ordering, collections::BinaryHeap, sync::Arc};

use glam::DVec3;

use super::{CellSettings, eye_level, grid::IndexBox, voxels::Voxels};

/// A vertical edge may be this share of the longest horizontal one.
const HEIGHT_SHARE: f32 = 0.5;
/// Boxes with no edge longer than this, in [`Grid::scale_m`](super::grid::Grid::scale_m), stay whole.
const MIN_CELL: f32 = 3.0;
/// A plane is a wall when at least this much of it is, in squares of the same: furniture has smaller sides.
const MIN_WALL: f64 = 4.0;
/// A box that holds a smaller share of reached space than this, as along a slanted wall, is halved …
const MIN_FILL: f64 = 0.6;
/// … unless its longest edge is at most this, in the same.
const MIN_HALVED: f32 = 3.0;
/// A box without walls that is so many times as large as it may be is halved before small walls divide others.
const FAR_TOO_LARGE: f32 = 4.0;
/// How much a split through the middle is preferred over one at the side, in shares of wall.
const BALANCE: f64 = 0.1;
/// How much what lies over people's heads counts beside where they are.
const OVER_HEADS: f64 = 1.0 / 16.0;
/// The share of a box's section that counts at least, so that a plane which mostly runs through solid is no wall.
const MIN_SECTION: f64 = 0.5;

/// A horizontal plane is preferred to none but upright walls, unless this share of it is floor: rooms side by side may
/// differ in height.
const STOREY: f64 = 0.85;
/// Nothing thinner than this is cut off along the side of a thing, in metres.
const MIN_SLAB: f32 = 1.0;
/// A slab is free when this share of each of its layers is …
const VOID: f64 = 0.99;
/// … and it is no seam when it is as thick as this, in metres.
const MIN_VOID: f32 = 1.5;

/// A box that can be split, and how much that is worth.
struct Open {
    worth_m2: f64,
    /// How much wall lies on the plane, in m² …
    wall_m2: f64,
    /// … and how much of that is built.
    built_m2: f64,
    /// Whether people stand below the plane and nobody above.
    at_eye_level: bool,
    node: usize,
    plane: Plane,
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Open {}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Open {
    fn cmp(&self, other: &Self) -> Ordering {
        self.worth_m2
            .total_cmp(&other.worth_m2)
            .then(other.node.cmp(&self.node))
    }
}

/// A plane across an axis, before the voxels with this index.
struct Plane {
    axis: usize,
    index: usize,
}

/// A box of the partition, and whether it was split.
#[derive(Clone)]
pub(super) struct Node {
    /// Shrunk to what can be reached of the region.
    pub(super) voxels: IndexBox,
    /// What it may grow into: the box before it was shrunk.
    region: IndexBox,
    pub(super) children: Option<[usize; 2]>,
    /// How much wall lies on the plane between its children, in m².
    pub(super) wall_m2: f64,
    /// How much of that is built and no furniture, see [`eye_level::built_m2`].
    pub(super) built_m2: f64,
    /// Whether people stand in the first of its children and nobody in the second.
    pub(super) at_eye_level: bool,
    /// Whether it lies above such a plane.
    pub(super) over_heads: bool,
}

impl Node {
    /// How much it counts beside where people are.
    pub(super) fn weight(&self) -> f64 {
        if self.over_heads { OVER_HEADS } else { 1.0 }
    }
}

/// The tree of boxes; the root is the first node.
#[derive(Clone)]
pub(super) struct Tree {
    pub(super) voxels: Arc<Voxels>,
    pub(super) nodes: Vec<Node>,
}

impl Tree {
    /// Cuts all reached voxels into at most so many boxes.
    pub(super) fn cut(voxels: &Arc<Voxels>, settings: &CellSettings, max_cells: usize) -> Self {
        let everything = voxels.grid.everything();
        let node = |region: IndexBox| Node {
            // Planes are chosen inside shrunk boxes, so both halves hold reached voxels.
            voxels: shrunk(voxels, region).unwrap_or(region),
            region,
            children: None,
            wall_m2: 0.0,
            built_m2: 0.0,
            at_eye_level: false,
            over_heads: false,
        };
        let mut nodes = vec![node(everything)];
        let mut open: BinaryHeap<Open> = split_of(voxels, 0, &nodes[0], settings).into_iter().collect();
        let mut count = 1;
        while let Some(split) = open.pop() {
            if count >= max_cells.max(1) {
                break;
            }
            let Plane { axis, index } = split.plane;
            let (mut low, mut high) = (nodes[split.node].region, nodes[split.node].region);
            low.max[axis] = index;
            high.min[axis] = index;
            let over_heads = nodes[split.node].over_heads;
            let children = [(low, false), (high, split.at_eye_level)].map(|(region, above)| {
                nodes.push(Node {
                    over_heads: over_heads || above,
                    ..node(region)
                });
                let child = nodes.len() - 1;
                open.extend(split_of(voxels, child, &nodes[child], settings));
                child
            });
            nodes[split.node].children = Some(children);
            nodes[split.node].wall_m2 = split.wall_m2;
            nodes[split.node].built_m2 = split.built_m2;
            nodes[split.node].at_eye_level = split.at_eye_level;
            count += 1;
        }
        Self {
            voxels: Arc::clone(voxels),
            nodes,
        }
    }

    /// The boxes that are not split, disjoint, neighbours near each other; together they hold all reached voxels.
    pub(super) fn leaves(&self) -> Vec<usize> {
        self.leaves_of(0)
    }

    /// Those below a node, or itself.
    pub(super) fn leaves_of(&self, node: usize) -> Vec<usize> {
        let mut leaves = Vec::new();
        let mut stack = vec![node];
        while let Some(node) = stack.pop() {
            match self.nodes[node].children {
                Some([low, high]) => stack.extend([high, low]),
                None => leaves.push(node),
            }
        }
        leaves
    }

    /// A box as it becomes a cell.
    pub(super) fn cell(&self, node: usize) -> IndexBox {
        grown(&self.voxels, self.nodes[node].voxels, &self.nodes[node].region)
    }
}

fn voxels_in(node: &IndexBox) -> impl Iterator<Item = [usize; 3]> {
    let (min, max) = (node.min, node.max);
    (min[2]..max[2]).flat_map(move |z| (min[1]..max[1]).flat_map(move |y| (min[0]..max[0]).map(move |x| [x, y, z])))
}

/// The box of the reached voxels of a box.
fn shrunk(voxels: &Voxels, node: IndexBox) -> Option<IndexBox> {
    let mut bounds: Option<IndexBox> = None;
    for voxel in voxels_in(&node).filter(|voxel| voxels.reached(*voxel)) {
        let bounds = bounds.get_or_insert(IndexBox { min: voxel, max: voxel });
        bounds.min = [0, 1, 2].map(|axis| bounds.min[axis].min(voxel[axis]));
        bounds.max = [0, 1, 2].map(|axis| bounds.max[axis].max(voxel[axis] + 1));
    }
    bounds
}

/// The box and one layer more at each side where a solid voxel touches a reached one without a wall between.
fn grown(voxels: &Voxels, node: IndexBox, region: &IndexBox) -> IndexBox {
    let mut grown = node;
    for axis in 0..3 {
        let layer = |at: usize| {
            let mut layer = node;
            (layer.min[axis], layer.max[axis]) = (at, at + 1);
            layer
        };
        if node.min[axis] > region.min[axis] {
            let half_filled = |voxel: [usize; 3]| {
                let mut beyond = voxel;
                beyond[axis] -= 1;
                voxels.reached(voxel) && voxels.solid(beyond) && !voxels.wall_below(voxel, axis)
            };
            if voxels_in(&layer(node.min[axis])).any(half_filled) {
                grown.min[axis] -= 1;
            }
        }
        if node.max[axis] < region.max[axis] {
            let half_filled = |voxel: [usize; 3]| {
                let mut beyond = voxel;
                beyond[axis] += 1;
                voxels.reached(voxel) && voxels.solid(beyond) && !voxels.wall_below(beyond, axis)
            };
            if voxels_in(&layer(node.max[axis] - 1)).any(half_filled) {
                grown.max[axis] += 1;
            }
        }
    }
    grown
}

/// The volume of the reached voxels of a box.
pub(super) fn filled_m3(voxels: &Voxels, node: &IndexBox) -> f64 {
    let volume = |voxel: [usize; 3]| {
        (0..3)
            .map(|a| f64::from(voxels.grid.width_m(a, voxel[a])))
            .product::<f64>()
    };
    voxels_in(node).filter(|voxel| voxels.reached(*voxel)).map(volume).sum()
}

/// How much of a plane matters, and how much of that is wall, in m².
#[derive(Clone, Copy, Default)]
struct Section {
    wall_m2: f64,
    beside_free_m2: f64,
    /// How much of the layer of voxels behind the plane can be reached.
    reached_m2: f64,
}

/// All planes across each axis inside a box; the first lies on its lower side.
fn sections(voxels: &Voxels, node: &IndexBox) -> [Vec<Section>; 3] {
    let widths = [0, 1, 2].map(|axis| {
        let range = node.min[axis]..node.max[axis];
        range
            .map(|i| f64::from(voxels.grid.width_m(axis, i)))
            .collect::<Vec<_>>()
    });
    let mut sections = [0, 1, 2].map(|axis| vec![Section::default(); node.max[axis] - node.min[axis]]);
    for voxel in voxels_in(node) {
        let here = voxels.reached(voxel);
        let local = [0, 1, 2].map(|axis| voxel[axis] - node.min[axis]);
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let area_m2 = widths[u][local[u]] * widths[v][local[v]];
            let section = &mut sections[axis][local[axis]];
            if here {
                section.reached_m2 += area_m2;
            }
            if local[axis] == 0 {
                continue;
            }
            let mut before = voxel;
            before[axis] -= 1;
            let there = voxels.reached(before);
            if here || there {
                section.beside_free_m2 += area_m2;
                if here != there || voxels.wall_below(voxel, axis) {
                    section.wall_m2 += area_m2;
                }
            }
        }
    }
    sections
}

/// How a box is split, if it is.
fn split_of(voxels: &Voxels, number: usize, node: &Node, settings: &CellSettings) -> Option<Open> {
    let within = &node.voxels;
    let scale_m = voxels.grid.scale_m();
    let [min, max] = voxels.grid.bounds(within);
    if max - min == glam::Vec3::ZERO || (max - min).max_element() <= MIN_CELL * scale_m {
        return None;
    }
    let sections = sections(voxels, within);
    let wall = wall_in(voxels, within, &sections, settings);
    let above_heads = (wall.is_none() && !node.over_heads)
        .then(|| eye_level::plane_in(voxels, within))
        .flatten();
    let (worth_m2, plane) = match above_heads {
        Some(index) => (surface_m2((max - min).as_dvec3()), Plane { axis: 1, index }),
        None => wall.or_else(|| halving_of(voxels, within, &sections, settings))?,
    };
    let section = sections[plane.axis][plane.index - within.min[plane.axis]];
    Some(Open {
        worth_m2: worth_m2 * node.weight(),
        wall_m2: section.wall_m2,
        built_m2: eye_level::built_m2(voxels, within, node.over_heads, (plane.axis, plane.index)),
        at_eye_level: above_heads.is_some(),
        node: number,
        plane,
    })
}

/// The plane that is most of all a wall, and the area of that wall.
fn wall_in(
    voxels: &Voxels,
    within: &IndexBox,
    sections: &[Vec<Section>; 3],
    settings: &CellSettings,
) -> Option<(f64, Plane)> {
    let min_wall_m2 = min_wall_m2(voxels);
    let [min, max] = voxels.grid.bounds(within);
    let size = (max - min).as_dvec3();
    // Whether it stands upright, or else is a floor all over; how good it is; its area.
    let mut best: Option<(bool, f64, f64, Plane)> = None;
    for (axis, sections) in sections.iter().enumerate() {
        let full_m2 = size[(axis + 1) % 3] * size[(axis + 2) % 3];
        for (offset, section) in sections.iter().enumerate().skip(1) {
            let share = section.wall_m2 / section.beside_free_m2.max(MIN_SECTION * full_m2);
            let index = within.min[axis] + offset;
            let at = f64::from(voxels.grid.lines(axis)[index] - min[axis]) / size[axis];
            let score = share + BALANCE * at.min(1.0 - at);
            let first = axis != 1 || share >= STOREY;
            let wall = share >= settings.wall_share && section.wall_m2 >= min_wall_m2;
            if wall && best.as_ref().is_none_or(|best| (first, score) > (best.0, best.1)) {
                best = Some((first, score, section.wall_m2, Plane { axis, index }));
            }
        }
    }
    best.map(|(_, _, wall_m2, plane)| (wall_m2, plane))
}

/// How a box is cut that is too large or mostly unreachable: along the largest wall in it, be that ever so small a share
/// of the plane, as a house is on a lawn; without any wall near its middle, which is worth most where anything is built and the
/// box is far too large, and elsewhere less than any wall, larger boxes first.
fn halving_of(
    voxels: &Voxels,
    within: &IndexBox,
    sections: &[Vec<Section>; 3],
    settings: &CellSettings,
) -> Option<(f64, Plane)> {
    let grid = &voxels.grid;
    let [min, max] = grid.bounds(within);
    let size = (max - min).as_dvec3();
    let across_m = (settings.max_cell_m * grid.open_metre()).max(settings.max_cell_share * grid.scene_m());
    let limits_m = [across_m, HEIGHT_SHARE * across_m, across_m];
    let excess = |axis: usize| (max - min)[axis] / limits_m[axis];
    let axis = (0..3).max_by(|a, b| excess(*a).total_cmp(&excess(*b)))?;
    let sparse = (max - min)[axis] > MIN_HALVED * grid.scale_m()
        && filled_m3(voxels, within) < MIN_FILL * size.element_product();
    if within.max[axis] - within.min[axis] <= 1 || !(excess(axis) > 1.0 || sparse) {
        return None;
    }
    // Large boxes first, whatever their walls, so that streets come before what is between them.
    if let Some((_, plane)) = void_in(voxels, within, sections) {
        return Some((surface_m2(size), plane));
    }
    let walls = (0..3).flat_map(|axis| {
        let planes = sections[axis].iter().enumerate().skip(1);
        let lines = &grid.lines(axis)[within.min[axis]..=within.max[axis]];
        let room = move |offset: &usize| {
            let at = lines[*offset];
            (at - lines[0]).min(lines[lines.len() - 1] - at) >= MIN_SLAB * grid.metre()
        };
        planes
            .filter(move |(offset, _)| room(offset))
            .map(move |(offset, section)| (section.wall_m2, axis, offset))
    });
    let largest = walls.max_by(|a, b| a.0.total_cmp(&b.0).then((b.1, b.2).cmp(&(a.1, a.2))));
    match largest {
        Some((wall_m2, axis, offset)) if wall_m2 >= min_wall_m2(voxels) => {
            let index = within.min[axis] + offset;
            Some((wall_m2, Plane { axis, index }))
        }
        _ => {
            let index = middle(voxels, within, axis, &sections[axis]);
            let full_m2 = size[(axis + 1) % 3] * size[(axis + 2) % 3];
            // A street is as long as the town, and who is somewhere in it sees what is seen from all of it.
            let worth_m2 = if excess(axis) > FAR_TOO_LARGE && grid.is_built(within) {
                surface_m2(size)
            } else {
                -1.0 / full_m2.max(f64::MIN_POSITIVE)
            };
            Some((worth_m2, Plane { axis, index }))
        }
    }
}

/// The larger side of the largest slab through all of a box that is all free, like the air over a town or a street: its
/// volume, and the plane where it ends.
fn void_in(voxels: &Voxels, within: &IndexBox, sections: &[Vec<Section>; 3]) -> Option<(f64, Plane)> {
    let [min, max] = voxels.grid.bounds(within);
    let size = (max - min).as_dvec3();
    let mut best: Option<(f64, Plane)> = None;
    for (axis, sections) in sections.iter().enumerate() {
        let full_m2 = size[(axis + 1) % 3] * size[(axis + 2) % 3];
        let lines = voxels.grid.lines(axis);
        let free = |section: &Section| section.reached_m2 >= VOID * full_m2;
        let mut start = 0;
        while start < sections.len() {
            let open = |section: &&Section| free(section) && section.wall_m2 <= (1.0 - VOID) * full_m2;
            let run = usize::from(free(&sections[start]));
            let end = start + run + sections[start + 1..].iter().take_while(|s| run == 1 && open(s)).count();
            let thick_m = lines[within.min[axis] + end] - lines[within.min[axis] + start];
            let inner = if start > 0 { start } else { end };
            let volume_m3 = f64::from(thick_m) * full_m2;
            let wide = thick_m >= MIN_VOID * voxels.grid.metre() && inner < sections.len();
            if run == 1 && wide && best.as_ref().is_none_or(|(most, _)| volume_m3 > *most) {
                let index = within.min[axis] + inner;
                best = Some((volume_m3, Plane { axis, index }));
            }
            start = end.max(start + 1);
        }
    }
    best
}

/// Half the surface of a box.
fn surface_m2(size: DVec3) -> f64 {
    size.x * size.y + size.y * size.z + size.z * size.x
}

/// The least area of a wall.
fn min_wall_m2(voxels: &Voxels) -> f64 {
    MIN_WALL * f64::from(voxels.grid.scale_m()).powi(2)
}

/// The plane of the middle third with the most wall, else the nearest to the middle.
fn middle(voxels: &Voxels, node: &IndexBox, axis: usize, sections: &[Section]) -> usize {
    let lines = voxels.grid.lines(axis);
    let (start, end) = (lines[node.min[axis]], lines[node.max[axis]]);
    let off_center = |index: usize| ((lines[index] - start) / (end - start) - 0.5).abs();
    let score = |index: usize| {
        let section = sections[index - node.min[axis]];
        let share = section.wall_m2 / section.beside_free_m2.max(f64::MIN_POSITIVE);
        let bonus = if off_center(index) < 1.0 / 6.0 { share } else { 0.0 };
        bonus - f64::from(off_center(index))
    };
    (node.min[axis] + 1..node.max[axis])
        .max_by(|a, b| score(*a).total_cmp(&score(*b)).then(b.cmp(a)))
        .unwrap_or(node.min[axis] + 1)
}
