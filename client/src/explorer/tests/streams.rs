//! What becomes of a smooth LOD that turns out not to decode, and of rungs that go? And what is learnt of the line from what did not come over it?

use std::sync::{
    Mutex,
    atomic::{AtomicUsize, Ordering},
};

use belvedere_scene::{
    object::Model,
    rung::{RungName, SmoothLod},
};

use super::*;
use crate::{Ask, Watch, strategy::tests::smooth, testing::level};

/// Bytes of the only level: more than all rungs take.
static LEVEL: [u8; 200_000] = [7; 200_000];
const MATERIALS: [u8; 300] = [8; 300];
/// Where rungs end, and how far they are off: too far apart to come in one step.
const RUNGS: [(u64, f64); 2] = [(10_000, 0.5), (40_000, 0.0)];

/// Bytes that count as long as anybody keeps them.
struct Kept(Vec<u8>, Arc<AtomicUsize>);

impl Kept {
    fn bytes(content: Vec<u8>, count: &Arc<AtomicUsize>) -> Bytes {
        count.fetch_add(content.len(), Ordering::Relaxed);
        Bytes::from_owner(Self(content, count.clone()))
    }
}

impl AsRef<[u8]> for Kept {
    fn as_ref(&self) -> &[u8] {
        &self.0
    }
}

impl Drop for Kept {
    fn drop(&mut self) {
        self.1.fetch_sub(self.0.len(), Ordering::Relaxed);
    }
}

/// A tree with one model, which knows what was forgotten of it and how much of its rungs is in memory, and may have all of it on disk.
struct Tree {
    objects: Bare,
    rung_bytes: Arc<AtomicUsize>,
    is_kept: bool,
    forgotten: Mutex<Vec<BlobName>>,
}

impl ByteSource for Tree {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        match path.parse::<RungName>() {
            Ok(rung) => {
                let from = rung
                    .number
                    .checked_sub(1)
                    .map_or(0, |before| RUNGS[usize::from(before)].0);
                let content = vec![rung.number; (RUNGS[usize::from(rung.number)].0 - from) as usize];
                Ok(Kept::bytes(content, &self.rung_bytes))
            }
            Err(_) => self.objects.get(path).await,
        }
    }

    async fn get_watched(&self, ask: Ask<'_>, _: &mut Watch<'_>) -> Result<(Bytes, u64), Error> {
        let bytes = self.get(ask.path).await?;
        let carried = if self.is_kept { 0 } else { bytes.len() as u64 };
        Ok((bytes, carried))
    }

    fn forget_parts(&self, whole: &BlobName) {
        self.forgotten.lock().expect("the notes").push(whole.clone());
    }
}

fn named(bytes: &[u8], ext: &str) -> BlobName {
    BlobName::of(bytes, ext).expect("a name")
}

/// One looks at one object, drawn by a level or by fewer bytes of a stream.
async fn looking(is_kept: bool) -> (Explorer<Tree>, SmoothLod) {
    looking_within(u64::MAX, is_kept).await
}

async fn looking_within(memory_bytes: u64, is_kept: bool) -> (Explorer<Tree>, SmoothLod) {
    let (level, materials) = (level(&LEVEL), named(&MATERIALS, "gltf"));
    let objects = Bare::new()
        .with(&level.url, LEVEL.to_vec())
        .with(&materials, MATERIALS.to_vec());
    let smooth = SmoothLod {
        materials,
        ..smooth(1, &RUNGS)
    };
    let model = Model {
        levels: vec![level],
        smooth: Some(smooth.clone()),
        impostor: None,
        procedural: None,
    };
    let tree = Tree {
        objects,
        rung_bytes: Arc::default(),
        is_kept,
        forgotten: Mutex::default(),
    };
    let mut explorer = explorer(tree, memory_bytes).await;
    explorer.stand_in(place_with(1, vec![seen_at(1, 1, 2.0, 1.0, model)]));
    explorer.replan();
    (explorer, smooth)
}

impl Explorer<Tree> {
    /// What the model is drawn with when nothing more comes.
    async fn settled(&mut self) -> Form {
        while self.advance().await.is_some() {}
        self.mesh(ModelId(1)).expect("it is drawn").grade.form
    }
}

#[tokio::test]
async fn levels_take_the_place_of_a_stream_that_does_not_decode_and_it_is_forgotten_on_disk() {
    let (mut explorer, smooth) = looking(false).await;
    // It does not decode before its last rung has come, which would show that these are not its bytes.
    let first = loop {
        let events = explorer.advance().await.expect("rungs come");
        let drawn = events.into_iter().find_map(|event| match event {
            Event::Drawn { grade, .. } => Some(grade.form),
            _ => None,
        });
        if let Some(form) = drawn {
            break form;
        }
    };
    assert_eq!(first, Form::Rung);
    explorer.without_smooth(ModelId(1));
    assert_eq!(explorer.settled().await, Form::Level);
    let forgotten = explorer.scene.source().forgotten.lock().expect("the notes").clone();
    assert_eq!(forgotten, [smooth.url]);
    // What it was drawn with before stays, since nobody needs its memory.
    let before = RUNGS[0].0 as usize + MATERIALS.len();
    assert_eq!(explorer.memory_bytes(), (LEVEL.len() + before) as u64);
    // Of a model that has none, or that nobody knows, there is nothing to be said.
    explorer.without_smooth(ModelId(9));
    assert_eq!(explorer.settled().await, Form::Level);
}

#[tokio::test]
async fn rungs_that_go_for_want_of_memory_are_in_memory_no_longer() {
    // Room for the first rung of one model and its materials, and not for those of two.
    let (mut explorer, first) = looking_within(15_000, false).await;
    assert_eq!(explorer.settled().await, Form::Rung);
    for number in 2..6 {
        let model = Model {
            levels: vec![level(&LEVEL)],
            smooth: Some(SmoothLod {
                materials: first.materials.clone(),
                ..smooth(number, &RUNGS)
            }),
            impostor: None,
            procedural: None,
        };
        explorer.stand_in(place_with(number, vec![seen_at(number, number, 2.0, 1.0, model)]));
        explorer.look_around(CellId(number));
        explorer.replan();
        while explorer.advance().await.is_some() {}
        assert!(explorer.mesh(ModelId(number)).is_some(), "m{number} is drawn");
        let kept = explorer.scene.source().rung_bytes.load(Ordering::Relaxed);
        assert_eq!(kept as u64 + 300, explorer.memory_bytes());
    }
}

#[tokio::test]
async fn a_stream_that_is_not_what_its_name_promises_shows_when_its_last_rung_comes() {
    let (mut explorer, smooth) = looking(false).await;
    let mut told = Vec::new();
    while let Some(events) = explorer.advance().await {
        told.extend(events.into_iter().filter_map(|event| match event {
            Event::Problem(Error::Stream(name)) => Some(name),
            _ => None,
        }));
    }
    assert_eq!(told, [smooth.url]);
    assert_eq!(explorer.settled().await, Form::Level);
}

#[tokio::test]
async fn what_is_kept_on_disk_says_nothing_of_the_line() {
    for (is_kept, is_known) in [(false, true), (true, false)] {
        let (mut explorer, _) = looking(is_kept).await;
        explorer.settled().await;
        assert_eq!(explorer.meter.bytes_per_s().is_finite(), is_known);
    }
}

#[tokio::test]
async fn nor_does_what_could_not_be_had() {
    let mut explorer = explorer(Bare::new(), u64::MAX).await;
    explorer.stand_in(place(1, true));
    explorer.without_rules();
    while explorer.advance().await.is_some() {}
    assert_eq!(
        (explorer.missing(), explorer.meter.bytes_per_s()),
        (Some(1), f64::INFINITY)
    );
}
