//! The oracle passes what is right and names what is wrong: it looks only at what is published, so a changed record is
//! enough to make it fail.

use belvedere::{
    db::{Catalogue, NewRevision},
    store::BlobStore,
};
use belvedere_scene::{
    BlobName, CellId, ObjectId, Revision, SceneName,
    index::{CellChunk, PageKind},
    manifest::Manifest,
    record::{CellRecord, Guarantee},
};

use crate::{
    boxes::{TWO_ROOMS, askew, two_rooms},
    program::{Data, THREE_ROOMS, text},
};

/// A published scene that can be changed behind the program's back.
struct Tampering {
    catalogue: Catalogue,
    store: BlobStore,
    scene: SceneName,
}

impl Tampering {
    async fn with(data: &Data, scene: &str) -> Self {
        Self {
            catalogue: Catalogue::open(&data.path()).await.expect("a catalogue"),
            store: BlobStore::open_folder(&data.path(), 1 << 20).await.expect("a store"),
            scene: scene.parse().expect("a name"),
        }
    }

    async fn read(&self, name: &BlobName) -> Vec<u8> {
        let bytes = self.store.get(name).await.expect("the store answers").expect("a blob");
        bytes.to_vec()
    }

    async fn write(&self, bytes: Vec<u8>, ext: &str, written: &mut Vec<(BlobName, u64)>) -> BlobName {
        let name = BlobName::of(&bytes, ext).expect("a name");
        written.push((name.clone(), bytes.len() as u64));
        self.store.put(&name, bytes.into()).await.expect("stored");
        name
    }

    /// Publishes the scene again with the record of its first cell changed.
    async fn change_first_record(&self, change: impl FnOnce(&mut CellRecord)) {
        let baked = self
            .catalogue
            .baked(&self.scene)
            .await
            .expect("an answer")
            .expect("a scene");
        let mut blobs = self
            .catalogue
            .blobs_of(&self.scene, baked.pointer.revision)
            .await
            .expect("its blobs");
        let mut pointer = baked.pointer;
        let mut manifest: Manifest = serde_json::from_slice(&self.read(&pointer.manifest).await).expect("a manifest");
        let entry = &mut manifest.cells.entries[0];
        assert_eq!(entry.kind, PageKind::Chunk, "a small world has one level of pages");
        let mut chunk: CellChunk = serde_json::from_slice(&self.read(&entry.url).await).expect("a chunk");
        let mut record = CellRecord::decode(&self.read(&chunk.cells[0].record).await).expect("a record");
        change(&mut record);
        chunk.cells[0].record = self.write(record.encode(), "cell", &mut blobs).await;
        let json = serde_json::to_vec(&chunk).expect("JSON");
        entry.url = self.write(json, "json", &mut blobs).await;
        let json = serde_json::to_vec(&manifest).expect("JSON");
        pointer.manifest = self.write(json, "json", &mut blobs).await;
        pointer.revision = Revision::of_manifest(pointer.manifest.hash());
        let new = NewRevision {
            pointer: &pointer,
            source_key: "changed by hand",
            sources: &[],
            report: &baked.report,
            blobs: &blobs,
            claim: None,
        };
        self.catalogue.publish(&new).await.expect("published");
    }
}

/// Removes the entry with the largest solid angle; gives what was removed and from where.
async fn lose_the_largest(tampering: &Tampering) -> (CellId, ObjectId) {
    let mut lost = None;
    tampering
        .change_first_record(|record| {
            let object = record.visible()[0].object;
            record.opvs.retain(|visible| visible.object != object);
            record.lpvs.retain(|visible| visible.object != object);
            // The bake chose; here the record only says what it saw.
            record.guarantee = Guarantee::Sampled;
            lost = Some((record.cell, object));
        })
        .await;
    lost.expect("a record was changed")
}

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).expect("JSON")
}

const FEW: [&str; 4] = ["--eyes", "60", "--size", "128"];

fn verify<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&["verify", "rooms"], &FEW[..], more].concat()
}

#[test]
fn a_baked_scene_is_clean_and_its_figures_agree_with_each_other() {
    let data = Data::new();
    let baked = data.bake(&data.write("rooms.plan", THREE_ROOMS), "rooms");
    let report = json(&data.ok(&verify(&["--json"])));
    assert_eq!(report["revision"], baked["revision"]);
    assert_eq!(report["cells"], baked["cells"]);
    assert_eq!(
        (&report["missed_objects"], &report["worst"]),
        (&0.into(), &serde_json::Value::Null)
    );
    assert_eq!(report["false_negative_rate"], 0.0);
    let eyes = report["eyes"].as_u64().expect("a count");
    assert_eq!(eyes, 60.max(baked["cells"].as_u64().expect("a count")));
    // Floor and walls fill a good part of every view; the rest is sky.
    let pixels = report["pixels"].as_u64().expect("a count");
    assert!(pixels > eyes * 6 * 128 * 128 / 10 && pixels <= eyes * 6 * 128 * 128);
    let tightness = report["tightness_mean"].as_f64().expect("a ratio");
    assert!((1.0..20.0).contains(&tightness), "{tightness}");

    let table = data.ok(&verify(&[]));
    assert!(
        table.contains("missed objects") && table.contains("passed: "),
        "{table}"
    );
    assert_eq!(json(&data.ok(&verify(&["--json", "--seed", "2"])))["passed"], true);
}

#[tokio::test(flavor = "multi_thread")]
async fn an_object_that_is_taken_out_of_a_record_is_named_with_its_cell_and_an_eye() {
    let data = Data::new();
    data.bake(&data.write("rooms.plan", THREE_ROOMS), "rooms");
    let tampering = Tampering::with(&data, "rooms").await;
    let (cell, object) = lose_the_largest(&tampering).await;

    let failed = data.run(&verify(&["--json", "--picture", "worst.png"]));
    assert_eq!(failed.status.code(), Some(1));
    let report = json(&text(&failed.stdout));
    assert_eq!(report["passed"], false);
    assert_eq!(report["missed_objects"], 1);
    let worst = &report["worst"];
    assert_eq!(worst["cell"], cell.to_string());
    assert_eq!(worst["object"], object.to_string());
    assert!(worst["pixels"].as_u64() > Some(4));
    assert!(report["false_negative_rate"].as_f64() > Some(1e-4));
    let message = text(&failed.stderr);
    for part in [cell.to_string(), object.to_string(), worst["eye"][0].to_string()] {
        assert!(message.contains(&part), "{part} in {message}");
    }
    let picture = std::fs::read(data.folder("worst.png")).expect("a picture");
    assert!(picture.starts_with(b"\x89PNG"));

    // Every other cell is still right.
    let other = json(&data.ok(&verify(&["--json", "--cell", "c1"])));
    assert_eq!((&other["passed"], &other["cells"]), (&true.into(), &1.into()));
    let table = text(&data.run(&verify(&["--cell", "c0"])).stdout);
    assert!(
        table.contains(&object.to_string()) && table.contains("failed: "),
        "{table}"
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn what_a_record_wrongly_hides_behind_a_closed_door_is_named_with_the_door() {
    let data = Data::new();
    data.bake(&data.write("rooms.glb", two_rooms()), "rooms");
    let right = json(&data.ok(&verify(&["--json"])));
    let closed = &right["closed"];
    assert_eq!(
        (&closed["doors"], &closed["missed_objects"]),
        (&1.into(), &0.into()),
        "{closed}"
    );
    assert!(closed["eyes"].as_u64() >= Some(50), "{closed}");
    let table = data.ok(&verify(&[]));
    assert!(table.contains("with doors closed: 1 doors"), "{table}");

    let door = closed["loosest"]["closed"][0].as_str().expect("the door is named");
    let door: ObjectId = door.parse().expect("an object");

    // What fills most of the view is said to vanish with the door.
    let tampering = Tampering::with(&data, "rooms").await;
    let mut changed = None;
    tampering
        .change_first_record(|record| {
            let entries = record.opvs.iter_mut().chain(&mut record.lpvs);
            let largest = entries.filter(|visible| visible.object != door && visible.doors.is_empty());
            let largest = largest.max_by(|a, b| a.solid_angle_sr.total_cmp(&b.solid_angle_sr));
            let largest = largest.expect("an entry that no door hides");
            largest.doors = vec![door];
            changed = Some((record.cell, largest.object));
        })
        .await;
    let (cell, object) = changed.expect("a record was changed");
    let failed = data.run(&verify(&["--json"]));
    assert_eq!(failed.status.code(), Some(1));
    let report = json(&text(&failed.stdout));
    assert_eq!(
        (&report["passed"], &report["missed_objects"]),
        (&false.into(), &0.into())
    );
    let (closed, worst) = (&report["closed"], &report["closed"]["worst"]);
    assert_eq!(closed["missed_objects"], 1, "{closed}");
    assert_eq!(
        (&worst["cell"], &worst["object"]),
        (&cell.to_string().into(), &object.to_string().into())
    );
    assert_eq!(worst["closed"], serde_json::json!([door.to_string()]));
    assert_eq!(worst["closed_nodes"], serde_json::json!(["door:between"]));
    let message = text(&failed.stderr);
    for part in ["with doors closed", "`door:between`", &object.to_string()] {
        assert!(message.contains(part), "{part} in {message}");
    }
    let table = text(&data.run(&verify(&["--cell", &cell.to_string()])).stdout);
    assert!(
        table.contains("`door:between`") && table.contains("failed: "),
        "{table}"
    );
}

#[test]
fn what_is_not_there_is_said_with_what_is() {
    let data = Data::new();
    let nothing = data.fails(&["verify", "rooms"]);
    assert!(nothing.contains("belvedere bake"), "{nothing}");
    data.bake(&data.write("rooms.plan", THREE_ROOMS), "rooms");
    let other = data.fails(&["verify", "town"]);
    assert!(other.contains("`town`") && other.contains("rooms"), "{other}");
    let beyond = data.fails(&["verify", "rooms", "--cell", "c9999"]);
    assert!(beyond.contains("c9999"), "{beyond}");
    assert!(!data.run(&["verify", "rooms", "--size", "4"]).status.success());
}

#[test]
fn a_world_that_stands_askew_is_cut_along_its_walls_and_lacks_nothing() {
    let data = Data::new();
    let cells = |degrees: f64, scene: &str| {
        let report = data.bake(&data.write("world.glb", askew(&TWO_ROOMS, degrees)), scene);
        let checked = json(&data.ok(&["verify", scene, "--json", "--eyes", "400", "--size", "96"]));
        assert_eq!(
            (&checked["passed"], &checked["missed_objects"]),
            (&true.into(), &0.into()),
            "{checked}"
        );
        let reason = report["visibility"]["reason"].as_str().expect("a reason").to_owned();
        assert_eq!(reason.contains("in a frame turned by"), degrees != 0.0, "{reason}");
        let visible = report["visibility"]["mean_visible"].as_f64().expect("a mean");
        (report["cells"].clone(), visible)
    };
    let (straight, visible) = cells(0.0, "straight");
    for (degrees, scene) in [(17.0, "askew"), (-40.0, "more")] {
        let (turned, more) = cells(degrees, scene);
        assert_eq!(turned, straight, "as many cells by {degrees}°");
        assert!(more <= 1.5 * visible, "{more} objects beside {visible}");
    }
}
