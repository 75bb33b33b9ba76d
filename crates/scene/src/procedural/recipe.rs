//! How is one part of a model made without the rest? From what it was called with.

use std::fmt::Write as _;
use std::sync::Arc;

use super::value::Value;

/// What a part was made of. It is known for parts that place nothing themselves and depend on nothing else.
#[derive(Debug, Clone, PartialEq)]
pub struct Recipe {
    /// The file that declares it, as it was imported.
    pub file: String,
    /// What the file was given for parameters of its own; a text that has them as its own is
    /// [`Program::text_given`](super::Program::text_given).
    pub given: Arc<[(String, Value)]>,
    /// The part; `None` for the file as a whole.
    pub part: Option<String>,
    /// A value for each of its parameters, in order.
    pub parameters: Vec<(String, Value)>,
}

impl Recipe {
    /// Rules that place this part and nothing else: grown with the same seed and level of detail, part 1 is the same, where the
    /// file has what it was given as its own.
    #[must_use]
    pub fn text(&self) -> String {
        let mut text = format!("import \"{}\" as rules rules", self.file);
        if let Some(part) = &self.part {
            text = text + "." + part;
        }
        for (i, (name, value)) in self.parameters.iter().enumerate() {
            text += if i == 0 { "(" } else { ", " };
            // Writing to a text cannot fail; `{value}` gives the shortest digits that lead back to the number.
            _ = write!(text, "{name} = {}", value.to_json());
        }
        text += if self.parameters.is_empty() { "()" } else { ")" };
        text
    }
}
