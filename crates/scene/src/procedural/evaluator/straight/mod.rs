//! What is done at one go? Statements that make no choice, for several turns of a loop side by side: most of what rules draw
//! is that, leaves of a spray, windows of a wall, the heights of a field. When the traversal first comes to such a statement
//! it becomes a [`Plan`] ([`mod@plan`], [`solids`]): a list of solids, and the operations that give their numbers ([`code`]), made
//! of its expressions ([`compile`], [`emit`]). [`fill`] puts the numbers in, [`sheaf`] places triangles of all turns at once,
//! both with [`mod@widest`] vectors, [`added`] hands them on, [`memory`] keeps what is asked for again, and [`mod@kept`] the plans. Branches carry branches: what leads to a part
//! or to a rule with `levels` is done at one go too, and [`tail`] goes on from there.
//!
//! It is known beforehand what such a visit takes, so limits are asked once for all of it. Where anything is amiss nothing
//! has been done: the nodes are visited one by one, and that says what and where.

mod added;
mod code;
mod compile;
mod emit;
mod fill;
mod kept;
mod memory;
mod plan;
mod sheaf;
mod solids;
mod tail;
#[cfg(test)]
mod tests;
mod widest;

use std::ops::Range;

use code::{Code, Columns, Known};
pub(in crate::procedural) use kept::Kept;
use memory::Memory;
use plan::{Plan, Slope, plan, slope};
use widest::compute;

use super::statement::MAX_LENGTH as FARTHEST;
use super::{Evaluator, Outcome, Scope, Turtle};
use crate::Bounds;
use crate::procedural::random::step;
use crate::procedural::syntax::{Cost, Expr, Statement};
use crate::procedural::value::Value;

/// Most nodes of a model that are looked at to make plans: so that a text of many rules that call each other takes no longer.
const MOST_WORK: u32 = 1 << 20;
/// As many turns are computed side by side, at most.
const WIDE: usize = 8;
/// The same for loops of few turns.
const NARROW: usize = 4;
/// The same for loops of some more.
const WIDEST: usize = 12;
/// Longest axes along x, y and z with which a turtle may turn: as it turns, none gets beyond [`FARTHEST`].
const LONGEST: f64 = 1e8;

/// What became of a statement.
#[derive(Debug, Default)]
pub(super) enum Planning {
    #[default]
    Untried,
    /// It makes choices.
    Refused,
    /// It is being visited, or something was amiss with a visit.
    Amiss,
    Ready(Box<Plan>),
    Field(Box<Slope>),
}

/// Plans, and room to compute in.
#[derive(Debug, Default)]
pub(in crate::procedural) struct Plans {
    /// For each module one for each statement that may have one.
    of: Vec<Vec<Planning>>,
    work: u32,
    made: u32,
    /// Missing while something is computed in it.
    room: Option<Box<Room>>,
    /// Numbers of turns that the traversal has yet to come to; those of inner loops behind those of outer ones.
    ahead: Vec<f64>,
}

/// Room to compute in.
#[derive(Debug, Default)]
struct Room {
    /// For each number of turns side by side.
    numbers: [Numbers; 4],
    paths: Vec<u32>,
    memory: Memory,
}

/// Room for numbers, and whose constants lie there.
#[derive(Debug, Default)]
struct Numbers {
    of: Vec<f64>,
    constants_of: Option<u32>,
}

impl Room {
    fn columns<const N: usize>(&mut self, code: &Code) -> Columns<'_, N> {
        let Self { numbers, paths, memory } = self;
        let Numbers {
            of: numbers,
            constants_of,
        } = match N {
            1 => &mut numbers[0],
            2..=NARROW => &mut numbers[1],
            5..=WIDE => &mut numbers[2],
            _ => &mut numbers[3],
        };
        numbers.resize(numbers.len().max(N * code.registers), 0.0);
        paths.resize(paths.len().max(N * code.paths), 0);
        Columns {
            numbers: numbers.as_chunks_mut().0,
            paths: paths.as_chunks_mut().0,
            memory,
            constants_of,
        }
    }
}

/// The turns of a loop.
pub(super) struct Turns<'t> {
    pub(super) count: usize,
    /// The path of turn 0 and on comes from this, by the number of the turn; that of the scope when there is no loop.
    pub(super) path: Option<u32>,
    pub(super) given: Given<'t>,
}

/// What a turn gives to each slot.
#[derive(Debug, Clone, Copy)]
pub(super) enum Given<'t> {
    /// Its number.
    Number,
    /// An item, which is a number, or a list of one for each slot.
    Items(&'t [Value]),
}

impl Turns<'_> {
    fn path_of(&self, scope: &Scope, turn: usize) -> u32 {
        self.path.map_or(scope.path, |path| step(path, turn as u32))
    }
}

/// What an item of a list gives to a slot.
fn number_of(item: &Value, slot: usize) -> f64 {
    match item {
        Value::Number(number) => *number,
        Value::List(items, _) => number_of(&items[slot], 0),
    }
}

/// Whether a plan may lead out of reach from where the turtle is.
fn is_too_far(plan: &Plan, turtle: &Turtle) -> bool {
    let frame = turtle.frame.numbers();
    let is_near =
        frame[..9].iter().all(|along| along.abs() <= LONGEST) && frame[9..].iter().all(|along| along.abs() <= FARTHEST);
    plan.moves && !is_near
}

impl Plans {
    pub(super) fn new(counts: impl Iterator<Item = u32>) -> Self {
        let untried = |count: u32| (0..count).map(|_| Planning::Untried).collect();
        Self {
            of: counts.map(untried).collect(),
            ..Self::default()
        }
    }

    /// Tells its code from all others.
    fn named<P>(&mut self, mut plan: P, code: impl FnOnce(&mut P) -> &mut Code) -> P {
        code(&mut plan).id = self.made;
        self.made += 1;
        plan
    }

    fn take(&mut self, module: usize, id: u32) -> Planning {
        std::mem::replace(&mut self.of[module][id as usize], Planning::Amiss)
    }

    fn put(&mut self, module: usize, id: u32, planning: Planning) {
        self.of[module][id as usize] = planning;
    }
}

impl<'p> Evaluator<'p> {
    /// Visits a statement; whether that was possible.
    pub(super) fn at_once(&mut self, scope: &Scope, turtle: &Turtle, id: u32, of: &'p Statement) -> Outcome<bool> {
        if matches!(
            self.plans.of[scope.module][id as usize],
            Planning::Refused | Planning::Amiss
        ) {
            return Ok(false);
        }
        let turns = Turns {
            count: 1,
            path: None,
            given: Given::Number,
        };
        Ok(self.turns(scope, turtle, (id, &[], of), &turns)? == 1)
    }

    /// Visits a statement in the turns of a loop; how many of them are done.
    pub(super) fn turns(
        &mut self,
        scope: &Scope,
        turtle: &Turtle,
        (id, slots, of): (u32, &[u32], &'p Statement),
        turns: &Turns,
    ) -> Outcome<usize> {
        if turns.count == 0 {
            return Ok(0);
        }
        let mut made = match self.plans.take(scope.module, id) {
            Planning::Ready(plan) => plan,
            Planning::Untried if self.plans.work < MOST_WORK => {
                let (plan, work) = plan(self.program, scope.module, slots, of);
                let plan = plan.map(|plan| self.plans.named(plan, |plan| &mut plan.code));
                self.plans.work += work;
                match plan {
                    Some(plan) => Box::new(plan),
                    None => {
                        self.plans.put(scope.module, id, Planning::Refused);
                        return Ok(0);
                    }
                }
            }
            other => {
                self.plans.put(scope.module, id, other);
                return Ok(0);
            }
        };
        let Some(materials) = self.known_paints(scope, &made.paints) else {
            self.plans.put(scope.module, id, Planning::Ready(made));
            return Ok(0);
        };
        let place = (turtle, &materials[..]);
        if made.tail.is_some() {
            return self.tails(scope, place, (id, made), turns);
        }
        // Whole rows of turns, then what is left over; what one row can hold is done in one.
        let whole = if turns.count <= WIDEST {
            0
        } else {
            turns.count - turns.count % WIDE
        };
        let mut done = self.chunks::<WIDE>(scope, place, &mut made, (turns, 0..whole))?;
        if done == whole {
            let left = (turns, done..turns.count);
            done = match turns.count - whole {
                0 => done,
                1 => self.chunks::<1>(scope, place, &mut made, left)?,
                2..=NARROW => self.chunks::<NARROW>(scope, place, &mut made, left)?,
                5..=WIDE => self.chunks::<WIDE>(scope, place, &mut made, left)?,
                _ => self.chunks::<WIDEST>(scope, place, &mut made, left)?,
            };
        }
        if done == turns.count {
            self.plans.put(scope.module, id, Planning::Ready(made));
        }
        Ok(done)
    }

    /// Those that have been computed before.
    fn known_paints(&self, scope: &Scope, paints: &[usize]) -> Option<Vec<usize>> {
        let known = &self.instances[scope.instance].surfaces;
        paints.iter().map(|&paint| known[paint]).collect()
    }

    /// Some of them, `N` at a time; before which turn that ended.
    fn chunks<const N: usize>(
        &mut self,
        scope: &Scope,
        (turtle, materials): (&Turtle, &[usize]),
        plan: &mut Plan,
        (turns, range): (&Turns, Range<usize>),
    ) -> Outcome<usize> {
        if range.is_empty() || is_too_far(plan, turtle) {
            return Ok(range.start);
        }
        let mut room = self.plans.room.take().unwrap_or_default();
        let mut columns = room.columns::<N>(&plan.code);
        let mut done = range.start;
        while done < range.end {
            let count = N.min(range.end - done);
            let Some((steps, nesting, levels)) = self.affordable(scope, plan.cost, plan.levels, count) else {
                break;
            };
            let is_first = done == range.start;
            if !self.compute_turns(
                (scope, turtle),
                &mut columns,
                (plan, is_first),
                (turns, done..done + count),
            ) {
                break;
            }
            let before = self.usage.steps;
            self.pay(steps, nesting, levels);
            let alone = match &plan.solids[..] {
                [planned] if planned.is_placed => Some(planned),
                _ => None,
            };
            if let Some(planned) = alone.filter(|planned| self.has_room(planned, count)) {
                let place_of = (scope, planned.at, planned.outline_at);
                let material = planned.paint.map_or(turtle.material, |paint| materials[paint]);
                self.add_sheaf(place_of, material, planned, 0..count)?;
                done += count;
                continue;
            }
            for place in 0..count {
                let triangles = self.usage.triangles;
                if self
                    .add_turn((scope, turtle, materials), &mut plan.solids, &columns, place)
                    .is_err()
                {
                    // What its nodes say of it, visited one by one, names the calls that led there too.
                    self.usage.triangles = triangles;
                    self.usage.steps = before + u64::from(plan.cost.steps) * place as u64;
                    self.plans.room = Some(room);
                    return Ok(done + place);
                }
            }
            done += count;
        }
        self.plans.room = Some(room);
        Ok(done)
    }

    /// Computes what some turns have in common, when they are the first, and what they have of their own; whether nothing is
    /// amiss with any of them.
    fn compute_turns<const N: usize>(
        &self,
        (scope, turtle): (&Scope, &Turtle),
        columns: &mut Columns<N>,
        (plan, are_first): (&mut Plan, bool),
        (turns, range): (&Turns, Range<usize>),
    ) -> bool {
        let frame = turtle.frame.numbers();
        if are_first {
            for (column, number) in columns.numbers.iter_mut().zip(frame) {
                *column = [number; N];
            }
        }
        // Places that are left over do what the last turn does.
        let (first, last) = (range.start as u32, range.end as u32 - 1);
        let here: [u32; N] = std::array::from_fn(|place| last.min(first + place as u32));
        for (slot, numbers) in columns.numbers[frame.len()..][..plan.inputs].iter_mut().enumerate() {
            *numbers = match turns.given {
                // As signed numbers they are known to every processor.
                Given::Number => here.map(|turn| f64::from(turn as i32)),
                Given::Items(items) => here.map(|turn| number_of(&items[turn as usize], slot)),
            };
        }
        columns.paths[0] = match turns.path {
            Some(path) => here.map(|turn| step(path, turn)),
            None => [scope.path; N],
        };
        let to_place = if self.measuring { &mut [] } else { &mut plan.solids[..] };
        let bounds = &self.parts[self.part].bounds;
        compute(columns, (&plan.code, are_first), &self.known(scope), (to_place, bounds))
    }

    /// Heights of a field at so many x of a row; whether that was possible.
    pub(super) fn row(
        &mut self,
        scope: &Scope,
        (id, slots, height): (u32, [u32; 2], &'p Expr),
        (x, z): (impl Fn(u32) -> f64, f64),
        (count, heights): (u32, &mut Vec<f64>),
    ) -> bool {
        let mut made = match self.plans.take(scope.module, id) {
            Planning::Field(slope) => slope,
            Planning::Untried if self.plans.work < MOST_WORK => {
                let (slope, work) = slope(self.program, scope.module, slots, height);
                let slope = slope.map(|slope| self.plans.named(slope, |slope| &mut slope.code));
                self.plans.work += work;
                match slope {
                    Some(slope) => Box::new(slope),
                    None => {
                        self.plans.put(scope.module, id, Planning::Refused);
                        return false;
                    }
                }
            }
            other => {
                self.plans.put(scope.module, id, other);
                return false;
            }
        };
        let is_done = self.row_at_once(scope, &mut made, (x, z), (count, heights));
        if is_done {
            self.plans.put(scope.module, id, Planning::Field(made));
        }
        is_done
    }

    fn row_at_once(
        &mut self,
        scope: &Scope,
        slope: &mut Slope,
        (x, z): (impl Fn(u32) -> f64, f64),
        (count, heights): (u32, &mut Vec<f64>),
    ) -> bool {
        let Some((steps, nesting, levels)) = self.affordable(scope, slope.cost, slope.levels, count as usize) else {
            return false;
        };
        let mut room = self.plans.room.take().unwrap_or_default();
        let mut columns = room.columns::<WIDE>(&slope.code);
        let known = self.known(scope);
        columns.numbers[1] = [z; WIDE];
        columns.paths[0] = [scope.path; WIDE];
        let before = heights.len();
        let mut is_sound = true;
        for first in (0..count).step_by(WIDE) {
            let here = (WIDE as u32).min(count - first);
            columns.numbers[0] = std::array::from_fn(|place| x(first + (place as u32).min(here - 1)));
            is_sound = compute(
                &mut columns,
                (&slope.code, first == 0),
                &known,
                (&mut [], &Bounds::EMPTY),
            );
            if !is_sound {
                heights.truncate(before);
                break;
            }
            heights.extend_from_slice(&columns.numbers[slope.height as usize][..here as usize]);
        }
        if is_sound {
            self.pay(steps, nesting, levels);
        }
        self.plans.room = Some(room);
        is_sound
    }

    fn known<'k>(&'k self, scope: &Scope) -> Known<'k> {
        Known {
            locals: &self.stack[scope.base..],
            globals: &self.instances[scope.instance].values,
            level: scope.level.into(),
            detail: self.settings.detail.into(),
            seed: self.settings.seed,
        }
    }

    /// What was taken when a visit of so many turns is paid, steps, nesting and levels; nothing when that is too much.
    fn affordable(&self, scope: &Scope, cost: Cost, levels: u32, turns: usize) -> Option<(u64, u32, u32)> {
        let limits = &self.settings.limits;
        let steps = self.usage.steps.saturating_add(u64::from(cost.steps) * turns as u64);
        let nesting = self.nesting.saturating_add(cost.nesting);
        let levels = if levels == 0 {
            0
        } else {
            scope.depth.saturating_add(levels)
        };
        let fits = steps <= limits.steps && nesting <= limits.nesting && levels <= limits.levels;
        let fits = fits && self.has_room_for_lists();
        fits.then_some((steps, nesting, levels))
    }

    fn pay(&mut self, steps: u64, nesting: u32, levels: u32) {
        self.usage.steps = steps;
        self.usage.nesting = self.usage.nesting.max(nesting);
        self.usage.levels = self.usage.levels.max(levels);
        self.tell();
    }
}
