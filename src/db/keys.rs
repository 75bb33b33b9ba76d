//! Which API keys are there? What they may do, the catalogue need not understand.

use sqlx::{AssertSqlSafe, Row, any::AnyRow};

use super::Catalogue;

/// A key as it is kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredKey {
    /// The public part.
    pub id: String,
    /// SHA-256 of the secret part, in hex.
    pub digest: String,
    /// What people call it.
    pub name: String,
    /// JSON: what it may do.
    pub scopes: String,
    /// JSON: in which scenes; `None` stands for all.
    pub scenes: Option<String>,
    /// When it was made.
    pub created_at: String,
    /// When it ends.
    pub expires_at: Option<String>,
    /// When it was taken back.
    pub revoked_at: Option<String>,
    /// Whether it is neither expired nor revoked.
    pub valid: bool,
}

/// A key that is about to be kept.
#[derive(Debug)]
pub struct NewKey<'a> {
    /// The public part.
    pub id: &'a str,
    /// SHA-256 of the secret part, in hex.
    pub digest: &'a str,
    /// What people call it.
    pub name: &'a str,
    /// JSON.
    pub scopes: &'a str,
    /// JSON.
    pub scenes: Option<&'a str>,
    /// Days from now on; without them it does not end.
    pub days: Option<u32>,
}

impl Catalogue {
    /// Keeps a new key.
    pub async fn keep_key(&self, key: &NewKey<'_>) -> anyhow::Result<()> {
        let sql = AssertSqlSafe(format!(
            "INSERT INTO api_keys (id, digest, name, scopes, scenes, expires_at) VALUES ($1, $2, $3, $4, $5, {})",
            self.dialect.in_seconds("$6")
        ));
        sqlx::query(sql)
            .bind(key.id)
            .bind(key.digest)
            .bind(key.name)
            .bind(key.scopes)
            .bind(key.scenes)
            // From no number there is no time.
            .bind(key.days.map(|days| i64::from(days) * 24 * 3600))
            .execute(&self.pool)
            .await?;
        Ok(())
    }

    /// A key by its public part.
    pub async fn key(&self, id: &str) -> anyhow::Result<Option<StoredKey>> {
        let sql = AssertSqlSafe(format!("{} WHERE id = $1", self.select_keys()));
        let row = sqlx::query(sql).bind(id).fetch_optional(&self.pool).await?;
        row.as_ref().map(stored).transpose()
    }

    /// Every key that ever was, oldest first.
    pub async fn keys(&self) -> anyhow::Result<Vec<StoredKey>> {
        let sql = AssertSqlSafe(format!("{} ORDER BY created_at, id", self.select_keys()));
        let rows = sqlx::query(sql).fetch_all(&self.pool).await?;
        rows.iter().map(stored).collect()
    }

    fn select_keys(&self) -> String {
        format!(
            "SELECT id, digest, name, scopes, scenes, created_at, expires_at, revoked_at, \
             CASE WHEN revoked_at IS NULL AND (expires_at IS NULL OR expires_at > {}) THEN 1 ELSE 0 END AS valid \
             FROM api_keys",
            self.dialect.now()
        )
    }

    /// Takes a key back; says whether it was there. One that was taken back before keeps its time.
    pub async fn revoke_key(&self, id: &str) -> anyhow::Result<bool> {
        let sql = AssertSqlSafe(format!(
            "UPDATE api_keys SET revoked_at = coalesce(revoked_at, {}) WHERE id = $1",
            self.dialect.now()
        ));
        Ok(sqlx::query(sql).bind(id).execute(&self.pool).await?.rows_affected() > 0)
    }
}

fn stored(row: &AnyRow) -> anyhow::Result<StoredKey> {
    Ok(StoredKey {
        id: row.try_get("id")?,
        digest: row.try_get("digest")?,
        name: row.try_get("name")?,
        scopes: row.try_get("scopes")?,
        scenes: row.try_get("scenes")?,
        created_at: row.try_get("created_at")?,
        expires_at: row.try_get("expires_at")?,
        revoked_at: row.try_get("revoked_at")?,
        valid: row.try_get::<i64, _>("valid")? != 0,
    })
}
