//! Which models can clients grow themselves, and what keeps the others from it?

use serde::{Deserialize, Serialize};

use crate::source::SourceScene;

/// What keeps a model that has grown from rules from being grown alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tie {
    /// It takes on the paint that it is called in.
    Paint,
    /// It is what something is `called`, or other parts or glTF files stand in it.
    Others,
    /// It is a piece of what was cut.
    Cut,
}

/// How many models of a scene are offered as rules, and why the others that have grown from rules are not.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Growable {
    /// All of the scene, those that no rules made too.
    pub models: usize,
    /// Those that can be grown alone.
    pub alone: usize,
    /// Those tied by [`Tie::Paint`].
    pub painted: usize,
    /// Those tied by [`Tie::Others`].
    pub with_others: usize,
    /// Those tied by [`Tie::Cut`].
    pub cut: usize,
}

impl Growable {
    /// Counts those of a scene.
    #[must_use]
    pub fn of(scene: &SourceScene) -> Self {
        let tied = |tie| scene.models.iter().filter(|model| model.tie == Some(tie)).count();
        Self {
            models: scene.models.len(),
            alone: scene.models.iter().filter(|model| model.recipe.is_some()).count(),
            painted: tied(Tie::Paint),
            with_others: tied(Tie::Others),
            cut: tied(Tie::Cut),
        }
    }

    /// The same for a person; `None` where nothing has grown from rules.
    #[must_use]
    pub fn sentence(&self) -> Option<String> {
        let why = [
            (self.painted, "take what their caller paints them with"),
            (self.with_others, "are `called` something or hold other parts"),
            (self.cut, "are pieces of what is too large for one object"),
        ];
        let why: Vec<_> = why.into_iter().filter(|(count, _)| *count > 0).collect();
        (self.alone > 0 || !why.is_empty()).then(|| {
            let why = why.iter().map(|(count, why)| format!("; {count} {why}"));
            format!(
                "{} of {} models can be grown by clients{}",
                self.alone,
                self.models,
                why.collect::<String>()
            )
        })
    }
}
