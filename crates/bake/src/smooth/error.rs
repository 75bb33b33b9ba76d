//! How far is what a stream's beginning gives from the whole mesh? The root mean square of sampled distances, both ways.
//!
//! As METRO does (Cignoni et al. 1998): points spread evenly over each surface, and their distances from the other. The
//! larger of the two means counts. Samples are the same in every run.

use glam::DVec3;

use super::quantise::QuantisedMesh;
use crate::lod::proximity::ShapeTree;

/// A mesh to be measured, in steps of the lattice.
pub struct Surface(ShapeTree);

impl Surface {
    /// Of a mesh that is given by twice its positions.
    #[must_use]
    pub fn new(twice_positions: &[[i32; 3]], triangles: &[[u32; 3]]) -> Self {
        let corner = |v: u32| DVec3::from_array(twice_positions[v as usize].map(|x| 0.5 * f64::from(x)));
        Self(ShapeTree::new(triangles.iter().map(|t| t.map(corner)).collect()))
    }

    /// Of the whole mesh.
    #[must_use]
    pub fn of(mesh: &QuantisedMesh) -> Self {
        Self::new(&mesh.twice_positions(), &mesh.triangles)
    }

    /// The diagonal of its box.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        self.0.diagonal()
    }
}

/// Measures distances from one surface.
pub struct Ruler<'a> {
    source: &'a ShapeTree,
    points: Vec<DVec3>,
    samples: usize,
}

impl<'a> Ruler<'a> {
    /// From a surface with triangles, with so many points on each of the two.
    #[must_use]
    pub fn new(source: &'a Surface, samples: usize) -> Self {
        Self {
            points: spread(&source.0.shapes, samples),
            samples,
            source: &source.0,
        }
    }

    /// The error of another surface, in steps of the lattice; infinite when it has no triangles.
    #[must_use]
    pub fn rms(&self, drawn: &Surface) -> f64 {
        self.rms_within(drawn, f64::INFINITY).unwrap_or(f64::INFINITY)
    }

    /// The same if it is at most so much. That it is more is often seen after a few points.
    #[must_use]
    pub fn rms_within(&self, drawn: &Surface, most: f64) -> Option<f64> {
        if drawn.0.shapes.is_empty() {
            return None;
        }
        let there = mean_square_within(&self.points, &drawn.0, most)?;
        let back = mean_square_within(&spread(&drawn.0.shapes, self.samples), self.source, most)?;
        let error = there.max(back).sqrt();
        (error <= most).then_some(error)
    }
}

/// Points at even steps of area; where in its triangle each lies follows a sequence that fills it evenly (Roberts 2018).
pub(crate) fn spread(shapes: &[[DVec3; 3]], samples: usize) -> Vec<DVec3> {
    let area = |[a, b, c]: &[DVec3; 3]| (*b - *a).cross(*c - *a).length();
    let total: f64 = shapes.iter().map(area).sum();
    let step = total / samples as f64;
    let mut points = Vec::with_capacity(samples + 1);
    let mut until_next = step / 2.0;
    for shape in shapes {
        until_next -= area(shape);
        while until_next < 0.0 && points.len() < samples {
            until_next += step;
            let i = points.len() as f64;
            let (mut u, mut v) = (
                (0.5 + 0.754_877_666_246_693 * i).fract(),
                (0.5 + 0.569_840_290_998_053 * i).fract(),
            );
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            points.push(shape[0] + u * (shape[1] - shape[0]) + v * (shape[2] - shape[0]));
        }
    }
    if points.is_empty() {
        // Without area: at least the corners.
        points.extend(shapes.iter().take(samples).map(|shape| shape[0]));
    }
    points
}

/// The mean of the squared distances of points from shapes.
pub(crate) fn mean_square(points: &[DVec3], tree: &ShapeTree) -> f64 {
    mean_square_within(points, tree, f64::INFINITY).unwrap_or(f64::INFINITY)
}

/// The same; `None` when its root is surely above `most`.
fn mean_square_within(points: &[DVec3], tree: &ShapeTree, most: f64) -> Option<f64> {
    // What is rounded must not decide.
    let most_sum = most * most * points.len() as f64 * (1.0 + 1e-9);
    let mut sum = 0.0;
    // Points follow each other over the surface: what was nearest to one is near to the next.
    let mut near = None;
    for &point in points {
        let nearest = tree.nearest_to_all(&[point], near, 0.0);
        near = Some(nearest.shape);
        sum += nearest.distance.powi(2);
        if sum > most_sum {
            return None;
        }
    }
    Some(sum / points.len() as f64)
}
