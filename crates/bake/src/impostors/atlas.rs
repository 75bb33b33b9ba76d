//! How do views become two pictures? Side by side, row by row, each number in fewer steps than a byte has: leaves and bark
//! are noise to PNG, and what is far away has no need of more ([`STEPS`]).
//!
//! | picture | red, green, blue | alpha |
//! |---|---|---|
//! | colour | base colour, sRGB | coverage |
//! | shape | x and y of the normal in the view's axes, −1 to 1; depth in radii before the middle, −1 to 1 | where some of the colour is for each who wears the model to choose: the share that is not |
//!
//! Frames of a movement stand below each other, each with all views.
//!
//! Pixels that show nothing take over what lies next to them ([`FRINGE`] pixels around), and the view's mean further out,
//! so that filters and smaller sizes of a picture do not mix in what is no colour of the model.

use belvedere_scene::impostor::Wish;
use glam::Vec3;

use super::raster::Pixel;
use crate::pictures;

/// How many pixels around a view's outline take over what lies inside, as a share of the view's size.
const FRINGE: f32 = 1.0 / 8.0;

/// In how many steps numbers go from nothing to all.
struct Steps {
    colour: u8,
    coverage: u8,
    normal: u8,
    depth: u8,
}

/// A step of the depth is about a pixel of the largest view.
const STEPS: Steps = Steps {
    colour: 63,
    coverage: 31,
    normal: 31,
    depth: 63,
};

/// All views of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Atlas {
    /// What was asked for.
    pub wish: Wish,
    /// Rows of pixels, from above.
    pub(super) colour: Vec<[u8; 4]>,
    pub(super) shape: Vec<[u8; 4]>,
}

impl Atlas {
    /// Joins the views of one frame, which come row by row.
    pub(super) fn of_views(views: &[Vec<Pixel>], wish: Wish) -> Self {
        let (count, size) = (wish.views as usize, wish.size_px as usize);
        let side = count * size;
        let pixels = side * side;
        let mut colour = vec![[0; 4]; pixels];
        let mut shape = vec![[0; 4]; pixels];
        for (number, view) in views.iter().enumerate() {
            let filled = filled(view, size);
            let first = number / count * size * side + number % count * size;
            for (index, (pixel, seen)) in filled.iter().zip(view).enumerate() {
                let at = first + index / size * side + index % size;
                let [r, g, b] = pixel.colour.to_array().map(|x| byte(pictures::srgb(x), STEPS.colour));
                colour[at] = [r, g, b, byte(seen.coverage, STEPS.coverage)];
                let Pixel {
                    normal,
                    depth,
                    recolour,
                    ..
                } = pixel;
                let numbers = [
                    (normal.x, STEPS.normal),
                    (normal.y, STEPS.normal),
                    (*depth, STEPS.depth),
                ];
                let [x, y, depth] = numbers.map(|(x, steps)| byte((x + 1.0) / 2.0, steps));
                shape[at] = [x, y, depth, byte(1.0 - recolour, STEPS.coverage)];
            }
        }
        Self { wish, colour, shape }
    }

    /// Puts the frames of another with as many views below these.
    pub(super) fn add_below(&mut self, other: Self) {
        self.colour.extend(other.colour);
        self.shape.extend(other.shape);
        self.wish.frames += other.wish.frames;
    }

    /// Pixels along a side of a frame.
    #[must_use]
    pub fn side_px(&self) -> u32 {
        self.wish.views * self.wish.size_px
    }

    /// Width and height of its pictures.
    fn size_px(&self) -> [u32; 2] {
        [self.side_px(), self.side_px() * self.wish.frames]
    }

    /// Base colour and coverage.
    #[must_use]
    pub fn colour_png(&self) -> Vec<u8> {
        pictures::png(
            self.size_px(),
            self.colour.as_flattened(),
            image::ExtendedColorType::Rgba8,
        )
    }

    /// Normals and depth, and whose colours are not its own.
    #[must_use]
    pub fn shape_png(&self) -> Vec<u8> {
        if self.shape.iter().any(|[.., own]| *own < 255) {
            let pixels = self.shape.as_flattened();
            return pictures::png(self.size_px(), pixels, image::ExtendedColorType::Rgba8);
        }
        let pixels: Vec<u8> = self
            .shape
            .iter()
            .flat_map(|[x, y, depth, _]| [*x, *y, *depth])
            .collect();
        pictures::png(self.size_px(), &pixels, image::ExtendedColorType::Rgb8)
    }
}

/// The same view with something at every pixel, unless it is empty.
fn filled(view: &[Pixel], size: usize) -> Vec<Pixel> {
    let mut pixels = view.to_vec();
    let mut known: Vec<bool> = view.iter().map(|pixel| pixel.coverage > 0.0).collect();
    for _ in 0..(size as f32 * FRINGE).ceil() as usize {
        let before = known.clone();
        for index in (0..pixels.len()).filter(|index| !before[*index]) {
            let (x, y) = (index % size, index / size);
            let around = [
                (x > 0).then(|| index - 1),
                (x + 1 < size).then_some(index + 1),
                (y > 0).then(|| index.wrapping_sub(size)),
                (y + 1 < size).then_some(index + size),
            ];
            let around = around.into_iter().flatten().filter(|other| before[*other]);
            let around: Vec<Pixel> = around.map(|other| pixels[other]).collect();
            if !around.is_empty() {
                pixels[index] = mean(&around);
                known[index] = true;
            }
        }
    }
    let seen: Vec<Pixel> = view.iter().filter(|pixel| pixel.coverage > 0.0).copied().collect();
    let rest = if seen.is_empty() {
        Pixel {
            normal: Vec3::Z,
            ..Pixel::default()
        }
    } else {
        mean(&seen)
    };
    for (pixel, known) in pixels.iter_mut().zip(known) {
        if !known {
            *pixel = rest;
        }
    }
    pixels
}

/// The mean of pixels.
fn mean(pixels: &[Pixel]) -> Pixel {
    let count = pixels.len() as f32;
    let sum = |of: fn(&Pixel) -> Vec3| pixels.iter().map(of).sum::<Vec3>() / count;
    Pixel {
        colour: sum(|pixel| pixel.colour),
        coverage: 0.0,
        normal: sum(|pixel| pixel.normal).normalize_or(Vec3::Z),
        depth: pixels.iter().map(|pixel| pixel.depth).sum::<f32>() / count,
        recolour: pixels.iter().map(|pixel| pixel.recolour).sum::<f32>() / count,
    }
}

/// 0 to 255 for 0 to 1, in so many steps.
fn byte(x: f32, steps: u8) -> u8 {
    let steps = f32::from(steps);
    ((x * steps).round() / steps * 255.0).round().clamp(0.0, 255.0) as u8
}
