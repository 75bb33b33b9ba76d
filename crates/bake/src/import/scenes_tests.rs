//! Does every test scene import as its readme says?

#[path = "../../../../tests/tools/scenes.rs"]
mod beside;

use std::path::{Path, PathBuf};

use super::split::{SplitSettings, split};
use super::{FileError, ImportError, Imported, Limits, SourceFiles, import};
use crate::progress::Silent;
use crate::source::{SourceObject, SourceScene, Topology};
use belvedere_scene::Bounds;
use beside::scenes;

/// The files of a folder.
struct Folder(PathBuf);

impl SourceFiles for Folder {
    fn read(&self, relative: &str, max_bytes: u64) -> Result<Vec<u8>, FileError> {
        let path = self.0.join(relative);
        match std::fs::metadata(&path) {
            Ok(m) if m.len() > max_bytes => Err(FileError::TooLarge(max_bytes)),
            Ok(_) => std::fs::read(path).map_err(|e| FileError::Io(e.to_string())),
            Err(_) => Err(FileError::Missing),
        }
    }
}

fn read(root: &Path, name: &str) -> Result<Imported, ImportError> {
    let path = root.join(name);
    let folder = Folder(path.parent().unwrap().to_owned());
    let bytes = std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    import(name, bytes, &folder, &Limits::default(), &Silent)
}

fn imported(root: &Path, name: &str) -> Imported {
    let imported = read(root, name).unwrap_or_else(|e| panic!("{name}: {e}"));
    check(name, &imported.scene);
    imported
}

/// What every imported scene guarantees.
fn check(name: &str, scene: &SourceScene) {
    let mut used = vec![false; scene.models.len()];
    for object in &scene.objects {
        used[object.model] = true;
        assert!(
            object.world_from_object.is_finite() && object.world_from_object.determinant() != 0.0,
            "{name}"
        );
    }
    assert!(used.iter().all(|u| *u), "{name}: unused model");
    for p in scene.models.iter().flat_map(|m| &m.primitives) {
        let vertices = p.positions.len();
        assert!(
            !p.indices.is_empty() && p.indices.len().is_multiple_of(p.topology.arity()),
            "{name}"
        );
        assert!(p.indices.iter().all(|i| (*i as usize) < vertices), "{name}");
        assert!(p.positions.as_flattened().iter().all(|x| x.is_finite()), "{name}");
        for len in [p.normals.len(), p.tangents.len(), p.colors.len()] {
            assert!(len == 0 || len == vertices, "{name}");
        }
        assert!(p.uvs.iter().all(|set| set.len() == vertices), "{name}");
        let unit = |n: &[f32; 3]| (n.iter().map(|x| x * x).sum::<f32>() - 1.0).abs() < 1e-3;
        assert!(p.normals.iter().all(unit), "{name}");
        assert!(p.material.is_none_or(|m| m < scene.materials.len()), "{name}");
    }
    assert!(scene.textures.iter().all(|t| t.image < scene.images.len()), "{name}");
}

/// Shapes of a topology that all objects draw together.
fn drawn(scene: &SourceScene, topology: Topology) -> u64 {
    let count = |model: usize| -> usize {
        let primitives = scene.models[model].primitives.iter();
        primitives.filter(|p| p.topology == topology).map(|p| p.count()).sum()
    };
    scene.objects.iter().map(|o| count(o.model) as u64).sum()
}

/// Triangles drawn, triangles left out of meshes as degenerate, and objects.
fn figures(imported: &Imported) -> (u64, u64, usize) {
    (
        drawn(&imported.scene, Topology::Triangles),
        imported.defects.count("degenerate triangle: dropped"),
        imported.scene.objects.len(),
    )
}

#[test]
fn scenes_draw_the_triangles_that_their_readmes_state() {
    let Some(root) = scenes() else { return };
    // Triangles of the readme in single-instance scenes: what is drawn and what had no area add up to it.
    for (name, stated, objects) in [
        ("apartment/apartment.glb", 177_934, 1),
        ("level-zdm2/zdm2.glb", 58_772, 1),
        ("museum-hall/hall.glb", 6_391, 52),
        ("town/model/town_model.gltf", 30_477, 20),
        ("town/tree/scene.gltf", 778, 2),
        ("town/lamp/scene.gltf", 180, 1),
        ("ship-textured/dutch_ship_medium_1k.gltf", 69_162, 3),
        ("compressed/bridge-garden-meshopt.glb", 21_883, 1),
        ("compressed/chess-board-draco.glb", 178_848, 8),
        ("avatars/fox/Fox.gltf", 576, 1),
        ("avatars/alien/Alien_Scolitex.gltf", 11_036, 1),
        ("avatars/stag/Stag.gltf", 3_670, 2),
        ("instancing/SimpleInstancing.glb", 1_500, 125),
        ("instancing/GpuInstancesMetadata.gltf", 120, 10),
    ] {
        let (drawn, degenerate, count) = figures(&imported(&root, name));
        assert_eq!((drawn + degenerate, count), (stated, objects), "{name}");
    }
    // The readme of the Draco variant: 110,336 are drawn when the empty ones are gone.
    let (drawn, ..) = figures(&imported(&root, "engine-cad/2CylinderEngine.glb"));
    assert_eq!(drawn, 110_336);
    let compressed = imported(&root, "engine-cad/draco/2CylinderEngine.gltf");
    let (drawn, degenerate, _) = figures(&compressed);
    assert!(
        degenerate > 0 && (110_300..110_336).contains(&drawn),
        "{drawn} and {degenerate}"
    );
    assert_eq!(
        (compressed.scene.models.len(), compressed.scene.viewpoints.len()),
        (29, 1)
    );
    let tiles = std::fs::read_dir(root.join("village-tiles")).unwrap();
    let mut names: Vec<_> = tiles.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.retain(|name| name.ends_with(".glb"));
    let all = names.iter().map(|name| {
        let (drawn, degenerate, _) = figures(&imported(&root, &format!("village-tiles/{name}")));
        drawn + degenerate
    });
    assert_eq!(all.sum::<u64>(), 10_868);
}

/// The box as the readmes state it: around the transformed boxes of the meshes.
fn stated_box(scene: &SourceScene) -> Bounds {
    let world = |object: &SourceObject| {
        let positions = scene.models[object.model].primitives.iter().flat_map(|p| &p.positions);
        let own = Bounds::around(positions.map(|p| p.map(f64::from)));
        Bounds::around(
            own.corners()
                .map(|c| object.world_from_object.transform_point3(c.into()).to_array()),
        )
    };
    scene
        .objects
        .iter()
        .map(world)
        .fold(Bounds::EMPTY, |all, b| all.union(&b))
}

#[test]
fn skinned_figures_stand_as_high_as_their_readme_states() {
    let Some(root) = scenes() else { return };
    for (name, height) in [
        ("stag/Stag.gltf", 5.4),
        ("alien/Alien_Scolitex.gltf", 3.4),
        ("fox/Fox.gltf", 79.0),
    ] {
        let found = stated_box(&imported(&root, &format!("avatars/{name}")).scene).size_m()[1];
        assert!((found / height - 1.0).abs() < 0.02, "{name}: {found}");
    }
}

#[test]
fn scenes_stand_in_the_boxes_that_their_readmes_state() {
    let Some(root) = scenes() else { return };
    for (name, [low, high]) in [
        ("apartment/apartment.glb", [[0.44, -0.10, -11.43], [12.81, 2.68, -0.13]]),
        ("level-zdm2/zdm2.glb", [[-33.9, -12.0, -29.3], [43.3, 24.0, 30.3]]),
        (
            "engine-cad/2CylinderEngine.glb",
            [[-373.0, -188.0, -140.0], [372.0, 115.0, 135.0]],
        ),
        (
            "compressed/chess-board-draco.glb",
            [[-158.0, -1.3, -137.0], [180.0, 42.0, 137.0]],
        ),
        (
            "compressed/bridge-garden-meshopt.glb",
            [[-5.5, 0.4, -5.3], [5.8, 7.4, 6.1]],
        ),
    ] {
        let scene = imported(&root, name).scene;
        let found = stated_box(&scene);
        // Readmes round to two or three digits.
        let near = |a: f64, b: f64| (a - b).abs() <= 0.006 * a.abs().max(10.0);
        for axis in 0..3 {
            assert!(
                near(found.min[axis], low[axis]) && near(found.max[axis], high[axis]),
                "{name}: {found:?}"
            );
        }
    }
}

#[test]
fn textures_of_the_ship_and_the_town_are_kept() {
    let Some(root) = scenes() else { return };
    let ship = imported(&root, "ship-textured/dutch_ship_medium_1k.gltf").scene;
    assert_eq!(
        (ship.materials.len(), ship.textures.len(), ship.images.len()),
        (3, 9, 9)
    );
    assert!(ship.images.iter().all(|i| i.ext == "jpg"));
    let town = imported(&root, "town/model/town_model.gltf").scene;
    assert!(town.images.len() == 2 && town.images.iter().all(|i| i.media_type == "image/webp"));
    let tree = imported(&root, "town/tree/scene.gltf").scene;
    assert!(tree.materials.iter().any(|m| m.see_through));
}

#[test]
fn every_primitive_mode_draws_its_shapes() {
    let Some(root) = scenes() else { return };
    for number in 0..16 {
        let name = format!("edge-cases/primitive-modes/Mesh_PrimitiveMode_{number:02}.gltf");
        let scene = imported(&root, &name).scene;
        let found = [Topology::Points, Topology::Lines, Topology::Triangles].map(|t| drawn(&scene, t));
        let expected = match number {
            0 | 7 => [1024, 0, 0],
            1..=3 | 8..=10 => [0, 4, 0],
            _ => [0, 0, 2],
        };
        assert_eq!(found, expected, "{name}");
    }
}

#[test]
fn ill_behaved_files_are_mended_or_refused_for_the_right_reason() {
    let Some(root) = scenes() else { return };
    for (file, defect, triangles) in [
        (
            "IndexOutOfRange.gltf",
            "index past the last vertex: its shape dropped",
            11,
        ),
        ("BoxBadNormals.glb", "normal that is not of unit length: made so", 12),
        (
            "IncorrectVertexArrays/Cube.gltf",
            "indices left over after the last whole shape: dropped",
            46,
        ),
        (
            "badUint.gltf",
            "member of the wrong type: left out with what needs it",
            12,
        ),
    ] {
        let imported = imported(&root, &format!("edge-cases/ill-behaved/{file}"));
        assert!(imported.defects.count(defect) > 0, "{file}");
        assert_eq!(drawn(&imported.scene, Topology::Triangles), triangles, "{file}");
    }
    for (file, reason) in [
        ("edge-cases/ill-behaved/RecursiveNodes.gltf", "node below itself"),
        (
            "edge-cases/ill-behaved/BoxWithInfinites.glb",
            "position that is not finite",
        ),
        ("edge-cases/ill-behaved/MissingBin/BoxTextured.gltf", "BoxTextured0.bin"),
        ("edge-cases/ill-behaved/NoScene.gltf", "no node with a mesh"),
        ("edge-cases/ill-behaved/SceneWithoutNodes.gltf", "no node with a mesh"),
        ("edge-cases/ill-behaved/badArray.gltf", "/meshes/0/primitives"),
        (
            "museum-hall/sound-room.glb",
            "object with zero scale: dropped (28 times",
        ),
        ("house-vrml97/HouseOfImmersion.wrl", "VRML97"),
        ("house-x3d/house.x3d", "X3D"),
    ] {
        let refused = read(&root, file).map(|_| ()).unwrap_err().to_string();
        assert!(refused.contains(reason), "{file}: {refused}");
    }
}

#[test]
fn splitting_keeps_what_is_drawn_and_gives_objects_of_sensible_number() {
    let Some(root) = scenes() else { return };
    for (name, objects) in [
        ("apartment/apartment.glb", 150..250),
        ("level-zdm2/zdm2.glb", 50..100),
        ("town/model/town_model.gltf", 30..400),
        ("engine-cad/2CylinderEngine.glb", 100..200),
        ("instancing/SimpleInstancing.glb", 125..126),
    ] {
        let Imported { scene, mut defects } = imported(&root, name);
        let before = [Topology::Points, Topology::Lines, Topology::Triangles].map(|t| drawn(&scene, t));
        let after = split(scene, &SplitSettings::default(), &mut defects);
        check(name, &after);
        assert_eq!(
            [Topology::Points, Topology::Lines, Topology::Triangles].map(|t| drawn(&after, t)),
            before,
            "{name}"
        );
        assert!(
            objects.contains(&after.objects.len()),
            "{name}: {} objects",
            after.objects.len()
        );
    }
}

#[test]
fn damaged_compressed_scenes_never_panic() {
    let Some(root) = scenes() else { return };
    let folder = root.join("engine-cad/draco");
    let json = std::fs::read(folder.join("2CylinderEngine.gltf")).unwrap();
    struct Damaged(Vec<u8>);
    impl SourceFiles for Damaged {
        fn read(&self, _: &str, _: u64) -> Result<Vec<u8>, FileError> {
            Ok(self.0.clone())
        }
    }
    let bin = std::fs::read_dir(&folder).unwrap().map(|e| e.unwrap().path());
    let bin = bin
        .filter(|p| p.extension().is_some_and(|e| e == "bin"))
        .map(|p| std::fs::read(p).unwrap());
    let bin = bin.max_by_key(Vec::len).unwrap();
    let limits = Limits {
        memory_bytes: 256 << 20,
        ..Limits::default()
    };
    for seed in 0..12u64 {
        let mut damaged = bin.clone();
        let mut state = seed + 1;
        for _ in 0..(1 + 40 * seed) {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            let at = (state >> 20) as usize % damaged.len();
            damaged[at] ^= 1 << (state >> 61);
        }
        if let Ok(imported) = import("x.gltf", json.clone(), &Damaged(damaged), &limits, &Silent) {
            check("damaged", &imported.scene);
        }
    }
}
