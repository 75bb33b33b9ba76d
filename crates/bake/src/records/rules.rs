//! From which rules can a client grow a model itself? Writes the texts, each once, and says what to make of them.

use std::collections::{BTreeMap, BTreeSet};

use belvedere_scene::{
    BlobName,
    object::{Import, Procedural},
    procedural::tidied,
};

use super::sink::{Ledger, SinkError};
use crate::source::{SourceModel, SourceRecipe};

/// The extension of rules.
pub(super) const DCG: &str = "dcg";

/// What a client that knows the language needs, when the model has grown from rules and can be grown alone.
pub(super) fn write(model: &SourceModel, ledger: &Ledger<'_>) -> Result<Option<Procedural>, SinkError> {
    let Some(SourceRecipe { texts, recipe, seed }) = &model.recipe else {
        return Ok(None);
    };
    let put = |name: &str| -> Result<(BlobName, u64), SinkError> {
        let text = texts.get(name).map(String::as_str).unwrap_or_default();
        ledger.put(DCG, text.as_bytes().to_vec())
    };
    let (rules, rules_bytes) = put(&recipe.file)?;
    let mut imports = BTreeMap::new();
    for name in imported(texts, &recipe.file) {
        let (url, bytes) = put(name)?;
        imports.insert(name.to_owned(), Import { url, bytes });
    }
    let parameters = recipe
        .parameters
        .iter()
        .map(|(name, value)| (name.clone(), value.to_json()));
    Ok(Some(Procedural {
        rules,
        rules_bytes,
        imports,
        part: recipe.part.clone(),
        parameters: parameters.collect(),
        seed: *seed,
    }))
}

/// The files that a file imports, and those that they import. A text that holds a name in quotes, however it is written, counts as
/// importing it.
fn imported<'t>(texts: &'t BTreeMap<String, String>, file: &str) -> BTreeSet<&'t str> {
    let mut found = BTreeSet::new();
    let mut open = vec![file];
    while let Some(text) = open.pop().and_then(|file| texts.get(file)) {
        let quoted = text.split('"').filter(|quoted| !quoted.contains('\n'));
        for (name, _) in quoted.filter_map(|quoted| texts.get_key_value(&tidied(quoted))) {
            if name != file && found.insert(name.as_str()) {
                open.push(name);
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_imported_however_their_names_are_written() {
        let texts = [
            (
                "yard.dcg",
                "import \"./lib/crate.dcg\" as crate\nimport \"lib/../post.dcg\" as post\ncrate() post()",
            ),
            ("lib/crate.dcg", "import \"lib/board.dcg\" as board\nboard()"),
            ("lib/board.dcg", "box(1, 1, 1)"),
            ("post.dcg", "cylinder(1, 1)"),
            ("other.dcg", "sphere(1)"),
        ];
        let texts = texts.map(|(name, text)| (name.to_owned(), text.to_owned())).into();
        let names: Vec<_> = imported(&texts, "yard.dcg").into_iter().collect();
        assert_eq!(names, ["lib/board.dcg", "lib/crate.dcg", "post.dcg"]);
    }
}
