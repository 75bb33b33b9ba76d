//! How far is what a stream's beginning gives from the whole mesh? The root mean square of sampled distances, both ways.
//!
//! As METRO does (Cignoni et al. 1998): points spread evenly over each surface, and their distances from the other. The
//! larger of the two means counts. Samples are the same in every run.

use glam::DVec3;

use super::quantise::QuantisedMesh;
use crate::lod::proximity::ShapeTree;

/// Measures distances from one mesh, in steps of its lattice.
pub struct Ruler {
    source: ShapeTree,
    points: Vec<DVec3>,
    samples: usize,
}

impl Ruler {
    /// Of a mesh with triangles, with so many points on each surface.
    #[must_use]
    pub fn new(mesh: &QuantisedMesh, samples: usize) -> Self {
        let shapes = shapes(&mesh.twice_positions(), &mesh.triangles);
        Self {
            points: spread(&shapes, samples),
            samples,
            source: ShapeTree::new(shapes),
        }
    }

    /// The diagonal of its box.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        self.source.diagonal()
    }

    /// The error of a mesh given by twice its positions; infinite when it has no triangles.
    #[must_use]
    pub fn rms(&self, twice_positions: &[[i32; 3]], triangles: &[[u32; 3]]) -> f64 {
        if triangles.is_empty() {
            return f64::INFINITY;
        }
        let shapes = shapes(twice_positions, triangles);
        let points = spread(&shapes, self.samples);
        let tree = ShapeTree::new(shapes);
        mean_square(&self.points, &tree)
            .max(mean_square(&points, &self.source))
            .sqrt()
    }
}

fn shapes(twice: &[[i32; 3]], triangles: &[[u32; 3]]) -> Vec<[DVec3; 3]> {
    let corner = |v: u32| DVec3::from_array(twice[v as usize].map(|x| 0.5 * f64::from(x)));
    triangles.iter().map(|t| t.map(corner)).collect()
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

pub(crate) fn mean_square(points: &[DVec3], tree: &ShapeTree) -> f64 {
    let squares = points
        .iter()
        .map(|&p| tree.nearest_to_all(&[p], None, 0.0).distance.powi(2));
    squares.sum::<f64>() / points.len() as f64
}
