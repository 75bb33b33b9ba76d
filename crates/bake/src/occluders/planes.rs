//! Which walls are there? Groups hiding faces by plane and finds what they cover.
//!
//! Cost: linear in faces, and in squares times the faces that meet them.

use std::collections::BTreeMap;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::{
    squares::{covered, lines},
    wall::{Tolerance, Wall},
};
use crate::{
    progress::{Cancelled, Portion, Progress},
    random::GOLDEN,
    world::{Triangle, World},
};

/// Steps of progress that finding groups takes …
const GROUPS: u64 = 1500;
/// … and making walls of them …
const WALLS: u64 = 1500;
/// … and both.
pub(super) const STEPS: u64 = GROUPS + WALLS;
/// Triangles that are done are told of so many at a time.
const AT_A_TIME: usize = 1 << 16;
/// At most this many walls.
const MAX_WALLS: usize = 8192;
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
    pub(super) faces: Vec<Face>,
}

/// A triangle of the world, and whether it hides what is on the side away from the normal of its plane, or on the normal's.
pub(super) type Face = (u32, [bool; 2]);

/// A plane is a wall when the faces in it have this area together, in m².
pub(super) fn min_area_m2(world: &World) -> f32 {
    world.small_m().powi(2)
}

/// A wall is somewhere at least as wide and high as this, in m: strips hide next to nothing, and towns are full of them.
pub(super) fn min_width_m(world: &World) -> f32 {
    world.small_m()
}

/// Groups of faces that may be walls, largest first.
///
/// # Errors
/// When cancelled.
pub(super) fn groups_by_area(
    world: &World,
    tolerance: Tolerance,
    progress: &dyn Progress,
) -> Result<Vec<Group>, Cancelled> {
    let mut groups = groups(world, tolerance, min_area_m2(world), progress)?;
    groups.retain(|group| group.area_m2 >= min_area_m2(world));
    groups.sort_by(|a, b| b.area_m2.total_cmp(&a.area_m2).then(a.faces[0].0.cmp(&b.faces[0].0)));
    groups.truncate(MAX_WALLS);
    Ok(groups)
}

/// The walls that groups make, but for narrow ones, whose groups go; none for groups after which memory would not suffice.
///
/// # Errors
/// When cancelled.
pub(super) fn walls(
    groups: &mut Vec<Group>,
    world: &World,
    tolerance: Tolerance,
    progress: &dyn Progress,
) -> Result<Vec<Wall>, Cancelled> {
    let faces = groups.iter().map(|group| group.faces.len() as u64);
    let portion = Portion::of(progress, WALLS, faces.sum());
    let mut squares = 0;
    let mut walls = Vec::with_capacity(groups.len());
    let mut is_kept = vec![true; groups.len()];
    'all: for (some, is_kept) in groups.chunks(AT_ONCE).zip(is_kept.chunks_mut(AT_ONCE)) {
        let made = some.par_iter().map(|group| {
            if portion.cancelled() {
                return Err(Cancelled);
            }
            let wall = group.wall(world, tolerance);
            portion.advance(group.faces.len() as u64);
            Ok(wall)
        });
        let made = made.collect::<Result<Vec<_>, _>>()?;
        for (wall, is_kept) in made.into_iter().zip(is_kept) {
            squares += wall.lines[0].len() * wall.lines[1].len();
            if squares > MAX_SQUARES {
                break 'all;
            }
            *is_kept = wall.is_wide(min_width_m(world));
            walls.extend(is_kept.then_some(wall));
        }
    }
    let mut is_kept = is_kept.into_iter();
    groups.retain(|_| is_kept.next().unwrap_or(true));
    Ok(walls)
}

/// Groups of faces; those that have less than this area need not be among them.
fn groups(
    world: &World,
    tolerance: Tolerance,
    least_m2: f32,
    progress: &dyn Progress,
) -> Result<Vec<Group>, Cancelled> {
    let step_m = 8.0 * tolerance.plane_m;
    // All triangles are looked at once for areas and once for groups.
    let portion = Portion::of(progress, GROUPS, 2 * world.triangle_count() as u64);
    let areas = Areas::of(world, step_m, &portion)?;
    let mut groups: Vec<Group> = Vec::new();
    let mut by_key: BTreeMap<Key, Vec<u32>> = BTreeMap::new();
    for (index, triangle) in world.triangles().enumerate() {
        tell(index, &portion)?;
        let Some(Plane { normal, offset, hides }) = plane_of(&triangle).filter(|plane| plane.hides != [false; 2])
        else {
            continue;
        };
        let (steps, step) = key(normal, offset, step_m);
        if areas.around(steps, step) < f64::from(least_m2) {
            continue;
        }
        let near = [step, step - 1, step + 1].into_iter().find_map(|step| {
            let found = by_key.get(&(steps, step))?;
            found.iter().copied().find(|group| {
                let group = &groups[*group as usize];
                lies_in(&triangle, group.normal, group.offset, tolerance)
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
    Ok(groups)
}

/// Tells now and then of triangles that are done, of which this is the next.
fn tell(triangle: usize, progress: &dyn Progress) -> Result<(), Cancelled> {
    if triangle > 0 && triangle.is_multiple_of(AT_A_TIME) {
        progress.advance(AT_A_TIME as u64);
        if progress.cancelled() {
            return Err(Cancelled);
        }
    }
    Ok(())
}

/// Planes with one key, or with offsets that differ by a step, may be one.
type Key = ([i32; 3], i64);

fn key(normal: Vec3, offset: f32, step_m: f32) -> Key {
    let steps = normal.to_array().map(|x| (x * NORMAL_STEPS).round() as i32);
    (steps, f64::from(offset / step_m).floor() as i64)
}

/// How large the faces with each key are together, or larger: keys share places. A wood has millions of leaves, and none of
/// them lies in a plane that is worth a look.
struct Areas(Vec<f64>);

impl Areas {
    const PLACES: usize = 1 << 20;
    /// A group may hold faces that are a step away from its first one, to either side.
    const REACH: i64 = 2;

    fn of(world: &World, step_m: f32, progress: &dyn Progress) -> Result<Self, Cancelled> {
        let mut areas = vec![0.0; Self::PLACES];
        for (index, triangle) in world.triangles().enumerate() {
            tell(index, progress)?;
            if let Some(Plane { normal, offset, .. }) = plane_of(&triangle) {
                let (steps, step) = key(normal, offset, step_m);
                areas[Self::place(steps, step)] += f64::from(triangle.area_m2());
            }
        }
        Ok(Self(areas))
    }

    fn place(steps: [i32; 3], step: i64) -> usize {
        let mix = |hash: u64, part: u64| (hash ^ part).wrapping_mul(GOLDEN).rotate_left(29);
        let hash = steps.iter().fold(step as u64, |hash, part| mix(hash, *part as u64));
        (mix(hash, 0) >> 32) as usize % Self::PLACES
    }

    /// At least the area of any group that a face with this key may come into.
    fn around(&self, steps: [i32; 3], step: i64) -> f64 {
        let near = step - Self::REACH..=step + Self::REACH;
        near.map(|step| self.0[Self::place(steps, step)]).sum()
    }
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
    /// Some faces of a group, rising, `None` when there are none. Its plane is that of the largest face, and what stands
    /// off that plane, because a small face told its direction only roughly, is left out.
    pub(super) fn of_some(mut faces: Vec<Face>, world: &World, tolerance: Tolerance) -> Option<Self> {
        let triangle = |face: &Face| world.triangle(face.0);
        let smaller = |a: &&Face, b: &&Face| {
            let by_area = triangle(a).area_m2().total_cmp(&triangle(b).area_m2());
            by_area.then(b.0.cmp(&a.0))
        };
        let Plane { normal, offset, .. } = plane_of(&triangle(faces.iter().max_by(smaller)?))?;
        faces.retain(|face| lies_in(&triangle(face), normal, offset, tolerance));
        Some(Self {
            normal,
            offset,
            area_m2: faces.iter().map(|face| triangle(face).area_m2()).sum(),
            faces,
        })
    }

    pub(super) fn wall(&self, world: &World, tolerance: Tolerance) -> Wall {
        let axes = Wall::axes_across(self.normal);
        let flat: Vec<([Vec2; 3], [bool; 2])> = self
            .faces
            .iter()
            .map(|(index, hides)| {
                let place = |p: Vec3| Vec2::new(axes[0].dot(p), axes[1].dot(p));
                (world.triangle(*index).corners.map(place), *hides)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{cells::plan::Builder, progress::Silent};

    #[test]
    fn a_small_face_does_not_tilt_the_wall_that_is_left_when_others_are_gone() {
        let aslant = Vec3::new(0.3, 0.0, 0.9).normalize();
        let along = Vec3::new(0.9, 0.0, -0.3).normalize();
        let at = |u: f32, v: f32| 200.0 * aslant + u * along + Vec3::new(0.0, v, 0.0);
        let mut builder = Builder::default();
        for faces in [
            &[[at(-40., 0.), at(-1., 0.), at(-40., 30.)]][..],
            &[[at(0., 0.), at(0.05, 0.), at(0.05, 0.03)]],
            &[
                [at(1., 0.), at(61., 0.), at(61., 10.)],
                [at(1., 0.), at(61., 10.), at(1., 10.)],
            ],
        ] {
            let corners: Vec<_> = faces.concat().iter().map(Vec3::to_array).collect();
            let indices = 0..corners.len() as u32;
            builder.mesh("faces", corners, indices.collect());
        }
        let world = World::new(&builder.scene).unwrap();
        let tolerance = Tolerance {
            plane_m: 2e-4,
            hole_m: 1e-3,
        };
        let groups = groups(&world, tolerance, 0.0, &Silent).unwrap();
        assert_eq!(groups.len(), 1);
        let part = Group::of_some(groups[0].faces[1..].to_vec(), &world, tolerance).unwrap();
        for (face, _) in &part.faces {
            assert!(lies_in(&world.triangle(*face), part.normal, part.offset, tolerance));
        }
        assert!(part.area_m2 > 599.0, "{} m²", part.area_m2);
    }
}
