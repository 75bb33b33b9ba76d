//! How does a client get many coarsest levels with few requests? In packs, where most of a pack is wanted.

use std::collections::BTreeMap;

use belvedere_scene::{
    BlobName,
    object::{Level, PackRef},
};
use bytes::Bytes;

use crate::{
    ByteSource, Error, Scene,
    document::verified,
    strategy::{file::Key, order::Member, planner::WORTH_A_PACK},
};

/// Whether enough of these levels stand in a pack for it to be fetched whole.
pub(crate) fn is_worth(pack: &PackRef, wanted: &[&Level]) -> bool {
    let inside = |level: &&&Level| level.pack.as_ref().is_some_and(|other| other.url == pack.url);
    let files: BTreeMap<&BlobName, u64> = wanted.iter().filter(inside).map(|l| (&l.url, l.bytes)).collect();
    files.values().sum::<u64>() as f64 >= WORTH_A_PACK * pack.bytes as f64
}

impl<S: ByteSource> Scene<S> {
    /// The GLBs of some levels, in their order, each verified against the hash in its name. Levels that stand in a pack
    /// of which at least half is wanted come with that pack, or alone when it cannot be had.
    ///
    /// # Errors
    /// When one cannot be fetched or arrives damaged.
    pub async fn glbs(&self, levels: &[&Level]) -> Result<Vec<Bytes>, Error> {
        let files: BTreeMap<&BlobName, &Level> = levels.iter().map(|level| (&level.url, *level)).collect();
        // A pack that is not worth it, or cannot be had, is `None`: its levels come alone.
        let mut packs: BTreeMap<&BlobName, Option<Bytes>> = BTreeMap::new();
        let mut glbs: BTreeMap<&BlobName, Bytes> = BTreeMap::new();
        for (name, level) in files {
            let mut packed = None;
            if let Some(pack) = &level.pack {
                if !packs.contains_key(&pack.url) {
                    let whole = if is_worth(pack, levels) {
                        verified(self.source(), &pack.url, Some(pack.bytes)).await.ok()
                    } else {
                        None
                    };
                    packs.insert(&pack.url, whole);
                }
                packed = packs[&pack.url].as_ref().and_then(|whole| out_of(whole, pack, level));
            }
            let glb = match packed {
                Some(glb) => glb,
                None => verified(self.source(), name, Some(level.bytes)).await?,
            };
            glbs.insert(name, glb);
        }
        Ok(levels.iter().map(|level| glbs[&level.url].clone()).collect())
    }
}

/// A level's GLB out of its pack, if it is the right one.
fn out_of(whole: &Bytes, pack: &PackRef, level: &Level) -> Option<Bytes> {
    let member = Member {
        key: Key::from(&level.url),
        from: pack.from,
        bytes: level.bytes,
    };
    let glb = member.out_of(whole).filter(|glb| member.key.is_of(glb))?;
    Some(whole.slice_ref(glb))
}
