//! What grows out of the rules? A traversal of the graph, depth first and from left to right (Schmalstieg 1997, §8.3).
//!
//! Values are computed when the traversal comes by: arguments once for each call, branches that are not taken never. State
//! is handed down and never up, so what happens in one branch does not touch the next. Everything that is visited is
//! counted, and stops at its limit.
//!
//! * [`statement`] visits nodes, [`enumerate`] those that visit theirs many times, unless that is [`foreseen`] to be too many.
//! * [`call`] follows edges of the graph, [`part`] shares what they lead to, [`module`] gives files their values, [`alone`] makes
//!   one part by itself.
//! * [`straight`] does at one go what makes no choice.
//! * [`held`] counts what lists take that are needed at once.
//! * [`expression`] computes values, [`plain`] many of them at one go, [`terminal`] makes solids and [`material`] surfaces of
//!   them, [`wish`] pictures.

mod alone;
mod call;
mod enumerate;
mod expression;
mod foreseen;
mod held;
mod material;
mod module;
mod part;
mod plain;
mod statement;
mod straight;
mod terminal;
mod wish;

pub use alone::{grow_part, grow_part_watched};
pub use part::PHASE;
pub(super) use straight::Kept;
use straight::Plans;

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use super::affine::Affine;
use super::error::DcgError;
use super::grown::{Grown, Part, Surface};
use super::limits::{FINEST, Limits, Usage, reached};
use super::link::Program;
use super::problem::Problem;
use super::solid::Tools;
use super::syntax::{At, Module, Rule};
use super::value::Value;
use crate::Bounds;

/// What can be chosen besides the text.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Where random numbers come from.
    pub seed: u32,
    /// Level of detail, from 0 (coarsest) to [`FINEST`].
    pub detail: u32,
    /// Values for parameters of the first file.
    pub parameters: BTreeMap<String, Value>,
    /// What may be taken.
    pub limits: Limits,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            seed: 0,
            detail: FINEST,
            parameters: BTreeMap::new(),
            limits: Limits::default(),
        }
    }
}

/// The box around a glTF file that rules place, by the path that they give; nothing where it is not known.
pub type Boxes<'b> = &'b dyn Fn(&str) -> Option<Bounds>;

const NO_BOXES: Boxes<'static> = &|_| None;

/// Hears now and then how many steps were taken so far.
pub type Watch<'w> = &'w dyn Fn(u64);

const NOBODY: Watch<'static> = &|_| {};
/// So many steps lie between two times that it hears; they take a fraction of a second.
const WATCHED_EACH: u64 = 1 << 22;

/// Grows a model: all its triangles. glTF files that it places are in no bounds.
///
/// # Errors
/// When a parameter is unknown or out of range, something has no value, or a limit is reached.
pub fn grow(program: &Program, settings: &Settings) -> Result<Grown, Box<DcgError>> {
    grow_with(program, settings, NO_BOXES)
}

/// The same with the boxes around glTF files, which are then in the bounds of what places them.
///
/// # Errors
/// As [`grow`], and where a glTF file reaches beyond what a part declares.
pub fn grow_with(program: &Program, settings: &Settings, boxes: Boxes) -> Result<Grown, Box<DcgError>> {
    grow_watched(program, settings, boxes, NOBODY)
}

/// The same for somebody who wants to know how far it is.
///
/// # Errors
/// As [`grow_with`].
pub fn grow_watched(
    program: &Program,
    settings: &Settings,
    boxes: Boxes,
    watch: Watch,
) -> Result<Grown, Box<DcgError>> {
    let mut evaluator = Evaluator::growing(program, settings, boxes);
    evaluator.watch = watch;
    evaluator.finish(Evaluator::grow_model)
}

/// A box that holds the model, without making triangles. A part that says `within` is not looked into; `boxes` are those of
/// glTF files.
///
/// # Errors
/// As [`grow`] does, but for what is inside of such parts.
pub fn bounds(program: &Program, settings: &Settings, boxes: Boxes) -> Result<Bounds, Box<DcgError>> {
    Ok(bounds_watched(program, settings, boxes, NOBODY)?.0)
}

/// The same for somebody who wants to know how far it is, and what it took.
///
/// # Errors
/// As [`bounds`].
pub fn bounds_watched(
    program: &Program,
    settings: &Settings,
    boxes: Boxes,
    watch: Watch,
) -> Result<(Bounds, Usage), Box<DcgError>> {
    let mut evaluator = Evaluator::new(program, settings, boxes, true);
    evaluator.watch = watch;
    let grown = evaluator.finish(Evaluator::grow_model)?;
    Ok((grown.parts[0].bounds, grown.usage))
}

/// Refuses what a model is given if it does not take it.
pub(super) fn refuse_given(program: &Program, settings: &Settings) -> Result<(), Box<DcgError>> {
    Evaluator::new(program, settings, NO_BOXES, false).given().map(|_| ())
}

/// As many letters are kept like a number.
const LETTERS: usize = 8;

type Outcome<T> = Result<T, Box<DcgError>>;

/// Where names are looked up, and which random numbers belong here.
#[derive(Debug, Clone, Copy)]
struct Scope {
    module: usize,
    /// Index into [`Evaluator::instances`].
    instance: usize,
    /// Where the values of the rule begin on the stack.
    base: usize,
    /// See [`random`](super::random).
    path: u32,
    /// Calls inside each other.
    depth: u32,
    /// Calls of this rule inside each other.
    level: u32,
    /// What was [held](Evaluator::held) when it began.
    held: usize,
}

/// What is handed down besides names.
#[derive(Debug, Clone, Copy)]
struct Turtle {
    frame: Affine,
    material: usize,
}

/// A file with values for its parameters.
#[derive(Debug)]
struct ModuleInstance {
    /// No other has had this number.
    serial: u32,
    /// The parameters that were given to it, with their values.
    given: Arc<[(String, Value)]>,
    values: Vec<Option<Value>>,
    /// Its materials without parameters, once they are computed.
    surfaces: Vec<Option<usize>>,
}

/// What is known of a part besides its geometry.
#[derive(Debug, Clone, Default)]
struct Account {
    finished: bool,
    /// Whether it has a parameter by which it moves.
    has_phase: bool,
    /// Parts, glTF files and viewpoints placed in it, with all that they contain.
    placements: u64,
    /// Where each of its own glTF files is placed.
    models: Vec<(usize, At)>,
}

/// What lists among some values hold: the steps that it takes to tell them from others, besides those of the values.
fn listed<'v>(values: impl IntoIterator<Item = &'v Value>) -> u64 {
    values.into_iter().map(|value| value.size() as u64 - 1).sum()
}

struct Evaluator<'p> {
    program: &'p Program,
    settings: &'p Settings,
    boxes: Boxes<'p>,
    /// Whether only bounds are wanted.
    measuring: bool,
    watch: Watch<'p>,
    usage: Usage,
    /// At more steps than these something is to be done: to say how many there were, or to stop.
    next_stop: u64,
    nesting: u32,
    stack: Vec<Value>,
    /// For each place of the stack the size of the list that was put there last.
    listed: Vec<u32>,
    /// Numbers of lists that are needed now.
    held: usize,
    instances: Vec<ModuleInstance>,
    /// How many there have been.
    instances_made: u32,
    /// For each module its expressions that are [settled](super::syntax::Plain::settled): the instance for which each was computed
    /// last, by its serial number, and what it was.
    settled: Vec<Vec<Option<(u32, f64)>>>,
    /// Files with their own defaults.
    default_instances: Vec<Option<usize>>,
    /// Instances and parts by what they were made with.
    known: HashMap<Vec<u64>, usize>,
    known_materials: BTreeMap<Vec<u64>, usize>,
    /// Room for what is looked up there.
    key: Vec<u64>,
    /// Calls that are open, for each rule of each module.
    open: Vec<u32>,
    /// Where the rules of a module begin in `open`.
    first_rule: Vec<usize>,
    parts: Vec<Part>,
    accounts: Vec<Account>,
    /// The part that is being made.
    part: usize,
    materials: Vec<Surface>,
    tools: Tools,
    plans: Plans,
}

impl<'p> Evaluator<'p> {
    fn new(program: &'p Program, settings: &'p Settings, boxes: Boxes<'p>, measuring: bool) -> Self {
        let mut first_rule = Vec::new();
        let mut rules = 0;
        for module in &program.modules {
            first_rule.push(rules);
            rules += module.rules.len();
        }
        Self {
            program,
            settings,
            boxes,
            measuring,
            watch: NOBODY,
            usage: Usage::default(),
            next_stop: WATCHED_EACH.min(settings.limits.steps),
            nesting: 0,
            stack: Vec::new(),
            listed: Vec::new(),
            held: 0,
            instances: Vec::new(),
            instances_made: 0,
            settled: program
                .modules
                .iter()
                .map(|module| vec![None; module.settled as usize])
                .collect(),
            default_instances: vec![None; program.modules.len()],
            known: HashMap::new(),
            known_materials: BTreeMap::new(),
            key: Vec::new(),
            open: vec![0; rules],
            first_rule,
            parts: Vec::new(),
            accounts: Vec::new(),
            part: 0,
            materials: vec![Surface::default()],
            tools: Tools::default(),
            plans: Plans::new(program.modules.iter().map(|module| module.plans)),
        }
    }

    /// One that makes triangles, with the plans of what grew before.
    fn growing(program: &'p Program, settings: &'p Settings, boxes: Boxes<'p>) -> Self {
        let mut evaluator = Self::new(program, settings, boxes, false);
        if let Some(plans) = program.kept.take() {
            evaluator.plans = plans;
        }
        evaluator
    }

    fn finish(mut self, grow: impl FnOnce(&mut Self) -> Outcome<()>) -> Outcome<Grown> {
        let grown = grow(&mut self);
        let grown = grown.map_err(|error| self.program.with_given(error, self.settings));
        if !self.measuring {
            self.program.kept.put(self.plans);
        }
        grown?;
        self.usage.parts = self.parts.len() as u64;
        self.usage.materials = self.materials.len() as u64;
        self.usage.files = self.program.modules.len() as u64;
        self.usage.text = self.program.modules.iter().map(|module| module.text.len() as u64).sum();
        self.usage.placements = self.accounts[0].placements;
        Ok(Grown {
            parts: self.parts,
            materials: self.materials,
            usage: self.usage,
        })
    }

    fn error<T>(&self, module: usize, at: At, problem: Problem) -> Outcome<T> {
        Err(self.program.modules[module].error(at, problem))
    }

    /// The error, with the call in which it happened.
    #[cold]
    fn traced(&self, (module, at): (usize, At), mut error: Box<DcgError>) -> Box<DcgError> {
        let Module { file, text, .. } = &self.program.modules[module];
        error.add_caller(file, text, at);
        error
    }

    /// Counts visits; `at` is where to say that there are too many.
    fn count(&mut self, scope: &Scope, at: At, steps: u64) -> Outcome<()> {
        if self.takes(steps) {
            return Ok(());
        }
        self.error(scope.module, at, reached("steps", self.settings.limits.steps))
    }

    /// Counts what is kept until the end.
    fn keep(&mut self, (module, at): (usize, At), numbers: usize) -> Outcome<()> {
        self.usage.kept = self.usage.kept.saturating_add(numbers as u64);
        let limit = self.settings.limits.kept;
        if self.usage.kept > limit {
            return self.error(module, at, reached("numbers kept", limit));
        }
        Ok(())
    }

    /// The same of a name.
    fn keep_name(&mut self, (module, at): (usize, At), name: &str) -> Outcome<()> {
        self.keep((module, at), name.len() / LETTERS)
    }

    /// Goes one deeper; whoever calls it comes back with [`Evaluator::ascend`], unless there was an error.
    fn descend(&mut self, scope: &Scope, at: At) -> Outcome<()> {
        if self.enters() {
            return Ok(());
        }
        self.refused(scope, at)
    }

    /// Counts visits; whether there are not too many.
    fn takes(&mut self, steps: u64) -> bool {
        self.usage.steps = self.usage.steps.saturating_add(steps);
        self.usage.steps <= self.next_stop || self.goes_on()
    }

    /// Says how many steps were taken; whether there may be more.
    #[cold]
    fn goes_on(&mut self) -> bool {
        let (steps, most) = (self.usage.steps, self.settings.limits.steps);
        (self.watch)(steps.min(most));
        self.next_stop = steps.saturating_add(WATCHED_EACH).min(most);
        steps <= most
    }

    /// Says how many steps were taken where they were paid for at one go.
    #[inline]
    fn tell(&mut self) {
        if self.usage.steps > self.next_stop {
            self.goes_on();
        }
    }

    /// Goes one deeper; whether that is allowed.
    fn enters(&mut self) -> bool {
        self.nesting += 1;
        self.usage.nesting = self.usage.nesting.max(self.nesting);
        self.nesting <= self.settings.limits.nesting && self.takes(1)
    }

    /// Why [`Evaluator::enters`] said no.
    #[cold]
    fn refused(&self, scope: &Scope, at: At) -> Outcome<()> {
        let Limits { nesting, steps, .. } = self.settings.limits;
        let reached = if self.nesting > nesting {
            reached("levels of nesting", nesting.into())
        } else {
            reached("steps", steps)
        };
        self.error(scope.module, at, reached)
    }

    fn ascend(&mut self) {
        self.nesting -= 1;
    }

    fn local(&mut self, scope: &Scope, slot: u32) -> &mut Value {
        &mut self.stack[scope.base + slot as usize]
    }

    fn rule(&self, module: usize, index: usize) -> &'p Rule {
        &self.program.modules[module].rules[index]
    }
}
