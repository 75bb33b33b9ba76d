//! What of a scene hides a share of what is behind it, and how much? Partial occluders that never move (poster on crowds with
//! partial visibility, §3.1.1: the contents of a cell are projected onto its boundary, and its solidity is the share that
//! they cover).
//!
//! * [`leaves`]: which faces are foliage: what is cut out of pictures by their alpha, and heaps of small, loose sheets.
//! * [`cover`]: their projections onto the sides of boxes of air.
//!
//! Walls and furniture are none: what is hidden behind them is known exactly. Cost: the leaves, and the pixels that they cover.

mod cover;
mod leaves;

use std::collections::{BTreeMap, BTreeSet};

use belvedere_scene::foliage::{Foliage, FoliageSquare, Slab, joined};
use glam::DVec3;

use self::{
    cover::Cover,
    leaves::{Leaf, Leaves},
};
use crate::source::{SourceObject, SourceScene};

/// Squares are at least so large, about as a tree is …
const SMALLEST_M: f64 = 4.0;
/// … and twice as large while there are more of them.
const MOST_SQUARES: usize = 1 << 14;
/// What hides less is left out.
const LEAST_SOLIDITY: f64 = 0.02;

/// Measures the foliage of a scene, in world space.
pub(crate) fn of(scene: &SourceScene) -> Foliage {
    let leaves = Leaves::of(scene);
    let side_m = side(scene, &leaves);
    let mut cover = Cover::new(side_m);
    for (object, leaf) in placed(scene, &leaves) {
        cover.add(&leaf.placed(&object.world_from_object));
    }
    let mut columns: BTreeMap<[i64; 2], Vec<Slab>> = BTreeMap::new();
    for ([x, z], slab) in cover.slabs() {
        columns.entry([x, z]).or_default().push(slab);
    }
    let squares = columns.into_iter().map(|(at, thin)| FoliageSquare {
        at,
        slabs: joined(thin, LEAST_SOLIDITY),
    });
    let squares: Vec<_> = squares.filter(|square| !square.slabs.is_empty()).collect();
    if squares.is_empty() {
        return Foliage::default();
    }
    Foliage { side_m, squares }
}

fn placed<'a>(scene: &'a SourceScene, leaves: &'a Leaves) -> impl Iterator<Item = (&'a SourceObject, &'a Leaf)> + 'a {
    let objects = scene.objects.iter();
    objects.flat_map(|object| {
        let of_model = leaves.of_model(object.model);
        let small = |leaf: &&Leaf| leaf.is_small(object.largest_scale());
        of_model.iter().filter(small).map(move |leaf| (object, leaf))
    })
}

/// The edge of squares of which there are not too many.
fn side(scene: &SourceScene, leaves: &Leaves) -> f64 {
    let mut side_m = SMALLEST_M;
    let mut squares: BTreeSet<[i64; 2]> = BTreeSet::new();
    for (object, leaf) in placed(scene, leaves) {
        let middle: DVec3 = object.world_from_object.transform_point3(leaf.middle());
        squares.insert([middle.x, middle.z].map(|x| (x / side_m).floor() as i64));
        while squares.len() > MOST_SQUARES {
            side_m *= 2.0;
            squares = squares.iter().map(|at| at.map(|x| x.div_euclid(2))).collect();
        }
    }
    side_m
}

#[cfg(test)]
mod tests {
    use glam::DMat4;

    use super::*;
    use crate::{
        cells::plan::Builder,
        source::{Image, Material, Texture},
    };

    /// Sheets of 0.2 m that face both x and z, evenly spread over a box from the origin; each passes none of it.
    fn bush(builder: &mut Builder, count: usize, size: [f32; 3], double_sided: bool) -> u32 {
        let mut positions: Vec<[f32; 3]> = Vec::new();
        for i in 0..count {
            // Halton's sequence for 2, 3 and 5.
            let digit = |base: usize| {
                let (mut share, mut sum, mut n) = (1.0f32, 0.0f32, i + 1);
                while n > 0 {
                    share /= base as f32;
                    sum += share * (n % base) as f32;
                    n /= base;
                }
                sum
            };
            let at = [2, 3, 5].map(digit);
            let [x, y, z] = [0, 1, 2].map(|axis| at[axis] * size[axis]);
            positions.extend([
                [x, y, z],
                [x + 0.2, y, z + 0.2],
                [x + 0.2, y + 0.2, z + 0.2],
                [x, y + 0.2, z],
            ]);
        }
        let indices = (0..count as u32).flat_map(|i| [0, 1, 2, 0, 2, 3].map(|k| 4 * i + k));
        let object = builder.mesh("bush", positions, indices.collect());
        builder.paint(object, false, double_sided);
        object
    }

    fn solidity_at(foliage: &Foliage, at: [i64; 2], height_m: f64) -> f64 {
        let square = foliage.squares.iter().find(|square| square.at == at);
        let slabs = square.map_or(&[][..], |square| &square.slabs);
        let slab = slabs
            .iter()
            .find(|slab| slab.from_m <= height_m && height_m < slab.to_m);
        slab.map_or(0.0, |slab| slab.solidity)
    }

    #[test]
    fn a_bush_covers_what_its_leaves_do_together() {
        let mut builder = Builder::default();
        let bush = bush(&mut builder, 200, [3.8, 2.8, 3.8], true);
        builder.scene.objects[bush as usize].world_from_object = DMat4::from_translation(DVec3::new(-4.0, 1.0, 8.0));
        let foliage = of(&builder.scene);
        assert!(foliage.is_sound() && foliage.side_m == 4.0, "{foliage:?}");
        // 200 leaves of 0.04 m² over 12 m² of each side: 1 − e^(−200·0.04/12) of it, about.
        let solidity = solidity_at(&foliage, [-1, 2], 2.0);
        assert!((0.3..0.55).contains(&solidity), "{foliage:?}");
        assert_eq!(foliage.squares.len(), 1, "{foliage:?}");
        assert_eq!(solidity_at(&foliage, [-1, 2], 0.5), 0.0, "below it");
    }

    #[test]
    fn what_is_large_or_solid_or_lonely_is_no_foliage() {
        let mut builder = Builder::default();
        bush(&mut builder, 200, [3.0, 3.0, 3.0], false);
        bush(&mut builder, 8, [3.0, 3.0, 3.0], true);
        let wall = builder.block("wall", [8.0, 0.0, 0.0], [9.0, 3.0, 20.0]);
        builder.paint(wall, false, true);
        assert!(of(&builder.scene).is_empty());
        let mut builder = Builder::default();
        let vast = bush(&mut builder, 200, [3.0, 3.0, 3.0], true);
        builder.scene.objects[vast as usize].world_from_object = DMat4::from_scale(DVec3::splat(20.0));
        assert!(of(&builder.scene).is_empty(), "these leaves are as large as sails");
    }

    /// A sheet that shows a picture whose left half is clear.
    fn cut_out(alpha_mode: &str, ext: &'static str) -> SourceScene {
        let mut builder = Builder::default();
        let sheet = builder.quad(
            "sheet",
            [[0.0, 0.0, 2.0], [4.0, 0.0, 2.0], [4.0, 1.0, 2.0], [0.0, 1.0, 2.0]],
        );
        let mut scene = builder.scene;
        let picture = image::RgbaImage::from_fn(8, 8, |x, _| image::Rgba([0, 99, 0, if x < 4 { 0 } else { 255 }]));
        let mut bytes = std::io::Cursor::new(Vec::new());
        picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        scene.images.push(Image {
            ext,
            media_type: "image/png",
            bytes: bytes.into_inner(),
        });
        scene.textures.push(Texture {
            image: 0,
            sampler: None,
        });
        scene.materials.push(Material {
            gltf: serde_json::json!({
                "alphaMode": alpha_mode,
                "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
            }),
            see_through: true,
            double_sided: true,
        });
        let model = scene.objects[sheet as usize].model;
        let primitive = &mut scene.models[model].primitives[0];
        primitive.material = Some(scene.materials.len() - 1);
        primitive.uvs = vec![vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]];
        scene
    }

    #[test]
    fn of_a_picture_counts_what_its_alpha_leaves() {
        let foliage = of(&cut_out("MASK", "png"));
        // Half of one pair of sides, and nothing of the other, which sees the edge of the sheet.
        assert_eq!(solidity_at(&foliage, [0, 0], 0.5), 0.25, "{foliage:?}");
        assert!(of(&cut_out("BLEND", "png")).is_empty(), "glass");
        assert!(of(&cut_out("MASK", "ktx2")).is_empty(), "nobody knows what is clear");
    }
}
