//! What holds of impostors: they look like the model, better than its coarsest level, the same for any number of threads.

use belvedere_scene::impostor::Wish;
use glam::Vec3;
use image::{ImageFormat, RgbaImage};
use serde_json::json;

use super::*;
use crate::defect::Defects;
use crate::lod::{LodSettings, chain};
use crate::progress::Silent;
use crate::source::{Image, Material, Primitive, SourceScene, Texture};
use measure::{difference, directions};
use raster::Pixel;
use surface::note_unseen;

const SIZE_PX: u32 = 32;

fn wish(below: bool) -> Wish {
    Wish {
        views: 8,
        size_px: SIZE_PX,
        below,
        ..Wish::DEFAULT
    }
}

/// The same numbers in every run, 0 to 1.
fn dice() -> impl FnMut() -> f32 {
    let mut state = 7u32;
    move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32
    }
}

/// A trunk with a crown of leaves around it, each a triangle.
fn tree(leaves: usize) -> SourceModel {
    let mut roll = dice();
    let mut crown = Primitive {
        material: Some(0),
        ..Primitive::default()
    };
    for _ in 0..leaves {
        let ball = Vec3::new(roll(), roll(), roll()) * 2.0 - 1.0;
        let middle = Vec3::new(0.0, 6.0, 0.0) + ball.normalize_or_zero() * 2.5 * roll().cbrt();
        for _ in 0..3 {
            let corner = middle + (Vec3::new(roll(), roll(), roll()) - 0.5) * 0.9;
            crown.indices.push(crown.positions.len() as u32);
            crown.positions.push(corner.to_array());
        }
    }
    let mut trunk = Primitive {
        material: Some(1),
        ..Primitive::default()
    };
    for i in 0..8u32 {
        let angle = std::f32::consts::TAU * i as f32 / 8.0;
        for y in [0.0, 6.0] {
            trunk.positions.push([0.3 * angle.cos(), y, -0.3 * angle.sin()]);
        }
        let [a, b] = [2 * i, 2 * ((i + 1) % 8)];
        trunk.indices.extend([a, b, a + 1, a + 1, b, b + 1]);
    }
    SourceModel {
        primitives: vec![crown, trunk],
        impostor: Some(wish(false)),
        ..SourceModel::default()
    }
}

fn material(gltf: serde_json::Value, double_sided: bool) -> Material {
    Material {
        gltf,
        see_through: false,
        double_sided,
    }
}

fn scene(model: SourceModel) -> SourceScene {
    let painted =
        |colour: [f64; 3]| json!({"pbrMetallicRoughness": {"baseColorFactor": [colour[0], colour[1], colour[2], 1.0]}});
    SourceScene {
        models: vec![model],
        materials: vec![
            material(painted([0.1, 0.5, 0.1]), true),
            material(painted([0.3, 0.2, 0.1]), false),
        ],
        ..SourceScene::default()
    }
}

/// The share of what is covered that is covered in one picture and not in the other, and the root mean square difference
/// of colours where both are covered.
fn compare(truth: &[Pixel], shown: &[Pixel]) -> (f64, f64) {
    let covered: f64 = truth.iter().map(|pixel| f64::from(pixel.coverage)).sum();
    let both = truth
        .iter()
        .zip(shown)
        .filter(|(a, b)| a.coverage > 0.5 && b.coverage > 0.5);
    let squares: Vec<f64> = both
        .map(|(a, b)| f64::from((a.colour - b.colour).length_squared()))
        .collect();
    let mean = squares.iter().sum::<f64>() / squares.len().max(1) as f64;
    (difference(truth, shown) / covered, mean.sqrt())
}

/// The mean over directions between views of how far off the impostor is, and how far off another mesh is.
fn off(scene: &SourceScene, below: bool, other: &[Primitive]) -> [(f64, f64); 2] {
    let surfaces = Surfaces::new(scene);
    let body = Body::new(&scene.models[0].primitives, &surfaces).unwrap();
    let other = Body::within(other, &surfaces, (body.centre, body.radius));
    let atlas = draw(&body, wish(below));
    let from = directions(23, below);
    let mut sums = [(0.0, 0.0); 2];
    for direction in &from {
        let truth = body.picture(*direction, SIZE_PX);
        for (sum, shown) in sums
            .iter_mut()
            .zip([show::picture(&atlas, *direction), other.picture(*direction, SIZE_PX)])
        {
            let (covered, coloured) = compare(&truth, &shown);
            *sum = (
                sum.0 + covered / from.len() as f64,
                sum.1 + coloured / from.len() as f64,
            );
        }
    }
    sums
}

#[test]
fn between_its_views_it_looks_like_the_model_and_more_so_than_the_coarsest_level() {
    let scene = scene(tree(700));
    let settings = LodSettings {
        double_sided: [0].into(),
        ..LodSettings::default()
    };
    let levels = chain(&scene.models[0], &settings).levels;
    let coarsest = levels.last().unwrap();
    assert!(levels.len() > 2);
    let [impostor, mesh] = off(&scene, false, &coarsest.primitives);
    eprintln!(
        "impostor {impostor:?}, coarsest level of {} triangles {mesh:?}",
        coarsest.triangles
    );
    assert!(impostor.0 < 0.14 && impostor.1 < 0.04, "{impostor:?}");
    assert!(impostor.0 < 0.6 * mesh.0, "{impostor:?} {mesh:?}");
}

#[test]
fn from_its_own_views_it_is_the_model_but_for_rounding() {
    let scene = scene(tree(300));
    let surfaces = Surfaces::new(&scene);
    let body = Body::new(&scene.models[0].primitives, &surfaces).unwrap();
    for below in [false, true] {
        let atlas = draw(&body, wish(below));
        for view in [[2, 3], [4, 4], [5, 1]] {
            let direction = atlas.wish.mapping().of_view(view, 8);
            let (truth, shown) = (body.picture(direction, SIZE_PX), show::picture(&atlas, direction));
            let (covered, coloured) = compare(&truth, &shown);
            assert!(covered < 0.02 && coloured < 0.02, "{view:?} {covered} {coloured}");
            let turned = truth.iter().zip(&shown).filter(|(a, _)| a.coverage > 0.5);
            let least = turned.map(|(a, b)| a.normal.dot(b.normal)).fold(1.0, f32::min);
            assert!(least > 0.98, "{least}");
        }
    }
}

#[test]
fn one_that_is_seen_from_below_shows_what_is_there() {
    let mut model = tree(0);
    // A red plate under a green one.
    let plate = |y: f32, flip: bool, material| Primitive {
        material: Some(material),
        positions: vec![[-3.0, y, -3.0], [3.0, y, -3.0], [3.0, y, 3.0], [-3.0, y, 3.0]],
        indices: if flip {
            vec![0, 1, 2, 0, 2, 3]
        } else {
            vec![0, 2, 1, 0, 3, 2]
        },
        ..Primitive::default()
    };
    model.primitives = vec![plate(0.1, false, 1), plate(-0.1, true, 2)];
    let mut scene = scene(model);
    // Both can be seen from both sides, so that depth alone decides.
    scene.materials[1] = material(json!({"pbrMetallicRoughness": {"baseColorFactor": [0, 1, 0, 1]}}), true);
    scene.materials.push(material(
        json!({"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}}),
        true,
    ));
    let surfaces = Surfaces::new(&scene);
    let body = Body::new(&scene.models[0].primitives, &surfaces).unwrap();
    let middle = |below: bool, y: f64| {
        let shown = show::picture(&draw(&body, wish(below)), [0.05, y, 0.02]);
        shown[(SIZE_PX * SIZE_PX / 2 + SIZE_PX / 2) as usize]
    };
    for below in [false, true] {
        let seen = middle(below, 1.0);
        assert!(seen.coverage > 0.9 && seen.colour.y > 0.9, "{below} {seen:?}");
    }
    let seen = middle(true, -1.0);
    assert!(seen.coverage > 0.9 && seen.colour.x > 0.9, "{seen:?}");
}

#[test]
fn the_same_model_gives_the_same_bytes_for_any_number_of_threads() {
    let scene = scene(tree(200));
    let baked = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let surfaces = Surfaces::new(&scene);
        pool.install(|| bake(&scene.models[0], &surfaces, wish(true), &Silent).unwrap().unwrap())
    };
    let one = baked(1);
    assert_eq!(one, baked(5));
    for (bytes, channels) in [(&one.colour, 4), (&one.shape, 3)] {
        let picture = image::load_from_memory_with_format(bytes, ImageFormat::Png).unwrap();
        assert_eq!(
            (picture.width(), picture.color().channel_count()),
            (8 * SIZE_PX, channels)
        );
    }
    let pixel = 2.0 * one.radius / f64::from(SIZE_PX);
    assert!(one.error >= pixel && one.error < 3.0 * pixel, "{} {pixel}", one.error);
}

#[test]
fn what_shows_nothing_takes_over_what_lies_beside_it() {
    let scene = scene(tree(200));
    let surfaces = Surfaces::new(&scene);
    let atlas = draw(&Body::new(&scene.models[0].primitives, &surfaces).unwrap(), wish(false));
    let is_of_the_tree = |[r, g, b, _]: &[u8; 4]| *r > 20 && *g > 20 && *b > 20;
    assert!(atlas.colour.iter().all(is_of_the_tree));
    assert!(atlas.colour.iter().any(|[.., alpha]| *alpha == 0));
}

/// A square that faces +Z, and a scene that knows it.
fn square(gltf: serde_json::Value, double_sided: bool) -> SourceScene {
    let mut encoded = std::io::Cursor::new(Vec::new());
    let picture = RgbaImage::from_fn(2, 1, |x, _| {
        image::Rgba(if x == 0 { [255, 0, 0, 255] } else { [0, 0, 255, 60] })
    });
    picture.write_to(&mut encoded, ImageFormat::Png).unwrap();
    let image = |bytes| Image {
        ext: "png",
        media_type: "image/png",
        bytes,
    };
    let model = SourceModel {
        primitives: vec![Primitive {
            material: Some(0),
            positions: vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]],
            uvs: vec![vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]],
            indices: vec![0, 1, 2, 0, 2, 3],
            ..Primitive::default()
        }],
        impostor: Some(wish(false)),
        ..SourceModel::default()
    };
    let texture = |image| Texture { image, sampler: None };
    SourceScene {
        models: vec![model],
        materials: vec![material(gltf, double_sided)],
        textures: vec![texture(0), texture(1)],
        images: vec![image(encoded.into_inner()), image(b"not a picture".to_vec())],
        ..SourceScene::default()
    }
}

/// What is seen left and right of the square's middle, from a side.
fn left_and_right(scene: &SourceScene, z: f64) -> [Pixel; 2] {
    let surfaces = Surfaces::new(scene);
    let body = Body::new(&scene.models[0].primitives, &surfaces).unwrap();
    let seen = body.picture([0.0, 0.0, z], 16);
    [seen[8 * 16 + 5], seen[8 * 16 + 10]]
}

#[test]
fn pictures_masks_and_backs_are_as_their_materials_say() {
    let textured = |index: usize| json!({"index": index});
    let plain =
        json!({"pbrMetallicRoughness": {"baseColorTexture": textured(0), "baseColorFactor": [0.5, 1, 0.25, 1]}});
    let [left, right] = left_and_right(&square(plain.clone(), false), 1.0);
    assert!((left.colour - Vec3::new(0.5, 0.0, 0.0)).length() < 1e-3, "{left:?}");
    assert!((right.colour - Vec3::new(0.0, 0.0, 0.25)).length() < 1e-3, "{right:?}");
    assert!((left.normal - Vec3::Z).length() < 1e-3);
    assert_eq!(
        left_and_right(&square(plain.clone(), false), -1.0).map(|pixel| pixel.coverage),
        [0.0; 2]
    );
    let behind = left_and_right(&square(plain.clone(), true), -1.0);
    let slanted = {
        let scene = square(plain.clone(), true);
        let surfaces = Surfaces::new(&scene);
        let body = Body::new(&scene.models[0].primitives, &surfaces).unwrap();
        body.picture([0.6, 0.0, -0.8], 16)[8 * 16 + 8].normal
    };
    assert!((slanted - Vec3::new(0.6, 0.0, 0.8)).length() < 1e-3, "{slanted}");
    assert!(behind[1].colour.x > 0.4 && behind[0].colour.z > 0.2 && behind[0].normal.z > 0.99);
    for (mode, cutoff, covered) in [
        ("MASK", 0.5, [1.0, 0.0]),
        ("MASK", 0.1, [1.0; 2]),
        ("BLEND", 0.1, [1.0, 0.0]),
    ] {
        let mut masked = plain.clone();
        masked["alphaMode"] = json!(mode);
        masked["alphaCutoff"] = json!(cutoff);
        assert_eq!(
            left_and_right(&square(masked, false), 1.0).map(|pixel| pixel.coverage),
            covered,
            "{mode}"
        );
    }
    let mut turned = plain.clone();
    turned["pbrMetallicRoughness"]["baseColorTexture"] =
        json!({"index": 0, "extensions": {"KHR_texture_transform": {"offset": [0.5, 0]}}});
    assert!(left_and_right(&square(turned, false), 1.0)[0].colour.z > 0.2);
}

#[test]
fn pictures_that_are_not_seen_are_noted() {
    let gltf = json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}});
    let noted = |ext: &'static str| {
        let mut scene = square(gltf.clone(), false);
        scene.models[0].impostor = Some(Wish::DEFAULT);
        scene.images[0].ext = ext;
        let mut defects = Defects::default();
        note_unseen(&scene, &mut defects);
        defects
            .iter()
            .map(|defect| (defect.count, defect.first))
            .collect::<Vec<_>>()
    };
    assert_eq!(noted("png"), []);
    let webp = noted("webp");
    assert_eq!(webp.len(), 1);
    assert!(webp[0].0 == 1 && webp[0].1.ends_with("picture 0 (.webp)"), "{webp:?}");
}

#[test]
fn what_is_broken_or_has_no_extent_does_no_harm() {
    for index in [1, 7, usize::MAX] {
        let gltf =
            json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": index}, "baseColorFactor": ["a", 1e99]}});
        let [left, _] = left_and_right(&square(gltf, false), 1.0);
        assert_eq!(left.colour, Vec3::ONE, "{index}");
    }
    let mut scene = square(json!(null), false);
    let model = &mut scene.models[0];
    model.primitives[0].positions = vec![[3.0; 3]; 4];
    let surfaces = Surfaces::new(&scene);
    assert_eq!(bake(&scene.models[0], &surfaces, Wish::DEFAULT, &Silent).unwrap(), None);
    assert_eq!(
        bake(&SourceModel::default(), &surfaces, Wish::DEFAULT, &Silent).unwrap(),
        None
    );
    let mut huge = square(json!(null), true);
    huge.models[0].primitives[0].positions = vec![[-3e38; 3], [3e38, -3e38, 0.0], [3e38; 3], [0.0, 3e38, 1.0]];
    let surfaces = Surfaces::new(&huge);
    assert!(bake(&huge.models[0], &surfaces, wish(true), &Silent).unwrap().is_some());
}
