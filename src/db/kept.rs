//! What of live sessions outlives the server: movers that were created to stay, and how doors stand.

use belvedere_scene::{ObjectId, Revision, SceneName};
use sqlx::{AssertSqlSafe, Row, any::AnyRow};

use super::{Catalogue, change::returned};

/// A mover as it is kept. What it is and where, the catalogue need not understand.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeptMover {
    /// Its id.
    pub object: ObjectId,
    /// Who may speak for it.
    pub token: String,
    /// JSON.
    pub mover: String,
    /// JSON: the last pose since it was created.
    pub pose: Option<String>,
}

/// A door as it is kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeptDoor {
    /// Its id in a revision.
    pub object: ObjectId,
    /// JSON: the box around it.
    pub bounds: String,
    /// How it stands.
    pub open: bool,
}

impl Catalogue {
    /// Keeps a new mover of a scene that is published; says whether it did. Another server of the catalogue may have taken its id, or
    /// the scene been removed.
    pub async fn keep_mover(&self, scene: &SceneName, kept: &KeptMover) -> anyhow::Result<bool> {
        let added = sqlx::query(AssertSqlSafe(format!(
            "INSERT INTO kept_movers (object, scene, token, mover, pose) \
             SELECT CAST($1 AS BIGINT), scene, CAST($3 AS TEXT), CAST($4 AS TEXT), CAST($5 AS TEXT) FROM scenes WHERE scene = $2{} \
             ON CONFLICT (object) DO NOTHING",
            self.dialect.held()
        )))
        .bind(i64::from(kept.object.0))
        .bind(scene.as_str())
        .bind(&kept.token)
        .bind(&kept.mover)
        .bind(&kept.pose)
        .execute(&self.pool)
        .await?;
        Ok(added.rows_affected() > 0)
    }

    /// Keeps where movers are; those that are not kept stay so.
    pub async fn keep_poses(&self, poses: &[(ObjectId, String)]) -> anyhow::Result<()> {
        let mut tx = self.transaction().await?;
        for (object, pose) in poses {
            sqlx::query("UPDATE kept_movers SET pose = $1 WHERE object = $2")
                .bind(pose)
                .bind(i64::from(object.0))
                .execute(&mut *tx)
                .await?;
        }
        tx.commit().await?;
        Ok(())
    }

    /// Forgets the mover that has this id and this token; not one that somebody else has made under the same id.
    pub async fn forget_mover(&self, object: ObjectId, token: &str) -> anyhow::Result<()> {
        sqlx::query("DELETE FROM kept_movers WHERE object = $1 AND token = $2")
            .bind(i64::from(object.0))
            .bind(token)
            .execute(&self.pool)
            .await?;
        Ok(())
    }

    /// What all kept movers and sessions were created and opened with, JSON.
    pub async fn kept_looks(&self) -> anyhow::Result<(Vec<String>, Vec<String>)> {
        let read = async |asked| -> anyhow::Result<Vec<String>> {
            let rows = sqlx::query(asked).fetch_all(&self.pool).await?;
            rows.iter().map(|row| Ok(row.try_get("look")?)).collect()
        };
        let movers = read("SELECT mover AS look FROM kept_movers").await?;
        Ok((movers, read("SELECT visitor AS look FROM sessions").await?))
    }

    /// The movers of a scene, rising.
    pub async fn kept_movers(&self, scene: &SceneName) -> anyhow::Result<Vec<KeptMover>> {
        let rows = sqlx::query("SELECT object, token, mover, pose FROM kept_movers WHERE scene = $1 ORDER BY object")
            .bind(scene.as_str())
            .fetch_all(&self.pool)
            .await?;
        rows.iter().map(kept).collect()
    }

    /// Those of these movers that are kept, each with its scene.
    pub async fn movers_anywhere(&self, objects: &[ObjectId]) -> anyhow::Result<Vec<(SceneName, KeptMover)>> {
        let places = (1..=objects.len()).map(|place| format!("${place}"));
        let places = places.collect::<Vec<_>>().join(", ");
        let asked = format!("SELECT object, scene, token, mover, pose FROM kept_movers WHERE object IN ({places})");
        let asking = objects
            .iter()
            .fold(sqlx::query(AssertSqlSafe(asked)), |asking, object| {
                asking.bind(i64::from(object.0))
            });
        // One statement for each number of them is not worth remembering.
        let rows = asking.persistent(false).fetch_all(&self.pool).await?;
        rows.iter()
            .map(|row| Ok((row.try_get::<&str, _>("scene")?.parse()?, kept(row)?)))
            .collect()
    }

    /// Draws ids of movers that nobody else ever gets: the first of `many` in a row.
    pub async fn draw_mover_ids(&self, many: u32) -> anyhow::Result<ObjectId> {
        let drawing = sqlx::query("UPDATE mover_ids SET next = next + $1 RETURNING next - $1 AS first");
        let row = returned(&self.pool, drawing.bind(i64::from(many))).await?;
        Ok(ObjectId(u32::try_from(row.try_get::<i64, _>("first")?)?))
    }

    /// Scenes where something is kept, by name.
    pub async fn scenes_with_kept(&self) -> anyhow::Result<Vec<SceneName>> {
        let rows = sqlx::query("SELECT scene FROM kept_movers UNION SELECT scene FROM kept_doors ORDER BY scene")
            .fetch_all(&self.pool)
            .await?;
        rows.iter()
            .map(|row| Ok(row.try_get::<&str, _>("scene")?.parse()?))
            .collect()
    }

    /// Keeps how a door of a revision stands, unless the scene was removed.
    pub async fn keep_door(&self, scene: &SceneName, revision: Revision, door: &KeptDoor) -> anyhow::Result<()> {
        sqlx::query(AssertSqlSafe(format!(
            "INSERT INTO kept_doors (scene, revision, object, bounds, open) \
             SELECT scene, CAST($2 AS TEXT), CAST($3 AS BIGINT), CAST($4 AS TEXT), CAST($5 AS BIGINT) FROM scenes WHERE scene = $1{} \
             ON CONFLICT (scene, object) DO UPDATE SET revision = excluded.revision, bounds = excluded.bounds, open = excluded.open",
            self.dialect.held()
        )))
        .bind(scene.as_str())
        .bind(revision.to_string())
        .bind(i64::from(door.object.0))
        .bind(&door.bounds)
        .bind(i64::from(door.open))
        .execute(&self.pool)
        .await?;
        Ok(())
    }

    /// How the doors of a revision stand, rising; those that were never moved are not among them.
    pub async fn kept_doors(&self, scene: &SceneName, revision: Revision) -> anyhow::Result<Vec<KeptDoor>> {
        let rows = sqlx::query(
            "SELECT object, bounds, open FROM kept_doors WHERE scene = $1 AND revision = $2 ORDER BY object",
        )
        .bind(scene.as_str())
        .bind(revision.to_string())
        .fetch_all(&self.pool)
        .await?;
        rows.iter()
            .map(|row| {
                Ok(KeptDoor {
                    object: object(row)?,
                    bounds: row.try_get("bounds")?,
                    open: row.try_get::<i64, _>("open")? != 0,
                })
            })
            .collect()
    }
}

fn kept(row: &AnyRow) -> anyhow::Result<KeptMover> {
    Ok(KeptMover {
        object: object(row)?,
        token: row.try_get("token")?,
        mover: row.try_get("mover")?,
        pose: row.try_get("pose")?,
    })
}

fn object(row: &AnyRow) -> anyhow::Result<ObjectId> {
    Ok(ObjectId(u32::try_from(row.try_get::<i64, _>("object")?)?))
}

#[cfg(test)]
impl Catalogue {
    /// A scene is published, with nothing in it.
    pub(crate) async fn publish_nothing(&self, scene: &SceneName) {
        let rows = format!(
            "INSERT INTO revisions (scene, revision, pointer, source_key, sources, report) VALUES ('{scene}', '1', '', '', '', ''); \
             INSERT INTO scenes VALUES ('{scene}', '1')"
        );
        sqlx::Executor::execute(&self.pool, AssertSqlSafe(rows)).await.unwrap();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mover(object: u32) -> KeptMover {
        KeptMover {
            object: ObjectId(object),
            token: "t".into(),
            mover: "{}".into(),
            pose: None,
        }
    }

    #[tokio::test]
    async fn movers_and_doors_come_back_from_a_closed_catalogue() {
        let data = tempfile::tempdir().unwrap();
        let (here, there): (SceneName, SceneName) = ("here".parse().unwrap(), "there".parse().unwrap());
        let (old, new): (Revision, Revision) = ("0".repeat(16).parse().unwrap(), "1".repeat(16).parse().unwrap());
        let door = KeptDoor {
            object: ObjectId(3),
            bounds: "{}".into(),
            open: false,
        };
        {
            let catalogue = Catalogue::open(data.path()).await.unwrap();
            for scene in [&here, &there] {
                catalogue.publish_nothing(scene).await;
            }
            assert_eq!(catalogue.draw_mover_ids(10).await.unwrap(), ObjectId(100_000_000));
            for object in [7, 9, 8] {
                assert!(catalogue.keep_mover(&here, &mover(object)).await.unwrap());
            }
            assert!(
                !catalogue.keep_mover(&there, &mover(7)).await.unwrap(),
                "an id is used once"
            );
            catalogue.forget_mover(ObjectId(9), "another one's").await.unwrap();
            let poses = [(ObjectId(8), "p".to_owned()), (ObjectId(99), "q".to_owned())];
            catalogue.keep_poses(&poses).await.unwrap();
            catalogue.forget_mover(ObjectId(7), "t").await.unwrap();
            catalogue
                .keep_door(
                    &there,
                    old,
                    &KeptDoor {
                        open: true,
                        ..door.clone()
                    },
                )
                .await
                .unwrap();
            catalogue.keep_door(&there, new, &door).await.unwrap();
        }
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        let moved = KeptMover {
            pose: Some("p".into()),
            ..mover(8)
        };
        assert_eq!(catalogue.kept_movers(&here).await.unwrap(), [moved, mover(9)]);
        assert_eq!(catalogue.draw_mover_ids(1).await.unwrap(), ObjectId(100_000_010));
        assert_eq!(catalogue.scenes_with_kept().await.unwrap(), [here, there.clone()]);
        assert_eq!(catalogue.kept_doors(&there, old).await.unwrap(), []);
        assert_eq!(catalogue.kept_doors(&there, new).await.unwrap(), [door]);
    }
}
