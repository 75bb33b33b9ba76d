//! Who writes into the folder of a tree? One at a time, as each reads the list of scenes and writes it anew with its own; so
//! what is there half done when one begins is nobody's.

use std::{
    collections::BTreeSet,
    fs::{self, File},
    io::ErrorKind,
    path::{Path, PathBuf},
};

use anyhow::Context;

use crate::page;

/// Stays in the folder, empty.
const LOCK: &str = ".belvedere-publish.lock";

/// Waits until nobody else writes a tree into this folder, which is made when it is not there; holds as long as the file is open.
/// Then removes what those have left that were broken off.
pub(super) async fn alone_in(folder: &Path) -> anyhow::Result<File> {
    let root = folder.to_owned();
    let waiting = move || {
        fs::create_dir_all(&root)?;
        let file = File::options()
            .create(true)
            .truncate(false)
            .write(true)
            .open(root.join(LOCK))?;
        match file.lock() {
            // Some file systems of other machines have no locks.
            Err(error) if has_no_locks(&error) => {
                tracing::warn!(%error, folder = %root.display(), "cannot be locked: see that nobody else publishes into it now");
            }
            locked => {
                locked?;
                remove_left(&root)?;
            }
        }
        std::io::Result::Ok(file)
    };
    let waited = tokio::task::spawn_blocking(waiting).await?;
    waited.with_context(|| format!("cannot write into {} alone", folder.display()))
}

/// Whether the file system of a folder has no locks, or, of another machine, none that answer.
pub(super) fn has_no_locks(error: &std::io::Error) -> bool {
    #[cfg(unix)]
    let not_there = error.raw_os_error() == Some(rustix::io::Errno::NOLCK.raw_os_error());
    #[cfg(not(unix))]
    let not_there = false;
    not_there || error.kind() == ErrorKind::Unsupported
}

fn remove_left(root: &Path) -> std::io::Result<()> {
    let scenes = root.join("v1/scenes");
    let ours: BTreeSet<PathBuf> = page::paths().map(|path| root.join(path)).collect();
    let mut folders: BTreeSet<PathBuf> = ours.iter().filter_map(|path| Some(path.parent()?.to_owned())).collect();
    folders.extend([root.join("o"), scenes.clone()]);
    folders.extend(entries(&scenes)?);
    for folder in folders {
        for path in entries(&folder)? {
            let Some(whole) = shall_become(&path) else { continue };
            let is_page = ours.contains(&whole) || ours.contains(&whole.with_extension(""));
            if is_page || folder.starts_with(&scenes) || folder == root.join("o") {
                fs::remove_file(path)?;
            }
        }
    }
    Ok(())
}

/// What is in a folder; nothing, where there is no such folder.
fn entries(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    match fs::read_dir(folder) {
        Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => Ok(vec![]),
        entries => entries?.map(|entry| Ok(entry?.path())).collect(),
    }
}

/// The file whose place a file half done was to take, `{file}.{process}.new`.
fn shall_become(path: &Path) -> Option<PathBuf> {
    let name = path.file_name()?.to_str()?;
    let (whole, process) = name.strip_suffix(".new")?.rsplit_once('.')?;
    let is_number = !process.is_empty() && process.bytes().all(|byte| byte.is_ascii_digit());
    is_number.then(|| path.with_file_name(whole))
}
