//! What does one part look like by itself, as its recipe says? In another pose, or with less detail, of the texts that were read:
//! so what is wrong with it is told at their lines.

use super::{Account, Evaluator, NO_BOXES, NOBODY, Outcome, Scope, Settings, Turtle, Watch};
use crate::procedural::affine::Affine;
use crate::procedural::error::DcgError;
use crate::procedural::grown::{Grown, Part, SaidInFile};
use crate::procedural::link::Program;
use crate::procedural::recipe::Recipe;
use crate::procedural::syntax::At;

/// Grows one part of a model by itself, as part 1, as its recipe says; parameters of the first file are not asked for. What is wrong
/// with what it is given is told where the part was asked for, if that is known, as is the call in which something is wrong.
///
/// # Errors
/// As [`grow`](super::grow).
pub fn grow_part(
    program: &Program,
    (recipe, asked): (&Recipe, Option<SaidInFile>),
    settings: &Settings,
) -> Result<Grown, Box<DcgError>> {
    grow_part_watched(program, (recipe, asked), settings, NOBODY)
}

/// The same for somebody who wants to know how far it is.
///
/// # Errors
/// As [`grow`](super::grow).
pub fn grow_part_watched(
    program: &Program,
    (recipe, asked): (&Recipe, Option<SaidInFile>),
    settings: &Settings,
    watch: Watch,
) -> Result<Grown, Box<DcgError>> {
    let mut evaluator = Evaluator::growing(program, settings, NO_BOXES);
    evaluator.watch = watch;
    evaluator.finish(|evaluator| evaluator.grow_alone(recipe, asked))
}

impl Evaluator<'_> {
    /// Grows a part of the program into an empty model, as part 1; nothing where the program has no such part. What is wrong with
    /// what it is given is told where it was `said`, or else where the part is declared.
    pub(super) fn grow_alone(&mut self, recipe: &Recipe, said: Option<SaidInFile>) -> Outcome<()> {
        self.parts.push(Part::new("", None));
        self.accounts.push(Account::default());
        let modules = &self.program.modules;
        let Some(module) = modules.iter().position(|module| module.file == recipe.file) else {
            return Ok(());
        };
        let rules = &modules[module].rules;
        let rule = recipe
            .part
            .as_ref()
            .map(|name| rules.iter().position(|rule| rule.name == *name));
        let declared = rule.flatten().map_or(0, |index| rules[index].at);
        let place = said.map_or((module, declared), |said| (said.file, said.at));
        let (instance, path) = self.instance_alone(module, recipe, place)?;
        let inner = Scope {
            module,
            instance,
            base: self.stack.len(),
            path,
            depth: 1,
            level: 0,
            held: self.held,
        };
        let outer = Scope {
            module: place.0,
            depth: 0,
            ..inner
        };
        let turtle = Turtle {
            frame: Affine::IDENTITY,
            material: 0,
        };
        match rule {
            None => {
                let part = self.grow_file(&turtle, module, (instance, path), inner.depth);
                let part = part.map_err(|error| self.traced(place, error))?;
                self.place_known((&outer, place.1), &turtle, part)
            }
            Some(None) => Ok(()),
            Some(Some(index)) => {
                let rule = self.rule(module, index);
                self.open_frame(inner.base, rule.slots);
                for (slot, (_, value)) in recipe.parameters.iter().enumerate() {
                    self.put(inner.base + slot, value.clone(), place)?;
                }
                self.go_on((&outer, place.1), &turtle, (rule, index), inner)
            }
        }
    }

    /// The recipe's file with what it was given, and the path that belongs to that.
    fn instance_alone(&mut self, module: usize, recipe: &Recipe, place: (usize, At)) -> Outcome<(usize, u32)> {
        let given = match recipe.part {
            Some(_) => &recipe.given[..],
            None => &recipe.parameters,
        };
        let parameters = self.program.modules[module].parameters.iter();
        let values = parameters.map(|parameter| {
            let (_, value) = given.iter().find(|(name, _)| *name == parameter.formal.name)?;
            Some((value.clone(), Some(place)))
        });
        self.instance(module, &values.collect::<Vec<_>>(), Some(place))
    }
}
