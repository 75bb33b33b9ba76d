//! Which vertex stands for a cluster?
//!
//! D. Schmalstieg, *The Remote Rendering Pipeline* (1997), §6.2, "Selecting the cluster representative": a cluster is made
//! of the children of one octree cell, and one of their representatives becomes its own (of few vertices, any of them):
//! the one with the least weighted sum of three measures over the *involved* triangles, those with a corner in the cluster.
//!
//! * *Error area*: by how much the sum of their areas changes when these corners move to the candidate.
//! * *Error volume*: the sum of the tetrahedra from each of them to the candidate.
//! * *Weighted mean*: how far the candidate is from the mean of the vertices. The only one for lines and points.
//!
//! A fourth is the error volume's modern form, and the default: the *quadric* error of Garland & Heckbert, *Surface
//! simplification using quadric error metrics* (1997), squared distances to the triangles' planes weighted by area. It
//! adds up from cell to cell, so that it costs the same for every cluster. The others visit the involved triangles.
//!
//! All measures are taken in the octree's unit cube and divided by the cell's side to their power, so that weights mean
//! the same for any size.

use glam::DVec3;

use crate::lod::cube::RootCube;
use crate::lod::octree::to_f64;
use crate::smooth::quadric::Quadric;
use crate::source::{Primitive, Topology};

/// How much each measure counts; what is 0 is not computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measures {
    /// Weight of the error area.
    pub error_area: f64,
    /// Weight of the error volume.
    pub error_volume: f64,
    /// Weight of the distance from the weighted mean.
    pub weighted_mean: f64,
    /// Weight of the quadric error.
    pub quadric: f64,
}

impl Default for Measures {
    /// Quadric error, and a little of the weighted mean where that says nothing.
    fn default() -> Self {
        Self {
            error_area: 0.0,
            error_volume: 0.0,
            weighted_mean: 1e-3,
            quadric: 1.0,
        }
    }
}

impl Measures {
    /// The three of the thesis: error area and error volume alike, and a little of the weighted mean for lines.
    pub const THESIS: Self = Self {
        error_area: 1.0,
        error_volume: 1.0,
        weighted_mean: 1e-3,
        quadric: 0.0,
    };

    fn visits_triangles(&self) -> bool {
        self.error_area != 0.0 || self.error_volume != 0.0
    }
}

/// A vertex, or a cell that was closed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part {
    /// Its points: `first..end`.
    pub(super) first: u32,
    pub(super) end: u32,
    pub(super) representative: u32,
    /// How many vertices it stands for, doublets counted.
    pub(super) vertices: u32,
    /// Sum of their positions in the unit cube.
    sum: DVec3,
    quadric: Quadric,
    /// Quadric error of the representative; never less than that of a part in it.
    pub(super) error: f64,
}

/// What is known of points and the triangles around them.
pub(super) struct Involved<'a> {
    measures: Measures,
    primitives: &'a [Primitive],
    point_of_vertex: &'a [Vec<u32>],
    /// In the unit cube.
    places: Vec<DVec3>,
    quadrics: Vec<Quadric>,
    /// The corners at point i: `corners[first_corner[i]..first_corner[i + 1]]`, as primitive and triangle. Empty when no
    /// measure visits triangles.
    first_corner: Vec<u32>,
    corners: Vec<(u32, u32)>,
}

/// What is found out of a point from its triangles and lines.
#[derive(Debug, Clone, Copy, Default)]
struct Gathered {
    quadric: Quadric,
    /// Sum of the opposite edges, turned outwards in their triangles' planes.
    outwards: DVec3,
    /// Weight of the point's own place.
    reach: f64,
}

/// Of so many vertices each may represent them.
const FEW_POINTS: usize = 32;
/// How much the border of a surface counts beside the surface.
const BORDER_WEIGHT: f64 = 1.0;
/// How much a line counts, for the square of its length.
const LINE_WEIGHT: f64 = 1.0;
/// How much the distance to each vertex itself counts, for the square of the longest edge there: of what is flat the
/// smaller cell is closed first, and spikes stay.
const PLACE_WEIGHT: f64 = 1e-4;

impl<'a> Involved<'a> {
    pub(super) fn new(
        primitives: &'a [Primitive],
        point_of_vertex: &'a [Vec<u32>],
        points: &[[f32; 3]],
        root: &RootCube,
        measures: Measures,
    ) -> Self {
        let mut involved = Self {
            measures,
            primitives,
            point_of_vertex,
            places: points.iter().map(|p| root.unit(to_f64(*p))).collect(),
            quadrics: Vec::new(),
            first_corner: Vec::new(),
            corners: Vec::new(),
        };
        involved.add_quadrics();
        if measures.visits_triangles() {
            involved.gather_corners();
        }
        involved
    }

    /// Planes of triangles. Where a surface ends also upright ones: around an inner vertex, the opposite edges of its
    /// triangles, each turned outwards in its triangle's plane, add up to nothing; at a border they do not.
    fn add_quadrics(&mut self) {
        let mut gathered = vec![Gathered::default(); self.places.len()];
        let point_weight = (self.places.len() as f64).recip();
        for (primitive, points) in self.primitives.iter().zip(self.point_of_vertex) {
            let point = |v: u32| points[v as usize] as usize;
            match primitive.topology {
                Topology::Triangles => {
                    for triangle in primitive.indices.as_chunks::<3>().0 {
                        let at = triangle.map(point);
                        let [a, b, c] = at.map(|p| self.places[p]);
                        let cross = (b - a).cross(c - a);
                        let sides = [c - b, a - c, b - a];
                        let longest = sides.iter().map(|side| side.length_squared()).fold(0.0, f64::max);
                        at.iter().for_each(|&p| gathered[p].reach += PLACE_WEIGHT * longest);
                        let length = cross.length();
                        if length > 0.0 {
                            let normal = cross / length;
                            let quadric = Quadric::plane(normal, a, 0.5 * length);
                            for (p, opposite) in at.into_iter().zip(sides) {
                                gathered[p].quadric.add(&quadric);
                                gathered[p].outwards += opposite.cross(normal);
                            }
                        }
                    }
                }
                Topology::Lines => {
                    for line in primitive.indices.as_chunks::<2>().0 {
                        let at = line.map(point);
                        let along = self.places[at[1]] - self.places[at[0]];
                        let length = along.length();
                        at.iter().for_each(|&p| gathered[p].reach += point_weight);
                        if length > 0.0 {
                            let (side, up) = (along / length).any_orthonormal_pair();
                            for normal in [side, up] {
                                let quadric = Quadric::plane(normal, self.places[at[0]], LINE_WEIGHT * length * length);
                                at.iter().for_each(|&p| gathered[p].quadric.add(&quadric));
                            }
                        }
                    }
                }
                Topology::Points => primitive
                    .indices
                    .iter()
                    .for_each(|&v| gathered[point(v)].reach += point_weight),
            }
        }
        let places = self.places.iter().zip(gathered);
        let quadrics = places.map(|(place, gathered)| {
            let mut quadric = gathered.quadric;
            let length = gathered.outwards.length();
            if length > 0.0 {
                let normal = gathered.outwards / length;
                quadric.add(&Quadric::plane(normal, *place, BORDER_WEIGHT * length * length));
            }
            quadric.add(&Quadric::point(*place, gathered.reach));
            quadric
        });
        self.quadrics = quadrics.collect();
    }

    fn gather_corners(&mut self) {
        let mut corners: Vec<(u32, u32, u32)> = Vec::new();
        for (p, (primitive, points)) in self.primitives.iter().zip(self.point_of_vertex).enumerate() {
            if primitive.topology == Topology::Triangles {
                let point = |(i, v): (usize, &u32)| (points[*v as usize], p as u32, i as u32 / 3);
                corners.extend(primitive.indices.iter().enumerate().map(point));
            }
        }
        corners.sort_unstable();
        let starts = 0..=self.places.len() as u32;
        self.first_corner = starts
            .map(|point| corners.partition_point(|corner| corner.0 < point) as u32)
            .collect();
        self.corners = corners.into_iter().map(|(_, p, triangle)| (p, triangle)).collect();
    }

    /// A single point that stands for so many vertices.
    pub(super) fn leaf(&self, point: u32, vertices: u32) -> Part {
        Part {
            first: point,
            end: point + 1,
            representative: point,
            vertices,
            sum: self.places[point as usize] * f64::from(vertices),
            quadric: self.quadrics[point as usize],
            error: 0.0,
        }
    }

    /// Error area and error volume of a candidate for the points of a cluster.
    fn visit(&self, points: std::ops::Range<u32>, candidate: DVec3) -> (f64, f64) {
        let (mut change, mut volume) = (0.0, 0.0);
        for point in points.clone() {
            let own = self.first_corner[point as usize] as usize..self.first_corner[point as usize + 1] as usize;
            for &(p, triangle) in &self.corners[own] {
                let vertices = self.primitives[p as usize].indices.as_chunks::<3>().0[triangle as usize];
                let at = vertices.map(|v| self.point_of_vertex[p as usize][v as usize]);
                // Each triangle once: with its first point in the cluster.
                if at.iter().any(|other| points.contains(other) && *other < point) {
                    continue;
                }
                let before = at.map(|q| self.places[q as usize]);
                let after = at.map(|q| {
                    if points.contains(&q) {
                        candidate
                    } else {
                        self.places[q as usize]
                    }
                });
                change += area(after) - area(before);
                let [a, b, c] = before;
                volume += (b - a).cross(c - a).dot(candidate - a).abs() / 6.0;
            }
        }
        (change.abs(), volume)
    }
}

/// Makes one part of several, in a cell with that side.
pub(super) fn representative(parts: &[Part], side: f64, involved: &Involved<'_>) -> Part {
    let mut whole = parts[0];
    for part in &parts[1..] {
        whole.end = part.end;
        whole.vertices += part.vertices;
        whole.sum += part.sum;
        whole.quadric.add(&part.quadric);
        whole.error = whole.error.max(part.error);
    }
    let measures = &involved.measures;
    let mean = whole.sum / f64::from(whole.vertices);
    let points = whole.first..whole.end;
    let has_few = points.len() <= FEW_POINTS && !measures.visits_triangles();
    let representatives = parts.iter().map(|part| part.representative).filter(|_| !has_few);
    let every_point = points.clone().filter(|_| has_few);
    let mut least = f64::INFINITY;
    for candidate in representatives.chain(every_point) {
        let place = involved.places[candidate as usize];
        let mut cost = 0.0;
        if measures.visits_triangles() {
            let (area, volume) = involved.visit(points.clone(), place);
            cost += measures.error_area * area / side.powi(2) + measures.error_volume * volume / side.powi(3);
        }
        cost += measures.weighted_mean * place.distance_squared(mean) / side.powi(2);
        cost += measures.quadric * whole.quadric.at(place) / side.powi(4);
        if cost < least {
            least = cost;
            whole.representative = candidate;
        }
    }
    let place = involved.places[whole.representative as usize];
    whole.error = whole.error.max(whole.quadric.at(place));
    whole
}

/// Of a triangle.
pub(super) fn area([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}
