//! What does the source file hold?
//!
//! glTF 2.0 (`.glb`, `.gltf` with its files, `.zip` of one), a floor plan ([`plan`]) or rules ([`procedural`]) become a
//! [`SourceScene`] and a count of [`Defects`]. The file may be anything: what can be mended or left out is, and is counted with its first place; what would change the
//! scene beyond recognition, leave the source's folder or go over the limits is refused with an [`ImportError`].
//!
//! A tour, in the order in which data flows: `container` and `archive` find the document and its bytes; `json` parses it, `document`
//! reads members of it without trust; `reader` resolves buffers and views, `compression` decodes them; `accessors`
//! reads numbers; `nodes` and `instances` place objects, `mark` says what for; `primitives`, `topology` and `attributes` check geometry;
//! `skin` poses it, for pictures of what moves as `animation` and `poses` say; `materials` collects what is used; `impostor` reads what asks for pictures, `extras` finds wishes that nobody reads. [`split`] then cuts sprawling meshes into objects.
//!
//! Guarantees: geometry is finite, indices are in range, no triangle is without area, every model, material, texture
//! and picture is used. Objects may be **mirrored**: triangles stay as in the source, so whoever needs the front of a
//! face in the world looks at the sign of the determinant of `world_from_object`. Same bytes, same result. Cost is
//! linear in the decoded data, which [`Limits`] bounds.

mod accessors;
mod animation;
mod archive;
mod assemble;
mod attributes;
mod compression;
mod container;
mod document;
mod error;
mod extent;
mod extras;
mod finish;
pub(crate) mod impostor;
mod instances;
mod json;
mod large;
mod limits;
mod local;
mod lookalike;
mod mark;
mod materials;
mod nodes;
pub mod plan;
mod poses;
mod primitives;
pub mod procedural;
mod reader;
mod skin;
pub mod split;
mod subset;
mod topology;
mod uri;
mod uv_sets;

#[cfg(test)]
mod damage_tests;
#[cfg(test)]
mod hostile_tests;
#[cfg(test)]
mod scenes_tests;
#[cfg(test)]
mod testing;

pub use error::{FileError, ImportError};
pub use json::NoJson;
pub use limits::Limits;

use std::collections::BTreeMap;

use serde::de::IgnoredAny;
use serde_json::Value;

use crate::defect::Defects;
use crate::progress::{Progress, Stage};
use crate::source::SourceScene;
use archive::Archive;
use container::{Format, detect, glb_chunks, has_ending, without_byte_order_mark};
use document::{Item, parsed_bytes};
use limits::Budget;
use procedural::{Ground, Sowing};
use reader::{Bytes, Reader};

/// A source that was read.
#[derive(Debug)]
pub struct Imported {
    /// What it holds.
    pub scene: SourceScene,
    /// What was wrong with it.
    pub defects: Defects,
}

/// Reads files beside the source. The caller roots it in a folder.
pub trait SourceFiles {
    /// Reads a whole file of at most `max_bytes`. `relative` is a path below the folder, with `/` between its parts and
    /// without `.`, `..`, `\` and `:`.
    ///
    /// # Errors
    /// When there is no such file, or it is too large, or cannot be read.
    fn read(&self, relative: &str, max_bytes: u64) -> Result<Vec<u8>, FileError>;

    /// Names of files in a folder below it, as `relative` says it (empty: that folder itself), for who looks for one that is
    /// not there; none where they may not be listed.
    fn names(&self, relative: &str) -> Vec<String> {
        let _ = relative;
        Vec::new()
    }
}

/// No files beside the source: whatever it needs must be inside of it.
#[derive(Debug, Clone, Copy)]
pub struct NoFiles;

impl SourceFiles for NoFiles {
    fn read(&self, _: &str, _: u64) -> Result<Vec<u8>, FileError> {
        Err(FileError::Denied)
    }
}

/// Extensions that a file may require: handled here, kept in materials, or without meaning for what is drawn.
const SUPPORTED: [&str; 19] = [
    "EXT_instance_features",
    "EXT_lights_image_based",
    "EXT_mesh_features",
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_structural_metadata",
    "EXT_texture_avif",
    "EXT_texture_webp",
    "KHR_animation_pointer",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "KHR_xmp_json_ld",
];
/// Families of extensions that are kept in materials, or have no meaning for what is drawn.
const SUPPORTED_PREFIXES: [&str; 2] = ["KHR_materials_", "OMI_physics_"];

/// Reads a source file: what `bytes` are is found out by their content; `file_name` is for messages.
///
/// # Errors
/// When the file is of another format or version, requires what is not supported, names files outside of its folder,
/// goes over the limits, leaves nothing to draw, or when `progress` is cancelled.
pub fn import(
    file_name: &str,
    bytes: Vec<u8>,
    files: &dyn SourceFiles,
    limits: &Limits,
    progress: &dyn Progress,
) -> Result<Imported, ImportError> {
    let ground = Ground {
        files,
        limits,
        progress,
    };
    import_sown(file_name, bytes, &Sowing::default(), ground)
}

/// The same, with a seed and parameters for rules.
///
/// # Errors
/// As [`import`], and when the file is no rules but something is given for them.
pub fn import_sown(file_name: &str, bytes: Vec<u8>, sowing: &Sowing, ground: Ground) -> Result<Imported, ImportError> {
    if *sowing != Sowing::default() && !is_rules(file_name) {
        return Err(ImportError::NoRules {
            file: file_name.to_owned(),
        });
    }
    let budget = Budget::new(ground.limits);
    import_on((ground, budget), file_name, bytes, Asker::Source(sowing))
}

/// Whether a file is taken for rules: by its name, since any text may be some.
#[must_use]
pub fn is_rules(file_name: &str) -> bool {
    has_ending(file_name, "dcg")
}

/// Whether a file is glTF, or an archive, which may hold it. Rules may begin with a brace, too: only a whole document with
/// an `asset` is glTF's.
#[must_use]
pub fn is_gltf(bytes: &[u8]) -> bool {
    match detect("", bytes) {
        Format::Glb | Format::Zip => true,
        Format::Json => {
            let members = serde_json::from_slice::<BTreeMap<String, IgnoredAny>>(without_byte_order_mark(bytes));
            members.is_ok_and(|members| members.contains_key("asset"))
        }
        Format::Other(_) => false,
    }
}

/// Who asks for a file.
#[derive(Clone, Copy)]
enum Asker<'a> {
    /// Whoever bakes it; rules get this.
    Source(&'a Sowing),
    /// Rules that place it. Its nodes may grow no rules, or the two could place each other for ever.
    Placed,
}

fn import_on(on: (Ground, Budget), file_name: &str, bytes: Vec<u8>, asker: Asker) -> Result<Imported, ImportError> {
    let mut imported = read(on, file_name, bytes, asker)?;
    large::drop_wishes(&mut imported.scene, &mut imported.defects);
    Ok(imported)
}

/// Reads what a file holds.
fn read(
    (ground, budget): (Ground, Budget),
    file_name: &str,
    bytes: Vec<u8>,
    asker: Asker,
) -> Result<Imported, ImportError> {
    budget.claim(bytes.len(), 1, || file_name.to_owned())?;
    if has_ending(file_name, "plan") {
        return read_plan(&bytes, ground.progress);
    }
    let nodes_grow = match asker {
        Asker::Source(sowing) if is_rules(file_name) => {
            return procedural::read(file_name, bytes, sowing, (ground, &budget));
        }
        Asker::Source(_) => true,
        Asker::Placed => false,
    };
    if detect(file_name, &bytes) != Format::Zip {
        return Document::open(file_name, bytes, &budget)?.read(ground, budget, nodes_grow);
    }
    let archive = Archive::open(bytes)?;
    let main = archive.read_main(budget.left_bytes())?;
    budget.claim(main.len(), 1, || archive.main_path().to_owned())?;
    let inside = Ground {
        files: &archive,
        ..ground
    };
    let document = Document::open(archive.main_path(), main, &budget).map_err(|error| match error {
        ImportError::Glb(_) => ImportError::Zip(format!("entry \"{}\": {error}", archive.main_path())),
        other => other,
    })?;
    document.read(inside, budget, nodes_grow)
}

/// Reads a floor plan, see [`plan`].
fn read_plan(bytes: &[u8], progress: &dyn Progress) -> Result<Imported, ImportError> {
    progress.start(Stage::Import, 1);
    let text = std::str::from_utf8(bytes).map_err(|e| ImportError::PlanNotText { byte: e.valid_up_to() })?;
    let scene = plan::parse(text)?.to_scene();
    progress.advance(1);
    Ok(Imported {
        scene,
        defects: Defects::default(),
    })
}

/// A parsed document and the binary chunk beside it.
struct Document {
    json: Value,
    bin: Option<Bytes>,
}

impl Document {
    fn open(file_name: &str, bytes: Vec<u8>, budget: &Budget) -> Result<Self, ImportError> {
        let parse = |text: &[u8]| -> Result<Value, ImportError> {
            let text = without_byte_order_mark(text);
            budget.claim(parsed_bytes(text), 1, || "the glTF document".into())?;
            Ok(json::parsed(text)?)
        };
        match detect(file_name, &bytes) {
            Format::Json => Ok(Self {
                json: parse(&bytes)?,
                bin: None,
            }),
            Format::Glb => {
                let chunks = glb_chunks(&bytes)?;
                let json = parse(&bytes[chunks.json])?;
                Ok(Self {
                    json,
                    bin: chunks.bin.map(|range| Bytes::new(bytes).slice(range)),
                })
            }
            Format::Zip => Err(ImportError::Zip(format!("\"{file_name}\" in it is an archive again"))),
            Format::Other(found) => Err(ImportError::UnknownFormat { found }),
        }
    }

    fn read(self, ground: Ground, budget: Budget, nodes_grow: bool) -> Result<Imported, ImportError> {
        check_version(&self.json)?;
        check_required(&self.json)?;
        let mut reader = Reader::new(&self.json, self.bin, ground.files, budget);
        let scene = assemble::assemble(&mut reader, ground, nodes_grow)?;
        Ok(Imported {
            scene,
            defects: reader.defects,
        })
    }
}

fn check_version(json: &Value) -> Result<(), ImportError> {
    let asset = json.get("asset").ok_or(ImportError::NotGltf(
        "it has no \"asset\": give a glTF 2.0 file (.glb, .gltf) or a .zip that holds one",
    ))?;
    let text = |key: &str| {
        asset
            .get(key)
            .map(|v| v.as_str().map_or_else(|| v.to_string(), str::to_owned))
    };
    let found = text("version").unwrap_or_else(|| "unknown (no \"version\")".into());
    if found.split('.').next() != Some("2") {
        return Err(ImportError::Version { found });
    }
    match text("minVersion") {
        Some(found) if found != "2.0" => Err(ImportError::Version { found }),
        _ => Ok(()),
    }
}

fn check_required(json: &Value) -> Result<(), ImportError> {
    let required = Item::root(json).elements("extensionsRequired").unwrap_or_default();
    for name in required.iter().filter_map(|e| e.value.as_str()) {
        if !SUPPORTED.contains(&name) && !SUPPORTED_PREFIXES.iter().any(|prefix| name.starts_with(prefix)) {
            return Err(ImportError::RequiredExtension { name: name.to_owned() });
        }
    }
    Ok(())
}
