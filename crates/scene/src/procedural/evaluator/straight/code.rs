//! What is computed without a choice? Numbers from numbers, one operation after the other, for several turns of a loop side
//! by side. Each turn has the numbers that it would have alone: they never meet.

use super::memory::Memory;
use crate::procedural::arithmetic::floor;
use crate::procedural::evaluator::statement::MAX_LENGTH as FARTHEST;
use crate::procedural::operation::{BuiltIn, MAX_POWER, Operator, truth};
use crate::procedural::random::{mixed, share, step};
use crate::procedural::value::Value;

/// Where a number lies, with those of the other turns beside it. Each is written once.
pub(super) type Register = u16;

/// What becomes a number, or several that lie one behind the other.
#[derive(Debug, Clone, Copy)]
pub(super) enum Operation {
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
    /// From a number on, over a span.
    RandomFrom {
        path: Register,
        site: u32,
        from: Register,
        span: Register,
    },
    /// A path, not a number.
    Path {
        from: Register,
        site: u32,
        to: Register,
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
    /// The origin of a frame after a move along its axes; refuses what is too far.
    Moved {
        axes: [Register; 9],
        origin: [Register; 3],
        by: [Register; 3],
    },
    /// What becomes of two axes, the first and then the second, when a frame turns; refuses angles that are too large.
    Turned {
        axes: [[Register; 3]; 2],
        degrees: Register,
    },
}

/// Operations in their order, and where each puts what it gives.
#[derive(Debug, Default)]
pub(super) struct Code {
    pub(super) id: u32,
    /// They stay where they are put, as nothing else is written there.
    pub(super) constants: Vec<(f64, Register)>,
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
    /// Whose constants lie there.
    pub(super) constants_of: &'c mut Option<u32>,
}

impl<const N: usize> Columns<'_, N> {
    /// Goes through operations, those that are the same in every turn too when that is wanted; whether nothing is to be said
    /// about any turn.
    #[inline(always)]
    pub(super) fn compute(&mut self, code: &Code, with_shared: bool, known: &Known) -> bool {
        if self.constants_of.replace(code.id) != Some(code.id) {
            for &(number, to) in &code.constants {
                self.numbers[to as usize] = [number; N];
            }
        }
        let shared = if with_shared { &code.shared[..] } else { &[] };
        for operations in [shared, &code.each[..]] {
            for (operation, to) in operations {
                if !self.step(operation, *to, known) {
                    return false;
                }
            }
        }
        self.finite(&code.finite)
    }

    #[inline(always)]
    fn step(&mut self, operation: &Operation, to: Register, known: &Known) -> bool {
        // What an operation takes lies before what it gives.
        let (before, after) = self.numbers.split_at_mut(to as usize);
        let at = |register: Register| &before[register as usize];
        match *operation {
            Operation::Local(slot) => match known.locals[slot as usize] {
                Value::Number(number) => put(after, |_| number),
                Value::List(..) => return false,
            },
            Operation::Global(slot) => match known.globals[slot] {
                Some(Value::Number(number)) => put(after, |_| number),
                _ => return false,
            },
            Operation::Detail => put(after, |_| known.detail),
            Operation::Level => put(after, |_| known.level),
            Operation::Minus(of) => {
                let of = at(of);
                put(after, |i| -of[i]);
            }
            Operation::Not(of) => {
                let of = at(of);
                put(after, |i| truth(of[i] == 0.0));
            }
            Operation::Binary(operator, [a, b]) => binary(operator, [at(a), at(b)], after),
            Operation::BuiltIn(name @ (BuiltIn::Sin | BuiltIn::Cos), [of, ..]) => {
                let (sin, cos) = self.memory.sin_cos(at(of));
                after[0] = if name == BuiltIn::Sin { sin } else { cos };
            }
            Operation::BuiltIn(name, [a, b, c]) => return built_in(name, [at(a), at(b), at(c)], after),
            Operation::Fractal { at: [x, z], octaves } => {
                let Some(sums) = self.memory.fractal(known.seed, [at(x), at(z)], octaves) else {
                    return false;
                };
                put(after, |i| sums[i]);
            }
            Operation::Random { path, site } => after[0] = shares(&self.paths[path as usize], site),
            Operation::RandomFrom { path, site, from, span } => {
                let (from, span) = (at(from), at(span));
                let shares = shares(&self.paths[path as usize], site);
                put(after, |i| from[i] + span[i] * shares[i]);
            }
            Operation::Path { from, site, to } => {
                let from = self.paths[from as usize];
                for (path, from) in self.paths[to as usize].iter_mut().zip(from) {
                    *path = step(from, site);
                }
            }
            Operation::Check { number, range } => return all(at(number), |n| (range[0] <= n) & (n <= range[1])),
            Operation::Apart { number, from_zero } => return all(at(number), |number| number.abs() >= from_zero),
            Operation::Moved { axes, origin, by } => {
                let [x, y, z] = by.map(at);
                let mut sound = is_near(x) & is_near(y) & is_near(z);
                for (axis, after) in after.iter_mut().take(3).enumerate() {
                    let axes = [at(axes[axis]), at(axes[3 + axis]), at(axes[6 + axis])];
                    put_moved((axes, at(origin[axis])), [x, y, z], after);
                    sound &= is_near(after);
                }
                return sound;
            }
            Operation::Turned { axes, degrees } => {
                let (sin, cos) = self.memory.sin_cos(at(degrees));
                for axis in 0..3 {
                    let (u, v) = (at(axes[0][axis]), at(axes[1][axis]));
                    put(&mut after[axis..], |i| u[i] * cos[i] + v[i] * sin[i]);
                    put(&mut after[3 + axis..], |i| v[i] * cos[i] - u[i] * sin[i]);
                }
                return is_near(at(degrees));
            }
        }
        true
    }

    /// Whether all of these are finite.
    #[inline(always)]
    fn finite(&self, registers: &[Register]) -> bool {
        registers
            .iter()
            .all(|&of| all(&self.numbers[of as usize], f64::is_finite))
    }
}

#[inline(always)]
fn is_near<const N: usize>(numbers: &[f64; N]) -> bool {
    all(numbers, |number| number.abs() <= FARTHEST)
}

/// Keeps a number for each turn, in the first of these registers.
#[inline(always)]
fn put<const N: usize>(to: &mut [[f64; N]], number: impl Fn(usize) -> f64) {
    for (i, to) in to[0].iter_mut().enumerate() {
        *to = number(i);
    }
}

/// What becomes of a coordinate of a point.
#[inline(always)]
fn put_moved<const N: usize>(
    ([a, b, c], origin): ([&[f64; N]; 3], &[f64; N]),
    [x, y, z]: [&[f64; N]; 3],
    to: &mut [f64; N],
) {
    for i in 0..N {
        to[i] = a[i] * x[i] + b[i] * y[i] + c[i] * z[i] + origin[i];
    }
}

/// Random numbers, from 0 up to 1.
#[inline(always)]
fn shares<const N: usize>(paths: &[u32; N], site: u32) -> [f64; N] {
    let (mut hashes, mut shares) = ([0; N], [0.0; N]);
    for i in 0..N {
        hashes[i] = mixed(step(paths[i], site));
    }
    for i in 0..N {
        shares[i] = share(hashes[i]);
    }
    shares
}

#[inline(always)]
fn binary<const N: usize>(operator: Operator, [a, b]: [&[f64; N]; 2], to: &mut [[f64; N]]) {
    match operator {
        Operator::Add => put(to, |i| a[i] + b[i]),
        Operator::Subtract => put(to, |i| a[i] - b[i]),
        Operator::Multiply => put(to, |i| a[i] * b[i]),
        Operator::Divide => put(to, |i| a[i] / b[i]),
        _ => put(to, |i| operator.of(a[i], b[i])),
    }
}

#[inline(always)]
fn built_in<const N: usize>(name: BuiltIn, [a, b, c]: [&[f64; N]; 3], to: &mut [[f64; N]]) -> bool {
    match name {
        BuiltIn::Floor => put(to, |i| floor(a[i])),
        BuiltIn::Clamp => put(to, |i| BuiltIn::Clamp.of(a[i], b[i], c[i])),
        BuiltIn::Power if !all(b, |b| b.abs() <= MAX_POWER && b == floor(b)) => return false,
        _ => put(to, |i| name.of(a[i], b[i], c[i])),
    }
    true
}

#[inline(always)]
fn all<const N: usize>(numbers: &[f64; N], holds: impl Fn(f64) -> bool) -> bool {
    let mut all = true;
    for &number in numbers {
        all &= holds(number);
    }
    all
}
