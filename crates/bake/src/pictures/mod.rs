//! In which sizes is a picture published, and which of them does a level of detail need?
//!
//! A *ladder* holds the picture as it came and then each time half as wide and half as high (rounded down), while what
//! that gives has at least [`SMALLEST_PX`] pixels along its longer side. Where that takes no fewer bytes, the larger one stands for it. Pixels are averages over the area that they
//! cover ([`averages`]): of colours in linear light, and weighted by alpha where that says what is there; of normals and
//! other data as they stand. PNG stays PNG and JPEG stays JPEG; what is neither has one size ([`claims`] says what of it is looked at). A picture with a side of more than
//! [`claims::LARGEST_PX`] pixels begins with the first size that has none.
//!
//! From the distance on at which a level is good enough, its error covers at most one pixel of the screen. So a level
//! takes the smallest size of which a texel is at most as long as its error ([`texels`]): between half and one pixel there.

mod averages;
pub(crate) mod claims;
#[cfg(test)]
mod tests;
pub mod texels;
pub(crate) mod transform;

use image::{
    DynamicImage, ExtendedColorType, GrayImage, ImageEncoder, ImageFormat, Luma, Rgba32FImage, RgbaImage,
    codecs::{
        jpeg::JpegEncoder,
        png::{CompressionType, FilterType, PngEncoder},
    },
};

use self::averages::{filled, from_averages, halved, to_averages};
pub(crate) use self::averages::{linear, srgb};
use self::claims::{LARGEST_PX, decoded_format};
use crate::source::Image;

/// No size is made whose longer side has fewer pixels.
pub const SMALLEST_PX: u32 = 32;
/// Of JPEG: what most writers take.
const QUALITY: u8 = 85;

/// What the numbers of a picture mean; of two meanings, the later asks less of how its pixels are averaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Content {
    /// sRGB colours that are there as far as alpha says: base colours of materials that are masked or blended.
    Cutout,
    /// sRGB colours; alpha is a number of its own, or means nothing.
    Color,
    /// Directions, roughness and the like, proportional to what they mean.
    Data,
}

/// A picture in all sizes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ladder {
    /// How wide and high the first one is; none when nobody could tell.
    pub size_px: Option<[u32; 2]>,
    /// The encoded pictures, each half as wide and high as the one before, or that one again where this saves nothing; the last one
    /// does. The first is the source's own unless that is too large.
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
        pixels = halved(&pixels);
        let Some(encoded) = encode(&pixels, content, has_alpha, format) else {
            break;
        };
        let last = &ladder.rungs[ladder.rungs.len() - 1];
        let smaller = if encoded.len() < last.len() {
            encoded
        } else {
            last.clone()
        };
        ladder.rungs.push(smaller);
    }
    let saving = |pair: &[Vec<u8>]| pair[1].len() < pair[0].len();
    let last = ladder.rungs.windows(2).rposition(saving).map_or(0, |before| before + 1);
    ladder.rungs.truncate(last + 1);
    ladder
}

/// Whether pictures of a kind are decoded here.
pub(crate) fn is_decoded(ext: &str) -> bool {
    decoded_format(ext).is_some()
}

/// How opaque a picture is, texel by texel; none when it does not say or cannot be read.
pub(crate) fn alpha(picture: &Image) -> Option<GrayImage> {
    if picture.ext != "png" {
        return None;
    }
    let decoded = decode(&picture.bytes, ImageFormat::Png, Content::Data)?.pixels;
    let pixels = decoded.color().has_alpha().then(|| decoded.into_rgba8())?;
    Some(GrayImage::from_fn(pixels.width(), pixels.height(), |x, y| {
        Luma([pixels.get_pixel(x, y).0[3]])
    }))
}

/// A picture of colours in linear light, alpha not multiplied in, halved until no side has more pixels than this; `None`
/// when it cannot be decoded.
pub(crate) fn small(picture: &Image, content: Content, most_px: u32) -> Option<Rgba32FImage> {
    let format = decoded_format(picture.ext)?;
    let mut pixels = decode(&picture.bytes, format, content)?.pixels.into_rgba32f();
    to_averages(&mut pixels, content);
    while pixels.width().max(pixels.height()) > most_px {
        pixels = halved(&pixels);
    }
    Some(if content == Content::Cutout {
        filled(&pixels)
    } else {
        pixels
    })
}

/// A square of pixels as PNG, as small as its writer makes it.
pub(crate) fn png([width_px, height_px]: [u32; 2], pixels: &[u8], kind: ExtendedColorType) -> Vec<u8> {
    let mut encoded = Vec::new();
    smallest_png(&mut encoded)
        .write_image(pixels, width_px, height_px, kind)
        .expect("rows of pixels can be written into memory");
    encoded
}

/// What is published is read more often than it is written, and stands beside what its author may have packed well.
fn smallest_png(into: &mut Vec<u8>) -> PngEncoder<&mut Vec<u8>> {
    PngEncoder::new_with_quality(into, CompressionType::Best, FilterType::Adaptive)
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
        let half = shown(&halved(&pixels), content);
        bytes.extend(half.into_raw());
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

/// Averages as they are published.
fn shown(pixels: &Rgba32FImage, content: Content) -> RgbaImage {
    let filled = (content == Content::Cutout).then(|| filled(pixels));
    let pixels = filled.as_ref().unwrap_or(pixels);
    RgbaImage::from_fn(pixels.width(), pixels.height(), |x, y| {
        image::Rgba(from_averages(pixels.get_pixel(x, y).0, content))
    })
}

fn encode(pixels: &Rgba32FImage, content: Content, has_alpha: bool, format: ImageFormat) -> Option<Vec<u8>> {
    let shown = DynamicImage::ImageRgba8(shown(pixels, content));
    let shown = if has_alpha { shown } else { shown.into_rgb8().into() };
    written(&shown, format)
}

fn written(shown: &DynamicImage, format: ImageFormat) -> Option<Vec<u8>> {
    let mut encoded = Vec::new();
    let written = match format {
        ImageFormat::Jpeg => shown.write_with_encoder(JpegEncoder::new_with_quality(&mut encoded, QUALITY)),
        _ => shown.write_with_encoder(smallest_png(&mut encoded)),
    };
    written.ok().map(|()| encoded)
}
