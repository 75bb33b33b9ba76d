//! Does level 0 hold the source's triangles, where the source puts them? Reads both with the `gltf` crate, which the
//! program itself does not use, and compares them in world space.

use std::collections::BTreeMap;

use belvedere_client::{ByteSource, HttpSource, Scene};
use belvedere_scene::ObjectId;
use glam::{DMat4, DVec3};

use crate::{program::Data, scenes::scenes};

type Triangle = [[i64; 3]; 3];

/// Rounds to a grid that is coarse beside the rounding of what is published and fine beside the scene.
fn rounded(corners: [DVec3; 3], step: f64) -> Triangle {
    let mut triangle = corners.map(|c| (c / step).round().to_array().map(|x| x as i64));
    triangle.sort_unstable();
    triangle
}

/// Whether an importer keeps a triangle.
fn has_area([a, b, c]: &[DVec3; 3]) -> bool {
    (b - a).cross(c - a) != DVec3::ZERO
}

/// The corners of a mesh's triangles in its own space.
fn triangles_of_mesh(mesh: &gltf::Mesh<'_>, buffers: &[Vec<u8>]) -> Vec<[DVec3; 3]> {
    let mut out = Vec::new();
    for primitive in mesh.primitives() {
        if primitive.mode() != gltf::mesh::Mode::Triangles {
            continue;
        }
        let reader = primitive.reader(|buffer| buffers.get(buffer.index()).map(Vec::as_slice));
        let points: Vec<DVec3> = reader
            .read_positions()
            .expect("positions")
            .map(|p| DVec3::from(p.map(f64::from)))
            .collect();
        let indices: Vec<usize> = match reader.read_indices() {
            Some(indices) => indices.into_u32().map(|i| i as usize).collect(),
            None => (0..points.len()).collect(),
        };
        for t in indices.chunks_exact(3) {
            out.push([points[t[0]], points[t[1]], points[t[2]]]);
        }
    }
    out
}

fn source_triangles(path: &std::path::Path, step: f64) -> Vec<Triangle> {
    let gltf = gltf::Gltf::open(path).expect("a glTF file");
    let folder = path.parent().expect("a folder");
    let buffers: Vec<Vec<u8>> = gltf
        .buffers()
        .map(|buffer| match buffer.source() {
            gltf::buffer::Source::Bin => gltf.blob.clone().expect("a binary chunk"),
            gltf::buffer::Source::Uri(uri) => std::fs::read(folder.join(uri)).expect("a buffer"),
        })
        .collect();
    let mut found = Vec::new();
    let mut open: Vec<(gltf::Node<'_>, DMat4)> = gltf
        .default_scene()
        .expect("a scene")
        .nodes()
        .map(|node| (node, DMat4::IDENTITY))
        .collect();
    while let Some((node, parent)) = open.pop() {
        let local = glam::Mat4::from_cols_array_2d(&node.transform().matrix()).as_dmat4();
        let world = parent * local;
        if let Some(mesh) = node.mesh() {
            let kept = triangles_of_mesh(&mesh, &buffers).into_iter().filter(has_area);
            found.extend(kept.map(|t| rounded(t.map(|c| world.transform_point3(c)), step)));
        }
        open.extend(node.children().map(|child| (child, world)));
    }
    found
}

/// Level 0 of every object in its plain form, which any glTF reader takes.
async fn published_triangles(scene: &Scene<HttpSource>, source: &HttpSource, step: f64) -> Vec<Triangle> {
    let (mut found, name) = (Vec::new(), &scene.pointer().scene);
    for id in 0..scene.pointer().objects {
        let info = scene.object(ObjectId(id)).await.expect("an object");
        let error_m = info.levels[0].geometric_error_m;
        assert!(
            error_m <= 1e-3 && error_m <= scene.pointer().bounds.diagonal_m() * 2f64.powi(-15),
            "o{id}: {error_m} m"
        );
        let path = format!("/v1/scenes/{name}/objects/o{id}/lods/0?form=plain");
        let glb = source.get(&path).await.expect("level 0");
        let gltf = gltf::Gltf::from_slice(&glb).expect("a valid GLB");
        let buffers = vec![gltf.blob.clone().expect("a binary chunk")];
        let world = DMat4::from_cols_array(&info.transform);
        for mesh in gltf.meshes() {
            // Rounding may have taken its area from one; it is published all the same.
            let written = triangles_of_mesh(&mesh, &buffers).into_iter();
            found.extend(written.map(|t| rounded(t.map(|c| world.transform_point3(c)), step)));
        }
    }
    found
}

/// By how many steps in all two triangles differ that have the same corners, but for rounding that put a coordinate on
/// the other side of a step.
fn difference(a: &Triangle, b: &Triangle) -> Option<i64> {
    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let apart = |order: &[usize; 3]| {
        let steps = (0..9).map(|i| (a[i / 3][i % 3] - b[order[i / 3]][i % 3]).abs());
        steps.map(|steps| (steps <= 1).then_some(steps)).sum::<Option<i64>>()
    };
    ORDERS.iter().filter_map(apart).min()
}

/// Each source triangle looks for one like it that no other has taken, those that differ least first.
fn assert_same(source: &[Triangle], published: &[Triangle], scene: &str) {
    assert_eq!(source.len(), published.len(), "{scene}: number of triangles");
    // Sums of corners that are alike differ by at most three steps.
    let bin = |t: &Triangle| [0, 1, 2].map(|axis| t.iter().map(|c| c[axis]).sum::<i64>().div_euclid(4));
    let mut left: BTreeMap<[i64; 3], Vec<&Triangle>> = BTreeMap::new();
    for triangle in published {
        left.entry(bin(triangle)).or_default().push(triangle);
    }
    let mut take = |wanted: &Triangle, most: i64| {
        (0..27).any(|i| {
            let beside = [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1];
            let place: [i64; 3] = std::array::from_fn(|a| bin(wanted)[a] + beside[a]);
            let like = |other: &&Triangle| difference(other, wanted).is_some_and(|steps| steps <= most);
            let found = left
                .get_mut(&place)
                .and_then(|there| Some((there.iter().position(like)?, there)));
            found.map(|(at, there)| there.swap_remove(at)).is_some()
        })
    };
    let mut lonely: Vec<&Triangle> = source.iter().collect();
    for most in 0..=9 {
        lonely.retain(|wanted| !take(wanted, most));
    }
    assert!(
        lonely.len() * 1000 <= source.len(),
        "{scene}: {} of {} triangles stand elsewhere, such as {:?}",
        lonely.len(),
        source.len(),
        lonely[0]
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn level_0_holds_the_triangles_of_the_source_under_the_right_transform() {
    let Some(scenes) = scenes() else { return };
    for (name, file) in [
        ("ship", "ship-textured/dutch_ship_medium_1k.gltf"),
        ("village", "village-tiles/house1-1.glb"),
        ("hall", "museum-hall/hall.glb"),
    ] {
        let data = Data::new();
        let path = scenes.join(file);
        let report = data.bake(&path, name);
        let server = data.serve();
        let scene = server
            .client()
            .open(&name.parse().expect("a name"))
            .await
            .expect("a scene");
        let step = (scene.pointer().bounds.diagonal_m() * 1e-5).max(4e-3);
        let source = source_triangles(&path, step);
        assert!(!source.is_empty());
        let http = HttpSource::new(&server.base).expect("an address");
        assert_same(&source, &published_triangles(&scene, &http, step).await, name);
        assert_eq!(report["triangles"].as_u64(), Some(source.len() as u64));
    }
}
