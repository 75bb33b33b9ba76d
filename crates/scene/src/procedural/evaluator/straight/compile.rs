//! How does an expression become operations? Node by node, in the order in which a visit computes them; functions are read
//! where they are called. What a visit would count is counted here, once.
//!
//! An expression that has a choice to make, or is about lists, becomes nothing.

use super::code::{Operation, Register};
use super::emit::Emitter;
use crate::procedural::link::Program;
use crate::procedural::operation::{BuiltIn, MAX_OCTAVES};
use crate::procedural::syntax::{Call, Cost, Expr, Formal, Written};

/// Most nodes that are made operations together, so that what calls much is not read again and again.
const MOST_NODES: u32 = 1_024;
/// Most calls inside each other that are read where they stand.
const MOST_CALLS: u32 = 16;

/// What `level` means here.
#[derive(Debug, Clone, Copy)]
pub(super) enum Level {
    /// That of the rule that is being visited.
    Own,
    /// A function has none.
    None,
    /// That of a rule that would be called: not known before.
    Unknown,
}

/// What names mean, and which random numbers belong here.
#[derive(Debug)]
pub(super) struct Names {
    /// Values by their slots; later ones hide earlier ones.
    pub(super) bound: Vec<(u32, Register)>,
    /// Whether other values lie on the stack.
    pub(super) has_stack: bool,
    pub(super) level: Level,
    pub(super) path: Register,
}

pub(super) struct Compiler<'p> {
    pub(super) program: &'p Program,
    pub(super) module: usize,
    pub(super) names: Names,
    pub(super) emitter: Emitter,
    pub(super) cost: Cost,
    /// Most calls inside each other.
    pub(super) levels: u32,
    nesting: u32,
    calls: u32,
}

impl<'p> Compiler<'p> {
    pub(super) fn new(program: &'p Program, module: usize) -> Self {
        let names = Names {
            bound: Vec::new(),
            has_stack: true,
            level: Level::Own,
            path: 0,
        };
        Self {
            program,
            module,
            names,
            emitter: Emitter::new(),
            cost: Cost::default(),
            levels: 0,
            nesting: 0,
            calls: 0,
        }
    }

    /// Nodes that were looked at.
    pub(super) fn work(&self) -> u32 {
        self.cost.steps
    }

    /// Nodes around what is looked at, itself included.
    pub(super) fn nesting(&self) -> u32 {
        self.nesting
    }

    /// Whether what is looked at was called.
    pub(super) fn is_in_call(&self) -> bool {
        self.calls > 0
    }

    /// Goes one deeper; whoever calls it comes back with [`Compiler::leave`], unless there was nothing.
    pub(super) fn enter(&mut self) -> Option<()> {
        self.nesting += 1;
        self.cost.nesting = self.cost.nesting.max(self.nesting);
        self.count(1)
    }

    pub(super) fn leave(&mut self) {
        self.nesting -= 1;
    }

    pub(super) fn count(&mut self, steps: u32) -> Option<()> {
        self.cost.steps += steps;
        (self.cost.steps <= MOST_NODES).then_some(())
    }

    /// A number within a range.
    pub(super) fn ranged(&mut self, expr: &'p Expr, (min, max): (f64, f64)) -> Option<Register> {
        let number = self.number(expr)?;
        self.emitter.within(number, (min, max));
        Some(number)
    }

    /// As [`Evaluator::value`](super::Evaluator::value) visits it.
    pub(super) fn value(&mut self, expr: &'p Expr) -> Option<Register> {
        if let Expr::Plain(plain) = expr {
            return self.value(&plain.of);
        }
        self.enter()?;
        let register = self.computed(expr)?;
        self.leave();
        Some(register)
    }

    /// As [`Evaluator::number`](super::Evaluator::number) visits it.
    pub(super) fn number(&mut self, expr: &'p Expr) -> Option<Register> {
        match expr {
            Expr::Number(_) | Expr::Local(_) => self.computed(expr),
            _ => self.value(expr),
        }
    }

    fn computed(&mut self, expr: &'p Expr) -> Option<Register> {
        Some(match expr {
            Expr::Number(number) => self.emitter.constant(*number),
            Expr::Local(slot) => self.local(*slot)?,
            Expr::Global(index) => {
                let wanted = self.program.modules[self.module].uses[*index].slot;
                let is_same = |known: &Operation| matches!(known, Operation::Global(slot) if *slot == wanted);
                self.emitter.load(Operation::Global(wanted), is_same)
            }
            Expr::Detail => self
                .emitter
                .load(Operation::Detail, |known| matches!(known, Operation::Detail)),
            Expr::Level => match self.names.level {
                Level::Own => self
                    .emitter
                    .load(Operation::Level, |known| matches!(known, Operation::Level)),
                Level::None => self.emitter.constant(0.0),
                Level::Unknown => return None,
            },
            Expr::Minus(of) => {
                let of = self.number(of)?;
                match self.emitter.known(of) {
                    Some(number) => self.emitter.constant(-number),
                    None => {
                        self.emitter.shown(&[of]);
                        self.emitter.emit(Operation::Minus(of), &[of], 1)
                    }
                }
            }
            Expr::Not(of) => {
                let of = self.number(of)?;
                self.emitter.emit(Operation::Not(of), &[of], 1)
            }
            Expr::Binary { operator, sides, .. } => {
                let sides = [self.number(&sides[0])?, self.number(&sides[1])?];
                self.emitter.binary(*operator, sides)
            }
            Expr::BuiltIn {
                name, site, arguments, ..
            } => self.built_in(*name, *site, arguments)?,
            Expr::Call(index) => self.apply(&self.program.modules[self.module].calls[*index])?,
            _ => return None,
        })
    }

    fn local(&mut self, wanted: u32) -> Option<Register> {
        match self.names.bound.iter().rev().find(|(slot, _)| *slot == wanted) {
            Some((_, register)) => Some(*register),
            None if self.names.has_stack => {
                let is_same = |known: &Operation| matches!(known, Operation::Local(slot) if *slot == wanted);
                Some(self.emitter.load(Operation::Local(wanted), is_same))
            }
            None => None,
        }
    }

    fn built_in(&mut self, name: BuiltIn, site: u32, arguments: &'p [Written]) -> Option<Register> {
        let mut of = [0; 3];
        if name == BuiltIn::Mix {
            let [a, b] = [self.value(&arguments[0].of)?, self.value(&arguments[1].of)?];
            let part = self.number(&arguments[2].of)?;
            // Between numbers, which have a size of one.
            self.count(1)?;
            return Some(self.emitter.between(a, b, part));
        }
        if name == BuiltIn::Count {
            return None;
        }
        for (of, argument) in of.iter_mut().zip(arguments) {
            *of = self.number(&argument.of)?;
        }
        let of = &of[..arguments.len()];
        Some(match (name, of) {
            (BuiltIn::Noise, &[x, z]) => self.fractal([x, z], 1)?,
            (BuiltIn::Fractal, &[x, z, octaves]) => {
                let octaves = self.emitter.known(octaves);
                let octaves = octaves.filter(|octaves| (1.0..=MAX_OCTAVES).contains(octaves))?;
                self.fractal([x, z], octaves as u32)?
            }
            (BuiltIn::Random, &[a, b]) => self.emitter.random_between(self.names.path, site, [a, b]),
            (BuiltIn::Random, _) => self.emitter.random(self.names.path, site),
            _ => {
                let filled = [0, 1, 2].map(|i| of.get(i).copied().unwrap_or(of[0]));
                self.emitter.emit(Operation::BuiltIn(name, filled), of, 1)
            }
        })
    }

    fn fractal(&mut self, at: [Register; 2], octaves: u32) -> Option<Register> {
        self.count(octaves)?;
        Some(self.emitter.emit(Operation::Fractal { at, octaves }, &at, 1))
    }

    /// The value of a function of the file.
    fn apply(&mut self, call: &'p Call) -> Option<Register> {
        if call.module.is_some() {
            return None;
        }
        let function = &self.program.modules[self.module].functions[call.target.index?];
        let outer = self.call(call, &function.formals, Level::None)?;
        let value = self.value(&function.value.of)?;
        self.back(outer);
        Some(value)
    }

    /// Binds what a callee of the same file is given. Whoever calls it comes [back](Compiler::back) with what it gives.
    pub(super) fn call(&mut self, call: &'p Call, formals: &'p [Formal], level: Level) -> Option<Names> {
        if self.calls == MOST_CALLS {
            return None;
        }
        let mut bound = Vec::new();
        for (slot, argument) in call.given() {
            bound.push((slot as u32, self.value(&argument.value.of)?));
        }
        let to = self.emitter.path(self.names.path, call.site);
        let inner = Names {
            bound,
            has_stack: false,
            level: Level::None,
            path: to,
        };
        let outer = std::mem::replace(&mut self.names, inner);
        self.calls += 1;
        self.levels = self.levels.max(self.calls);
        for (slot, formal) in call.left(formals) {
            if let Some(default) = &formal.default {
                let value = self.value(&default.of)?;
                self.names.bound.push((slot as u32, value));
            }
        }
        self.names.level = level;
        Some(outer)
    }

    pub(super) fn back(&mut self, outer: Names) {
        self.names = outer;
        self.calls -= 1;
    }
}
