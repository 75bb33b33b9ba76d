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
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
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
    /// The first of those that are tied as most of them are.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub example: Option<String>,
}

impl Tie {
    const ALL: [Self; 3] = [Self::Paint, Self::Others, Self::Cut];

    /// What models that are so tied do.
    fn told(self) -> &'static str {
        match self {
            Self::Paint => "take what their caller paints them with",
            Self::Others => "are `called` something or hold other parts",
            Self::Cut => "are pieces of what is too large for one object",
        }
    }

    /// What would untie them.
    fn way_out(self) -> &'static str {
        match self {
            Self::Paint => "let the part paint itself, with a parameter for what differs",
            Self::Others => "let it be made of rules, and a rule place parts side by side, outside of `called`",
            Self::Cut => "make it of several parts",
        }
    }
}

impl Growable {
    /// Counts those of a scene.
    #[must_use]
    pub fn of(scene: &SourceScene) -> Self {
        let models = |tie| scene.models.iter().filter(move |model| model.tie == Some(tie));
        let tied = |tie| models(tie).count();
        let likeliest = Tie::ALL.into_iter().max_by_key(|tie| tied(*tie));
        let first = likeliest.and_then(|tie| models(tie).next());
        Self {
            models: scene.models.len(),
            alone: scene.models.iter().filter(|model| model.recipe.is_some()).count(),
            painted: tied(Tie::Paint),
            with_others: tied(Tie::Others),
            cut: tied(Tie::Cut),
            example: first.map(|model| model.name.clone()),
        }
    }

    /// How many are tied so.
    fn tied(&self, tie: Tie) -> usize {
        match tie {
            Tie::Paint => self.painted,
            Tie::Others => self.with_others,
            Tie::Cut => self.cut,
        }
    }

    /// The same for a person, with what would help where few can be grown; `None` where nothing has grown from rules.
    #[must_use]
    pub fn sentence(&self) -> Option<String> {
        let ties: Vec<Tie> = Tie::ALL.into_iter().filter(|tie| self.tied(*tie) > 0).collect();
        if self.alone == 0 && ties.is_empty() {
            return None;
        }
        let mut sentence = format!("{} of {} models can be grown by clients", self.alone, self.models);
        for tie in &ties {
            sentence += &format!("; {} {}", self.tied(*tie), tie.told());
        }
        let likeliest = ties.into_iter().max_by_key(|tie| self.tied(*tie));
        if let (Some(tie), Some(example)) = (likeliest, &self.example)
            && self.tied(tie) > self.alone
        {
            sentence += &format!(", as `{example}`: {}", tie.way_out());
        }
        Some(sentence)
    }
}
