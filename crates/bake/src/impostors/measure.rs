//! How far off is an impostor? Outlines are compared, since they are what strikes the eye against the sky: the area that
//! is covered in one picture and not in the other, over the length of the outline, is the mean distance between them.

use std::f64::consts::{PI, TAU};

use rayon::prelude::*;

use super::atlas::Atlas;
use super::raster::{Body, Pixel};
use super::show;

/// Directions that are looked from.
const DIRECTIONS: u32 = 16;

/// The mean distance between the outlines that the body has and those that its impostor shows, in pixels of a view.
#[must_use]
pub fn outline_px(body: &Body<'_>, atlas: &Atlas) -> f64 {
    let compared: Vec<[f64; 2]> = directions(DIRECTIONS, atlas.wish.below)
        .into_par_iter()
        .map(|direction| {
            let truth = body.picture(direction, atlas.wish.size_px);
            let shown = show::picture(atlas, direction);
            [difference(&truth, &shown), outline(&truth, atlas.wish.size_px as usize)]
        })
        .collect();
    let sum = |i: usize| compared.iter().map(|pair| pair[i]).sum::<f64>();
    if sum(1) > 0.0 { sum(0) / sum(1) } else { 0.0 }
}

/// Directions that lie evenly on a ball, or on the upper half of one: a spiral whose turns are a golden section.
#[must_use]
pub fn directions(count: u32, below: bool) -> Vec<[f64; 3]> {
    let golden_turn = PI * (3.0 - 5.0f64.sqrt());
    let direction = |i: u32| {
        let share = (f64::from(i) + 0.5) / f64::from(count);
        let up = if below { 1.0 - 2.0 * share } else { 1.0 - share };
        let level = (1.0 - up * up).sqrt();
        let angle = (golden_turn * f64::from(i)) % TAU;
        [level * angle.cos(), up, level * angle.sin()]
    };
    (0..count).map(direction).collect()
}

/// Area that is covered in one picture and not in the other, in pixels.
#[must_use]
pub fn difference(a: &[Pixel], b: &[Pixel]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| f64::from((a.coverage - b.coverage).abs()))
        .sum()
}

/// The length of the outline, in pixels: the sum of how steeply coverage rises.
fn outline(picture: &[Pixel], size: usize) -> f64 {
    let coverage = |x: usize, y: usize| f64::from(picture[y * size + x].coverage);
    let mut length = 0.0;
    for y in 0..size - 1 {
        for x in 0..size - 1 {
            let here = coverage(x, y);
            length += (coverage(x + 1, y) - here).hypot(coverage(x, y + 1) - here);
        }
    }
    length
}
