//! Is an object that the store does not have one that somebody needs? Whoever is answered with 404 has asked for a name that
//! nobody knows, or has found a hole in what is published.
//!
//! Anybody may guess names, and of which scene one is, the catalogue alone knows. So it is asked beside the answers, at most once in
//! [`PAUSE`], for all names that have come meanwhile, by their index. Where more have come than are asked for at once, some are drawn,
//! each with the same chance however often it came and whatever else did (Cohen & Kaplan 2007, *Summarizing data using bottom-k
//! sketches*): no scene with many holes, and nobody who guesses, hides the hole of another scene. What was found is not asked for again
//! for a while, since a hole is asked for by everybody who sees it.

use std::{
    collections::{BTreeMap, BTreeSet},
    hash::{BuildHasher, RandomState},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

use belvedere_scene::{BlobName, SceneName};

use crate::{db::Catalogue, seldom::Seldom};

/// Between two questions to the catalogue.
const PAUSE: Duration = Duration::from_secs(1);
/// So many names are asked for at once.
const MOST_ASKED: usize = 128;
/// So many names are remembered to be missing.
const MOST_FOUND: usize = 4_096;

/// Watches over objects that are not there. Cheap to clone.
#[derive(Debug, Clone, Default)]
pub struct MissingObjects(Arc<Inner>);

#[derive(Debug, Default)]
struct Inner {
    names: Mutex<Names>,
    told: Mutex<Seldom<SceneName>>,
    found: AtomicU64,
}

/// Names that are to be asked for, and those that need not be.
#[derive(Debug, Default)]
struct Names<S = RandomState> {
    draw: S,
    /// In each draw a name has a chance of its own.
    draws: u64,
    /// By their numbers in the draw.
    drawn: BTreeSet<(u64, BlobName)>,
    found: Seldom<BlobName>,
    /// Somebody asks, now and then, until there are none.
    asking: bool,
}

impl<S: BuildHasher> Names<S> {
    fn add(&mut self, blob: &BlobName) {
        let was_found = self.found.was_lately(blob, Instant::now());
        let place = (self.draw.hash_one((self.draws, blob)), blob.clone());
        if !was_found && self.drawn.insert(place) && self.drawn.len() > MOST_ASKED {
            self.drawn.pop_last();
        }
    }

    fn take(&mut self) -> Vec<BlobName> {
        self.draws += 1;
        std::mem::take(&mut self.drawn)
            .into_iter()
            .map(|(_, blob)| blob)
            .collect()
    }

    fn found(&mut self, blobs: impl Iterator<Item = BlobName>) {
        self.found.add(blobs, MOST_FOUND, Instant::now());
    }
}

impl MissingObjects {
    /// The store does not have this. Waits for nothing.
    pub(super) fn note(&self, catalogue: &Catalogue, blob: &BlobName) {
        if let Some(asking) = self.add(blob) {
            let catalogue = catalogue.clone();
            tokio::spawn(asking.ask(move |asked| {
                let catalogue = catalogue.clone();
                async move { catalogue.scenes_that_need(&asked).await }
            }));
        }
    }

    /// Whoever gets this is to ask.
    fn add(&self, blob: &BlobName) -> Option<Asking> {
        let mut names = self.names();
        names.add(blob);
        let begins = !names.drawn.is_empty() && !std::mem::replace(&mut names.asking, true);
        begins.then(|| Asking {
            missing: self.clone(),
            has_ended: false,
        })
    }

    /// How often it was something that a current revision needs.
    pub(super) fn found(&self) -> u64 {
        self.0.found.load(Ordering::Relaxed)
    }

    fn names(&self) -> MutexGuard<'_, Names> {
        self.0.names.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn tell(&self, needed: &BTreeMap<BlobName, SceneName>) {
        self.0.found.fetch_add(needed.len() as u64, Ordering::Relaxed);
        self.names().found(needed.keys().cloned());
        let mut told = self.0.told.lock().unwrap_or_else(PoisonError::into_inner);
        for (blob, scene) in needed {
            if told.is_due(scene.clone(), Instant::now()) {
                tracing::warn!(%scene, %blob, "the store lacks an object that is published: bake its scene again");
            }
        }
    }
}

/// Somebody asks. When that ends in whatever way, somebody else may.
#[derive(Debug)]
struct Asking {
    missing: MissingObjects,
    /// As it should: by now somebody else may ask.
    has_ended: bool,
}

impl Asking {
    /// Asks for what has come, until nothing has come for a while.
    async fn ask<F, A>(mut self, scenes_that_need: F)
    where
        F: Fn(Vec<BlobName>) -> A,
        A: Future<Output = anyhow::Result<BTreeMap<BlobName, SceneName>>>,
    {
        while let Some(asked) = self.take() {
            // A catalogue that is away is told of elsewhere.
            if let Ok(needed) = scenes_that_need(asked).await {
                self.missing.tell(&needed);
            }
            tokio::time::sleep(PAUSE).await;
        }
    }

    /// What has come; where nothing has, nobody asks any more.
    fn take(&mut self) -> Option<Vec<BlobName>> {
        let mut names = self.missing.names();
        let asked = names.take();
        names.asking = !asked.is_empty();
        self.has_ended = asked.is_empty();
        (!self.has_ended).then_some(asked)
    }
}

impl Drop for Asking {
    fn drop(&mut self) {
        if !self.has_ended {
            self.missing.names().asking = false;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::hash::{BuildHasherDefault, DefaultHasher};

    use super::*;

    fn name(number: u32) -> BlobName {
        BlobName::of(&number.to_le_bytes(), "glb").unwrap()
    }

    #[test]
    fn whoever_comes_last_and_whoever_comes_often_has_the_same_chance() {
        const ROUNDS: usize = 400;
        let mut names = Names::<BuildHasherDefault<DefaultHasher>>::default();
        let others: Vec<_> = (0..2 * MOST_ASKED as u32).map(name).collect();
        let (often, hole) = (&others[0], name(u32::MAX));
        let mut drawn = [0; 2];
        for _ in 0..ROUNDS {
            for other in &others {
                names.add(other);
                names.add(often);
            }
            names.add(&hole);
            let asked = names.take();
            assert_eq!(asked.len(), MOST_ASKED);
            drawn[0] += usize::from(asked.contains(&hole));
            drawn[1] += usize::from(asked.contains(often));
        }
        // Of 257 names 128 are drawn: each in about half of the rounds, within four standard deviations.
        let about_half = ROUNDS / 2 - 40..ROUNDS / 2 + 40;
        assert!(drawn.iter().all(|drawn| about_half.contains(drawn)), "{drawn:?}");
    }

    #[tokio::test]
    async fn a_question_that_fails_in_an_unforeseen_way_is_not_the_last() {
        async fn fail(_: Vec<BlobName>) -> anyhow::Result<BTreeMap<BlobName, SceneName>> {
            panic!("unforeseen")
        }
        let missing = MissingObjects::default();
        let asking = missing.add(&name(1)).unwrap();
        assert!(missing.add(&name(2)).is_none(), "somebody asks already");
        assert!(tokio::spawn(asking.ask(fail)).await.unwrap_err().is_panic());
        let mut again = missing.add(&name(3)).expect("somebody asks again");
        assert_eq!(again.take(), Some(vec![name(3)]));
        // Once it has ended as it should, it is in nobody's way.
        assert_eq!(again.take(), None);
        let next = missing.add(&name(4)).unwrap();
        drop(again);
        assert!(missing.add(&name(5)).is_none(), "the next one asks");
        drop(next);
        assert!(missing.add(&name(6)).is_some());
    }

    #[test]
    fn what_was_found_is_not_asked_for_again_and_gives_way_to_others() {
        let mut names = Names::<RandomState>::default();
        names.found((0..100_000).map(name));
        for number in 0..MOST_FOUND as u32 {
            names.add(&name(number));
        }
        assert_eq!(names.take(), []);
        // The first that found no room, and one of which nobody has asked.
        for number in [MOST_FOUND as u32, 200_000] {
            names.add(&name(number));
            assert_eq!(names.take(), [name(number)]);
        }
    }
}
