//! Which scenes are not for everybody? What their links are signed with, the catalogue need not understand.

use std::collections::HashSet;

use belvedere_scene::{BlobName, SceneName};
use sqlx::Row;

use super::Catalogue;
use crate::secret::Secret;

/// A scene that is not for everybody.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PrivateScene {
    /// Its name; it need not be published yet.
    pub scene: SceneName,
    /// What its links are signed with.
    pub link_key: Secret,
    /// When it was made private.
    pub since: String,
}

impl Catalogue {
    /// The private scenes, by name.
    pub async fn private_scenes(&self) -> anyhow::Result<Vec<PrivateScene>> {
        let rows = sqlx::query("SELECT scene, link_key, since FROM private_scenes ORDER BY scene")
            .fetch_all(&self.pool)
            .await?;
        rows.iter()
            .map(|row| {
                Ok(PrivateScene {
                    scene: row.try_get::<&str, _>("scene")?.parse()?,
                    link_key: row.try_get::<&str, _>("link_key")?.into(),
                    since: row.try_get("since")?,
                })
            })
            .collect()
    }

    /// Makes a scene private, from before it is published on if need be. Of one that is private already nothing changes.
    /// Says whether it was not.
    pub async fn make_private(&self, scene: &SceneName, link_key: &Secret) -> anyhow::Result<bool> {
        let made =
            sqlx::query("INSERT INTO private_scenes (scene, link_key) VALUES ($1, $2) ON CONFLICT (scene) DO NOTHING")
                .bind(scene.as_str())
                .bind(link_key.reveal())
                .execute(&self.pool)
                .await?;
        Ok(made.rows_affected() > 0)
    }

    /// Gives a private scene another key, so that no link holds that was signed with the last one; says whether it is
    /// private.
    pub async fn replace_link_key(&self, scene: &SceneName, link_key: &Secret) -> anyhow::Result<bool> {
        let replaced = sqlx::query("UPDATE private_scenes SET link_key = $1 WHERE scene = $2")
            .bind(link_key.reveal())
            .bind(scene.as_str())
            .execute(&self.pool)
            .await?;
        Ok(replaced.rows_affected() > 0)
    }

    /// Opens a scene to everybody; says whether it was private.
    pub async fn make_public(&self, scene: &SceneName) -> anyhow::Result<bool> {
        let opened = sqlx::query("DELETE FROM private_scenes WHERE scene = $1")
            .bind(scene.as_str())
            .execute(&self.pool)
            .await?;
        Ok(opened.rows_affected() > 0)
    }

    /// How many revisions of all scenes are kept.
    pub async fn count_revisions(&self) -> anyhow::Result<i64> {
        let row = sqlx::query("SELECT COUNT(*) AS kept FROM revisions")
            .fetch_one(&self.pool)
            .await?;
        Ok(row.try_get("kept")?)
    }

    /// Every blob that some kept revision of a public scene needs.
    pub async fn public_blobs(&self) -> anyhow::Result<HashSet<BlobName>> {
        let rows = sqlx::query(
            "SELECT DISTINCT blob FROM revision_blobs WHERE scene NOT IN (SELECT scene FROM private_scenes)",
        )
        .fetch_all(&self.pool)
        .await?;
        names(&rows)
    }

    /// Every blob that some kept revision of this scene needs.
    pub async fn blobs_of_scene(&self, scene: &SceneName) -> anyhow::Result<HashSet<BlobName>> {
        let rows = sqlx::query("SELECT DISTINCT blob FROM revision_blobs WHERE scene = $1")
            .bind(scene.as_str())
            .fetch_all(&self.pool)
            .await?;
        names(&rows)
    }
}

fn names(rows: &[sqlx::any::AnyRow]) -> anyhow::Result<HashSet<BlobName>> {
    rows.iter()
        .map(|row| Ok(row.try_get::<&str, _>("blob")?.parse()?))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_private_scene_keeps_its_key_until_that_is_replaced() {
        let data = tempfile::tempdir().unwrap();
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        let town: SceneName = "town".parse().unwrap();
        let key = async || {
            let all = catalogue.private_scenes().await.unwrap();
            all.first().map(|private| private.link_key.reveal().to_owned())
        };
        assert!(!catalogue.replace_link_key(&town, &"c".into()).await.unwrap());
        assert!(catalogue.make_private(&town, &"a".into()).await.unwrap());
        assert!(!catalogue.make_private(&town, &"b".into()).await.unwrap());
        assert_eq!(key().await.as_deref(), Some("a"));
        assert!(catalogue.replace_link_key(&town, &"c".into()).await.unwrap());
        assert_eq!(key().await.as_deref(), Some("c"));
        assert!(catalogue.make_public(&town).await.unwrap() && !catalogue.make_public(&town).await.unwrap());
        assert_eq!(key().await, None);
    }
}
