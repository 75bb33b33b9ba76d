//! How does a request of the planner become bytes that can be believed? An object is verified against its name. Rungs come
//! from their own addresses, or as ranges of their stream where a tree has no such addresses, and are compared with its
//! hash when all have come. What does not come in a bundle as it should comes alone.

use std::{
    collections::{BTreeMap, HashMap},
    sync::atomic::{AtomicBool, Ordering},
};

use belvedere_scene::{BlobHash, object::Model, rung::RungName};
use bytes::Bytes;

use crate::{
    Ask, ByteSource, Error, Scene,
    document::as_promised,
    source::unwatched,
    strategy::{
        bundles,
        file::{FileName, FileRef},
        order::Order,
    },
};

/// How a tree was found to answer.
#[derive(Debug, Default)]
pub(crate) struct Manners {
    /// Rungs have no addresses of their own.
    ranges: AtomicBool,
    /// A range was answered with something else.
    ranges_refused: AtomicBool,
    /// A bundle was not what it should be.
    bundles_refused: AtomicBool,
}

impl Manners {
    pub(crate) fn bundles_refused(&self) -> bool {
        self.bundles_refused.load(Ordering::Relaxed)
    }
}

/// Who looks at files while they come ([`crate::Watch`]).
pub(crate) type WatchFiles<'a> = dyn FnMut(&FileRef, &[u8]) + Send + 'a;

/// What came of an order.
pub(crate) struct Fetched {
    /// Each is here or has its own error.
    pub(crate) files: Vec<(FileRef, Result<Bytes, Error>)>,
    /// Bytes that a line had to carry: none of what was kept.
    pub(crate) carried: u64,
}

/// Fetches all files of an order. `ends` says at which byte of its stream a rung ends. Of objects that come alone one can `watch` what
/// is here, before it is verified.
pub(crate) async fn fetch<S: ByteSource>(
    scene: &Scene<S>,
    manners: &Manners,
    order: &Order,
    ends: impl Fn(&RungName) -> Option<u64>,
    watch: &mut WatchFiles<'_>,
) -> Fetched {
    let mut files = Vec::with_capacity(order.files.len());
    let (together, mut carried) = match &order.files[..] {
        [_] => (vec![None], 0),
        files => members(scene, manners, order, files).await,
    };
    for (file, member) in order.files.iter().zip(together) {
        let bytes = match member {
            Some(bytes) => Ok(bytes),
            None => alone(scene, manners, file, &ends, watch).await.map(|(bytes, came)| {
                carried += came;
                bytes
            }),
        };
        files.push((file.clone(), bytes));
    }
    Fetched { files, carried }
}

/// The files of a bundle that are kept already, and those of what is left of it that came as they should; what a line carried of these.
async fn members<S: ByteSource>(
    scene: &Scene<S>,
    manners: &Manners,
    order: &Order,
    files: &[FileRef],
) -> (Vec<Option<Bytes>>, u64) {
    let mut found = Vec::with_capacity(files.len());
    for file in files {
        let kept = scene.source().kept(&file.name.path(), file.bytes).await;
        found.push(kept.filter(|bytes| is_right(file, bytes)));
    }
    let away = files.iter().zip(&found).filter(|(_, kept)| kept.is_none());
    let rest = Order {
        files: away.map(|(file, _)| file.clone()).collect(),
        wish: order.wish,
    };
    if rest.files.len() < 2 {
        return (found, 0);
    }
    let (came, carried) = bundle(scene, manners, &rest).await;
    let missing = found.iter_mut().filter(|file| file.is_none());
    missing.zip(came).for_each(|(file, came)| *file = came);
    (found, carried)
}

/// Whether bytes are a file, as far as they tell by themselves.
fn is_right(file: &FileRef, bytes: &Bytes) -> bool {
    bytes.len() as u64 == file.bytes && file.name.may_be(bytes)
}

/// The members of a bundle, those that came as they should; what a line carried of it.
async fn bundle<S: ByteSource>(scene: &Scene<S>, manners: &Manners, order: &Order) -> (Vec<Option<Bytes>>, u64) {
    let path = order.path();
    let ask = Ask::of(&path).having(Some(bundles::bytes_of(&order.files)));
    let answer = scene.source().get_watched(ask, &mut unwatched).await;
    let count = order.files.len();
    let (members, carried) = match &answer {
        Ok((bytes, carried)) => (bundles::members_of(bytes, count), *carried),
        Err(_) => (None, 0),
    };
    let passes = answer.as_ref().is_err_and(Error::is_transient);
    let Some(members) = members else {
        // What the server cannot answer so once, it is not asked so again.
        manners.bundles_refused.fetch_or(!passes, Ordering::Relaxed);
        return (vec![None; count], carried);
    };
    let mut right = Vec::with_capacity(count);
    for (file, bytes) in order.files.iter().zip(members) {
        let right_bytes = Some(bytes).filter(|bytes| is_right(file, bytes));
        if let Some(bytes) = &right_bytes {
            scene.source().keep(&file.name.path(), bytes).await;
        }
        right.push(right_bytes);
    }
    (right, carried)
}

async fn alone<S: ByteSource>(
    scene: &Scene<S>,
    manners: &Manners,
    file: &FileRef,
    ends: impl Fn(&RungName) -> Option<u64>,
    watch: &mut WatchFiles<'_>,
) -> Result<(Bytes, u64), Error> {
    let (bytes, carried) = match &file.name {
        FileName::Object(name) => {
            let mut watch = |so_far: &[u8]| watch(file, so_far);
            let url = name.url();
            let ask = Ask::of(&url).having(Some(file.bytes));
            let (bytes, carried) = scene.source().get_watched(ask, &mut watch).await?;
            (as_promised(name, bytes)?, carried)
        }
        FileName::Rung(rung) => rung_of(scene, manners, rung, file.bytes, ends(rung)).await?,
    };
    if bytes.len() as u64 == file.bytes {
        return Ok((bytes, carried));
    }
    Err(Error::Length {
        path: file.name.path(),
        found: bytes.len() as u64,
        expected: file.bytes,
    })
}

/// A rung from its own address, or so many bytes of its stream up to where it ends; and what a line carried of it.
async fn rung_of<S: ByteSource>(
    scene: &Scene<S>,
    manners: &Manners,
    rung: &RungName,
    bytes: u64,
    end: Option<u64>,
) -> Result<(Bytes, u64), Error> {
    let path = rung.to_string();
    let mut answer = Err(Error::Missing(path.clone()));
    if !manners.ranges.load(Ordering::Relaxed) {
        let ask = Ask::of(&path).having(Some(bytes));
        answer = scene.source().get_watched(ask, &mut unwatched).await;
    }
    if matches!(answer, Err(Error::Missing(_) | Error::Refused { .. }))
        && !manners.ranges_refused.load(Ordering::Relaxed)
        && let Some(to) = end
    {
        let range = to.saturating_sub(bytes)..to;
        answer = scene.source().get_range(&rung.whole().url(), range).await;
        manners.ranges.fetch_or(answer.is_ok(), Ordering::Relaxed);
        let is_wrong = matches!(answer, Err(Error::Range { .. }));
        manners.ranges_refused.fetch_or(is_wrong, Ordering::Relaxed);
    }
    answer
}

/// Rungs that have come, until their streams are whole.
#[derive(Debug, Default)]
pub(crate) struct Streams {
    rungs: HashMap<BlobHash, BTreeMap<u8, Bytes>>,
}

impl Streams {
    /// Takes in a rung of a model; answers whether the stream is whole now, and right or wrong.
    pub(crate) fn take(&mut self, rung: &RungName, bytes: Bytes, model: &Model) -> Option<bool> {
        let smooth = model.smooth.as_ref()?;
        let known = self.rungs.entry(rung.hash).or_default();
        known.insert(rung.number, bytes);
        if known.len() < smooth.rungs.len() {
            return None;
        }
        let whole: Vec<u8> = self.rungs.remove(&rung.hash)?.into_values().flatten().collect();
        Some(smooth.url.is_of(&whole))
    }

    /// Forgets what has come of a stream.
    pub(crate) fn forget(&mut self, stream: BlobHash) {
        self.rungs.remove(&stream);
    }
}
