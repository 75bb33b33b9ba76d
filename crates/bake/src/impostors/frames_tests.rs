//! What holds of impostors that move: each frame is its pose, colours that others choose are noted, nothing depends on threads.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use belvedere_scene::impostor::Wish;
use glam::Vec3;
use image::{ImageFormat, RgbaImage};
use serde_json::json;

use super::*;
use crate::progress::{Counted, Silent, Stage};
use crate::source::{Frames, Material, Primitive, SourceScene};

const SIZE_PX: u32 = 32;

fn material(gltf: serde_json::Value) -> Material {
    Material {
        gltf,
        see_through: false,
        double_sided: true,
    }
}

/// A flag on a pole, whose cloth each chooses: it points along +x, then +z.
fn flag() -> SourceScene {
    let sheet = |cloth: [[f32; 3]; 4], material| Primitive {
        material: Some(material),
        positions: cloth.to_vec(),
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Primitive::default()
    };
    let pole = sheet(
        [[-0.3, 0.0, 0.0], [0.3, 0.0, 0.0], [0.3, 4.0, 0.0], [-0.3, 4.0, 0.0]],
        0,
    );
    let along = |x: f32, z: f32| {
        let cloth = [
            [0.0, 2.0, 0.0],
            [2.0 * x, 2.0, 2.0 * z],
            [2.0 * x, 4.0, 2.0 * z],
            [0.0, 4.0, 0.0],
        ];
        vec![pole.clone(), sheet(cloth, 1)]
    };
    let poses = vec![along(1.0, 0.0), along(0.0, 1.0)];
    let painted = json!({"extras": {"belvedere": {"recolour": true}}});
    SourceScene {
        models: vec![SourceModel {
            primitives: poses[0].clone(),
            poses,
            impostor: Some(Wish {
                frames: 2,
                size_px: SIZE_PX,
                ..Wish::DEFAULT
            }),
            ..SourceModel::default()
        }],
        materials: vec![material(json!({})), material(painted)],
        ..SourceScene::default()
    }
}

/// The pixels of a picture as RGBA, and those of one of its frames.
fn frame(png: &[u8], number: u32) -> RgbaImage {
    let picture = image::load_from_memory_with_format(png, ImageFormat::Png)
        .unwrap()
        .into_rgba8();
    let side = picture.width();
    assert_eq!(picture.height(), 2 * side);
    image::imageops::crop_imm(&picture, 0, number * side, side, side).to_image()
}

#[test]
fn each_frame_shows_its_own_pose_in_the_ball_of_all() {
    let scene = flag();
    let surfaces = Surfaces::new(&scene);
    let wish = scene.models[0].impostor.unwrap();
    let moving = bake(&scene.models[0], &surfaces, wish, &Silent).unwrap().unwrap();
    assert_eq!(moving.frames, 2);
    let ball = (moving.centre.into(), moving.radius);
    for (number, pose) in scene.models[0].poses.iter().enumerate() {
        let alone = draw(&Body::within(pose, &surfaces, ball), Wish { frames: 1, ..wish });
        let still = image::load_from_memory(&alone.colour_png()).unwrap().into_rgba8();
        assert_eq!(frame(&moving.colour, number as u32), still, "frame {number}");
    }
    assert_ne!(frame(&moving.colour, 0), frame(&moving.colour, 1));
}

/// The same model, whose two poses are grown when they are drawn.
fn grown_later(
    model: &SourceModel,
    looks: Vec<Primitive>,
    grow: impl Fn(u32) -> Vec<Primitive> + Send + Sync + 'static,
) -> SourceModel {
    SourceModel {
        poses: Vec::new(),
        frames: Some(Frames {
            count: 2,
            grow: Arc::new(grow),
            looks,
        }),
        ..model.clone()
    }
}

/// Stops when so many frames were grown.
struct Grown {
    count: Arc<AtomicU32>,
    most: u32,
}

impl Progress for Grown {
    fn start(&self, _: Stage, _: u64) {}
    fn advance(&self, _: u64) {}
    fn cancelled(&self) -> bool {
        self.count.load(Ordering::Relaxed) >= self.most
    }
}

/// Both are grown for their corners, for how far these reach, and to be drawn.
#[test]
fn who_cancels_waits_for_one_frame_at_most() {
    let scene = flag();
    let surfaces = Surfaces::new(&scene);
    let model = &scene.models[0];
    for most in 0..6 {
        let count = Arc::new(AtomicU32::new(0));
        let (poses, grown) = (model.poses.clone(), Arc::clone(&count));
        let later = grown_later(model, Vec::new(), move |number| {
            grown.fetch_add(1, Ordering::Relaxed);
            poses[number as usize].clone()
        });
        let progress = Grown { count, most };
        let stopped = bake(&later, &surfaces, model.impostor.unwrap(), &progress);
        assert_eq!(stopped, Err(Cancelled));
        assert_eq!(progress.count.load(Ordering::Relaxed), most);
    }
}

/// One after the other and with materials of their own numbers, they are the same pictures, and each is a step.
#[test]
fn frames_that_are_grown_when_they_are_drawn_look_the_same() {
    let scene = flag();
    let surfaces = Surfaces::new(&scene);
    let model = &scene.models[0];
    let wish = model.impostor.unwrap();
    let numbered = |pose: &Vec<Primitive>| {
        let other = pose.iter().map(|primitive| Primitive {
            material: primitive.material.map(|material| 1 - material),
            ..primitive.clone()
        });
        other.collect::<Vec<_>>()
    };
    let poses: Vec<Vec<Primitive>> = model.poses.iter().map(numbered).collect();
    let look = |material| Primitive {
        material: Some(material),
        ..Primitive::default()
    };
    let later = grown_later(model, vec![look(1), look(0)], move |number| {
        poses[number as usize].clone()
    });
    let counted = Counted::default();
    let drawn = bake(&later, &surfaces, wish, &counted).unwrap();
    assert_eq!(drawn, bake(model, &surfaces, wish, &Silent).unwrap());
    assert_eq!(counted.made.into_inner(), 2);
}

#[test]
fn where_each_chooses_the_colour_is_noted_and_nowhere_else() {
    let scene = flag();
    let surfaces = Surfaces::new(&scene);
    let baked = bake(&scene.models[0], &surfaces, scene.models[0].impostor.unwrap(), &Silent)
        .unwrap()
        .unwrap();
    // From +z the flag of the first frame lies to the right, above the middle; the pole is below it.
    let [column, row] = (0..8 * 8)
        .map(|number| [number % 8, number / 8])
        .min_by(|a, b| {
            let away = |view: &[u32; 2]| {
                let direction = Vec3::from_array(Wish::DEFAULT.mapping().of_view(*view, 8).map(|x| x as f32));
                direction.distance(Vec3::Z)
            };
            away(a).total_cmp(&away(b))
        })
        .unwrap();
    let view = |png: &[u8]| {
        let (x, y) = (column * SIZE_PX, row * SIZE_PX);
        image::imageops::crop_imm(&frame(png, 0), x, y, SIZE_PX, SIZE_PX).to_image()
    };
    let (colour, shape) = (view(&baked.colour), view(&baked.shape));
    let covered = || colour.enumerate_pixels().filter(|(.., pixel)| pixel.0[3] == 255);
    let own = |x: u32, y: u32| shape.get_pixel(x, y).0[3];
    let (below, above): (Vec<_>, Vec<_>) = covered().partition(|(_, y, _)| *y > SIZE_PX / 2 + 2);
    assert!(
        below.len() > 20 && below.iter().all(|(x, y, _)| own(*x, *y) == 255),
        "{}",
        below.len()
    );
    let chosen = above.iter().filter(|(x, y, _)| own(*x, *y) == 0).count();
    assert!(chosen > 50, "{chosen} of {}", above.len());
}

#[test]
fn what_nobody_chooses_takes_no_fourth_channel() {
    let mut scene = flag();
    scene.materials[1] = material(json!({"extras": {"belvedere": {"recolour": 1}}}));
    let surfaces = Surfaces::new(&scene);
    let baked = bake(&scene.models[0], &surfaces, scene.models[0].impostor.unwrap(), &Silent)
        .unwrap()
        .unwrap();
    let picture = image::load_from_memory(&baked.shape).unwrap();
    assert_eq!(picture.color().channel_count(), 3);
}

#[test]
fn frames_are_the_same_bytes_for_any_number_of_threads() {
    let scene = flag();
    let baked = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let surfaces = Surfaces::new(&scene);
        pool.install(|| {
            bake(&scene.models[0], &surfaces, scene.models[0].impostor.unwrap(), &Silent)
                .unwrap()
                .unwrap()
        })
    };
    assert_eq!(baked(1), baked(2));
}
