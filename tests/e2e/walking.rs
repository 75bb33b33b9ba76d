//! A client walks: from cell to cell, through what a server or a folder gives.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{Arc, Mutex},
};

use belvedere_client::{ByteSource, Client, Error, FolderSource, HttpSource, Scene, Walk};
use belvedere_scene::{
    CellId, SceneName,
    record::{CellJson, CellRecord},
};

use bytes::Bytes;

use crate::program::{Data, THREE_ROOMS};

/// The side of a tile of a plan that does not state it.
const TILE_M: f64 = 1.0;

async fn open<S: ByteSource>(client: &Client<S>, scene: &str) -> Scene<S> {
    client
        .open(&scene.parse::<SceneName>().expect("a name"))
        .await
        .expect("a scene")
}

async fn names_visible_at<S: ByteSource>(scene: &Scene<S>, point: [f64; 3]) -> BTreeSet<String> {
    let located = scene.locate(point).await.expect("a cell");
    let record = scene.record(&located.cell).await.expect("a record");
    let infos = scene.visible(&record).await.expect("infos");
    infos.into_iter().map(|info| info.source_node).collect()
}

/// Whether anything of a room is seen.
fn sees(names: &BTreeSet<String>, room: &str) -> bool {
    names.iter().any(|name| name.split('/').next() == Some(room))
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_sees_what_stands_in_open_sight_and_not_what_a_wall_hides() {
    let data = Data::new();
    data.bake(&data.write("rooms.plan", THREE_ROOMS), "rooms");
    let server = data.serve();
    let scene = open(&server.client(), "rooms").await;

    // The upper left corner of the drawing is the origin.
    let at = |x: f64, z: f64| [x * TILE_M, 1.5, z * TILE_M];
    let west = names_visible_at(&scene, at(2.5, 2.5)).await;
    assert!(sees(&west, "Room A"), "from the west room: {west:?}");
    assert!(sees(&west, "Room B"), "through the doorway: {west:?}");
    assert!(!sees(&west, "Room C"), "the closed room is hidden: {west:?}");
    let closed = names_visible_at(&scene, at(10.5, 2.5)).await;
    assert!(
        sees(&closed, "Room C") && !sees(&closed, "Room A") && !sees(&closed, "Room B"),
        "from the closed room: {closed:?}"
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn the_static_tree_is_byte_for_byte_what_the_server_serves() {
    let data = Data::new();
    data.bake(&data.write("rooms.plan", THREE_ROOMS), "rooms");
    data.ok(&["publish", "rooms", "--to", "tree"]);
    let server = data.serve();
    let http = HttpSource::new(&server.base).expect("an address");
    let folder = FolderSource::new(data.folder("tree"));

    let mut paths = vec![
        "/v1/scenes/index.json".to_owned(),
        "/v1/scenes/rooms/index.json".to_owned(),
    ];
    for entry in std::fs::read_dir(data.folder("tree/o")).expect("blobs") {
        let name = entry.expect("an entry").file_name().into_string().expect("UTF-8");
        if name.matches('.').count() == 1 {
            paths.push(format!("/o/{name}"));
        }
    }
    assert!(paths.len() > 10, "only {paths:?}");
    for path in &paths {
        assert!(
            http.get(path).await.expect(path) == folder.get(path).await.expect(path),
            "{path} differs"
        );
    }

    let from_folder = open(&Client::new(folder), "rooms").await;
    let from_server = open(&server.client(), "rooms").await;
    let start = from_server.pointer().viewpoints[0].position;
    assert_eq!(
        names_visible_at(&from_folder, start).await,
        names_visible_at(&from_server, start).await
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn a_step_leads_to_the_same_record_as_the_record() {
    let data = Data::new();
    data.bake(&data.write("rooms.plan", THREE_ROOMS), "rooms");
    let server = data.serve();
    let scene = open(&server.client(), "rooms").await;
    let mut steps = 0;
    for id in 0..scene.pointer().cells {
        let cell = |id| scene.cell(id);
        let here = cell(CellId(id)).await.expect("the index").expect("a cell");
        let twin = scene.blob(&here.record_json).await.expect("a twin");
        let twin: CellJson = serde_json::from_slice(&twin).expect("a twin");
        assert_eq!(here.steps.is_some(), !here.adjacent.is_empty());
        for next in &here.adjacent {
            let next = cell(*next).await.expect("the index").expect("a cell");
            let there = scene.record(&next).await.expect("a record");
            let mut walk = Walk::start(&scene, next.clone()).await.expect("a start");
            walk.look_around().await.expect("steps");
            let record = walk.enter(here.clone()).await.expect("the way back").clone();
            assert_eq!(record, scene.record(&here).await.expect("a record"));
            assert_eq!(walk.enter(next.clone()).await.expect("the way there"), &there);

            let all = scene.steps(&next).await.expect("steps").expect("steps");
            let bytes = all.step(here.cell).expect("a step").len() as u64;
            assert_eq!(twin.bytes.delta[&next.cell], bytes);
            let crossing = twin.bytes.crossing[&next.cell] - bytes;
            assert!(crossing <= twin.bytes.visible_coarsest);
            let seen = |record: &CellRecord| record.visible().iter().map(|v| v.object).collect::<BTreeSet<_>>();
            assert!(crossing == 0 || !seen(&record).is_subset(&seen(&there)));
            steps += 1;
        }
    }
    assert!(steps > 1, "{steps} steps");
}

/// A cache in front of a server, as a CDN would be: whatever was asked for once never reaches the server again.
#[derive(Clone)]
struct Cache {
    origin: HttpSource,
    kept: Arc<Mutex<BTreeMap<String, Bytes>>>,
}

impl ByteSource for Cache {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        let kept = self.kept.lock().expect("the cache").get(path).cloned();
        if let Some(bytes) = kept {
            return Ok(bytes);
        }
        let bytes = self.origin.get(path).await?;
        self.kept
            .lock()
            .expect("the cache")
            .insert(path.to_owned(), bytes.clone());
        Ok(bytes)
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn behind_one_cold_cache_the_second_walk_costs_the_server_nothing() {
    let data = Data::new();
    data.bake(&data.write("rooms.plan", THREE_ROOMS), "rooms");
    let server = data.serve();
    let cache = Cache {
        origin: HttpSource::new(&server.base).expect("an address"),
        kept: Arc::default(),
    };
    let mut asked = Vec::new();
    for _ in 0..2 {
        let scene = open(&Client::new(cache.clone()), "rooms").await;
        let start = scene
            .locate(scene.pointer().viewpoints[0].position)
            .await
            .expect("a cell");
        let mut walk = Walk::start(&scene, start.cell).await.expect("a start");
        for _ in 0..4 {
            walk.look_around().await.expect("steps");
            let Some(next) = walk.cell().adjacent.first() else {
                break;
            };
            let next = scene.cell(*next).await.expect("the index").expect("a cell");
            walk.enter(next).await.expect("a record");
            scene.visible(walk.record()).await.expect("infos");
        }
        asked.push(
            cache
                .kept
                .lock()
                .expect("the cache")
                .keys()
                .cloned()
                .collect::<Vec<_>>(),
        );
    }
    assert_eq!(asked[0], asked[1]);
    let of = |ext: &str| asked[0].iter().filter(|path| path.ends_with(ext)).count();
    assert_eq!((of(".cell"), of(".steps") > 0), (1, true), "{:?}", asked[0]);
}

#[tokio::test(flavor = "multi_thread")]
async fn packs_hold_what_their_levels_hold_and_cost_a_cell_as_few_requests_as_the_manifest_says() {
    let data = Data::new();
    data.bake(&data.write("rooms.plan", THREE_ROOMS), "rooms");
    let server = data.serve();
    let (mut requests, mut alone) = (0, 0);
    let cells = open(&server.client(), "rooms").await.pointer().cells;
    for id in 0..cells {
        let cache = Cache {
            origin: HttpSource::new(&server.base).expect("an address"),
            kept: Arc::default(),
        };
        let scene = open(&Client::new(cache.clone()), "rooms").await;
        let cell = scene.cell(CellId(id)).await.expect("the index").expect("a cell");
        let record = scene.record(&cell).await.expect("a record");
        let infos = scene.visible(&record).await.expect("infos");
        let coarsest: Vec<_> = infos.iter().filter_map(|info| info.levels.last()).collect();
        let glbs = scene.glbs(&coarsest).await.expect("levels");
        let asked = |ext: &str| {
            let kept = cache.kept.lock().expect("the cache");
            kept.keys().filter(|path| path.ends_with(ext)).count()
        };
        requests += asked(".pack") + asked(".glb");
        assert!(asked(".pack") > 0);
        for (level, glb) in coarsest.iter().zip(&glbs) {
            assert_eq!(*glb, scene.blob(&level.url).await.expect("a level"));
        }
        alone += asked(".glb");
    }
    assert!(requests * 2 < alone, "{requests} requests instead of {alone}");
    let packs = open(&server.client(), "rooms").await.manifest().packs;
    let mean = requests as f64 / f64::from(cells);
    assert!(
        (packs.requests_per_cell - mean).abs() < 1e-9,
        "{packs:?}, {mean} counted"
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn every_cell_can_be_reached_by_the_index_and_names_only_objects_that_exist() {
    let data = Data::new();
    data.bake(&data.write("rooms.plan", THREE_ROOMS), "rooms");
    let server = data.serve();
    let scene = open(&server.client(), "rooms").await;
    for id in 0..scene.pointer().cells {
        let cell = scene
            .cell(belvedere_scene::CellId(id))
            .await
            .expect("the index")
            .expect("a cell");
        let middle = cell.bounds.center();
        let located = scene.locate(middle).await.expect("a cell");
        assert_eq!((located.cell.cell, located.distance_m), (cell.cell, 0.0));
        let record = scene.record(&cell).await.expect("a record");
        assert_eq!(record.adjacent, cell.adjacent);
        for portal in &record.portals {
            assert!(record.adjacent.contains(&portal.to));
        }
        for info in scene.visible(&record).await.expect("infos") {
            for level in &info.levels {
                let glb = scene.blob(&level.url).await.expect("a level");
                assert_eq!(glb.len() as u64, level.bytes);
            }
        }
    }
}
