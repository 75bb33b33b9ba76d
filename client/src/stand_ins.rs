//! What stands for an object until somebody needs its entry? What its population says: where it is, and what it grows from, in
//! far fewer bytes (Schmalstieg, *The Remote Rendering Pipeline*, 1997, §8.4). Its name, box and levels come with the entry,
//! which [`Scene::entry`] reads for whoever wants them.
//!
//! A population is fetched where it costs at most half of the chunks of objects that it spares (the rule of
//! `viewer/core/atlas/standins.ts`). Nobody knows which these are before it is here: a chunk is read all the same when somebody in it
//! that is wanted cannot be grown. So what populations have spared so far says what the next one will.

use std::{
    collections::{BTreeMap, HashMap, HashSet},
    sync::Arc,
};

use belvedere_scene::{BlobName, ObjectId, index::PageEntry, population::Population};

use crate::{
    ByteSource, Error, Scene,
    strategy::{
        file::{REQUEST_BYTES, compressed_bytes},
        sight::Seen,
    },
};

/// A population is worth at most this share of what one would read instead.
const WORTH: f64 = 0.5;
/// So much is believed to have been spared before anything was.
const TRUST_BYTES: f64 = 1000.0;

/// What populations were to spare, and did.
#[derive(Debug, Default)]
pub(crate) struct Spared {
    hoped_bytes: f64,
    bytes: f64,
}

impl Spared {
    /// The share of what the next one promises that it will spare.
    fn share(&self) -> f64 {
        (self.bytes + TRUST_BYTES) / (self.hoped_bytes + TRUST_BYTES)
    }
}

/// A chunk of objects that has not been read, and those in it that are wanted.
#[derive(Debug)]
struct Chunk {
    cost_bytes: f64,
    wanted: Vec<ObjectId>,
}

/// Populations that were worth reading.
#[derive(Debug, Default)]
pub(crate) struct StandIns {
    members: HashMap<ObjectId, (Arc<Population>, usize)>,
    /// What could not be had, so that entries are read instead.
    pub(crate) failures: Vec<Error>,
}

impl StandIns {
    /// Reads what is worth it for some objects, but for those of which a start has told.
    pub(crate) async fn read<S: ByteSource>(scene: &Scene<S>, objects: &[ObjectId]) -> Self {
        let mut read = Self::default();
        let (Some(root), None) = (&scene.manifest().populations, &scene.manifest().whole) else {
            return read;
        };
        // What costs what: each population, and the chunks of objects that need not be read for it.
        let mut wanted: BTreeMap<u32, (PageEntry, HashMap<BlobName, Chunk>)> = BTreeMap::new();
        for object in objects {
            if scene.is_started(*object).await {
                continue;
            }
            let holders = match scene.leaf(root, object.0).await {
                Ok(population) => scene
                    .leaf(&scene.manifest().objects, object.0)
                    .await
                    .map(|chunk| population.zip(chunk)),
                Err(cause) => Err(cause),
            };
            match holders {
                Ok(Some((population, chunk))) if !scene.is_read(&chunk.url).await => {
                    let (_, chunks) = wanted.entry(population.first).or_insert((population, HashMap::new()));
                    let cost_bytes = cost_bytes("json", chunk.bytes);
                    let known = chunks.entry(chunk.url).or_insert(Chunk {
                        cost_bytes,
                        wanted: Vec::new(),
                    });
                    known.wanted.push(*object);
                }
                Ok(_) | Err(Error::GivenUp { .. }) => {}
                Err(cause) => {
                    read.failures.push(cause);
                    break;
                }
            }
        }
        for (entry, chunks) in wanted.into_values() {
            let hoped_bytes: f64 = chunks.values().map(|chunk| chunk.cost_bytes).sum();
            let is_new = !scene.is_read(&entry.url).await;
            let worth_bytes = WORTH * hoped_bytes * scene.spared().await.share();
            if is_new && cost_bytes("pop", entry.bytes) > worth_bytes {
                continue;
            }
            match scene.population(&entry).await {
                Ok(population) => {
                    read.take(&population, chunks.values().flat_map(|chunk| &chunk.wanted));
                    let is_spared = |chunk: &&Chunk| chunk.wanted.iter().all(|o| read.members.contains_key(o));
                    let mut spared = scene.spared().await;
                    spared.hoped_bytes += hoped_bytes;
                    spared.bytes += chunks
                        .values()
                        .filter(is_spared)
                        .map(|chunk| chunk.cost_bytes)
                        .sum::<f64>();
                }
                Err(Error::GivenUp { .. }) => {}
                Err(cause) => read.failures.push(cause),
            }
        }
        read
    }

    /// What stands for an object that fills so many steradians.
    pub(crate) async fn seen<S: ByteSource>(
        &self,
        scene: &Scene<S>,
        object: ObjectId,
        solid_angle_sr: f64,
    ) -> Option<Seen> {
        let (population, at) = self.members.get(&object)?;
        let member = &population.members[*at];
        let model = population.recipes[member.recipe].model;
        let geometry = scene.grown_model(population, member.recipe).await?;
        Some(Seen::stand_in(member, model, geometry, solid_angle_sr))
    }

    /// Its other members have been read, or are not asked for.
    fn take<'o>(&mut self, population: &Arc<Population>, wanted: impl Iterator<Item = &'o ObjectId>) {
        let wanted: HashSet<_> = wanted.collect();
        let members = population.members.iter().enumerate();
        let wanted = members.filter(|(_, member)| wanted.contains(&member.object));
        self.members
            .extend(wanted.map(|(at, member)| (member.object, (population.clone(), at))));
    }
}

fn cost_bytes(ext: &str, bytes: u64) -> f64 {
    compressed_bytes(ext, bytes) + REQUEST_BYTES
}

#[cfg(test)]
mod tests {
    use belvedere_scene::population::Member;

    use super::*;

    #[test]
    fn nothing_stands_for_members_that_are_not_asked_for() {
        let member = |object| Member {
            object: ObjectId(object),
            recipe: 0,
            position: [0.0; 3],
            rotation: [0.0, 0.0, 0.0, 1.0],
            scale: 1.0,
        };
        let population = Arc::new(Population {
            members: (0..4).map(member).collect(),
            ..Population::default()
        });
        let mut read = StandIns::default();
        read.take(&population, [ObjectId(1), ObjectId(7)].iter());
        assert_eq!(read.members.keys().collect::<Vec<_>>(), [&ObjectId(1)]);
    }
}
