//! What does a closed door hide?
//!
//! Sets are computed with all doors open. An entry depends on a door when, with that door alone closed, the object can
//! be proved hidden from the whole cell ([`Screening`], as on line), or from each of a few parts of it. Then every sight line to it passes the door, so one
//! known sight line that does not answers the question without a proof. Two doors neither of which hides an object alone,
//! but which do together, are not noted: whoever asks with both closed may get an object too many, never one too few.

use super::{sampler::Sighting, screen::Screening, surroundings::Surroundings};
use crate::occluders::Region;

/// A proof that one door hides one object takes at most so many tests of a wall, and so many for parts of the cell.
const STEPS: u32 = 1500;
/// How often the cell is halved where a proof for all of it fails.
const HALVINGS: u32 = 3;

/// Finds the doors that hide objects from one cell.
pub(super) struct Marker<'a> {
    surroundings: &'a Surroundings,
    eye: &'a Region,
    /// In numbers of the surroundings.
    doors: Vec<u32>,
    screening: Screening<'a>,
}

impl<'a> Marker<'a> {
    pub(super) fn new(surroundings: &'a Surroundings, eye: &'a Region) -> Self {
        let blocker = &surroundings.scenery.blocker;
        Self {
            surroundings,
            eye,
            doors: blocker.doors(),
            screening: Screening::new(blocker, &[], 0),
        }
    }

    /// Doors each of which hides an object when it is closed, rising. `known` is a sight line to it.
    pub(super) fn doors_of(&mut self, object: u32, known: Option<&Sighting>) -> Vec<u32> {
        if self.doors.is_empty() {
            return Vec::new();
        }
        let Some(number) = self.surroundings.number_of(object) else {
            return Vec::new();
        };
        let Some(target) = &self.surroundings.scenery.targets[number as usize] else {
            return Vec::new();
        };
        let [from, to] = known.map_or([self.eye.center(), target.center()], |s| [s.eye, s.target]);
        let blocker = &self.surroundings.scenery.blocker;
        let (eye, screening) = (self.eye, &mut self.screening);
        let hides = |door: &&u32| {
            **door != number && blocker.door_is_on(**door, from, to) && {
                screening.close(vec![**door], STEPS);
                screening.hides(eye, target).is_some() || {
                    screening.close(vec![**door], STEPS);
                    halves_are_hidden(screening, eye, target, HALVINGS)
                }
            }
        };
        let doors = self.doors.iter().filter(hides);
        doors.map(|door| self.surroundings.objects[*door as usize]).collect()
    }
}

/// Whether closed doors hide the target from both halves of the region, or from halves of these, so often.
fn halves_are_hidden(screening: &mut Screening<'_>, eye: &Region, target: &Region, halvings: u32) -> bool {
    halvings > 0
        && eye.halves().iter().all(|half| {
            screening.hides(half, target).is_some() || halves_are_hidden(screening, half, target, halvings - 1)
        })
}

#[cfg(test)]
mod tests {
    use super::super::{Method, Views, VisibilitySettings, compute};
    use crate::{
        cells::{self, CellSettings, plan::Builder},
        memory::Forgetful,
        occluders::Hiders,
        progress::Silent,
        source::Role,
        world::World,
    };

    /// Two rooms of 6 m with a thing in each, and between them a wall at x = 0 with a door in it; the wall and the door are so
    /// thick, or sheets.
    fn rooms(wall_m: f32, door_m: f32) -> (Builder, [u32; 2], u32) {
        let mut builder = Builder::default();
        builder.block("floor", [-6.2, -0.2, -3.2], [6.2, 0.0, 3.2]);
        builder.block("ceiling", [-6.2, 3.0, -3.2], [6.2, 3.2, 3.2]);
        for x in [-6.2, 6.0] {
            builder.block("end", [x, 0.0, -3.2], [x + 0.2, 3.0, 3.2]);
        }
        for z in [-3.2, 3.0] {
            builder.block("side", [-6.0, 0.0, z], [6.0, 3.0, z + 0.2]);
        }
        let mut panel = |name: &str, thick_m: f32, [y0, y1]: [f32; 2], [z0, z1]: [f32; 2]| {
            if thick_m > 0.0 {
                return builder.block(name, [-0.5 * thick_m, y0, z0], [0.5 * thick_m, y1, z1]);
            }
            let corners = [[0.0, y0, z0], [0.0, y1, z0], [0.0, y1, z1], [0.0, y0, z1]];
            let panel = builder.mesh(name, corners.to_vec(), vec![0, 1, 2, 0, 2, 3]);
            builder.paint(panel, false, true);
            panel
        };
        panel("wall", wall_m, [0.0, 3.0], [-3.0, -0.5]);
        panel("wall", wall_m, [0.0, 3.0], [0.5, 3.0]);
        panel("lintel", wall_m, [2.2, 3.0], [-0.5, 0.5]);
        let door = panel("door", door_m, [0.0, 2.2], [-0.5, 0.5]);
        let things = [-4.0, 4.0].map(|x: f32| builder.block("thing", [x, 0.0, 1.0], [x + 0.4, 1.0, 1.4]));
        builder.scene.objects[door as usize].role = Role::Door;
        (builder, things, door)
    }

    #[test]
    fn a_closed_door_hides_the_next_room_however_thin_it_and_its_wall_are() {
        for (wall_m, door_m) in [(0.0, 0.0), (0.0, 0.04), (0.2, 0.0), (0.2, 0.04)] {
            let (builder, things, door) = rooms(wall_m, door_m);
            let world = World::new(&builder.scene).unwrap();
            let eyes = [[-3.0, 1.6, 0.0], [3.0, 1.6, 0.0]];
            let graph = cells::build(&world, &eyes, &CellSettings::default(), &Silent).unwrap();
            let hiders = Hiders::of(&world, Vec::new());
            let settings = VisibilitySettings {
                method: Method::Conservative,
                ..VisibilitySettings::default()
            };
            let visibility = compute(&Views::of(&world, &graph, &hiders), &settings, &Forgetful, &Silent).unwrap();
            for (room, eye) in eyes.into_iter().enumerate() {
                let cell = graph.cell_at(eye).unwrap() as usize;
                let entries = &visibility.cells[cell].objects;
                let doors_of = |object: u32| &entries.iter().find(|seen| seen.object == object).unwrap().doors[..];
                assert_eq!(
                    doors_of(things[1 - room]),
                    [door],
                    "wall {wall_m} m, door {door_m} m, room {room}"
                );
                assert!(doors_of(things[room]).is_empty(), "what is in the room");
            }
        }
    }
}
