//! Which models can clients grow themselves, and what keeps the others from it?

use serde::{Deserialize, Serialize};

use crate::source::SourceScene;

/// What keeps a model that has grown from rules from being grown alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tie {
    /// It takes on the paint that it is called in.
    Paint,
    /// It is what the first file draws beside the parts that it places.
    Outside,
    /// It is what something is `called`.
    Called,
    /// Other parts, glTF files or something `called` stand in it, be that empty.
    Others,
    /// It is a piece of what was cut.
    Cut,
}

/// How many models of a scene are offered as rules, and why the others are not. Together they are all.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Growable {
    /// All that are published, those that no rules made too: equal ones once, of what is cut each piece.
    pub models: usize,
    /// Those that can be grown alone.
    pub alone: usize,
    /// Those tied by [`Tie::Paint`].
    pub painted: usize,
    /// Those tied by [`Tie::Outside`].
    #[serde(default)]
    pub outside: usize,
    /// Those tied by [`Tie::Called`].
    #[serde(default)]
    pub called: usize,
    /// Those tied by [`Tie::Others`].
    pub with_others: usize,
    /// Those tied by [`Tie::Cut`].
    pub cut: usize,
    /// The first of those that are tied as most of them are.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub example: Option<String>,
}

impl Tie {
    const ALL: [Self; 5] = [Self::Paint, Self::Outside, Self::Called, Self::Others, Self::Cut];

    /// What one model that is so tied does, and what several do.
    fn told(self) -> [&'static str; 2] {
        match self {
            Self::Paint => [
                "takes what its caller paints it with",
                "take what their caller paints them with",
            ],
            Self::Outside => ["is drawn outside of parts", "are drawn outside of parts"],
            Self::Called => ["is what `called` names", "are what `called` names"],
            Self::Others => [
                "holds other parts, glTF files or something `called`",
                "hold other parts, glTF files or something `called`",
            ],
            Self::Cut => [
                "is a piece of what is too large for one object",
                "are pieces of what is too large for one object",
            ],
        }
    }

    /// What would untie them.
    fn way_out(self) -> &'static str {
        match self {
            Self::Paint => "let the part paint itself, with a parameter for what differs",
            Self::Outside => "put it into a `part`",
            Self::Called => "draw it in a `part`, and call that behind `called`",
            Self::Others => "let a rule place parts side by side",
            Self::Cut => "make it of several parts",
        }
    }
}

impl Growable {
    /// Counts those of a scene [as it is published](crate::as_published).
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
            outside: tied(Tie::Outside),
            called: tied(Tie::Called),
            with_others: tied(Tie::Others),
            cut: tied(Tie::Cut),
            example: first.map(|model| model.name.clone()),
        }
    }

    /// How many are tied so.
    fn tied(&self, tie: Tie) -> usize {
        match tie {
            Tie::Paint => self.painted,
            Tie::Outside => self.outside,
            Tie::Called => self.called,
            Tie::Others => self.with_others,
            Tie::Cut => self.cut,
        }
    }

    /// How many are from other files.
    fn made_by_no_rules(&self) -> usize {
        let tied: usize = Tie::ALL.into_iter().map(|tie| self.tied(tie)).sum();
        self.models.saturating_sub(self.alone + tied)
    }

    /// The same for a person, with what would help the others, and one of them where most are tied alike; `None` where nothing has
    /// grown from rules.
    #[must_use]
    pub fn sentence(&self) -> Option<String> {
        let ties: Vec<Tie> = Tie::ALL.into_iter().filter(|tie| self.tied(*tie) > 0).collect();
        if self.alone == 0 && ties.is_empty() {
            return None;
        }
        let likeliest = ties.iter().copied().max_by_key(|tie| self.tied(*tie));
        let models = if self.models == 1 { "model" } else { "models" };
        let mut sentence = format!(
            "{} of {} published {models} can be grown by clients",
            self.alone, self.models
        );
        for tie in ties {
            let count = self.tied(tie);
            let [one, several] = tie.told();
            sentence += &format!("; {count} {}", if count == 1 { one } else { several });
            if let Some(example) = self.example.as_ref().filter(|_| likeliest == Some(tie))
                && count > self.alone
            {
                sentence += &format!(", as `{example}`");
            }
            sentence += &format!(": {}", tie.way_out());
        }
        match self.made_by_no_rules() {
            0 => {}
            1 => sentence += "; 1 comes from a glTF file",
            many => sentence += &format!("; {many} come from glTF files"),
        }
        Some(sentence)
    }
}
