//! How does `EXT_meshopt_compression` store rows of numbers? Both ways: for what is imported and for what is published.
//!
//! A *view* is a run of rows, all of one stride. Rows of vertices may be filtered before they are compressed: unit vectors
//! as octahedral coordinates, floats as exponent and mantissa, colours and quaternions in their ways. The bitstreams are
//! those of the extension's specification: vertices in version 0, triangles and index sequences in version 1.

/// The extension's name in a glTF file.
pub(crate) const EXTENSION: &str = "EXT_meshopt_compression";

/// One element of a view: the meshopt decoder takes its stride from the size of a type.
#[derive(Clone, Copy)]
struct Row<const STRIDE: usize>([u8; STRIDE]);

impl<const STRIDE: usize> Default for Row<STRIDE> {
    fn default() -> Self {
        Self([0; STRIDE])
    }
}

fn rows<const STRIDE: usize>(encoded: &[u8], count: usize) -> Option<Vec<u8>> {
    let rows = meshopt::decode_vertex_buffer::<Row<STRIDE>>(encoded, count).ok()?;
    Some(rows.into_iter().flat_map(|row| row.0).collect())
}

/// Calls `rows` with the stride as a constant; the format allows multiples of four up to 256.
macro_rules! rows_of {
    ($stride:expr, $encoded:expr, $count:expr; $($n:literal)*) => {
        match $stride { $($n => rows::<$n>($encoded, $count),)* _ => None }
    };
}

fn attributes(encoded: &[u8], count: usize, stride: usize) -> Option<Vec<u8>> {
    rows_of!(stride, encoded, count;
        4 8 12 16 20 24 28 32 36 40 44 48 52 56 60 64 68 72 76 80 84 88 92 96 100 104 108 112 116 120 124 128
        132 136 140 144 148 152 156 160 164 168 172 176 180 184 188 192 196 200 204 208 212 216 220 224 228 232
        236 240 244 248 252 256)
}

fn indices(encoded: &[u8], count: usize, stride: usize, triangles: bool) -> Option<Vec<u8>> {
    let narrow = |v: Vec<u16>| v.into_iter().flat_map(u16::to_le_bytes).collect();
    let wide = |v: Vec<u32>| v.into_iter().flat_map(u32::to_le_bytes).collect();
    match (stride, triangles) {
        (2, true) if count.is_multiple_of(3) => meshopt::decode_index_buffer(encoded, count).ok().map(narrow),
        (4, true) if count.is_multiple_of(3) => meshopt::decode_index_buffer(encoded, count).ok().map(wide),
        (2, false) => meshopt::decode_index_sequence(encoded, count).ok().map(narrow),
        (4, false) => meshopt::decode_index_sequence(encoded, count).ok().map(wide),
        _ => None,
    }
}

/// Undoes a filter in place; `false` when it does not fit the stride.
pub(crate) fn undo_filter(filter: &str, bytes: &mut Vec<u8>, stride: usize) -> bool {
    let words = |bytes: &[u8]| -> Vec<[i16; 4]> {
        let word = |c: &[u8; 8], i: usize| i16::from_le_bytes([c[2 * i], c[2 * i + 1]]);
        bytes
            .as_chunks::<8>()
            .0
            .iter()
            .map(|c| std::array::from_fn(|i| word(c, i)))
            .collect()
    };
    let unwords = |words: Vec<[i16; 4]>| words.into_iter().flatten().flat_map(i16::to_le_bytes).collect();
    let octets = |bytes: &[u8]| -> Vec<[i8; 4]> {
        bytes
            .as_chunks()
            .0
            .iter()
            .map(|c: &[u8; 4]| c.map(|b| b as i8))
            .collect()
    };
    let unoctets = |octets: Vec<[i8; 4]>| octets.into_iter().flatten().map(|b| b as u8).collect();
    match (filter, stride) {
        ("NONE", _) => {}
        ("OCTAHEDRAL", 4) => {
            let mut vectors = octets(bytes);
            meshopt::decode_filter_oct(&mut vectors);
            *bytes = unoctets(vectors);
        }
        ("OCTAHEDRAL", 8) => {
            let mut vectors = words(bytes);
            meshopt::decode_filter_oct(&mut vectors);
            *bytes = unwords(vectors);
        }
        ("QUATERNION", 8) => {
            let mut quaternions = words(bytes);
            meshopt::decode_filter_quat(&mut quaternions);
            *bytes = unwords(quaternions);
        }
        ("EXPONENTIAL", _) if stride.is_multiple_of(4) => {
            let mut numbers: Vec<[u32; 1]> = bytes.as_chunks().0.iter().map(|c| [u32::from_le_bytes(*c)]).collect();
            meshopt::decode_filter_exp(&mut numbers);
            *bytes = numbers.into_iter().flatten().flat_map(u32::to_le_bytes).collect();
        }
        ("COLOR", 4) => {
            let mut colors = bytes.as_chunks::<4>().0.to_vec();
            meshopt::decode_filter_color(&mut colors);
            *bytes = colors.into_flattened();
        }
        ("COLOR", 8) => {
            let mut colors: Vec<[u16; 4]> = words(bytes).into_iter().map(|c| c.map(|w| w as u16)).collect();
            meshopt::decode_filter_color(&mut colors);
            *bytes = colors.into_iter().flatten().flat_map(u16::to_le_bytes).collect();
        }
        _ => return false,
    }
    true
}

/// Decodes a view and undoes its filter; `None` when the bytes are no such view.
pub(crate) fn decode(mode: &str, filter: &str, encoded: &[u8], count: usize, stride: usize) -> Option<Vec<u8>> {
    let mut bytes = match mode {
        "ATTRIBUTES" => attributes(encoded, count, stride),
        "TRIANGLES" => indices(encoded, count, stride, true),
        "INDICES" => indices(encoded, count, stride, false),
        _ => None,
    }?;
    undo_filter(filter, &mut bytes, stride).then_some(bytes)
}

/// Compresses rows of vertices, filtered already. `None` for a stride that nothing here writes.
pub(crate) fn encode_attributes(rows: &[u8], stride: usize) -> Option<Vec<u8>> {
    fn encode<const STRIDE: usize>(rows: &[u8]) -> Option<Vec<u8>> {
        // The extension knows version 0 only.
        meshopt::encode_vertex_buffer_level(rows.as_chunks::<STRIDE>().0, 0, Some(0)).ok()
    }
    match stride {
        4 => encode::<4>(rows),
        8 => encode::<8>(rows),
        12 => encode::<12>(rows),
        16 => encode::<16>(rows),
        _ => None,
    }
}
