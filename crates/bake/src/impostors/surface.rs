//! Which colour has a point of a surface? Base colour alone, as glTF's metallic-roughness model has it: the material's
//! factor times its picture times the vertex's colour, in linear light.
//!
//! What is drawn is either there or not: masked surfaces have their own threshold, blended ones are there from an opacity
//! of a half on. Light that a surface gives off, and what a second picture or an extension would add, is left out.

use std::collections::{BTreeMap, BTreeSet};

use belvedere_scene::impostor::Wish;
use glam::{Vec2, Vec4};
use image::Rgba32FImage;
use rayon::prelude::*;
use serde_json::Value;

use crate::defect::Defects;
use crate::pictures::{self, Content, texels::base_content, transform::Transform};
use crate::source::{Material, Primitive, SourceModel, SourceScene};

/// Opacity from which on a blended surface is there.
const BLENDED: f32 = 0.5;

/// The materials of a scene with the pictures that impostors need.
pub struct Surfaces<'a> {
    scene: &'a SourceScene,
    /// Linear light, alpha not multiplied in; by image, and by what a material reads it as.
    pictures: BTreeMap<(usize, Content), Rgba32FImage>,
}

/// What is drawn of one primitive.
pub struct Surface<'s> {
    factor: Vec4,
    picture: Option<Placed<'s>>,
    /// Where alpha is smaller, there is nothing.
    threshold: Option<f32>,
    /// Whether it is drawn from behind too.
    pub double_sided: bool,
    /// Whether each who wears the model chooses its colour: `extras.belvedere.recolour` of its material.
    pub recolour: bool,
}

/// A picture, and how it lies on a surface.
struct Placed<'s> {
    pixels: &'s Rgba32FImage,
    wrap: [Wrap; 2],
    transform: Transform,
}

#[derive(Clone, Copy)]
enum Wrap {
    Repeat,
    Clamp,
    Mirror,
}

/// The pictures that a model shows as base colours, and as what.
fn shown<'s>(scene: &'s SourceScene, model: &'s SourceModel) -> impl Iterator<Item = (usize, Content)> {
    let materials = model.primitives.iter().filter_map(|primitive| primitive.material);
    materials.filter_map(|index| {
        let material = scene.materials.get(index)?;
        let (index, _) = texture(material)?;
        Some((scene.textures.get(index)?.image, base_content(&material.gltf)))
    })
}

/// Notes models that ask for an impostor in which a picture of theirs is not seen.
pub fn note_unseen(scene: &SourceScene, defects: &mut Defects) {
    let kind = "picture that is neither PNG nor JPEG of a model that asks for an impostor: not seen in it";
    for model in scene.models.iter().filter(|model| model.impostor.is_some()) {
        let images: BTreeSet<usize> = shown(scene, model).map(|(image, _)| image).collect();
        for image in images {
            let ext = scene.images.get(image).map_or("", |image| image.ext);
            let unseen = u64::from(!pictures::is_decoded(ext));
            defects.note(kind, unseen, || {
                format!("model \"{}\", picture {image} (.{ext})", model.name)
            });
        }
    }
}

impl<'a> Surfaces<'a> {
    /// Reads the pictures of all models that ask for an impostor; one that cannot be decoded is white.
    #[must_use]
    pub fn new(scene: &'a SourceScene) -> Self {
        let asking = scene.models.iter().filter(|model| model.impostor.is_some());
        let images: BTreeSet<(usize, Content)> = asking.flat_map(|model| shown(scene, model)).collect();
        // No view shows more of a picture than it has pixels itself, twice that where it wraps around.
        let most_px = 2 * Wish::SIZES_PX[Wish::SIZES_PX.len() - 1];
        let read = |key: (usize, Content)| {
            let (image, content) = key;
            Some((key, pictures::small(scene.images.get(image)?, content, most_px)?))
        };
        let pictures: Vec<_> = images.into_par_iter().filter_map(read).collect();
        Self {
            scene,
            pictures: pictures.into_iter().collect(),
        }
    }

    /// That of a primitive.
    #[must_use]
    pub fn of(&self, primitive: &Primitive) -> Surface<'_> {
        let material = primitive.material.and_then(|index| self.scene.materials.get(index));
        let gltf = material.map_or(&Value::Null, |material| &material.gltf);
        let factor: [f32; 4] =
            std::array::from_fn(|i| number(gltf, &format!("/pbrMetallicRoughness/baseColorFactor/{i}"), 1.0));
        let threshold = match gltf.get("alphaMode").and_then(Value::as_str) {
            Some("MASK") => Some(number(gltf, "/alphaCutoff", 0.5)),
            Some("BLEND") => Some(BLENDED),
            _ => None,
        };
        Surface {
            factor: Vec4::from(factor),
            picture: material.and_then(|material| self.placed(material)),
            threshold,
            double_sided: material.is_some_and(|material| material.double_sided),
            recolour: gltf.pointer("/extras/belvedere/recolour") == Some(&Value::Bool(true)),
        }
    }

    fn placed(&self, material: &Material) -> Option<Placed<'_>> {
        let (index, member) = texture(material)?;
        let texture = self.scene.textures.get(index)?;
        let wrap = |name: &str| {
            let sampler = texture.sampler.as_ref();
            match sampler.and_then(|sampler| sampler.get(name)?.as_u64()) {
                Some(33071) => Wrap::Clamp,
                Some(33648) => Wrap::Mirror,
                _ => Wrap::Repeat,
            }
        };
        Some(Placed {
            pixels: self.pictures.get(&(texture.image, base_content(&material.gltf)))?,
            wrap: [wrap("wrapS"), wrap("wrapT")],
            transform: Transform::of(member),
        })
    }
}

impl Surface<'_> {
    /// Whether all of it is there.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.threshold.is_none()
    }

    /// The colour at a point of a triangle, by the weights of its corners; `None` where there is nothing.
    #[must_use]
    pub fn colour(&self, primitive: &Primitive, corners: [usize; 3], weights: [f32; 3]) -> Option<[f32; 3]> {
        let mut colour = self.factor;
        if let Some(picture) = &self.picture
            && let Some(uvs) = primitive.uvs.get(picture.transform.set)
        {
            let mean = |sum: Vec2, (corner, weight): (usize, f32)| sum + weight * Vec2::from(uvs[corner]);
            colour *= picture.at(corners.into_iter().zip(weights).fold(Vec2::ZERO, mean));
        }
        if !primitive.colors.is_empty() {
            let mean = |sum: Vec4, (corner, weight): (usize, f32)| sum + weight * Vec4::from(primitive.colors[corner]);
            colour *= corners.into_iter().zip(weights).fold(Vec4::ZERO, mean);
        }
        let is_there = self.threshold.is_none_or(|least| colour.w >= least);
        is_there.then(|| colour.truncate().clamp(glam::Vec3::ZERO, glam::Vec3::ONE).to_array())
    }
}

impl Placed<'_> {
    fn at(&self, uv: Vec2) -> Vec4 {
        let at = self.transform.apply(uv.as_dvec2()).as_vec2();
        let place = |axis: usize, count: u32| {
            let x = match self.wrap[axis] {
                Wrap::Repeat => at[axis] - at[axis].floor(),
                Wrap::Clamp => at[axis].clamp(0.0, 1.0),
                Wrap::Mirror => 1.0 - ((at[axis] / 2.0 - (at[axis] / 2.0).floor()) * 2.0 - 1.0).abs(),
            };
            ((x * count as f32) as u32).min(count - 1)
        };
        let (width, height) = self.pixels.dimensions();
        Vec4::from(self.pixels.get_pixel(place(0, width), place(1, height)).0)
    }
}

/// The number of a material's base colour texture, and the member that names it.
fn texture(material: &Material) -> Option<(usize, &Value)> {
    let member = material.gltf.pointer("/pbrMetallicRoughness/baseColorTexture")?;
    Some((usize::try_from(member.get("index")?.as_u64()?).ok()?, member))
}

fn number(value: &Value, pointer: &str, otherwise: f32) -> f32 {
    let found = value.pointer(pointer).and_then(Value::as_f64);
    found.map(|x| x as f32).filter(|x| x.is_finite()).unwrap_or(otherwise)
}
