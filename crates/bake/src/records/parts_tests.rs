//! Do parts of a mesh that was cut stay together, whichever levels of them are drawn?

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Mutex;

use belvedere_scene::BlobName;
use glam::DMat4;

use super::{BlobSink, Models, SinkError};
use crate::{
    defect::Defects,
    glb,
    import::{
        self, Limits, NoFiles,
        split::{SplitSettings, split},
    },
    lod::LodSettings,
    progress::Silent,
    source::{Primitive, Role, SourceModel, SourceObject, SourceScene},
};

#[derive(Default)]
struct Memory(Mutex<BTreeMap<BlobName, Vec<u8>>>);

impl BlobSink for Memory {
    fn put(&self, name: &BlobName, bytes: Vec<u8>) -> Result<(), SinkError> {
        self.0.lock().unwrap().insert(name.clone(), bytes);
        Ok(())
    }
}

/// Hills, 60 m wide.
fn hills(side: u32) -> SourceScene {
    let height = |x: f32, z: f32| 3.0 * (0.31 * x).sin() * (0.23 * z).cos() + 0.2 * (1.9 * x + 2.3 * z).sin();
    let at = |i: u32| 60.0 * i as f32 / side as f32;
    let places = (0..=side).flat_map(|z| (0..=side).map(move |x| (at(x), at(z))));
    let quads = (0..side).flat_map(|z| (0..side).map(move |x| z * (side + 1) + x));
    let hills = Primitive {
        positions: places.map(|(x, z)| [x, height(x, z), z]).collect(),
        indices: quads
            .flat_map(|a| [a, a + side + 1, a + 1, a + 1, a + side + 1, a + side + 2])
            .collect(),
        ..Primitive::default()
    };
    SourceScene {
        models: vec![SourceModel {
            primitives: vec![hills],
            ..SourceModel::default()
        }],
        objects: vec![SourceObject {
            source_node: "hills".to_owned(),
            part: 0,
            model: 0,
            world_from_object: DMat4::IDENTITY,
            role: Role::default(),
        }],
        ..SourceScene::default()
    }
}

/// Where a published level has vertices.
fn positions(glb: &[u8]) -> BTreeSet<[u32; 3]> {
    let plain = glb::plain(glb, "").unwrap();
    let read = import::import("level.glb", plain, &NoFiles, &Limits::default(), &Silent).unwrap();
    let primitives = read.scene.models.iter().flat_map(|model| &model.primitives);
    let positions = primitives.flat_map(|p| &p.positions);
    positions.map(|p| p.map(|x| (x + 0.0).to_bits())).collect()
}

#[test]
fn what_lies_on_a_cut_stands_in_one_place_in_all_levels() {
    let scene = split(hills(72), &SplitSettings::default(), &mut Defects::default());
    let sink = Memory::default();
    let written = Models::write(&scene, &LodSettings::default(), &sink, &Silent).unwrap();
    let blobs = sink.0.into_inner().unwrap();
    let levels: Vec<Vec<_>> = (written.models.iter())
        .map(|model| model.levels.iter().map(|level| positions(&blobs[&level.url])).collect())
        .collect();
    assert!(levels.len() > 1 && levels.iter().all(|levels| levels.len() > 2));
    let mut parts_at: BTreeMap<[u32; 3], usize> = BTreeMap::new();
    for place in levels.iter().flat_map(|levels| &levels[0]) {
        *parts_at.entry(*place).or_default() += 1;
    }
    assert!(parts_at.values().filter(|parts| **parts > 1).count() > 60);
    for levels in &levels {
        let cut: BTreeSet<_> = levels[0].iter().filter(|place| parts_at[*place] > 1).collect();
        for (number, level) in levels.iter().enumerate() {
            let lost = cut.iter().filter(|place| !level.contains(**place)).count();
            assert_eq!(lost, 0, "of {} in level {number}", cut.len());
        }
    }
}
