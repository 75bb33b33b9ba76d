//! Which statements make no choice? Solids, what places and paints them, what gathers and names: where all that a visit does
//! is known beforehand, it becomes a list of solids with code that gives their numbers.

use super::code::{Code, Operation, Register};
use super::compile::{Compiler, Level};
use super::sheaf::Sheaf;
use crate::procedural::evaluator::statement::{MAX_LENGTH as FARTHEST, MIN_SCALE};
use crate::procedural::evaluator::terminal::MAX_LENGTH;
use crate::procedural::link::Program;
use crate::procedural::operation::Operator;
use crate::procedural::solid::Solid;
use crate::procedural::syntax::{At, Cost, Expr, Statement, Transform, Written};

/// Twelve numbers: x, y and z of three axes and of an origin.
pub(super) type Frame = [Register; 12];

/// Statements that are done at one go.
#[derive(Debug)]
pub(in crate::procedural::evaluator) struct Plan {
    /// The first twelve numbers are where the turtle is, then come those that the turns differ by.
    pub(super) code: Code,
    pub(super) solids: Vec<Planned>,
    /// Materials without parameters, of the same file.
    pub(super) paints: Vec<usize>,
    /// How many numbers the turns differ by.
    pub(super) inputs: usize,
    /// Whether the turtle moves.
    pub(super) moves: bool,
    /// What the visit of one turn takes.
    pub(super) cost: Cost,
    /// Calls inside each other.
    pub(super) levels: u32,
    /// What comes in place of solids.
    pub(super) tail: Option<Tail>,
}

/// A call of a part, or of a rule with `levels`, with nothing behind it.
#[derive(Debug)]
pub(super) struct Tail {
    /// Among those of the file.
    pub(super) call: usize,
    /// What it is given, in the order in which that is written.
    pub(super) arguments: Vec<Register>,
    pub(super) frame: Frame,
    /// Which of the plan's paints it wears, if not the turtle's.
    pub(super) paint: Option<usize>,
    /// Nodes around it.
    pub(super) nesting: u32,
}

/// A solid among them.
#[derive(Debug)]
pub(super) struct Planned {
    pub(super) at: At,
    pub(super) outline_at: At,
    pub(super) frame: Frame,
    /// Which of the plan's paints it wears, if not the turtle's.
    pub(super) paint: Option<usize>,
    /// In the order in which the solid takes them.
    pub(super) numbers: Vec<Register>,
    /// As it was last; numbers are put in turn by turn.
    pub(super) solid: Solid,
    /// The faces of a mesh, when all are triangles.
    pub(super) triangles: Vec<[u32; 3]>,
    /// What was placed of them last, if it was sound.
    pub(super) sheaf: Sheaf,
    pub(super) is_placed: bool,
}

/// A number for each point of a height field, by its x and z.
#[derive(Debug)]
pub(in crate::procedural::evaluator) struct Slope {
    /// The first two numbers are x and z.
    pub(super) code: Code,
    pub(super) height: Register,
    pub(super) cost: Cost,
    pub(super) levels: u32,
}

pub(super) struct Planner<'p> {
    pub(super) compiler: Compiler<'p>,
    pub(super) frame: Frame,
    pub(super) paint: Option<usize>,
    pub(super) solids: Vec<Planned>,
    paints: Vec<usize>,
    moves: bool,
    is_stretched: bool,
    tail: Option<Tail>,
}

/// What a statement does each time that it is visited, with values of its own in `slots`; nothing when that is not known.
/// Also how many nodes were looked at.
pub(super) fn plan<'p>(
    program: &'p Program,
    module: usize,
    slots: &[u32],
    statement: &'p Statement,
) -> (Option<Plan>, u32) {
    let mut compiler = Compiler::new(program, module);
    compiler.emitter.given(12, true);
    for &slot in slots {
        let register = compiler.emitter.given(1, false);
        compiler.names.bound.push((slot, register));
    }
    let mut planner = Planner {
        compiler,
        frame: std::array::from_fn(|i| i as Register),
        paint: None,
        solids: Vec::new(),
        paints: Vec::new(),
        moves: false,
        is_stretched: false,
        tail: None,
    };
    let done = planner.statement(statement);
    let (cost, levels, work) = (planner.compiler.cost, planner.compiler.levels, planner.compiler.work());
    let plan = done.map(|()| Plan {
        code: planner.compiler.emitter.finished(),
        solids: planner.solids,
        paints: planner.paints,
        inputs: slots.len(),
        moves: planner.moves,
        cost,
        levels,
        tail: planner.tail,
    });
    (plan, work)
}

/// The same for the height of a field.
pub(super) fn slope<'p>(
    program: &'p Program,
    module: usize,
    slots: [u32; 2],
    height: &'p Expr,
) -> (Option<Slope>, u32) {
    let mut compiler = Compiler::new(program, module);
    for slot in slots {
        let register = compiler.emitter.given(1, false);
        compiler.names.bound.push((slot, register));
    }
    let height = compiler.ranged(height, (-MAX_LENGTH, MAX_LENGTH));
    let (cost, levels, work) = (compiler.cost, compiler.levels, compiler.work());
    let slope = height.map(|height| Slope {
        code: compiler.emitter.finished(),
        height,
        cost,
        levels,
    });
    (slope, work)
}

impl<'p> Planner<'p> {
    /// As [`Evaluator::visit`](super::Evaluator::visit) visits it.
    fn statement(&mut self, statement: &'p Statement) -> Option<()> {
        if self.tail.is_some() {
            return None;
        }
        self.compiler.enter()?;
        match statement {
            Statement::Group { of, .. } => of.iter().try_for_each(|inner| self.statement(inner))?,
            Statement::Let { slot, value, .. } => {
                let register = self.compiler.value(&value.of)?;
                self.compiler.names.bound.push((*slot, register));
            }
            Statement::Place {
                transform, by, body, ..
            } => {
                let frame = self.placed(*transform, by)?;
                let outer = std::mem::replace(&mut self.frame, frame);
                self.statement(body)?;
                self.frame = outer;
            }
            Statement::Paint { call, body } => {
                let module = &self.compiler.program.modules[self.compiler.module];
                let call = &module.calls[*call];
                if call.module.is_some() {
                    return None;
                }
                let index = call.target.index?;
                if !module.materials[index].formals.is_empty() {
                    return None;
                }
                let paint = Some(self.paints.len());
                self.paints.push(index);
                let outer = std::mem::replace(&mut self.paint, paint);
                self.statement(body)?;
                self.paint = outer;
            }
            Statement::Call { call: number, .. } => {
                let module = &self.compiler.program.modules[self.compiler.module];
                let call = &module.calls[*number];
                if call.module.is_some() {
                    return None;
                }
                let rule = &module.rules[call.target.index?];
                if rule.is_part || rule.levels.is_some() {
                    self.tail = Some(self.ended(*number)?);
                    self.compiler.leave();
                    return Some(());
                }
                let outer = self.compiler.call(call, &rule.formals, Level::Unknown)?;
                self.statement(&rule.body)?;
                self.compiler.back(outer);
            }
            Statement::Solid {
                kind, at, arguments, ..
            } => self.solid(*at, *kind, arguments)?,
            _ => return None,
        }
        self.compiler.leave();
        Some(())
    }

    /// A call that ends it. It is worth the while when something leads to it, and of the rules that were read where they are
    /// called the traversal would know nothing.
    fn ended(&mut self, call: usize) -> Option<Tail> {
        if !self.moves || !self.solids.is_empty() || self.compiler.is_in_call() {
            return None;
        }
        let given = self.compiler.program.modules[self.compiler.module].calls[call].given();
        let arguments = given.map(|(_, argument)| self.compiler.value(&argument.value.of));
        Some(Tail {
            call,
            arguments: arguments.collect::<Option<_>>()?,
            frame: self.frame,
            paint: self.paint,
            nesting: self.compiler.nesting(),
        })
    }

    fn placed(&mut self, transform: Transform, by: &'p [Written]) -> Option<Frame> {
        self.moves = true;
        let compiler = &mut self.compiler;
        let mut numbers = [0; 3];
        for (number, written) in numbers.iter_mut().zip(by) {
            *number = compiler.number(&written.of)?;
        }
        let mut frame = self.frame;
        let mut inputs = self.frame.to_vec();
        inputs.extend(&numbers[..by.len()]);
        let axis = |axis: usize| std::array::from_fn(|i| self.frame[3 * axis + i]);
        let mut put = |compiler: &mut Compiler, places: &[usize], first: Register| {
            for (&place, register) in places.iter().zip(first..) {
                frame[place] = register;
                compiler.emitter.shown(&[register]);
            }
        };
        // Axes keep their length when they turn; once they are stretched, they are measured.
        let is_stretched = self.is_stretched;
        let mut turned = |compiler: &mut Compiler, about: usize| {
            let (from, to) = ((about + 1) % 3, (about + 2) % 3);
            let axes = [axis(from), axis(to)];
            let degrees = numbers[0];
            let first = compiler.emitter.emit(Operation::Turned { axes, degrees }, &inputs, 6);
            let places = [from, to].map(|axis| [3 * axis, 3 * axis + 1, 3 * axis + 2]);
            compiler.emitter.shown(&[degrees]);
            put(compiler, places.as_flattened(), first);
            if is_stretched {
                (first..first + 6).for_each(|number| compiler.emitter.within(number, (-FARTHEST, FARTHEST)));
            }
        };
        match transform {
            Transform::Turn => turned(compiler, 1),
            Transform::Tilt => turned(compiler, 0),
            Transform::Roll => turned(compiler, 2),
            Transform::Move => {
                let axes = std::array::from_fn(|i| self.frame[i]);
                let moved = Operation::Moved {
                    axes,
                    origin: axis(3),
                    by: numbers,
                };
                let first = compiler.emitter.emit(moved, &inputs, 3);
                compiler.emitter.shown(&numbers);
                put(compiler, &[9, 10, 11], first);
            }
            Transform::Scale => {
                let factors = if by.len() == 1 { [numbers[0]; 3] } else { numbers };
                for number in factors {
                    compiler.emitter.within(number, (-FARTHEST, FARTHEST));
                    compiler.emitter.apart(number, MIN_SCALE);
                }
                self.is_stretched = true;
                for place in 0..9 {
                    let register = compiler
                        .emitter
                        .binary(Operator::Multiply, [self.frame[place], factors[place / 3]]);
                    compiler.emitter.within(register, (-FARTHEST, FARTHEST));
                    put(compiler, &[place], register);
                }
            }
        }
        Some(frame)
    }
}
