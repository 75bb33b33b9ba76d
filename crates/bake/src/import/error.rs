//! Why was a source refused? Refusals are fatal; what can be mended is counted in [`Defects`](crate::defect::Defects).

use belvedere_scene::procedural::DcgError;

use super::json::NoJson;

/// A source that cannot be imported.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// Not a format that is read here.
    #[error(
        "this is {found}; give a glTF 2.0 file (.glb, or .gltf with its files), a .zip that holds one, a floor plan (.plan) or rules (.dcg); \
         other formats can be converted, with Blender for example"
    )]
    UnknownFormat {
        /// What it looks like.
        found: String,
    },
    /// A binary glTF container whose document cannot be reached.
    #[error("broken GLB container: {0}")]
    Glb(String),
    /// A zip archive that cannot or must not be read.
    #[error("zip archive: {0}")]
    Zip(String),
    /// The document is no JSON.
    #[error("the glTF document is not valid JSON: {0}")]
    Json(#[from] NoJson),
    /// The document is JSON, but no glTF.
    #[error("the JSON document is not glTF: {0}")]
    NotGltf(&'static str),
    /// Another version of glTF.
    #[error("/asset: glTF version {found}; only version 2.0 is read: convert it")]
    Version {
        /// What the document says.
        found: String,
    },
    /// The file cannot be shown without an extension that is not known here.
    #[error("/extensionsRequired: the file requires {name}, which is not supported: export it without")]
    RequiredExtension {
        /// The extension.
        name: String,
    },
    /// A reference that would read outside of the source's folder.
    #[error(
        "{place}: the URI \"{uri}\" leaves the folder of the source: put the file beside it; to upload both, pack them into one .zip"
    )]
    UriLeavesFolder {
        /// Where it stands.
        place: String,
        /// The URI as written.
        uri: String,
    },
    /// The file claims more memory than it may have.
    #[error(
        "{place}: needs {claimed_bytes} bytes of memory together with what was read before; the limit is {limit_bytes}"
    )]
    Memory {
        /// What asked for it.
        place: String,
        /// All claims together.
        claimed_bytes: u64,
        /// [`Limits::memory_bytes`](super::Limits::memory_bytes).
        limit_bytes: u64,
    },
    /// More placed objects than allowed.
    #[error("{place}: more than {limit} objects are placed")]
    TooManyObjects {
        /// The node that went over.
        place: String,
        /// [`Limits::max_objects`](super::Limits::max_objects).
        limit: usize,
    },
    /// Nothing is left to draw because a file is not there.
    #[error(
        "{file}, and without that file nothing is left to draw; put it beside the source; to upload both, pack them into one .zip"
    )]
    MissingFile {
        /// Where it is asked for, its name, and why it cannot be read.
        file: String,
    },
    /// Nothing is left to draw.
    #[error("nothing is left to draw: {reasons}")]
    NothingToDraw {
        /// The first defects, or that there was nothing to begin with.
        reasons: String,
    },
    /// A floor plan that cannot be drawn.
    #[error("floor plan, {0}")]
    Plan(#[from] super::plan::PlanError),
    /// A floor plan is text.
    #[error("the floor plan is not UTF-8 text: byte {byte} is not")]
    PlanNotText {
        /// The first byte that is none.
        byte: usize,
    },
    /// Rules that are wrong.
    #[error("{0}")]
    Rules(#[from] Box<DcgError>),
    /// A seed or parameters for something that does not grow.
    #[error("a seed and parameters are for rules (.dcg), and {file} is none: leave them out")]
    NoRules {
        /// The file.
        file: String,
    },
    /// The caller wanted to stop.
    #[error("import was cancelled")]
    Cancelled,
}

/// Why a file beside the source could not be read.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// There is no such file.
    #[error("there is no such file")]
    Missing,
    /// It is larger than asked for.
    #[error("it is larger than {0} bytes")]
    TooLarge(u64),
    /// The caller does not give files.
    #[error("files beside the source are not available here")]
    Denied,
    /// Reading failed.
    #[error("{0}")]
    Io(String),
}

/// Something wrong in one place of the source, which its reader mends by leaving that place out.
#[derive(Debug, Clone)]
pub(super) struct Flaw {
    /// A kind for [`Defects::note`](crate::defect::Defects::note).
    pub(super) kind: &'static str,
    /// A JSON pointer, and a few facts.
    pub(super) place: String,
}

/// Why a part of the source was not read: mend and go on, or stop.
#[derive(Debug)]
pub(super) enum Trouble {
    /// Leave it out.
    Flaw(Flaw),
    /// Stop.
    Fatal(ImportError),
}

impl From<ImportError> for Trouble {
    fn from(error: ImportError) -> Self {
        Self::Fatal(error)
    }
}

impl From<Flaw> for Trouble {
    fn from(flaw: Flaw) -> Self {
        Self::Flaw(flaw)
    }
}

impl Trouble {
    /// The same of what a member names: whoever mends it looks for the member.
    pub(super) fn named_by(self, member: String) -> Self {
        match self {
            Self::Flaw(Flaw { kind, place }) => Self::Flaw(Flaw {
                kind,
                place: format!("{member}, which names {place}"),
            }),
            fatal @ Self::Fatal(_) => fatal,
        }
    }
}

/// What reading one part of the source gives.
pub(super) type Read<T> = Result<T, Trouble>;

/// A flaw as the error of a [`Read`].
pub(super) fn flaw<T>(kind: &'static str, place: impl Into<String>) -> Read<T> {
    Err(Trouble::Flaw(Flaw {
        kind,
        place: place.into(),
    }))
}
