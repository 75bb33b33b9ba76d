//! What is a picture, and is it what it claims to be? A picture that somebody brings is shown to every visitor, whose browser
//! decodes what it claims.
//!
//! PNG and JPEG are decoded whole. WebP (RFC 9649), KTX 2.0 (Khronos) and AVIF (ISO/IEC 23008-12) are published as they came, so
//! they are believed as far as their headers tell: how wide and high they are, and whether all of their file is there.

use std::{fmt, io::Cursor};

use image::{DynamicImage, ImageFormat, ImageReader, Limits};

/// No side of a published picture is longer.
pub(crate) const LARGEST_PX: u32 = 8192;
/// A PNG or JPEG of more pixels is not decoded; one of fewer that is too wide or too high is made smaller.
const MOST_PIXELS: u64 = 1 << 27;
/// Of a pixel with four channels of 16 bits.
const PIXEL_BYTES: u64 = 8;

/// Why a picture is not published.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Unfit {
    /// So wide and high.
    TooLarge([u32; 2]),
    /// Not a picture, or only a part of one.
    Damaged(String),
}

impl Unfit {
    /// What is told of all that are so.
    pub(crate) fn kind(&self) -> &'static str {
        match self {
            Self::TooLarge(_) => "picture that claims too many pixels: left out of its materials",
            Self::Damaged(_) => "picture that cannot be decoded: left out of its materials",
        }
    }
}

impl fmt::Display for Unfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooLarge([width, height]) => write!(
                f,
                "claims {width} × {height} pixels, at most {LARGEST_PX} × {LARGEST_PX} are taken: shrink it"
            ),
            Self::Damaged(why) => write!(f, "{why}: write it again"),
        }
    }
}

/// The extension and media type of a picture, by its first bytes.
pub(crate) fn kind(bytes: &[u8]) -> Option<(&'static str, &'static str)> {
    let brand = |at: usize| bytes.get(at..at + 4);
    Some(match bytes {
        _ if bytes.starts_with(b"\x89PNG\r\n\x1A\n") => ("png", "image/png"),
        _ if bytes.starts_with(b"\xFF\xD8\xFF") => ("jpg", "image/jpeg"),
        _ if bytes.starts_with(b"RIFF") && brand(8) == Some(b"WEBP") => ("webp", "image/webp"),
        _ if bytes.starts_with(b"\xABKTX 20\xBB\r\n\x1A\n") => ("ktx2", "image/ktx2"),
        _ if brand(4) == Some(b"ftyp") && matches!(brand(8), Some(b"avif" | b"avis")) => ("avif", "image/avif"),
        _ => return None,
    })
}

/// How wide and high a picture is that may be published, perhaps made smaller; decoding it takes up to so much memory.
pub(crate) fn size_px(ext: &str, bytes: &[u8], memory_bytes: u64) -> Result<[u32; 2], Unfit> {
    if let Some(format) = decoded_format(ext) {
        let decoded = decode(bytes, format, memory_bytes)?;
        return Ok([decoded.width(), decoded.height()]);
    }
    let told = match ext {
        "webp" => webp(bytes),
        "ktx2" => ktx2(bytes),
        _ => avif(bytes),
    };
    match told {
        Some([0, _] | [_, 0]) | None => Err(Unfit::Damaged(
            "its header is damaged, or its end is missing".to_owned(),
        )),
        Some(size) if size.into_iter().any(|px| px > LARGEST_PX) => Err(Unfit::TooLarge(size)),
        Some(size) => Ok(size),
    }
}

/// What decodes pictures of this kind; all others are published as they came.
pub(super) fn decoded_format(ext: &str) -> Option<ImageFormat> {
    match ext {
        "png" => Some(ImageFormat::Png),
        "jpg" => Some(ImageFormat::Jpeg),
        _ => None,
    }
}

pub(super) fn decode(bytes: &[u8], format: ImageFormat, memory_bytes: u64) -> Result<DynamicImage, Unfit> {
    let damaged = |error: image::ImageError| Unfit::Damaged(error.to_string());
    let reader = || ImageReader::with_format(Cursor::new(bytes), format);
    let (width, height) = reader().into_dimensions().map_err(damaged)?;
    let most_bytes = memory_bytes.min(PIXEL_BYTES * MOST_PIXELS);
    let too_large = Unfit::TooLarge([width, height]);
    if u64::from(width) * u64::from(height) > most_bytes / PIXEL_BYTES {
        return Err(too_large);
    }
    let mut limits = Limits::default();
    limits.max_alloc = Some(most_bytes);
    let mut reader = reader();
    reader.limits(limits);
    reader.decode().map_err(|error| match error {
        image::ImageError::Limits(_) => too_large,
        other => damaged(other),
    })
}

fn number<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..at.checked_add(N)?)?.try_into().ok()
}

/// RFC 9649, §2.4 to §2.7; of lossy pictures RFC 6386, §9.1, and of lossless ones RFC 9649, §3.4.
fn webp(bytes: &[u8]) -> Option<[u32; 2]> {
    let whole = u64::from(u32::from_le_bytes(number(bytes, 4)?)) + 8;
    if whole > bytes.len() as u64 {
        return None;
    }
    match bytes.get(12..16)? {
        b"VP8 " if number(bytes, 23)? == [0x9D, 0x01, 0x2A] => {
            let side = |at| Some(u32::from(u16::from_le_bytes(number(bytes, at)?)) & 0x3FFF);
            Some([side(26)?, side(28)?])
        }
        b"VP8L" if bytes.get(20) == Some(&0x2F) => {
            let packed = u32::from_le_bytes(number(bytes, 21)?);
            Some([packed, packed >> 14].map(|side| (side & 0x3FFF) + 1))
        }
        b"VP8X" => {
            let side = |at| number(bytes, at).map(|[a, b, c]| u32::from_le_bytes([a, b, c, 0]) + 1);
            Some([side(24)?, side(27)?])
        }
        _ => None,
    }
}

/// KTX 2.0, §3: sizes, then where each level lies and how long it is when it is unpacked.
fn ktx2(bytes: &[u8]) -> Option<[u32; 2]> {
    /// As much as the largest picture has as RGBA with all smaller levels.
    const MOST_BYTES: u64 = 6 * (LARGEST_PX as u64).pow(2);
    let field = |i: usize| number(bytes, 12 + 4 * i).map(u32::from_le_bytes);
    let [width, height, levels] = [field(2)?, field(3)?, field(7)?];
    for level in 0..levels.clamp(1, 32) as usize {
        let field = |i: usize| number(bytes, 80 + 24 * level + 8 * i).map(u64::from_le_bytes);
        let [start, length, unpacked] = [field(0)?, field(1)?, field(2)?];
        if start.checked_add(length)? > bytes.len() as u64 || unpacked > MOST_BYTES {
            return None;
        }
    }
    Some([width, height])
}

/// The largest size that any item of the file has (ISO/IEC 23008-12, §6.5.3), within its boxes (ISO/IEC 14496-12, §4.2).
fn avif(bytes: &[u8]) -> Option<[u32; 2]> {
    let mut largest = None;
    let mut within = vec![(bytes, 0)];
    while let Some((mut rest, depth)) = within.pop() {
        while !rest.is_empty() {
            let short = u32::from_be_bytes(number(rest, 0)?);
            let (head, length) = match short {
                0 => (8, rest.len() as u64),
                1 => (16, u64::from_be_bytes(number(rest, 8)?)),
                _ => (8, u64::from(short)),
            };
            let length = usize::try_from(length).ok()?;
            let inside = rest.get(head..length)?;
            match (rest.get(4..8)?, depth) {
                (b"meta", 0) => within.push((inside.get(4..)?, 1)),
                (b"iprp", 1) | (b"ipco", 2) => within.push((inside, depth + 1)),
                (b"ispe", 3) => {
                    let [width, height] = [4, 8].map(|at| number(inside, at).map(u32::from_be_bytes));
                    let size = [width?, height?];
                    largest = largest.max(Some((size.into_iter().max(), size)));
                }
                _ => {}
            }
            rest = &rest[length..];
        }
    }
    largest.map(|(_, size)| size)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROOM: u64 = 4 << 30;

    fn put(bytes: &mut [u8], at: usize, with: &[u8]) {
        bytes[at..at + with.len()].copy_from_slice(with);
    }

    fn webp_of(chunk: &[u8; 4], body: &[u8]) -> Vec<u8> {
        let mut bytes = [b"RIFF\0\0\0\0WEBP", chunk.as_slice(), &[0; 4], body].concat();
        let length = bytes.len() as u32 - 8;
        put(&mut bytes, 4, &length.to_le_bytes());
        bytes
    }

    fn ktx2_of(width: u32, height: u32, unpacked: u64) -> Vec<u8> {
        let mut bytes = [b"\xABKTX 20\xBB\r\n\x1A\n".as_slice(), &[0; 92 + 64]].concat();
        put(&mut bytes, 20, &[width.to_le_bytes(), height.to_le_bytes()].concat());
        put(&mut bytes, 40, &1u32.to_le_bytes());
        put(&mut bytes, 80, &[104, 64, unpacked].map(u64::to_le_bytes).concat());
        bytes
    }

    fn boxed(kind: &[u8; 4], inside: &[u8]) -> Vec<u8> {
        [&(inside.len() as u32 + 8).to_be_bytes(), kind.as_slice(), inside].concat()
    }

    fn avif_of(sizes: &[[u32; 2]]) -> Vec<u8> {
        let size = |[w, h]: &[u32; 2]| boxed(b"ispe", &[[0; 4], w.to_be_bytes(), h.to_be_bytes()].concat());
        let inside = boxed(
            b"iprp",
            &boxed(b"ipco", &sizes.iter().flat_map(size).collect::<Vec<_>>()),
        );
        let meta = boxed(b"meta", &[&[0; 4], inside.as_slice()].concat());
        [boxed(b"ftyp", b"avif\0\0\0\0"), meta, boxed(b"mdat", b"pixels")].concat()
    }

    #[test]
    fn headers_tell_how_large_a_picture_is_that_is_published_as_it_came() {
        let lossy = webp_of(b"VP8 ", &[0, 0, 0, 0x9D, 0x01, 0x2A, 0x40, 0x41, 0xF0, 0x00]);
        let lossless = webp_of(b"VP8L", &[0x2F, 0x3F, 0xC1, 0x3B, 0x00]);
        let extended = webp_of(b"VP8X", &[0, 0, 0, 0, 0x3F, 0x01, 0, 0xEF, 0, 0]);
        let small = [320, 240];
        for (bytes, found) in [
            (lossy, Ok(small)),
            (lossless, Ok([320, 240])),
            (extended, Ok(small)),
            (
                webp_of(b"VP8X", &[0, 0, 0, 0, 0x00, 0x20, 0, 0xEF, 0, 0]),
                Err([8193, 240]),
            ),
            (ktx2_of(320, 240, 320 * 240 * 4), Ok(small)),
            (ktx2_of(8, 70_000, 64), Err([8, 70_000])),
            (avif_of(&[[16, 16], small]), Ok(small)),
            (avif_of(&[small, [40_000, 1]]), Err([40_000, 1])),
        ] {
            let (ext, _) = kind(&bytes).unwrap();
            assert_eq!(size_px(ext, &bytes, ROOM), found.map_err(Unfit::TooLarge), "{ext}");
            // The last byte of what an AVIF has as its pixels lies in no header.
            let cut = &bytes[..bytes.len() - 1];
            assert!(matches!(size_px(ext, cut, ROOM), Err(Unfit::Damaged(_))), "{ext} cut");
        }
        let packed = ktx2_of(320, 240, 1 << 40);
        assert!(matches!(size_px("ktx2", &packed, ROOM), Err(Unfit::Damaged(_))));
    }

    #[test]
    fn nothing_is_decoded_that_claims_more_than_there_is_room_for() {
        let mut png = crate::pictures::png([64, 64], &[0; 64 * 64], image::ExtendedColorType::L8);
        assert_eq!(size_px("png", &png, ROOM), Ok([64, 64]));
        assert_eq!(size_px("png", &png, 1000), Err(Unfit::TooLarge([64, 64])));
        assert!(matches!(
            size_px("png", &png[..png.len() / 2], ROOM),
            Err(Unfit::Damaged(_))
        ));
        // Another width, and the checksum of the header that has it.
        put(&mut png, 16, &30_000u32.to_be_bytes());
        put(&mut png, 20, &30_000u32.to_be_bytes());
        let checksum = crc(&png[12..29]);
        put(&mut png, 29, &checksum.to_be_bytes());
        assert_eq!(size_px("png", &png, ROOM), Err(Unfit::TooLarge([30_000; 2])));
        let text = b"\x89PNG\r\n\x1A\nthis is no picture at all";
        assert!(matches!(size_px("png", text, ROOM), Err(Unfit::Damaged(_))));
    }

    /// CRC-32 (ISO 3309), bit by bit.
    fn crc(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(!0u32, |crc, byte| {
            (0..8).fold(crc ^ u32::from(*byte), |crc, _| (crc >> 1) ^ (0xEDB8_8320 * (crc & 1)))
        })
    }
}
