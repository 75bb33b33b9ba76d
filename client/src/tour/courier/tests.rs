//! What comes when, what of it is of use, and what is it counted as?

use std::sync::Mutex;

use belvedere_scene::{BlobName, object::Model};

use super::*;
use crate::{
    Ask, Watch,
    strategy::{
        grade::Form,
        order::{Budgets, View},
        plan::Held,
        sight::{Eye, Seen},
        tests::seen_at,
    },
    testing::{self, Bare, level, packed, streamed},
};

#[tokio::test]
async fn files_in_a_pack_are_here_when_the_line_has_carried_the_pack_up_to_where_they_end() {
    let packed = packed(&[&[1; 150], &[2; 300], &[3; 150]]);
    let line = Line {
        bits_per_s: 8000.0,
        latency_ms: 100.0,
    };
    let tree = Bare::new().with(&packed.pack, packed.bytes.clone());
    let scene = testing::open(Metered::new(tree)).await;
    scene.source().take();
    for memory_bytes in [u64::MAX, 1_000] {
        let mut courier = Courier::on(line, &scene);
        let mut planner = Planner::new(Budgets {
            memory_bytes,
            ..Budgets::default()
        });
        let view = View {
            eye: Eye::at([0.0; 3]),
            here: &packed.seen,
            is_all_known: true,
            ahead: Vec::new(),
        };
        planner.plan(&view, f64::INFINITY);
        let order = planner.next(&mut Vec::new()).expect("a pack");
        courier.fetch(&order, &mut planner, 0.0).await;
        // 600 bytes and 400 of headers take a second, from 100 ms on.
        let mut came = Vec::new();
        while courier.next_ms() < f64::INFINITY {
            let now_ms = courier.next_ms();
            assert!(!courier.receive(&mut planner, now_ms - 1.0).any);
            assert!(courier.receive(&mut planner, now_ms).any);
            came.push((now_ms, planner.settle().len()));
        }
        assert_eq!(came, [(350.0, 1), (850.0, 1), (1100.0, 1)]);
        assert_eq!([planner.residency.bytes(), planner.residency.peak_bytes()], [600, 600]);
    }
}

/// Eight kilobits a second: a kilobyte takes a second.
const SLOW: Line = Line {
    bits_per_s: 8000.0,
    latency_ms: 0.0,
};

fn within(memory_bytes: u64) -> Planner {
    Planner::new(Budgets {
        memory_bytes,
        ..Budgets::default()
    })
}

fn looking_at(here: &[Seen]) -> View<'_> {
    View {
        eye: Eye::at([0.0; 3]),
        here,
        is_all_known: true,
        ahead: Vec::new(),
    }
}

/// Fetches all that is wanted, one after the other.
async fn settle<S: ByteSource>(courier: &mut Courier<'_, S>, planner: &mut Planner, here: &[Seen]) {
    let mut now_ms = 0.0;
    loop {
        planner.plan(&looking_at(here), courier.bytes_per_s());
        let Some(order) = planner.next(&mut Vec::new()) else {
            break;
        };
        courier.fetch(&order, planner, now_ms).await;
        while courier.next_ms() < f64::INFINITY {
            now_ms = now_ms.max(courier.next_ms());
            courier.receive(planner, now_ms);
            planner.settle();
        }
    }
}

#[tokio::test]
async fn a_server_that_ignores_ranges_sends_one_stream_whole_and_is_asked_for_no_other() {
    let materials = vec![9; 300];
    for memory_bytes in [u64::MAX, 300_000] {
        let mut tree = Bare::new().with(&BlobName::of(&materials, "gltf").expect("a name"), materials.clone());
        let mut seen = Vec::new();
        let mut streams = Vec::new();
        for number in [1_u8, 2] {
            let (smooth, whole) = streamed(number, &[(10_000, 0.5), (30_000, 0.2), (40_000, 0.0)], &materials);
            let glb = vec![number; 200_000];
            tree = tree.with(&smooth.url, whole).with(&level(&glb).url, glb.clone());
            streams.push(smooth.clone());
            let model = Model {
                levels: vec![level(&glb)],
                smooth: Some(smooth),
                impostor: None,
                procedural: None,
            };
            seen.push(seen_at(
                u32::from(number),
                u32::from(number),
                2.0,
                1.0 / f64::from(number),
                model,
            ));
        }
        let scene = testing::open(Metered::new(tree)).await;
        scene.source().take();
        let (mut courier, mut planner) = (Courier::on(SLOW, &scene), within(memory_bytes));
        settle(&mut courier, &mut planner, &seen).await;
        let forms = seen
            .iter()
            .map(|seen| planner.residency.held(seen.model).expect("it is drawn").form);
        assert_eq!(forms.collect::<Vec<_>>(), [Form::Rung, Form::Level]);
        let asked = scene.source().asked();
        let times = |path: String| asked.iter().filter(|asked| **asked == path).count();
        assert_eq!(
            [times(streams[0].url.url()), times(streams[1].url.url())],
            [1, 0],
            "{asked:?}"
        );
        let rungs = asked.iter().filter(|path| path.contains(".r")).count();
        assert_eq!(rungs, 1, "who has no rungs is not asked for them again: {asked:?}");
        assert_eq!(planner.residency.bytes(), 300 + 40_000 + 200_000);
        let tour = courier.end().await;
        assert_eq!(tour.lost_files, 0);
        assert_eq!(tour.first_failures.len(), 1, "{:?}", tour.first_failures);
        assert!(
            tour.first_failures[0].contains("asked for no more parts"),
            "{:?}",
            tour.first_failures
        );
        assert_eq!((tour.bytes.needed, tour.bytes.failed), (300 + 40_000 + 200_000, 0));
    }
}

#[tokio::test]
async fn a_stream_is_taken_whole_where_there_is_nothing_else_and_what_finds_no_room_is_in_vain() {
    let materials = vec![9; 300];
    for (memory_bytes, failed) in [(u64::MAX, 0), (10_450, 20_000)] {
        let mut tree = Bare::new().with(&BlobName::of(&materials, "gltf").expect("a name"), materials.clone());
        let mut seen = Vec::new();
        let many = if failed == 0 { 2 } else { 1 };
        for number in 1..=many {
            let (smooth, whole) = streamed(number, &[(10_000, 0.5), (30_000, 0.0)], &materials);
            tree = tree.with(&smooth.url, whole);
            let model = Model {
                levels: Vec::new(),
                smooth: Some(smooth),
                impostor: None,
                procedural: None,
            };
            seen.push(seen_at(u32::from(number), u32::from(number), 2.0, 1.0, model));
        }
        let scene = testing::open(Metered::new(tree)).await;
        scene.source().take();
        let (mut courier, mut planner) = (Courier::on(SLOW, &scene), within(memory_bytes));
        settle(&mut courier, &mut planner, &seen).await;
        assert!(seen.iter().all(|seen| planner.residency.held(seen.model).is_some()));
        let tour = courier.end().await;
        assert_eq!(tour.lost_files, 0, "{:?}", tour.first_failures);
        assert_eq!(tour.bytes.failed, failed);
        assert_eq!(tour.bytes.needed + tour.bytes.failed, 300 + 30_000 * u64::from(many));
    }
}

/// A tree that brings each of its files only after so many bytes in vain, or never.
struct Wasteful {
    tree: Bare,
    vain_bytes: u64,
    comes: bool,
}

impl ByteSource for Wasteful {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        self.tree.get(path).await
    }

    async fn get_watched(&self, ask: Ask<'_>, _: &mut Watch<'_>) -> Result<(Bytes, u64), Error> {
        let bytes = self.tree.get(ask.path).await?;
        let is_document = ask.path.ends_with(".json");
        let count = ask.count.expect("somebody counts");
        count.note(if is_document { 0 } else { self.vain_bytes });
        if !self.comes && !is_document {
            return Err(testing::silence(ask.path));
        }
        let carried = bytes.len() as u64;
        count.note(carried);
        Ok((bytes, carried))
    }
}

#[tokio::test]
async fn what_came_in_vain_takes_its_time_on_the_line_and_is_told_apart() {
    let glb = vec![1; 600];
    let model = Model {
        levels: vec![level(&glb)],
        smooth: None,
        impostor: None,
        procedural: None,
    };
    let seen = [seen_at(1, 1, 2.0, 1.0, model)];
    // 400 bytes of headers for each answer.
    for (comes, there_ms, needed) in [(true, 700.0 + 1000.0, 600), (false, 700.0, 0)] {
        let source = Wasteful {
            tree: Bare::new().with(&level(&glb).url, glb.clone()),
            vain_bytes: 300,
            comes,
        };
        let scene = testing::open(Metered::new(source)).await;
        scene.source().take();
        let (mut courier, mut planner) = (Courier::on(SLOW, &scene), within(u64::MAX));
        planner.plan(&looking_at(&seen), f64::INFINITY);
        let order = planner.next(&mut Vec::new()).expect("a level");
        courier.fetch(&order, &mut planner, 0.0).await;
        assert_eq!(courier.next_ms(), there_ms);
        assert_eq!(courier.arrived_bytes(there_ms), needed + 300);
        let tour = courier.end().await;
        assert_eq!((tour.bytes.needed, tour.bytes.failed), (needed, 300));
        assert_eq!(tour.requests, 1);
    }
}

/// A tree that brings small files together, damaged where that is wanted.
struct Bundling {
    tree: Bare,
    members: Mutex<Vec<Bytes>>,
}

impl ByteSource for Bundling {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        if !path.starts_with("/o/bundle/") {
            return self.tree.get(path).await;
        }
        let members = self.members.lock().expect("the members");
        let (mut end, mut bundle) = (0, b"BVBN\x01\0".to_vec());
        bundle.extend((members.len() as u16).to_le_bytes());
        for member in &*members {
            end += member.len() as u32;
            bundle.extend(end.to_le_bytes());
        }
        bundle.extend(members.iter().flatten());
        Ok(bundle.into())
    }

    fn offers_bundles(&self) -> bool {
        true
    }
}

/// An object for each file, with that as its only level.
fn one_for_each(files: &[Vec<u8>]) -> Vec<Seen> {
    let object = |(number, file): (u32, &Vec<u8>)| {
        let model = Model {
            levels: vec![level(file)],
            smooth: None,
            impostor: None,
            procedural: None,
        };
        seen_at(number, number, 2.0, 1.0, model)
    };
    (1..).zip(files).map(object).collect()
}

#[tokio::test]
async fn members_of_a_bundle_are_here_when_the_line_has_carried_it_up_to_where_they_end() {
    let mut files: Vec<Vec<u8>> = [200, 200, 300].map(|bytes| vec![bytes as u8; bytes]).to_vec();
    files[1][0] = 1;
    let seen = one_for_each(&files);
    files.sort_by_key(|file| level(file).url.to_string());
    for damaged in [None, Some(1)] {
        let mut members: Vec<Bytes> = files.iter().cloned().map(Bytes::from).collect();
        if let Some(at) = damaged {
            members[at] = vec![0; files[at].len()].into();
        }
        let source = Bundling {
            tree: files
                .iter()
                .fold(Bare::new(), |tree, file| tree.with(&level(file).url, file.clone())),
            members: Mutex::new(members),
        };
        let scene = testing::open(Metered::new(source)).await;
        scene.source().take();
        let (mut courier, mut planner) = (Courier::on(SLOW, &scene), within(u64::MAX));
        planner.offer_bundles(true);
        planner.plan(&looking_at(&seen), f64::INFINITY);
        let order = planner.next(&mut Vec::new()).expect("a bundle");
        assert_eq!(order.files.len(), 3);
        courier.fetch(&order, &mut planner, 0.0).await;
        let mut came = Vec::new();
        while courier.next_ms() < f64::INFINITY {
            let now_ms = courier.next_ms();
            assert!(!courier.receive(&mut planner, now_ms - 1.0).any);
            courier.receive(&mut planner, now_ms);
            came.extend(vec![now_ms; planner.settle().len()]);
        }
        assert_eq!(came.len(), 3);
        // 720 bytes and 400 of headers.
        let alone_ms = damaged.map_or(0.0, |at| (400 + files[at].len()) as f64);
        let mut end = 20.0;
        let mut expected: Vec<f64> = Vec::new();
        for (at, file) in files.iter().enumerate() {
            end += file.len() as f64;
            expected.push(if damaged == Some(at) {
                1120.0 + alone_ms
            } else {
                1120.0 * end / 720.0
            });
        }
        expected.sort_by(f64::total_cmp);
        for (came, expected) in came.iter().zip(&expected) {
            assert!((came - expected).abs() < 1e-6, "{came} instead of {expected}");
        }
        let tour = courier.end().await;
        assert_eq!(tour.bytes.failed, damaged.map_or(0, |at| files[at].len() as u64));
        assert_eq!(tour.ways.bundles.bytes + tour.bytes.failed, 720 + tour.bytes.failed);
    }
}

/// A tree whose bundles break off after their first member.
struct Breaking(Bundling);

impl ByteSource for Breaking {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        self.0.get(path).await
    }

    async fn get_watched(&self, ask: Ask<'_>, watch: &mut Watch<'_>) -> Result<(Bytes, u64), Error> {
        let mut bytes = self.get(ask.path).await?;
        let is_bundle = ask.path.starts_with("/o/bundle/");
        if is_bundle {
            bytes.truncate(16 + 200);
        }
        watch(&bytes);
        let carried = bytes.len() as u64;
        ask.count.expect("somebody counts").note(carried);
        match is_bundle {
            true => Err(testing::silence(ask.path)),
            false => Ok((bytes, carried)),
        }
    }

    fn offers_bundles(&self) -> bool {
        true
    }
}

#[tokio::test]
async fn what_came_of_a_bundle_before_it_broke_off_is_not_in_vain() {
    let mut files = [1, 2].map(|byte| vec![byte; 200]);
    files.sort_by_key(|file| level(file).url.to_string());
    let seen = one_for_each(&files);
    let with = |tree: Bare, file: &Vec<u8>| tree.with(&level(file).url, file.clone());
    let source = Breaking(Bundling {
        tree: files.iter().fold(Bare::new(), with),
        members: Mutex::new(files.iter().cloned().map(Bytes::from).collect()),
    });
    let scene = testing::open(Metered::new(source)).await;
    scene.source().take();
    let (mut courier, mut planner) = (Courier::on(SLOW, &scene), within(u64::MAX));
    planner.offer_bundles(true);
    settle(&mut courier, &mut planner, &seen).await;
    let tour = courier.end().await;
    assert_eq!((tour.bytes.needed, tour.bytes.failed), (400, 16), "only the table");
    assert_eq!((tour.requests, tour.lost_files), (2, 0));
}
