//! Where does a tree go? Into a folder, for any web server, or into a bucket that is one. Either way a reader sees each file
//! as it was or as it is, whole.

use std::path::{Path, PathBuf};

use anyhow::Context;
use tokio::io::AsyncWriteExt;

use super::alone::alone_in;
use crate::{
    db,
    store::{BlobStore, Bucket, BucketTree},
};

const WAY_OUT: &str = "publish into another place";

/// Where a tree is written.
#[derive(Debug)]
pub(crate) enum Target {
    Folder(PathBuf),
    Bucket(Bucket, BucketTree),
}

impl Target {
    /// The folder or, if it is an address like `s3://bucket/prefix`, the bucket on this server.
    pub(crate) fn new(to: &str, endpoint: Option<&str>, plain_http: bool) -> anyhow::Result<Self> {
        if to.starts_with("s3://") {
            let bucket = Bucket::new(to, endpoint, plain_http)?;
            let tree = BucketTree::at(&bucket)?;
            return Ok(Self::Bucket(bucket, tree));
        }
        anyhow::ensure!(
            !to.contains("://"),
            "a tree is written into a folder or a bucket, s3://bucket/prefix; got `{to}`"
        );
        Ok(Self::Folder(PathBuf::from(to)))
    }

    /// Waits until nobody else writes into the folder, as long as the file is held. A bucket has no such lock.
    pub(super) async fn alone(&self) -> anyhow::Result<Option<std::fs::File>> {
        match self {
            Self::Folder(folder) => Ok(Some(alone_in(folder).await?)),
            Self::Bucket(..) => Ok(None),
        }
    }

    /// Fails in a data folder. Makes nothing, so that a wrong place stays as it was.
    pub(super) fn is_no_data_folder(&self) -> anyhow::Result<()> {
        if let Self::Folder(folder) = self {
            anyhow::ensure!(
                !folder.join(db::FILE_NAME).exists(),
                "{} is a data folder, whose `gc` would remove what the tree needs; {WAY_OUT}",
                folder.display()
            );
        }
        Ok(())
    }

    /// Where its blobs go. Fails where a catalogue's are: its `gc` removes what the tree needs and that catalogue does not.
    pub(super) async fn open_store(&self) -> anyhow::Result<BlobStore> {
        let store = match self {
            Self::Folder(folder) => BlobStore::open_folder(folder, 0).await?,
            Self::Bucket(bucket, _) => BlobStore::open_bucket(bucket, 0).await?,
        };
        if let Some(owner) = store.owner().await? {
            anyhow::bail!(
                "in {self} is the store of catalogue {owner}, whose `gc` would remove what the tree needs; {WAY_OUT}"
            );
        }
        Ok(store)
    }

    /// A file below the root, if there is one.
    pub(super) async fn read(&self, path: &str) -> anyhow::Result<Option<Vec<u8>>> {
        match self {
            Self::Folder(folder) => match tokio::fs::read(folder.join(path)).await {
                Ok(bytes) => Ok(Some(bytes)),
                Err(cause) if cause.kind() == std::io::ErrorKind::NotFound => Ok(None),
                Err(cause) => Err(cause).with_context(|| format!("cannot read {path}")),
            },
            Self::Bucket(_, tree) => Ok(tree.read(path).await?.map(Into::into)),
        }
    }

    /// Puts a file in place, so that it outlives a loss of power.
    pub(super) async fn replace(&self, path: &str, bytes: &[u8]) -> anyhow::Result<()> {
        match self {
            Self::Folder(folder) => replace(&folder.join(path), bytes).await,
            Self::Bucket(_, tree) => Ok(tree.write(path, bytes.to_vec().into()).await?),
        }
    }

    /// Puts a file in place; it lasts when the store beside it is synced.
    pub(super) async fn place(&self, path: &str, bytes: &[u8]) -> anyhow::Result<()> {
        match self {
            Self::Folder(folder) => place(&folder.join(path), bytes).await,
            Self::Bucket(_, tree) => Ok(tree.write(path, bytes.to_vec().into()).await?),
        }
    }
}

impl std::fmt::Display for Target {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Folder(folder) => folder.display().fmt(f),
            Self::Bucket(bucket, _) => bucket.fmt(f),
        }
    }
}

/// Puts a file in place in one step, so that a reader sees the old one or the new one, after a loss of power too.
async fn replace(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    let (file, half_done) = write_beside(path, bytes).await?;
    let cannot = || format!("cannot write {}", path.display());
    file.sync_all().await.with_context(cannot)?;
    tokio::fs::rename(&half_done, path).await.with_context(cannot)?;
    // The rename itself must last.
    let folder = path.parent().with_context(cannot)?;
    let folder = tokio::fs::File::open(folder).await.with_context(cannot)?;
    folder.sync_all().await.with_context(cannot)
}

/// Puts a file in place in one step; it lasts when the store beside it is synced.
async fn place(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    let (_, half_done) = write_beside(path, bytes).await?;
    let renamed = tokio::fs::rename(&half_done, path).await;
    renamed.with_context(|| format!("cannot write {}", path.display()))
}

/// Writes what shall take the place of a file.
async fn write_beside(path: &Path, bytes: &[u8]) -> anyhow::Result<(tokio::fs::File, PathBuf)> {
    let cannot = || format!("cannot write {}", path.display());
    let folder = path.parent().with_context(cannot)?;
    tokio::fs::create_dir_all(folder).await.with_context(cannot)?;
    let mut half_done = PathBuf::from(path).into_os_string();
    half_done.push(format!(".{}.new", std::process::id()));
    let half_done = PathBuf::from(half_done);
    let mut file = tokio::fs::File::create(&half_done).await.with_context(cannot)?;
    file.write_all(bytes).await.with_context(cannot)?;
    file.flush().await.with_context(cannot)?;
    Ok((file, half_done))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_tree_is_written_beside_no_catalogue() {
        let place = tempfile::tempdir().unwrap();
        let to = Target::new(place.path().to_str().unwrap(), None, false).unwrap();
        to.is_no_data_folder().unwrap();
        let store = to.open_store().await.unwrap();
        to.open_store().await.unwrap();
        store.give_to("c1").await.unwrap();
        let told = to.open_store().await.unwrap_err().to_string();
        assert!(told.contains("catalogue c1"), "{told}");
        let data = tempfile::tempdir().unwrap();
        std::fs::write(data.path().join(db::FILE_NAME), "").unwrap();
        let to = Target::new(data.path().to_str().unwrap(), None, false).unwrap();
        let told = to.is_no_data_folder().unwrap_err().to_string();
        assert!(told.contains("is a data folder"), "{told}");
    }
}
