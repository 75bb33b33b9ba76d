//! How small and how fast are smooth LODs?
#![allow(clippy::print_stdout, clippy::unwrap_used, missing_docs)]
use std::time::Instant;
use belvedere_bake::{import::{self, FileError, Limits, SourceFiles}, progress::Silent, smooth::{self, quantise::QuantisedMesh}, source::{Primitive, SourceModel, Topology}};
use belvedere_scene::smooth::Decoder;
use glam::DVec3;

struct Folder(std::path::PathBuf);
impl SourceFiles for Folder {
    fn read(&self, relative: &str, _: u64) -> Result<Vec<u8>, FileError> {
        std::fs::read(self.0.join(relative)).map_err(|_| FileError::Denied)
    }
}
fn scene(path: &str) -> SourceModel {
    let path = std::path::Path::new("/work/shared/scenes").join(path);
    let bytes = std::fs::read(&path).unwrap();
    let imported = import::import(path.file_name().unwrap().to_str().unwrap(), bytes, &Folder(path.parent().unwrap().into()), &Limits::default(), &Silent).unwrap();
    let mut model = SourceModel::default();
    for o in &imported.scene.objects {
        for p in &imported.scene.models[o.model].primitives {
            if p.topology != Topology::Triangles { continue; }
            let mut p = p.clone();
            for x in &mut p.positions { *x = o.world_from_object.transform_point3(DVec3::from_array(x.map(f64::from))).as_vec3().to_array(); }
            model.primitives.push(p);
        }
    }
    model
}
fn grid(n: usize, f: impl Fn(f64, f64) -> [f64; 3]) -> SourceModel {
    let mut p = Primitive::default();
    for j in 0..=n { for i in 0..=n { p.positions.push(f(i as f64 / n as f64, j as f64 / n as f64).map(|x| x as f32)); } }
    let w = n as u32 + 1;
    for j in 0..n as u32 { for i in 0..n as u32 { let a = j * w + i; p.indices.extend([a, a + 1, a + w, a + 1, a + w + 1, a + w]); } }
    SourceModel { name: String::new(), primitives: vec![p] }
}
fn main() {
    let only = std::env::args().nth(1).filter(|a| !a.starts_with('-'));
    let tau = std::f64::consts::TAU;
    let noise = |x: f64, y: f64| { let mut h = 0.0; let mut a = 0.2; let mut f = 3.0; for k in 0..8 { h += a * ((x * f + k as f64).sin() * (y * f * 1.13 + 2.0 * k as f64).cos() + (x * f * 0.7 - y * f * 0.8).sin()); a *= 0.5; f *= 1.97; } h };
    let list: Vec<(&str, Box<dyn Fn() -> SourceModel>)> = vec![
        ("engine", Box::new(|| scene("engine-cad/2CylinderEngine.glb"))),
        ("ship", Box::new(|| scene("ship-textured/dutch_ship_medium_1k.gltf"))),
        ("museum", Box::new(|| scene("museum-hall/hall.glb"))),
        ("town", Box::new(|| scene("town/model/town_model.gltf"))),
        ("zdm2", Box::new(|| scene("level-zdm2/zdm2.glb"))),
        ("apartment", Box::new(|| scene("apartment/apartment.glb"))),
        ("stag", Box::new(|| scene("avatars/stag/Stag.gltf"))),
        ("alien", Box::new(|| scene("avatars/alien/Alien_Scolitex.gltf"))),
        ("chess", Box::new(|| scene("compressed/chess-board-draco.glb"))),
        ("bridge", Box::new(|| scene("compressed/bridge-garden-meshopt.glb"))),
        ("tree", Box::new(|| scene("village-tiles/tree-lime-2-0.glb"))),
        ("sphere", Box::new(move || grid(150, move |u, v| { let (a, b) = (u * tau, (v - 0.5) * tau / 2.0); [a.cos() * b.cos(), b.sin(), a.sin() * b.cos()] }))),
        ("torus", Box::new(move || grid(200, move |u, v| { let (a, b) = (u * tau, v * tau); let r = 1.0 + 0.4 * b.cos(); [r * a.cos(), 0.4 * b.sin(), r * a.sin()] }))),
        ("terrain", Box::new(move || grid(256, move |u, v| [u, 0.3 * noise(u * 4.0, v * 4.0), v]))),
    ];
    let (mut log, mut n) = (0.0, 0.0);
    for (name, make) in list {
        if only.as_ref().is_some_and(|o| !o.split(',').any(|o| o == name)) { continue; }
        let mesh = QuantisedMesh::new(&make(), 14);
        let (v, t) = (mesh.positions.len(), mesh.triangles.len());
        if std::env::var("DUMP").is_ok() { let mut o: Vec<u8> = Vec::new(); o.extend((v as u32).to_le_bytes()); o.extend((t as u32).to_le_bytes()); for x in mesh.positions.iter().flatten() { o.extend(x.to_le_bytes()); } for x in mesh.triangles.iter().flatten() { o.extend(x.to_le_bytes()); } std::fs::write(format!("/tmp/lab/m/{name}.mesh"), o).unwrap(); continue; }
        let start = Instant::now();
        let bytes = smooth::encode(&mesh);
        let enc = start.elapsed().as_secs_f64();
        let mut dec = f64::INFINITY;
        let mut out = None;
        for _ in 0..3 {
            let start = Instant::now();
            let mut decoder = Decoder::new(14, (v, t));
            decoder.push(&bytes).unwrap();
            dec = dec.min(start.elapsed().as_secs_f64());
            assert!(decoder.is_complete(), "{:?}", decoder.counts());
            out = Some(decoder);
        }
        let out = out.unwrap();
        let canon = |p: &[[i32; 3]], t: &[[u32; 3]]| { let mut l: Vec<[[i32; 3]; 3]> = t.iter().map(|t| { let mut c = t.map(|i| p[i as usize]); let m = (0..3).min_by_key(|&i| c[i]).unwrap(); c.rotate_left(m); c }).collect(); l.sort_unstable(); l };
        assert!(canon(&mesh.positions, &mesh.triangles) == canon(&out.positions(), out.triangles()), "{name} differs");
        let thesis = 12 * v + 6 * t;
        let pc = 100.0 * bytes.len() as f64 / thesis as f64;
        log += pc.ln(); n += 1.0;
        println!("{name:10} V {v:7} T {t:7} {:8} B {pc:6.2} % {:6.2} bpv  enc {:.2} Mt/s dec {:.2} Mt/s", bytes.len(), 8.0 * bytes.len() as f64 / v as f64, t as f64 / enc / 1e6, t as f64 / dec / 1e6);
    }
    println!("geomean {:.2} %", (log / n as f64).exp());
}
