//! May this catalogue's `gc` remove things from this store? With another catalogue's settings it would remove all that is
//! published, so a store belongs to the catalogue that has used it first.

use std::collections::BTreeMap;

use belvedere_scene::BlobName;

use super::data::DataFolder;

impl DataFolder {
    /// A store in which nothing is yet belongs to this catalogue from now on, unless it is somebody's already.
    pub(super) async fn own_new_store(&self) -> anyhow::Result<()> {
        if self.store().owner().await?.is_none() && self.store().is_empty().await? {
            self.store().give_to(&self.catalogue().id().await?).await?;
        }
        Ok(())
    }

    /// Fails where the store, in which all that is in `stored` is, is another catalogue's or may be. One of a time when stores
    /// did not say so is taken for this catalogue's where that needs half of it, and says so from then on, unless nothing is to
    /// be changed; so does any that is to be adopted.
    pub(crate) async fn own_store(
        &self,
        stored: &BTreeMap<BlobName, u64>,
        adopt: bool,
        change_nothing: bool,
    ) -> anyhow::Result<()> {
        let (owner, id) = (self.store().owner().await?, self.catalogue().id().await?);
        if owner.as_ref() == Some(&id) {
            return Ok(());
        }
        if !adopt {
            let way_out = "give the settings of the catalogue that published them; if that is gone for good, \
                 `gc --adopt` makes the store this catalogue's and removes what this one does not need";
            if let Some(owner) = owner {
                anyhow::bail!("the store belongs to catalogue {owner}, and this is catalogue {id}: {way_out}");
            }
            let needed = self.catalogue().blobs_in_use(u32::MAX).await?;
            let needed = stored.keys().filter(|name| needed.contains(name)).count();
            anyhow::ensure!(
                2 * needed >= stored.len(),
                "the store has {} objects, of which this catalogue needs {needed}, and does not say whose it is: {way_out}",
                stored.len()
            );
        }
        if !change_nothing {
            self.store().give_to(&id).await?;
        }
        Ok(())
    }
}
