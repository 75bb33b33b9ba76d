//! In which size does a level show each picture? The smallest whose texels are no longer than the level's error; and what has
//! no coarser mesh has levels with smaller pictures.

use std::collections::{BTreeMap, BTreeSet};

use belvedere_scene::object::TextureRef;
use glam::DVec2;
use rayon::prelude::*;

use super::sink::{Ledger, SinkError};
use crate::{
    glb,
    lod::LodLevel,
    pictures::{self, texels},
    source::{SourceModel, SourceScene},
};

/// A picture of fewer bytes is not worth a level that shows it smaller.
const LEAST_PICTURE_BYTES: u64 = 4 << 10;

/// Every picture in all sizes, stored.
pub(super) struct Pictures<'a> {
    pub(super) scene: &'a SourceScene,
    /// For each picture how wide and high it is, where anybody could tell, and its sizes.
    ladders: Vec<(Option<[u32; 2]>, Vec<TextureRef>)>,
}

impl<'a> Pictures<'a> {
    pub(super) fn write(scene: &'a SourceScene, ledger: &Ledger<'_>) -> Result<Self, SinkError> {
        let contents = texels::contents(&scene.materials, &scene.textures, scene.images.len());
        let ladders = scene.images.par_iter().zip(contents).map(|(image, content)| {
            let ladder = pictures::ladder(image, content);
            let put = |bytes| {
                ledger
                    .put(image.ext, bytes)
                    .map(|(url, bytes)| TextureRef { url, bytes })
            };
            Ok((
                ladder.size_px,
                ladder.rungs.into_iter().map(put).collect::<Result<_, _>>()?,
            ))
        });
        Ok(Self {
            scene,
            ladders: ladders.collect::<Result<_, _>>()?,
        })
    }

    /// A picture as it came.
    pub(super) fn whole(&self, image: usize) -> &TextureRef {
        &self.ladders[image].1[0]
    }

    /// The pictures as a model shows them.
    pub(super) fn on(&self, model: &SourceModel) -> PicturesOnModel<'_> {
        PicturesOnModel {
            ladders: &self.ladders,
            covered: texels::covered(&model.primitives, &self.scene.materials, &self.scene.textures),
        }
    }
}

/// Which size of each picture a level of a model takes.
pub(super) struct PicturesOnModel<'a> {
    pub(super) ladders: &'a [(Option<[u32; 2]>, Vec<TextureRef>)],
    /// The lengths that a picture's width and height cover, in model units.
    pub(super) covered: BTreeMap<usize, DVec2>,
}

impl PicturesOnModel<'_> {
    /// The smallest size whose texels are no longer than a level's error; the largest when nobody knows how long they are.
    pub(super) fn at(&self, image: usize, geometric_error: f64) -> &TextureRef {
        &self.ladders[image].1[self.halvings(image, geometric_error)]
    }

    /// How often it is halved for a level of this error.
    fn halvings(&self, image: usize, geometric_error: f64) -> usize {
        let fine_enough = |halvings: &usize| {
            self.texel(image, *halvings)
                .is_some_and(|texel| texel <= geometric_error)
        };
        (1..self.ladders[image].1.len()).take_while(fine_enough).count()
    }

    /// How long the longer side of a texel is in model units when the picture is halved so often.
    fn texel(&self, image: usize, halvings: usize) -> Option<f64> {
        let side_px = self.ladders[image].0?.map(|px| f64::from((px >> halvings).max(1)));
        Some((self.covered.get(&image)? / DVec2::from(side_px)).max_element())
    }

    /// The same mesh with its largest picture two sizes smaller, or as many more as it takes to be another picture, at the error from
    /// which on that is good enough; `None` where that would save next to nothing.
    pub(super) fn with_smaller(&self, level: LodLevel, scene: &SourceScene) -> Option<LodLevel> {
        let used = pictures_of(&level, scene).into_iter();
        let largest = used.max_by_key(|image| self.at(*image, level.geometric_error).bytes)?;
        let (halvings, rungs) = (self.halvings(largest, level.geometric_error), &self.ladders[largest].1);
        if rungs[halvings].bytes < LEAST_PICTURE_BYTES {
            return None;
        }
        let is_another = |smaller: &usize| rungs[*smaller] != rungs[halvings];
        let smaller = ((halvings + 2).min(rungs.len() - 1)..rungs.len()).find(is_another)?;
        let geometric_error = self.texel(largest, smaller)?;
        (geometric_error > level.geometric_error).then_some(LodLevel {
            geometric_error,
            ..level
        })
    }
}

/// The pictures that a level shows.
pub(super) fn pictures_of(level: &LodLevel, scene: &SourceScene) -> BTreeSet<usize> {
    let textures = glb::used_textures(&level.primitives, &scene.materials);
    textures
        .into_iter()
        .map(|texture| scene.textures[texture].image)
        .collect()
}

#[cfg(test)]
mod tests {
    use belvedere_scene::BlobName;

    use super::*;
    use crate::source::{Material, Primitive, Texture};

    /// Of a model with 1,024 texels along 4 units, of which nothing but the picture gets smaller: the errors of its levels in texels,
    /// and the bytes of their pictures.
    fn shown(ladder: &[u64]) -> Vec<(f64, u64)> {
        let scene = SourceScene {
            materials: vec![Material {
                gltf: serde_json::json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}),
                see_through: false,
                double_sided: false,
            }],
            textures: vec![Texture {
                image: 0,
                sampler: None,
            }],
            ..SourceScene::default()
        };
        let rung = |bytes: &u64| TextureRef {
            url: BlobName::of(&bytes.to_le_bytes(), "png").unwrap(),
            bytes: *bytes,
        };
        let pictures = PicturesOnModel {
            ladders: &[(Some([1024, 1024]), ladder.iter().map(rung).collect())],
            covered: BTreeMap::from([(0, DVec2::splat(4.0))]),
        };
        let whole = LodLevel {
            geometric_error: 0.0,
            triangles: 1,
            lines: 0,
            primitives: vec![Primitive {
                material: Some(0),
                positions: vec![[0.0; 3], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0]],
                indices: vec![0, 1, 2],
                ..Primitive::default()
            }],
        };
        let mut shown = Vec::new();
        let mut last = Some(whole);
        while let Some(level) = last {
            let error = level.geometric_error;
            shown.push(((error * 256.0).round(), pictures.at(0, error).bytes));
            last = pictures.with_smaller(level, &scene);
        }
        shown
    }

    #[test]
    fn pictures_get_smaller_where_the_mesh_does_not() {
        let shown = shown(&[900_000, 300_000, 80_000, 20_000, 6_000, 1_500]);
        assert_eq!(shown, [(0.0, 900_000), (4.0, 80_000), (16.0, 6_000), (32.0, 1_500)]);
    }

    #[test]
    fn no_level_shows_the_picture_of_the_one_before() {
        // Sizes that would save nothing are the larger one again.
        let shown = shown(&[90_000, 90_000, 90_000, 60_000, 60_000, 20_000]);
        assert_eq!(shown, [(0.0, 90_000), (8.0, 60_000), (32.0, 20_000)]);
    }

    #[test]
    fn a_picture_is_as_fine_as_the_longer_side_of_its_texels_asks_for() {
        let rung = |bytes: u64| TextureRef {
            url: BlobName::of(&bytes.to_le_bytes(), "png").unwrap(),
            bytes,
        };
        let pictures = PicturesOnModel {
            ladders: &[(Some([1000, 13]), [9, 8, 7, 6].map(rung).to_vec())],
            covered: BTreeMap::from([(0, DVec2::new(1.0, 2.0))]),
        };
        // 13 texels along 2 units, then 6, 3 and 1.
        for (error, bytes) in [
            (0.0, 9),
            (0.2, 9),
            (0.34, 8),
            (0.6, 8),
            (0.67, 7),
            (1.9, 7),
            (2.0, 6),
            (9.0, 6),
        ] {
            assert_eq!(pictures.at(0, error).bytes, bytes, "{error}");
        }
    }
}
