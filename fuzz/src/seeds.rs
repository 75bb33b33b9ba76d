//! Where do sound inputs come from? From a small world that is baked once, and from the golden files.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{LazyLock, Mutex};

use belvedere_bake::{
    BakeSettings, Host, Source, bake,
    import::{Limits, NoFiles, import},
    progress::Silent,
    records::{BlobSink, SinkError},
    smooth::{
        quantise::{Precision, QuantisedMesh},
        thesis::encode,
    },
    source::{Primitive, SourceModel},
    visibility::{Method, SampledSettings, VisibilitySettings},
};
use belvedere_scene::BlobName;

/// Three rooms with an opening and a door between them.
pub(crate) const PLAN: &str = "\
#################
#a..#..b#...#..d#
#...+...#.c.+...#
#...#...#...#...#
###+#####...#####
#.......+...#
#..e....#...#
#############
";

#[derive(Default)]
struct Memory(Mutex<BTreeMap<BlobName, Vec<u8>>>);

impl BlobSink for Memory {
    fn put(&self, name: &BlobName, bytes: Vec<u8>) -> Result<(), SinkError> {
        if let Ok(mut blobs) = self.0.lock() {
            blobs.insert(name.clone(), bytes);
        }
        Ok(())
    }
}

/// All that a bake of the plan writes.
static BAKED: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| {
    let imported = import("rooms.plan", PLAN.into(), &NoFiles, &Limits::default(), &Silent);
    let Ok(mut imported) = imported else {
        return Vec::new();
    };
    let settings = BakeSettings {
        visibility: VisibilitySettings {
            sampled: Some(SampledSettings {
                rays_per_cell: 2000,
                ..SampledSettings::default()
            }),
            method: Method::Auto,
        },
        ..BakeSettings::default()
    };
    let source = Source {
        scene: imported.scene,
        title: "rooms".to_owned(),
        bytes: 0,
    };
    let sink = Memory::default();
    let written = bake(source, &settings, &mut imported.defects, &Host::taking(&sink));
    let manifest = written
        .ok()
        .and_then(|written| serde_json::to_vec(&written.manifest).ok());
    let mut blobs: Vec<Vec<u8>> = sink.0.into_inner().unwrap_or_default().into_values().collect();
    blobs.extend(manifest);
    blobs
});

/// What a bake writes that begins so, shortest first; not more than a dozen, and none that is large.
pub(crate) fn baked(beginning: &[u8]) -> Vec<Vec<u8>> {
    let matching = BAKED
        .iter()
        .filter(|bytes| bytes.starts_with(beginning) && bytes.len() < 1 << 15);
    let mut found: Vec<Vec<u8>> = matching.cloned().collect();
    found.sort_by_key(Vec::len);
    found.truncate(12);
    found
}

/// Golden files of a folder with these endings.
pub(crate) fn golden(folder: &str, ending: &str) -> Vec<Vec<u8>> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../tests/golden")
        .join(folder);
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder)
        .map(|entries| entries.flatten().map(|entry| entry.path()).collect())
        .unwrap_or_default();
    paths.sort();
    let matching = paths
        .iter()
        .filter(|path| path.extension().is_some_and(|found| found == ending));
    matching.filter_map(|path| std::fs::read(path).ok()).collect()
}

/// A document with most of what an import reads: attributes, materials, a skin, a morph target, instances, strips, lines.
pub(crate) const GLTF: &str = include_str!("../seeds/rich.gltf");

pub(crate) fn museum() -> Vec<u8> {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../tests/fixtures/museum.plan");
    std::fs::read(file).unwrap_or_default()
}

/// A document as a GLB without a binary chunk.
pub(crate) fn glb_of(json: &str) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((json.len() as u32 + 20).to_le_bytes());
    bytes.extend((json.len() as u32).to_le_bytes());
    bytes.extend(b"JSON");
    bytes.extend(json);
    bytes
}

/// A zip archive of files as they are (APPNOTE 4.3).
pub(crate) fn zip_of(files: &[(&str, &[u8])]) -> Vec<u8> {
    let (mut bytes, mut directory) = (Vec::new(), Vec::new());
    for (name, file) in files {
        let at = bytes.len() as u32;
        let mut entry = vec![10, 0, 0, 0, 0, 0, 0, 0, 0x21, 0];
        entry.extend(crc(file).to_le_bytes());
        entry.extend([file.len() as u32; 2].iter().flat_map(|length| length.to_le_bytes()));
        entry.extend((name.len() as u32).to_le_bytes());
        bytes.extend(b"PK\x03\x04");
        bytes.extend(&entry);
        bytes.extend(name.bytes().chain(file.iter().copied()));
        directory.extend(b"PK\x01\x02\x0a\0");
        directory.extend(entry);
        directory.extend([0; 10]);
        directory.extend(at.to_le_bytes());
        directory.extend(name.bytes());
    }
    let (start, length, count) = (bytes.len() as u32, directory.len() as u32, files.len() as u16);
    bytes.extend(directory);
    bytes.extend(b"PK\x05\x06\0\0\0\0");
    bytes.extend([count; 2].iter().flat_map(|count| count.to_le_bytes()));
    bytes.extend([length, start].iter().flat_map(|number| number.to_le_bytes()));
    bytes.extend([0; 2]);
    bytes
}

fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| {
            (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg())
        })
    })
}

/// Packets of a bent sheet in two materials.
pub(crate) fn thesis() -> Vec<Vec<u8>> {
    let sheet = |side: u16, n: u16| {
        let row = u32::from(n) + 1;
        let point = |i: u16, j: u16| [f32::from(side * n + i), f32::from(j), f32::from(i * j % 5)];
        Primitive {
            material: Some(usize::from(side)),
            positions: (0..=n).flat_map(|j| (0..=n).map(move |i| point(i, j))).collect(),
            indices: (0..u32::from(n))
                .flat_map(|j| j * row..j * row + u32::from(n))
                .flat_map(|a| [a, a + row, a + 1, a + 1, a + row, a + row + 1])
                .collect(),
            ..Primitive::default()
        }
    };
    let of_size = |n: u16| {
        let model = SourceModel {
            primitives: vec![sheet(0, n), sheet(1, n)],
            ..SourceModel::default()
        };
        encode(&QuantisedMesh::new(&model, Precision::default()))
    };
    [2, 6].into_iter().filter_map(of_size).collect()
}
