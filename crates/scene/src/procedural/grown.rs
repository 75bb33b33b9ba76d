//! What has grown? Parts that are placed, and what they look like.

use super::affine::Affine;
use super::limits::Usage;
use super::recipe::Recipe;
use super::solid::Mesh;
use crate::{Bounds, impostor::Wish};

/// A model with all its triangles.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Grown {
    /// Pieces of geometry; the first is the whole model, later ones are placed by earlier or later ones, never in a cycle.
    pub parts: Vec<Part>,
    /// Materials, indexed by [`Mesh::material`].
    pub materials: Vec<Surface>,
    /// What it took.
    pub usage: Usage,
}

/// A piece of geometry in its own space.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// The name of its rule or file, or the name that it was called.
    pub name: String,
    /// Where `called` gave the name, if that did: then it is also the name of what is placed in it.
    pub called: Option<SaidInFile>,
    /// What pictures it asks for, to be drawn with from far away.
    pub impostor: Option<Wish>,
    /// Where it asks for them, or says how many frames they have.
    pub asked: Option<SaidInFile>,
    /// How it can be made alone, when it can.
    pub recipe: Option<Recipe>,
    /// Whether it has taken on the paint that it is called in.
    pub takes_paint: bool,
    /// Its own triangles, one mesh for each material.
    pub meshes: Vec<Mesh>,
    /// Parts that it places.
    pub placements: Vec<Placement>,
    /// glTF files that it places.
    pub models: Vec<(String, Affine)>,
    /// Where one may look from; along −z, with +y up.
    pub viewpoints: Vec<(String, Affine)>,
    /// A box that holds it and all that it places: of glTF files those whose boxes were given.
    pub bounds: Bounds,
}

/// Where something is said.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct SaidInFile {
    /// Which of the program's [files](super::Program::files).
    pub file: usize,
    /// Byte in its text.
    pub at: u32,
}

/// A part in its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Index into [`Grown::parts`].
    pub part: usize,
    /// Places it in the space of the part that contains it.
    pub frame: Affine,
}

/// A material of the metallic-roughness model.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// The name of its rule.
    pub name: String,
    /// Linear light.
    pub colour: [f64; 3],
    /// 0 to 1.
    pub roughness: f64,
    /// 0 to 1.
    pub metallic: f64,
    /// Linear light that it gives off.
    pub emissive: [f64; 3],
    /// Below 1 one sees through.
    pub opacity: f64,
    /// Whether it is drawn from behind too.
    pub double_sided: bool,
    /// Whether each who wears the model chooses its colour.
    pub recolour: bool,
}

impl Default for Surface {
    /// What is not painted.
    fn default() -> Self {
        Self {
            name: "plain".to_owned(),
            colour: [0.6; 3],
            roughness: 0.9,
            metallic: 0.0,
            emissive: [0.0; 3],
            opacity: 1.0,
            double_sided: false,
            recolour: false,
        }
    }
}

/// A part in the world.
#[derive(Debug, Clone, PartialEq)]
pub struct Instance<'g> {
    /// Index into [`Grown::parts`].
    pub part: usize,
    /// What it was called, or its part's name.
    pub name: &'g str,
    /// Where it was called so.
    pub said: Option<SaidInFile>,
    /// Places it in the world.
    pub world_from_part: Affine,
}

impl Part {
    pub(super) fn new(name: &str, called: Option<SaidInFile>) -> Self {
        Self {
            name: name.to_owned(),
            called,
            impostor: None,
            asked: None,
            recipe: None,
            takes_paint: false,
            meshes: Vec::new(),
            placements: Vec::new(),
            models: Vec::new(),
            viewpoints: Vec::new(),
            bounds: Bounds::EMPTY,
        }
    }
}

impl Grown {
    /// Every part in the world, parents before children, also those without triangles of their own.
    #[must_use]
    pub fn instances(&self) -> Vec<Instance<'_>> {
        let mut instances = Vec::new();
        let mut stack = vec![(0, None, Affine::IDENTITY)];
        while let Some((index, called, world_from_part)) = stack.pop() {
            let part = &self.parts[index];
            let called = part.called.map(|said| (part.name.as_str(), said)).or(called);
            instances.push(Instance {
                part: index,
                name: called.map_or(&part.name, |(name, _)| name),
                said: called.map(|(_, said)| said),
                world_from_part,
            });
            let children = part.placements.iter().rev();
            stack.extend(children.map(|child| (child.part, called, world_from_part.after(&child.frame))));
        }
        instances
    }

    /// Triangles of all instances.
    #[must_use]
    pub fn triangles(&self) -> u64 {
        let of = |part: &Part| {
            part.meshes
                .iter()
                .map(|mesh| mesh.indices.len() as u64 / 3)
                .sum::<u64>()
        };
        self.instances()
            .iter()
            .map(|instance| of(&self.parts[instance.part]))
            .sum()
    }

    /// What the geometry would take in the measure of Schmalstieg (1997, §8.6) and Marvie and Bouatouch (2004, §7.2): 12
    /// bytes for each vertex and 6 for each triangle, of every instance.
    #[must_use]
    pub fn explicit_bytes(&self) -> u64 {
        let of = |mesh: &Mesh| 12 * mesh.positions.len() as u64 + 2 * mesh.indices.len() as u64;
        let of = |part: &Part| part.meshes.iter().map(of).sum::<u64>();
        self.instances()
            .iter()
            .map(|instance| of(&self.parts[instance.part]))
            .sum()
    }
}
