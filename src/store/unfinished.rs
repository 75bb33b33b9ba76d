//! What do writes into a folder leave behind when they are broken off? A file `{name}#{number}`, which is given its name only when
//! it is whole: nobody reads it, and listing the blobs does not show it.

use std::{io, path::PathBuf};

use super::{BlobStore, StoreError, io as failed};

/// A file of a write that has not ended, and never will where nobody writes.
#[derive(Debug)]
pub struct Unfinished {
    path: PathBuf,
    /// How much of it is there.
    pub bytes: u64,
}

impl BlobStore {
    /// Such files; none in a bucket, which keeps nothing of them.
    ///
    /// # Errors
    /// When the folder cannot be read.
    pub async fn unfinished(&self) -> Result<Vec<Unfinished>, StoreError> {
        let Some(folder) = &self.inner.folder else {
            return Ok(vec![]);
        };
        let looking = async {
            let (mut found, mut files) = (vec![], tokio::fs::read_dir(&folder.path).await?);
            while let Some(file) = files.next_entry().await? {
                if file.file_name().to_str().is_some_and(is_unfinished) {
                    found.push(Unfinished {
                        path: file.path(),
                        bytes: file.metadata().await?.len(),
                    });
                }
            }
            io::Result::Ok(found)
        };
        let said = || "look for writes that were broken off".to_owned();
        looking.await.map_err(|error| failed(said(), generic(error)))
    }
}

impl Unfinished {
    /// Removes it.
    ///
    /// # Errors
    /// When the system does not.
    pub async fn remove(self) -> Result<(), StoreError> {
        let said = || format!("remove {}", self.path.display());
        let removed = tokio::fs::remove_file(&self.path).await;
        removed.map_err(|error| failed(said(), generic(error)))
    }
}

fn is_unfinished(file: &str) -> bool {
    let number = file.split_once('#').map(|(_, number)| number);
    number.is_some_and(|number| !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit()))
}

pub(super) fn generic(error: io::Error) -> object_store::Error {
    object_store::Error::Generic {
        store: "folder",
        source: Box::new(error),
    }
}
