//! Does every test scene import as its readme says? The scenes stand beside the repository; without them these tests
//! say so and pass.

use std::path::{Path, PathBuf};

use super::split::{SplitSettings, split};
use super::{FileError, ImportError, Imported, Limits, SourceFiles, import};
use crate::progress::Silent;
use crate::source::{Role, SourceScene, Topology};

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

fn scenes() -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/scenes");
    if !root.is_dir() {
        println!("skipped: there are no test scenes at {}", root.display());
        return None;
    }
    Some(root)
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
        assert!(object.world_from_object.is_finite() && object.world_from_object.determinant() != 0.0, "{name}");
    }
    assert!(used.iter().all(|u| *u), "{name}: unused model");
    for p in scene.models.iter().flat_map(|m| &m.primitives) {
        let vertices = p.positions.len();
        assert!(!p.indices.is_empty() && p.indices.len().is_multiple_of(p.topology.arity()), "{name}");
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

#[test]
fn survey() {
    let Some(root) = scenes() else { return };
    let mut stack = vec![root.clone()];
    let mut files = Vec::new();
    while let Some(folder) = stack.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() { stack.push(path) } else { files.push(path) }
        }
    }
    files.sort();
    for path in files {
        let ext = path.extension().and_then(|e| e.to_str()).unwrap_or("");
        if !["glb", "gltf", "wrl", "x3d"].contains(&ext) { continue }
        let name = path.strip_prefix(&root).unwrap().to_str().unwrap().to_owned();
        let t = |s: &SourceScene| (drawn(s, Topology::Points), drawn(s, Topology::Lines), drawn(s, Topology::Triangles));
        match read(&root, &name) {
            Ok(i) => {
                check(&name, &i.scene);
                println!("{name}: objects {} models {} mats {} tex {} img {} vp {} drawn {:?}", i.scene.objects.len(), i.scene.models.len(), i.scene.materials.len(), i.scene.textures.len(), i.scene.images.len(), i.scene.viewpoints.len(), t(&i.scene));
                for d in i.defects.iter() { println!("     {} x{} {}", d.kind, d.count, d.first) }
                let before = t(&i.scene);
                let mut defects = i.defects;
                let s = split(i.scene, &SplitSettings::default(), &mut defects);
                check(&name, &s);
                assert_eq!(before, t(&s));
                let _ = Role::Door;
                println!("     split: {} objects {} models", s.objects.len(), s.models.len());
            }
            Err(e) => println!("{name}: ERR {e}"),
        }
    }
}
