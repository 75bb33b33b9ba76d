//! How does a bake become what is served? Blobs first, the pointer last.
//!
//! [`bake`] imports a file and writes its blobs into the data folder; the catalogue then moves the scene's pointer in
//! one transaction. A crash anywhere before leaves the old revision served and nothing but blobs that `gc` collects.

mod alone;
pub(crate) mod data;
mod found;
mod owner;
mod patience;
pub(crate) mod report;
pub(crate) mod rollback;
pub(crate) mod source_files;
pub(crate) mod target;
pub(crate) mod tree;

use std::{
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

use anyhow::Context;
use belvedere_bake::{
    BakeError, BakeSettings, Host, Source,
    import::{
        self, ImportError, Limits,
        procedural::{Ground, Sowing},
    },
    records::{BlobSink, SinkError, Written},
};
use belvedere_scene::{BlobHash, BlobName, SceneName};
use bytes::Bytes;

use self::{
    data::{DataFolder, DataLock},
    found::FoundFile,
    patience::{ANSWER, Patience, answered},
    report::Report,
    rollback::whole,
    source_files::{SourceFolder, TooLarge, find_named, read_named},
};
use crate::{
    db::{Claim, NewRevision, PREVIEW_OF},
    progress::BakeProgress,
    store::StoreError,
    worlds,
};

/// Changes whenever the same source would give other bytes than before, so that a newer build bakes again.
const BAKE_VERSION: u32 = 31;

/// So long a scene's name for people may be.
pub(crate) const MOST_TITLE_BYTES: usize = 200;

/// What to bake, and under which name.
#[derive(Debug)]
pub(crate) struct Request {
    pub(crate) scene: SceneName,
    pub(crate) title: Option<String>,
    pub(crate) input: BakeInput,
    /// What rules are given.
    pub(crate) sowing: Sowing,
    pub(crate) settings: BakeSettings,
    pub(crate) limits: Limits,
    /// Bake even when nothing has changed.
    pub(crate) again: bool,
    /// The job that this is, if any; published only as long as it is this server's.
    pub(crate) claim: Option<Claim>,
}

/// Where the source is.
#[derive(Debug, Clone)]
pub(crate) enum BakeInput {
    /// A file; what it refers to stands beside it.
    File(PathBuf),
    /// A file that is built into the program, as what it refers to is.
    BuiltIn(&'static str),
}

impl BakeInput {
    fn file_name(&self) -> String {
        match self {
            Self::File(path) => path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            Self::BuiltIn(file) => (*file).to_owned(),
        }
    }

    /// Fails when the main file is not there.
    pub(crate) fn find(&self) -> anyhow::Result<()> {
        match self {
            Self::File(path) => find_named(path).map(drop),
            Self::BuiltIn(_) => Ok(()),
        }
    }

    /// The main file, which may take what `limits` let the whole source take, and the folder beside it.
    fn read(&self, limits: &Limits) -> anyhow::Result<(Vec<u8>, SourceFolder)> {
        match self {
            Self::File(path) => {
                // By its name alone: where it lies on a server is nobody's business who uploaded it.
                let told = |error: anyhow::Error| match error.downcast::<TooLarge>() {
                    Ok(large) => anyhow::Error::from(large.of_file(self.file_name())),
                    Err(other) => other,
                };
                let bytes = read_named(path, (limits.memory_bytes, "--memory-mib")).map_err(told)?;
                Ok((bytes, SourceFolder::beside(path)))
            }
            Self::BuiltIn(file) => {
                let text = worlds::text(file).with_context(|| format!("{file} is not built in"))?;
                Ok((text.as_bytes().to_vec(), SourceFolder::built_in()))
            }
        }
    }
}

/// Of a text without an extension that does not look like anything else.
const TAKEN_FOR_RULES: &str =
    ", which was taken for rules; a floor plan is uploaded with `?format=plan`, or has a name that ends with .plan";

/// Whether a bake failed for what its source is, so that its author can mend it.
pub(crate) fn is_of_the_source(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        let of_the_bake = cause.downcast_ref::<BakeError>();
        let of_the_import = cause.downcast_ref::<ImportError>();
        of_the_import.is_some_and(|error| !matches!(error, ImportError::Cancelled))
            || cause.is::<TooLarge>()
            || of_the_bake.is_some_and(|error| matches!(error, BakeError::World(_) | BakeError::Author(_)))
    })
}

/// Hears of a first revision, with larger visible sets, that is served while the bake goes on.
pub(crate) type OnFirst = Box<dyn Fn(&Report) + Send + Sync>;

/// Bakes and publishes; does nothing when the current revision was made from the same files with the same settings.
/// Where somebody wants to hear of it, a first revision is published long before the bake is done.
pub(crate) async fn bake(
    data: &DataFolder,
    request: Request,
    progress: Arc<BakeProgress>,
    on_first: Option<OnFirst>,
) -> anyhow::Result<Report> {
    let patience = Patience::new(progress.clone());
    let no_gc = patience.wait(|| data.lock_for_writing()).await?;
    let not_ours = patience.wait(|| data.own_new_store()).await?;
    let key = source_key(&request);
    if !request.again
        && let Some(mut report) = patience.wait(|| unchanged(data, &request, &key)).await?
    {
        report.notes.extend(not_ours);
        return Ok(report);
    }
    let found = FoundFile::open(&data.bakes(), &request.scene);
    let publisher = Publisher {
        data: data.clone(),
        handle: tokio::runtime::Handle::current(),
        scene: request.scene.clone(),
        claim: request.claim.clone(),
        key,
        no_gc,
        patience,
    };
    tokio::task::spawn_blocking(move || {
        let mut report = run(request, &publisher, &found, &progress, on_first.as_ref())?;
        report.notes.extend(not_ours);
        report.notes.extend(
            found
                .finish()
                .err()
                .map(|cause| format!("what was found could not be kept, so the next bake starts anew: {cause}")),
        );
        Ok(report)
    })
    .await?
}

/// Imports, bakes and publishes, on a thread that may wait.
fn run(
    request: Request,
    publisher: &Publisher,
    found: &FoundFile,
    progress: &BakeProgress,
    on_first: Option<&OnFirst>,
) -> anyhow::Result<Report> {
    let file_name = request.input.file_name();
    let (bytes, files) = request.input.read(&request.limits)?;
    let main_file = (file_name.clone(), BlobHash::of(&bytes).to_string());
    let main_bytes = bytes.len() as u64;
    let ground = Ground {
        files: &files,
        limits: &request.limits,
        progress,
    };
    let told_name = source_files::told_apart(&file_name, &bytes).into_owned();
    let guessed = told_name != file_name && told_name.ends_with(".dcg");
    let imported = import::import_sown(&told_name, bytes, &request.sowing, ground).with_context(|| {
        let guess = if guessed { TAKEN_FOR_RULES } else { "" };
        format!("cannot import {file_name}{guess}")
    })?;
    let read = files.into_read();
    let title = request
        .title
        .or_else(|| imported.scene.title.as_deref().and_then(one_line))
        .unwrap_or_else(|| {
            Path::new(&file_name)
                .file_stem()
                .unwrap_or_default()
                .to_string_lossy()
                .chars()
                .filter(|c| !c.is_control())
                .collect()
        });
    let source = Source {
        scene: imported.scene,
        title,
        bytes: main_bytes + read.iter().map(|file| file.bytes).sum::<u64>(),
    };
    let sources: Vec<_> = std::iter::once(main_file)
        .chain(read.into_iter().map(|f| (f.name, known(f.hash))))
        .collect();
    let mut defects = imported.defects;
    let first = |written: &Written| {
        // Under another key, so that whoever bakes next goes on.
        let report = publisher
            .publish(
                &format!("{PREVIEW_OF}{}", publisher.key),
                written,
                &sources,
                Report::of(&publisher.scene, written, Vec::new(), progress),
            )
            .map_err(|cause| SinkError {
                name: written.manifest_name.clone(),
                cause: cause.reallocate_into_boxed_dyn_error_without_backtrace(),
            })?;
        if let Some(hear) = on_first {
            hear(&report);
        }
        Ok(())
    };
    let host = Host {
        sink: publisher,
        memory: found,
        progress,
        first: on_first.is_some().then_some(&first as _),
    };
    let written = belvedere_bake::bake(source, &request.settings, &mut defects, &host)?;
    let defects: Vec<_> = defects.iter().collect();
    publisher.publish(
        &publisher.key,
        &written,
        &sources,
        Report::of(&publisher.scene, &written, defects, progress),
    )
}

/// Puts blobs into the store and moves the scene's pointer, for a bake that knows nothing of either.
struct Publisher {
    data: DataFolder,
    handle: tokio::runtime::Handle,
    scene: SceneName,
    claim: Option<Claim>,
    /// Everything but the files that decides the result.
    key: String,
    /// As long as blobs are written, even when nobody waits for it any more.
    no_gc: DataLock,
    patience: Patience,
}

impl Publisher {
    fn publish(
        &self,
        key: &str,
        written: &Written,
        sources: &[(String, String)],
        report: Report,
    ) -> anyhow::Result<Report> {
        let new = NewRevision {
            pointer: &written.pointer(self.scene.clone()),
            source_key: key,
            sources,
            report: &serde_json::to_value(&report)?,
            blobs: &written.blobs,
            claim: self.claim.as_ref(),
        };
        let published = async {
            // Not tried again: what could not be written out may be lost, and a system says so once.
            self.data.store().sync().await?;
            self.patience.wait(|| self.move_pointer(&new)).await
        };
        self.handle
            .block_on(published)
            .context("cannot move the scene's pointer; the old revision stays")?;
        Ok(report)
    }

    async fn move_pointer(&self, new: &NewRevision<'_>) -> anyhow::Result<()> {
        if !self.data.still_locked(&self.no_gc).await? {
            // Somebody may have collected what no revision named yet.
            match whole(self.data.store(), new.blobs).await {
                Err(cause @ StoreError::Missing(_)) => {
                    let gone = "blobs were collected while the catalogue was away; bake again";
                    return Err(anyhow::Error::from(cause).context(gone));
                }
                found => found?,
            }
        }
        // Its time grows with what is written: a millisecond a blob is a slow database.
        let patience = ANSWER + Duration::from_millis(new.blobs.len() as u64);
        answered(patience, self.data.catalogue().publish(new)).await
    }
}

impl BlobSink for Publisher {
    fn put(&self, name: &BlobName, bytes: Vec<u8>) -> Result<(), SinkError> {
        let bytes = Bytes::from(bytes);
        let putting = || {
            let bytes = bytes.clone();
            async move { Ok(self.data.store().put(name, bytes).await?) }
        };
        let put = self.handle.block_on(self.patience.wait(putting));
        put.map(drop).map_err(|cause| SinkError {
            name: name.clone(),
            cause: cause.reallocate_into_boxed_dyn_error_without_backtrace(),
        })
    }
}

/// Everything but the files that decides the result.
fn source_key(request: &Request) -> String {
    let settings = format!(
        "{BAKE_VERSION} {:?} {:?} {:?} {:?}",
        request.title, request.sowing, request.settings, request.limits
    );
    BlobHash::of(settings.as_bytes()).to_string()
}

/// The report of the current revision, when baking again would give the same one.
async fn unchanged(data: &DataFolder, request: &Request, key: &str) -> anyhow::Result<Option<Report>> {
    let Some(baked) = answered(ANSWER, data.catalogue().baked(&request.scene)).await? else {
        return Ok(None);
    };
    if baked.source_key != key || !same_files(request, &baked.sources)? {
        return Ok(None);
    }
    let asking = data.catalogue().blobs_of(&request.scene, baked.pointer.revision);
    let blobs = answered(ANSWER, asking).await?;
    match whole(data.store(), &blobs).await {
        Ok(()) => {}
        Err(StoreError::Missing(_)) => return Ok(None),
        Err(cause) => return Err(cause.into()),
    }
    let report: Report = serde_json::from_value(baked.report)?;
    Ok(Some(Report {
        unchanged: true,
        ..report
    }))
}

fn same_files(request: &Request, sources: &[(String, String)]) -> anyhow::Result<bool> {
    let Some(((main, main_hash), beside)) = sources.split_first() else {
        return Ok(false);
    };
    let (bytes, files) = request.input.read(&request.limits)?;
    if *main != request.input.file_name() || *main_hash != BlobHash::of(&bytes).to_string() {
        return Ok(false);
    }
    Ok(beside.iter().all(|(name, hash)| known(files.hash_of(name)) == *hash))
}

/// A title that a file gives itself, as one that is given with it must be; none where nothing is left.
fn one_line(title: &str) -> Option<String> {
    let title: String = title.chars().filter(|c| !c.is_control()).collect();
    let title = title.trim();
    let title = &title[..title.floor_char_boundary(MOST_TITLE_BYTES)];
    (!title.is_empty()).then(|| title.to_owned())
}

/// How the catalogue notes a file: its hash, or that it could not be read.
fn known(hash: Option<BlobHash>) -> String {
    hash.map_or_else(|| "absent".to_owned(), |hash| hash.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_title_is_one_line_that_controls_nothing() {
        assert_eq!(one_line("A town").as_deref(), Some("A town"));
        assert_eq!(
            one_line("\u{1b}]0;owned\u{7} town\n\u{9b}").as_deref(),
            Some("]0;owned town")
        );
        assert_eq!(one_line(" \n\u{1b} "), None);
        let long = one_line(&"é".repeat(MOST_TITLE_BYTES)).unwrap();
        assert_eq!(long.len(), MOST_TITLE_BYTES);
    }
}
