//! What is known of models: which of them is in a pack, and whose is a smooth LOD?

use std::{collections::HashMap, sync::Arc};

use belvedere_scene::{BlobHash, ModelId, object::Model};

use super::{file::Key, order::Member, sight::Seen};

/// Models that were planned for.
#[derive(Debug, Default)]
pub(super) struct Models {
    models: HashMap<ModelId, Arc<Model>>,
}

impl Models {
    pub(super) fn learn<'a>(&mut self, seen: impl Iterator<Item = &'a Seen>) {
        for seen in seen {
            let known = self.models.entry(seen.model).or_insert_with(|| seen.geometry.clone());
            // What stood in for a model knows less of it.
            if known.levels.is_empty() && !seen.geometry.levels.is_empty() {
                *known = seen.geometry.clone();
            }
        }
    }

    pub(super) fn get(&self, model: ModelId) -> Option<&Arc<Model>> {
        self.models.get(&model)
    }

    /// The model whose smooth LOD this is.
    pub(super) fn of_stream(&self, stream: BlobHash) -> Option<&Arc<Model>> {
        let is_its = |model: &&Arc<Model>| model.smooth.as_ref().is_some_and(|smooth| smooth.url.hash() == stream);
        self.models.values().find(is_its)
    }

    /// The rules of all of them.
    pub(super) fn rules(&self) -> impl Iterator<Item = Key> {
        let grown = self.models.values().filter_map(|model| model.procedural.as_ref());
        grown.map(|procedural| (&procedural.rules).into())
    }

    /// The known files in a pack, each once.
    pub(super) fn members_of(&self, pack: Key) -> Vec<Member> {
        let levels = self.models.values().filter_map(|model| model.levels.last());
        let inside = levels.filter_map(|level| {
            let place = level.pack.as_ref().filter(|place| Key::from(&place.url) == pack)?;
            Some(Member {
                key: (&level.url).into(),
                from: place.from,
                bytes: level.bytes,
            })
        });
        let mut members: Vec<_> = inside.collect();
        members.sort_by_key(|member| member.from);
        members.dedup_by_key(|member| member.from);
        members
    }
}
