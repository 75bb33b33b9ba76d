//! Does any sight line lead from a region to an object, if neither a proof for all of both nor a ray said so?
//!
//! A proof fails where openings are seen at a slant by some eyes, or where some of the object is seen past a jamb. So both ends
//! are cut, coarse to fine, whichever is longer: eyes into halves of their region (the subcells of Cohen-Or & Zadicario,
//! *Visibility streaming for network-based walkthroughs*, 1998), and what they look at into what of the object's surface lies in
//! either half of its box ([`super::surface`]). It also fails where eyes stand on both sides of a wall's plane, as around the corner
//! of a house; so these are cut there first ([`Prover::astride`]). The object is hidden when a proof holds for each pair of parts. What a proof
//! leaves open is narrow by then, and so is the way to it: a few rays between the two parts often find the sight line
//! ([`Scout`]).
//!
//! Guarantee: conservative, as [`super::prover`] is. Parts of the surface are looked at with a margin, so that a body does not
//! hide the face that it lies behind. Cost: at most as many pairs of parts as [`Limits`] allow.

use std::{collections::VecDeque, rc::Rc};

use super::{
    fusion::Shadows,
    prover::{Prover, Witness},
    surface::Surface,
};
use crate::{occluders::Region, world::World};

/// Looks for sight lines to what proofs leave open.
pub trait Scout {
    /// Whether the object is seen from the region when one looks at it a few times.
    fn glances(&mut self, object: u32, eye: &Region) -> bool;

    /// The object's faces, where they are known.
    fn surface(&self, object: u32) -> Option<Surface>;

    /// Whether a sight line leads from a part of the region to a part of the object's surface, `ways` being openings that may
    /// lie on it.
    fn looks(&mut self, object: u32, eye: &Region, part: &Surface, ways: &[Region]) -> bool;
}

/// Knows no faces and sees nothing: for who has nothing but boxes.
pub struct Blind;

impl Scout for Blind {
    fn glances(&mut self, _: u32, _: &Region) -> bool {
        false
    }

    fn surface(&self, _: u32) -> Option<Surface> {
        None
    }

    fn looks(&mut self, _: u32, _: &Region, _: &Surface, _: &[Region]) -> bool {
        false
    }
}

/// Knows the faces of a world's objects, which are numbered as there, and sees nothing.
pub struct Faces<'a>(pub &'a World);

impl Scout for Faces<'_> {
    fn glances(&mut self, _: u32, _: &Region) -> bool {
        false
    }

    fn surface(&self, object: u32) -> Option<Surface> {
        Surface::of(self.0, object)
    }

    fn looks(&mut self, _: u32, _: &Region, _: &Surface, _: &[Region]) -> bool {
        false
    }
}

/// How far a question is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// So many pairs of parts may be cut, those that were cut before included.
    pub cuts: u32,
    /// All proofs together may take so many more tests of a wall.
    pub steps: u32,
}

/// What came of a question.
#[derive(Debug, Clone, PartialEq)]
pub enum Answer {
    /// No sight line leads there, for these reasons.
    Hidden(Vec<Witness>),
    /// The scout found one.
    Seen,
    /// Nobody knows yet.
    Open,
}

/// Whether an object is seen from a region, as far as that was followed.
#[derive(Debug)]
pub struct Question {
    /// The object.
    pub object: u32,
    /// Parts of the region, each with what of the object is still to be looked at from there.
    pairs: VecDeque<(Region, Rc<Surface>)>,
    witnesses: Vec<Witness>,
    cuts: u32,
}

impl Question {
    /// Asks about an object, around which `target` is. `None` when its faces are not known and some eyes are in there:
    /// these see what it holds and not the box around it.
    pub fn new(eye: &Region, (object, target): (u32, &Region), scout: &dyn Scout) -> Option<Self> {
        let from_outside = || (!eye.overlaps(target)).then(|| Surface::of_box(target));
        let surface = scout.surface(object).or_else(from_outside)?;
        Some(Self {
            object,
            pairs: VecDeque::from([(eye.clone(), Rc::new(surface))]),
            witnesses: Vec::new(),
            cuts: 0,
        })
    }

    /// How many pairs of parts were cut.
    pub fn cuts(&self) -> u32 {
        self.cuts
    }

    /// Goes on where it stopped. `shadows` are those that bodies cast for all of the region or a larger one.
    pub fn follow(
        &mut self,
        prover: &mut Prover<'_>,
        shadows: Option<&Shadows>,
        limits: Limits,
        scout: &mut dyn Scout,
    ) -> Answer {
        let margin_m = prover.margin_m();
        let steps_at_end = prover.budget().saturating_sub(limits.steps);
        while let Some((eye, part)) = self.pairs.pop_front() {
            let target = part.around(margin_m);
            // Shadows begin a little behind what casts them, so these need no margin.
            let hidden = if shadows.is_some_and(|shadows| shadows.hide(&part.around(0.0))) {
                Some(Witness::Fused)
            } else {
                prover.hides(&eye, &target)
            };
            if let Some(witness) = hidden {
                if !self.witnesses.contains(&witness) {
                    self.witnesses.push(witness);
                }
                continue;
            }
            if scout.looks(self.object, &eye, &part, prover.leak()) {
                return Answer::Seen;
            }
            if self.cuts == limits.cuts || prover.budget() <= steps_at_end {
                self.pairs.push_front((eye, part));
                return Answer::Open;
            }
            self.cuts += 1;
            let eyes = match prover.astride() {
                Some((axis, at)) => Some(eye.cut(axis, at)),
                None => (longest_m(&eye) >= longest_m(&target)).then(|| eye.halves()),
            };
            if let Some(eyes) = eyes {
                self.pairs.extend(eyes.map(|eye| (eye, Rc::clone(&part))));
            } else {
                let parts = part.halves().into_iter().filter(|half| !half.is_empty());
                self.pairs.extend(parts.map(|half| (eye.clone(), Rc::new(half))));
            }
        }
        Answer::Hidden(std::mem::take(&mut self.witnesses))
    }
}

fn longest_m(region: &Region) -> f32 {
    (region.max - region.min).max_element()
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::{
        cells::plan::Builder,
        source::{Primitive, Topology},
        visibility::{
            conservative::Scenery,
            prover::{Proofs, Prover},
            random::Random,
        },
    };

    const LIMITS: Limits = Limits {
        cuts: 4096,
        steps: u32::MAX,
    };
    const PROOFS: Proofs = Proofs {
        bodies: true,
        walls: true,
    };
    const WALL: u32 = 0;
    const FRAME: u32 = 1;
    const BEHIND: u32 = 2;

    /// A wall across x at 0 with a door; a frame 5 cm behind it that leaves more than the door open; and a board behind the
    /// wall, beside the door.
    fn wall_frame_and_board() -> World {
        let mut builder = Builder::default();
        let mut panel = |name: &str, x: f32, doorway: [[f32; 2]; 2]| {
            let [[z0, z1], [_, top]] = doorway;
            let spans = [
                ([-10.0, z0], [0.0, 3.0]),
                ([z1, 20.0], [0.0, 3.0]),
                ([z0, z1], [top, 3.0]),
            ];
            let (mut corners, mut indices) = (Vec::new(), Vec::new());
            for ([z0, z1], [y0, y1]) in spans {
                let first = corners.len() as u32;
                corners.extend([[x, y0, z0], [x, y0, z1], [x, y1, z1], [x, y1, z0]]);
                // It faces the eye, where x is less.
                indices.extend([0, 1, 2, 0, 2, 3].map(|i| first + i));
            }
            builder.mesh(name, corners, indices);
        };
        panel("wall", 0.0, [[4.0, 5.0], [0.0, 2.0]]);
        panel("frame", 0.05, [[3.5, 5.5], [0.0, 2.4]]);
        let board = [[1.0, 0.5, 0.0], [1.0, 0.5, 1.0], [1.0, 1.5, 1.0]];
        builder.mesh("board", board.to_vec(), vec![0, 1, 2]);
        World::new(&builder.scene).unwrap()
    }

    fn ask(world: &World, eye: &Region, object: u32, scout: &mut dyn Scout) -> Answer {
        ask_within(LIMITS, world, eye, object, scout)
    }

    fn ask_within(limits: Limits, world: &World, eye: &Region, object: u32, scout: &mut dyn Scout) -> Answer {
        let scenery = Scenery::of(world);
        let mut prover = Prover::new(&scenery.blocker, PROOFS);
        let target = scenery.targets[object as usize].clone().unwrap();
        let question = Question::new(eye, (object, &target), scout);
        question.map_or(Answer::Open, |mut q| q.follow(&mut prover, None, limits, scout))
    }

    fn eye(world: &World) -> Region {
        let [min, max] = [[-6.0, 1.0, 0.0], [-5.0, 1.5, 1.0]].map(|p| world.relative(p));
        Region::of_box(min, max)
    }

    #[test]
    fn a_wall_is_not_seen_through_its_own_door() {
        let world = wall_frame_and_board();
        let eye = eye(&world);
        assert_eq!(ask(&world, &eye, FRAME, &mut Blind), Answer::Open, "its box is");
        assert!(matches!(
            ask(&world, &eye, FRAME, &mut Faces(&world)),
            Answer::Hidden(_)
        ));
        assert!(matches!(ask(&world, &eye, BEHIND, &mut Blind), Answer::Hidden(_)));
        assert_eq!(ask(&world, &eye, WALL, &mut Faces(&world)), Answer::Open);
    }

    #[test]
    fn a_box_that_nobody_sees_from_outside_says_nothing_of_what_it_holds() {
        let mut builder = Builder::default();
        builder.block("west", [-3.2, 0.0, -3.0], [-3.0, 3.0, 3.0]);
        builder.block("east", [3.0, 0.0, -3.0], [3.2, 3.0, 3.0]);
        for z in [-3.2, 3.0] {
            builder.block("side", [-3.2, 0.0, z], [3.2, 3.0, z + 0.2]);
        }
        for y in [-0.2, 3.0] {
            builder.block("slab", [-3.2, y, -3.2], [3.2, y + 0.2, 3.2]);
        }
        // Two things that stand around the room on all sides; one of them is in there, too.
        let around = [
            [-5.0, 1.0, 0.0],
            [5.0, 1.0, 0.0],
            [0.0, 1.0, -5.0],
            [0.0, 1.0, 5.0],
            [0.0, -1.5, 0.0],
            [0.0, 4.5, 0.0],
        ];
        for (name, places) in [
            ("outside", &around[..]),
            ("scattered", &[&around[..], &[[1.0, 1.0, 0.0]]].concat()),
        ] {
            let corners = places
                .iter()
                .flat_map(|[x, y, z]| [[*x, *y, *z], [x + 0.2, *y, *z], [*x, y + 0.2, z + 0.2]]);
            let corners: Vec<_> = corners.collect();
            let indices = (0..corners.len() as u32).collect();
            builder.mesh(name, corners, indices);
        }
        let world = World::new(&builder.scene).unwrap();
        let [outside, scattered] = [2, 1].map(|last| world.object_bounds().len() as u32 - last);
        let [min, max] = [[-2.0, 1.0, -2.0], [-1.0, 2.0, -1.0]].map(|p| world.relative(p));
        let eye = Region::of_box(min, max);
        assert!(matches!(
            ask(&world, &eye, outside, &mut Faces(&world)),
            Answer::Hidden(_)
        ));
        assert_eq!(ask(&world, &eye, scattered, &mut Faces(&world)), Answer::Open);
        // The box around either is hidden on all sides.
        for object in [outside, scattered] {
            assert_eq!(ask(&world, &eye, object, &mut Blind), Answer::Open);
        }
    }

    #[test]
    fn a_line_is_not_hidden_with_the_faces_of_its_object() {
        let mut builder = Builder::default();
        builder.block("wall", [0.0, 0.0, -10.0], [0.2, 3.0, 4.0]);
        builder.mesh(
            "board",
            vec![[1.0, 0.5, 0.0], [1.0, 0.5, 1.0], [1.0, 1.5, 1.0]],
            vec![0, 1, 2],
        );
        let model = builder.scene.models.len() - 1;
        let ask_about = |builder: &Builder| {
            let world = World::new(&builder.scene).unwrap();
            let [min, max] = [[-6.0, 1.0, 0.0], [-5.0, 1.5, 1.0]].map(|p| world.relative(p));
            let board = world.object_bounds().len() as u32 - 1;
            ask(&world, &Region::of_box(min, max), board, &mut Faces(&world))
        };
        assert!(matches!(ask_about(&builder), Answer::Hidden(_)));
        builder.scene.models[model].primitives.push(Primitive {
            topology: Topology::Lines,
            positions: vec![[1.0, 1.0, 1.0], [1.0, 1.0, 9.0]],
            indices: vec![0, 1],
            ..Primitive::default()
        });
        assert_eq!(ask_about(&builder), Answer::Open);
    }

    #[test]
    fn nothing_that_a_ray_sees_is_hidden_whatever_the_eye() {
        let world = wall_frame_and_board();
        let mut random = Random::stream(11, 0);
        let (mut hidden, mut seen) = (0, 0);
        for _ in 0..60 {
            let corner = Vec3::new(-7.0, 0.0, -4.0) + random.cube() * Vec3::new(6.0, 1.5, 10.0);
            let eye = Region::of_box(corner, corner + 0.01 + random.cube());
            for object in [FRAME, BEHIND] {
                let surface = Surface::of(&world, object).unwrap();
                let mut passed = Vec::new();
                let is_seen = (0..4000).any(|_| {
                    let from = eye.min + random.cube() * (eye.max - eye.min);
                    let towards = surface.point(&mut random) - from;
                    let hit = world.cast(from, towards, f32::MAX, &mut passed);
                    hit.is_some_and(|hit| hit.object == object)
                });
                let answer = ask(&world, &eye, object, &mut Faces(&world));
                assert!(
                    !(is_seen && matches!(answer, Answer::Hidden(_))),
                    "{object} from {eye:?}"
                );
                hidden += usize::from(matches!(answer, Answer::Hidden(_)));
                seen += usize::from(is_seen);
            }
        }
        assert!(hidden > 20 && seen > 5, "{hidden} hidden, {seen} seen");
    }

    #[test]
    fn eyes_on_both_sides_of_a_facade_do_not_see_through_the_notch_at_its_corner() {
        // Walls end where their middles meet, so that the corner outside lacks a square.
        let mut builder = Builder::default();
        builder.block("floor", [-0.5, -0.3, -0.5], [10.5, 0.0, 10.5]);
        builder.block("roof", [-0.5, 3.0, -0.5], [10.5, 3.3, 10.5]);
        for at in [0.0, 10.0] {
            builder.block("wall", [at - 0.1, 0.0, 0.0], [at + 0.1, 3.0, 10.0]);
            builder.block("wall", [0.0, 0.0, at - 0.1], [10.0, 3.0, at + 0.1]);
        }
        let thing = builder.block("thing", [5.0, 0.0, 5.0], [5.5, 1.0, 5.5]);
        let world = World::new(&builder.scene).unwrap();
        let [min, max] = [[-2.5, 0.3, -2.5], [-0.5, 2.0, 5.0]].map(|p| world.relative(p));
        let eye = Region::of_box(min, max);
        let few = Limits { cuts: 32, ..LIMITS };
        let answer = ask_within(few, &world, &eye, thing, &mut Faces(&world));
        assert!(matches!(answer, Answer::Hidden(_)), "{answer:?}");
    }
}
