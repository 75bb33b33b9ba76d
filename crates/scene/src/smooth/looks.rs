//! How much may a reader look at? Splits cost bits, and what a reader looks at for them is the triangles around vertices: of
//! these a few bytes could bring very many together, and have them looked through again and again.
//!
//! Meshes that are told as they hang together are far from the bound: some ten looks a vertex. A writer counts at least
//! what its readers will, so that it knows when it must not write at all.

use super::header::Header;

/// For each vertex and each triangle that there will be.
const LOOKS: u64 = 256;
/// So many triangles of a list are searched or moved in the time of one look.
const AT_ONCE: usize = 8;

pub(super) const TOO_MANY_LOOKS: &str = "it makes its reader look at more than a mesh of its size needs";

/// What may still be looked at.
#[derive(Debug, Clone)]
pub(super) struct Looks {
    left: u64,
}

impl Looks {
    pub(super) fn of(header: &Header) -> Self {
        Self {
            left: LOOKS * (u64::from(header.vertices) + u64::from(header.triangles)),
        }
    }

    #[inline(always)]
    pub(super) fn take(&mut self, looks: usize) {
        self.left = self.left.saturating_sub(looks as u64);
    }

    /// A list of so many triangles is searched.
    #[inline(always)]
    pub(super) fn take_for_search(&mut self, length: usize) {
        self.take(length / AT_ONCE);
    }

    #[inline(always)]
    pub(super) fn are_used_up(&self) -> bool {
        self.left == 0
    }
}
