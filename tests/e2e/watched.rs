//! What does a client ask for, and what does it make of answers that are wrong? A source that notes the one and does the other.

use std::{
    collections::{BTreeMap, BTreeSet},
    ops::Range,
    sync::{Arc, Mutex},
};

use belvedere_client::{Ask, ByteSource, Error, Part};
use bytes::Bytes;

/// What a source does to an answer.
pub(crate) type Harm = fn(&str, Bytes) -> Result<Bytes, Error>;

/// A source that counts what is asked for, and does harm to it.
#[derive(Clone)]
pub(crate) struct Watched<S> {
    source: S,
    asked: Arc<Mutex<BTreeMap<String, u32>>>,
    harm: Harm,
}

impl<S> Watched<S> {
    pub(crate) fn new(source: S, harm: Harm) -> Self {
        Self {
            source,
            asked: Arc::default(),
            harm,
        }
    }

    pub(crate) fn requests(&self) -> usize {
        self.asked.lock().expect("the notes").len()
    }

    /// All that was asked for.
    pub(crate) fn paths(&self) -> BTreeSet<String> {
        self.asked.lock().expect("the notes").keys().cloned().collect()
    }

    /// What was asked for more than once.
    pub(crate) fn twice(&self) -> Vec<String> {
        let asked = self.asked.lock().expect("the notes");
        let twice = asked
            .iter()
            .filter(|(path, times)| path.starts_with("/o/") && **times > 1);
        twice.map(|(path, _)| path.clone()).collect()
    }
}

impl<S: ByteSource> ByteSource for Watched<S> {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        *self
            .asked
            .lock()
            .expect("the notes")
            .entry(path.to_owned())
            .or_default() += 1;
        let bytes = self.source.get(path).await?;
        (self.harm)(path, bytes)
    }

    async fn get_range(&self, ask: Ask<'_>, range: Range<u64>) -> Result<(Part, u64), Error> {
        let whole = self.get(ask.path).await?;
        let [from, to] = [range.start, range.end].map(|at| at as usize);
        let part = whole.slice(from..to);
        let carried = part.len() as u64;
        Ok((Part::Asked(part), carried))
    }

    fn offers_bundles(&self) -> bool {
        self.source.offers_bundles()
    }
}
