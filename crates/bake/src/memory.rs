//! Was this found before? A bake may remember what it found for each cell, so that one that was killed goes on where it
//! was, and a scene that was changed a little is baked anew only where that matters.

use std::{
    collections::BTreeMap,
    sync::{Mutex, PoisonError},
};

use crate::digest::Digest;

/// Remembers results by the digest of all that they were made from. Called from many threads.
pub trait Memory: Sync {
    /// What was kept under a key, if it still is.
    fn recall(&self, key: &Digest) -> Option<String>;
    /// Keeps a result, one line of text. Whether it can be recalled is no concern of the bake.
    fn keep(&self, key: &Digest, result: &str);
    /// Whether what it recalls under a key was found by this bake itself.
    fn is_of_this_bake(&self, _key: &Digest) -> bool {
        false
    }
}

/// A memory that also recalls what this bake itself has kept.
pub(crate) struct Recent<'a> {
    memory: &'a dyn Memory,
    /// Whether it still takes something.
    is_open: bool,
    kept: Mutex<BTreeMap<Digest, String>>,
}

impl<'a> Recent<'a> {
    pub(crate) fn over(memory: &'a dyn Memory) -> Self {
        Self {
            memory,
            is_open: true,
            kept: Mutex::default(),
        }
    }

    /// From now on only the memory below takes what is found.
    pub(crate) fn close(&mut self) {
        self.is_open = false;
    }

    fn own(&self, key: &Digest) -> Option<String> {
        self.kept
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .get(key)
            .cloned()
    }
}

impl Memory for Recent<'_> {
    fn recall(&self, key: &Digest) -> Option<String> {
        self.own(key).or_else(|| self.memory.recall(key))
    }

    fn keep(&self, key: &Digest, result: &str) {
        self.memory.keep(key, result);
        if self.is_open {
            let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
            kept.insert(*key, result.to_owned());
        }
    }

    fn is_of_this_bake(&self, key: &Digest) -> bool {
        self.own(key).is_some()
    }
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
