//! Where does a number come to lie? Operations are put one behind the other, those that are the same in every turn apart;
//! what is known of each number is kept, so that nothing is computed or checked twice.

use super::code::{Code, Operation, Register};
use crate::procedural::operation::Operator;

/// As many operations are looked at to find one that does the same.
const MOST_COMPARED: usize = 64;

#[derive(Debug, Clone, Copy)]
struct Number {
    /// Whether it is the same in every turn.
    is_shared: bool,
    /// Whether something else shows that it is finite.
    is_shown: bool,
    constant: Option<f64>,
}

/// Code that is being written.
#[derive(Debug)]
pub(super) struct Emitter {
    code: Code,
    numbers: Vec<Number>,
    /// Whether each path is the same in every turn.
    shared_paths: Vec<bool>,
}

impl Emitter {
    pub(super) fn new() -> Self {
        Self {
            code: Code::default(),
            numbers: Vec::new(),
            shared_paths: vec![false],
        }
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
        self.code.paths = self.shared_paths.len();
        self.code
    }

    fn reserve(&mut self, count: usize, known: Number) -> Register {
        let first = self.numbers.len();
        self.numbers.resize(first + count, known);
        first as Register
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

    /// Where an operation on these puts what it gives, when there is such a one not far before.
    fn known_before(&self, of: &[Register], is_same: impl Fn(&Operation) -> bool) -> Option<Register> {
        let is_shared = of.iter().all(|&of| self.numbers[of as usize].is_shared);
        let code = if is_shared { &self.code.shared } else { &self.code.each };
        let mut near = code.iter().rev().take(MOST_COMPARED);
        near.find(|(known, _)| is_same(known)).map(|(_, to)| *to)
    }

    /// What gives no number; it may take any so far.
    fn demand(&mut self, operation: Operation, is_shared: bool) {
        self.push(operation, self.numbers.len() as Register, is_shared);
    }

    /// What is there before anything is computed, once.
    pub(super) fn load(&mut self, operation: Operation, is_same: impl Fn(&Operation) -> bool) -> Register {
        if let Some((_, known)) = self.code.shared.iter().find(|(known, _)| is_same(known)) {
            return *known;
        }
        let to = self.loaded(None);
        self.push(operation, to, true);
        to
    }

    fn loaded(&mut self, constant: Option<f64>) -> Register {
        let known = Number {
            is_shared: true,
            is_shown: true,
            constant,
        };
        self.reserve(1, known)
    }

    pub(super) fn constant(&mut self, number: f64) -> Register {
        let bits = number.to_bits();
        if let Some((_, known)) = self.code.constants.iter().find(|(known, _)| known.to_bits() == bits) {
            return *known;
        }
        let to = self.loaded(Some(number));
        self.code.constants.push((number, to));
        to
    }

    /// That something else is not finite when these are not.
    pub(super) fn shown(&mut self, registers: &[Register]) {
        registers
            .iter()
            .for_each(|&of| self.numbers[of as usize].is_shown = true);
    }

    /// A number that is not too near to zero.
    pub(super) fn apart(&mut self, number: Register, from_zero: f64) {
        let is_shared = self.numbers[number as usize].is_shared;
        self.demand(Operation::Apart { number, from_zero }, is_shared);
    }

    /// What is within a range. Of parts of the same number, as points of a shape are, the whole is looked at once; where that is
    /// too much, though its parts are not, the nodes are visited one by one.
    pub(super) fn within(&mut self, number: Register, (min, max): (f64, f64)) {
        let whole = self.whole_of(number).filter(|_| min == -max);
        let number = match whole {
            Some(whole) => {
                self.shown(&[number]);
                whole
            }
            None => number,
        };
        let known = self.numbers[number as usize];
        let range = [min, max];
        let is_same = |known: &Operation| matches!(known, Operation::Check { number: n, range: r } if (*n, *r) == (number, range));
        let is_constant = known.constant.is_some_and(|own| min <= own && own <= max);
        if !is_constant && self.known_before(&[number], is_same).is_none() {
            self.demand(Operation::Check { number, range }, known.is_shared);
        }
        self.shown(&[number]);
    }

    /// What a number is a constant part of.
    fn whole_of(&self, number: Register) -> Option<Register> {
        let is_shared = self.numbers[number as usize].is_shared;
        let code = if is_shared { &self.code.shared } else { &self.code.each };
        let mut near = code.iter().rev().take(MOST_COMPARED);
        let (made, _) = near.find(|(_, to)| *to == number)?;
        let is_part = |of: Register| self.numbers[of as usize].constant.is_some_and(|part| part.abs() <= 1.0);
        match *made {
            Operation::Binary(Operator::Multiply, [a, b]) if is_part(a) => Some(b),
            Operation::Binary(Operator::Multiply, [a, b]) if is_part(b) => Some(a),
            _ => None,
        }
    }

    pub(super) fn binary(&mut self, operator: Operator, sides: [Register; 2]) -> Register {
        if let [Some(a), Some(b)] = sides.map(|side| self.numbers[side as usize].constant)
            && operator.of(a, b).is_finite()
        {
            return self.constant(operator.of(a, b));
        }
        if let (Operator::Multiply, [a, b]) = (operator, sides) {
            // Once a number stays what it is.
            match sides.map(|side| self.numbers[side as usize].constant) {
                [_, Some(1.0)] => return a,
                [Some(1.0), _] => return b,
                _ => {}
            }
        }
        match operator {
            Operator::Add | Operator::Subtract | Operator::Multiply => self.shown(&sides),
            Operator::Divide => self.shown(&sides[..1]),
            _ => {}
        }
        let is_same = |known: &Operation| matches!(known, Operation::Binary(o, s) if (*o, *s) == (operator, sides));
        match self.known_before(&sides, is_same) {
            Some(register) => register,
            None => self.emit(Operation::Binary(operator, sides), &sides, 1),
        }
    }

    pub(super) fn between(&mut self, a: Register, b: Register, part: Register) -> Register {
        let span = self.binary(Operator::Subtract, [b, a]);
        let along = self.binary(Operator::Multiply, [span, part]);
        self.binary(Operator::Add, [a, along])
    }

    /// The number itself, where it is written out.
    pub(super) fn known(&self, number: Register) -> Option<f64> {
        self.numbers[number as usize].constant
    }

    /// A random number of a place.
    pub(super) fn random(&mut self, path: Register, site: u32) -> Register {
        let to = self.drawn(Operation::Random { path, site }, self.shared_paths[path as usize]);
        self.shown(&[to]);
        to
    }

    /// The same between two numbers.
    pub(super) fn random_between(&mut self, path: Register, site: u32, [a, b]: [Register; 2]) -> Register {
        let span = self.binary(Operator::Subtract, [b, a]);
        self.shown(&[a, span]);
        let is_shared = [a, span].iter().all(|&of| self.numbers[of as usize].is_shared);
        let from = Operation::RandomFrom {
            path,
            site,
            from: a,
            span,
        };
        self.drawn(from, is_shared && self.shared_paths[path as usize])
    }

    fn drawn(&mut self, operation: Operation, is_shared: bool) -> Register {
        let known = Number {
            is_shared,
            is_shown: false,
            constant: None,
        };
        let to = self.reserve(1, known);
        self.push(operation, to, is_shared);
        to
    }

    /// The path behind a call.
    pub(super) fn path(&mut self, from: Register, site: u32) -> Register {
        let to = self.shared_paths.len() as Register;
        let is_shared = self.shared_paths[from as usize];
        self.shared_paths.push(is_shared);
        self.demand(Operation::Path { from, site, to }, is_shared);
        to
    }
}
