//! What is computed without a choice? Numbers from numbers, one operation after the other, for several turns of a loop side
//! by side. Each turn has the numbers that it would have alone: they never meet.

use super::memory::Memory;
use crate::procedural::arithmetic::{floor, sin_cos_of_each};
use crate::procedural::operation::{BuiltIn, MAX_POWER, Operator, random, truth};
use crate::procedural::random::step;
use crate::procedural::value::Value;

/// Where a number lies, with those of the other turns beside it. Each is written once.
pub(super) type Register = u16;

/// What becomes a number, or several that lie one behind the other.
#[derive(Debug, Clone, Copy)]
pub(super) enum Operation {
    Constant(f64),
    /// A value of the rule, which must be a number.
    Local(u32),
    /// The same of the file.
    Global(usize),
    Detail,
    Level,
    Minus(Register),
    Not(Register),
    Binary(Operator, [Register; 2]),
    /// Of those that need nothing but numbers.
    BuiltIn(BuiltIn, [Register; 3]),
    Fractal {
        at: [Register; 2],
        octaves: u32,
    },
    /// From 0 up to 1.
    Random {
        path: Register,
        site: u32,
    },
    /// A path, not a number.
    Path {
        from: Register,
        site: u32,
    },
    /// Refuses what is out of range.
    Check {
        number: Register,
        range: [f64; 2],
    },
    /// Refuses what is nearer to zero.
    Apart {
        number: Register,
        from_zero: f64,
    },
    /// The origin of a frame after a move along its axes.
    Moved {
        axes: [Register; 9],
        origin: [Register; 3],
        by: [Register; 3],
    },
    /// What becomes of two axes, the first and then the second, when a frame turns.
    Turned {
        axes: [[Register; 3]; 2],
        degrees: Register,
    },
}

/// Operations in their order, and where each puts what it gives.
#[derive(Debug, Default)]
pub(super) struct Code {
    /// What is the same in every turn.
    pub(super) shared: Vec<(Operation, Register)>,
    pub(super) each: Vec<(Operation, Register)>,
    /// What shows whether all numbers were finite.
    pub(super) finite: Vec<Register>,
    pub(super) registers: usize,
    pub(super) paths: usize,
}

/// What code may ask for.
pub(super) struct Known<'k> {
    pub(super) locals: &'k [Value],
    pub(super) globals: &'k [Option<Value>],
    pub(super) level: f64,
    pub(super) detail: f64,
    pub(super) seed: u32,
}

/// What has been computed for `N` turns.
pub(super) struct Columns<'c, const N: usize> {
    pub(super) numbers: &'c mut [[f64; N]],
    pub(super) paths: &'c mut [[u32; N]],
    pub(super) memory: &'c mut Memory,
}

impl<const N: usize> Columns<'_, N> {
    /// Goes through operations; whether nothing is to be said about any turn.
    pub(super) fn run(&mut self, operations: &[(Operation, Register)], known: &Known) -> bool {
        operations
            .iter()
            .all(|&(operation, to)| self.step(operation, to, known))
    }

    #[inline]
    fn step(&mut self, operation: Operation, to: Register, known: &Known) -> bool {
        match operation {
            Operation::Constant(number) => self.put(to, |_| number),
            Operation::Local(slot) => match known.locals[slot as usize] {
                Value::Number(number) => self.put(to, |_| number),
                Value::List(..) => false,
            },
            Operation::Global(slot) => match known.globals[slot] {
                Some(Value::Number(number)) => self.put(to, |_| number),
                _ => false,
            },
            Operation::Detail => self.put(to, |_| known.detail),
            Operation::Level => self.put(to, |_| known.level),
            Operation::Minus(of) => {
                let of = self.at(of);
                self.put(to, |i| -of[i])
            }
            Operation::Not(of) => {
                let of = self.at(of);
                self.put(to, |i| truth(of[i] == 0.0))
            }
            Operation::Binary(operator, [a, b]) => self.binary(operator, [self.at(a), self.at(b)], to),
            Operation::BuiltIn(name, [a, b, c]) => self.built_in(name, [self.at(a), self.at(b), self.at(c)], to),
            Operation::Fractal { at: [x, z], octaves } => {
                let places = [self.at(x), self.at(z)];
                let sums = self.memory.fractal(known.seed, places, octaves);
                sums.is_some_and(|sums| self.put(to, |i| sums[i]))
            }
            Operation::Random { path, site } => {
                let paths = self.paths[path as usize];
                self.put(to, |i| random(paths[i], site))
            }
            Operation::Path { from, site } => {
                let from = self.paths[from as usize];
                for (path, from) in self.paths[to as usize].iter_mut().zip(from) {
                    *path = step(from, site);
                }
                true
            }
            Operation::Check { number, range } => all(self.at(number), |n| range[0] <= n && n <= range[1]),
            Operation::Apart { number, from_zero } => all(self.at(number), |number| number.abs() >= from_zero),
            Operation::Moved { axes, origin, by } => {
                let (x, y, z) = (self.at(by[0]), self.at(by[1]), self.at(by[2]));
                for axis in 0..3 {
                    let (a, b, c) = (self.at(axes[axis]), self.at(axes[3 + axis]), self.at(axes[6 + axis]));
                    let from = self.at(origin[axis]);
                    let moved = |i: usize| a[i] * x[i] + b[i] * y[i] + c[i] * z[i] + from[i];
                    self.put(to + axis as Register, moved);
                }
                true
            }
            Operation::Turned { axes, degrees } => {
                let (sin, cos) = sin_cos_of_each(self.at(degrees));
                for axis in 0..3 {
                    let (u, v) = (self.at(axes[0][axis]), self.at(axes[1][axis]));
                    self.put(to + axis as Register, |i| u[i] * cos[i] + v[i] * sin[i]);
                    self.put(to + 3 + axis as Register, |i| v[i] * cos[i] - u[i] * sin[i]);
                }
                true
            }
        }
    }

    #[inline(always)]
    fn at(&self, register: Register) -> [f64; N] {
        self.numbers[register as usize]
    }

    /// Keeps a number for each turn.
    #[inline(always)]
    fn put(&mut self, to: Register, number: impl Fn(usize) -> f64) -> bool {
        let to = &mut self.numbers[to as usize];
        for i in 0..N {
            to[i] = number(i);
        }
        true
    }

    /// Whether all of these are finite.
    pub(super) fn finite(&self, registers: &[Register]) -> bool {
        registers.iter().all(|&of| all(self.at(of), f64::is_finite))
    }

    #[inline(always)]
    fn binary(&mut self, operator: Operator, [a, b]: [[f64; N]; 2], to: Register) -> bool {
        match operator {
            Operator::Add => self.put(to, |i| a[i] + b[i]),
            Operator::Subtract => self.put(to, |i| a[i] - b[i]),
            Operator::Multiply => self.put(to, |i| a[i] * b[i]),
            Operator::Divide => self.put(to, |i| a[i] / b[i]),
            _ => self.put(to, |i| operator.of(a[i], b[i])),
        }
    }

    #[inline(always)]
    fn built_in(&mut self, name: BuiltIn, [a, b, c]: [[f64; N]; 3], to: Register) -> bool {
        match name {
            BuiltIn::Sin => {
                let (sin, _) = sin_cos_of_each(a);
                self.put(to, |i| sin[i])
            }
            BuiltIn::Cos => {
                let (_, cos) = sin_cos_of_each(a);
                self.put(to, |i| cos[i])
            }
            BuiltIn::Power if !all(b, |b| b.abs() <= MAX_POWER && b == floor(b)) => false,
            _ => self.put(to, |i| name.of(a[i], b[i], c[i])),
        }
    }
}

#[inline(always)]
fn all<const N: usize>(numbers: [f64; N], holds: impl Fn(f64) -> bool) -> bool {
    let mut all = true;
    for number in numbers {
        all &= holds(number);
    }
    all
}
