//! What do compressed views hold? (`EXT_meshopt_compression`, as far as positions and indices need it)
//!
//! The bitstreams are decoded by the `meshopt` crate, whose decoders take untrusted bytes.

use serde_json::Value;

/// Decodes the view that an extension object describes; `None` when it does not lie in the chunk, is damaged, is neither
/// of positions nor of indices, or takes more than `most` bytes.
pub(super) fn unfold(compression: &Value, binary: &[u8], most: usize) -> Option<Vec<u8>> {
    let number = |name: &str| usize::try_from(compression.get(name)?.as_u64()?).ok();
    let text = |name: &str| compression.get(name).and_then(Value::as_str);
    let start = number("byteOffset").unwrap_or(0);
    let encoded = binary.get(start..)?.get(..number("byteLength")?)?;
    let (count, stride) = (number("count")?, number("byteStride")?);
    count.checked_mul(stride).filter(|bytes| *bytes <= most)?;
    let filter = text("filter").unwrap_or("NONE");
    match (text("mode")?, stride, filter) {
        ("ATTRIBUTES", 8, _) => words(rows::<8>(encoded, count)?, filter),
        ("ATTRIBUTES", 12, _) => words(rows::<12>(encoded, count)?, filter),
        ("TRIANGLES", 2, "NONE") if count.is_multiple_of(3) => {
            let indices: Vec<u16> = meshopt::decode_index_buffer(encoded, count).ok()?;
            Some(indices.into_iter().flat_map(u16::to_le_bytes).collect())
        }
        ("TRIANGLES", 4, "NONE") if count.is_multiple_of(3) => {
            let indices: Vec<u32> = meshopt::decode_index_buffer(encoded, count).ok()?;
            Some(indices.into_iter().flat_map(u32::to_le_bytes).collect())
        }
        ("INDICES", 2, "NONE") => {
            let indices: Vec<u16> = meshopt::decode_index_sequence(encoded, count).ok()?;
            Some(indices.into_iter().flat_map(u16::to_le_bytes).collect())
        }
        ("INDICES", 4, "NONE") => {
            let indices: Vec<u32> = meshopt::decode_index_sequence(encoded, count).ok()?;
            Some(indices.into_iter().flat_map(u32::to_le_bytes).collect())
        }
        _ => None,
    }
}

fn rows<const STRIDE: usize>(encoded: &[u8], count: usize) -> Option<Vec<u8>>
where
    [u8; STRIDE]: Default,
{
    let rows: Vec<[u8; STRIDE]> = meshopt::decode_vertex_buffer(encoded, count).ok()?;
    Some(rows.into_flattened())
}

/// Undoes the filter of positions: each float is a mantissa of 24 bits below an exponent of 8, both signed.
fn words(mut rows: Vec<u8>, filter: &str) -> Option<Vec<u8>> {
    match filter {
        "NONE" => {}
        "EXPONENTIAL" => {
            for word in rows.as_chunks_mut::<4>().0 {
                let bits = i32::from_le_bytes(*word);
                let (mantissa, exponent) = ((bits << 8) >> 8, bits >> 24);
                let value = f64::from(mantissa) * f64::from(exponent).exp2();
                *word = (value as f32).to_le_bytes();
            }
        }
        _ => return None,
    }
    Some(rows)
}
