//! Does a straight way meet anything that hides? For many questions about one scene.
//!
//! All faces in world space under a tree of boxes that are halved at the median of the longest side (Goldsmith and Salmon,
//! *Automatic Creation of Object Hierarchies for Ray Tracing*, 1987, without their cost). The semantics are those of
//! [`crate::scene`], but that doors may be closed: then their faces hide as any other's do. Cost: a few dozen boxes and faces for a
//! question.

use std::{collections::BTreeSet, ops::ControlFlow};

use belvedere_scene::ObjectId;
use glam::DVec3;

use crate::scene::Scene;

/// So many faces in a leaf.
const LEAF: usize = 4;
/// Ways end this share before what they lead to and begin so far from where they come from.
const CLEARANCE: f64 = 1e-9;

/// All that may hide.
#[derive(Debug)]
pub struct Blockade {
    faces: Vec<Face>,
    nodes: Vec<Node>,
}

#[derive(Debug, Clone)]
struct Face {
    corners: [DVec3; 3],
    /// It hides from its front only, where the corners go round counter-clockwise.
    front_only: bool,
    /// The door that it belongs to: it hides while that is closed.
    door: Option<ObjectId>,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    min: DVec3,
    max: DVec3,
    /// Of a leaf the first face, else the second child; the first child is the next node.
    at: usize,
    /// How many faces; zero of an inner node.
    count: usize,
}

impl Blockade {
    /// What hides in a scene, and what its doors hide when they are closed.
    #[must_use]
    pub fn of(scene: &Scene) -> Self {
        let mut faces = Vec::new();
        for object in &scene.objects {
            let (model, mirrored) = (&scene.models[object.model], object.mirrored());
            for patch in model.patches.iter().filter(|patch| !patch.surface.see_through) {
                faces.extend(patch.triangles.iter().map(|triangle| {
                    let mut corners = triangle.map(|i| object.world_from_object.transform_point3(model.position(i)));
                    if mirrored {
                        corners.swap(1, 2);
                    }
                    Face {
                        corners,
                        front_only: !patch.surface.double_sided,
                        door: object.door.then_some(object.id),
                    }
                }));
            }
        }
        let mut nodes = Vec::new();
        if !faces.is_empty() {
            let end = faces.len();
            grow(&mut nodes, &mut faces, 0, end);
        }
        Self { faces, nodes }
    }

    /// Whether one sees straight from one point to another while these doors are closed and the others open.
    #[must_use]
    pub fn sees(&self, from: DVec3, to: DVec3, closed: &BTreeSet<ObjectId>) -> bool {
        let mut free = true;
        self.meet(from, to, closed, &mut |_| {
            free = false;
            ControlFlow::Break(())
        });
        free
    }

    /// How far one sees on that way: the share of it before anything hides the rest, 1 for all of it.
    #[must_use]
    pub fn reach(&self, from: DVec3, to: DVec3, closed: &BTreeSet<ObjectId>) -> f64 {
        let mut nearest = 1.0f64;
        self.meet(from, to, closed, &mut |share| {
            nearest = nearest.min(share);
            ControlFlow::Continue(())
        });
        nearest
    }

    /// Calls with the share of the way at each face that hides.
    fn meet(&self, from: DVec3, to: DVec3, closed: &BTreeSet<ObjectId>, found: &mut dyn FnMut(f64) -> ControlFlow<()>) {
        let way = to - from;
        let mut open = if self.nodes.is_empty() { vec![] } else { vec![0] };
        while let Some(number) = open.pop() {
            let node = &self.nodes[number];
            if !node.is_met(from, way) {
                continue;
            }
            if node.count == 0 {
                open.extend([number + 1, node.at]);
                continue;
            }
            let faces = &self.faces[node.at..node.at + node.count];
            for share in faces.iter().filter_map(|face| face.hides_at(from, way, closed)) {
                if found(share).is_break() {
                    return;
                }
            }
        }
    }
}

/// Adds the tree over some faces, which it sorts.
fn grow(nodes: &mut Vec<Node>, faces: &mut [Face], first: usize, end: usize) {
    let some = &mut faces[first..end];
    let around = |points: &mut dyn Iterator<Item = DVec3>| {
        points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| {
            (min.min(p), max.max(p))
        })
    };
    let (min, max) = around(&mut some.iter().flat_map(|face| face.corners));
    let number = nodes.len();
    let count = if some.len() <= LEAF { some.len() } else { 0 };
    let at = first;
    nodes.push(Node { min, max, at, count });
    if count > 0 {
        return;
    }
    let (low, high) = around(&mut some.iter().map(Face::middle));
    let axis = (high - low).max_position();
    let half = some.len() / 2;
    some.select_nth_unstable_by(half, |a, b| a.middle()[axis].total_cmp(&b.middle()[axis]));
    grow(nodes, faces, first, first + half);
    nodes[number].at = nodes.len();
    grow(nodes, faces, first + half, end);
}

impl Node {
    fn is_met(&self, from: DVec3, way: DVec3) -> bool {
        let (mut enter, mut leave) = (0.0f64, 1.0f64);
        for axis in 0..3 {
            if way[axis] == 0.0 {
                if from[axis] < self.min[axis] || from[axis] > self.max[axis] {
                    return false;
                }
                continue;
            }
            let (a, b) = (
                (self.min[axis] - from[axis]) / way[axis],
                (self.max[axis] - from[axis]) / way[axis],
            );
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        enter <= leave
    }
}

impl Face {
    fn middle(&self) -> DVec3 {
        let [a, b, c] = self.corners;
        (a + b + c) / 3.0
    }

    /// The share of a way at which it hides the rest.
    fn hides_at(&self, from: DVec3, way: DVec3, closed: &BTreeSet<ObjectId>) -> Option<f64> {
        if self.door.is_some_and(|door| !closed.contains(&door)) {
            return None;
        }
        let [a, b, c] = self.corners;
        let normal = (b - a).cross(c - a);
        let approach = normal.dot(way);
        if approach == 0.0 || (self.front_only && approach > 0.0) {
            return None;
        }
        let share = normal.dot(a - from) / approach;
        if !(CLEARANCE..=1.0 - CLEARANCE).contains(&share) {
            return None;
        }
        let point = from + share * way;
        let inside = |from: DVec3, to: DVec3| normal.dot((to - from).cross(point - from)) >= 0.0;
        (inside(a, b) && inside(b, c) && inside(c, a)).then_some(share)
    }
}

#[cfg(test)]
mod tests {
    use glam::DMat4;

    use super::*;
    use crate::{
        scene::Object,
        testing::{BOTH_SIDES, GLASS, OPAQUE, object, quad, scene},
    };

    const NONE: BTreeSet<ObjectId> = BTreeSet::new();

    fn z(z: f64) -> DVec3 {
        DVec3::new(0.1, 0.2, z)
    }

    #[test]
    fn a_face_hides_where_it_is_drawn_and_glass_never_does() {
        let of = |surface| Blockade::of(&scene(vec![quad([-1.0; 2], [1.0; 2], 0.0, surface)]));
        for (surface, from_front, from_back) in [(OPAQUE, false, true), (BOTH_SIDES, false, false), (GLASS, true, true)]
        {
            let blockade = of(surface);
            assert_eq!(blockade.sees(z(1.0), z(-1.0), &NONE), from_front);
            assert_eq!(blockade.sees(z(-1.0), z(1.0), &NONE), from_back);
            assert!(blockade.sees(z(2.0), z(1.0), &NONE), "before it");
            assert!(
                blockade.sees(DVec3::new(2.0, 0.0, 1.0), DVec3::new(2.0, 0.0, -1.0), &NONE),
                "beside it"
            );
        }
        assert!(Blockade::of(&scene(vec![])).sees(z(1.0), z(-1.0), &NONE));
    }

    #[test]
    fn a_door_hides_while_it_is_closed_and_a_mirror_turns_faces() {
        let model = quad([-1.0; 2], [1.0; 2], 0.0, OPAQUE);
        let place = |transform| Object {
            world_from_object: transform,
            ..object(0, transform)
        };
        let door = Object {
            door: true,
            ..place(DMat4::IDENTITY)
        };
        let blockade = Blockade::of(&Scene::new(vec![model.clone()], vec![door]));
        assert!(blockade.sees(z(1.0), z(-1.0), &NONE));
        assert!(!blockade.sees(z(1.0), z(-1.0), &BTreeSet::from([ObjectId(0)])));
        let mirrored = place(DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0)));
        let blockade = Blockade::of(&Scene::new(vec![model], vec![mirrored]));
        assert!(!blockade.sees(z(1.0), z(-1.0), &NONE), "the front is still in front");
    }

    #[test]
    fn a_tree_of_many_faces_says_what_each_face_says() {
        let quads = (0..250u8).map(f32::from).map(|i| {
            let [x, y] = [(i * 0.37).sin() * 4.0, (i * 0.73).cos() * 4.0];
            quad([x, y], [x + 0.8, y + 0.6], (i * 0.11).sin() * 5.0, BOTH_SIDES)
        });
        let blockade = Blockade::of(&scene(quads.collect()));
        let mut random = crate::random::Random::of([1, 2, 3]);
        let mut point = |z: f64| DVec3::new(10.0 * random.unit() - 5.0, 10.0 * random.unit() - 5.0, z);
        let mut seen = 0;
        for _ in 0..500 {
            let (from, to) = (point(-6.0), point(6.0));
            let hits = blockade
                .faces
                .iter()
                .filter_map(|face| face.hides_at(from, to - from, &NONE));
            let plainly = hits.fold(1.0, f64::min);
            assert_eq!(blockade.reach(from, to, &NONE), plainly);
            assert_eq!(blockade.sees(from, to, &NONE), plainly == 1.0);
            seen += usize::from(plainly == 1.0);
        }
        assert!((50..450).contains(&seen), "{seen}");
    }
}
