//! What is seen of a bundle before all of it is here? And of a stream that came whole where a part was asked for?

use std::sync::Arc;

use belvedere_scene::object::Model;
use tokio::sync::Semaphore;

use super::*;
use crate::{
    Ask, Watch,
    testing::{level, silence, streamed},
};

fn model(glb: &[u8]) -> Model {
    Model {
        levels: vec![level(glb)],
        smooth: None,
        impostor: None,
        procedural: None,
    }
}

/// A tree whose bundle of two comes up to the end of the first, and goes on when it is let go, or breaks off there.
#[derive(Clone)]
struct Halting {
    tree: Arc<Bare>,
    members: [Bytes; 2],
    go: Arc<Semaphore>,
}

impl ByteSource for Halting {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        self.tree.get(path).await
    }

    async fn get_watched(&self, ask: Ask<'_>, watch: &mut Watch<'_>) -> Result<(Bytes, u64), Error> {
        if !ask.path.starts_with("/o/bundle/") {
            let bytes = self.get(ask.path).await?;
            let carried = bytes.len() as u64;
            return Ok((bytes, carried));
        }
        let [first, second] = self.members.each_ref().map(|member| member.len() as u32);
        let mut bundle = b"BVBN\x01\0\x02\0".to_vec();
        bundle.extend(first.to_le_bytes());
        bundle.extend((first + second).to_le_bytes());
        bundle.extend(&self.members[0]);
        watch(&bundle);
        match self.go.acquire().await {
            Ok(goes_on) => goes_on.forget(),
            Err(_) => return Err(silence(ask.path)),
        }
        bundle.extend(&self.members[1]);
        watch(&bundle);
        let carried = bundle.len() as u64;
        Ok((bundle.into(), carried))
    }

    fn offers_bundles(&self) -> bool {
        true
    }
}

#[tokio::test]
async fn what_has_come_of_a_bundle_is_drawn_while_the_rest_is_coming() {
    let mut members = [&b"a level"[..], b"another"].map(Bytes::from_static);
    members.sort_by_key(|member| level(member).url.to_string());
    let source = Halting {
        tree: Arc::new(Bare::new()),
        members: members.clone(),
        go: Arc::new(Semaphore::new(0)),
    };
    let mut explorer = explorer(source.clone(), u64::MAX).await;
    let seen = (0..)
        .zip(&members)
        .map(|(number, glb)| seen_at(number, number, 2.0, 1.0, model(glb)));
    explorer.stand_in(place_with(1, seen.collect()));
    explorer.replan();
    assert_eq!(explorer.under_way.len(), 1);
    let mut drawn = Vec::new();
    let mut note = |events: Vec<Event>| {
        drawn.extend(events.into_iter().filter_map(|event| match event {
            Event::Drawn { model, .. } => Some(model.0),
            _ => None,
        }));
        drawn.clone()
    };
    assert_eq!(note(explorer.advance().await.expect("the first")), [0]);
    assert_eq!((explorer.missing(), explorer.memory_bytes()), (Some(1), 7));
    source.go.add_permits(1);
    assert_eq!(note(explorer.advance().await.expect("the second")), [0, 1]);
    while explorer.advance().await.is_some() {}
    assert_eq!((explorer.missing(), explorer.memory_bytes()), (Some(0), 14));
    assert!(
        source.tree.asked().is_empty(),
        "nothing came alone: {:?}",
        source.tree.asked()
    );
}

#[tokio::test]
async fn of_a_bundle_that_breaks_off_only_the_rest_comes_alone() {
    let mut members = [&b"a level"[..], b"another"].map(Bytes::from_static);
    members.sort_by_key(|member| level(member).url.to_string());
    let with = |tree: Bare, member: &Bytes| tree.with(&level(member).url, member.clone());
    let source = Halting {
        tree: Arc::new(members.iter().fold(Bare::new(), with)),
        members: members.clone(),
        go: Arc::new(Semaphore::new(0)),
    };
    source.go.close();
    let mut explorer = explorer(source.clone(), u64::MAX).await;
    let seen = (0..)
        .zip(&members)
        .map(|(number, glb)| seen_at(number, number, 2.0, 1.0, model(glb)));
    explorer.stand_in(place_with(1, seen.collect()));
    explorer.replan();
    while explorer.advance().await.is_some() {}
    assert_eq!((explorer.missing(), explorer.memory_bytes()), (Some(0), 14));
    assert_eq!(source.tree.asked(), [level(&members[1]).url.url()]);
}

#[tokio::test]
async fn a_stream_that_came_whole_is_not_asked_for_again_and_that_is_said_once() {
    let materials = vec![9; 300];
    let mut tree = Bare::new().with(&BlobName::of(&materials, "gltf").expect("a name"), materials.clone());
    let (mut seen, mut streams) = (Vec::new(), Vec::new());
    for number in [1_u8, 2] {
        let (smooth, whole) = streamed(number, &[(10_000, 0.5), (30_000, 0.2), (40_000, 0.0)], &materials);
        let glb = vec![number; 200_000];
        tree = tree.with(&smooth.url, whole).with(&level(&glb).url, glb.clone());
        streams.push(smooth.url.url());
        let model = Model {
            smooth: Some(smooth),
            ..model(&glb)
        };
        seen.push(seen_at(u32::from(number), u32::from(number), 2.0, 1.0, model));
    }
    let mut explorer = explorer(tree, u64::MAX).await;
    explorer.stand_in(place_with(1, seen));
    explorer.replan();
    let mut problems = Vec::new();
    while let Some(events) = explorer.advance().await {
        problems.extend(events.into_iter().filter_map(|event| match event {
            Event::Problem(cause) => Some(cause.to_string()),
            _ => None,
        }));
    }
    let forms = [1, 2].map(|model| explorer.mesh(ModelId(model)).expect("it is drawn").grade.form);
    assert!(forms.contains(&Form::Rung) && forms.contains(&Form::Level), "{forms:?}");
    let asked = explorer.scene.source().asked();
    let times = asked.iter().filter(|path| streams.contains(path)).count();
    assert_eq!(times, 1, "{asked:?}");
    assert_eq!(problems.len(), 1, "{problems:?}");
    assert_eq!(explorer.memory_bytes(), 300 + 40_000 + 200_000);
}
