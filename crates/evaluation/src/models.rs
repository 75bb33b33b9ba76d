//! Which meshes are measured? Things that grow out of the rules in `content/`, chosen for what the papers' models are called.

use std::{
    fs,
    io::Write,
    path::{Path, PathBuf},
};

use anyhow::Context;
use belvedere_bake::{
    glb::{self, GlbInput, lattice::Lattice},
    import::{
        FileError, Limits, SourceFiles,
        procedural::{Ground, Growth, plant},
    },
    lod::{self, LodLevel},
    progress::Silent,
    smooth::{self, quantise::QuantisedMesh},
    source::{Material, SourceModel},
};
use belvedere_scene::procedural::Settings;
use flate2::{Compression, write::GzEncoder};

/// The folder of the rules.
#[must_use]
pub fn content() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../content")
}

struct Content;

impl SourceFiles for Content {
    fn read(&self, relative: &str, _: u64) -> Result<Vec<u8>, FileError> {
        fs::read(content().join(relative)).map_err(|_| FileError::Denied)
    }
}

/// Grows a file of `content/`.
///
/// # Errors
/// When it is not there or wrong.
pub fn grow_file(file: &str) -> anyhow::Result<Growth> {
    let text = fs::read_to_string(content().join(file)).with_context(|| format!("cannot read {file}"))?;
    grow(file, text)
}

fn grow(name: &str, text: String) -> anyhow::Result<Growth> {
    let ground = Ground {
        files: &Content,
        limits: &Limits::default(),
        progress: &Silent,
    };
    plant(name, text.into_bytes(), &Settings::default(), ground).with_context(|| format!("cannot grow {name}"))
}

/// A mesh, and how it is called.
#[derive(Debug)]
pub struct Mesh {
    /// Its name.
    pub name: String,
    /// Its largest part: what most triangles belong to.
    pub model: SourceModel,
    /// Materials of its scene.
    pub materials: Vec<Material>,
}

impl Mesh {
    /// Grows what a line of rules says, with the files of `content/` at hand.
    ///
    /// # Errors
    /// When the rules are wrong or grow nothing.
    pub fn of_rules(name: &str, rules: &str) -> anyhow::Result<Self> {
        Self::largest(name, grow("evaluated.dcg", rules.to_owned())?)
    }

    /// Its smooth LOD, from these corners.
    ///
    /// # Errors
    /// When so many triangles meet at one vertex that it has none.
    pub fn stream(&self, quantised: &QuantisedMesh) -> anyhow::Result<Vec<u8>> {
        smooth::encode(quantised).with_context(|| format!("{} has no smooth LOD", self.name))
    }

    fn largest(name: &str, growth: Growth) -> anyhow::Result<Self> {
        let scene = growth.scene;
        let model = scene.models.into_iter().max_by_key(SourceModel::triangle_count);
        Ok(Self {
            name: name.to_owned(),
            model: model
                .filter(|model| model.triangle_count() > 0)
                .with_context(|| format!("{name} has no triangles"))?,
            materials: scene.materials,
        })
    }
}

/// Bytes that a line carries for a level: its GLB as the bake writes it, compressed where that is less.
#[must_use]
pub fn carried_bytes(mesh: &Mesh, level: &LodLevel) -> u64 {
    let lattice = Lattice::alone(&mesh.model.primitives).of_error(level.geometric_error);
    let input = GlbInput {
        primitives: &lod::rounded(level, lattice).primitives,
        materials: &mesh.materials,
        textures: &[],
        image_uri: &|_| String::new(),
    };
    let plain = glb::write(&input, lattice).bytes;
    let mut packed = GzEncoder::new(Vec::new(), Compression::best());
    // Memory takes whatever it is given.
    let packed = packed.write_all(&plain).and_then(|()| packed.finish());
    packed.map_or(plain.len(), |packed| packed.len().min(plain.len())) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_become_a_mesh() {
        let mesh = Mesh::of_rules("posts", "for i in 3 move(2 * i, 0, 0) box(1, 1, 1)").unwrap();
        assert_eq!(mesh.model.triangle_count(), 36);
        assert!(Mesh::of_rules("nothing", "let a = 1").is_err());
    }
}
