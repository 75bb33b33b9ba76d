//! How does a picture become a file? PNG (ISO/IEC 15948): signature, header, one compressed stream, end.

use std::io::Write;

use flate2::{Compression, Crc, write::ZlibEncoder};

const SIGNATURE: [u8; 8] = [0x89, b'P', b'N', b'G', 0x0D, 0x0A, 0x1A, 0x0A];

/// Encodes three bytes a pixel, row by row from the top.
pub(super) fn encode(width: usize, height: usize, rgb: &[u8]) -> anyhow::Result<Vec<u8>> {
    let side = |pixels: usize| u32::try_from(pixels).map(u32::to_be_bytes);
    // Eight bits a sample, colour type 2 (RGB), the only compression and filter methods, not interlaced.
    let header = [&side(width)?[..], &side(height)?[..], &[8, 2, 0, 0, 0]].concat();
    let mut stream = ZlibEncoder::new(Vec::new(), Compression::default());
    for row in rgb.chunks_exact(3 * width.max(1)) {
        // Filter 0: as it is.
        stream.write_all(&[0])?;
        stream.write_all(row)?;
    }
    let mut file = SIGNATURE.to_vec();
    for (kind, data) in [(b"IHDR", &header[..]), (b"IDAT", &stream.finish()?), (b"IEND", &[])] {
        let mut crc = Crc::new();
        crc.update(kind);
        crc.update(data);
        file.extend(u32::try_from(data.len())?.to_be_bytes());
        file.extend(kind);
        file.extend(data);
        file.extend(crc.sum().to_be_bytes());
    }
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    #[test]
    fn the_file_starts_as_a_png_and_holds_the_rows() {
        let rgb: Vec<u8> = (0..2 * 3 * 3).collect();
        let file = encode(3, 2, &rgb).unwrap();
        assert_eq!(file[..8], SIGNATURE);
        assert_eq!(file[8..29], *b"\0\0\0\x0dIHDR\0\0\0\x03\0\0\0\x02\x08\x02\0\0\0");
        let length = u32::from_be_bytes([file[33], file[34], file[35], file[36]]) as usize;
        let mut rows = Vec::new();
        flate2::read::ZlibDecoder::new(&file[41..41 + length])
            .read_to_end(&mut rows)
            .unwrap();
        assert_eq!(rows, [&[0], &rgb[..9], &[0], &rgb[9..]].concat());
        // The checksum of an empty last chunk is the same in every PNG.
        assert_eq!(file[file.len() - 4..], [0xAE, 0x42, 0x60, 0x82]);
    }
}
