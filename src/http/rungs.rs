//! How is a rung of a smooth LOD answered? As an object of its own that is cut from the stored stream: nothing more is
//! stored, and every answer is a plain whole, for caches that refuse slices.

use std::ops::Range;

use belvedere_scene::{rung::RungName, smooth::Header};
use bytes::Bytes;

use super::error::ApiError;
use crate::store::{Representation, Representations};

/// A rung as an object without encoded forms, and where it begins in the stored stream, which is `whole`.
///
/// # Errors
/// When the stream has fewer rungs, or is none.
pub(super) fn cut(rung: RungName, whole: &Bytes) -> Result<(usize, Representations), ApiError> {
    let part = part(rung, whole)?;
    let (from, bytes) = (part.start, whole.slice(part));
    let etag = format!("\"{}-r{}\"", rung.hash, rung.number);
    Ok((from, Representations::alone(Representation::new(bytes, etag.into()))))
}

/// Where a rung lies in the stored stream.
///
/// # Errors
/// When the stream has fewer rungs, or is none.
pub(super) fn part(rung: RungName, whole: &[u8]) -> Result<Range<usize>, ApiError> {
    let broken = |cause: &str| ApiError::Internal(anyhow::anyhow!("{} has no rungs: {cause}", rung.whole()));
    let header = match Header::read(whole) {
        Ok(Some((header, _))) => header,
        Ok(None) => return Err(broken("its header is not whole")),
        Err(cause) => return Err(broken(&cause.to_string())),
    };
    let slice = header.rung(usize::from(rung.number)).ok_or_else(|| {
        let rungs = match header.cuts.len() {
            0 => "none".to_owned(),
            1 => "one, r0".to_owned(),
            count => format!("{count}, r0 to r{}", count - 1),
        };
        ApiError::NotFound(format!("rung r{} of `{}`; it has {rungs}", rung.number, rung.whole()))
    })?;
    let slice = slice.start as usize..slice.end as usize;
    match whole.get(slice.clone()) {
        Some(_) => Ok(slice),
        None => Err(broken("it ends before its header says")),
    }
}
