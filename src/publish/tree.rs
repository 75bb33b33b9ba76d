//! How does a scene leave for a bucket or a plain web server? As the same tree that the server serves: blobs first,
//! then the scene's pointer, then the list of scenes, each replaced in one step. What the server cuts from a stored object,
//! the rungs of smooth LODs, are files here.

use anyhow::Context;
use belvedere_scene::{
    BlobName, SceneName,
    pointer::{Pointer, SceneList},
    rung::{RungName, SLOD},
    smooth::Header,
};

use super::{data::DataFolder, target::Target};
use crate::{
    page,
    published::{pointer_bytes, scene_list_bytes},
    store::{BlobStore, Coding},
};

/// The list of scenes, below the root.
const LIST: &str = "v1/scenes/index.json";

/// What was written.
#[derive(Debug, Default, serde::Serialize)]
pub(crate) struct TreeReport {
    pub(crate) scene: String,
    pub(crate) revision: String,
    pub(crate) blobs: u64,
    /// Blobs that were not there before.
    pub(crate) new_blobs: u64,
    pub(crate) bytes: u64,
    /// Files that are slices of these blobs, for caches that refuse ranges.
    pub(crate) rungs: u64,
}

/// Writes the tree of one scene's current revision; `wrote` hears of each blob.
pub(crate) async fn write(
    data: &DataFolder,
    scene: &SceneName,
    to: &Target,
    mut wrote: impl FnMut(u64, u64),
) -> anyhow::Result<TreeReport> {
    to.is_no_data_folder()?;
    let _no_gc = data.lock_for_writing().await?;
    // What was published while others wrote is what is to be written.
    let _alone = to.alone().await?;
    let pointer = data.baked(scene).await?.pointer;
    let blobs = data.catalogue().blobs_of(scene, pointer.revision).await?;
    let target = to.open_store().await?;
    for file in target.unfinished().await? {
        file.remove().await?;
    }
    let mut report = TreeReport {
        scene: scene.to_string(),
        revision: pointer.revision.to_string(),
        ..TreeReport::default()
    };
    for (done, (name, size)) in blobs.iter().enumerate() {
        let new = data
            .store()
            .copy_to(name, &target)
            .await
            .with_context(|| format!("cannot copy {name}"))?;
        report.blobs += 1;
        report.new_blobs += u64::from(new);
        report.bytes += size;
        if name.ext() == SLOD {
            report.rungs += write_rungs(data.store(), name, to).await?;
        }
        wrote(done as u64 + 1, blobs.len() as u64);
    }
    write_page(to).await?;
    target.sync().await?;
    to.replace(&format!("v1/scenes/{scene}/index.json"), &pointer_bytes(&pointer))
        .await?;
    let list = with_scene(read_list(to).await?, &pointer);
    to.replace(LIST, &scene_list_bytes(&list)).await?;
    Ok(report)
}

/// Writes the viewer's page; what its files name comes before them, as paths are in order.
async fn write_page(to: &Target) -> anyhow::Result<()> {
    for path in page::paths() {
        let forms = page::forms(path).await.expect("what is listed is there");
        for coding in Coding::ALL {
            if let Some(form) = forms.of(Some(coding)) {
                to.replace(&format!("{path}.{}", coding.file_suffix()), &form.bytes)
                    .await?;
            }
        }
        let identity = forms.of(None).expect("a file of the page is in memory");
        to.replace(path, &identity.bytes).await?;
    }
    Ok(())
}

/// Writes the rungs of a smooth LOD that are not there yet; gives how many it has.
async fn write_rungs(store: &BlobStore, name: &BlobName, to: &Target) -> anyhow::Result<u64> {
    let bytes = store.get(name).await?.with_context(|| format!("{name} is gone"))?;
    let header = Header::read(&bytes).with_context(|| format!("cannot read {name}"))?;
    let cuts = header.map_or(Vec::new(), |(header, _)| header.cuts);
    let mut from = 0;
    for (number, cut) in (0u8..).zip(&cuts) {
        let rung = RungName {
            hash: name.hash(),
            number,
        };
        let slice = bytes
            .get(from..cut.bytes as usize)
            .with_context(|| format!("{name} ends before its header says"))?;
        from = cut.bytes as usize;
        let path = format!("o/{}", rung.file_name());
        if to.read(&path).await?.is_none_or(|known| known != slice) {
            to.place(&path, slice).await?;
        }
    }
    Ok(cuts.len() as u64)
}

/// The list of a tree that may hold other scenes already.
async fn read_list(tree: &Target) -> anyhow::Result<SceneList> {
    match tree.read(LIST).await? {
        Some(bytes) => serde_json::from_slice(&bytes)
            .with_context(|| format!("{LIST} in {tree} is not a list of scenes; move it away to go on")),
        None => Ok(SceneList::default()),
    }
}

fn with_scene(mut list: SceneList, pointer: &Pointer) -> SceneList {
    list.scenes.retain(|summary| summary.scene != pointer.scene);
    list.scenes.push(pointer.summary());
    list.scenes.sort_by(|a, b| a.scene.cmp(&b.scene));
    list
}
