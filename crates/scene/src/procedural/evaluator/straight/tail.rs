//! Where does the traversal go on? Where a statement ends with a call of a part, or of a rule with `levels` as each branch of a tree
//! does, all that leads there is computed for several turns side by side. Then the calls are followed, one after the other.

use std::ops::Range;

use super::plan::Plan;
use super::{NARROW, Planning, Turns, WIDE, is_too_far};
use crate::procedural::affine::Affine;
use crate::procedural::evaluator::{Evaluator, Outcome, Scope, Turtle};
use crate::procedural::value::Value;

/// Twelve numbers of a frame.
const FRAME: usize = 12;

impl<'p> Evaluator<'p> {
    /// Visits a statement that ends with a call in the turns of a loop; how many of them are done. It may be visited again by
    /// what it calls, so that its plan is put back before.
    pub(super) fn tails(
        &mut self,
        scope: &Scope,
        (turtle, materials): (&Turtle, &[usize]),
        (id, mut plan): (u32, Box<Plan>),
        turns: &Turns,
    ) -> Outcome<usize> {
        let before = self.plans.ahead.len();
        let mut done = 0;
        loop {
            let count = match turns.count - done {
                1 => self.look_ahead::<1>(scope, turtle, &mut plan, (turns, done)),
                2..=NARROW => self.look_ahead::<NARROW>(scope, turtle, &mut plan, (turns, done)),
                _ => self.look_ahead::<WIDE>(scope, turtle, &mut plan, (turns, done)),
            };
            let (Some(count), Some(tail)) = (count, &plan.tail) else {
                return Ok(done);
            };
            let material = tail.paint.map_or(turtle.material, |paint| materials[paint]);
            let (call, nesting, row) = (tail.call, tail.nesting, FRAME + tail.arguments.len());
            let (cost, levels) = (plan.cost, plan.levels);
            self.plans.put(scope.module, id, Planning::Ready(plan));
            for turn in 0..count {
                let Some((steps, most_nesting, levels)) = self.affordable(scope, cost, levels, 1) else {
                    self.plans.ahead.truncate(before);
                    return Ok(done);
                };
                self.pay(steps, most_nesting, levels);
                let first = before + turn * row;
                let frame = std::array::from_fn(|i| self.plans.ahead[first + i]);
                let frame = Affine::of_numbers(frame);
                let path = turns.path_of(scope, done);
                let arguments = first + FRAME..first + row;
                self.nesting += nesting;
                self.follow_with(&Scope { path, ..*scope }, &Turtle { frame, material }, call, arguments)?;
                self.nesting -= nesting;
                done += 1;
            }
            self.plans.ahead.truncate(before);
            if done == turns.count {
                return Ok(done);
            }
            plan = match self.plans.take(scope.module, id) {
                Planning::Ready(plan) => plan,
                _ => return Ok(done),
            };
        }
    }

    /// Computes where some turns lead, from one on, and with what arguments; how many, if nothing is amiss with them.
    fn look_ahead<const N: usize>(
        &mut self,
        scope: &Scope,
        turtle: &Turtle,
        plan: &mut Plan,
        (turns, first): (&Turns, usize),
    ) -> Option<usize> {
        let count = N.min(turns.count - first);
        if is_too_far(plan, turtle) {
            return None;
        }
        let mut room = self.plans.room.take().unwrap_or_default();
        let mut columns = room.columns::<N>(&plan.code);
        let range = first..first + count;
        let is_sound = self.compute_turns((scope, turtle), &mut columns, (plan, true), (turns, range));
        if let Some(tail) = plan.tail.as_ref().filter(|_| is_sound) {
            for turn in 0..count {
                let registers = tail.frame.iter().chain(&tail.arguments);
                let numbers = registers.map(|&register| columns.numbers[register as usize][turn]);
                self.plans.ahead.extend(numbers);
            }
        }
        self.plans.room = Some(room);
        is_sound.then_some(count)
    }

    /// Visits the rule that a call leads to, with arguments that were computed ahead.
    fn follow_with(&mut self, scope: &Scope, turtle: &Turtle, call: usize, arguments: Range<usize>) -> Outcome<()> {
        let call = &self.program.modules[scope.module].calls[call];
        let depth = self.deeper(scope, call.at)?;
        let index = call.target.index.unwrap_or_default();
        let rule = self.rule(call.target.module, index);
        let inner = self.scope_of((scope, call), depth)?;
        self.open_frame(inner.base, rule.slots);
        for ((slot, _), number) in call.given().zip(arguments) {
            self.stack[inner.base + slot] = Value::Number(self.plans.ahead[number]);
        }
        self.bind_defaults((scope, call), &inner, &rule.formals)?;
        self.go_on((scope, call.at), turtle, (rule, index), inner)
    }
}
