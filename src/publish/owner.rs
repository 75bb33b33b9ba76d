//! May this catalogue's `gc` remove things from this store? With another catalogue's settings it would remove all that is
//! published, so a store belongs to the catalogue that has used it first.

use std::collections::BTreeMap;

use belvedere_scene::BlobName;

use super::data::DataFolder;

impl DataFolder {
    /// A store in which nothing is yet belongs to this catalogue from now on, unless it is somebody's already. Says so where it is
    /// another catalogue's: whoever has lost that one goes on, and whoever has mistaken it shall know before its `gc` runs.
    pub(super) async fn own_new_store(&self) -> anyhow::Result<Option<String>> {
        let (owner, id) = (self.store().owner().await?, self.catalogue().id().await?);
        match owner {
            Some(owner) if owner == id => Ok(None),
            Some(owner) => Ok(Some(format!(
                "the store belongs to catalogue {owner}, and this is catalogue {id}: `gc` of that one removes what was stored here now. \
                 Give the settings of that catalogue, or another store; if that is gone for good, `belvedere gc --adopt` makes the \
                 store this catalogue's"
            ))),
            None => {
                if self.store().is_empty().await? {
                    self.store().give_to(&id).await?;
                }
                Ok(None)
            }
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::place::PlaceArgs;

    #[tokio::test]
    async fn whoever_bakes_into_anothers_store_is_told_whose_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let place = PlaceArgs {
            data: Some(folder.path().to_owned()),
            ..PlaceArgs::default()
        };
        let data = DataFolder::open_place(&(&place).try_into().unwrap()).await.unwrap();
        for _ in 0..2 {
            assert_eq!(
                data.own_new_store().await.unwrap(),
                None,
                "it is this catalogue's from now on"
            );
        }
        data.store().give_to("c0ffee").await.unwrap();
        let told = data.own_new_store().await.unwrap().unwrap();
        assert!(
            told.contains("catalogue c0ffee") && told.contains("gc --adopt"),
            "{told}"
        );
    }
}
