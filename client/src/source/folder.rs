//! What would a web server in front of a folder send?

use std::{ops::Range, path::PathBuf};

use bytes::Bytes;

use super::{Ask, ByteSource, Part, part_of};
use crate::Error;

/// A folder that `belvedere publish` wrote.
#[derive(Debug, Clone)]
pub struct FolderSource {
    root: PathBuf,
}

impl FolderSource {
    /// The tree in this folder.
    #[must_use]
    pub fn new(root: impl Into<PathBuf>) -> Self {
        Self { root: root.into() }
    }
}

impl ByteSource for FolderSource {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        let below = path.trim_start_matches('/');
        if below.split('/').any(|part| part == "..") {
            return Err(Error::Missing(path.to_owned()));
        }
        match tokio::fs::read(self.root.join(below)).await {
            Ok(bytes) => Ok(bytes.into()),
            Err(cause) if cause.kind() == std::io::ErrorKind::NotFound => Err(Error::Missing(path.to_owned())),
            Err(cause) => Err(Error::Fetch {
                path: path.to_owned(),
                cause: cause.to_string(),
            }),
        }
    }

    /// What a web server in front of the folder would send.
    async fn get_carried(&self, path: &str) -> Result<(Bytes, u64), Error> {
        let bytes = self.get(path).await?;
        let packed = tokio::fs::metadata(self.root.join(format!("{}.gz", path.trim_start_matches('/')))).await;
        let carried = packed.map_or(bytes.len() as u64, |packed| packed.len());
        Ok((bytes, carried))
    }

    async fn get_range(&self, ask: Ask<'_>, range: Range<u64>) -> Result<(Part, u64), Error> {
        let part = part_of(ask.path, &self.get(ask.path).await?, range)?;
        let carried = part.len() as u64;
        Ok((Part::Asked(part), carried))
    }
}
