//! How does a file reach the node that will need it? Through the bucket that all nodes share. Nodes that share a folder find
//! it where it is.
//!
//! A file is sent once, below a name of its own that nobody guesses, and removed when nobody needs it any more. What a
//! crash leaves in the bucket stands below `uploads/`, where a rule of the bucket may remove it after some days.

use std::{path::Path, sync::Arc};

use futures_util::TryStreamExt;
use object_store::{ObjectMeta, ObjectStore, ObjectStoreExt, buffered::BufWriter, path::Path as Key};
use tokio::{fs::File, io::AsyncWriteExt};

use super::{Bucket, StoreError, io};

/// Files on their way between nodes. Cheap to clone.
#[derive(Debug, Clone, Default)]
pub struct Errands {
    bucket: Option<Arc<dyn ObjectStore>>,
}

impl Errands {
    /// Through a bucket.
    ///
    /// # Errors
    /// When the settings of the bucket cannot be used.
    pub fn through(bucket: &Bucket) -> Result<Self, StoreError> {
        Ok(Self {
            bucket: Some(bucket.open("uploads")?),
        })
    }

    /// Whether files are elsewhere than where they were written.
    #[must_use]
    pub fn travel(&self) -> bool {
        self.bucket.is_some()
    }

    /// Sends a file, under its own name, below `folder`.
    ///
    /// # Errors
    /// When the file cannot be read or the bucket does not take it.
    pub async fn send(&self, folder: &str, file: &Path) -> Result<(), StoreError> {
        let Some(bucket) = &self.bucket else { return Ok(()) };
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        let failed = |error| io(format!("take {name}"), generic(error));
        let mut source = File::open(file).await.map_err(failed)?;
        let mut target = BufWriter::new(bucket.clone(), Key::from_iter([folder, &name]));
        let sent = tokio::io::copy(&mut source, &mut target).await;
        if let Err(error) = sent {
            // Nothing is there unless all of it is.
            _ = target.abort().await;
            return Err(failed(error));
        }
        target.shutdown().await.map_err(failed)
    }

    /// Fetches what was sent below `folder` into a folder of this machine, which is made.
    ///
    /// # Errors
    /// When the bucket does not give it or it cannot be written.
    pub async fn fetch(&self, folder: &str, into: &Path) -> Result<(), StoreError> {
        let Some(bucket) = &self.bucket else { return Ok(()) };
        let failed = |source| io(format!("fetch {folder}"), source);
        let cannot = |error| failed(generic(error));
        tokio::fs::create_dir_all(into).await.map_err(cannot)?;
        for found in below(bucket, folder).await.map_err(failed)? {
            let mut target = File::create(into.join(found.location.filename().unwrap_or_default()))
                .await
                .map_err(cannot)?;
            let mut bytes = bucket.get(&found.location).await.map_err(failed)?.into_stream();
            let mut written = 0;
            while let Some(part) = bytes.try_next().await.map_err(failed)? {
                written += part.len() as u64;
                target.write_all(&part).await.map_err(cannot)?;
            }
            if written != found.size {
                let cut = format!("{written} of {} bytes came", found.size);
                return Err(cannot(std::io::Error::new(std::io::ErrorKind::UnexpectedEof, cut)));
            }
            target.flush().await.map_err(cannot)?;
        }
        Ok(())
    }

    /// Removes what was sent below `folder`.
    ///
    /// # Errors
    /// When the bucket fails.
    pub async fn remove(&self, folder: &str) -> Result<(), StoreError> {
        let Some(bucket) = &self.bucket else { return Ok(()) };
        let failed = |source| io(format!("remove {folder}"), source);
        for found in below(bucket, folder).await.map_err(failed)? {
            bucket.delete(&found.location).await.map_err(failed)?;
        }
        Ok(())
    }
}

/// What was sent below `folder`.
async fn below(bucket: &Arc<dyn ObjectStore>, folder: &str) -> Result<Vec<ObjectMeta>, object_store::Error> {
    bucket.list(Some(&Key::from(folder))).try_collect().await
}

fn generic(source: std::io::Error) -> object_store::Error {
    object_store::Error::Generic {
        store: "uploads",
        source: Box::new(source),
    }
}
