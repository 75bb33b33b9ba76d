//! Which scenes are not for everybody? What their links are signed with, the catalogue need not understand.

use std::collections::HashSet;

use belvedere_scene::{BlobName, SceneName};
use sqlx::{AnyConnection, Row};

use super::{Catalogue, PATIENCE, in_time};
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

    /// Every blob that some kept revision of a public scene needs. However many there are, it fails within seconds when the
    /// catalogue is away.
    pub async fn public_blobs(&self) -> anyhow::Result<HashSet<BlobName>> {
        let mut all = HashSet::new();
        let mut last = String::new();
        loop {
            let asking = sqlx::query(
                "SELECT DISTINCT blob FROM revision_blobs \
                 WHERE blob > $1 AND scene NOT IN (SELECT scene FROM private_scenes) ORDER BY blob LIMIT $2",
            );
            let asking = asking.bind(&last).bind(A_PAGE).fetch_all(&self.pool);
            let rows = in_time(PATIENCE, asking).await?;
            let Some(row) = rows.last() else { return Ok(all) };
            last = row.try_get("blob")?;
            for row in &rows {
                all.insert(row.try_get::<&str, _>("blob")?.parse()?);
            }
        }
    }

    /// Every blob that some kept revision of this scene needs; the same holds.
    pub async fn blobs_of_scene(&self, scene: &SceneName) -> anyhow::Result<HashSet<BlobName>> {
        let mut all = HashSet::new();
        let mut last = (String::new(), String::new());
        loop {
            let asking = sqlx::query(
                "SELECT revision, blob FROM revision_blobs WHERE scene = $1 AND (revision, blob) > ($2, $3) \
                 ORDER BY revision, blob LIMIT $4",
            );
            let asking = asking.bind(scene.as_str()).bind(&last.0).bind(&last.1).bind(A_PAGE);
            let rows = in_time(PATIENCE, asking.fetch_all(&self.pool)).await?;
            let Some(row) = rows.last() else { return Ok(all) };
            last = (row.try_get("revision")?, row.try_get("blob")?);
            for row in &rows {
                all.insert(row.try_get::<&str, _>("blob")?.parse()?);
            }
        }
    }
}

/// So many rows are read at once: each page has its time.
const A_PAGE: i64 = 20_000;

/// Makes a scene private that nobody may have seen: says whether it is private now. One that is published for everybody stays so.
pub(super) async fn hide_unseen(
    connection: &mut AnyConnection,
    scene: &SceneName,
    link_key: &Secret,
) -> Result<bool, sqlx::Error> {
    let made = sqlx::query(
        "INSERT INTO private_scenes (scene, link_key) \
         SELECT $1, $2 WHERE NOT EXISTS (SELECT 1 FROM scenes WHERE scene = $1) \
         OR EXISTS (SELECT 1 FROM private_scenes WHERE scene = $1) \
         ON CONFLICT (scene) DO UPDATE SET link_key = private_scenes.link_key",
    )
    .bind(scene.as_str())
    .bind(link_key.reveal())
    .execute(connection)
    .await?;
    Ok(made.rows_affected() > 0)
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

    #[tokio::test]
    async fn blobs_are_read_in_pages_and_all_of_them() {
        let data = tempfile::tempdir().unwrap();
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        let cellar: SceneName = "cellar".parse().unwrap();
        let names = |from: i64, to: i64| -> Vec<BlobName> {
            (from..to)
                .map(|i| BlobName::of(&i.to_le_bytes(), "glb").unwrap())
                .collect()
        };
        let many = A_PAGE + 500;
        let mut tx = catalogue.transaction().await.unwrap();
        // A half of what the second revision needs the first one needs, too.
        for (scene, revision, blobs) in [
            ("open", "1", names(0, many)),
            ("cellar", "1", names(many, many + 1000)),
            ("cellar", "2", names(many + 500, 2 * many)),
        ] {
            let sql = "INSERT INTO revisions (scene, revision, pointer, source_key, sources, report) VALUES ($1, $2, '', '', '', '')";
            let adding = sqlx::query(sql).bind(scene).bind(revision);
            adding.execute(&mut *tx).await.unwrap();
            for some in blobs.chunks(500) {
                let rows: Vec<_> = some
                    .iter()
                    .map(|blob| format!("('{scene}', '{revision}', '{blob}', 7)"))
                    .collect();
                let sql = format!(
                    "INSERT INTO revision_blobs (scene, revision, blob, bytes) VALUES {}",
                    rows.join(", ")
                );
                sqlx::query(sqlx::AssertSqlSafe(sql)).execute(&mut *tx).await.unwrap();
            }
        }
        tx.commit().await.unwrap();
        catalogue.make_private(&cellar, &"a".into()).await.unwrap();
        let public = catalogue.public_blobs().await.unwrap();
        assert_eq!(public, names(0, many).into_iter().collect());
        let private = catalogue.blobs_of_scene(&cellar).await.unwrap();
        assert_eq!(private, names(many, 2 * many).into_iter().collect());
    }

    #[tokio::test]
    async fn a_scene_that_is_published_for_everybody_is_not_made_private_unseen() {
        let data = tempfile::tempdir().unwrap();
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        let [town, open, hidden]: [SceneName; 3] = ["town", "open", "hidden"].map(|name| name.parse().unwrap());
        for scene in [&open, &hidden] {
            for published in [
                "INSERT INTO revisions (scene, revision, pointer, source_key, sources, report) VALUES ($1, '0', '', '', '', '')",
                "INSERT INTO scenes (scene, revision) VALUES ($1, '0')",
            ] {
                let publishing = sqlx::query(published).bind(scene.as_str());
                publishing.execute(&catalogue.pool).await.unwrap();
            }
        }
        assert!(catalogue.make_private(&hidden, &"a".into()).await.unwrap());
        for (scene, private) in [(&town, true), (&town, true), (&hidden, true), (&open, false)] {
            let mut connection = catalogue.pool.acquire().await.unwrap();
            let made = hide_unseen(&mut connection, scene, &"b".into()).await.unwrap();
            assert_eq!(made, private, "{scene}");
        }
        let all = catalogue.private_scenes().await.unwrap();
        let keys: Vec<_> = all.iter().map(|one| (&one.scene, one.link_key.reveal())).collect();
        assert_eq!(keys, [(&hidden, "a"), (&town, "b")]);
    }
}
