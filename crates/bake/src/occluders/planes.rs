//! Which walls are there? Groups hiding faces by plane and finds what they cover.
//!
//! Cost: linear in faces, and in squares times the faces that meet them.

use std::collections::BTreeMap;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::wall::{Tolerance, Wall};
use crate::world::{Triangle, World};

/// At most this many walls.
const MAX_WALLS: usize = 8192;
/// A wall is at least this share of the scene's diagonal squared.
const MIN_AREA: f32 = 1e-6;
/// At most this many lines along an axis of a wall.
const MAX_LINES: usize = 256;
/// At most this many squares in all walls together.
const MAX_SQUARES: usize = 24 << 20;
/// So many walls are made at once, so that little is made that memory does not suffice for.
const AT_ONCE: usize = 64;
/// Normals are told apart to one part in this many.
const NORMAL_STEPS: f32 = 1024.0;

/// Faces in one plane, and on which side of it they hide.
#[derive(Clone)]
pub(super) struct Group {
    normal: Vec3,
    offset: f32,
    /// Sum of the areas of the faces.
    pub(super) area_m2: f32,
    /// Rising.
    pub(super) faces: Vec<(u32, [bool; 2])>,
}

/// A plane is a wall when the faces in it have this area together, in m².
pub(super) fn min_area_m2(world: &World) -> f32 {
    MIN_AREA * world.scale_m().powi(2)
}

/// Groups of faces that may be walls, largest first.
pub(super) fn groups_by_area(world: &World, tolerance: Tolerance) -> Vec<Group> {
    let mut groups = groups(world.triangles(), tolerance);
    groups.retain(|group| group.area_m2 >= min_area_m2(world));
    groups.sort_by(|a, b| b.area_m2.total_cmp(&a.area_m2).then(a.faces[0].0.cmp(&b.faces[0].0)));
    groups.truncate(MAX_WALLS);
    groups
}

/// The walls that groups make; none for those after which memory would not suffice.
pub(super) fn walls(groups: &[Group], world: &World, tolerance: Tolerance) -> Vec<Wall> {
    let mut squares = 0;
    let mut walls = Vec::with_capacity(groups.len());
    for some in groups.chunks(AT_ONCE) {
        let made: Vec<Wall> = some
            .par_iter()
            .map(|group| group.wall(world.triangles(), tolerance))
            .collect();
        for wall in made {
            squares += wall.lines[0].len() * wall.lines[1].len();
            if squares > MAX_SQUARES {
                return walls;
            }
            walls.push(wall);
        }
    }
    walls
}

fn groups(triangles: &[Triangle], tolerance: Tolerance) -> Vec<Group> {
    let step_m = 8.0 * tolerance.plane_m;
    let mut groups: Vec<Group> = Vec::new();
    let mut by_key: BTreeMap<([i32; 3], i64), Vec<u32>> = BTreeMap::new();
    for (index, triangle) in triangles.iter().enumerate() {
        let Some(Plane { normal, offset, hides }) = plane_of(triangle).filter(|plane| plane.hides != [false; 2]) else {
            continue;
        };
        let steps = normal.to_array().map(|x| (x * NORMAL_STEPS).round() as i32);
        let step = f64::from(offset / step_m).floor() as i64;
        let near = [step, step - 1, step + 1].into_iter().find_map(|step| {
            let found = by_key.get(&(steps, step))?;
            found.iter().copied().find(|group| {
                let group = &groups[*group as usize];
                lies_in(triangle, group.normal, group.offset, tolerance)
            })
        });
        let index_of = near.unwrap_or_else(|| {
            groups.push(Group {
                normal,
                offset,
                area_m2: 0.0,
                faces: Vec::new(),
            });
            by_key.entry((steps, step)).or_default().push(groups.len() as u32 - 1);
            groups.len() as u32 - 1
        });
        let group = &mut groups[index_of as usize];
        group.area_m2 += triangle.area_m2();
        group.faces.push((index as u32, hides));
    }
    groups
}

/// The plane of a triangle, and whether it hides what is on the side away from the normal, or on the normal's.
struct Plane {
    normal: Vec3,
    offset: f32,
    hides: [bool; 2],
}

fn plane_of(triangle: &Triangle) -> Option<Plane> {
    let [a, b, c] = triangle.corners;
    let front = (b - a).cross(c - a).try_normalize()?;
    // One normal for both sides of a plane: its largest part points up its axis.
    let flip = front[front.abs().max_position()] < 0.0;
    let normal = if flip { -front } else { front };
    let mut hides = [triangle.hides_from_front(), triangle.hides_from_back()];
    if flip {
        hides.reverse();
    }
    Some(Plane {
        normal,
        offset: normal.dot((a + b + c) / 3.0),
        hides,
    })
}

fn lies_in(triangle: &Triangle, normal: Vec3, offset: f32, tolerance: Tolerance) -> bool {
    let mut corners = triangle.corners.iter();
    corners.all(|p| (normal.dot(*p) - offset).abs() <= tolerance.plane_m)
}

impl Group {
    /// The part of it in some triangles, `None` when that is empty. Its plane is that of the largest face, and what stands
    /// off that plane, because a small face told its direction only roughly, is left out.
    pub(super) fn among(
        &self,
        triangles: &[Triangle],
        tolerance: Tolerance,
        mut among: impl FnMut(u32) -> bool,
    ) -> Option<Self> {
        let triangle = |face: &(u32, [bool; 2])| &triangles[face.0 as usize];
        let mut faces: Vec<_> = self.faces.iter().copied().filter(|(index, _)| among(*index)).collect();
        let smaller = |a: &&(u32, [bool; 2]), b: &&(u32, [bool; 2])| {
            let by_area = triangle(a).area_m2().total_cmp(&triangle(b).area_m2());
            by_area.then(b.0.cmp(&a.0))
        };
        let Plane { normal, offset, .. } = plane_of(triangle(faces.iter().max_by(smaller)?))?;
        faces.retain(|face| lies_in(triangle(face), normal, offset, tolerance));
        Some(Self {
            normal,
            offset,
            area_m2: faces.iter().map(|face| triangle(face).area_m2()).sum(),
            faces,
        })
    }

    fn axes(&self) -> [Vec3; 2] {
        // For an upright or level plane these are the world's own axes or lie level, as most edges do.
        let level = Vec3::Y.cross(self.normal);
        let first = if level.length_squared() > 1e-6 {
            level.normalize()
        } else {
            Vec3::X
        };
        [first, self.normal.cross(first)]
    }

    pub(super) fn wall(&self, triangles: &[Triangle], tolerance: Tolerance) -> Wall {
        let axes = self.axes();
        let flat: Vec<([Vec2; 3], [bool; 2])> = self
            .faces
            .iter()
            .map(|(index, hides)| {
                let place = |p: Vec3| Vec2::new(axes[0].dot(p), axes[1].dot(p));
                (triangles[*index as usize].corners.map(place), *hides)
            })
            .collect();
        let lines = [0, 1].map(|axis| lines(&flat, axis, tolerance));
        let squares = [0, 1].map(|side| {
            let faces = flat.iter().filter(|(_, hides)| hides[side]).map(|(corners, _)| corners);
            covered(faces, &lines, tolerance)
        });
        Wall::new(self.normal, self.offset, axes, lines, squares)
    }
}

/// Where corners lie along an axis; where there are too many, those on the longest edges across it.
fn lines(faces: &[([Vec2; 3], [bool; 2])], axis: usize, tolerance: Tolerance) -> Vec<f32> {
    let mut corners: Vec<(f32, f32)> = Vec::with_capacity(3 * faces.len());
    for (face, _) in faces {
        for i in 0..3 {
            let (from, to) = (face[i], face[(i + 1) % 3]);
            let straight = (from[axis] - to[axis]).abs() <= tolerance.plane_m;
            let length = if straight { (from - to).length() } else { 0.0 };
            corners.push((from[axis], length));
            corners.push((to[axis], length));
        }
    }
    corners.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut lines: Vec<(f32, f32)> = Vec::new();
    for (at, length) in corners {
        match lines.last_mut() {
            Some(last) if at - last.0 <= tolerance.plane_m => last.1 += length,
            _ => lines.push((at, length)),
        }
    }
    let ends = [lines[0].0, lines[lines.len() - 1].0];
    if lines.len() > MAX_LINES {
        lines.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.total_cmp(&b.0)));
        lines.truncate(MAX_LINES - 2);
    }
    let mut lines: Vec<f32> = lines.into_iter().map(|(at, _)| at).chain(ends).collect();
    lines.sort_by(f32::total_cmp);
    lines.dedup();
    if lines.len() == 1 {
        lines.push(lines[0] + tolerance.plane_m);
    }
    lines
}

/// For each square whether the faces cover all of it, but for gaps narrower than a hole.
fn covered<'a>(faces: impl Iterator<Item = &'a [Vec2; 3]>, lines: &[Vec<f32>; 2], tolerance: Tolerance) -> Vec<bool> {
    let width = lines[0].len() - 1;
    let height = lines[1].len() - 1;
    let grow_m = 0.5 * tolerance.hole_m;
    let mut left: Vec<Option<Vec<Vec<Vec2>>>> = vec![None; width * height];
    for face in faces {
        let Some(knife) = Knife::of(face, grow_m) else {
            continue;
        };
        let min = face[0].min(face[1]).min(face[2]);
        let max = face[0].max(face[1]).max(face[2]);
        let range = |axis: usize| {
            let first = lines[axis]
                .partition_point(|line| *line <= min[axis] - grow_m)
                .saturating_sub(1);
            let end = lines[axis].partition_point(|line| *line < max[axis] + grow_m);
            first..end.min(lines[axis].len() - 1)
        };
        for j in range(1) {
            for i in range(0) {
                let rest = left[j * width + i].get_or_insert_with(|| {
                    let [u, v] = [[lines[0][i], lines[0][i + 1]], [lines[1][j], lines[1][j + 1]]];
                    let corner = |a: usize, b: usize| Vec2::new(u[a], v[b]);
                    vec![vec![corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)]]
                });
                if !rest.is_empty() {
                    let mut pieces = Vec::new();
                    rest.drain(..).for_each(|piece| knife.cut(piece, &mut pieces));
                    *rest = pieces;
                }
            }
        }
    }
    left.into_iter()
        .map(|rest| rest.is_some_and(|rest| rest.is_empty()))
        .collect()
}

/// Takes a triangle, grown by a little, away from polygons.
struct Knife {
    /// Where each edge begins, and which way it leads around, counter-clockwise.
    edges: [[Vec2; 2]; 3],
    grow_m: f32,
}

impl Knife {
    /// `None` where an edge has no length.
    fn of(face: &[Vec2; 3], grow_m: f32) -> Option<Self> {
        let mut face = *face;
        if (face[1] - face[0]).perp_dot(face[2] - face[0]) < 0.0 {
            face.swap(1, 2);
        }
        let along = |i: usize| (face[(i + 1) % 3] - face[i]).try_normalize();
        Some(Self {
            edges: [[face[0], along(0)?], [face[1], along(1)?], [face[2], along(2)?]],
            grow_m,
        })
    }

    /// Positive inside of an edge, also for what is within the growth.
    fn inside(&self, [from, along]: &[Vec2; 2], p: Vec2) -> f32 {
        along.perp_dot(p - *from) + self.grow_m
    }

    /// Adds to `pieces` what is left of a convex polygon: convex polygons again.
    fn cut(&self, polygon: Vec<Vec2>, pieces: &mut Vec<Vec<Vec2>>) {
        // Most polygons lie beside the triangle or in it.
        let mut is_in = true;
        for edge in &self.edges {
            let (mut some_in, mut some_out) = (false, false);
            for p in &polygon {
                let height = self.inside(edge, *p);
                some_in |= height > 0.0;
                some_out |= height < 0.0;
            }
            if !some_in {
                pieces.push(polygon);
                return;
            }
            is_in &= !some_out;
        }
        if is_in {
            return;
        }
        let before = pieces.len();
        let mut rest = polygon.clone();
        for edge in &self.edges {
            let outer = clipped(&rest, |p| -self.inside(edge, p));
            if outer.len() > 2 {
                pieces.push(outer);
            }
            rest = clipped(&rest, |p| self.inside(edge, p));
            if rest.len() < 3 {
                pieces.truncate(before);
                pieces.push(polygon);
                return;
            }
        }
    }
}

/// The part of a convex polygon where a linear function is not negative.
fn clipped(polygon: &[Vec2], height: impl Fn(Vec2) -> f32) -> Vec<Vec2> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (here, there) = (height(*a), height(b));
        if here >= 0.0 {
            kept.push(*a);
        }
        if (here > 0.0 && there < 0.0) || (here < 0.0 && there > 0.0) {
            kept.push(*a + here / (here - there) * (b - *a));
        }
    }
    let area: f32 = (2..kept.len())
        .map(|i| (kept[i - 1] - kept[0]).perp_dot(kept[i] - kept[0]))
        .sum();
    if area <= f32::MIN_POSITIVE { Vec::new() } else { kept }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOLERANCE: Tolerance = Tolerance {
        plane_m: 1e-5,
        hole_m: 1e-3,
    };

    fn p(u: f32, v: f32) -> Vec2 {
        Vec2::new(u, v)
    }

    #[test]
    fn two_triangles_cover_their_rectangle_and_a_cut_corner_does_not() {
        let lines = [vec![0.0, 2.0, 4.0], vec![0.0, 3.0]];
        let faces = [[p(0., 0.), p(4., 0.), p(4., 3.)], [p(0., 0.), p(4., 3.), p(0., 3.)]];
        assert_eq!(covered(faces.iter(), &lines, TOLERANCE), [true, true]);
        let cut = [[p(0., 0.), p(4., 0.), p(4., 3.)], [p(0., 0.), p(4., 3.), p(1., 3.)]];
        assert_eq!(covered(cut.iter(), &lines, TOLERANCE), [false, true]);
    }

    #[test]
    fn a_gap_as_wide_as_a_hole_stays_open() {
        let lines = [vec![0.0, 2.0], vec![0.0, 1.0]];
        let rectangle = |a: f32, b: f32| [[p(a, 0.), p(b, 0.), p(b, 1.)], [p(a, 0.), p(b, 1.), p(a, 1.)]];
        let with_gap = |gap_m: f32| [rectangle(0.0, 1.0), rectangle(1.0 + gap_m, 2.0)].concat();
        assert_eq!(covered(with_gap(0.9e-3).iter(), &lines, TOLERANCE), [true]);
        assert_eq!(covered(with_gap(1.2e-3).iter(), &lines, TOLERANCE), [false]);
    }

    #[test]
    fn a_small_face_does_not_tilt_the_wall_that_is_left_when_others_are_gone() {
        let aslant = Vec3::new(0.3, 0.0, 0.9).normalize();
        let along = Vec3::new(0.9, 0.0, -0.3).normalize();
        let at = |u: f32, v: f32| 200.0 * aslant + u * along + Vec3::new(0.0, v, 0.0);
        let triangle = |corners: [Vec3; 3], object| Triangle::opaque(corners, object);
        let triangles = [
            triangle([at(-40., 0.), at(-1., 0.), at(-40., 30.)], 0),
            triangle([at(0., 0.), at(0.05, 0.), at(0.05, 0.03)], 1),
            triangle([at(1., 0.), at(61., 0.), at(61., 10.)], 2),
            triangle([at(1., 0.), at(61., 10.), at(1., 10.)], 2),
        ];
        let tolerance = Tolerance {
            plane_m: 2e-4,
            hole_m: 1e-3,
        };
        let groups = groups(&triangles, tolerance);
        assert_eq!(groups.len(), 1);
        let part = groups[0].among(&triangles, tolerance, |face| face > 0).unwrap();
        for (face, _) in &part.faces {
            assert!(lies_in(&triangles[*face as usize], part.normal, part.offset, tolerance));
        }
        assert!(part.area_m2 > 599.0, "{} m²", part.area_m2);
    }
}
