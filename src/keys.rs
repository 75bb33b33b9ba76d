//! Who may change what is published, or read what is private? Whoever shows an API key that covers it.
//!
//! A key is `bvk_{id}_{secret}`: the id names it in lists and logs, the secret is 256 random bits of which only the
//! SHA-256 is kept. So the catalogue betrays nothing that one could log in with, and a key that is lost is made anew.

use std::{fmt, str::FromStr};

use belvedere_scene::{BlobHash, SceneName};
use serde::{Deserialize, Serialize};
use subtle::ConstantTimeEq;

use crate::db::{Catalogue, NewKey, StoredKey};

/// What every key begins with, and no token does.
pub(crate) const PREFIX: &str = "bvk_";
const ID_DIGITS: usize = 16;
const SECRET_DIGITS: usize = 64;

/// What a key may do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Scope {
    /// Upload a scene, and cancel its jobs.
    Publish,
    /// Move a scene back to an earlier revision.
    Rollback,
    /// Read private scenes.
    Read,
}

impl fmt::Display for Scope {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Publish => "publish",
            Self::Rollback => "rollback",
            Self::Read => "read",
        })
    }
}

/// A key with its secret, as its owner holds it.
#[derive(Clone)]
pub struct ApiKey {
    id: String,
    secret: String,
}

/// The text is no key.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("an API key is `bvk_`, {ID_DIGITS} hex digits, `_` and {SECRET_DIGITS} hex digits")]
pub struct NoKey;

impl ApiKey {
    fn random() -> anyhow::Result<Self> {
        let mut bytes = [0; (ID_DIGITS + SECRET_DIGITS) / 2];
        getrandom::fill(&mut bytes).map_err(|error| anyhow::anyhow!("the system gives no random numbers: {error}"))?;
        let mut id: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        let secret = id.split_off(ID_DIGITS);
        Ok(Self { id, secret })
    }

    /// The key as it is shown, once, to whom it was made for.
    #[must_use]
    pub fn reveal(&self) -> String {
        format!("{PREFIX}{}_{}", self.id, self.secret)
    }

    /// The public part.
    #[must_use]
    pub fn id(&self) -> &str {
        &self.id
    }

    fn digest(&self) -> BlobHash {
        BlobHash::of(self.secret.as_bytes())
    }
}

impl fmt::Debug for ApiKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ApiKey({PREFIX}{}_…)", self.id)
    }
}

impl FromStr for ApiKey {
    type Err = NoKey;

    fn from_str(text: &str) -> Result<Self, NoKey> {
        let hex = |text: &str, digits| {
            text.len() == digits && text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
        };
        let (id, secret) = text
            .strip_prefix(PREFIX)
            .and_then(|rest| rest.split_once('_'))
            .filter(|(id, secret)| hex(id, ID_DIGITS) && hex(secret, SECRET_DIGITS))
            .ok_or(NoKey)?;
        Ok(Self {
            id: id.to_owned(),
            secret: secret.to_owned(),
        })
    }
}

/// What somebody may do who has shown a valid key.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Grant {
    /// The key's public part.
    pub id: String,
    /// What it may do.
    pub scopes: Vec<Scope>,
    /// In which scenes; `None` stands for all.
    pub scenes: Option<Vec<SceneName>>,
}

impl Grant {
    /// Whether this may be done in this scene.
    #[must_use]
    pub fn covers(&self, scope: Scope, scene: &SceneName) -> bool {
        self.scopes.contains(&scope) && self.scenes.as_ref().is_none_or(|scenes| scenes.contains(scene))
    }

    fn of(stored: &StoredKey) -> anyhow::Result<Self> {
        Ok(Self {
            id: stored.id.clone(),
            scopes: scopes(&stored.scopes)?,
            scenes: stored.scenes.as_deref().map(serde_json::from_str).transpose()?,
        })
    }
}

/// The scopes of a stored list; those of a newer version are nothing that this one could grant.
fn scopes(json: &str) -> anyhow::Result<Vec<Scope>> {
    let stored: Vec<serde_json::Value> = serde_json::from_str(json)?;
    Ok(stored
        .into_iter()
        .filter_map(|scope| serde_json::from_value(scope).ok())
        .collect())
}

/// A key as it is listed: never with its secret.
#[derive(Debug, Clone, Serialize)]
pub struct ListedKey {
    /// What it may do.
    #[serde(flatten)]
    pub grant: Grant,
    /// What people call it.
    pub name: String,
    /// When it was made.
    pub created_at: String,
    /// When it ends, if it does.
    pub expires_at: Option<String>,
    /// When it was taken back, if it was.
    pub revoked_at: Option<String>,
    /// Whether it is neither expired nor revoked.
    pub valid: bool,
}

impl ListedKey {
    fn of(stored: StoredKey) -> anyhow::Result<Self> {
        Ok(Self {
            grant: Grant::of(&stored)?,
            name: stored.name,
            created_at: stored.created_at,
            expires_at: stored.expires_at,
            revoked_at: stored.revoked_at,
            valid: stored.valid,
        })
    }
}

/// What a new key shall be.
#[derive(Debug, Clone)]
pub struct Wanted {
    /// What people call it.
    pub name: String,
    /// What it may do.
    pub scopes: Vec<Scope>,
    /// In which scenes; `None` stands for all.
    pub scenes: Option<Vec<SceneName>>,
    /// After how many days it ends, if ever.
    pub days: Option<u32>,
}

/// The keys of one data folder. Cheap to clone.
#[derive(Debug, Clone)]
pub struct Keys {
    catalogue: Catalogue,
}

impl Keys {
    /// The keys that this catalogue holds.
    #[must_use]
    pub fn new(catalogue: Catalogue) -> Self {
        Self { catalogue }
    }

    /// Makes a key. Its secret is in the answer and nowhere else.
    ///
    /// # Errors
    /// When the system has no random numbers or the catalogue cannot be written.
    pub async fn create(&self, wanted: &Wanted) -> anyhow::Result<ApiKey> {
        let key = ApiKey::random()?;
        let scenes = wanted.scenes.as_ref().map(serde_json::to_string).transpose()?;
        self.catalogue
            .keep_key(&NewKey {
                id: &key.id,
                digest: &key.digest().to_string(),
                name: &wanted.name,
                scopes: &serde_json::to_string(&wanted.scopes)?,
                scenes: scenes.as_deref(),
                days: wanted.days,
            })
            .await?;
        Ok(key)
    }

    /// What this key may do; `None` when it is unknown, expired or revoked.
    ///
    /// # Errors
    /// When the catalogue does not answer.
    pub async fn grant(&self, key: &ApiKey) -> anyhow::Result<Option<Grant>> {
        let Some(stored) = self.catalogue.key(&key.id).await? else {
            return Ok(None);
        };
        let digest: BlobHash = stored.digest.parse()?;
        // However many bytes of a guess are right, it takes the same time.
        let same = bool::from(digest.0.ct_eq(&key.digest().0));
        (same && stored.valid).then(|| Grant::of(&stored)).transpose()
    }

    /// Every key that ever was, oldest first.
    ///
    /// # Errors
    /// When the catalogue does not answer.
    pub async fn list(&self) -> anyhow::Result<Vec<ListedKey>> {
        let stored = self.catalogue.keys().await?;
        stored.into_iter().map(ListedKey::of).collect()
    }

    /// Takes a key back, from its next use on; says whether it was there.
    ///
    /// # Errors
    /// When the catalogue does not answer.
    pub async fn revoke(&self, id: &str) -> anyhow::Result<bool> {
        self.catalogue.revoke_key(id).await
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    async fn keys() -> (tempfile::TempDir, Keys) {
        let data = tempfile::tempdir().unwrap();
        let keys = Keys::new(Catalogue::open(data.path()).await.unwrap());
        (data, keys)
    }

    fn wanted(days: Option<u32>) -> Wanted {
        Wanted {
            name: "press".into(),
            scopes: vec![Scope::Publish],
            scenes: Some(vec!["town".parse().unwrap()]),
            days,
        }
    }

    #[tokio::test]
    async fn a_key_grants_what_it_was_made_for_until_it_is_revoked() {
        let (_data, keys) = keys().await;
        let key = keys.create(&wanted(None)).await.unwrap();
        let shown: ApiKey = key.reveal().parse().unwrap();
        let grant = keys.grant(&shown).await.unwrap().unwrap();
        let (town, other): (SceneName, SceneName) = ("town".parse().unwrap(), "other".parse().unwrap());
        assert!(grant.covers(Scope::Publish, &town));
        assert!(!grant.covers(Scope::Rollback, &town) && !grant.covers(Scope::Publish, &other));

        let guess: ApiKey = format!("bvk_{}_{}", key.id(), "0".repeat(SECRET_DIGITS))
            .parse()
            .unwrap();
        assert_eq!(keys.grant(&guess).await.unwrap(), None, "the id alone opens nothing");
        assert!(keys.revoke(key.id()).await.unwrap());
        assert_eq!(keys.grant(&shown).await.unwrap(), None);
        assert!(!keys.revoke("0000000000000000").await.unwrap());
        let listed = keys.list().await.unwrap();
        assert!(listed.len() == 1 && listed[0].revoked_at.is_some() && !listed[0].valid);
    }

    #[test]
    fn a_scope_of_a_newer_version_grants_nothing() {
        assert_eq!(
            scopes(r#"["publish", "paint", "read"]"#).unwrap(),
            [Scope::Publish, Scope::Read]
        );
        assert!(scopes("publish").is_err());
    }

    #[tokio::test]
    async fn a_key_ends_when_its_time_is_over() {
        let (_data, keys) = keys().await;
        let ended = keys.create(&wanted(Some(0))).await.unwrap();
        assert_eq!(keys.grant(&ended).await.unwrap(), None);
        let open = keys.create(&wanted(Some(1))).await.unwrap();
        assert!(keys.grant(&open).await.unwrap().is_some());
    }

    #[tokio::test]
    async fn neither_the_catalogue_nor_a_log_holds_the_secret() {
        let (_data, keys) = keys().await;
        let key = keys.create(&wanted(None)).await.unwrap();
        let stored = keys.catalogue.key(key.id()).await.unwrap().unwrap();
        for text in [
            format!("{stored:?}"),
            format!("{key:?}"),
            serde_json::to_string(&keys.list().await.unwrap()).unwrap(),
        ] {
            assert!(!text.contains(&key.secret), "{text}");
        }
    }

    #[test]
    fn what_is_not_spelt_like_a_key_is_none() {
        let key = ApiKey::random().unwrap().reveal();
        assert!(key.parse::<ApiKey>().is_ok());
        for text in [
            String::new(),
            key[1..].to_owned(),
            key.to_uppercase(),
            key.replace('_', "-"),
            format!("{key}0"),
            format!("{key}_"),
        ] {
            assert_eq!(text.parse::<ApiKey>().unwrap_err(), NoKey, "{text}");
        }
    }
}
