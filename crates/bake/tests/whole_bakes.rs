//! Does the whole bake hold together, on plans and on worlds that nobody here made?

#[path = "../../../tests/tools/scenes.rs"]
mod scenes;

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
    sync::Mutex,
};

use belvedere_bake::{
    BakeSettings, Host, Source, bake,
    defect::Defects,
    glb::lattice::LONGEST_STEP_M,
    import::{FileError, Imported, Limits, SourceFiles, import},
    progress::Silent,
    records::{BlobSink, SinkError, Written},
    visibility::{Method, SampledSettings, VisibilitySettings},
};
use belvedere_scene::{
    BlobHash, BlobName, CellId,
    index::CellChunk,
    object::{ModelChunk, ObjectChunk, ObjectInfo},
    record::CellRecord,
    start::Start,
};
use scenes::scenes;

/// Keeps blobs in memory.
#[derive(Default)]
struct Memory(Mutex<BTreeMap<BlobName, Vec<u8>>>);

impl BlobSink for Memory {
    fn put(&self, name: &BlobName, bytes: Vec<u8>) -> Result<(), SinkError> {
        assert_eq!(BlobHash::of(&bytes), name.hash());
        self.0
            .lock()
            .expect("no other thread has panicked")
            .insert(name.clone(), bytes);
        Ok(())
    }
}

struct Folder(PathBuf);

impl SourceFiles for Folder {
    fn read(&self, relative: &str, _: u64) -> Result<Vec<u8>, FileError> {
        std::fs::read(self.0.join(relative)).map_err(|_| FileError::Missing)
    }
}

struct Baked {
    written: Written,
    blobs: BTreeMap<BlobName, Vec<u8>>,
    defects: Defects,
}

fn baked(name: &str, bytes: Vec<u8>, folder: &Path, method: Method, rays_per_cell: u32) -> Baked {
    let files = Folder(folder.to_owned());
    let imported = import(name, bytes, &files, &Limits::default(), &Silent);
    let Imported { scene, mut defects } = imported.unwrap_or_else(|cause| panic!("{name}: {cause}"));
    let settings = BakeSettings {
        visibility: VisibilitySettings {
            sampled: Some(SampledSettings {
                rays_per_cell,
                ..SampledSettings::default()
            }),
            method,
        },
        ..BakeSettings::default()
    };
    let sink = Memory::default();
    let source = Source {
        scene,
        title: name.to_owned(),
        bytes: 0,
    };
    let written =
        bake(source, &settings, &mut defects, &Host::taking(&sink)).unwrap_or_else(|cause| panic!("{name}: {cause}"));
    Baked {
        written,
        blobs: sink.0.into_inner().expect("no thread has panicked"),
        defects,
    }
}

fn baked_plan(text: &str) -> Baked {
    baked(
        "test.plan",
        text.as_bytes().to_vec(),
        Path::new("."),
        Method::Auto,
        20_000,
    )
}

impl Baked {
    fn documents<T: serde::de::DeserializeOwned>(&self, has: &str) -> Vec<T> {
        let json = self
            .blobs
            .iter()
            .filter(|(name, _)| name.ext() == "json")
            .map(|(_, bytes)| bytes);
        json.filter(|bytes| bytes.starts_with(has.as_bytes()))
            .map(|bytes| serde_json::from_slice(bytes).expect("a document of the format"))
            .collect()
    }

    /// What must hold of every revision.
    fn check(&self, name: &str) {
        let manifest = &self.written.manifest;
        assert!(manifest.counts.cells > 0 && manifest.counts.objects > 0, "{name}");
        assert!(!manifest.viewpoints.is_empty(), "{name}");
        let sizes: BTreeMap<_, _> = self
            .blobs
            .iter()
            .map(|(name, bytes)| (name.clone(), bytes.len() as u64))
            .collect();
        assert_eq!(
            sizes,
            self.written.blobs.iter().cloned().collect(),
            "{name}: the list of blobs is what was stored"
        );
        let mut objects = BTreeMap::new();
        let models = self.documents::<ModelChunk>(r#"{"models":"#);
        let models: BTreeMap<_, _> = models.into_iter().flat_map(|chunk| chunk.models).collect();
        assert_eq!(models.len(), manifest.counts.models as usize, "{name}");
        for chunk in self.documents::<ObjectChunk>(r#"{"objects":"#) {
            for entry in chunk.objects {
                let info = ObjectInfo::join(&entry, &models[&entry.model]);
                let errors: Vec<_> = info.levels.iter().map(|l| l.geometric_error_m).collect();
                // Half a step of the lattice along each axis.
                let rounding_m = 0.5 * 3f64.sqrt() * LONGEST_STEP_M;
                assert!(
                    errors.is_sorted() && errors[0] <= 1.001 * rounding_m,
                    "{name}: {errors:?}"
                );
                for level in &info.levels {
                    assert_eq!(sizes.get(&level.url), Some(&level.bytes), "{name}");
                    assert!(
                        level.textures.iter().all(|t| sizes.get(&t.url) == Some(&t.bytes)),
                        "{name}"
                    );
                }
                objects.insert(entry.object, entry);
            }
        }
        assert_eq!(objects.len(), manifest.counts.objects as usize, "{name}");
        let mut cells = BTreeMap::new();
        for chunk in self.documents::<CellChunk>(r#"{"cells":"#) {
            for entry in chunk.cells {
                let record = CellRecord::decode(&self.blobs[&entry.record]).expect("a record");
                assert!(
                    record.visible().iter().all(|v| v.object.0 < manifest.counts.objects),
                    "{name}"
                );
                assert!(record.adjacent.iter().all(|c| c.0 < manifest.counts.cells), "{name}");
                assert!(sizes.contains_key(&entry.record_json), "{name}");
                cells.insert(entry.cell, (entry, record));
            }
        }
        assert_eq!(cells.len(), manifest.counts.cells as usize, "{name}");
        assert_eq!(manifest.starts.is_empty(), manifest.whole.is_some(), "{name}");
        for named in &manifest.starts {
            let start: Start = serde_json::from_slice(&self.blobs[&named.url]).expect("a start");
            let here = start.cell().expect("where one begins");
            assert_eq!((here.cell, here.bounds), (named.cell, named.bounds), "{name}");
            let next_door = |cell: &CellId| start.cells.iter().any(|entry| entry.cell == *cell);
            assert!(here.adjacent.iter().all(next_door), "{name}");
            assert_eq!(Some(&named.bytes), sizes.get(&named.url), "{name}");
            let mut seen = BTreeSet::new();
            for entry in &start.cells {
                let (indexed, record) = &cells[&entry.cell];
                assert_eq!(entry, indexed, "{name}");
                seen.extend(record.visible().iter().map(|visible| visible.object));
            }
            let seen: Vec<_> = seen.iter().map(|object| objects[object].clone()).collect();
            let used = seen.iter().map(|entry| (entry.model, models[&entry.model].clone()));
            assert_eq!(start.models, used.collect(), "{name}");
            assert_eq!(start.objects, seen, "{name}");
        }
    }
}

const PLAN: &str = "\
#############
#a..#..b#...#
#...+...#.c.#
###+#####...###
#..d....+...+e#
###############
";

/// The plan, baked by so many threads.
fn baked_by(threads: usize) -> Baked {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .expect("a pool");
    pool.install(|| baked_plan(PLAN))
}

#[test]
fn a_plan_bakes_to_a_revision_that_is_whole_and_the_same_for_one_two_and_eight_threads() {
    let one = baked_by(1);
    one.check("plan");
    assert_eq!(one.defects.iter().count(), 0);
    for threads in [2, 8] {
        let other = baked_by(threads).written;
        assert_eq!(other.revision(), one.written.revision(), "{threads} threads");
        assert_eq!(other.blobs, one.written.blobs, "{threads} threads");
    }
}

/// With bodies alone, which is quickest, and enough to see that all stages work together; what is seen is checked elsewhere.
const FEW_RAYS: u32 = 400;

#[test]
fn every_world_beside_this_checkout_bakes() {
    let Some(scenes) = scenes() else { return };
    for file in [
        "apartment/apartment.glb",
        "avatars/fox/Fox.gltf",
        "avatars/stag/Stag.gltf",
        "avatars/alien/Alien_Scolitex.gltf",
        "compressed/bridge-garden-meshopt.glb",
        "compressed/chess-board-draco.glb",
        "engine-cad/2CylinderEngine.glb",
        "instancing/GpuInstancesMetadata.gltf",
        "instancing/SimpleInstancing.glb",
        "level-zdm2/zdm2.glb",
        "museum-hall/hall.glb",
        "ship-textured/dutch_ship_medium_1k.gltf",
        "town/lamp/scene.gltf",
        "town/model/town_model.gltf",
        "town/tree/scene.gltf",
        "village-tiles/house-5-3.glb",
    ] {
        let path = scenes.join(file);
        let bytes = std::fs::read(&path).unwrap();
        baked(file, bytes, path.parent().unwrap(), Method::Occluders, FEW_RAYS).check(file);
    }
}

#[test]
fn every_ill_behaved_file_beside_this_checkout_is_refused_or_bakes_after_mending() {
    let Some(scenes) = scenes() else { return };
    let folder = scenes.join("edge-cases/ill-behaved");
    for file in [
        "IndexOutOfRange.gltf",
        "BoxBadNormals.glb",
        "IncorrectVertexArrays/Cube.gltf",
        "badUint.gltf",
    ] {
        let path = folder.join(file);
        let baked = baked(
            file,
            std::fs::read(&path).unwrap(),
            path.parent().unwrap(),
            Method::Occluders,
            FEW_RAYS,
        );
        baked.check(file);
        assert!(
            baked.defects.iter().count() > 0,
            "{file}: nothing is said of what was mended"
        );
    }
    for (file, reason) in [
        ("RecursiveNodes.gltf", "node below itself"),
        ("BoxWithInfinites.glb", "position that is not finite"),
        ("MissingBin/BoxTextured.gltf", "BoxTextured0.bin"),
        ("NoScene.gltf", "no node with a mesh"),
        ("SceneWithoutNodes.gltf", "no node with a mesh"),
        ("badArray.gltf", "/meshes/0/primitives"),
    ] {
        let path = folder.join(file);
        let files = Folder(path.parent().unwrap().to_owned());
        let bytes = std::fs::read(&path).unwrap();
        let refused = import(file, bytes, &files, &Limits::default(), &Silent);
        let cause = refused.map(drop).unwrap_err().to_string();
        assert!(cause.contains(reason), "{file}: {cause}");
    }
}
