//! Where do grid lines lie? On large walls and floors, and between them evenly.
//!
//! All positions are relative to the world's origin. Around what is built ([`built`]) lines grow apart, because little is
//! there but room to stand in: a village in wide fields is cut as finely as one without.

use belvedere_scene::Bounds;
use glam::Vec3;

use super::{CellSettings, built::built};
use crate::world::World;

/// How much further apart each line outside the scene is than the one before.
const OUTSIDE_GROWTH: f32 = 1.5;
/// Voxels are no smaller than this share of the scene.
const FINEST: f32 = 16.0 * f32::EPSILON;
/// Nor is any wider, around what is built, than this share of it, or than a cell of the country …
const COARSEST: f32 = 1.0 / 256.0;
/// … but where they are coarse in height, too, as under a sky: than this one.
const COARSEST_IN_HEIGHT: f32 = 1.0 / 64.0;
/// A scene that is less than so many metres long is taken for a model of one that is as long, as a doll's house is one of a house,
/// and cut along the same walls …
const HOUSE_M: f32 = 10.0;
/// … but where it has none it is looked at as a whole: there it is taken for a model of something shorter.
const OPEN_M: f32 = 4.0;
/// Viewpoints within so many lengths of the scene are reached.
const VIEWPOINT_REACH: f32 = 20.0;
/// Planes nearer to each other than this share of a voxel are one.
const MIN_GAP: f32 = 0.2;
/// A face is on a plane when it is no further away than this share of a voxel.
const ON_PLANE: f32 = 0.005;
/// A plane attracts a line when its faces cover at least this many voxel faces: the jambs of a doorway do.
const MIN_FACES: f64 = 4.0;

/// A box of voxels: from the first of each axis up to and excluding the second.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct IndexBox {
    pub(super) min: [usize; 3],
    pub(super) max: [usize; 3],
}

/// A rectilinear grid.
pub(super) struct Grid {
    /// For each axis the rising positions of its lines, at least two.
    lines: [Vec<f32>; 3],
    voxel_m: f32,
    tolerance_m: f32,
    metre: f32,
    scene_m: f32,
    /// Where anything is built.
    built: [Vec3; 2],
}

impl Grid {
    /// The grid of a world: voxels of the wanted size, or larger when that were too many. It reaches out to the
    /// viewpoints (relative to the world's origin), unless they are absurdly far away.
    pub(super) fn over(world: &World, viewpoints: &[Vec3], settings: &CellSettings) -> Self {
        let bounds = world.bounds();
        let bounds = if bounds.is_empty() {
            Bounds::around([world.origin().to_array()])
        } else {
            bounds
        };
        let (min, max) = (world.relative(bounds.min), world.relative(bounds.max));
        let scene_m = (max - min).max_element();
        let metre = metre_in(scene_m, HOUSE_M);
        let built = built(world, [min, max]);
        let planes = [0, 1, 2].map(|axis| Planes::of(world, axis, scene_m));
        let beyond = |axis: usize| {
            let reach = |p: &Vec3| (min[axis] - p[axis]).max(p[axis] - max[axis]);
            let near = |reach: &f32| *reach <= VIEWPOINT_REACH * scene_m;
            viewpoints.iter().map(reach).filter(near).fold(0.0, f32::max)
        };
        let is_coarse_in_height = (built[1] - built[0]).y < (max - min).y;
        let coarsest = if is_coarse_in_height {
            COARSEST_IN_HEIGHT
        } else {
            COARSEST
        };
        let widest_m = (settings.max_cell_m * metre).max(coarsest * scene_m);
        // No finer than single precision tells lines apart.
        let mut voxel_m = (settings.voxel_m * metre).max(FINEST * scene_m);
        loop {
            let tolerance_m = (ON_PLANE * voxel_m).max(8.0 * f32::EPSILON * scene_m);
            let lines = [0, 1, 2].map(|axis| {
                let start = if axis == 1 {
                    planes[1].ground_over(min.y, voxel_m)
                } else {
                    min[axis]
                };
                let ends = [start, max[axis]];
                let mut lines = inside(ends, planes[axis].lines(voxel_m), MIN_GAP * voxel_m, |gap| {
                    between(gap, built.map(|corner| corner[axis]), [voxel_m, widest_m.max(voxel_m)])
                });
                let above = 2.0 * metre;
                let room = if axis == 1 {
                    above.max((0.05 * scene_m).min(max.y - min.y))
                } else {
                    above.max(0.05 * scene_m)
                };
                let room = room.max(1.05 * beyond(axis));
                surround(&mut lines, room, voxel_m, axis != 1 || beyond(axis) > 0.0);
                lines
            });
            let count = lines.iter().fold(1.0, |n, l| n * (l.len() - 1) as f64);
            if count <= settings.max_voxels.max(128) as f64 {
                return Self {
                    lines,
                    voxel_m,
                    tolerance_m,
                    metre,
                    scene_m,
                    built,
                };
            }
            voxel_m *= 1.1;
        }
    }

    /// Voxels along each axis.
    pub(super) fn size(&self) -> [usize; 3] {
        [0, 1, 2].map(|axis| self.lines[axis].len() - 1)
    }

    /// The largest edge of a voxel where anything is built.
    pub(super) fn voxel_m(&self) -> f32 {
        self.voxel_m
    }

    /// What stands for a metre in a scene that is smaller than a house, else one metre.
    pub(super) fn metre(&self) -> f32 {
        self.metre
    }

    /// What stands for a metre where there are no walls.
    pub(super) fn open_metre(&self) -> f32 {
        metre_in(self.scene_m, OPEN_M)
    }

    /// The size of what a person handles: a metre, in a large scene a hundredth of what is built, because nobody looks at
    /// a cell of a town as closely as at a cell of a flat.
    pub(super) fn scale_m(&self) -> f32 {
        self.metre.max((self.built[1] - self.built[0]).max_element() / 100.0)
    }

    /// The longest edge of the scene's box.
    pub(super) fn scene_m(&self) -> f32 {
        self.scene_m
    }

    /// Whether the middle of a box lies where anything is built, above it or below it.
    pub(super) fn is_built(&self, node: &IndexBox) -> bool {
        let [min, max] = self.bounds(node);
        let middle = 0.5 * (min + max);
        [0, 2]
            .into_iter()
            .all(|axis| self.built[0][axis] <= middle[axis] && middle[axis] <= self.built[1][axis])
    }

    /// How far from a plane is still on it.
    pub(super) fn tolerance_m(&self) -> f32 {
        self.tolerance_m
    }

    /// The lines of one axis.
    pub(super) fn lines(&self, axis: usize) -> &[f32] {
        &self.lines[axis]
    }

    /// The edge of a voxel.
    pub(super) fn width_m(&self, axis: usize, index: usize) -> f32 {
        self.lines[axis][index + 1] - self.lines[axis][index]
    }

    /// The voxels whose inside an interval meets, as a range that is never empty.
    pub(super) fn range(&self, axis: usize, from: f32, to: f32) -> [usize; 2] {
        let lines = &self.lines[axis];
        let first = lines.partition_point(|line| *line <= from).saturating_sub(1);
        let first = first.min(lines.len() - 2);
        let end = lines
            .partition_point(|line| *line < to)
            .clamp(first + 1, lines.len() - 1);
        [first, end]
    }

    /// The voxel that holds a point, or the nearest.
    pub(super) fn voxel_at(&self, point: Vec3) -> [usize; 3] {
        [0, 1, 2].map(|axis| self.range(axis, point[axis], point[axis])[0])
    }

    /// Two opposite corners of a box of voxels.
    pub(super) fn bounds(&self, voxels: &IndexBox) -> [Vec3; 2] {
        [voxels.min, voxels.max].map(|corner| Vec3::from([0, 1, 2].map(|axis| self.lines[axis][corner[axis]])))
    }

    /// The whole grid.
    pub(super) fn everything(&self) -> IndexBox {
        IndexBox {
            min: [0; 3],
            max: self.size(),
        }
    }
}

/// What stands for a metre in a scene so long, if those that are shorter than a length are models of that length.
fn metre_in(scene_m: f32, length_m: f32) -> f32 {
    if scene_m > 0.0 {
        (scene_m / length_m).min(1.0)
    } else {
        1.0
    }
}

/// The planes of faces across one axis.
struct Planes(Vec<Plane>);

struct Plane {
    at: f32,
    area_m2: f64,
    /// The same, with half of what faces down.
    weight_m2: f64,
}

/// What faces down counts so much beside what faces up: a storey is cut at what one walks on, not at its underside.
const UNDERSIDE: f64 = 0.5;

impl Planes {
    /// Heaviest first.
    fn of(world: &World, axis: usize, scene_m: f32) -> Self {
        let flat = 1e-6 * scene_m;
        let mut faces: Vec<_> = world
            .triangles()
            .filter(|triangle| triangle.hides())
            .filter_map(|triangle| {
                let [a, b, c] = triangle.corners.map(|p| p[axis]);
                let (low, high) = (a.min(b).min(c), a.max(b).max(c));
                (high - low <= flat).then(|| {
                    let at = 0.5 * (low + high);
                    let area_m2 = f64::from(triangle.area_m2());
                    let faces_down = axis == 1 && triangle.faces_down();
                    let weight_m2 = if faces_down { UNDERSIDE * area_m2 } else { area_m2 };
                    Plane { at, area_m2, weight_m2 }
                })
            })
            .collect();
        faces.sort_by(|a, b| a.at.total_cmp(&b.at));
        let mut planes: Vec<Plane> = Vec::new();
        for face in faces {
            match planes.last_mut() {
                Some(plane) if face.at - plane.at <= flat => {
                    plane.area_m2 += face.area_m2;
                    plane.weight_m2 += face.weight_m2;
                }
                _ => planes.push(face),
            }
        }
        planes.sort_by(|a, b| b.weight_m2.total_cmp(&a.weight_m2).then(a.at.total_cmp(&b.at)));
        Self(planes)
    }

    /// Planes that large voxels may be cut along.
    fn large(&self, voxel_m: f32) -> impl Iterator<Item = &Plane> {
        let least = MIN_FACES * f64::from(voxel_m).powi(2);
        self.0.iter().filter(move |plane| plane.area_m2 >= least)
    }

    /// Where the lowest voxels begin: on the ground, if that is a slab over the lower end of the scene in which no voxel has room.
    fn ground_over(&self, end: f32, voxel_m: f32) -> f32 {
        let within = |plane: &&Plane| (end..=end + MIN_GAP * voxel_m).contains(&plane.at);
        self.large(voxel_m).find(within).map_or(end, |plane| plane.at)
    }

    /// The positions of large planes that keep their distance from heavier ones, in no order.
    fn lines(&self, voxel_m: f32) -> Vec<f32> {
        let mut lines: Vec<f32> = Vec::new();
        for plane in self.large(voxel_m) {
            let place = lines.partition_point(|line| *line < plane.at);
            let near = |line: Option<&f32>| line.is_some_and(|line| (line - plane.at).abs() < MIN_GAP * voxel_m);
            if !near(lines.get(place)) && !near(place.checked_sub(1).and_then(|before| lines.get(before))) {
                lines.insert(place, plane.at);
            }
        }
        lines
    }
}

/// The ends of the scene, the given lines and as many between every two of them as `between` says.
fn inside([start, end]: [f32; 2], planes: Vec<f32>, gap_m: f32, between: impl Fn([f32; 2]) -> Vec<f32>) -> Vec<f32> {
    let mut fixed = vec![start];
    fixed.extend(planes.into_iter().filter(|at| *at > start + gap_m && *at < end - gap_m));
    if end > start {
        fixed.push(end);
    }
    let mut lines = vec![start];
    for pair in fixed.windows(2) {
        lines.extend(between([pair[0], pair[1]]));
        lines.push(pair[1]);
    }
    lines
}

/// Lines between two places: evenly where anything is built, further and further apart before and behind, up to the second of
/// two widths.
fn between([from, to]: [f32; 2], [start, end]: [f32; 2], [voxel_m, widest_m]: [f32; 2]) -> Vec<f32> {
    let even = |from: f32, to: f32| {
        let count = ((to - from) / voxel_m - 1e-3).ceil().max(1.0);
        (1..count as usize).map(move |i| from + (to - from) * i as f32 / count)
    };
    // Steps away from `near`, which may have begun further inside.
    let apart = |near: f32, far: f32, edge: f32| {
        let mut lines = Vec::new();
        let (mut at, way) = (near, (far - near).signum());
        loop {
            let step = (voxel_m + (OUTSIDE_GROWTH - 1.0) * ((at - edge) * way).max(0.0)).min(widest_m);
            at += way * step;
            if (far - at) * way < 0.5 * step {
                return lines;
            }
            lines.push(at);
        }
    };
    let mut lines = Vec::new();
    if from < start {
        let mut before = apart(to.min(start), from, start);
        before.reverse();
        lines.extend(before);
    }
    let (inner_from, inner_to) = (from.max(start), to.min(end));
    if inner_from < inner_to {
        // Not beside a wall.
        let clear = |line: f32| line - from > MIN_GAP * voxel_m && to - line > MIN_GAP * voxel_m;
        lines.extend(clear(inner_from).then_some(inner_from));
        lines.extend(even(inner_from, inner_to));
        lines.extend(clear(inner_to).then_some(inner_to));
    }
    if to > end {
        lines.extend(apart(from.max(end), to, end));
    }
    lines
}

/// Adds lines outside: above, and `below` too where wanted.
fn surround(lines: &mut Vec<f32>, room: f32, voxel_m: f32, below: bool) {
    let mut offsets = Vec::new();
    let (mut offset, mut step) = (0.0, voxel_m);
    while offset < room {
        offset += step;
        offsets.push(offset.min(room));
        step *= OUTSIDE_GROWTH;
    }
    let (first, last) = (lines[0], lines[lines.len() - 1]);
    lines.extend(offsets.iter().map(|offset| last + offset));
    if below {
        lines.splice(0..0, offsets.iter().rev().map(|offset| first - offset));
    }
    lines.dedup();
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_rises(lines: &[f32], [from, to]: [f32; 2]) {
        assert!(lines.is_sorted_by(|a, b| a < b));
        assert!(lines.first().is_none_or(|line| *line > from) && lines.last().is_none_or(|line| *line < to));
    }

    #[test]
    fn lines_are_even_where_anything_is_built_and_further_apart_around_it() {
        let ends = [-1000.0, 400.0];
        let lines = between(ends, [-10.0, 10.0], [0.5, 50.0]);
        assert_rises(&lines, ends);
        let gaps: Vec<_> = lines.windows(2).map(|pair| (pair[0], pair[1] - pair[0])).collect();
        let inside = gaps.iter().filter(|(at, _)| (-10.0..10.0).contains(at));
        assert!(inside.clone().count() == 40 && inside.clone().all(|(_, gap)| (gap - 0.5).abs() < 1e-4));
        assert!(gaps.iter().all(|(_, gap)| *gap < 75.1));
        assert!(lines.len() < 130, "{}", lines.len());
    }

    #[test]
    fn what_lies_all_inside_or_all_outside_is_cut_too() {
        assert_rises(&between([-5.0, 5.0], [-10.0, 10.0], [0.3, 9.0]), [-5.0, 5.0]);
        assert_rises(&between([20.0, 90.0], [-10.0, 10.0], [0.3, 9.0]), [20.0, 90.0]);
        assert_rises(&between([-90.0, -20.0], [-10.0, 10.0], [0.3, 9.0]), [-90.0, -20.0]);
    }

    /// However thin the ground is beside its voxels, they begin on it.
    #[test]
    fn one_stands_on_a_thin_slab_of_ground_in_a_wide_land() {
        for basement in [false, true] {
            let mut builder = crate::cells::plan::Builder::default();
            builder.block("ground", [-3000., -0.5, -2000.], [3000., 0., 2000.]);
            builder.block("house", [0., 0., 0.], [10., 6., 10.]);
            if basement {
                builder.block("shaft", [50., -40., 0.], [54., -0.5, 4.]);
            }
            let world = World::new(&builder.scene).unwrap();
            let settings = CellSettings {
                voxel_m: 3.0,
                ..CellSettings::default()
            };
            let grid = Grid::over(&world, &[], &settings);
            let ground = world.relative([0.0; 3]).y;
            let nearest = grid
                .lines(1)
                .iter()
                .map(|line| (line - ground).abs())
                .fold(f32::INFINITY, f32::min);
            assert!(
                nearest < 1e-3,
                "no voxel begins on the ground, the nearest {nearest} m beside it"
            );
        }
    }

    /// A house millions of metres from a stray triangle.
    #[test]
    fn far_away_lines_are_told_apart() {
        let mut builder = crate::cells::plan::Builder::default();
        builder.block("house", [9e6, 0., 9e6], [9e6 + 10., 10., 9e6 + 10.]);
        builder.block("stray", [0., 0., 0.], [1., 1., 1.]);
        let world = World::new(&builder.scene).unwrap();
        let grid = Grid::over(&world, &[], &CellSettings::default());
        for axis in 0..3 {
            assert!(grid.lines(axis).is_sorted_by(|a, b| a < b));
        }
    }
}
