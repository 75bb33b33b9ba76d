//! How does a request of the planner become bytes that can be believed? An object is verified against its name. Rungs come
//! from their own addresses, or as ranges of their stream where a tree has no such addresses, and are compared with its
//! hash when all have come. A server that answers a range with all of the stream has given all of its rungs, and is asked for no range of
//! another: for what one rung costs there, levels are the better buy. What does not come in a bundle as it should comes alone.

use std::{
    collections::BTreeMap,
    ops::Range,
    sync::{
        Arc, Mutex, MutexGuard,
        atomic::{AtomicBool, Ordering},
    },
};

use belvedere_scene::{
    BlobHash, BlobHasher, bundle as format,
    rung::{RungName, SmoothLod},
};
use bytes::Bytes;
use tokio::sync::OwnedMutexGuard;

use crate::{
    Ask, ByteSource, Error, Part, Scene,
    document::as_promised,
    source::{part_of, unwatched},
    strategy::{
        bundles,
        file::{FileName, FileRef, StreamRef},
        order::Order,
    },
};

/// How a tree was found to answer. Where ranges are ignored it keeps the last stream that came whole, which no budget of memory counts.
#[derive(Debug, Default)]
pub(crate) struct Manners {
    /// Whether rungs have no addresses of their own.
    no_rungs: AtomicBool,
    ranges: Mutex<Ranges>,
    /// Who is asking how ranges are answered, and for which streams as a whole: others who want the same wait for that.
    asking: Mutex<BTreeMap<Option<BlobHash>, Arc<tokio::sync::Mutex<()>>>>,
    /// A bundle was not what it should be.
    bundles_refused: AtomicBool,
}

/// How a server answers who asks for a range. As long as nobody knows, one asks at a time; streams that come whole do not wait for each other.
#[derive(Debug, Default)]
enum Ranges {
    #[default]
    Unknown,
    /// With that.
    Kept,
    /// With all of the stream: this is the last that came so, for who wants another rung of it at the same time.
    Ignored(BlobHash, Bytes),
    /// With something else.
    Refused,
}

impl Manners {
    pub(crate) fn bundles_refused(&self) -> bool {
        self.bundles_refused.load(Ordering::Relaxed)
    }

    /// Held for a moment, and never while an answer is waited for.
    fn ranges(&self) -> MutexGuard<'_, Ranges> {
        self.ranges.lock().expect("nothing panics while it holds this lock")
    }

    /// Waits until nobody else asks for a stream as a whole, or, without one, how ranges are answered.
    async fn turn(&self, stream: Option<BlobHash>) -> OwnedMutexGuard<()> {
        let turn = {
            let mut asking = self.asking.lock().expect("nothing panics while it holds this lock");
            asking.retain(|_, turn| Arc::strong_count(turn) > 1);
            asking.entry(stream).or_default().clone()
        };
        turn.lock_owned().await
    }
}

/// Who looks at files while they come ([`crate::Watch`]).
pub(crate) type WatchFiles<'a> = dyn FnMut(&FileRef, &[u8]) + Send + 'a;

/// What came of an order.
#[derive(Default)]
pub(crate) struct Fetched {
    /// Each is here or has its own error.
    pub(crate) files: Vec<(FileRef, Result<Bytes, Error>)>,
    /// After which share of the bundle each of them was here, if it came in one.
    pub(crate) shares: Vec<Option<f64>>,
    /// What came although nobody had asked for it: other rungs of a stream that came whole.
    pub(crate) beside: Vec<(FileRef, Bytes)>,
    /// Bytes that a line had to carry: none of what was kept …
    pub(crate) carried: u64,
    /// … and how many of these could not be used.
    pub(crate) failed: u64,
    /// Bytes of members that came right in a bundle that broke off: a line carried them too, though its answer is an error.
    pub(crate) saved: u64,
    /// What there is to be said of the server.
    pub(crate) notes: Vec<Error>,
}

/// Fetches all files of an order. `streams` says what is known of the stream of a rung. Of objects that come alone, and of members of a
/// bundle, one can `watch` what is here, before it is verified.
pub(crate) async fn fetch<S: ByteSource>(
    scene: &Scene<S>,
    manners: &Manners,
    order: &Order,
    streams: impl Fn(&RungName) -> Option<StreamRef>,
    watch: &mut WatchFiles<'_>,
) -> Fetched {
    let mut fetched = Fetched::default();
    let together = match &order.files[..] {
        [_] => vec![None],
        files => members(scene, manners, order, files, &mut fetched, watch).await,
    };
    for (file, member) in order.files.iter().zip(together) {
        let (bytes, share) = match member {
            Some((bytes, share)) => (Ok(bytes), share),
            None => {
                let known = fetched.beside.iter().position(|(beside, _)| beside.name == file.name);
                let came = match known {
                    Some(at) => Ok(fetched.beside.swap_remove(at).1),
                    None => alone(scene, manners, file, &streams, &mut fetched, watch).await,
                };
                (came, None)
            }
        };
        fetched.files.push((file.clone(), bytes));
        fetched.shares.push(share);
    }
    fetched
}

/// A file that did not come alone, and after which share of its bundle it was here, if it came in one.
type Member = Option<(Bytes, Option<f64>)>;

/// The files of a bundle that are kept already, and those of what is left of it that came as they should.
async fn members<S: ByteSource>(
    scene: &Scene<S>,
    manners: &Manners,
    order: &Order,
    files: &[FileRef],
    fetched: &mut Fetched,
    watch: &mut WatchFiles<'_>,
) -> Vec<Member> {
    let mut found = Vec::with_capacity(files.len());
    for file in files {
        let kept = scene.source().kept(&file.name.path(), file.bytes).await;
        found.push(kept.filter(|bytes| is_right(file, bytes)).map(|bytes| (bytes, None)));
    }
    let away = files.iter().zip(&found).filter(|(_, kept)| kept.is_none());
    let rest = Order {
        files: away.map(|(file, _)| file.clone()).collect(),
        wish: order.wish,
    };
    if rest.files.len() >= 2 {
        let came = bundle(scene, manners, &rest, fetched, watch).await;
        let missing = found.iter_mut().filter(|file| file.is_none());
        missing.zip(came).for_each(|(file, came)| *file = came);
    }
    found
}

/// Whether bytes are a file, as far as they tell by themselves.
pub(crate) fn is_right(file: &FileRef, bytes: &[u8]) -> bool {
    bytes.len() as u64 == file.bytes && file.name.may_be(bytes)
}

/// The members of a bundle, those that came as they should, also where it broke off; each can be seen as soon as it is here.
async fn bundle<S: ByteSource>(
    scene: &Scene<S>,
    manners: &Manners,
    order: &Order,
    fetched: &mut Fetched,
    watch: &mut WatchFiles<'_>,
) -> Vec<Member> {
    let path = order.path();
    let (count, bytes) = (order.files.len(), bundles::bytes_of(&order.files));
    let (mut given, mut saved) = (0, vec![None; count]);
    let mut look = |so_far: &[u8]| {
        let places = format::places(so_far, count).unwrap_or_default();
        for (file, place) in order.files.iter().zip(places).skip(given) {
            let Some(member) = so_far.get(place) else { break };
            given += 1;
            if is_right(file, member) {
                saved[given - 1] = Some((Bytes::copy_from_slice(member), None));
                watch(file, member);
            }
        }
    };
    let ask = Ask::of(&path).having(Some(bytes));
    let answer = scene.source().get_watched(ask, &mut look).await;
    let (members, carried) = match &answer {
        Ok((bytes, carried)) => (
            format::whole_places(bytes, count).map(|places| (bytes, places)),
            *carried,
        ),
        Err(_) => (None, 0),
    };
    fetched.carried += carried;
    let passes = answer.as_ref().is_err_and(Error::is_transient);
    let Some((answer, places)) = members else {
        // What the server cannot answer so once, it is not asked so again.
        manners.bundles_refused.fetch_or(!passes, Ordering::Relaxed);
        let mut saved_bytes = 0;
        for (file, member) in order.files.iter().zip(&saved) {
            if let Some((member, _)) = member {
                scene.source().keep(&file.name.path(), member).await;
                saved_bytes += member.len() as u64;
            }
        }
        fetched.failed += carried.saturating_sub(saved_bytes);
        fetched.saved += if answer.is_err() { saved_bytes } else { 0 };
        return saved;
    };
    let (mut right, mut to) = (Vec::with_capacity(count), bytes);
    to -= order.files.iter().map(|file| file.bytes).sum::<u64>();
    for (file, place) in order.files.iter().zip(places) {
        // A copy, so that what stays does not keep the others in memory.
        let member = Bytes::copy_from_slice(&answer[place]);
        to += member.len() as u64;
        if is_right(file, &member) {
            scene.source().keep(&file.name.path(), &member).await;
            right.push(Some((member, Some((to as f64 / bytes as f64).min(1.0)))));
        } else {
            fetched.failed += (member.len() as u64).min(carried);
            right.push(None);
        }
    }
    right
}

async fn alone<S: ByteSource>(
    scene: &Scene<S>,
    manners: &Manners,
    file: &FileRef,
    streams: impl Fn(&RungName) -> Option<StreamRef>,
    fetched: &mut Fetched,
    watch: &mut WatchFiles<'_>,
) -> Result<Bytes, Error> {
    let before = fetched.carried;
    let came = match &file.name {
        FileName::Object(name) => {
            let mut watch = |so_far: &[u8]| watch(file, so_far);
            let url = name.url();
            let ask = Ask::of(&url).having(Some(file.bytes));
            let (bytes, carried) = scene.source().get_watched(ask, &mut watch).await?;
            fetched.carried += carried;
            as_promised(name, bytes)
        }
        FileName::Rung(rung) => rung_of(scene, manners, rung, file.bytes, streams(rung), fetched).await,
    };
    let right = came.and_then(|bytes| match bytes.len() as u64 {
        found if found == file.bytes => Ok(bytes),
        found => Err(Error::Length {
            path: file.name.path(),
            found,
            expected: file.bytes,
        }),
    });
    if right.is_err() {
        fetched.failed += fetched.carried - before;
    }
    right
}

/// A rung from its own address, or as a part of its stream.
async fn rung_of<S: ByteSource>(
    scene: &Scene<S>,
    manners: &Manners,
    rung: &RungName,
    bytes: u64,
    stream: Option<StreamRef>,
    fetched: &mut Fetched,
) -> Result<Bytes, Error> {
    let path = rung.to_string();
    let mut answer = Err(Error::Missing(path.clone()));
    if !manners.no_rungs.load(Ordering::Relaxed) {
        let ask = Ask::of(&path).having(Some(bytes));
        answer = scene.source().get_watched(ask, &mut unwatched).await;
    }
    match answer {
        Ok((bytes, carried)) => {
            fetched.carried += carried;
            Ok(bytes)
        }
        Err(cause @ (Error::Missing(_) | Error::Refused { .. })) => {
            let place = stream.as_ref().and_then(|stream| stream.place(rung.number));
            match stream.zip(place) {
                Some((stream, place)) => range_of(scene, manners, rung, place, &stream, fetched, cause).await,
                None => Err(cause),
            }
        }
        Err(cause) => Err(cause),
    }
}

/// A rung as a part of its stream; with `absent` where no parts can be had.
async fn range_of<S: ByteSource>(
    scene: &Scene<S>,
    manners: &Manners,
    rung: &RungName,
    place: Range<u64>,
    stream: &StreamRef,
    fetched: &mut Fetched,
    absent: Error,
) -> Result<Bytes, Error> {
    let name = rung.whole();
    let url = name.url();
    let mut turn: Option<(Option<BlobHash>, OwnedMutexGuard<()>)> = None;
    let ignores = loop {
        let asks = match &*manners.ranges() {
            Ranges::Refused => return Err(absent),
            Ranges::Kept => {
                drop(turn.take());
                break false;
            }
            Ranges::Ignored(hash, whole) if *hash == rung.hash => return copy_of(&url, whole, place),
            Ranges::Ignored(..) if !stream.is_needed => return Err(Error::Whole(name)),
            Ranges::Ignored(..) => Some(rung.hash),
            Ranges::Unknown => None,
        };
        // Who had to wait looks again at what is known by then.
        if turn.take_if(|(of, _)| *of != asks).is_none() && turn.is_some() {
            break asks.is_some();
        }
        turn = Some((asks, manners.turn(asks).await));
    };
    let ask = Ask::of(&url).having(stream.ends.last().copied());
    let answer = match ignores {
        false => scene.source().get_range(ask, place.clone()).await,
        true => {
            let whole = scene.source().get_watched(ask, &mut unwatched).await;
            whole.map(|(whole, carried)| (Part::Whole(whole), carried))
        }
    };
    if let Err(Error::Range { .. }) = &answer {
        *manners.ranges() = Ranges::Refused;
    }
    let (part, carried) = answer?;
    fetched.carried += carried;
    manners.no_rungs.store(true, Ordering::Relaxed);
    match part {
        Part::Asked(bytes) => {
            let mut known = manners.ranges();
            // What was kept on disk says nothing of the server, and who ignored a range once is asked for no other.
            if carried > 0 && !matches!(&*known, Ranges::Ignored(..)) {
                *known = Ranges::Kept;
            }
            Ok(bytes)
        }
        Part::Whole(whole) => {
            let whole = as_promised(&name, whole)?;
            fetched.beside.extend(rungs_of(rung, stream, &whole));
            let ignored = Ranges::Ignored(rung.hash, whole.clone());
            let before = std::mem::replace(&mut *manners.ranges(), ignored);
            if !matches!(before, Ranges::Ignored(..)) {
                fetched.notes.push(Error::Whole(name));
            }
            copy_of(&url, &whole, place)
        }
    }
}

/// A part of a stream that is here whole: a copy, so that what stays does not keep the others in memory.
fn copy_of(url: &str, whole: &Bytes, place: Range<u64>) -> Result<Bytes, Error> {
    part_of(url, whole, place).map(|bytes| Bytes::copy_from_slice(&bytes))
}

/// The other rungs of a stream that is here whole.
fn rungs_of(rung: &RungName, stream: &StreamRef, whole: &Bytes) -> Vec<(FileRef, Bytes)> {
    let others = (0..=u8::MAX)
        .zip(&stream.ends)
        .filter(|(number, _)| *number != rung.number);
    let other = |number: u8| {
        let place = stream.place(number)?;
        let bytes = copy_of("", whole, place).ok()?;
        let name = FileName::Rung(RungName {
            hash: rung.hash,
            number,
        });
        let file = FileRef {
            name,
            bytes: bytes.len() as u64,
        };
        Some((file, bytes))
    };
    others.filter_map(|(number, _)| other(number)).collect()
}

/// Whether the rungs of a smooth LOD are what its name promises; `None` while one of them is not here.
pub(crate) fn is_as_named<'a>(smooth: &SmoothLod, here: impl Fn(&RungName) -> Option<&'a Bytes>) -> Option<bool> {
    let rungs: Option<Vec<_>> = smooth.rungs.iter().map(|rung| here(&rung.url)).collect();
    let mut hasher = BlobHasher::default();
    rungs?.into_iter().for_each(|rung| hasher.update(rung));
    Some(hasher.finish() == smooth.url.hash())
}

#[cfg(test)]
mod tests;
