//! How is a document read, and what is it when it is none that anybody wrote? Pointers have a name; all else is immutable and
//! is what its hash says.

use belvedere_scene::{BlobName, SceneName, pointer::Pointer};
use bytes::Bytes;
use serde::de::DeserializeOwned;

use crate::{Ask, ByteSource, Error, source::unwatched};

pub(crate) fn pointer_path(scene: &SceneName) -> String {
    format!("/v1/scenes/{scene}/index.json")
}

pub(crate) async fn pointer_of(source: &impl ByteSource, scene: &SceneName) -> Result<Pointer, Error> {
    named(source, &pointer_path(scene)).await
}

/// What a pointer names and is not there.
pub(crate) fn stale(scene: &SceneName, cause: Error) -> Error {
    match cause {
        Error::Missing(path) => Error::Stale {
            scene: scene.clone(),
            path,
        },
        other => other,
    }
}

/// A document that has a name instead of a hash. What cannot be read may be a damaged copy, or come from somebody on the way
/// who answers for the server, such as the page where one signs in to a network: so it is asked for once more.
pub(crate) async fn named<T: DeserializeOwned>(source: &impl ByteSource, path: &str) -> Result<T, Error> {
    match document(path, &source.get(path).await?) {
        Err(Error::Document { .. }) => fresh(source, path).await,
        read => read,
    }
}

/// The same from where it is published, past all caches.
pub(crate) async fn fresh<T: DeserializeOwned>(source: &impl ByteSource, path: &str) -> Result<T, Error> {
    let (bytes, _) = source.get_watched(Ask::of(path).fresh(), &mut unwatched).await?;
    document(path, &bytes)
}

/// An immutable object, which has so many bytes where that is known.
pub(crate) async fn verified(source: &impl ByteSource, name: &BlobName, bytes: Option<u64>) -> Result<Bytes, Error> {
    let url = name.url();
    let (bytes, _) = source.get_watched(Ask::of(&url).having(bytes), &mut unwatched).await?;
    as_promised(name, bytes)
}

/// Bytes that are what a name promises.
pub(crate) fn as_promised(name: &BlobName, bytes: Bytes) -> Result<Bytes, Error> {
    match name.is_of(&bytes) {
        true => Ok(bytes),
        false => Err(Error::Corrupt(name.clone())),
    }
}

pub(crate) fn document<T: DeserializeOwned>(path: &str, bytes: &[u8]) -> Result<T, Error> {
    serde_json::from_slice(bytes).map_err(|cause| Error::Document {
        path: path.to_owned(),
        cause: match beginning(bytes) {
            Some(beginning) if is_web_page(&beginning) => format!("{WEB_PAGE}; it begins with {beginning:?}"),
            Some(beginning) => format!("{cause}; it begins with {beginning:?}"),
            None => format!("{cause}; it has {} bytes", bytes.len()),
        },
    })
}

/// What a web page says of who answers.
const WEB_PAGE: &str = "this address answers with a web page, so it is probably not the root of a published tree, or somebody on the way \
                        answers for it";

fn is_web_page(beginning: &str) -> bool {
    let beginning = beginning.to_ascii_lowercase();
    beginning.starts_with("<!doctype html") || beginning.starts_with("<html")
}

/// So much of a document is said back.
const SAID_CHARACTERS: usize = 60;

/// How something that is text begins; nothing where it is none, or empty.
fn beginning(bytes: &[u8]) -> Option<String> {
    let begun = &bytes[..bytes.len().min(4 * SAID_CHARACTERS)];
    let text = String::from_utf8_lossy(begun);
    let said: String = text.trim().chars().take(SAID_CHARACTERS).collect();
    let is_text =
        !said.is_empty() && !said.contains(|c: char| c == '\u{fffd}' || (c.is_control() && !c.is_whitespace()));
    is_text.then_some(said)
}
