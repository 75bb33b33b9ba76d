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

/// No shape.
const NONE: u32 = u32::MAX;

impl<'a> Ruler<'a> {
    /// From a surface with triangles, with so many points on each of the two.
    #[must_use]
    pub fn new(source: &'a Surface, samples: usize) -> Self {
        Self {
            points: spread(&source.shapes, samples).0,
            samples,
            source,
        }
    }

    /// The error of another surface, in steps of the lattice; infinite when it has no triangles.
    #[must_use]
    pub fn rms(&self, drawn: &Surface) -> f64 {
        let mut watch = Watch::new(self);
        watch
            .rms_within(drawn, f64::INFINITY, |_| NONE)
            .unwrap_or(f64::INFINITY)
    }
}

/// Measures a surface again and again while it becomes finer.
pub(super) struct Watch<'a> {
    ruler: &'a Ruler<'a>,
    /// By point of the ruler, the drawn shape that was nearest at the last look; [`NONE`] before.
    nearest: Vec<u32>,
}

impl<'a> Watch<'a> {
    pub(super) fn new(ruler: &'a Ruler<'a>) -> Self {
        Self {
            nearest: vec![NONE; ruler.points.len()],
            ruler,
        }
    }

    /// The error of a surface, in steps of the lattice, if it is at most so much. That it is more is often seen after a few
    /// points. A shape that was drawn at the last look, too, has the same number; `source_shape` gives one of the source
    /// that is near to a drawn one.
    pub(super) fn rms_within(&mut self, drawn: &Surface, most: f64, source_shape: impl Fn(u32) -> u32) -> Option<f64> {
        if drawn.is_empty() {
            return None;
        }
        let Ruler {
            source,
            points,
            samples,
        } = self.ruler;
        let there = mean_square_within(points, &mut self.nearest, drawn, most)?;
        let (points, mut shapes) = spread(&drawn.shapes, *samples);
        shapes.iter_mut().for_each(|shape| *shape = source_shape(*shape));
        let back = mean_square_within(&points, &mut shapes, source, most)?;
        let error = there.max(back).sqrt();
        (error <= most).then_some(error)
    }
}

/// Points at even steps of area, and the shape on which each is; where in its triangle each lies follows a sequence that fills
/// it evenly (Roberts 2018).
fn spread(shapes: &[Corners], samples: usize) -> (Vec<DVec3>, Vec<u32>) {
    let area = |[a, b, c]: &Corners| (*b - *a).cross(*c - *a).length();
    let areas: Vec<f64> = shapes.iter().map(area).collect();
    let step = areas.iter().sum::<f64>() / samples as f64;
    let mut points = Vec::with_capacity(samples);
    let mut numbers = Vec::with_capacity(samples);
    let mut until_next = step / 2.0;
    for (number, (shape, area)) in (0..).zip(shapes.iter().zip(areas)) {
        until_next -= area;
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
            numbers.push(number);
        }
    }
    if points.is_empty() {
        // Without area: at least the corners.
        points.extend(shapes.iter().take(samples).map(|shape| shape[0]));
        numbers.extend(0..points.len() as u32);
    }
    (points, numbers)
}

/// The mean of the squared distances of points from a surface; `None` when its root is surely above `most`. `near` has for each
/// point a shape that may be near, or [`NONE`], and gets the nearest.
fn mean_square_within(points: &[DVec3], near: &mut [u32], surface: &Surface, most: f64) -> Option<f64> {
    // What is rounded must not decide.
    let most_sum = most * most * points.len() as f64 * (1.0 + 1e-9);
    let mut sum = 0.0;
    // Points follow each other over the surface: what was nearest to one is near to the next.
    let mut last = None;
    for (&point, near) in points.iter().zip(near) {
        let known = Some(*near).filter(|near| (*near as usize) < surface.shapes.len());
        let nearest = surface.nearest(point, known.or(last));
        *near = nearest.shape;
        last = Some(nearest.shape);
        sum += nearest.squared;
        if sum > most_sum {
            return None;
        }
    }
    Some(sum / points.len() as f64)
}
