//! What was imported? The source scene: the one form that every importer produces and every later stage reads.
//!
//! Spaces: positions are in model space; `world_from_object` places them. Lengths are metres, +Y is up, faces are
//! counter-clockwise seen from their front, angles are radians, as in glTF 2.0.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use belvedere_scene::Bounds;
use belvedere_scene::impostor::Wish;
use belvedere_scene::procedural::{DcgError, Recipe};
use glam::{DMat3, DMat4, DVec3};

use crate::growable::Tie;

/// A scene as read from a source file, before anything was computed.
#[derive(Debug, Clone, Default)]
pub struct SourceScene {
    /// The file's own name for it.
    pub title: Option<String>,
    /// Unique geometry, each at least once used by an object.
    pub models: Vec<SourceModel>,
    /// Placed instances, in source order.
    pub objects: Vec<SourceObject>,
    /// Materials, indexed by [`Primitive::material`].
    pub materials: Vec<Material>,
    /// Textures, indexed by the `index` members inside [`Material::gltf`].
    pub textures: Vec<Texture>,
    /// Pictures, indexed by [`Texture::image`].
    pub images: Vec<Image>,
    /// Cameras and author's viewpoints.
    pub viewpoints: Vec<SourceViewpoint>,
    /// What the author drew for the bake and not for the eye.
    pub authored: Authored,
}

/// Shapes that an author drew for the bake: nobody sees them. In source order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Authored {
    /// View cells: closed convex polyhedra (`cell:`).
    pub cells: Vec<AuthoredShape>,
    /// Openings between two cells: plane polygons (`portal:`).
    pub portals: Vec<AuthoredShape>,
    /// Bodies that hide: closed convex polyhedra inside of what is drawn (`occluder:`).
    pub occluders: Vec<AuthoredShape>,
}

impl Authored {
    /// The same where the rules that say it lie in a folder.
    pub(crate) fn put_below(&mut self, folder: &str) {
        let Self {
            cells,
            portals,
            occluders,
        } = self;
        let shapes = cells.iter_mut().chain(portals).chain(occluders);
        for said in shapes.filter_map(|shape| shape.said.as_mut()) {
            folder.clone_into(&mut Arc::make_mut(said).folder);
        }
    }
}

/// One of them.
#[derive(Debug, Clone, PartialEq)]
pub struct AuthoredShape {
    /// The name of its node, or `node[i]`.
    pub node: String,
    /// Its triangles in world space, either way round.
    pub triangles: Vec<[DVec3; 3]>,
    /// Where it was called so, when it has grown from rules.
    pub said: Option<Arc<Said>>,
}

/// A place in rules.
#[derive(Debug, Clone, PartialEq)]
pub struct Said {
    /// The texts of all files by their names.
    pub texts: Arc<BTreeMap<String, String>>,
    /// Where these files lie, from the source's folder.
    pub folder: String,
    /// One of them.
    pub file: String,
    /// Byte in its text.
    pub at: u32,
}

impl Said {
    /// What is wrong with what is said there, with file, line and column.
    #[must_use]
    pub fn told(&self, what: String) -> String {
        let text = self.texts.get(&self.file).map_or("", String::as_str);
        DcgError::of_grown(&self.file, text, self.at, what)
            .below(&self.folder)
            .to_string()
    }
}

impl AuthoredShape {
    /// Triangles where a map leads them, but for those that are not finite there.
    pub(crate) fn placed(
        node: String,
        triangles: impl IntoIterator<Item = [DVec3; 3]>,
        world_from_shape: DMat4,
    ) -> Self {
        let placed = triangles
            .into_iter()
            .map(|triangle| triangle.map(|corner| world_from_shape.transform_point3(corner)));
        let triangles = placed.filter(|triangle| triangle.iter().all(|corner| corner.is_finite()));
        Self {
            node,
            triangles: triangles.collect(),
            said: None,
        }
    }
}

/// Unique geometry.
#[derive(Debug, Clone, Default)]
pub struct SourceModel {
    /// The source's name for it, or `mesh[i]`.
    pub name: String,
    /// One for each material and topology.
    pub primitives: Vec<Primitive>,
    /// Positions along which it was cut from other parts of its mesh. Levels keep them, so that parts do not come apart.
    pub cut_positions: Vec<[f32; 3]>,
    /// What pictures it asks for, to be drawn with from far away.
    pub impostor: Option<Wish>,
    /// The frames of a round of its movement, each with its own geometry in the model's space; empty for what keeps still.
    pub poses: Vec<Vec<Primitive>>,
    /// The same where they are grown when they are needed, one after the other: all of them would take too much.
    pub frames: Option<Frames>,
    /// How its author wants it to look from ever farther away, in the model's space; empty where that is left to the bake.
    pub coarser: Vec<Vec<Primitive>>,
    /// How it grows, when it is whole and has grown from rules.
    pub recipe: Option<SourceRecipe>,
    /// What keeps it from that, when it has grown from rules and not by itself.
    pub tie: Option<Tie>,
}

/// Poses that are grown when they are needed.
#[derive(Clone)]
pub struct Frames {
    /// How many there are.
    pub count: u32,
    /// Grows one; materials of its primitives are numbers of `looks`.
    pub grow: Arc<dyn Fn(u32) -> Vec<Primitive> + Send + Sync>,
    /// For each of their materials a primitive that has it and nothing else, so that it is led where those of all others are.
    pub looks: Vec<Primitive>,
}

impl std::fmt::Debug for Frames {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Frames")
            .field("count", &self.count)
            .field("looks", &self.looks)
            .finish_non_exhaustive()
    }
}

/// Rules from which a model grows.
#[derive(Debug, Clone)]
pub struct SourceRecipe {
    /// The texts of all files by their names.
    pub texts: Arc<BTreeMap<String, String>>,
    /// Which part of which file, with which parameters.
    pub recipe: Recipe,
    /// Where random numbers come from.
    pub seed: u32,
}

/// Geometry with one material. Strips, fans and loops are already unrolled; indices are in range; positions finite.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Primitive {
    /// How indices make shapes.
    pub topology: Topology,
    /// Index into [`SourceScene::materials`]; `None` is glTF's default material.
    pub material: Option<usize>,
    /// One for each vertex.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals, one for each vertex, or empty.
    pub normals: Vec<[f32; 3]>,
    /// Tangents with handedness in w, one for each vertex, or empty.
    pub tangents: Vec<[f32; 4]>,
    /// Texture coordinate sets 0, 1, …: each holds one for each vertex.
    pub uvs: Vec<Vec<[f32; 2]>>,
    /// Linear RGBA colours, one for each vertex, or empty.
    pub colors: Vec<[f32; 4]>,
    /// One (points), two (lines) or three (triangles) indices for each shape.
    pub indices: Vec<u32>,
}

/// How indices make shapes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Topology {
    /// One index each.
    Points,
    /// Two indices each.
    Lines,
    /// Three indices each.
    #[default]
    Triangles,
}

impl Topology {
    /// How many indices make one shape.
    #[must_use]
    pub fn arity(self) -> usize {
        match self {
            Self::Points => 1,
            Self::Lines => 2,
            Self::Triangles => 3,
        }
    }
}

/// A placed instance of a model.
#[derive(Debug, Clone)]
pub struct SourceObject {
    /// The name of its node, or `node[i]`.
    pub source_node: String,
    /// Which part of a mesh that was split spatially, 0 when it was not.
    pub part: u32,
    /// Index into [`SourceScene::models`].
    pub model: usize,
    /// Places model space in the world; finite and affine, may mirror.
    pub world_from_object: DMat4,
    /// What its author said it is.
    pub role: Role,
}

/// What an author said an object is, through `extras.belvedere` or a name prefix (`door:` …).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Role {
    /// Nothing special.
    #[default]
    Ordinary,
    /// Can be opened and closed. Visible sets are those with all doors open; entries name the doors that hide them.
    Door,
}

/// A material, kept as glTF wrote it.
#[derive(Debug, Clone)]
pub struct Material {
    /// The glTF material object. Every `index` inside a `…Texture` member is an index into [`SourceScene::textures`].
    pub gltf: serde_json::Value,
    /// Whether light passes in places: alpha mode `MASK` or `BLEND`, or transmission. Such faces hide nothing.
    pub see_through: bool,
    /// Whether back faces are drawn. Where they are not, one sees through a face from behind.
    pub double_sided: bool,
}

/// A picture with a way of sampling it.
#[derive(Debug, Clone)]
pub struct Texture {
    /// Index into [`SourceScene::images`].
    pub image: usize,
    /// The glTF sampler object, when there is one.
    pub sampler: Option<serde_json::Value>,
}

/// A picture as it was encoded in the source.
#[derive(Debug, Clone)]
pub struct Image {
    /// `png`, `jpg`, `webp`, `ktx2` … by what the bytes say.
    pub ext: &'static str,
    /// `image/png` …
    pub media_type: &'static str,
    /// The encoded picture.
    pub bytes: Vec<u8>,
}

/// A place to start from.
#[derive(Debug, Clone)]
pub struct SourceViewpoint {
    /// Its name for people.
    pub name: String,
    /// The eye and its axes; looks along −Z, +Y up, as a glTF camera does.
    pub world_from_camera: DMat4,
}

impl SourceScene {
    /// Triangles of all objects.
    #[must_use]
    pub fn placed_triangles(&self) -> usize {
        let of_models: Vec<usize> = self.models.iter().map(SourceModel::triangle_count).collect();
        self.objects.iter().map(|object| of_models[object.model]).sum()
    }

    /// What all objects would take without any coding: 12 bytes for each vertex and 6 for each triangle.
    #[must_use]
    pub fn explicit_bytes(&self) -> u64 {
        let vertices = |model: &SourceModel| model.primitives.iter().map(|p| p.positions.len()).sum::<usize>();
        let of_model = |model: &SourceModel| 12 * vertices(model) as u64 + 6 * model.triangle_count() as u64;
        let of_models: Vec<u64> = self.models.iter().map(of_model).collect();
        self.objects.iter().map(|object| of_models[object.model]).sum()
    }

    /// The box around all objects, as tight as their points are known. Each point is looked at only of objects that reach beyond those
    /// before them.
    #[must_use]
    pub fn exact_bounds(&self) -> Bounds {
        let of_models: Vec<Bounds> = self.models.iter().map(|model| Bounds::around(points(model))).collect();
        let mut all = Bounds::EMPTY;
        for object in &self.objects {
            let matrix = &object.world_from_object;
            let world = |point: [f64; 3]| matrix.transform_point3(DVec3::from_array(point)).to_array();
            let own = &of_models[object.model];
            if !own.is_empty() && all.union(&Bounds::around(own.corners().map(world))) != all {
                all = all.union(&Bounds::around(points(&self.models[object.model]).map(world)));
            }
        }
        all
    }

    /// A box that holds all objects: around the boxes of their models as they stand.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        let of_models: Vec<Bounds> = self.models.iter().map(|model| Bounds::around(points(model))).collect();
        let mut all = Bounds::EMPTY;
        for object in &self.objects {
            let world = |corner| {
                object
                    .world_from_object
                    .transform_point3(DVec3::from_array(corner))
                    .to_array()
            };
            let own = &of_models[object.model];
            if !own.is_empty() {
                all = all.union(&Bounds::around(own.corners().map(world)));
            }
        }
        all
    }
}

/// The points of a model, in its own space.
fn points(model: &SourceModel) -> impl Iterator<Item = [f64; 3]> {
    let positions = model.primitives.iter().flat_map(|primitive| &primitive.positions);
    positions.map(|position| position.map(f64::from))
}

impl SourceObject {
    /// An upper bound of how much the transform stretches any length: the square root of the product of the largest
    /// column sum and the largest row sum bounds the spectral norm.
    #[must_use]
    pub fn largest_scale(&self) -> f64 {
        let linear = DMat3::from_mat4(self.world_from_object);
        let product = linear.transpose() * linear;
        // For a transform without shear the product is diagonal and this is exact.
        let row_sum = |row: DVec3| row.abs().element_sum();
        [product.x_axis, product.y_axis, product.z_axis]
            .map(row_sum)
            .into_iter()
            .fold(0.0, f64::max)
            .sqrt()
    }
}

impl Primitive {
    /// How many shapes there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.indices.len() / self.topology.arity()
    }

    /// The corners of each triangle; nothing for points and lines.
    pub fn triangles(&self) -> impl Iterator<Item = [[f32; 3]; 3]> {
        let indices = if self.topology == Topology::Triangles {
            &self.indices[..]
        } else {
            &[]
        };
        indices
            .as_chunks::<3>()
            .0
            .iter()
            .map(|t| t.map(|i| self.positions[i as usize]))
    }

    /// The same in double precision.
    pub(crate) fn exact_triangles(&self) -> impl Iterator<Item = [DVec3; 3]> {
        self.triangles().map(|t| t.map(|p| p.map(f64::from).into()))
    }
}

impl SourceModel {
    /// Its geometry, that of its poses and what its author made coarser.
    pub(crate) fn all_primitives_mut(&mut self) -> impl Iterator<Item = &mut Primitive> {
        let others = self.poses.iter_mut().chain(&mut self.coarser);
        let looks = self.frames.iter_mut().flat_map(|frames| &mut frames.looks);
        self.primitives.iter_mut().chain(others.flatten()).chain(looks)
    }

    /// How many poses there are to draw; one of what keeps still.
    #[must_use]
    pub fn pose_count(&self) -> u32 {
        match &self.frames {
            Some(frames) => frames.count,
            None => self.poses.len().max(1) as u32,
        }
    }

    /// One of its poses.
    #[must_use]
    pub fn pose(&self, number: u32) -> Cow<'_, [Primitive]> {
        let Some(frames) = &self.frames else {
            return self.poses.get(number as usize).unwrap_or(&self.primitives).into();
        };
        let mut pose = (frames.grow)(number);
        for primitive in &mut pose {
            let look = primitive.material.and_then(|look| frames.looks.get(look));
            primitive.material = look.and_then(|look| look.material);
        }
        pose.into()
    }

    /// Triangles of all primitives.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.primitives
            .iter()
            .filter(|p| p.topology == Topology::Triangles)
            .map(Primitive::count)
            .sum()
    }
}
