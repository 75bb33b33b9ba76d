//! Which meshes do the benches look at? Scenes that nobody here made, each as one model, and made-up ones.

use std::fs;
use std::path::{Path, PathBuf};

use belvedere_bake::import::{self, FileError, Limits, SourceFiles};
use belvedere_bake::progress::Silent;
use belvedere_bake::source::{Primitive, SourceModel, Topology};
use glam::{DMat3, DVec3};

/// Loads or makes a model.
pub(crate) type Make = fn() -> SourceModel;

/// Their names.
pub(crate) const ALL: [(&str, Make); 16] = [
    ("engine", || scene("engine-cad/2CylinderEngine.glb")),
    ("ship", || scene("ship-textured/dutch_ship_medium_1k.gltf")),
    ("museum", || scene("museum-hall/hall.glb")),
    ("town", || scene("town/model/town_model.gltf")),
    ("zdm2", || scene("level-zdm2/zdm2.glb")),
    ("apartment", || scene("apartment/apartment.glb")),
    ("stag", || scene("avatars/stag/Stag.gltf")),
    ("alien", || scene("avatars/alien/Alien_Scolitex.gltf")),
    ("chess", || scene("compressed/chess-board-draco.glb")),
    ("bridge", || scene("compressed/bridge-garden-meshopt.glb")),
    ("tree", || scene("village-tiles/tree-lime-2-0.glb")),
    ("sphere", sphere),
    ("torus", torus),
    ("terrain", terrain),
    ("soup", soup),
    ("fox", || scene("avatars/fox/Fox.gltf")),
];

struct Folder(PathBuf);

impl SourceFiles for Folder {
    fn read(&self, relative: &str, _: u64) -> Result<Vec<u8>, FileError> {
        fs::read(self.0.join(relative)).map_err(|_| FileError::Denied)
    }
}

/// All objects of a scene as one model.
fn scene(path: &str) -> SourceModel {
    // Beside the checkout, or beside the folder of checkouts.
    let checkout = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let folders = ["../shared/scenes", "../../shared/scenes"].map(|folder| checkout.join(folder).join(path));
    let path = folders.into_iter().find(|path| path.exists()).unwrap();
    let name = path.file_name().unwrap().to_string_lossy().into_owned();
    let folder = Folder(path.parent().unwrap().to_owned());
    let scene = import::import(&name, fs::read(&path).unwrap(), &folder, &Limits::default(), &Silent)
        .unwrap()
        .scene;
    let mut model = SourceModel::default();
    for object in &scene.objects {
        let matrix = object.world_from_object;
        let normal_matrix = DMat3::from_mat4(matrix).inverse().transpose();
        for primitive in &scene.models[object.model].primitives {
            let mut primitive = primitive.clone();
            for position in &mut primitive.positions {
                *position = matrix
                    .transform_point3(DVec3::from_array(position.map(f64::from)))
                    .as_vec3()
                    .to_array();
            }
            for normal in &mut primitive.normals {
                let turned = normal_matrix * DVec3::from_array(normal.map(f64::from));
                *normal = turned.normalize_or_zero().as_vec3().to_array();
            }
            model.primitives.push(primitive);
        }
    }
    merge(model)
}

/// One primitive for each material, as the other codecs are given one for each object.
fn merge(model: SourceModel) -> SourceModel {
    let mut merged: Vec<Primitive> = Vec::new();
    for part in model.primitives {
        if part.topology != Topology::Triangles {
            continue;
        }
        let fits = |p: &Primitive| {
            p.material == part.material
                && p.normals.is_empty() == part.normals.is_empty()
                && p.tangents.is_empty() == part.tangents.is_empty()
                && p.uvs.iter().map(Vec::is_empty).eq(part.uvs.iter().map(Vec::is_empty))
                && p.colors.is_empty() == part.colors.is_empty()
        };
        let Some(whole) = merged.iter_mut().find(|p| fits(p)) else {
            merged.push(part);
            continue;
        };
        let first = whole.positions.len() as u32;
        whole.positions.extend(part.positions);
        whole.normals.extend(part.normals);
        whole.tangents.extend(part.tangents);
        whole.colors.extend(part.colors);
        for (set, more) in whole.uvs.iter_mut().zip(part.uvs) {
            set.extend(more);
        }
        whole.indices.extend(part.indices.iter().map(|i| first + i));
    }
    SourceModel {
        primitives: merged,
        ..model
    }
}

/// A grid of n × n quads, bent.
fn grid(n: u32, bend: impl Fn(f64, f64) -> [f64; 3]) -> SourceModel {
    let mut primitive = Primitive::default();
    let at = |i: u32| f64::from(i) / f64::from(n);
    for j in 0..=n {
        for i in 0..=n {
            primitive.positions.push(bend(at(i), at(j)).map(|x| x as f32));
        }
    }
    let row = n + 1;
    for j in 0..n {
        for a in j * row..j * row + n {
            primitive
                .indices
                .extend([a, a + 1, a + row, a + 1, a + row + 1, a + row]);
        }
    }
    SourceModel {
        primitives: vec![primitive],
        ..SourceModel::default()
    }
}

fn sphere() -> SourceModel {
    grid(150, |u, v| {
        let (a, b) = (u * std::f64::consts::TAU, (v - 0.5) * std::f64::consts::PI);
        [a.cos() * b.cos(), b.sin(), a.sin() * b.cos()]
    })
}

fn torus() -> SourceModel {
    grid(200, |u, v| {
        let (a, b) = (u * std::f64::consts::TAU, v * std::f64::consts::TAU);
        let r = 1.0 + 0.4 * b.cos();
        [r * a.cos(), 0.4 * b.sin(), r * a.sin()]
    })
}

fn terrain() -> SourceModel {
    grid(256, |u, v| {
        let (mut height, mut size, mut waves) = (0.0, 0.06, 12.0);
        for octave in 0..8 {
            let shift = f64::from(octave);
            height += size
                * ((u * waves + shift).sin() * (v * waves * 1.13 + 2.0 * shift).cos()
                    + ((u * 0.7 - v * 0.8) * waves).sin());
            size *= 0.5;
            waves *= 1.97;
        }
        [u, height, v]
    })
}

/// Triangles that share nothing, anywhere.
fn soup() -> SourceModel {
    let mut state = 1u32;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32
    };
    let mut primitive = Primitive::default();
    for _ in 0..3000 {
        let middle = [random(), random(), random()];
        for _ in 0..3 {
            primitive.indices.push(primitive.positions.len() as u32);
            primitive.positions.push(middle.map(|x| x + 0.05 * random()));
        }
    }
    SourceModel {
        primitives: vec![primitive],
        ..SourceModel::default()
    }
}
