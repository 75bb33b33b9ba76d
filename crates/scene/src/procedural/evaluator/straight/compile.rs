//! How does an expression become operations? Node by node, in the order in which a visit computes them; functions are read
//! where they are called. What a visit would count is counted here, once.
//!
//! An expression that has a choice to make, or is about lists, becomes nothing.

use super::code::{Code, Operation, Register};
use crate::procedural::link::Program;
use crate::procedural::operation::{BuiltIn, MAX_OCTAVES, Operator};
use crate::procedural::syntax::{Call, Cost, Expr, Formal};

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
    pub(super) code: Code,
    pub(super) cost: Cost,
    /// Most calls inside each other.
    pub(super) levels: u32,
    nesting: u32,
    calls: u32,
    /// What is known of each register.
    numbers: Vec<Number>,
    /// Whether each path is the same in every turn.
    shared_paths: Vec<bool>,
}

#[derive(Debug, Clone, Copy)]
struct Number {
    /// Whether it is the same in every turn.
    is_shared: bool,
    /// Whether something else shows that it is finite.
    is_shown: bool,
    constant: Option<f64>,
}

impl<'p> Compiler<'p> {
    pub(super) fn new(program: &'p Program, module: usize) -> Self {
        let names = Names {
            bound: Vec::new(),
            has_stack: true,
            level: Level::Own,
            path: 0,
        };
        let code = Code {
            paths: 1,
            ..Code::default()
        };
        Self {
            program,
            module,
            names,
            code,
            cost: Cost::default(),
            levels: 0,
            nesting: 0,
            calls: 0,
            numbers: Vec::new(),
            shared_paths: vec![false],
        }
    }

    /// Nodes that were looked at.
    pub(super) fn work(&self) -> u32 {
        self.cost.steps
    }

    /// Registers that are filled from outside, the first of all.
    pub(super) fn given(&mut self, count: usize, is_shared: bool) -> Register {
        let known = Number {
            is_shared,
            is_shown: true,
            constant: None,
        };
        self.reserve(count, known)
    }

    pub(super) fn finished(mut self) -> Code {
        let open = self.numbers.iter().enumerate().filter(|(_, number)| !number.is_shown);
        self.code.finite = open.map(|(register, _)| register as Register).collect();
        self.code.registers = self.numbers.len();
        debug_assert_eq!(self.code.paths, self.shared_paths.len());
        self.code
    }

    fn reserve(&mut self, count: usize, known: Number) -> Register {
        let first = self.numbers.len();
        self.numbers.resize(first + count, known);
        first as Register
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

    pub(super) fn emit(&mut self, operation: Operation, of: &[Register], results: usize) -> Register {
        let is_shared = of.iter().all(|&of| self.numbers[of as usize].is_shared);
        let known = Number {
            is_shared,
            is_shown: false,
            constant: None,
        };
        let to = self.reserve(results, known);
        self.push(operation, to, is_shared);
        to
    }

    fn push(&mut self, operation: Operation, to: Register, is_shared: bool) {
        if is_shared {
            self.code.shared.push((operation, to));
        } else {
            self.code.each.push((operation, to));
        }
    }

    /// What is there before anything is computed, once.
    fn load(&mut self, operation: Operation, constant: Option<f64>, is_same: impl Fn(&Operation) -> bool) -> Register {
        if let Some((_, known)) = self.code.shared.iter().find(|(known, _)| is_same(known)) {
            return *known;
        }
        let known = Number {
            is_shared: true,
            is_shown: true,
            constant,
        };
        let to = self.reserve(1, known);
        self.push(operation, to, true);
        to
    }

    pub(super) fn constant(&mut self, number: f64) -> Register {
        let bits = number.to_bits();
        let is_same = |known: &Operation| matches!(known, Operation::Constant(known) if known.to_bits() == bits);
        self.load(Operation::Constant(number), Some(number), is_same)
    }

    /// That something else is not finite when these are not.
    pub(super) fn shown(&mut self, registers: &[Register]) {
        registers
            .iter()
            .for_each(|&of| self.numbers[of as usize].is_shown = true);
    }

    /// A number within a range.
    pub(super) fn ranged(&mut self, expr: &'p Expr, (min, max): (f64, f64)) -> Option<Register> {
        let number = self.number(expr)?;
        self.within(number, (min, max));
        Some(number)
    }

    /// A number that is not too near to zero.
    pub(super) fn apart(&mut self, number: Register, from_zero: f64) {
        let is_shared = self.numbers[number as usize].is_shared;
        self.push(Operation::Apart { number, from_zero }, 0, is_shared);
    }

    pub(super) fn within(&mut self, number: Register, (min, max): (f64, f64)) {
        let known = self.numbers[number as usize];
        if !known
            .constant
            .is_some_and(|constant| min <= constant && constant <= max)
        {
            let range = [min, max];
            self.push(Operation::Check { number, range }, 0, known.is_shared);
        }
        self.shown(&[number]);
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
            Expr::Number(number) => self.constant(*number),
            Expr::Local(slot) => self.local(*slot)?,
            Expr::Global(index) => {
                let wanted = self.program.modules[self.module].uses[*index].slot;
                let is_same = |known: &Operation| matches!(known, Operation::Global(slot) if *slot == wanted);
                self.load(Operation::Global(wanted), None, is_same)
            }
            Expr::Detail => self.load(Operation::Detail, None, |known| matches!(known, Operation::Detail)),
            Expr::Level => match self.names.level {
                Level::Own => self.load(Operation::Level, None, |known| matches!(known, Operation::Level)),
                Level::None => self.constant(0.0),
                Level::Unknown => return None,
            },
            Expr::Minus(of) => {
                let of = self.number(of)?;
                match self.numbers[of as usize].constant {
                    Some(number) => self.constant(-number),
                    None => {
                        self.shown(&[of]);
                        self.emit(Operation::Minus(of), &[of], 1)
                    }
                }
            }
            Expr::Not(of) => {
                let of = self.number(of)?;
                self.emit(Operation::Not(of), &[of], 1)
            }
            Expr::Binary { operator, sides, .. } => {
                let sides = [self.number(&sides[0])?, self.number(&sides[1])?];
                self.binary(*operator, sides)
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
                Some(self.load(Operation::Local(wanted), None, is_same))
            }
            None => None,
        }
    }

    pub(super) fn binary(&mut self, operator: Operator, sides: [Register; 2]) -> Register {
        if let [Some(a), Some(b)] = sides.map(|side| self.numbers[side as usize].constant)
            && operator.of(a, b).is_finite()
        {
            return self.constant(operator.of(a, b));
        }
        match operator {
            Operator::Add | Operator::Subtract | Operator::Multiply => self.shown(&sides),
            Operator::Divide => self.shown(&sides[..1]),
            _ => {}
        }
        self.emit(Operation::Binary(operator, sides), &sides, 1)
    }

    fn built_in(&mut self, name: BuiltIn, site: u32, arguments: &'p [Expr]) -> Option<Register> {
        let mut of = [0; 3];
        if name == BuiltIn::Mix {
            let [a, b] = [self.value(&arguments[0])?, self.value(&arguments[1])?];
            let part = self.number(&arguments[2])?;
            // Between numbers, which have a size of one.
            self.count(1)?;
            return Some(self.between(a, b, part));
        }
        if name == BuiltIn::Count {
            return None;
        }
        for (of, argument) in of.iter_mut().zip(arguments) {
            *of = self.number(argument)?;
        }
        let of = &of[..arguments.len()];
        Some(match (name, of) {
            (BuiltIn::Noise, &[x, z]) => self.fractal([x, z], 1)?,
            (BuiltIn::Fractal, &[x, z, octaves]) => {
                let octaves = self.numbers[octaves as usize].constant;
                let octaves = octaves.filter(|octaves| (1.0..=MAX_OCTAVES).contains(octaves))?;
                self.fractal([x, z], octaves as u32)?
            }
            (BuiltIn::Random, _) => {
                let random = Operation::Random {
                    path: self.names.path,
                    site,
                };
                let is_shared = self.shared_paths[self.names.path as usize];
                let known = Number {
                    is_shared,
                    is_shown: true,
                    constant: None,
                };
                let to = self.reserve(1, known);
                self.push(random, to, is_shared);
                match *of {
                    [a, b] => self.between(a, b, to),
                    _ => to,
                }
            }
            _ => {
                let filled = [0, 1, 2].map(|i| of.get(i).copied().unwrap_or(of[0]));
                self.emit(Operation::BuiltIn(name, filled), of, 1)
            }
        })
    }

    fn between(&mut self, a: Register, b: Register, part: Register) -> Register {
        let span = self.binary(Operator::Subtract, [b, a]);
        let along = self.binary(Operator::Multiply, [span, part]);
        self.binary(Operator::Add, [a, along])
    }

    fn fractal(&mut self, at: [Register; 2], octaves: u32) -> Option<Register> {
        self.count(octaves)?;
        Some(self.emit(Operation::Fractal { at, octaves }, &at, 1))
    }

    /// The value of a function of the file.
    fn apply(&mut self, call: &'p Call) -> Option<Register> {
        if call.module.is_some() {
            return None;
        }
        let function = &self.program.modules[self.module].functions[call.target.index?];
        let outer = self.call(call, &function.formals, Level::None)?;
        let value = self.value(&function.value)?;
        self.back(outer);
        Some(value)
    }

    /// Binds what a callee of the same file is given. Whoever calls it comes [back](Compiler::back) with what it gives.
    pub(super) fn call(&mut self, call: &'p Call, formals: &'p [Formal], level: Level) -> Option<Names> {
        if self.calls == MOST_CALLS {
            return None;
        }
        let mut bound = Vec::new();
        for (slot, given) in call.given.iter().enumerate() {
            if let Some(argument) = given.map(|i| &call.arguments[i]) {
                bound.push((slot as u32, self.value(&argument.value)?));
            }
        }
        let from = self.names.path;
        let path = self.code.paths;
        self.code.paths += 1;
        let is_shared = self.shared_paths[from as usize];
        self.shared_paths.push(is_shared);
        let site = call.site;
        self.push(Operation::Path { from, site }, path as Register, is_shared);
        let inner = Names {
            bound,
            has_stack: false,
            level: Level::None,
            path: path as Register,
        };
        let outer = std::mem::replace(&mut self.names, inner);
        self.calls += 1;
        self.levels = self.levels.max(self.calls);
        for (slot, (formal, given)) in formals.iter().zip(&call.given).enumerate() {
            if let (None, Some(default)) = (given, &formal.default) {
                let value = self.value(default)?;
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
