//! What have uploads left that ended early, and jobs that ended long ago?

use std::{
    collections::BTreeSet,
    path::Path,
    time::{Duration, SystemTime},
};

use anyhow::Context;

use super::Jobs;
use crate::db::{PATIENCE, in_time};

/// Jobs that ended so long ago are forgotten.
const REMEMBERED_DAYS: u32 = 30;
/// An upload without a job is a leftover when it has not grown for so long.
pub(super) const LEFTOVER: Duration = Duration::from_secs(3600);
/// Between two times that these are looked for; sooner where that has failed.
const TIDYING: Duration = Duration::from_secs(3600);
const TIDYING_AGAIN: Duration = Duration::from_secs(60);

/// Now and then removes what broken uploads have left here, and forgets jobs that ended long ago. Every server does, whether it
/// bakes or not.
pub(super) async fn tidy(jobs: &Jobs) {
    let mut told = None;
    loop {
        let failed = tidy_once(jobs).await.err().map(|error| format!("{error:#}"));
        // What stays wrong is told once.
        if let Some(error) = &failed
            && failed != told
        {
            tracing::warn!(error, "cannot remove what uploads have left that ended early");
        }
        told = failed;
        tokio::time::sleep(if told.is_some() { TIDYING_AGAIN } else { TIDYING }).await;
    }
}

async fn tidy_once(jobs: &Jobs) -> anyhow::Result<()> {
    let catalogue = &jobs.inner.catalogue;
    let asking = async {
        catalogue.forget_ended_jobs(REMEMBERED_DAYS).await?;
        catalogue.unfinished_jobs().await
    };
    let wanted = in_time(PATIENCE, asking)
        .await?
        .into_iter()
        .map(|stored| stored.job)
        .collect();
    let uploads = jobs.uploads();
    let removing = tokio::task::spawn_blocking(move || remove_leftovers(&uploads, &wanted));
    removing.await?
}

/// Removes those that can be; the first one that cannot is the error.
fn remove_leftovers(uploads: &Path, wanted: &BTreeSet<String>) -> anyhow::Result<()> {
    let entries = match std::fs::read_dir(uploads) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        entries => entries?,
    };
    let mut all = Ok(());
    for entry in entries {
        let entry = entry?;
        let name = entry.file_name();
        let wanted = name.to_str().is_some_and(|name| wanted.contains(name));
        if wanted {
            continue;
        }
        let removed = match last_change(&entry) {
            Ok(last) if last.elapsed().is_ok_and(|age| age > LEFTOVER) => std::fs::remove_dir_all(entry.path()),
            Ok(_) => Ok(()),
            Err(error) => Err(error),
        };
        match removed {
            // An upload that ended meanwhile has removed its own.
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                let failed = Err(error).with_context(|| format!("cannot remove {}", entry.path().display()));
                all = all.and(failed);
            }
            _ => {}
        }
    }
    all
}

/// When anything in an upload's folder was last written.
fn last_change(folder: &std::fs::DirEntry) -> std::io::Result<SystemTime> {
    let mut last = folder.metadata()?.modified()?;
    for file in std::fs::read_dir(folder.path())? {
        last = last.max(file?.metadata()?.modified()?);
    }
    Ok(last)
}

#[cfg(test)]
mod tests {
    use std::fs::File;

    use super::*;

    #[test]
    fn what_cannot_be_removed_keeps_nothing_else() {
        let uploads = tempfile::tempdir().unwrap();
        // A file is no upload, and what is in it cannot be listed.
        let strange: Vec<_> = (0..20).map(|i| uploads.path().join(format!("strange-{i}"))).collect();
        let left: Vec<_> = (0..20).map(|i| uploads.path().join(format!("left-{i}"))).collect();
        for (strange, left) in strange.iter().zip(&left) {
            std::fs::write(strange, "no folder").unwrap();
            std::fs::create_dir(left).unwrap();
            let folder = File::open(left).unwrap();
            folder.set_modified(SystemTime::now() - 2 * LEFTOVER).unwrap();
        }
        let error = remove_leftovers(uploads.path(), &BTreeSet::new()).unwrap_err();
        assert!(format!("{error:#}").contains("/strange-"), "{error:#}");
        assert!(left.iter().all(|folder| !folder.exists()) && strange.iter().all(|file| file.exists()));
    }
}
