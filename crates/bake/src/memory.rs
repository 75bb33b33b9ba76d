//! Was this found before? A bake may remember what it found for each cell, so that one that was killed goes on where it
//! was, and a scene that was changed a little is baked anew only where that matters.

use crate::digest::Digest;

/// Remembers results by the digest of all that they were made from. Called from many threads.
pub trait Memory: Sync {
    /// What was kept under a key, if it still is.
    fn recall(&self, key: &Digest) -> Option<String>;
    /// Keeps a result, one line of text. Whether it can be recalled is no concern of the bake.
    fn keep(&self, key: &Digest, result: &str);
}

/// Remembers nothing.
#[derive(Debug, Clone, Copy)]
pub struct Forgetful;

impl Memory for Forgetful {
    fn recall(&self, _: &Digest) -> Option<String> {
        None
    }

    fn keep(&self, _: &Digest, _: &str) {}
}
