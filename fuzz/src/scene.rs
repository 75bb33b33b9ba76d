//! Readers of the published format.

use std::fmt::Display;

use belvedere_scene::{
    BlobHash, BlobName, CellId, ModelId, ObjectId, Revision, SceneName,
    index::{CellChunk, CellSearch, Page},
    manifest::Manifest,
    object::{ModelChunk, ObjectChunk, PackRef},
    pointer::{Pointer, SceneList},
    procedural::{Limits, Loader, Program, Settings, bounds, grow},
    record::{CellJson, CellRecord, DecodeError, Steps},
    rung::RungName,
    smooth::{
        Decoder, Header, SmoothError,
        select::{ClusterTree, Selection, View},
        thesis,
    },
};
use serde::{Serialize, de::DeserializeOwned};

use crate::{Target, class_of_message, class_of_size, memory::within, seeds};

/// A record holds little more than its bytes, and a geometry section of up to 1 MiB.
fn record_bytes(bytes: &[u8]) -> u64 {
    512 * bytes.len() as u64 + (8 << 20)
}

fn class_of_record(record: Result<CellRecord, DecodeError>) -> u64 {
    match record {
        Err(error) => class_of_message(&error.to_string()),
        Ok(record) => {
            let corners = record.hull.points.len();
            assert!(record.hull.points.iter().flatten().all(|x| x.is_finite()));
            assert!(record.hull.faces.iter().flatten().all(|i| (*i as usize) < corners));
            assert!(record.visible().iter().all(|v| v.fraction > 0.0 && v.fraction <= 1.0));
            assert!((0.0..=1.0).contains(&record.miss_bound));
            assert_eq!(
                CellRecord::decode(&record.encode()).as_ref(),
                Ok(&record),
                "it reads what it writes"
            );
            class_of_size(record.visible().len()) ^ class_of_size(corners) << 8
        }
    }
}

pub(crate) const CELL_RECORD: Target = Target {
    name: "cell_record",
    seeds: || seeds::baked(b"BVCR"),
    check: |bytes| class_of_record(within(record_bytes(bytes), || CellRecord::decode(bytes))),
    rounds: 20_000,
};

/// Whole files of steps, and single ones on the way from a sound record.
pub(crate) const CELL_STEPS: Target = Target {
    name: "cell_steps",
    seeds: || {
        let whole = seeds::baked(b"BVST");
        let steps = whole.iter().filter_map(|bytes| Steps::decode(bytes).ok());
        let single: Vec<Vec<u8>> = steps.flat_map(|steps| steps.to).map(|(_, step)| step).collect();
        whole.into_iter().chain(single.into_iter().take(12)).collect()
    },
    check: |bytes| {
        let class = match within(record_bytes(bytes), || Steps::decode(bytes)) {
            Err(error) => class_of_message(&error.to_string()),
            Ok(steps) => {
                assert_eq!(
                    Steps::decode(&steps.encode()).as_ref(),
                    Ok(&steps),
                    "it reads what it writes"
                );
                class_of_size(steps.to.len())
            }
        };
        let from = seeds::baked(b"BVCR")
            .first()
            .and_then(|record| CellRecord::decode(record).ok());
        from.map_or(class, |from| {
            class ^ class_of_record(within(record_bytes(bytes), || from.follow(bytes))) << 1
        })
    },
    rounds: 20_000,
};

/// Reads a document; what can be read can be written and read again.
fn document<T: DeserializeOwned + Serialize>(bytes: &[u8]) -> Result<T, String> {
    let read: T = serde_json::from_slice(bytes).map_err(|error| error.to_string())?;
    let written = serde_json::to_vec(&read).unwrap_or_else(|error| panic!("it cannot be written again: {error}"));
    serde_json::from_slice::<T>(&written).map_err(|error| panic!("what it writes cannot be read: {error}"))
}

pub(crate) const DOCUMENTS: Target = Target {
    name: "documents",
    seeds: || seeds::baked(b"{"),
    check: |bytes| {
        let page = document::<Page>(bytes);
        if let Ok(page) = &page {
            let mut search = CellSearch::new(page, [0.5, 1.0, -2.0]);
            // Whatever the pages claim, each is asked for once.
            let mut asked = 0;
            while search.wants().is_some() {
                search.give_page(&Page { entries: Vec::new() });
                asked += 1;
            }
            assert!(asked <= page.entries.len() && search.finish().is_none());
        }
        let objects = document::<ObjectChunk>(bytes);
        if let Ok(chunk) = &objects {
            for entry in &chunk.objects {
                assert!(
                    chunk
                        .entry(entry.object)
                        .is_none_or(|found| found.object == entry.object)
                );
            }
        }
        let models = document::<ModelChunk>(bytes);
        if let Ok(chunk) = &models {
            for level in chunk.models.values().flat_map(|model| &model.levels) {
                let lies_in = |pack: &PackRef| pack.from + level.bytes <= pack.bytes;
                assert!(level.pack.as_ref().is_none_or(lies_in));
            }
            for lod in chunk.models.values().filter_map(|model| model.smooth.as_ref()) {
                assert!(lod.rungs.iter().all(|rung| rung.url.whole() == lod.url));
                let bytes: u64 = lod.rungs.iter().map(|rung| rung.to - rung.from).sum();
                assert_eq!(bytes, lod.bytes);
            }
        }
        let cells = document::<CellChunk>(bytes);
        if let Ok(cells) = &cells {
            for cell in &cells.cells {
                let point = [1.0, 2.0, 3.0];
                assert!(!cell.distance_m(point).is_nan() || !cell.holds_alone(point));
            }
        }
        let messages = [
            page.err(),
            objects.err(),
            models.err(),
            cells.err(),
            document::<Manifest>(bytes).err(),
            document::<Pointer>(bytes).err(),
            document::<SceneList>(bytes).err(),
            document::<CellJson>(bytes).err(),
        ];
        messages.iter().fold(0, |class, message| {
            class.wrapping_mul(31) ^ message.as_ref().map_or(1, |message| class_of_message(message))
        })
    },
    rounds: 20_000,
};

/// A name that can be read is written as it was.
fn name<T: Display, E>(text: &str, read: Result<T, E>) -> u64 {
    read.map_or(0, |name| {
        assert_eq!(name.to_string(), text, "a name has one spelling");
        1
    })
}

pub(crate) const NAMES: Target = Target {
    name: "names",
    seeds: || {
        let hash = BlobHash::of(b"").to_string();
        let texts = [
            "c12".to_owned(),
            "o9".to_owned(),
            "m4294967295".to_owned(),
            "rooms-1".to_owned(),
            format!("{hash}.glb"),
            format!("/o/{hash}.slod"),
            format!("/o/{hash}.r3.slod"),
            hash,
        ];
        texts.map(String::into_bytes).to_vec()
    },
    check: |bytes| {
        let text = &*String::from_utf8_lossy(bytes);
        let classes = [
            name(text, text.parse::<CellId>()),
            name(text, text.parse::<ObjectId>()),
            name(text, text.parse::<ModelId>()),
            name(text, text.parse::<SceneName>()),
            name(text, text.parse::<BlobHash>()),
            name(text, text.parse::<Revision>()),
            BlobName::from_url(text).map_or(0, |name| {
                assert_eq!(name.url(), text, "a URL has one spelling");
                1
            }),
            RungName::from_file_name(text).map_or(0, |name| {
                assert_eq!(name.file_name(), text, "a rung has one spelling");
                1
            }),
        ];
        classes.iter().fold(0, |class, found| class << 1 | found)
    },
    rounds: 50_000,
};

/// More memory than this is refused.
const SMOOTH_BYTES: u64 = 64 << 20;

/// Whatever came: indices in range, no corner twice, everything finite; and so for what an eye sees of it.
fn assert_drawable(decoder: &Decoder) {
    let lattice = decoder.lattice();
    let vertices = lattice.twice_positions.len() as u32;
    let sound = |[a, b, c]: [u32; 3]| a != b && b != c && c != a && a.max(b).max(c) < vertices;
    assert!(lattice.triangles.iter().copied().all(sound));
    assert_eq!(lattice.materials.len(), lattice.triangles.len());
    let finite = |snapshot: &belvedere_scene::smooth::Snapshot| {
        let count = snapshot.positions.len();
        let rows = snapshot.positions.iter().chain(&snapshot.normals);
        assert!(rows.flatten().all(|x| x.is_finite()));
        assert!(
            snapshot
                .indices
                .iter()
                .flatten()
                .all(|&corner| (corner as usize) < count)
        );
    };
    finite(&decoder.snapshot());
    let view = View {
        eye: [0.5, 1.0, 2.0],
        planes: vec![[0.0, 0.0, -1.0, 2.0]],
        pixels: 500.0,
        most_error_px: 2.0,
        outside: 8.0,
    };
    let mut selection = Selection::new(ClusterTree::new(decoder), 3);
    selection.update(&view, 2000);
    assert!(selection.drawn().iter().all(|&t| sound(selection.triangle(t))));
    finite(&selection.snapshot(decoder));
}

/// In two portions, cut where the last byte says.
pub(crate) const SMOOTH: Target = Target {
    name: "smooth",
    seeds: || seeds::golden("smooth", "slod"),
    check: |bytes| {
        let header = Header::read(bytes);
        let stated = header.ok().flatten().map_or(0, |(header, _)| header.memory_bytes());
        let allowed = stated.clamp(1 << 20, SMOOTH_BYTES) + 2 * bytes.len() as u64;
        let cut = bytes.last().map_or(0, |&last| usize::from(last) * bytes.len() / 256);
        let mut decoder = Decoder::new(SMOOTH_BYTES);
        let pushed = within(allowed, || {
            decoder.push(&bytes[..cut]).and_then(|()| decoder.push(&bytes[cut..]))
        });
        assert_drawable(&decoder);
        let class = pushed.map_err(|error| {
            assert_eq!(decoder.push(&[]), Err(error.clone()), "what is damaged stays damaged");
            match error {
                SmoothError::Memory { .. } => "memory".to_owned(),
                error => error.to_string(),
            }
        });
        class.err().map_or(0, |message| class_of_message(&message)) ^ class_of_size(decoder.counts().1)
    },
    rounds: 4_000,
};

pub(crate) const THESIS: Target = Target {
    name: "thesis",
    seeds: seeds::thesis,
    check: |bytes| {
        // A packet has 4 bits or more, and tells a triangle or a vertex; arrays double their room.
        let allowed = 128 * bytes.len() as u64 + (1 << 20);
        match within(allowed, || thesis::decode(bytes)) {
            Err(error) => class_of_message(&error.to_string()),
            Ok(mesh) => {
                let vertices = mesh.positions.len() as u32;
                assert!(mesh.triangles.iter().flatten().all(|&vertex| vertex < vertices));
                assert_eq!(mesh.materials.len(), mesh.triangles.len());
                class_of_size(mesh.triangles.len())
            }
        }
    },
    rounds: 10_000,
};

/// Every import leads to the same small file.
struct Always;

impl Loader for Always {
    fn load(&self, _: &str) -> Result<String, String> {
        Ok("function double(x) = 2 * x\nrule part { box(1, 1, 1) }\n".to_owned())
    }
}

pub(crate) const RULES: Target = Target {
    name: "rules",
    seeds: || seeds::golden("procedural", "dcg"),
    check: |bytes| {
        let text = String::from_utf8_lossy(bytes).into_owned();
        let program = match Program::read("any.dcg", text, &Always) {
            Err(error) => return class_of_message(&error.to_string()),
            Ok(program) => program,
        };
        let settings = Settings {
            limits: Limits {
                steps: 50_000,
                triangles: 20_000,
                placements: 5_000,
                parts: 500,
                ..Limits::default()
            },
            ..Settings::default()
        };
        let declared = bounds(&program, &settings, &|_| None);
        // Some 200 bytes for a triangle, a step or a placement, and the longest list for each of the values around.
        match within(256 << 20, || grow(&program, &settings)) {
            Err(error) => class_of_message(&error.to_string()) ^ 1,
            Ok(grown) => {
                assert!(declared.is_ok(), "what grows has bounds");
                for mesh in grown.parts.iter().flat_map(|part| &part.meshes) {
                    let count = mesh.positions.len();
                    assert_eq!(count, mesh.normals.len());
                    assert!(mesh.indices.iter().all(|i| (*i as usize) < count));
                    assert!(
                        mesh.positions
                            .iter()
                            .chain(&mesh.normals)
                            .flatten()
                            .all(|x| x.is_finite())
                    );
                }
                class_of_size(grown.parts.len())
            }
        }
    },
    rounds: 4_000,
};
