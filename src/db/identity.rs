//! Which catalogue is this?

use sqlx::Row;

use super::Catalogue;

impl Catalogue {
    /// A name that no other catalogue has, but for its copies.
    pub async fn id(&self) -> anyhow::Result<String> {
        let row = sqlx::query("SELECT id FROM identity").fetch_one(&self.pool).await?;
        Ok(row.try_get("id")?)
    }
}
