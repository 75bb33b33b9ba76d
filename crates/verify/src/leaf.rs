//! How does a closed door stand, and does a sight line pass it through nothing but the gap around its leaf?
//!
//! The format counts gaps of up to 3 % of a leaf's longest edge as closed where something else stands beside the leaf in its
//! plane (`docs/VISIBILITY.md`, What hides). What one sees through such a gap is no fault of a set. So each plane across the door's
//! thinnest side is asked: where the sight line crosses it, how far is the leaf away, and how far what stands beside it? A door that lies
//! before its opening has nothing in its planes, and keeps its gap.
//!
//! Cost: the faces around one door, for each plane and each sight line that is asked about.

use belvedere_scene::ObjectId;
use glam::{DVec2, DVec3};

use crate::{
    block::Block,
    flat::{Plane, hull},
    scene::{ERRORS, Scene},
    sight::slack_m,
};

/// Gaps of up to this share of a leaf's longest edge are closed.
const GAP: f64 = 0.03;
/// So many planes through the thickness of a door, beside those in which faces of it lie that enclose nothing.
const PLANES: u32 = 32;
/// … and so many of those where something beside it begins or ends.
const MOST_ENDS: usize = 64;
/// So many directions of faces are tried, those of the largest first; …
const DIRECTIONS: usize = 16;
/// … those whose cosine is larger are the same, …
const SAME: f64 = 1.0 - 1e-6;
/// … and a door is only thinner across another one if by this much.
const THINNER: f64 = 0.95;

/// A door in a frame of its own: x and y along its edges, z through it.
#[derive(Debug)]
pub struct Leaf {
    axes: [DVec3; 3],
    /// Its own faces.
    faces: Vec<[DVec3; 3]>,
    min: DVec3,
    max: DVec3,
    /// How far apart may be what counts as in one place.
    slack_m: f64,
}

/// What stands around a closed door.
#[derive(Debug)]
pub struct Gap<'a> {
    leaf: &'a Leaf,
    /// Faces of other things, none of them a door, in the door's frame.
    beside: Vec<[DVec3; 3]>,
    /// Depths of planes to look at.
    depths: Vec<f64>,
}

impl Leaf {
    /// How a door stands; `None` when it has no faces.
    #[must_use]
    pub fn of(scene: &Scene, door: ObjectId) -> Option<Self> {
        let triangles = scene.triangles_of(door.0 as usize);
        let normal = thinnest(&triangles)?;
        let [x, y] = edges(&triangles, normal);
        let axes = [x, y, normal];
        let faces: Vec<_> = triangles.iter().map(|face| face.map(|p| within(&axes, p))).collect();
        let corners = faces.iter().flatten();
        let (min, max) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), p| {
            (min.min(*p), max.max(*p))
        });
        let mut leaf = Self {
            axes,
            faces,
            min,
            max,
            slack_m: slack_m(&scene.with_closed(&[]), 0.0, 0.0),
        };
        leaf.slack_m += ERRORS * scene.error_near_m(&leaf.around());
        Some(leaf)
    }

    /// A point in the plane of the door's edges at a depth, in world space: `across` and `up` run from 0 to 1.
    pub(crate) fn at(&self, across: f64, up: f64, depth: f64) -> DVec3 {
        let local = self.min + DVec3::new(across, up, depth) * (self.max - self.min);
        self.axes[0] * local.x + self.axes[1] * local.y + self.axes[2] * local.z
    }

    /// Whether a point lies in something that the door encloses: its winding number (van Oosterom and Strackee, *The Solid Angle of
    /// a Plane Triangle*, 1983).
    #[must_use]
    pub fn encloses(&self, point: DVec3) -> bool {
        let p = within(&self.axes, point);
        let angles = self.faces.iter().map(|face| {
            let [a, b, c] = face.map(|corner| corner - p);
            let [la, lb, lc] = [a, b, c].map(DVec3::length);
            let volume = a.dot(b.cross(c));
            2.0 * volume.atan2(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb)
        });
        angles.sum::<f64>().abs() > std::f64::consts::TAU
    }

    /// What stands around it.
    #[must_use]
    pub fn gap(&self, scene: &Scene) -> Gap<'_> {
        let Block { min, max } = self.with_gap();
        let Block { min: low, max: high } = self.around();
        let mut beside = Vec::new();
        for (number, object) in scene.objects.iter().enumerate().filter(|(_, object)| !object.door) {
            let bounds = scene.bounds_of(number);
            if bounds.is_empty()
                || DVec3::from(bounds.max).cmplt(low).any()
                || DVec3::from(bounds.min).cmpgt(high).any()
            {
                continue;
            }
            let model = scene.model_of(number);
            for patch in model.patches.iter().filter(|patch| !patch.surface.see_through) {
                let place = |i: u32| object.world_from_object.transform_point3(model.position(i));
                let faces = patch.triangles.iter();
                let faces = faces.map(|face| face.map(|i| within(&self.axes, place(i))));
                beside.extend(faces.filter(|face| {
                    (0..3).all(|axis| {
                        face.iter().any(|p| p[axis] >= min[axis]) && face.iter().any(|p| p[axis] <= max[axis])
                    })
                }));
            }
        }
        Gap {
            leaf: self,
            depths: self.planes(&beside),
            beside,
        }
    }

    /// It and the gap around it, in its own frame …
    fn with_gap(&self) -> Block {
        let room = self.gap_m() + self.slack_m;
        Block {
            min: self.min - room,
            max: self.max + room,
        }
    }

    /// … and the box around both in world space.
    fn around(&self) -> Block {
        let placed = |local: DVec3| self.axes[0] * local.x + self.axes[1] * local.y + self.axes[2] * local.z;
        Block::around(self.with_gap().corners().into_iter().map(placed))
    }

    /// How wide a gap around it may be.
    fn gap_m(&self) -> f64 {
        let size = self.max - self.min;
        GAP * size.x.max(size.y)
    }

    /// Planes through it, those where something beside it begins or ends among them: not those in which it only begins or ends itself, where
    /// what it lies upon lies as well, but those of faces of it that enclose nothing.
    fn planes(&self, beside: &[[DVec3; 3]]) -> Vec<f64> {
        let [low, high] = [self.min.z + 2.0 * self.slack_m, self.max.z - 2.0 * self.slack_m];
        let share = |plane: u32| low + (high - low) * (f64::from(plane) + 0.5) / f64::from(PLANES);
        let mut depths: Vec<_> = (0..PLANES).map(share).collect();
        if low >= high {
            depths = vec![low.midpoint(high)];
        }
        let mut ends: Vec<_> = beside
            .iter()
            .flatten()
            .map(|p| p.z)
            .filter(|z| low < *z && *z < high)
            .collect();
        ends.sort_by(f64::total_cmp);
        ends.dedup_by(|b, a| *b - *a <= self.slack_m);
        depths.extend(ends.into_iter().take(MOST_ENDS));
        let mut edges: Vec<[[u64; 3]; 2]> = Vec::new();
        let bits = |p: DVec3| p.to_array().map(f64::to_bits);
        let sides = |face: &[DVec3; 3]| [[0, 1], [1, 2], [2, 0]].map(|side| side.map(|i| bits(face[i])));
        edges.extend(self.faces.iter().flat_map(sides));
        edges.sort_unstable();
        let is_bare = |[from, to]: [[u64; 3]; 2]| edges.binary_search(&[to, from]).is_err();
        for face in &self.faces {
            let [a, b, c] = face.map(|p| p.z);
            let is_level = a.max(b).max(c) - a.min(b).min(c) <= self.slack_m;
            let known = depths.iter().any(|depth| (depth - a).abs() <= self.slack_m);
            if is_level && !known && sides(face).into_iter().any(is_bare) {
                depths.push(a);
            }
        }
        depths
    }
}

impl Gap<'_> {
    /// Whether a sight line passes between the leaf and what stands beside it in one of its planes, where both are so near that the
    /// gap counts as closed.
    #[must_use]
    pub fn is_passed(&self, eye: DVec3, point: DVec3) -> bool {
        let [from, to] = [eye, point].map(|p| within(&self.leaf.axes, p));
        let most_m = self.leaf.gap_m() + 2.0 * self.leaf.slack_m;
        self.depths.iter().any(|depth| {
            let share = (depth - from.z) / (to.z - from.z);
            if !(0.0..=1.0).contains(&share) {
                return false;
            }
            let place = from.lerp(to, share).truncate();
            let near = |faces: &[[DVec3; 3]]| {
                let slack_m = self.leaf.slack_m;
                let away_m = faces
                    .iter()
                    .filter_map(|face| section_away_m(face, *depth, slack_m, place));
                away_m.fold(f64::INFINITY, f64::min)
            };
            near(&self.leaf.faces) + near(&self.beside) <= most_m
        })
    }
}

/// How far a place is from what of a face lies at a depth, the longer of the ways along both axes; `None` when nothing does.
fn section_away_m(face: &[DVec3; 3], depth: f64, slack_m: f64, place: DVec2) -> Option<f64> {
    let heights = face.map(|p| p.z - depth);
    let is_met = heights.iter().any(|h| *h <= slack_m) && heights.iter().any(|h| *h >= -slack_m);
    let lies = heights.iter().all(|h| h.abs() <= slack_m);
    let corner = |i: usize| face[i].truncate() - place;
    if lies {
        let sides = [[0, 1], [1, 2], [2, 0]].map(|side| side.map(corner));
        let turns = sides.map(|[a, b]| a.perp_dot(b));
        if turns.iter().all(|turn| *turn >= 0.0) || turns.iter().all(|turn| *turn <= 0.0) {
            return Some(0.0);
        }
        return sides.map(|[a, b]| away_m(a, b)).into_iter().reduce(f64::min);
    }
    // Both ends of the cut, or of the side that only touches the plane.
    let cuts = [[0, 1], [1, 2], [2, 0]].into_iter().filter_map(|[i, j]| {
        let share = heights[i] / (heights[i] - heights[j]);
        (0.0..=1.0).contains(&share).then(|| corner(i).lerp(corner(j), share))
    });
    let near = (0..3).filter(|i| heights[*i].abs() <= slack_m).map(corner);
    let ends: Vec<_> = cuts.chain(near).collect();
    let pairs = ends.iter().flat_map(|a| ends.iter().map(move |b| away_m(*a, *b)));
    pairs.filter(|_| is_met).reduce(f64::min)
}

/// How far a segment is from zero, the longer of the ways along both axes.
fn away_m(a: DVec2, b: DVec2) -> f64 {
    let way = b - a;
    // Along a segment that is a convex function, whose pieces end where a coordinate is zero or both are as long.
    let turns = [
        0.0,
        1.0,
        -a.x / way.x,
        -a.y / way.y,
        -(a.x - a.y) / (way.x - way.y),
        -(a.x + a.y) / (way.x + way.y),
    ];
    let shares = turns.into_iter().filter(|share| (0.0..=1.0).contains(share));
    shares
        .map(|share| a.lerp(b, share).abs().max_element())
        .fold(f64::INFINITY, f64::min)
}

fn within(axes: &[DVec3; 3], p: DVec3) -> DVec3 {
    DVec3::from_array(axes.map(|axis| axis.dot(p)))
}

/// The direction of a face across which these reach least far.
fn thinnest(triangles: &[[DVec3; 3]]) -> Option<DVec3> {
    let mut areas: Vec<_> = triangles.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a)).collect();
    areas.sort_by(|a, b| b.length_squared().total_cmp(&a.length_squared()));
    let mut directions: Vec<DVec3> = Vec::new();
    for direction in areas.into_iter().filter_map(DVec3::try_normalize) {
        if directions.len() < DIRECTIONS && directions.iter().all(|known| known.dot(direction).abs() <= SAME) {
            directions.push(direction);
        }
    }
    let thickness = |direction: DVec3| {
        let heights = triangles.iter().flatten().map(|p| direction.dot(*p));
        let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), h| {
            (low.min(h), high.max(h))
        });
        high - low
    };
    directions.into_iter().reduce(|best, next| {
        if thickness(next) < THINNER * thickness(best) {
            next
        } else {
            best
        }
    })
}

/// The sides of the smallest rectangle around these across a direction: one of them lies along a side of the convex hull (Freeman
/// and Shapira, *Determining the Minimum-Area Encasing Rectangle for an Arbitrary Closed Curve*, 1975).
fn edges(triangles: &[[DVec3; 3]], normal: DVec3) -> [DVec3; 2] {
    let plane = Plane::new((normal, 0.0));
    let outline = hull(triangles.iter().flatten().map(|p| plane.flat(*p)).collect());
    let length = |direction: DVec2| {
        let along = outline.iter().map(|p| direction.dot(*p));
        let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| {
            (low.min(at), high.max(at))
        });
        high - low
    };
    let sides = outline.iter().zip(outline.iter().cycle().skip(1));
    let directions = sides.filter_map(|(a, b)| (*b - *a).try_normalize());
    let size = |direction: &DVec2| length(*direction) * length(direction.perp());
    let best = directions
        .min_by(|a, b| size(a).total_cmp(&size(b)))
        .unwrap_or(DVec2::X);
    [best, best.perp()].map(|direction| plane.raised(direction))
}
