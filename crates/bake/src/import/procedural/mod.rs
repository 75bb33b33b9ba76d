//! What world do rules describe? A `.dcg` file, or one that a glTF node names, becomes objects like any others.
//!
//! `docs/PROCEDURAL.md` is the language, [`belvedere_scene::procedural`] grows it. Each part that has triangles becomes a
//! model, each place where it stands an object. Names mean here what they mean in glTF: `door:`, `cell:`, `portal:`,
//! `occluder:`. A glTF file that rules place is imported once and placed as often as they say.

mod absorb;
mod alone;
mod details;
mod growth;
mod marks;
mod node;
mod poses;
mod scene;
#[cfg(test)]
mod tests;
mod texts;

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::sync::Arc;

use belvedere_scene::Bounds;
use belvedere_scene::procedural::limits::{MAX_TEXT_BYTES, reached};
use belvedere_scene::procedural::{
    DcgError, Limits as GrowthLimits, Loader, Program, Settings, Usage, Value, Watch, bounds_watched, cut,
    grow_watched, nearest,
};

use super::container::has_ending;
use super::limits::Budget;
use super::uri::{Astray, relative_path};
use super::{Asker, FileError, ImportError, Imported, Limits, SourceFiles, is_gltf, is_rules, large};
use crate::defect::Defects;
use crate::progress::{Progress, Stage, Within};
pub use growth::Growth;
pub(super) use node::{Nursery, Planting, Wish, steps_of};
pub(super) use scene::number_viewpoints;
use texts::texts_of;

/// What rules are given besides their text.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sowing {
    /// Where random numbers come from.
    pub seed: u32,
    /// Values for parameters of the file.
    pub parameters: BTreeMap<String, Value>,
}

/// Where the rules' other files are, and what may be taken.
#[derive(Clone, Copy)]
pub struct Ground<'a> {
    /// Gives files beside the source.
    pub files: &'a dyn SourceFiles,
    /// What the whole source may take.
    pub limits: &'a Limits,
    /// Who looks on.
    pub progress: &'a dyn Progress,
}

/// Grows a file of rules. `path` is below the source's folder; what it imports is looked for beside it.
///
/// # Errors
/// When the text is none, is wrong, or needs a file that is not there.
pub fn plant(path: &str, bytes: Vec<u8>, settings: &Settings, ground: Ground) -> Result<Growth, ImportError> {
    let budget = Budget::new(ground.limits);
    let mut growth = watched(path, bytes, (settings, false), (ground, &budget))?;
    large::drop_wishes(&mut growth.scene, &mut growth.defects);
    Ok(growth)
}

/// Finds a box that holds what a file of rules would grow, and what that takes, without growing it. Parts that say `within` are
/// taken by their word.
///
/// # Errors
/// As [`plant`], but for what is inside of such parts.
pub fn measure(
    path: &str,
    bytes: Vec<u8>,
    settings: &Settings,
    ground: Ground,
) -> Result<(Bounds, Usage), ImportError> {
    let budget = Budget::new(ground.limits);
    let program = program(path, bytes, ground)?;
    let placed = Placed::of(path, &program, (ground, &budget));
    let most = settings.limits.steps;
    ground.progress.start(Stage::Import, most);
    let measured = telling(ground.progress, most, |tell| {
        bounds_watched(&program, settings, &|path| placed.bounds(path), tell)
    })?;
    // The box of what could not be read is missing.
    for (imported, _) in placed.known.into_inner().into_values() {
        imported?;
    }
    Ok(measured)
}

/// The same, with what the author made coarser where that is wanted, within a budget. All of a source: its steps, of as many as
/// it may take, are those of the import.
fn watched(
    path: &str,
    bytes: Vec<u8>,
    wanted: (&Settings, bool),
    (ground, budget): (Ground, &Budget),
) -> Result<Growth, ImportError> {
    let most = wanted.0.limits.steps;
    ground.progress.start(Stage::Import, most);
    telling(ground.progress, most, |tell| {
        planted(path, bytes, wanted, (ground, budget), tell)
    })
}

/// What grows while progress is told of its steps. In the end it has made `most`, as many as it may, however few it took.
fn telling<T>(progress: &dyn Progress, most: u64, grow: impl FnOnce(Watch) -> T) -> T {
    let advanced = Cell::new(0);
    let tell = |steps: u64| progress.advance(steps - advanced.replace(steps));
    let grown = grow(&tell);
    tell(most);
    grown
}

/// The same of rules that may be a piece of a source, within a budget that all of it shares.
fn planted(
    path: &str,
    bytes: Vec<u8>,
    (settings, with_levels): (&Settings, bool),
    (ground, budget): (Ground, &Budget),
    watch: Watch,
) -> Result<Growth, ImportError> {
    let program = program(path, bytes, ground)?;
    let placed = Placed::of(path, &program, (ground, budget));
    let mut grown = grow_watched(&program, settings, &|path| placed.bounds(path), watch)?;
    let mut defects = Defects::default();
    let recipes: Vec<_> = grown.parts.iter().map(|part| part.recipe.clone()).collect();
    let texts = texts_of(&program, &mut grown, &mut defects);
    let rules = (Arc::new(texts), settings.seed);
    let mut of_models = Defects::default();
    let mut model_bytes = BTreeMap::new();
    let growing = scene::Growing {
        program: &program,
        folder: folder_of(path),
        recipes: &recipes,
        rules: &rules,
        settings,
        with_levels,
        progress: ground.progress,
        watch,
        defects: &mut defects,
    };
    let scene = scene::scene_of(&grown, growing, (ground.limits, budget), &mut |model| {
        let imported = placed.take(model)?;
        of_models.absorb(imported.defects);
        model_bytes.insert(model.to_owned(), imported.scene.explicit_bytes());
        Ok(imported.scene)
    })?;
    defects.absorb(of_models);
    let models = grown.instances().into_iter();
    let models = models.flat_map(|instance| &grown.parts[instance.part].models);
    let explicit_bytes = grown.explicit_bytes() + models.map(|(path, _)| model_bytes[path]).sum::<u64>();
    Ok(Growth {
        program,
        grown,
        scene,
        explicit_bytes,
        defects,
    })
}

/// A file that was read, and the box around it.
type PlacedFile = (Result<Imported, ImportError>, Option<Bounds>);

/// glTF files that rules place, each read once, when its box is asked for first.
struct Placed<'a> {
    beside: Beside<'a>,
    program: &'a Program,
    on: (Ground<'a>, &'a Budget),
    known: RefCell<BTreeMap<String, PlacedFile>>,
}

impl<'a> Placed<'a> {
    fn of(path: &'a str, program: &'a Program, on: (Ground<'a>, &'a Budget)) -> Self {
        Self {
            beside: Beside::of(path, on.0),
            program,
            on,
            known: RefCell::default(),
        }
    }

    /// The box around one, if it could be read.
    fn bounds(&self, path: &str) -> Option<Bounds> {
        let mut known = self.known.borrow_mut();
        if !known.contains_key(path) {
            let imported = self.beside.import(path, self.program, self.on);
            let bounds = imported.as_ref().ok().map(|imported| imported.scene.bounds());
            known.insert(path.to_owned(), (imported, bounds));
        }
        known[path].1
    }

    /// What one holds.
    fn take(&self, path: &str) -> Result<Imported, ImportError> {
        match self.known.borrow_mut().remove(path) {
            Some((imported, _)) => imported,
            None => self.beside.import(path, self.program, self.on),
        }
    }
}

/// Reads rules and what they import.
fn program(path: &str, bytes: Vec<u8>, ground: Ground) -> Result<Program, ImportError> {
    let file = path.rsplit_once('/').map_or(path, |(_, file)| file);
    let text = DcgError::text_of(file, bytes)?;
    Ok(Program::read(file, text, &Beside::of(path, ground))?)
}

/// Reads a `.dcg` source.
pub(super) fn read(
    file_name: &str,
    bytes: Vec<u8>,
    sowing: &Sowing,
    (ground, budget): (Ground, &Budget),
) -> Result<Imported, ImportError> {
    let settings = Settings {
        seed: sowing.seed,
        limits: growth_limits(ground.limits),
        ..Settings::default()
    };
    let text = given(file_name, bytes.clone(), (sowing, &settings), ground)?;
    let grown = watched(file_name, text, (&settings, true), (ground, budget));
    let growth = grown.map_err(|error| as_written((file_name, bytes), error, (sowing, &settings), ground))?;
    if growth.scene.objects.is_empty() {
        return Err(ImportError::NothingToDraw {
            reasons: growth.nothing_drawn().to_owned(),
        });
    }
    Ok(Imported {
        scene: growth.scene,
        defects: growth.defects,
    })
}

/// Rules that have the parameters they are given as their own, so that what is published of them grows the same by itself.
fn given(
    path: &str,
    bytes: Vec<u8>,
    (sowing, settings): (&Sowing, &Settings),
    ground: Ground,
) -> Result<Vec<u8>, ImportError> {
    if sowing.parameters.is_empty() {
        return Ok(bytes);
    }
    let program = program(path, bytes.clone(), ground)?;
    program.refuse_given(&Settings {
        parameters: sowing.parameters.clone(),
        ..settings.clone()
    })?;
    let mut files = program.files();
    let text = files
        .next()
        .and_then(|(file, _)| program.text_given(file, &sowing.parameters));
    Ok(text.map_or(bytes, String::into_bytes))
}

/// A mistake of rules that were given parameters, told of the text as its author wrote it, and of what it was given, as all are told
/// who grow it.
fn as_written(
    (path, bytes): (&str, Vec<u8>),
    error: ImportError,
    (sowing, settings): (&Sowing, &Settings),
    ground: Ground,
) -> ImportError {
    if sowing.parameters.is_empty() || !matches!(error, ImportError::Rules(_)) {
        return error;
    }
    let settings = Settings {
        parameters: sowing.parameters.clone(),
        ..settings.clone()
    };
    let budget = Budget::new(ground.limits);
    let again = watched(path, bytes, (&settings, false), (ground, &budget));
    again.err().unwrap_or(error)
}

/// What rules may take of what a source may.
fn growth_limits(limits: &Limits) -> GrowthLimits {
    /// About what a triangle with its vertices takes from the evaluation to the scene.
    const TRIANGLE_BYTES: u64 = 200;
    let usual = GrowthLimits::default();
    GrowthLimits {
        triangles: usual.triangles.min(limits.memory_bytes / TRIANGLE_BYTES),
        placements: usual.placements.min(limits.max_objects as u64),
        ..usual
    }
}

/// Where a file lies.
fn folder_of(path: &str) -> &str {
    path.rsplit_once('/').map_or("", |(folder, _)| folder)
}

/// Files in the folder of the rules.
struct Beside<'a> {
    folder: &'a str,
    files: &'a dyn SourceFiles,
}

impl<'a> Beside<'a> {
    fn of(path: &'a str, ground: Ground<'a>) -> Self {
        Self {
            folder: folder_of(path),
            files: ground.files,
        }
    }

    fn path(&self, relative: &str) -> Result<String, Astray> {
        let path = relative_path(relative)?;
        Ok(if self.folder.is_empty() {
            path
        } else {
            format!("{}/{path}", self.folder)
        })
    }

    /// Why a file that rules name as `relative` was not read, and which they may have meant; names of such end like that.
    fn told(&self, relative: &str, (path, endings): (&str, &[&str]), cause: &FileError) -> String {
        match cause {
            FileError::Missing => {}
            // As a text that is too long says it itself.
            FileError::TooLarge(limit) if endings.contains(&"dcg") => {
                return reached("bytes of text", *limit).to_string();
            }
            _ => return cause.to_string(),
        }
        let (folder, name) = path.rsplit_once('/').unwrap_or(("", path));
        let names = self.files.names(folder);
        let mut whole = endings.iter().map(|ending| format!("{name}.{ending}"));
        let whole = whole.find(|whole| names.contains(whole));
        if let Some(meant) = whole.or_else(|| nearest(name, names.iter().map(String::as_str))) {
            let written = relative.rsplit_once('/').map_or("", |(folder, _)| folder);
            let slash = if written.is_empty() { "" } else { "/" };
            return format!("{cause}; did you mean \"{}{slash}{meant}\"?", cut(written));
        }
        match folder {
            "" => format!("{cause} in the source's folder"),
            _ => format!("{cause} in \"{}\", below the source's folder", cut(folder)),
        }
    }

    /// A glTF file that rules place. Rules in it are not grown.
    fn import(
        &self,
        relative: &str,
        program: &Program,
        (ground, budget): (Ground, &Budget),
    ) -> Result<Imported, ImportError> {
        let missing = |reason: String| ImportError::Rules(program.model_error(relative, reason));
        let path = self.path(relative).map_err(|astray| missing(astray.to_string()))?;
        if is_rules(&path) || has_ending(&path, "plan") {
            return Err(missing("`model` places glTF files; use `import` for rules".to_owned()));
        }
        let bytes = self
            .files
            .read(&path, ground.limits.memory_bytes)
            .map_err(|cause| missing(self.told(relative, (&path, &["glb", "gltf"]), &cause)))?;
        let files = Below {
            folder: folder_of(&path),
            files: self.files,
        };
        let ground = Ground {
            files: &files,
            progress: &Within(ground.progress),
            ..ground
        };
        super::import_on((ground, budget.clone()), &path, bytes, Asker::Placed).map_err(|cause| match cause {
            ImportError::UnknownFormat { found } => missing(format!(
                "this is {found}, and `model` places glTF 2.0 (.glb, .gltf with its files, or a .zip that holds one); other formats can be \
                 converted, with Blender for example"
            )),
            ImportError::NothingToDraw { .. }
            | ImportError::Glb(_)
            | ImportError::Json(_)
            | ImportError::NotGltf(_)
            | ImportError::Version { .. }
            | ImportError::RequiredExtension { .. } => missing(cause.to_string()),
            _ => cause,
        })
    }
}

fn names_gltf(path: &str) -> bool {
    has_ending(path, "glb") || has_ending(path, "gltf")
}

impl Loader for Beside<'_> {
    fn load(&self, relative: &str) -> Result<String, String> {
        let path = self.path(relative).map_err(|astray| astray.to_string())?;
        if names_gltf(relative) {
            return Err("`import` reads rules; place a glTF file with `model`".to_owned());
        }
        let bytes = self
            .files
            .read(&path, MAX_TEXT_BYTES as u64)
            .map_err(|cause| self.told(relative, (&path, &["dcg"]), &cause))?;
        DcgError::text_of(&path, bytes).map_err(|error| {
            let DcgError {
                line, column, problem, ..
            } = *error;
            format!("line {line}, column {column}: {problem}")
        })
    }
}

/// The files of a folder below the source's.
struct Below<'a> {
    folder: &'a str,
    files: &'a dyn SourceFiles,
}

impl SourceFiles for Below<'_> {
    fn read(&self, relative: &str, max_bytes: u64) -> Result<Vec<u8>, FileError> {
        if self.folder.is_empty() {
            return self.files.read(relative, max_bytes);
        }
        self.files.read(&format!("{}/{relative}", self.folder), max_bytes)
    }

    fn names(&self, relative: &str) -> Vec<String> {
        let parts = [self.folder, relative].map(|part| (!part.is_empty()).then_some(part));
        let parts: Vec<&str> = parts.into_iter().flatten().collect();
        self.files.names(&parts.join("/"))
    }
}
