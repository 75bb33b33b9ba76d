//! Was the scene published anew meanwhile, and what of it is here already? The pointer is looked at beside all else where something of
//! this revision is gone, and where somebody asks for that. The walk goes on with what is left, and who wants the newer revision
//! explores that: what has the same hash in both is not fetched again.

use std::{
    collections::{BTreeMap, HashMap},
    time::Duration,
};

use belvedere_scene::{Revision, object::Model};
use bytes::Bytes;
use tokio::time::Instant;

use super::{Event, Explorer, tasks::Brought};
use crate::{
    ByteSource, Error,
    strategy::{
        file::{FileName, FileRef, Key},
        grade::{Grade, Stock},
        sight::Seen,
    },
};

/// Between two looks at the pointer because something is gone.
const LOOK_AGAIN: Duration = Duration::from_secs(10);

/// What is known of a newer revision.
#[derive(Debug, Default)]
pub(super) struct Lookout {
    newer: Option<Revision>,
    /// Whether something was gone that was not looked into yet.
    pub(super) has_missed: bool,
    is_looking: bool,
    looked: Option<Instant>,
}

/// Files of another revision that may be wanted in this one, too.
#[derive(Debug, Default)]
pub(super) struct Inheritance {
    files: BTreeMap<Key, Bytes>,
    bytes: u64,
}

impl Inheritance {
    /// The same, and these files.
    fn with(&self, files: &HashMap<Key, Bytes>) -> Self {
        let mut all = self.files.clone();
        all.extend(files.iter().map(|(key, bytes)| (*key, bytes.clone())));
        Self {
            bytes: all.values().map(|bytes| bytes.len() as u64).sum(),
            files: all,
        }
    }

    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// A file, which has so many bytes.
    fn take(&mut self, key: Key, bytes: u64) -> Option<Bytes> {
        let file = self.files.remove(&key)?;
        self.bytes -= file.len() as u64;
        Some(file).filter(|file| file.len() as u64 == bytes)
    }

    /// Lets go what is more than so many bytes.
    pub(super) fn fit(&mut self, most_bytes: u64) {
        while self.bytes > most_bytes
            && let Some((_, file)) = self.files.pop_first()
        {
            self.bytes -= file.len() as u64;
        }
    }
}

/// All files with which a model is drawn so, and the packs in which they stand.
fn files_of(grade: Grade, model: &Model, stock: &impl Stock) -> Vec<FileRef> {
    let parts = grade.parts(model, stock);
    let files = parts.flat_map(|part| {
        let pack = part.pack.map(|pack| FileRef::object(&pack.url, pack.bytes));
        pack.into_iter().chain([part.file()])
    });
    files.collect()
}

impl<S: ByteSource + 'static> Explorer<S> {
    /// The first revision in which the scene was found to be published since; [`Event::Superseded`] tells when it is.
    #[must_use]
    pub fn newer_revision(&self) -> Option<Revision> {
        self.lookout.newer
    }

    /// Looks, beside all else, whether the scene was published anew; [`Explorer::advance`] tells if so. Caches on the way are asked
    /// first, so this may be done every few seconds. Where something of this revision is gone an explorer looks by itself, past them.
    pub fn look_for_newer(&mut self) {
        self.look(false);
    }

    /// An explorer of the revision in which the scene is published now, which stands nowhere yet; `None` where that is this one.
    /// Files and documents of the index that both share are not fetched again: the files count as memory of the new one as long as
    /// it has room for them. The old one may go on until all is there of the new one that is in sight, or be dropped at once.
    ///
    /// # Errors
    /// When the pointer, or the manifest that it names, cannot be fetched or read.
    pub async fn successor(&self) -> Result<Option<Self>, Error> {
        let Some(scene) = self.scene.newer().await? else {
            return Ok(None);
        };
        let mut successor = Self::new(scene, self.options);
        successor.inheritance = self.inheritance.with(&self.files);
        successor.manners = self.manners.clone();
        (successor.meter, successor.started) = (self.meter, self.started);
        successor.make_room();
        Ok(Some(successor))
    }

    /// Looks at the pointer where something is gone, unless that was done just now.
    pub(super) fn look_where_missed(&mut self) {
        let lookout = &mut self.lookout;
        lookout.has_missed |= self.scene.has_missed();
        let is_due = lookout.looked.is_none_or(|looked| looked.elapsed() >= LOOK_AGAIN);
        if lookout.has_missed && is_due {
            self.look(true);
        }
    }

    fn look(&mut self, past_caches: bool) {
        let lookout = &mut self.lookout;
        if lookout.newer.is_some() || lookout.is_looking {
            return;
        }
        lookout.is_looking = true;
        if past_caches {
            (lookout.has_missed, lookout.looked) = (false, Some(Instant::now()));
        }
        let scene = self.scene.clone();
        self.tasks.spawn(async move {
            // What a cache knows may be older than this revision.
            let found = match past_caches || !scene.is_current().await.unwrap_or(true) {
                true => scene.newer_revision().await,
                false => Ok(None),
            };
            Brought::Newer(found)
        });
    }

    /// Takes in what the pointer says. Who cannot look now, and has a reason to, does so later.
    pub(super) fn take_newer(&mut self, found: Result<Option<Revision>, Error>) {
        self.lookout.is_looking = false;
        self.lookout.has_missed |= found.is_err();
        let Ok(Some(revision)) = found else { return };
        self.lookout.newer = Some(revision);
        self.events.push(Event::Superseded(revision));
    }

    /// Takes in what is inherited of that.
    pub(super) fn inherit(&mut self, seen: &[Seen]) {
        if self.inheritance.bytes == 0 {
            return;
        }
        for model in seen.iter().map(|seen| &*seen.geometry) {
            for grade in Grade::all(model) {
                for file in files_of(grade, model, &self.planner.residency) {
                    self.inherit_file(&file, model);
                }
            }
        }
    }

    fn inherit_file(&mut self, file: &FileRef, model: &Model) {
        let key = file.name.key();
        let Some(bytes) = self.inheritance.take(key, file.bytes) else {
            return;
        };
        if let FileName::Rung(rung) = &file.name
            && self.spoils(rung, &bytes, model)
        {
            self.lose_damaged(rung, model);
        } else if !self.planner.is_here(key) {
            self.planner.residency.arrive(key, file.bytes);
            self.files.insert(key, bytes);
        }
    }

    /// What is inherited makes room for what is wanted.
    pub(super) fn make_room(&mut self) {
        let residency = &self.planner.residency;
        let taken_bytes = residency.bytes() + residency.asked_bytes();
        self.inheritance
            .fit(residency.limit_bytes().saturating_sub(taken_bytes));
    }
}
