//! Readers of what people bring to a bake, and of what a bake has written.

use belvedere_bake::{
    glb,
    import::{ImportError, Imported, Limits, NoFiles, import},
    occluders::StoredError,
    progress::Silent,
    visibility::conservative::Scenery,
};

use crate::{Target, class_of_message, class_of_size, memory::within, seeds};

/// What an import may decode.
const IMPORT_BYTES: u64 = 16 << 20;

/// Reads a source scene; what is left of it is sound.
fn imported(file_name: &str, bytes: &[u8]) -> u64 {
    let limits = Limits {
        memory_bytes: IMPORT_BYTES,
        max_objects: 200,
    };
    // Claims are added up for what is kept; while that is made, the document and copies of parts of it are there as well.
    let allowed = 3 * IMPORT_BYTES + 64 * bytes.len() as u64 + (4 << 20);
    let found: Result<Imported, ImportError> = within(allowed, || {
        import(file_name, bytes.to_vec(), &NoFiles, &limits, &Silent)
    });
    match found {
        Err(error) => class_of_message(&error.to_string()),
        Ok(Imported { scene, defects }) => {
            for primitive in scene.models.iter().flat_map(|model| &model.primitives) {
                let count = primitive.positions.len();
                assert!(primitive.indices.iter().all(|i| (*i as usize) < count));
                assert!(primitive.positions.iter().flatten().all(|x| x.is_finite()));
                for rows in [primitive.normals.len(), primitive.colors.len()] {
                    assert!(rows == 0 || rows == count);
                }
            }
            for object in &scene.objects {
                assert!(object.model < scene.models.len());
                assert!(object.world_from_object.is_finite());
            }
            let kinds = defects
                .iter()
                .fold(0, |class: u64, defect| class ^ class_of_message(defect.kind));
            kinds ^ class_of_size(scene.objects.len())
        }
    }
}

pub(crate) const GLB: Target = Target {
    name: "import_glb",
    seeds: || {
        let levels = seeds::baked(b"glTF");
        let plain = levels.iter().filter_map(|level| glb::plain(level, "").ok()).take(4);
        let rich = seeds::glb_of(seeds::GLTF);
        plain.chain([rich]).chain(levels.iter().take(4).cloned()).collect()
    },
    check: |bytes| imported("any.glb", bytes),
    rounds: 4_000,
};

pub(crate) const GLTF: Target = Target {
    name: "import_gltf",
    seeds: || vec![seeds::GLTF.as_bytes().to_vec()],
    check: |bytes| imported("any.gltf", bytes),
    rounds: 4_000,
};

pub(crate) const ZIP: Target = Target {
    name: "import_zip",
    seeds: || {
        let level = seeds::glb_of(seeds::GLTF);
        vec![
            seeds::zip_of(&[("scene.gltf", seeds::GLTF.as_bytes()), ("read me.txt", b"nothing")]),
            seeds::zip_of(&[("folder/", b""), ("folder/scene.glb", &level)]),
        ]
    },
    check: |bytes| imported("any.zip", bytes),
    rounds: 4_000,
};

pub(crate) const PLAN: Target = Target {
    name: "import_plan",
    seeds: || vec![seeds::PLAN.as_bytes().to_vec(), seeds::museum()],
    check: |bytes| imported("any.plan", bytes),
    rounds: 1_000,
};

/// A level as the bake writes it, to one that needs no decoder.
pub(crate) const LEVEL: Target = Target {
    name: "level",
    seeds: || seeds::baked(b"glTF"),
    check: |bytes| {
        // Views may claim a gigabyte: what is looked at is that nothing panics.
        match glb::plain(bytes, "") {
            Err(error) => class_of_message(&error.to_string()),
            Ok(plain) => {
                assert!(plain.starts_with(b"glTF"));
                class_of_size(plain.len())
            }
        }
    },
    rounds: 4_000,
};

pub(crate) const OCCLUDERS: Target = Target {
    name: "occluders",
    seeds: || seeds::baked(b"BVOC"),
    check: |bytes| {
        // Squares of walls are bits.
        let allowed = 1024 * bytes.len() as u64 + (1 << 20);
        match within(allowed, || Scenery::decode(bytes)) {
            Err(StoredError::Damaged(_)) => 0,
            Err(error) => class_of_message(&error.to_string()),
            Ok(stored) => {
                let again = stored.scenery.encode(&stored.frame, stored.origin);
                assert!(Scenery::decode(&again).is_ok(), "it reads what it writes");
                class_of_size(again.len())
            }
        }
    },
    rounds: 10_000,
};
