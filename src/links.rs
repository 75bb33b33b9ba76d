//! How does somebody without an account enter a private scene? By a link that whoever runs the server has signed.
//!
//! A link is a folder: `/s/{scene}/{expires}/{signature}/` holds the viewer and the tree of that scene, so what is
//! addressed relative to it carries the signature, and a cache before the server keeps each link's answers apart. The signature is
//! HMAC-SHA256 (RFC 2104) in lower-case hex of the text `/s/{scene}/{expires}`, with the 64 hex digits of the scene's key, as they
//! stand, for the key: what a script at the edge of a CDN computes in one line, and needs no look at the catalogue for.

use std::{fmt, str::FromStr};

use belvedere_scene::{BlobHash, SceneName};
use hmac::{Hmac, KeyInit, Mac};
use sha2::Sha256;
use subtle::ConstantTimeEq;

use crate::secret::Secret;

/// The first segment of every link.
pub const ROOT: &str = "/s/";

/// What the links of one scene are signed with.
#[derive(Clone, PartialEq, Eq)]
pub struct LinkKey(Secret);

/// The text is no key.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a link key is 64 lower-case hex digits")]
pub struct NoLinkKey;

impl LinkKey {
    /// A new one.
    ///
    /// # Errors
    /// When the system has no random numbers.
    pub fn random() -> anyhow::Result<Self> {
        let mut bytes = [0; 32];
        getrandom::fill(&mut bytes).map_err(|error| anyhow::anyhow!("the system gives no random numbers: {error}"))?;
        Ok(Self(BlobHash(bytes).to_string().as_str().into()))
    }

    /// As the catalogue keeps it.
    #[must_use]
    pub fn secret(&self) -> &Secret {
        &self.0
    }

    /// The link to a scene until a moment, in seconds since 1970: its path, which ends with `/`.
    #[must_use]
    pub fn sign(&self, scene: &SceneName, expires_s: u64) -> String {
        let folder = format!("{ROOT}{scene}/{expires_s}");
        let signature = self.signature(&folder);
        format!("{folder}/{signature}/")
    }

    fn signature(&self, folder: &str) -> BlobHash {
        let mut mac =
            Hmac::<Sha256>::new_from_slice(self.0.reveal().as_bytes()).expect("HMAC takes keys of any length");
        mac.update(folder.as_bytes());
        BlobHash(mac.finalize().into_bytes().into())
    }
}

impl FromStr for LinkKey {
    type Err = NoLinkKey;

    fn from_str(text: &str) -> Result<Self, NoLinkKey> {
        match text.parse::<BlobHash>() {
            Ok(_) => Ok(Self(text.into())),
            Err(_) => Err(NoLinkKey),
        }
    }
}

impl fmt::Debug for LinkKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("LinkKey(…)")
    }
}

/// What a path claims to be: a link, and what is asked for below it.
#[derive(Debug)]
pub struct Claimed<'a> {
    /// Whose link.
    pub scene: SceneName,
    /// Until when, in seconds since 1970.
    pub expires_s: u64,
    /// The link without its last `/`.
    pub link: &'a str,
    /// The path below it, with the `/` that it starts with.
    pub below: &'a str,
    signature: BlobHash,
}

impl<'a> Claimed<'a> {
    /// Reads a path; each link has one spelling.
    #[must_use]
    pub fn read(path: &'a str) -> Option<Self> {
        let mut rest = path.strip_prefix(ROOT)?.splitn(4, '/');
        let (scene, expires, signature, below) = (rest.next()?, rest.next()?, rest.next()?, rest.next()?);
        let expires_s: u64 = expires.parse().ok()?;
        let (link, below) = path.split_at(path.len() - below.len() - 1);
        (expires_s.to_string() == expires).then_some(Self {
            scene: scene.parse().ok()?,
            expires_s,
            link,
            below,
            signature: signature.parse().ok()?,
        })
    }

    /// Whether this key has signed it, however long ago. Takes the same time however much of a guess is right.
    #[must_use]
    pub fn is_signed_with(&self, key: &LinkKey) -> bool {
        let folder = format!("{ROOT}{}/{}", self.scene, self.expires_s);
        key.signature(&folder).0.ct_eq(&self.signature.0).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key() -> LinkKey {
        "0123456789abcdef".repeat(4).parse().unwrap()
    }

    #[test]
    fn a_signature_is_what_others_compute() {
        // printf %s /s/town/1800000000 | openssl dgst -sha256 -hmac 0123456789abcdef…
        let link = key().sign(&"town".parse().unwrap(), 1_800_000_000);
        assert_eq!(
            link,
            "/s/town/1800000000/3eea01a9cd79c319c168bc684055adff0ebc5b0d5d15d486a413d8e0436a2abc/"
        );
    }

    #[test]
    fn a_link_holds_for_its_scene_its_time_and_its_key_alone() {
        let town: SceneName = "town".parse().unwrap();
        let path = format!("{}o/x.glb", key().sign(&town, 90));
        let claimed = Claimed::read(&path).unwrap();
        assert_eq!((claimed.below, claimed.expires_s), ("/o/x.glb", 90));
        assert!(claimed.is_signed_with(&key()) && !claimed.is_signed_with(&LinkKey::random().unwrap()));
        for (from, to) in [("town", "tower"), ("/90/", "/91/")] {
            let other = path.replace(from, to);
            assert!(!Claimed::read(&other).unwrap().is_signed_with(&key()), "{other}");
        }
        assert_eq!(Claimed::read(&key().sign(&town, 90)).unwrap().below, "/");
    }

    #[test]
    fn a_link_has_one_spelling() {
        let path = key().sign(&"town".parse().unwrap(), 90);
        for wrong in [
            path.trim_end_matches('/').to_owned(),
            path.replace("/90/", "/090/"),
            path.replace("/90/", "/+90/"),
            path.to_uppercase(),
            path.replace("town", "to%77n"),
            path[1..].to_owned(),
            format!("/{path}"),
            "/s/".to_owned(),
        ] {
            assert!(Claimed::read(&wrong).is_none(), "{wrong}");
        }
    }

    #[test]
    fn a_key_is_not_shown() {
        let text = format!("{:?}", key());
        assert!(!text.contains("0123"), "{text}");
        assert!("x".parse::<LinkKey>().is_err() && "0".repeat(63).parse::<LinkKey>().is_err());
    }
}
