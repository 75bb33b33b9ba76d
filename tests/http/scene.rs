//! A published scene made by hand: eight unit cells in a row along x, one object in the middle of each, four to a chunk.

#![allow(dead_code, reason = "each test binary uses a part")]

use std::{collections::BTreeMap, net::SocketAddr, time::Duration};

use belvedere::{
    commands::serve::serve,
    config::{Config, Settings},
    db::{Catalogue, NewRevision},
    place::PlaceArgs,
    store::BlobStore,
};
use belvedere_scene::{
    BlobHash, BlobName, Bounds, CellId, ModelId, ObjectId, Revision,
    index::{CellChunk, Page, PageEntry, PageKind},
    manifest::{Counts, FORMAT, Manifest, PackSummary, RecordSizes, VisibilitySummary},
    object::{Level, Model, ModelChunk, ObjectChunk, ObjectEntry},
    pointer::{Pointer, Viewpoint},
    record::{self, CellJson, CellRecord, Guarantee, Hull, Steps, Visible},
};
use tokio_util::sync::CancellationToken;

pub(crate) const CELLS: u32 = 8;
const A_CHUNK: usize = 4;
/// The object that is a door.
const DOOR: u32 = CELLS - 2;

/// A running server; dropped, it stops.
pub(crate) struct Server {
    pub(crate) address: SocketAddr,
    pub(crate) data: tempfile::TempDir,
    pub(crate) catalogue: Catalogue,
    pub(crate) blobs: BlobStore,
    pub(crate) stopping: CancellationToken,
    pub(crate) running: tokio::task::JoinHandle<anyhow::Result<()>>,
}

impl Drop for Server {
    fn drop(&mut self) {
        self.stopping.cancel();
    }
}

impl Server {
    pub(crate) async fn start() -> Self {
        Self::start_with(Settings::default()).await
    }

    /// A server with one scene, `row`.
    pub(crate) async fn start_with(settings: Settings) -> Self {
        Self::start_changed(settings, |_| {}).await
    }

    /// The same, with limits that are no settings changed.
    pub(crate) async fn start_changed(settings: Settings, change: impl FnOnce(&mut Config)) -> Self {
        let data = tempfile::tempdir().unwrap();
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        let blobs = BlobStore::open_folder(data.path(), 1 << 20).await.unwrap();
        publish(&catalogue, &blobs, "A row").await;
        let settings = settings.or(Settings {
            listen: Some(SocketAddr::from(([127, 0, 0, 1], 0))),
            place: PlaceArgs {
                data: Some(data.path().to_owned()),
                ..PlaceArgs::default()
            },
            poll_ms: Some(20),
            drain_s: Some(2),
            ..Settings::default()
        });
        let mut config = Config::try_from(settings).unwrap();
        change(&mut config);
        let stopping = CancellationToken::new();
        let (listening, address) = tokio::sync::oneshot::channel();
        let running = tokio::spawn(serve(config, stopping.clone(), |address| {
            listening.send(address).unwrap();
        }));
        let address = tokio::time::timeout(Duration::from_secs(30), address)
            .await
            .unwrap()
            .unwrap();
        Self {
            address,
            data,
            catalogue,
            blobs,
            stopping,
            running,
        }
    }
}

/// The bytes that stand for a level of detail; they do compress.
pub(crate) fn glb() -> Vec<u8> {
    (0..5000u32).flat_map(|i| (i / 3).to_le_bytes()).collect()
}

fn unit_box(i: u32, inset: f64) -> Bounds {
    let x = f64::from(i);
    Bounds {
        min: [x + inset, inset, inset],
        max: [x + 1.0 - inset, 1.0 - inset, 1.0 - inset],
    }
}

struct Blobs<'a> {
    store: &'a BlobStore,
    written: BTreeMap<BlobName, u64>,
}

impl Blobs<'_> {
    async fn put(&mut self, bytes: Vec<u8>, ext: &str) -> (BlobName, u64) {
        let (name, len) = (BlobName::of(&bytes, ext).unwrap(), bytes.len() as u64);
        self.store.put(&name, bytes.into()).await.unwrap();
        self.written.insert(name.clone(), len);
        (name, len)
    }

    async fn json<T: serde::Serialize>(&mut self, document: &T) -> (BlobName, u64) {
        self.put(serde_json::to_vec(document).unwrap(), "json").await
    }
}

fn entry((url, bytes): (BlobName, u64), first: u32, bounds: impl Iterator<Item = Bounds>) -> PageEntry {
    let all: Vec<_> = bounds.collect();
    PageEntry {
        kind: PageKind::Chunk,
        url,
        bytes,
        first,
        count: all.len() as u32,
        bounds: all.iter().fold(Bounds::EMPTY, |a, b| a.union(b)),
    }
}

fn cell_record(i: u32) -> CellRecord {
    let neighbours = [i.checked_sub(1), (i + 1 < CELLS).then_some(i + 1)];
    CellRecord {
        cell: CellId(i),
        hull: Hull::of_box(&unit_box(i, 0.0)),
        adjacent: neighbours.into_iter().flatten().map(CellId).collect(),
        portals: vec![],
        // One sees three cells far.
        cpvs: (0..CELLS)
            .filter(|c| *c != i && c.abs_diff(i) <= 3)
            .map(CellId)
            .collect(),
        opvs: (0..CELLS)
            .filter(|o| *o != i)
            .map(|o| Visible {
                object: ObjectId(o),
                fraction: 0.5,
                solid_angle_sr: 0.1,
                // The last object is seen through the door before it.
                doors: (o == CELLS - 1 && i < DOOR)
                    .then_some(ObjectId(DOOR))
                    .into_iter()
                    .collect(),
            })
            .collect(),
        lpvs: vec![Visible {
            object: ObjectId(i),
            fraction: 1.0,
            solid_angle_sr: 1.0,
            doors: vec![],
        }],
        method: "sampled".to_owned(),
        guarantee: Guarantee::Sampled,
        miss_bound: 0.0,
        visible_level0_bytes: 1,
        visible_coarsest_bytes: 1,
    }
}

/// Publishes a revision of the scene `row`; another title makes another revision.
pub(crate) async fn publish(catalogue: &Catalogue, store: &BlobStore, title: &str) -> Pointer {
    publish_as(catalogue, store, "row", title).await
}

/// The same as another scene. Scenes with different titles have all objects but the manifest in common.
pub(crate) async fn publish_as(catalogue: &Catalogue, store: &BlobStore, scene: &str, title: &str) -> Pointer {
    let mut blobs = Blobs {
        store,
        written: BTreeMap::new(),
    };
    let (url, bytes) = blobs.put(glb(), "glb").await;
    let level = Level {
        level: 0,
        url,
        bytes,
        triangles: 12,
        geometric_error_m: 0.0,
        switch_distance_m: 0.0,
        textures: vec![],
        pack: None,
    };
    let models = BTreeMap::from([(
        ModelId(0),
        Model {
            levels: vec![level],
            smooth: None,
            impostor: None,
            procedural: None,
        },
    )]);
    let written = blobs.json(&ModelChunk { models }).await;
    let models = entry(written, 0, [unit_box(0, 0.25)].into_iter());
    let (mut cells, mut objects) = (Page::default(), Page::default());
    let ids: Vec<u32> = (0..CELLS).collect();
    for ids in ids.chunks(A_CHUNK) {
        let mut chunk = CellChunk::default();
        for i in ids {
            let record = cell_record(*i);
            let binary = blobs.put(record.encode(), "cell").await;
            let neighbours: Vec<_> = record.adjacent.iter().map(|cell| cell_record(cell.0)).collect();
            let steps = blobs.put(Steps::between(&record, &neighbours).encode(), "steps").await;
            let json = blobs.json(&CellJson::of(&record, binary.1, &[])).await;
            chunk
                .cells
                .push(record::index_entry(&record, &[], binary, Some(steps), json.0));
        }
        let written = blobs.json(&chunk).await;
        cells
            .entries
            .push(entry(written, ids[0], ids.iter().map(|i| unit_box(*i, 0.0))));
        let chunk = ObjectChunk {
            objects: ids.iter().map(|i| object(*i)).collect(),
        };
        let written = blobs.json(&chunk).await;
        objects
            .entries
            .push(entry(written, ids[0], ids.iter().map(|i| unit_box(*i, 0.25))));
    }
    let bounds = (0..CELLS)
        .map(|i| unit_box(i, 0.25))
        .fold(Bounds::EMPTY, |a, b| a.union(&b));
    let viewpoints = vec![Viewpoint {
        name: "Start".to_owned(),
        position: [0.5; 3],
        orientation: [0.0, 0.0, 0.0, 1.0],
        cell: CellId(0),
        made_up: false,
    }];
    let counts = Counts {
        cells: CELLS,
        objects: CELLS,
        models: 1,
        triangles: 96,
    };
    let manifest = Manifest {
        format: FORMAT,
        title: title.to_owned(),
        bounds,
        up: "+Y".to_owned(),
        unit: "m".to_owned(),
        counts,
        bytes: BTreeMap::new(),
        viewpoints: viewpoints.clone(),
        visibility: VisibilitySummary {
            method: "sampled".to_owned(),
            guarantee: Guarantee::Sampled,
            mean_visible: f64::from(CELLS),
            mean_seen: f64::from(CELLS),
            mean_not_hidden: None,
            reason: "asked for".to_owned(),
        },
        occluders: None,
        foliage: None,
        packs: PackSummary::default(),
        records: RecordSizes::default(),
        cells,
        objects,
        models: Page { entries: vec![models] },
        populations: None,
        starts: Vec::new(),
        whole: None,
    };
    let bytes = serde_json::to_vec(&manifest).unwrap();
    let revision = Revision::of_manifest(BlobHash::of(&bytes));
    let (name, _) = blobs.put(bytes, "json").await;
    let pointer = Pointer {
        scene: scene.parse().unwrap(),
        title: title.to_owned(),
        revision,
        manifest: name,
        bounds,
        up: "+Y".to_owned(),
        unit: "m".to_owned(),
        cells: counts.cells,
        objects: counts.objects,
        models: counts.models,
        triangles: counts.triangles,
        bytes: BTreeMap::from([("source".to_owned(), 1)]),
        viewpoints,
    };
    let all: Vec<_> = blobs.written.into_iter().collect();
    catalogue
        .publish(&NewRevision {
            pointer: &pointer,
            source_key: title,
            sources: &[],
            report: &serde_json::Value::Null,
            blobs: &all,
            claim: None,
        })
        .await
        .unwrap();
    pointer
}

fn object(i: u32) -> ObjectEntry {
    let mut transform = [0.0; 16];
    for diagonal in [0, 5, 10, 15] {
        transform[diagonal] = 1.0;
    }
    ObjectEntry {
        object: ObjectId(i),
        source_node: format!("node[{i}]"),
        part: 0,
        bounds: unit_box(i, 0.25),
        transform,
        scale: 1.0,
        model: ModelId(0),
        mover: false,
        door: i == DOOR,
    }
}
