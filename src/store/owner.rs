//! Whose is a store? `gc` removes from it what its catalogue does not need, so the marker names the one that it belongs to.

use bytes::Bytes;
use futures_util::TryStreamExt;
use object_store::path::Path as Key;

use super::{BlobStore, MARKER, StoreError, io};

const ABOUT: &str = "Immutable objects, named by the SHA-256 of their content.\n";
/// What the line begins with that names the catalogue.
const OF: &str = "Of catalogue ";

impl BlobStore {
    /// The name of the catalogue that the store belongs to, once somebody has said it.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn owner(&self) -> Result<Option<String>, StoreError> {
        let marker = self.read(&Key::from(MARKER)).await?.unwrap_or_default();
        let marker = String::from_utf8_lossy(&marker);
        let named = marker.lines().find_map(|line| line.strip_prefix(OF));
        Ok(named.map(|name| name.trim().to_owned()))
    }

    /// From now on the store belongs to this catalogue.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn give_to(&self, catalogue: &str) -> Result<(), StoreError> {
        self.write(&Key::from(MARKER), format!("{ABOUT}{OF}{catalogue}\n").into())
            .await
    }

    /// Whether nothing is stored.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn is_empty(&self) -> Result<bool, StoreError> {
        let others = self.inner.objects.list(None);
        let mut others = others.try_filter(|object| std::future::ready(object.location.as_ref() != MARKER));
        let first = others.try_next().await;
        Ok(first
            .map_err(|source| io("list its blobs".to_owned(), source))?
            .is_none())
    }

    pub(super) async fn mark(&self) -> Result<(), StoreError> {
        self.write(&Key::from(MARKER), Bytes::from_static(ABOUT.as_bytes()))
            .await
    }
}
