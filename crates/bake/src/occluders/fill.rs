//! Which boxes lie inside a closed surface? A small rectilinear grid snapped to the surface's large faces; voxels that
//! no face cuts and whose middle is inside; the largest boxes of these, greedily (after the octree of Cohen-Or &
//! Zadicario 1998, *Discussion*).

use glam::Vec3;

use crate::cells::meets_box;

/// At most this many lines of large faces along an axis.
const FACE_LINES: usize = 12;
/// No gap between lines is wider than this share of the box, unless faces lie further apart than …
const GAPS: f32 = 12.0;
/// At most this many boxes.
const MAX_BOXES: usize = 6;
/// A box smaller than this share of the whole is not worth having.
const MIN_VOLUME_SHARE: f32 = 0.01;
/// At most about this many places from which boxes are grown.
const SEEDS: usize = 256;
/// The share of a voxel within which a face lies in its side.
const TOUCH: f32 = 1e-4;
/// Faces lie across an axis within this share of their distance from the origin.
const FLAT: f32 = 4.0 * f32::EPSILON;

/// The corners of a face.
pub(super) type Triangle = [Vec3; 3];

struct Grid {
    lines: [Vec<f32>; 3],
}

/// What is to be filled.
#[derive(Debug, Default)]
pub(super) struct Shape {
    /// Closed but for a flat bottom.
    pub(super) surface: Vec<Triangle>,
    /// Whether its faces hide from behind too, so that it does not matter which way they look.
    pub(super) hides_both_ways: bool,
    /// The closed surfaces of what is hollow inside, whose faces look into that.
    pub(super) cavities: Vec<Triangle>,
}

impl Shape {
    /// All faces between what is solid and what is not.
    pub(super) fn faces(&self) -> Vec<Triangle> {
        [&self.surface[..], &self.cavities[..]].concat()
    }
}

/// Boxes inside a shape between these corners, clear of other geometry, largest first. None reaches further out of the shape than
/// half of `margin_m`.
pub(super) fn boxes(shape: &Shape, foreign: &[Triangle], [min, max]: [Vec3; 2], margin_m: f32) -> Vec<[Vec3; 2]> {
    let faces = shape.faces();
    let grid = Grid {
        lines: [0, 1, 2].map(|axis| lines(&faces, min, max, axis)),
    };
    let size = [0, 1, 2].map(|axis| grid.lines[axis].len() - 1);
    let mut solid = grid.inside(shape);
    // A face of the shape in the voxel's own side does not cut it.
    grid.cut(&faces, &mut solid, |half| {
        half - (TOUCH * half).min(Vec3::splat(0.5 * margin_m))
    });
    // What stands on a side of a voxel stands in it.
    grid.cut(foreign, &mut solid, |half| half * (1.0 + TOUCH));
    let mut found = Vec::new();
    let total: f32 = (max - min).element_product();
    for _ in 0..MAX_BOXES {
        let Some((low, high)) = largest_box(&solid, size, &grid) else {
            break;
        };
        let corner = |at: [usize; 3]| Vec3::new(grid.lines[0][at[0]], grid.lines[1][at[1]], grid.lines[2][at[2]]);
        let [a, b] = [corner(low), corner(high)];
        if (b - a).element_product() < MIN_VOLUME_SHARE * total {
            break;
        }
        for voxel in voxels(low, high) {
            solid[index(voxel, size)] = false;
        }
        found.push([a, b]);
    }
    found
}

fn voxels(low: [usize; 3], high: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (low[2]..high[2]).flat_map(move |z| (low[1]..high[1]).flat_map(move |y| (low[0]..high[0]).map(move |x| [x, y, z])))
}

fn index([x, y, z]: [usize; 3], size: [usize; 3]) -> usize {
    (z * size[1] + y) * size[0] + x
}

/// Where large faces across an axis lie, and between them evenly.
fn lines(triangles: &[Triangle], min: Vec3, max: Vec3, axis: usize) -> Vec<f32> {
    // A world that was turned has walls that lie across an axis but for rounding.
    let flat_m = FLAT * (max - min).max_element().max(max.abs().max(min.abs()).max_element());
    let mut faces: Vec<(f32, f32)> = triangles
        .iter()
        .filter_map(|t| {
            let [a, b, c] = t.map(|p| p[axis]);
            let (low, high) = (a.min(b).min(c), a.max(b).max(c));
            (high - low <= flat_m).then(|| (low, (t[1] - t[0]).cross(t[2] - t[0]).length()))
        })
        .collect();
    faces.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut sums: Vec<(f32, f32)> = Vec::new();
    for (at, area) in faces {
        match sums.last_mut() {
            Some(last) if at - last.0 <= flat_m => last.1 += area,
            _ => sums.push((at, area)),
        }
    }
    sums.sort_by(|a, b| b.1.total_cmp(&a.1));
    let within = |at: &f32| *at - min[axis] > flat_m && max[axis] - *at > flat_m;
    let places = sums.iter().map(|(at, _)| *at).filter(within);
    let mut lines: Vec<f32> = places.take(FACE_LINES).collect();
    lines.extend([min[axis], max[axis]]);
    lines.sort_by(f32::total_cmp);
    lines.dedup();
    let widest = (max[axis] - min[axis]) / GAPS;
    let mut all = vec![lines[0]];
    for pair in lines.windows(2) {
        let parts = ((pair[1] - pair[0]) / widest).ceil().max(1.0);
        all.extend((1..parts as usize).map(|i| pair[0] + (pair[1] - pair[0]) * i as f32 / parts));
        all.push(pair[1]);
    }
    all.dedup();
    all
}

impl Grid {
    fn range(&self, axis: usize, low: f32, high: f32) -> std::ops::Range<usize> {
        let lines = &self.lines[axis];
        let first = lines.partition_point(|line| *line <= low).saturating_sub(1);
        let end = lines.partition_point(|line| *line < high).min(lines.len() - 1);
        first..end.max(first)
    }

    /// For each voxel whether its middle lies inside.
    fn inside(&self, shape: &Shape) -> Vec<bool> {
        let size = [0, 1, 2].map(|axis| self.lines[axis].len() - 1);
        let is_solid = |turns: i32| turns > 0 || (shape.hides_both_ways && turns < 0);
        // Along two axes, which agree where a surface is closed.
        let [along_x, along_z] = [0, 2].map(|axis| self.winding(&shape.surface, axis, size));
        let [hollow_x, hollow_z] = [0, 2].map(|axis| self.winding(&shape.cavities, axis, size));
        let voxels = 0..along_x.len();
        voxels
            .map(|at| is_solid(along_x[at]) && is_solid(along_z[at]) && hollow_x[at] >= 0 && hollow_z[at] >= 0)
            .collect()
    }

    /// Takes out the voxels that faces go through, each with the half of its size that `half_of` makes of it.
    fn cut(&self, triangles: &[Triangle], inside: &mut [bool], half_of: impl Fn(Vec3) -> Vec3) {
        let size = [0, 1, 2].map(|axis| self.lines[axis].len() - 1);
        for triangle in triangles {
            let low = triangle[0].min(triangle[1]).min(triangle[2]);
            let high = triangle[0].max(triangle[1]).max(triangle[2]);
            let ranges = [0, 1, 2].map(|axis| {
                let lines = &self.lines[axis];
                let touch_m = 0.1 * TOUCH * (lines[lines.len() - 1] - lines[0]);
                self.range(axis, low[axis] - touch_m, high[axis] + touch_m)
            });
            for voxel in voxels([0, 1, 2].map(|a| ranges[a].start), [0, 1, 2].map(|a| ranges[a].end)) {
                let at = index(voxel, size);
                if !inside[at] {
                    continue;
                }
                let corner = |o: usize| Vec3::from([0, 1, 2].map(|a| self.lines[a][voxel[a] + o]));
                let (a, b) = (corner(0), corner(1));
                let middle = 0.5 * (a + b);
                let half = half_of(0.5 * (b - a));
                inside[at] = !meets_box(&triangle.map(|p| p - middle), half);
            }
        }
    }

    /// For each voxel how much more often a line along an axis to its middle has entered the surface than left it: less than never
    /// where its faces look inwards.
    fn winding(&self, triangles: &[Triangle], axis: usize, size: [usize; 3]) -> Vec<i32> {
        // Off the middle, so that the line runs along no edge of a regular mesh.
        const OFF: [f32; 2] = [0.513_7, 0.486_1];
        let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
        let mut turns = vec![0; size.iter().product()];
        let mut crossings: Vec<Vec<(f32, i32)>> = vec![Vec::new(); size[u] * size[v]];
        let place = |axis: usize, i: usize, off: f32| {
            let lines = &self.lines[axis];
            lines[i] + off * (lines[i + 1] - lines[i])
        };
        for t in triangles {
            let flat = t.map(|p| glam::DVec2::new(f64::from(p[u]), f64::from(p[v])));
            let (low, high) = (t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2]));
            let area = (flat[1] - flat[0]).perp_dot(flat[2] - flat[0]);
            if area == 0.0 {
                continue;
            }
            for j in self.range(v, low[v], high[v]) {
                for i in self.range(u, low[u], high[u]) {
                    let at = glam::DVec2::new(f64::from(place(u, i, OFF[0])), f64::from(place(v, j, OFF[1])));
                    let weights = [0, 1, 2]
                        .map(|k| (flat[(k + 2) % 3] - flat[(k + 1) % 3]).perp_dot(at - flat[(k + 1) % 3]) / area);
                    if weights.iter().all(|w| *w >= 0.0) {
                        let depth = (0..3).map(|k| weights[k] * f64::from(t[k][axis])).sum::<f64>();
                        crossings[j * size[u] + i].push((depth as f32, if area > 0.0 { -1 } else { 1 }));
                    }
                }
            }
        }
        for (row, crossings) in crossings.iter_mut().enumerate() {
            crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
            for k in 0..size[axis] {
                let middle = place(axis, k, 0.5);
                let depth: i32 = crossings.iter().take_while(|c| c.0 < middle).map(|c| c.1).sum();
                let mut voxel = [k; 3];
                (voxel[u], voxel[v]) = (row % size[u], row / size[u]);
                turns[index(voxel, size)] = depth;
            }
        }
        turns
    }
}

/// How many voxels are set below each corner of the grid: so a box of any size is counted at its eight corners (after Crow,
/// *Summed-area tables for texture mapping*, 1984).
struct Counts {
    below: Vec<u32>,
    corners: [usize; 3],
}

impl Counts {
    fn of(solid: &[bool], size: [usize; 3]) -> Self {
        let corners = size.map(|voxels| voxels + 1);
        let mut below = vec![0; corners.iter().product()];
        for [x, y, z] in voxels([0; 3], size) {
            let at = |x, y, z| below[index([x, y, z], corners)];
            let sides = at(x, y + 1, z + 1) + at(x + 1, y, z + 1) + at(x + 1, y + 1, z);
            let edges = at(x, y, z + 1) + at(x, y + 1, z) + at(x + 1, y, z);
            let count = u32::from(solid[index([x, y, z], size)]) + sides + at(x, y, z) - edges;
            below[index([x + 1, y + 1, z + 1], corners)] = count;
        }
        Self { below, corners }
    }

    /// Whether all voxels of a box are set.
    fn full(&self, low: [usize; 3], high: [usize; 3]) -> bool {
        let at = |x, y, z| i64::from(self.below[index([x, y, z], self.corners)]);
        let ([a, b, c], [x, y, z]) = (low, high);
        let set = at(x, y, z) - at(a, y, z) - at(x, b, z) - at(x, y, c) + at(a, b, z) + at(a, y, c) + at(x, b, c)
            - at(a, b, c);
        set == ((x - a) * (y - b) * (z - c)) as i64
    }
}

/// The largest box of voxels that are all set, grown from evenly spread places.
fn largest_box(solid: &[bool], size: [usize; 3], grid: &Grid) -> Option<([usize; 3], [usize; 3])> {
    let set: Vec<_> = voxels([0; 3], size).filter(|v| solid[index(*v, size)]).collect();
    let volume = |low: [usize; 3], high: [usize; 3]| -> f32 {
        (0..3).map(|a| grid.lines[a][high[a]] - grid.lines[a][low[a]]).product()
    };
    let counts = Counts::of(solid, size);
    let full = |low, high| counts.full(low, high);
    let mut best: Option<([usize; 3], [usize; 3])> = None;
    for seed in set.iter().step_by((set.len() / SEEDS).max(1)) {
        let (mut low, mut high) = (*seed, seed.map(|i| i + 1));
        loop {
            let before = (low, high);
            for axis in [1, 0, 2] {
                let mut layer = (low, high);
                if high[axis] < size[axis] {
                    (layer.0[axis], layer.1[axis]) = (high[axis], high[axis] + 1);
                    if full(layer.0, layer.1) {
                        high[axis] += 1;
                    }
                }
                layer = (low, high);
                if low[axis] > 0 {
                    (layer.0[axis], layer.1[axis]) = (low[axis] - 1, low[axis]);
                    if full(layer.0, layer.1) {
                        low[axis] -= 1;
                    }
                }
            }
            if before == (low, high) {
                break;
            }
        }
        if best.is_none_or(|(l, h)| volume(low, high) > volume(l, h)) {
            best = Some((low, high));
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quad(corners: [Vec3; 4]) -> [Triangle; 2] {
        let [a, b, c, d] = corners;
        [[a, b, c], [a, c, d]]
    }

    /// A box seen from outside.
    fn block(min: Vec3, max: Vec3) -> Vec<Triangle> {
        let at = |i: usize| {
            Vec3::new(
                if i & 1 == 0 { min.x } else { max.x },
                if i & 2 == 0 { min.y } else { max.y },
                if i & 4 == 0 { min.z } else { max.z },
            )
        };
        [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ]
        .iter()
        .flat_map(|q| quad(q.map(at)))
        .collect()
    }

    fn full(surface: Vec<Triangle>) -> Shape {
        Shape {
            surface,
            ..Shape::default()
        }
    }

    #[test]
    fn a_box_is_filled_to_its_faces() {
        let found = boxes(
            &full(block(Vec3::ZERO, Vec3::new(2.0, 3.0, 4.0))),
            &[],
            [Vec3::ZERO, Vec3::new(2.0, 3.0, 4.0)],
            1e-4,
        );
        assert_eq!(found, [[Vec3::ZERO, Vec3::new(2.0, 3.0, 4.0)]]);
    }

    #[test]
    fn boxes_are_counted_as_their_voxels_are() {
        let size = [4, 3, 5];
        let solid: Vec<bool> = (0..60u32).map(|i| i.wrapping_mul(2_654_435_761) >> 29 != 0).collect();
        let counts = Counts::of(&solid, size);
        let mut full = 0;
        for low in voxels([0; 3], size) {
            for high in voxels(low.map(|i| i + 1), size.map(|i| i + 1)) {
                let expected = voxels(low, high).all(|v| solid[index(v, size)]);
                assert_eq!(counts.full(low, high), expected, "{low:?} {high:?}");
                full += usize::from(expected);
            }
        }
        assert!(full > 60, "{full}");
    }

    #[test]
    fn boxes_of_an_l_lie_inside_it() {
        // Two overlapping arms: every point of a found box must lie in one of them.
        let arms = [
            [Vec3::ZERO, Vec3::new(6.0, 1.0, 2.0)],
            [Vec3::ZERO, Vec3::new(2.0, 1.0, 6.0)],
        ];
        let triangles: Vec<_> = arms.iter().flat_map(|[a, b]| block(*a, *b)).collect();
        let found = boxes(&full(triangles), &[], [Vec3::ZERO, Vec3::new(6.0, 1.0, 6.0)], 1e-4);
        let volume: f32 = found.iter().map(|[a, b]| (*b - *a).element_product()).sum();
        assert!(volume > 15.0, "of 20 m³ only {volume} are filled");
        for [a, b] in found {
            for corner in [a, b, Vec3::new(a.x, a.y, b.z), Vec3::new(b.x, a.y, a.z)] {
                let inside = |[min, max]: &[Vec3; 2]| corner.cmpge(*min).all() && corner.cmple(*max).all();
                assert!(arms.iter().any(inside), "{corner} is outside");
            }
        }
    }

    #[test]
    fn boxes_keep_clear_of_what_stands_in_a_house() {
        let furniture = block(Vec3::splat(1.0), Vec3::splat(2.0));
        let found = boxes(
            &full(block(Vec3::ZERO, Vec3::splat(4.0))),
            &furniture,
            [Vec3::ZERO, Vec3::splat(4.0)],
            1e-4,
        );
        for [a, b] in found {
            let apart = a.cmpge(Vec3::splat(2.0)).any() || b.cmple(Vec3::splat(1.0)).any();
            assert!(apart, "{a} {b} holds furniture");
        }
    }

    #[test]
    fn walls_around_a_room_are_filled_and_the_room_is_not() {
        let inwards = |triangles: Vec<Triangle>| triangles.into_iter().map(|[a, b, c]| [a, c, b]).collect::<Vec<_>>();
        let (low, high) = (Vec3::splat(0.3), Vec3::new(7.7, 3.3, 5.7));
        // Beside the room, what lies open already: no cavity of this shape, though in its box.
        let shape = Shape {
            hides_both_ways: false,
            surface: block(Vec3::ZERO, Vec3::new(8.0, 3.6, 6.0)),
            cavities: [
                inwards(block(low, high)),
                inwards(block(Vec3::splat(9.0), Vec3::splat(9.5))),
            ]
            .concat(),
        };
        let found = boxes(&shape, &[], [Vec3::ZERO, Vec3::splat(10.0)], 1e-4);
        assert!(!found.is_empty());
        for [a, b] in found {
            let apart = a.cmpge(high - 1e-5).any() || b.cmple(low + 1e-5).any();
            assert!(apart, "{a} {b} is in the room");
            assert!(b.cmple(Vec3::new(8.0, 3.6, 6.0)).all(), "{a} {b} is outside");
        }
    }

    #[test]
    fn a_slanted_roof_is_not_overstepped() {
        // A prism: the roof falls from 4 m to 0 along x.
        let p = |x, y, z| Vec3::new(x, y, z);
        let mut triangles = Vec::new();
        triangles.extend(quad([p(0., 0., 0.), p(4., 0., 0.), p(4., 0., 4.), p(0., 0., 4.)]));
        triangles.extend(quad([p(0., 0., 0.), p(0., 0., 4.), p(0., 4., 4.), p(0., 4., 0.)]));
        triangles.extend(quad([p(0., 4., 0.), p(0., 4., 4.), p(4., 0., 4.), p(4., 0., 0.)]));
        triangles.push([p(0., 0., 0.), p(0., 4., 0.), p(4., 0., 0.)]);
        triangles.push([p(0., 0., 4.), p(4., 0., 4.), p(0., 4., 4.)]);
        let found = boxes(&full(triangles), &[], [Vec3::ZERO, Vec3::splat(4.0)], 1e-4);
        assert!(!found.is_empty());
        for [_, b] in found {
            assert!(b.x + b.y <= 4.0 + 1e-4, "the corner {b} is above the roof");
        }
    }
}
