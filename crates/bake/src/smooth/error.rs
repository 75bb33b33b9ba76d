//! How far is what a stream's beginning gives from the whole mesh? The root mean square of sampled distances, both ways.
//!
//! As METRO does (Cignoni et al. 1998): points spread evenly over each surface, and their distances from the other. The
//! larger of the two means counts. Samples are the same in every run.

use glam::DVec3;

pub use super::surface::Surface;
use crate::lod::proximity::Corners;

/// Measures distances from one surface.
pub struct Ruler<'a> {
    source: &'a Surface,
    points: Vec<DVec3>,
    samples: usize,
}

impl<'a> Ruler<'a> {
    /// From a surface with triangles, with so many points on each of the two.
    #[must_use]
    pub fn new(source: &'a Surface, samples: usize) -> Self {
        Self {
            points: spread(&source.shapes, samples),
            samples,
            source,
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
        if drawn.is_empty() {
            return None;
        }
        let there = mean_square_within(&self.points, drawn, most)?;
        let back = mean_square_within(&spread(&drawn.shapes, self.samples), self.source, most)?;
        let error = there.max(back).sqrt();
        (error <= most).then_some(error)
    }
}

/// Points at even steps of area; where in its triangle each lies follows a sequence that fills it evenly (Roberts 2018).
fn spread(shapes: &[Corners], samples: usize) -> Vec<DVec3> {
    let area = |[a, b, c]: &Corners| (*b - *a).cross(*c - *a).length();
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

/// The mean of the squared distances of points from a surface; `None` when its root is surely above `most`.
fn mean_square_within(points: &[DVec3], surface: &Surface, most: f64) -> Option<f64> {
    // What is rounded must not decide.
    let most_sum = most * most * points.len() as f64 * (1.0 + 1e-9);
    let mut sum = 0.0;
    // Points follow each other over the surface: what was nearest to one is near to the next.
    let mut near = None;
    for &point in points {
        let nearest = surface.nearest(point, near);
        near = Some(nearest.shape);
        sum += nearest.squared;
        if sum > most_sum {
            return None;
        }
    }
    Some(sum / points.len() as f64)
}
