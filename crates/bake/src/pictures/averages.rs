//! What are many pixels together? Colours are averaged in linear light, and where alpha says how much of them is there,
//! weighted by it; all else as it stands.
//!
//! What is not there at all has no colour of its own. It takes over that of what lies around it ([`filled`]), so that
//! filters do not mix in one that nobody chose.

use image::{Rgba, Rgba32FImage};

use super::Content;

/// Makes of pixels what may be averaged: of cutouts, colours with alpha multiplied in.
pub(super) fn to_averages(pixels: &mut Rgba32FImage, content: Content) {
    if content == Content::Data {
        return;
    }
    for Rgba([r, g, b, alpha]) in pixels.pixels_mut() {
        let weight = if content == Content::Cutout { *alpha } else { 1.0 };
        for x in [r, g, b] {
            *x = linear(*x) * weight;
        }
    }
}

/// Averages in 8 bits; cutouts are [`filled`] before.
pub(super) fn from_averages([r, g, b, alpha]: [f32; 4], content: Content) -> [u8; 4] {
    let shown = match content {
        Content::Data => [r, g, b, alpha],
        Content::Color | Content::Cutout => [srgb(r), srgb(g), srgb(b), alpha],
    };
    shown.map(|x| (x * 255.0).round().clamp(0.0, 255.0) as u8)
}

/// Averages of a cutout with alpha no longer multiplied in. Pixels that are not there at all have the colour of the
/// smallest area around them, of those of which ever smaller sizes of the picture consist, in which there is something.
pub(super) fn filled(pixels: &Rgba32FImage) -> Rgba32FImage {
    let has_gaps = pixels.pixels().any(|pixel| pixel.0[3] <= 0.0);
    let (width, height) = pixels.dimensions();
    let coarser = (has_gaps && width.max(height) > 1).then(|| filled(&halved(pixels)));
    Rgba32FImage::from_fn(width, height, |x, y| {
        let [r, g, b, alpha] = pixels.get_pixel(x, y).0;
        if alpha > 0.0 {
            return Rgba([r / alpha, g / alpha, b / alpha, alpha]);
        }
        let around = coarser.as_ref().map_or([0.0; 4], |coarser| {
            let place = |at: u32, half: u32| (at / 2).min(half - 1);
            coarser
                .get_pixel(place(x, coarser.width()), place(y, coarser.height()))
                .0
        });
        Rgba([around[0], around[1], around[2], 0.0])
    })
}

/// IEC 61966-2-1.
pub(crate) fn linear(x: f32) -> f32 {
    if x <= 0.04045 {
        x / 12.92
    } else {
        ((x + 0.055) / 1.055).powf(2.4)
    }
}

pub(crate) fn srgb(x: f32) -> f32 {
    if x <= 0.003_130_8 {
        12.92 * x
    } else {
        1.055 * x.powf(1.0 / 2.4) - 0.055
    }
}

#[derive(Clone, Copy)]
enum Axis {
    X,
    Y,
}

/// Half as many pixels along both sides.
pub(super) fn halved(pixels: &Rgba32FImage) -> Rgba32FImage {
    halved_along(&halved_along(pixels, Axis::X), Axis::Y)
}

/// Half as many pixels along an axis, at least one, each the average over what it covers. An odd number is halved
/// without leaving one out: a pixel then covers a bit more than two.
fn halved_along(pixels: &Rgba32FImage, axis: Axis) -> Rgba32FImage {
    let (width, height) = pixels.dimensions();
    let length = match axis {
        Axis::X => width,
        Axis::Y => height,
    };
    let half = (length / 2).max(1);
    let covered = f64::from(length) / f64::from(half);
    let (new_width, new_height) = match axis {
        Axis::X => (half, height),
        Axis::Y => (width, half),
    };
    Rgba32FImage::from_fn(new_width, new_height, |x, y| {
        let at = match axis {
            Axis::X => x,
            Axis::Y => y,
        };
        let (start, end) = (f64::from(at) * covered, f64::from(at + 1) * covered);
        let mut sum = [0.0f64; 4];
        for place in (start as u32)..(end.ceil() as u32).min(length) {
            let share = (end.min(f64::from(place + 1)) - start.max(f64::from(place))) / covered;
            let pixel = match axis {
                Axis::X => pixels.get_pixel(place, y),
                Axis::Y => pixels.get_pixel(x, place),
            };
            for (sum, x) in sum.iter_mut().zip(pixel.0) {
                *sum += share * f64::from(x);
            }
        }
        Rgba(sum.map(|x| x as f32))
    })
}
