//! Which files is the viewer's page made of, and in which forms do they leave? They are part of the program, taken from
//! `viewer/dist` when it was built. Their compressed forms are made when they are first asked for, by the server or for a
//! static tree, as those of published objects are: most of what a first visitor waits for is scripts.

use std::{borrow::Cow, collections::BTreeMap, sync::LazyLock};

use bytes::Bytes;
use rust_embed::RustEmbed;
use tokio::sync::OnceCell;

use crate::store::Representations;

#[derive(RustEmbed)]
#[folder = "viewer/dist"]
#[allow_missing = true]
struct Dist;

static FORMS: LazyLock<BTreeMap<Cow<'static, str>, OnceCell<Representations>>> =
    LazyLock::new(|| Dist::iter().map(|path| (path, OnceCell::new())).collect());

/// Where each file is, below the root; none when the program was built without the viewer.
pub(crate) fn paths() -> impl Iterator<Item = &'static str> {
    FORMS.keys().map(AsRef::as_ref)
}

/// Whether one of them is there.
pub(crate) fn has(path: &str) -> bool {
    FORMS.contains_key(path)
}

/// The forms of one of them.
pub(crate) async fn forms(path: &str) -> Option<&'static Representations> {
    let (path, forms) = FORMS.get_key_value(path)?;
    let made = forms.get_or_init(|| async {
        let file = Dist::get(path).expect("what is listed is there");
        let bytes = match file.data {
            Cow::Borrowed(bytes) => Bytes::from_static(bytes),
            Cow::Owned(bytes) => Bytes::from(bytes),
        };
        tokio::task::spawn_blocking(move || Representations::of_bytes(bytes))
            .await
            .expect("encoding does not panic and is not aborted")
    });
    Some(made.await)
}
