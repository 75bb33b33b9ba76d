//! How does a model grow out of rules that came as text? As `docs/FORMAT.md` says it: part 1 of a text that places the one part
//! with its parameters, with the seed, at the finest level of detail.

use belvedere_scene::{
    object::Procedural,
    procedural::{DcgError, Grown, Loader, Program, Settings, grow},
};
use bytes::Bytes;

/// What the rules are called in the text that places the part.
const RULES: &str = "rules";

/// Rules, and what to make of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Seedling {
    /// Texts by the names that are given to them, the rules first.
    texts: Vec<(String, Bytes)>,
    procedural: Procedural,
}

impl Seedling {
    /// From the rules and what they import, in the order in which a grade names them.
    pub(super) fn new(procedural: &Procedural, pieces: &[Bytes]) -> Option<Self> {
        let names = std::iter::once(RULES.to_owned()).chain(procedural.imports.keys().cloned());
        let texts: Vec<_> = names.zip(pieces.iter().cloned()).collect();
        (texts.len() == procedural.imports.len() + 1).then(|| Self {
            texts,
            procedural: procedural.clone(),
        })
    }

    /// Grows the model: part 1 of the result, whose other parts are nobody's business.
    ///
    /// # Errors
    /// When the rules are wrong; [`crate::Explorer::without_rules`] has levels come instead.
    pub fn grow(&self) -> Result<Grown, Box<DcgError>> {
        let parameters = self.procedural.parameters.iter();
        let parameters: Vec<_> = parameters.map(|(name, value)| format!("{name} = {value}")).collect();
        let part = self
            .procedural
            .part
            .as_ref()
            .map_or(String::new(), |part| format!(".{part}"));
        let text = format!("import \"{RULES}\" as rules rules{part}({})", parameters.join(", "));
        let program = Program::read("model", text, self)?;
        let settings = Settings {
            seed: self.procedural.seed,
            ..Settings::default()
        };
        grow(&program, &settings)
    }
}

impl Loader for Seedling {
    fn load(&self, path: &str) -> Result<String, String> {
        let found = self.texts.iter().find(|(name, _)| name == path);
        let (_, bytes) = found.ok_or_else(|| "it was not published with the rules".to_owned())?;
        String::from_utf8(bytes.to_vec()).map_err(|cause| cause.to_string())
    }
}
