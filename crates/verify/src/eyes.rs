//! Where does one look from?
//!
//! Half of the eyes stand where sets are wrong most easily: in doorways, in corners, on edges and faces, that is a hair
//! inside, next to walls. The others stand anywhere. A cell is a convex polyhedron, given by its faces; nothing here
//! takes it for a box.

use std::fmt;

use belvedere_scene::record::{CellRecord, Hull};
use glam::DVec3;
use serde::Serialize;

use crate::{random::Random, scene::ERRORS};

/// Eyes on the surface are drawn towards the middle by this share of the way at least, so that none stands in a wall
/// because of rounding.
const INSET: f64 = 1e-4;

/// What kind of place an eye stands in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Place {
    /// Anywhere in the cell.
    Inside,
    /// In an opening to another cell.
    Doorway,
    /// In a corner of the cell.
    Corner,
    /// On a face.
    Face,
    /// On an edge between two faces.
    Edge,
    /// On the border of an opening.
    Jamb,
    /// As near as the cell comes to the border of a closed door: its hinge, its lock, the gap above or below it.
    Leaf,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Inside => "inside",
            Self::Doorway => "doorway",
            Self::Corner => "corner",
            Self::Face => "face",
            Self::Edge => "edge",
            Self::Jamb => "jamb",
            Self::Leaf => "leaf",
        })
    }
}

/// The order in which places are tried; with few eyes the first ones count.
const PLACES: [Place; 8] = [
    Place::Doorway,
    Place::Inside,
    Place::Corner,
    Place::Face,
    Place::Jamb,
    Place::Inside,
    Place::Edge,
    Place::Inside,
];

/// An eye.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Eye {
    /// In world space, metres.
    pub position: DVec3,
    /// Why it stands there.
    pub place: Place,
}

/// How far what is drawn at a place may be from where it stood when cells were made. Eyes are drawn towards the middle until they are
/// [`ERRORS`] times as far from every face of their cell, so that a wall that is published elsewhere than it stood is still before them.
pub(crate) type ErrorAt<'a> = dyn Fn(DVec3) -> f64 + 'a;

/// A cell to draw eyes in.
#[derive(Debug)]
pub struct Room {
    middle: DVec3,
    /// How far the nearest face is from the middle.
    depth_m: f64,
    faces: Vec<Vec<DVec3>>,
    portals: Vec<Vec<DVec3>>,
    /// Triangles of the faces with the sum of the volumes of the tetrahedra to the middle, up to and including each.
    tetrahedra: Vec<([DVec3; 3], f64)>,
}

impl Room {
    /// The room of a cell.
    #[must_use]
    pub fn of(record: &CellRecord) -> Self {
        let portals = record
            .portals
            .iter()
            .map(|p| p.polygon.iter().copied().map(DVec3::from).collect());
        Self::new(&record.hull, portals.collect())
    }

    fn new(hull: &Hull, mut portals: Vec<Vec<DVec3>>) -> Self {
        let corner = |i: &u32| DVec3::from(hull.points[*i as usize]);
        let mut faces: Vec<Vec<DVec3>> = hull.faces.iter().map(|f| f.iter().map(corner).collect()).collect();
        faces.retain(|face| !face.is_empty());
        portals.retain(|portal| !portal.is_empty());
        let sum: DVec3 = hull.points.iter().copied().map(DVec3::from).sum();
        let middle = sum / hull.points.len().max(1) as f64;
        let mut tetrahedra = Vec::new();
        let (mut volume, mut depth_m) = (0.0, f64::INFINITY);
        for face in &faces {
            for i in 2..face.len() {
                let [a, b, c] = [face[0], face[i - 1], face[i]];
                let normal = (b - a).cross(c - a).normalize_or_zero();
                if normal != DVec3::ZERO {
                    depth_m = f64::min(depth_m, normal.dot(middle - a).abs());
                }
                volume += (a - middle).dot((b - middle).cross(c - middle)).abs();
                tetrahedra.push(([a, b, c], volume));
            }
        }
        Self {
            middle,
            depth_m,
            faces,
            portals,
            tetrahedra,
        }
    }

    /// A point inside.
    #[must_use]
    pub fn middle(&self) -> DVec3 {
        self.middle
    }

    /// Its corners, some of them more than once.
    pub(crate) fn corners(&self) -> impl Iterator<Item = DVec3> {
        self.faces.iter().flatten().copied()
    }

    /// From where to where a line through a point is inside, in lengths of its way.
    pub(crate) fn along(&self, point: DVec3, way: DVec3) -> Option<[f64; 2]> {
        let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
        for face in self.faces.iter().filter(|face| face.len() >= 3) {
            let outward = (face[1] - face[0]).cross(face[2] - face[0]);
            let (beyond, rises) = (outward.dot(point - face[0]), outward.dot(way));
            let share = -beyond / rises;
            if rises > 0.0 {
                leave = leave.min(share);
            } else if rises < 0.0 {
                enter = enter.max(share);
            } else if beyond > 0.0 {
                return None;
            }
        }
        (enter < leave && enter.is_finite() && leave.is_finite()).then_some([enter, leave])
    }

    /// Eye `number` of a cell: always the same for the same seed.
    #[must_use]
    pub(crate) fn eye(&self, seed: u64, cell: u32, number: u64, error_m: &ErrorAt) -> Eye {
        let random = &mut Random::of([seed, u64::from(cell), number]);
        let wanted = PLACES[(number % PLACES.len() as u64) as usize];
        let place = match wanted {
            Place::Doorway | Place::Jamb if self.portals.is_empty() => Place::Face,
            other => other,
        };
        let on_surface = match place {
            Place::Inside | Place::Leaf => {
                return Eye {
                    position: self.inside(random, error_m),
                    place,
                };
            }
            Place::Corner => pick(&self.faces, random).map(|face| face[random.below(face.len())]),
            Place::Face => pick(&self.faces, random).map(|face| in_polygon(face, random)),
            Place::Edge => pick(&self.faces, random).map(|face| on_border(face, random)),
            Place::Doorway => pick(&self.portals, random).map(|portal| in_polygon(portal, random)),
            Place::Jamb => pick(&self.portals, random).map(|portal| on_border(portal, random)),
        };
        Eye {
            position: self.inset(on_surface.unwrap_or(self.middle), error_m),
            place,
        }
    }

    /// Where the way from somewhere to a place inside enters the cell, or a little further on every other time.
    pub(crate) fn entered_from(&self, point: DVec3, random: &mut Random, error_m: &ErrorAt) -> DVec3 {
        let way = self.inside(random, error_m) - point;
        let enter = self.along(point, way).map_or(1.0, |[enter, _]| enter.clamp(0.0, 1.0));
        let further = if random.unit() < 0.5 {
            0.0
        } else {
            random.unit().powi(4)
        };
        self.inset(point + (enter + further * (1.0 - enter)) * way, error_m)
    }

    fn inset(&self, point: DVec3, error_m: &ErrorAt) -> DVec3 {
        let mut known_m = 0.0;
        loop {
            let share = INSET.max(ERRORS * known_m / self.depth_m.max(f64::MIN_POSITIVE));
            let place = point.lerp(self.middle, share.min(1.0));
            let there_m = error_m(place);
            if there_m <= known_m {
                return place;
            }
            known_m = there_m;
        }
    }

    /// Uniform by volume.
    fn inside(&self, random: &mut Random, error_m: &ErrorAt) -> DVec3 {
        let Some((_, volume)) = self.tetrahedra.last() else {
            return self.middle;
        };
        let wanted = random.unit() * volume;
        let index = self.tetrahedra.partition_point(|(_, sum)| *sum < wanted);
        let (face, _) = self.tetrahedra[index.min(self.tetrahedra.len() - 1)];
        // The cube root makes the distance from the middle uniform by volume.
        let on_face = in_triangle(face, random);
        self.inset(self.middle.lerp(on_face, random.unit().cbrt()), error_m)
    }
}

fn pick<'a>(polygons: &'a [Vec<DVec3>], random: &mut Random) -> Option<&'a Vec<DVec3>> {
    (!polygons.is_empty()).then(|| &polygons[random.below(polygons.len())])
}

/// Uniform by area.
fn in_triangle([a, b, c]: [DVec3; 3], random: &mut Random) -> DVec3 {
    let (mut u, mut v) = (random.unit(), random.unit());
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    a + u * (b - a) + v * (c - a)
}

/// A point in a convex polygon.
pub(crate) fn in_polygon(polygon: &[DVec3], random: &mut Random) -> DVec3 {
    if polygon.len() < 3 {
        return on_border(polygon, random);
    }
    let i = 2 + random.below(polygon.len() - 2);
    in_triangle([polygon[0], polygon[i - 1], polygon[i]], random)
}

/// A point on the border of a polygon, in a corner every fourth time.
pub(crate) fn on_border(polygon: &[DVec3], random: &mut Random) -> DVec3 {
    let i = random.below(polygon.len());
    let share = if random.unit() < 0.25 { 0.0 } else { random.unit() };
    polygon[i].lerp(polygon[(i + 1) % polygon.len()], share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use belvedere_scene::Bounds;

    /// A box whose corners with the largest x, y and z are cut off to a wedge.
    fn wedge() -> Hull {
        Hull {
            points: vec![
                [0.0, 0.0, 0.0],
                [4.0, 0.0, 0.0],
                [0.0, 3.0, 0.0],
                [0.0, 0.0, 5.0],
                [4.0, 0.0, 5.0],
                [0.0, 3.0, 5.0],
            ],
            faces: vec![
                vec![0, 2, 1],
                vec![3, 4, 5],
                vec![0, 1, 4, 3],
                vec![0, 3, 5, 2],
                vec![1, 2, 5, 4],
            ],
        }
    }

    fn inside(hull: &Hull, point: DVec3) -> bool {
        hull.faces.iter().all(|face| {
            let [a, b, c] = [0, 1, 2].map(|i| DVec3::from(hull.points[face[i] as usize]));
            (b - a).cross(c - a).dot(point - a) < 0.0
        })
    }

    #[test]
    fn every_eye_stands_strictly_inside_any_convex_hull() {
        for hull in [
            wedge(),
            Hull::of_box(&Bounds {
                min: [-1.0; 3],
                max: [2.0, 0.5, 1.0],
            }),
        ] {
            let portal = hull.faces[0]
                .iter()
                .map(|i| DVec3::from(hull.points[*i as usize]))
                .collect();
            let room = Room::new(&hull, vec![portal]);
            for number in 0..800 {
                let eye = room.eye(7, 3, number, &|_| 0.0);
                assert!(inside(&hull, eye.position), "{eye:?}");
            }
        }
    }

    #[test]
    fn eyes_stand_clear_of_what_is_coarse_and_others_where_they_stood() {
        let room = Room::new(&wedge(), vec![]);
        let is_coarse = |place: DVec3| place.x < 1.0;
        let (mut moved, mut kept) = (0, 0);
        for number in 0..800 {
            let error_m = |place: DVec3| if is_coarse(place) { 0.1 } else { 0.0 };
            let eye = room.eye(7, 3, number, &error_m).position;
            let exact = room.eye(7, 3, number, &|_| 0.0).position;
            if is_coarse(eye) {
                moved += 1;
                let clear_m = [eye.x, eye.y, eye.z, 5.0 - eye.z]
                    .into_iter()
                    .fold(f64::INFINITY, f64::min);
                assert!(clear_m >= 0.2 - 1e-9, "{eye}");
            } else if !is_coarse(exact) {
                kept += 1;
                assert_eq!(eye, exact);
            }
        }
        assert!(moved > 100 && kept > 100, "{moved} moved, {kept} kept");
    }

    #[test]
    fn a_line_is_inside_between_two_faces() {
        let room = Room::new(&wedge(), vec![]);
        let at = DVec3::new(1.0, 1.0, 2.0);
        assert_eq!(room.along(at, DVec3::new(0.0, 0.0, 2.0)), Some([-1.0, 1.5]));
        let [enter, leave] = room.along(at, DVec3::X).unwrap();
        assert!(
            (enter + 1.0).abs() < 1e-12 && (leave - 5.0 / 3.0).abs() < 1e-12,
            "{leave}"
        );
        assert_eq!(room.along(DVec3::new(5.0, 1.0, 2.0), DVec3::Z), None, "beside it");
    }

    #[test]
    fn eyes_inside_fill_the_hull_evenly() {
        let hull = wedge();
        let room = Room::new(&hull, vec![]);
        let random = &mut Random::of([1, 2, 3]);
        let points: Vec<_> = (0..20_000).map(|_| room.inside(random, &|_| 0.0)).collect();
        let mean = points.iter().sum::<DVec3>() / points.len() as f64;
        // The centroid of the right triangle, and half the length.
        let expected = DVec3::new(4.0 / 3.0, 1.0, 2.5);
        assert!((mean - expected).length() < 0.05, "{mean}");
        // An eighth of them lies in the same hull at half the size.
        let half = Hull {
            points: hull
                .points
                .iter()
                .map(|p| room.middle().midpoint(DVec3::from(*p)).to_array())
                .collect(),
            ..hull
        };
        let within = points.iter().filter(|p| inside(&half, **p)).count() as f64 / points.len() as f64;
        assert!((within - 0.125).abs() < 0.01, "{within}");
    }

    #[test]
    fn the_same_seed_gives_the_same_eyes_and_another_seed_others() {
        let room = Room::new(&wedge(), vec![]);
        let eyes = |seed, cell| (0..16).map(|n| room.eye(seed, cell, n, &|_| 0.0)).collect::<Vec<_>>();
        assert_eq!(eyes(1, 0), eyes(1, 0));
        assert_ne!(eyes(1, 0), eyes(2, 0));
        assert_ne!(eyes(1, 0), eyes(1, 1));
    }
}
