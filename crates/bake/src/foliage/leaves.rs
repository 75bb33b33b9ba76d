//! Which faces are foliage? Those of materials of which a picture says where they are clear (`alphaMode` `MASK`), and small, loose
//! sheets that are seen from both sides, where a mesh has many of one material: leaves, needles, grass.

use std::collections::BTreeMap;

use glam::{DMat4, DVec2, DVec3};
use image::GrayImage;
use serde_json::Value;

use crate::{
    groups::Groups,
    pictures,
    source::{Material, Primitive, SourceScene, Topology},
};

/// A loose piece is a leaf when its box has no longer diagonal …
const LARGEST_PIECE_M: f64 = 1.0;
/// … and there are at least so many.
const FEWEST_PIECES: usize = 32;
/// A face with a picture has no longer edges; others are fences, nets and curtains, which are not looked into.
const LARGEST_CUT_OUT_M: f64 = 16.0;
/// glTF's, where a material says nothing.
const ALPHA_CUTOFF: f64 = 0.5;

/// A face, in the space of its model.
#[derive(Debug)]
pub(super) struct Leaf {
    corners: [DVec3; 3],
    /// How large what it belongs to is, and may be in world space.
    size: f64,
    largest_m: f64,
    cut_out: Option<(std::rc::Rc<CutOut>, [DVec2; 3])>,
}

/// Where a material is clear.
#[derive(Debug)]
pub(super) struct CutOut {
    alpha: GrayImage,
    /// Texels below are clear.
    least: f64,
}

/// A face in world space.
#[derive(Debug)]
pub(super) struct PlacedLeaf<'a> {
    pub(super) corners: [DVec3; 3],
    cut_out: Option<(&'a CutOut, &'a [DVec2; 3])>,
}

/// The foliage of all models.
pub(super) struct Leaves(Vec<Vec<Leaf>>);

impl Leaves {
    pub(super) fn of(scene: &SourceScene) -> Self {
        let cut_outs: Vec<_> = scene
            .materials
            .iter()
            .map(|material| cut_out(scene, material))
            .collect();
        let models = scene.models.iter().map(|model| {
            let solid = model.primitives.iter().filter(|p| p.topology == Topology::Triangles);
            let leaves = solid.flat_map(|primitive| {
                let material = primitive.material.map(|m| (&scene.materials[m], &cut_outs[m]));
                match material {
                    Some((_, Some((cut_out, set)))) => cut_outs_of(primitive, cut_out, *set),
                    Some((material, None)) if material.double_sided && !material.see_through => pieces_of(primitive),
                    _ => Vec::new(),
                }
            });
            leaves.collect()
        });
        Self(models.collect())
    }

    pub(super) fn of_model(&self, model: usize) -> &[Leaf] {
        &self.0[model]
    }
}

impl Leaf {
    /// Whether it is one when its model is so many times as large.
    pub(super) fn is_small(&self, scale: f64) -> bool {
        self.size * scale <= self.largest_m
    }

    pub(super) fn middle(&self) -> DVec3 {
        let [a, b, c] = self.corners;
        (a + b + c) / 3.0
    }

    pub(super) fn placed(&self, world_from_model: &DMat4) -> PlacedLeaf<'_> {
        PlacedLeaf {
            corners: self.corners.map(|corner| world_from_model.transform_point3(corner)),
            cut_out: self.cut_out.as_ref().map(|(cut_out, uvs)| (&**cut_out, uvs)),
        }
    }
}

impl PlacedLeaf<'_> {
    /// Whether it is there at a place that lies between its corners by these weights.
    pub(super) fn hides_at(&self, weights: [f64; 3]) -> bool {
        self.cut_out.is_none_or(|(cut_out, uvs)| {
            let uv = (0..3).map(|i| weights[i] * uvs[i]).sum::<DVec2>();
            let [width, height] = [cut_out.alpha.width(), cut_out.alpha.height()];
            // Pictures repeat.
            let texel = |x: f64, size: u32| ((x.rem_euclid(1.0) * f64::from(size)) as u32).min(size - 1);
            let alpha = cut_out.alpha.get_pixel(texel(uv.x, width), texel(uv.y, height));
            f64::from(alpha.0[0]) / 255.0 >= cut_out.least
        })
    }
}

/// What a material's picture says, with the set of coordinates that it takes; none where it says nothing that can be read.
fn cut_out(scene: &SourceScene, material: &Material) -> Option<(std::rc::Rc<CutOut>, usize)> {
    let of = |place: &str| material.gltf.pointer(place);
    if of("/alphaMode").and_then(Value::as_str) != Some("MASK") {
        return None;
    }
    let base = "/pbrMetallicRoughness/baseColorTexture";
    let number = |place: String| of(&place).and_then(Value::as_u64);
    let texture = scene.textures.get(number(format!("{base}/index"))? as usize)?;
    if of(&format!("{base}/extensions/KHR_texture_transform")).is_some() {
        return None;
    }
    let alpha = pictures::alpha(scene.images.get(texture.image)?)?;
    let factor = of("/pbrMetallicRoughness/baseColorFactor/3").and_then(Value::as_f64);
    let cutoff = of("/alphaCutoff").and_then(Value::as_f64).unwrap_or(ALPHA_CUTOFF);
    let least = cutoff / factor.unwrap_or(1.0);
    let set = number(format!("{base}/texCoord")).unwrap_or(0);
    Some((std::rc::Rc::new(CutOut { alpha, least }), set as usize))
}

fn cut_outs_of(primitive: &Primitive, cut_out: &std::rc::Rc<CutOut>, set: usize) -> Vec<Leaf> {
    let Some(uvs) = primitive.uvs.get(set) else {
        return Vec::new();
    };
    let faces = primitive.indices.as_chunks::<3>().0.iter();
    let leaf = |face: &[u32; 3]| {
        let corners = corners(primitive, face);
        let [a, b, c] = corners;
        Leaf {
            corners,
            size: a.distance(b).max(b.distance(c)).max(c.distance(a)),
            largest_m: LARGEST_CUT_OUT_M,
            cut_out: Some((
                cut_out.clone(),
                face.map(|i| DVec2::from(uvs[i as usize].map(f64::from))),
            )),
        }
    };
    faces.map(leaf).collect()
}

/// The faces of small pieces, where there are many.
fn pieces_of(primitive: &Primitive) -> Vec<Leaf> {
    let faces = primitive.indices.as_chunks::<3>().0;
    let piece_of = pieces(primitive);
    let mut boxes: BTreeMap<u32, [DVec3; 2]> = BTreeMap::new();
    for (face, piece) in faces.iter().zip(&piece_of) {
        for corner in corners(primitive, face) {
            let [low, high] = boxes.entry(*piece).or_insert([corner; 2]);
            (*low, *high) = (low.min(corner), high.max(corner));
        }
    }
    let size = |piece: &u32| boxes[piece][0].distance(boxes[piece][1]);
    if boxes.len() < FEWEST_PIECES {
        return Vec::new();
    }
    let leaf = |(face, piece): (&[u32; 3], &u32)| Leaf {
        corners: corners(primitive, face),
        size: size(piece),
        largest_m: LARGEST_PIECE_M,
        cut_out: None,
    };
    faces.iter().zip(&piece_of).map(leaf).collect()
}

/// For each face, a number that it shares with those that hang together with it by places of corners.
fn pieces(primitive: &Primitive) -> Vec<u32> {
    let mut first_at: BTreeMap<[u32; 3], u32> = BTreeMap::new();
    let place = |i: u32| primitive.positions[i as usize].map(|x| (x + 0.0).to_bits());
    let mut groups = Groups::of_one(primitive.positions.len());
    let faces = primitive.indices.as_chunks::<3>().0;
    for face in faces {
        let [a, b, c] = face.map(|i| *first_at.entry(place(i)).or_insert(i));
        groups.join(a, b);
        groups.join(a, c);
    }
    faces
        .iter()
        .map(|face| groups.root(first_at[&place(face[0])]))
        .collect()
}

fn corners(primitive: &Primitive, face: &[u32; 3]) -> [DVec3; 3] {
    face.map(|i| DVec3::from(primitive.positions[i as usize].map(f64::from)))
}
