//! Which texts do a model's parts need to be made alone? Those of its files; and where a file was given values for parameters of its
//! own, the same text that has them.

use std::collections::BTreeMap;

use belvedere_scene::procedural::{Grown, Program};

/// Most bytes of texts that differ by what they were given alone; parts of others cannot be made alone.
const MOST_GIVEN_BYTES: usize = 16 << 20;

/// All texts by their names; recipes of parts in files that were given something are led to texts that have it.
pub(super) fn texts_of(program: &Program, grown: &mut Grown) -> BTreeMap<String, String> {
    let mut texts: BTreeMap<String, String> = program
        .files()
        .map(|(name, text)| (name.to_owned(), text.to_owned()))
        .collect();
    let mut known: BTreeMap<(String, String), Option<String>> = BTreeMap::new();
    let (mut left, mut numbers) = (MOST_GIVEN_BYTES, 1_u32..);
    for part in &mut grown.parts {
        let Some(recipe) = part.recipe.as_mut().filter(|recipe| !recipe.given.is_empty()) else {
            continue;
        };
        let given: BTreeMap<_, _> = std::mem::take(&mut recipe.given).into_iter().collect();
        let values = given.iter().map(|(name, value)| format!("{name}={}", value.to_json()));
        let key = (recipe.file.clone(), values.collect::<Vec<_>>().join(","));
        let named = known.entry(key).or_insert_with(|| {
            let text = program.text_given(&recipe.file, &given)?;
            left = left.checked_sub(text.len())?;
            let stem = recipe.file.strip_suffix(".dcg").unwrap_or(&recipe.file);
            let mut names = numbers.by_ref().map(|number| format!("{stem}.{number}.dcg"));
            let name = names.find(|name| !texts.contains_key(name))?;
            texts.insert(name.clone(), text);
            Some(name)
        });
        match named {
            Some(name) => recipe.file.clone_from(name),
            None => part.recipe = None,
        }
    }
    texts
}
