//! How does a whole tree of files get into a bucket, so that it is its own web server? With the header fields that the
//! server would send, stored beside each object.

use std::sync::Arc;

use bytes::Bytes;
use object_store::{Attribute, Attributes, ObjectStore, ObjectStoreExt, PutOptions, path::Path as Key};

use super::{Bucket, StoreError, first_bytes, io};
use crate::media;

/// A tree below a place in a bucket. Cheap to clone.
#[derive(Debug, Clone)]
pub struct BucketTree {
    objects: Arc<dyn ObjectStore>,
}

impl BucketTree {
    /// The tree at this place.
    ///
    /// # Errors
    /// When the settings of the bucket cannot be used.
    pub fn at(bucket: &Bucket) -> Result<Self, StoreError> {
        Ok(Self {
            objects: bucket.open("")?,
        })
    }

    /// Reads a file; `None` when there is none.
    ///
    /// # Errors
    /// When the bucket fails.
    pub async fn read(&self, path: &str) -> Result<Option<Bytes>, StoreError> {
        let failed = |source| io(format!("read {path}"), source);
        match self.objects.get(&Key::from(path)).await {
            Ok(found) => Ok(Some(first_bytes::whole(found).await.map_err(failed)?)),
            Err(object_store::Error::NotFound { .. }) => Ok(None),
            Err(source) => Err(failed(source)),
        }
    }

    /// Writes a file in one step, whole or not at all.
    ///
    /// # Errors
    /// When the bucket does not take it.
    pub async fn write(&self, path: &str, bytes: Bytes) -> Result<(), StoreError> {
        let options = told(path, media::life(path));
        let written = self.objects.put_opts(&Key::from(path), bytes.into(), options).await;
        written.map(drop).map_err(|source| io(format!("write {path}"), source))
    }
}

/// What a bucket shall say of an object that it hands out.
pub(super) fn told(name: &str, life: &'static str) -> PutOptions {
    let mut attributes = Attributes::new();
    attributes.insert(Attribute::ContentType, media::kind(name).into());
    attributes.insert(Attribute::CacheControl, life.into());
    attributes.into()
}
