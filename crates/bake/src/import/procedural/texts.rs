//! Which texts do a model's parts need to be made alone? Those of its files; and where a file was given values for parameters of its
//! own, the same text that has them.

use std::collections::BTreeMap;
use std::sync::Arc;

use belvedere_scene::procedural::limits::{MAX_ALL_TEXT_BYTES, MAX_TEXT_BYTES};
use belvedere_scene::procedural::{Grown, NoImports, Problem, Program};

use crate::defect::Defects;

/// Most bytes of texts that differ by what they were given alone.
const MOST_GIVEN_BYTES: usize = 16 << 20;

const UNSAID: &str = "part of a file whose name no `import` can have: offered as meshes";
const TOO_LONG: &str =
    "part of a file that is given something and whose name leaves no room for a number: offered as meshes";
const TOO_MUCH: &str =
    "part of a file that is given so much, or in so many ways, that its rules would be too long: offered as meshes";

/// All texts by their names; recipes of parts in files that were given something are led to texts that have it. Parts whose text
/// would be too long cannot be made alone.
pub(super) fn texts_of(program: &Program, grown: &mut Grown, defects: &mut Defects) -> BTreeMap<String, String> {
    let files = || program.files().map(|(name, text)| (name.to_owned(), text.to_owned()));
    let mut texts: BTreeMap<String, String> = files().collect();
    let all_bytes: usize = texts.values().map(String::len).sum();
    let mut known: BTreeMap<(String, usize), Result<String, &'static str>> = BTreeMap::new();
    let (mut left, mut numbers) = (MOST_GIVEN_BYTES, 1_u32..);
    // All others were imported.
    let first = program.files().next().map(|(file, _)| file);
    let unsaid = first.filter(|file| !can_be_imported(file));
    for part in &mut grown.parts {
        if part.recipe.as_ref().is_some_and(|recipe| unsaid == Some(&recipe.file)) {
            defects.note(UNSAID, 1, || part.name.clone());
            part.recipe = None;
        }
        let Some(recipe) = part.recipe.as_mut().filter(|recipe| !recipe.given.is_empty()) else {
            continue;
        };
        let given = std::mem::take(&mut recipe.given);
        // Parts of one file that was given one thing share what it was given.
        let key = (recipe.file.clone(), Arc::as_ptr(&given).addr());
        let named = known.entry(key).or_insert_with(|| {
            let text = program.text_given(&recipe.file, &given.iter().cloned().collect());
            let text = text.ok_or(TOO_MUCH)?;
            let others_bytes = all_bytes - texts.get(&recipe.file).map_or(0, String::len);
            if text.len() > MAX_TEXT_BYTES || others_bytes + text.len() > MAX_ALL_TEXT_BYTES {
                return Err(TOO_MUCH);
            }
            left = left.checked_sub(text.len()).ok_or(TOO_MUCH)?;
            let stem = recipe.file.strip_suffix(".dcg").unwrap_or(&recipe.file);
            let mut names = numbers.by_ref().map(|number| format!("{stem}.{number}.dcg"));
            let name = names.find(|name| !texts.contains_key(name)).ok_or(TOO_MUCH)?;
            if !can_be_imported(&name) {
                return Err(TOO_LONG);
            }
            texts.insert(name.clone(), text);
            Ok(name)
        });
        match named {
            Ok(name) => recipe.file.clone_from(name),
            Err(kind) => {
                defects.note(kind, 1, || part.name.clone());
                part.recipe = None;
            }
        }
    }
    texts
}

/// A name that no `import` can say, so that the probe never imports itself: it would end the text.
const UNSAYABLE: &str = "\"";

/// Whether rules can say the name of a file: the one that is read first may have any.
fn can_be_imported(file: &str) -> bool {
    let said = Program::read(UNSAYABLE, format!("import \"{file}\" as file"), &NoImports);
    said.is_err_and(|error| matches!(&error.problem, Problem::Import { path, .. } if path == file))
}
