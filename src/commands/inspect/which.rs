//! Which object does somebody mean, who gives its id, `o7`, or the name of its node?

use std::{convert::Infallible, str::FromStr};

use anyhow::{Context as _, bail};
use belvedere_scene::{Bounds, ObjectId};

use super::{super::output::counted, Opened};

/// So many objects are read at a time.
const PAGE: usize = 1_000;
/// So many are named where several are meant.
const NAMED: usize = 5;
const EVERYWHERE: Bounds = Bounds {
    min: [f64::NEG_INFINITY; 3],
    max: [f64::INFINITY; 3],
};

/// An object as somebody names it.
#[derive(Debug, Clone)]
pub(super) enum Which {
    Id(ObjectId),
    /// The name of its node in the source.
    Node(String),
}

impl FromStr for Which {
    type Err = Infallible;

    fn from_str(text: &str) -> Result<Self, Infallible> {
        Ok(text.parse().map_or_else(|_| Self::Node(text.to_owned()), Self::Id))
    }
}

impl Which {
    /// The object, if it is one.
    pub(super) async fn of(&self, scene: &Opened) -> anyhow::Result<ObjectId> {
        let wanted = match self {
            Self::Id(id) => return Ok(*id),
            Self::Node(wanted) => wanted,
        };
        let (mut called, mut alike) = (Vec::new(), Vec::new());
        let lower = wanted.to_lowercase();
        let mut after = None;
        loop {
            let page = scene.reader.objects_in(&EVERYWHERE, after, PAGE).await?;
            for object in page.objects {
                if object.source_node == *wanted {
                    called.push(object.object);
                } else if alike.len() < NAMED && object.source_node.to_lowercase().contains(&lower) {
                    alike.push(format!("{} ({})", object.object, object.source_node));
                }
            }
            after = page.more_after;
            if after.is_none() {
                break;
            }
        }
        if called.len() > 1 {
            let first: Vec<_> = called.iter().take(NAMED).map(ToString::to_string).collect();
            bail!(
                "{} objects are called `{wanted}`; give an id: {}{}",
                called.len(),
                first.join(", "),
                if called.len() > NAMED { ", …" } else { "" }
            );
        }
        let known = scene.pointer.objects;
        called.pop().with_context(|| match &alike[..] {
            [] => format!(
                "no object is called `{wanted}`, the name of a node, and ids are such as o7; the scene has {}",
                counted(known as usize, "object")
            ),
            alike => format!("no object is called `{wanted}`; did you mean {}?", alike.join(", ")),
        })
    }
}
