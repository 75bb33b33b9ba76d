//! What is seen of a pack before all of it is here?

use std::sync::Arc;

use tokio::sync::Semaphore;

use super::*;
use crate::{
    Ask, Watch,
    testing::{Packed, packed},
};

const LEVELS: [&[u8]; 3] = [b"first", b"second", b"third"];
/// The first level, and the beginning of the second.
const BEGINNING: usize = 7;

/// How a pack ends that has begun.
type End = fn(Bytes) -> Result<Bytes, Error>;

/// A tree whose packs come up to some byte, and end when they are let go.
#[derive(Clone)]
struct Slow {
    tree: Arc<Bare>,
    beginning: usize,
    end: End,
    go: Arc<Semaphore>,
}

impl Slow {
    fn of(packed: &Packed, beginning: usize, end: End) -> Self {
        let tree = Bare::new().with(&packed.pack, packed.bytes.clone());
        let levels = packed.levels.iter().cloned();
        Self {
            tree: Arc::new(levels.fold(tree, |tree, (name, level)| tree.with(&name, level))),
            beginning,
            end,
            go: Arc::new(Semaphore::new(0)),
        }
    }
}

impl ByteSource for Slow {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        self.tree.get(path).await
    }

    async fn get_watched(&self, ask: Ask<'_>, watch: &mut Watch<'_>) -> Result<(Bytes, u64), Error> {
        let mut bytes = self.get(ask.path).await?;
        if ask.path.ends_with(".pack") {
            watch(&bytes[..self.beginning]);
            self.go.acquire().await.expect("it is never closed").forget();
            bytes = (self.end)(bytes)?;
        }
        watch(&bytes);
        let carried = bytes.len() as u64;
        Ok((bytes, carried))
    }
}

impl Explorer<Slow> {
    async fn looking_at(source: &Slow, seen: &[Seen], memory_bytes: u64) -> Self {
        let mut explorer = explorer(source.clone(), memory_bytes).await;
        explorer.stand_in(place_with(1, seen.to_vec()));
        explorer.replan();
        explorer
    }

    /// Models that are drawn from now on, up to when something has happened.
    async fn drawn(&mut self) -> Vec<u32> {
        let events = self.advance().await.expect("something is under way");
        let drawn = events.into_iter().filter_map(|event| match event {
            Event::Drawn { model, .. } => Some(model.0),
            _ => None,
        });
        drawn.collect()
    }

    /// Waits until nothing is under way; answers what went wrong.
    async fn end(&mut self, source: &Slow) -> Vec<Error> {
        source.go.add_permits(1);
        let mut problems = Vec::new();
        while let Some(events) = self.advance().await {
            problems.extend(events.into_iter().filter_map(|event| match event {
                Event::Problem(cause) => Some(cause),
                _ => None,
            }));
        }
        problems
    }

    fn glb(&self, model: u32) -> Option<Bytes> {
        match self.mesh(ModelId(model))?.geometry {
            Geometry::Glb(glb) => Some(glb),
            other => panic!("{other:?}"),
        }
    }
}

#[tokio::test]
async fn what_has_come_of_a_pack_is_drawn_while_the_rest_is_coming() {
    let packed = packed(&LEVELS);
    for memory_bytes in [u64::MAX, 1_000] {
        let source = Slow::of(&packed, BEGINNING, Ok);
        let mut explorer = Explorer::looking_at(&source, &packed.seen, memory_bytes).await;
        assert_eq!(explorer.drawn().await, [0]);
        assert_eq!((explorer.glb(0).as_deref(), explorer.glb(1)), (Some(LEVELS[0]), None));
        assert_eq!((explorer.missing(), explorer.progress().loaded_bytes), (Some(2), 5));
        assert!(explorer.end(&source).await.is_empty());
        let glbs = [0, 1, 2].map(|model| explorer.glb(model).expect("a level"));
        assert_eq!(glbs, LEVELS);
        assert_eq!(source.tree.asked(), [packed.pack.url()], "it came once");
        assert_eq!(explorer.memory_bytes(), packed.bytes.len() as u64);
        assert_eq!(explorer.planner.residency.peak_bytes(), packed.bytes.len() as u64);
    }
}

#[tokio::test]
async fn what_had_come_of_a_pack_stays_when_the_rest_does_not_come_or_is_damaged() {
    let packed = packed(&LEVELS);
    let cut: End = |_| {
        Err(Error::Fetch {
            path: String::new(),
            cause: "the connection was cut".to_owned(),
        })
    };
    let damaged: End = |bytes| {
        let mut bytes = bytes.to_vec();
        bytes[BEGINNING] ^= 1;
        Ok(bytes.into())
    };
    for (end, alone) in [(cut, &packed.levels[1..]), (damaged, &packed.levels[1..2])] {
        for memory_bytes in [u64::MAX, 1_000] {
            let source = Slow::of(&packed, BEGINNING, end);
            let mut explorer = Explorer::looking_at(&source, &packed.seen, memory_bytes).await;
            assert_eq!(explorer.drawn().await, [0]);
            assert_eq!(explorer.end(&source).await.len(), 1);
            let glbs = [0, 1, 2].map(|model| explorer.glb(model).expect("a level"));
            assert_eq!(glbs, LEVELS);
            let mut expected = vec![packed.pack.url()];
            expected.extend(alone.iter().map(|(name, _)| name.url()));
            assert_eq!(source.tree.asked(), expected);
            assert_eq!(explorer.planner.residency.asked_bytes(), 0);
        }
    }
}

#[tokio::test]
async fn a_pack_is_called_off_unless_all_has_come_that_was_wanted_of_it() {
    let packed = packed(&LEVELS);
    let two = packed.levels[0].1.len() + packed.levels[1].1.len();
    for (beginning, comes, cancelled) in [(BEGINNING, vec![0], 1), (two, vec![0, 1], 0)] {
        let source = Slow::of(&packed, beginning, Ok);
        let mut explorer = Explorer::looking_at(&source, &packed.seen[..2], u64::MAX).await;
        assert_eq!(explorer.drawn().await, comes);
        explorer.stand_in(place_with(2, Vec::new()));
        explorer.replan();
        assert_eq!(explorer.cancelled(), cancelled);
        explorer.end(&source).await;
        assert_eq!(explorer.glb(0).as_deref(), Some(LEVELS[0]), "what had come stays");
        let kept = if cancelled > 0 {
            LEVELS[0].len()
        } else {
            packed.bytes.len()
        };
        assert_eq!(explorer.memory_bytes(), kept as u64);
    }
}

/// A tree of packs that come up to some byte of the first, and no further.
struct Stuck {
    tree: Bare,
    first: String,
    beginning: usize,
}

impl ByteSource for Stuck {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        self.tree.get(path).await
    }

    async fn get_watched(&self, ask: Ask<'_>, watch: &mut Watch<'_>) -> Result<(Bytes, u64), Error> {
        let bytes = self.get(ask.path).await?;
        if ask.path.ends_with(".json") {
            let carried = bytes.len() as u64;
            return Ok((bytes, carried));
        }
        if ask.path == self.first {
            watch(&bytes[..self.beginning]);
        }
        std::future::pending().await
    }
}

#[tokio::test]
async fn a_pack_of_which_all_has_come_that_was_wanted_makes_room_for_what_waits() {
    const LARGE: usize = 30_000;
    for (rest, waits, cancelled) in [(20_000, true, 1), (10_000, true, 0), (20_000, false, 0)] {
        let levels: [Vec<u8>; 4] =
            std::array::from_fn(|number| vec![number as u8; if number < 3 { LARGE } else { rest }]);
        let first = packed(&levels.each_ref().map(Vec::as_slice));
        let mut seen = first.seen[..3].to_vec();
        let mut tree = Bare::new().with(&first.pack, first.bytes.clone());
        let others = if waits { 10..13_u8 } else { 10..11 };
        for number in others {
            let other = packed(&[&vec![number; 2 * LARGE]]);
            tree = tree
                .with(&other.levels[0].0, other.bytes.clone())
                .with(&other.pack, other.bytes.clone());
            seen.extend(other.seen.into_iter().map(|seen| Seen {
                object: belvedere_scene::ObjectId(u32::from(number)),
                model: ModelId(u32::from(number)),
                ..seen
            }));
        }
        let source = Stuck {
            tree,
            first: first.pack.url(),
            beginning: 3 * LARGE,
        };
        let mut explorer = explorer(source, u64::MAX).await;
        explorer.stand_in(place_with(1, seen));
        explorer.replan();
        let asked = explorer.under_way.len();
        explorer.advance().await.expect("three levels");
        assert_eq!(
            (0..3).filter(|model| explorer.mesh(ModelId(*model)).is_some()).count(),
            3
        );
        assert_eq!(explorer.cancelled(), cancelled, "{rest} bytes to come, {waits}");
        assert_eq!(explorer.under_way.len(), asked, "what waited took its place");
    }
}
