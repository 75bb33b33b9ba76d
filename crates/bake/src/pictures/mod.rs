//! In which sizes is a picture published, and which of them does a level of detail need?
//!
//! A *ladder* holds the picture as it came and then each time half as wide and half as high (rounded down), while what
//! that gives has at least [`SMALLEST_PX`] pixels along its longer side and bytes still fall. Pixels are averages over the area that they
//! cover: of colours in linear light and weighted by alpha, of normals and other data as they stand. PNG stays PNG and
//! JPEG stays JPEG; what is neither has one size ([`claims`] says what of it is looked at). A picture with a side of more than
//! [`claims::LARGEST_PX`] pixels begins with the first size that has none.
//!
//! From the distance on at which a level is good enough, its error covers at most one pixel of the screen. So a level
//! takes the smallest size of which a texel is at most as long as its error ([`texels`]): between half and one pixel there.

pub(crate) mod claims;
#[cfg(test)]
mod tests;
pub mod texels;

use image::{
    DynamicImage, ExtendedColorType, GrayImage, ImageEncoder, ImageFormat, Luma, Rgba32FImage, RgbaImage,
    codecs::{
        jpeg::JpegEncoder,
        png::{CompressionType, FilterType, PngEncoder},
    },
};

use self::claims::{LARGEST_PX, decoded_format};
use crate::source::Image;

/// No size is made whose longer side has fewer pixels.
pub const SMALLEST_PX: u32 = 32;
/// Of JPEG: what most writers take.
const QUALITY: u8 = 85;

/// What the numbers of a picture mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Content {
    /// sRGB colours, perhaps with alpha.
    Color,
    /// Directions, roughness and the like, proportional to what they mean.
    Data,
}

/// A picture in all sizes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ladder {
    /// How wide and high the first one is; none when nobody could tell.
    pub size_px: Option<[u32; 2]>,
    /// The encoded pictures, each half as wide and high as the one before; the first is the source's own unless that is too large.
    pub rungs: Vec<Vec<u8>>,
}

/// Makes the smaller sizes of a picture.
///
/// Costs a pass over the pixels and 16 bytes of memory for each; the same picture gives the same bytes.
#[must_use]
pub fn ladder(picture: &Image, content: Content) -> Ladder {
    let own = |size_px| Ladder {
        size_px,
        rungs: vec![picture.bytes.clone()],
    };
    let Some(format) = decoded_format(picture.ext) else {
        return own(None);
    };
    let Some(decoded) = decode(&picture.bytes, format, content) else {
        return Ladder {
            size_px: None,
            rungs: vec![nothing(format)],
        };
    };
    let size_px = Some([decoded.pixels.width(), decoded.pixels.height()]);
    let mut ladder = match decoded.shrunk {
        false => own(size_px),
        true => Ladder {
            size_px,
            rungs: vec![written(&decoded.pixels, format).unwrap_or_else(|| nothing(format))],
        },
    };
    let decoded = decoded.pixels;
    let has_alpha = decoded.color().has_alpha();
    let mut pixels = decoded.into_rgba32f();
    to_averages(&mut pixels, content);
    while pixels.width().max(pixels.height()) / 2 >= SMALLEST_PX {
        pixels = halved(&halved(&pixels, Axis::X), Axis::Y);
        let encoded = encode(&pixels, content, has_alpha, format);
        match encoded.filter(|bytes| ladder.rungs.last().is_some_and(|last| bytes.len() < last.len())) {
            Some(bytes) => ladder.rungs.push(bytes),
            None => break,
        }
    }
    ladder
}

/// How opaque a picture is, texel by texel; none when it does not say or cannot be read.
pub(crate) fn alpha(picture: &Image) -> Option<GrayImage> {
    if picture.ext != "png" {
        return None;
    }
    let decoded = decode(&picture.bytes, ImageFormat::Png, Content::Color)?.pixels;
    let pixels = decoded.color().has_alpha().then(|| decoded.into_rgba8())?;
    Some(GrayImage::from_fn(pixels.width(), pixels.height(), |x, y| {
        Luma([pixels.get_pixel(x, y).0[3]])
    }))
}

/// A picture of colours in linear light, alpha not multiplied in, halved until no side has more pixels than this; `None`
/// when it cannot be decoded.
pub(crate) fn small(picture: &Image, most_px: u32) -> Option<Rgba32FImage> {
    let format = decoded_format(picture.ext)?;
    let mut pixels = decode(&picture.bytes, format, Content::Color)?.pixels.into_rgba32f();
    to_averages(&mut pixels, Content::Color);
    while pixels.width().max(pixels.height()) > most_px {
        pixels = halved(&halved(&pixels, Axis::X), Axis::Y);
    }
    for image::Rgba([r, g, b, alpha]) in pixels.pixels_mut() {
        for x in [r, g, b] {
            *x = if *alpha > 0.0 { *x / *alpha } else { 0.0 };
        }
    }
    Some(pixels)
}

/// A square of pixels as PNG, as small as its writer makes it.
pub(crate) fn png([width_px, height_px]: [u32; 2], pixels: &[u8], kind: ExtendedColorType) -> Vec<u8> {
    let mut encoded = Vec::new();
    PngEncoder::new_with_quality(&mut encoded, CompressionType::Best, FilterType::Adaptive)
        .write_image(pixels, width_px, height_px, kind)
        .expect("rows of pixels can be written into memory");
    encoded
}

struct Decoded {
    pixels: DynamicImage,
    /// Whether it came with more pixels.
    shrunk: bool,
}

fn decode(bytes: &[u8], format: ImageFormat, content: Content) -> Option<Decoded> {
    let mut decoded = Decoded {
        pixels: claims::decode(bytes, format, u64::MAX).ok()?,
        shrunk: false,
    };
    while decoded.pixels.width().max(decoded.pixels.height()) > LARGEST_PX {
        decoded = Decoded {
            pixels: halved_in_bands(&decoded.pixels, content)?,
            shrunk: true,
        };
    }
    Some(decoded)
}

/// Half as many pixels along both sides; as numbers that can be averaged all at once would take too much memory.
fn halved_in_bands(whole: &DynamicImage, content: Content) -> Option<DynamicImage> {
    const BAND_PX: u32 = 256;
    let (width, height) = (whole.width(), whole.height());
    let bands = (height / BAND_PX).max(1);
    let mut bytes = Vec::new();
    for band in 0..bands {
        let start = band * BAND_PX;
        let end = if band + 1 == bands { height } else { start + BAND_PX };
        let mut pixels = whole.crop_imm(0, start, width, end - start).into_rgba32f();
        to_averages(&mut pixels, content);
        let half = halved(&halved(&pixels, Axis::X), Axis::Y);
        bytes.extend(half.pixels().flat_map(|pixel| from_averages(pixel.0, content)));
    }
    let half = DynamicImage::ImageRgba8(RgbaImage::from_raw((width / 2).max(1), (height / 2).max(1), bytes)?);
    Some(if whole.color().has_alpha() {
        half
    } else {
        half.into_rgb8().into()
    })
}

/// What stands for a picture that cannot be decoded.
fn nothing(format: ImageFormat) -> Vec<u8> {
    let white = image::RgbImage::from_pixel(1, 1, image::Rgb([255; 3]));
    written(&white.into(), format).expect("one pixel can be written into memory")
}

/// Makes of pixels what may be averaged.
fn to_averages(pixels: &mut Rgba32FImage, content: Content) {
    if content == Content::Color {
        for pixel in pixels.pixels_mut() {
            let alpha = pixel.0[3];
            for x in &mut pixel.0[..3] {
                *x = linear(*x) * alpha;
            }
        }
    }
}

/// The reverse, in 8 bits.
fn from_averages(pixel: [f32; 4], content: Content) -> [u8; 4] {
    let [r, g, b, alpha] = pixel;
    let shown = match content {
        Content::Data => pixel,
        Content::Color if alpha > 0.0 => [srgb(r / alpha), srgb(g / alpha), srgb(b / alpha), alpha],
        Content::Color => [0.0; 4],
    };
    shown.map(|x| (x * 255.0).round().clamp(0.0, 255.0) as u8)
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

/// Half as many pixels along an axis, at least one, each the average over what it covers. An odd number is halved
/// without leaving one out: a pixel then covers a bit more than two.
fn halved(pixels: &Rgba32FImage, axis: Axis) -> Rgba32FImage {
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
        image::Rgba(sum.map(|x| x as f32))
    })
}

fn encode(pixels: &Rgba32FImage, content: Content, has_alpha: bool, format: ImageFormat) -> Option<Vec<u8>> {
    let bytes = pixels.pixels().flat_map(|pixel| from_averages(pixel.0, content));
    let bytes = RgbaImage::from_raw(pixels.width(), pixels.height(), bytes.collect())?;
    let shown = DynamicImage::ImageRgba8(bytes);
    let shown = if has_alpha { shown } else { shown.into_rgb8().into() };
    written(&shown, format)
}

fn written(shown: &DynamicImage, format: ImageFormat) -> Option<Vec<u8>> {
    let mut encoded = Vec::new();
    let written = match format {
        ImageFormat::Jpeg => shown.write_with_encoder(JpegEncoder::new_with_quality(&mut encoded, QUALITY)),
        _ => shown.write_with_encoder(PngEncoder::new(&mut encoded)),
    };
    written.ok().map(|()| encoded)
}
