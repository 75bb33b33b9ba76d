//! What does a file cost each of many models that wait for it? Rules from which many would grow come once, so each of these counts
//! its share of them, as in `viewer/core/strategy/sharing.ts`: else levels of many models come instead, one by one, of which none alone costs
//! more than all of the rules.

use std::collections::HashMap;

use belvedere_scene::object::Model;

use super::{
    file::Key,
    grade::{State, Stock},
};

/// What is known of files, and how many models wait for each.
pub(super) struct Sharing<'a, S> {
    stock: &'a S,
    waiting: HashMap<Key, usize>,
}

impl<'a, S: Stock> Sharing<'a, S> {
    /// Among models of which nothing is here, each once.
    pub(super) fn among<'m>(models: impl IntoIterator<Item = &'m Model>, stock: &'a S) -> Self {
        let mut waiting = HashMap::new();
        for rules in models.into_iter().filter_map(|model| model.procedural.as_ref()) {
            let imports = rules.imports.values().map(|import| &import.url);
            for file in imports.chain([&rules.rules]) {
                *waiting.entry(file.into()).or_insert(0) += 1;
            }
        }
        Self { stock, waiting }
    }
}

impl<S: Stock> Stock for Sharing<'_, S> {
    fn state(&self, file: Key) -> State {
        self.stock.state(file)
    }

    fn waiting(&self, file: Key) -> usize {
        self.waiting.get(&file).copied().unwrap_or(1)
    }
}
