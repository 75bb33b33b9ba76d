//! How often, and where? Enumerators visit their statement once for each member of a population. Each visit has a path of
//! its own, so that each member has random numbers of its own.

use super::straight::{Given, Turns};
use super::{Evaluator, Outcome, Scope, Turtle};
use crate::procedural::affine::Affine;
use crate::procedural::problem::Problem;
use crate::procedural::random::{fraction, step};
use crate::procedural::solid::outline;
use crate::procedural::syntax::{At, Statement, Written};
use crate::procedural::value::Value;

/// Most members of one population.
const MAX_COUNT: f64 = 1_048_576.0;
/// Largest extent, metres.
const MAX_EXTENT: f64 = 1e6;
/// The plastic number's inverse and its square: steps of the most even sequence in the plane (Roberts 2018).
const EVEN_STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];

/// A scope and the word that the enumerator adds to the path.
type Site<'s> = (&'s Scope, u32);

impl<'p> Evaluator<'p> {
    /// `for`: over numbers from 0, or over the items of a list.
    pub(super) fn repeat(
        &mut self,
        (scope, site): Site,
        turtle: &Turtle,
        (slots, over): (&'p [u32], &'p Written),
        (plan, body): (u32, &'p Statement),
    ) -> Outcome<()> {
        let path = step(scope.path, site);
        let value = self.written(scope, over)?;
        let size = value.listed();
        match value {
            Value::Number(count) => {
                let count = self
                    .within((scope, over.at), count, "a count", (0.0, MAX_COUNT))?
                    .floor() as u32;
                self.foresee(scope, count.into(), body)?;
                let turns = Turns {
                    count: if slots.len() == 1 { count as usize } else { 0 },
                    path: Some(path),
                    given: Given::Number,
                };
                let done = self.turns(scope, turtle, (plan, slots, body), &turns)?;
                for i in done as u32..count {
                    let inner = Scope {
                        path: step(path, i),
                        ..*scope
                    };
                    self.assign((scope, over.at), slots, Value::Number(i.into()))?;
                    self.visit(&inner, turtle, body)?;
                }
            }
            Value::List(items, _) => {
                self.hold((scope.module, over.at), size)?;
                self.foresee(scope, items.len() as u64, body)?;
                let turns = Turns {
                    count: items.iter().take_while(|item| gives(item, slots.len())).count(),
                    path: Some(path),
                    given: Given::Items(&items),
                };
                let done = self.turns(scope, turtle, (plan, slots, body), &turns)?;
                for (i, item) in items.iter().enumerate().skip(done) {
                    let inner = Scope {
                        path: step(path, i as u32),
                        ..*scope
                    };
                    self.assign((scope, over.at), slots, item.clone())?;
                    self.visit(&inner, turtle, body)?;
                }
                self.release(size);
            }
        }
        Ok(())
    }

    /// One name takes a value as it is, several take the items of a list.
    fn assign(&mut self, (scope, at): (&Scope, At), slots: &[u32], value: Value) -> Outcome<()> {
        match (slots, value) {
            ([slot], value) => self.put(scope.base + *slot as usize, value, (scope.module, at))?,
            (_, Value::List(items, _)) if items.len() == slots.len() => {
                for (slot, item) in slots.iter().zip(items.iter()) {
                    self.put(scope.base + *slot as usize, item.clone(), (scope.module, at))?;
                }
            }
            _ => {
                let (what, wanted) = ("what `for` goes over", "a list of lists with an item for each name");
                return self.error(scope.module, at, Problem::Shape { what, wanted });
            }
        }
        Ok(())
    }

    /// `scatter`: evenly over a rectangle around the origin, beginning anywhere.
    pub(super) fn scatter(
        &mut self,
        (scope, site): Site,
        turtle: &Turtle,
        (slots, count, over): ([u32; 2], &'p Written, &'p [Written; 2]),
        body: &'p Statement,
    ) -> Outcome<()> {
        let path = step(scope.path, site);
        let count = self.ranged(scope, count, "a count", (0.0, MAX_COUNT))?.floor() as u32;
        let width = self.ranged(scope, &over[0], "a width", (0.0, MAX_EXTENT))?;
        let depth = self.ranged(scope, &over[1], "a depth", (0.0, MAX_EXTENT))?;
        let start = [0, 1].map(|axis| fraction(step(path, axis)));
        self.foresee(scope, count.into(), body)?;
        for i in 0..count {
            let inner = Scope {
                path: step(path, 2 + i),
                ..*scope
            };
            for (axis, extent) in [width, depth].into_iter().enumerate() {
                let along = start[axis] + f64::from(i) * EVEN_STEPS[axis];
                *self.local(scope, slots[axis]) = Value::Number(extent * (along - along.floor() - 0.5));
            }
            self.visit(&inner, turtle, body)?;
        }
        Ok(())
    }

    /// `edges`: along each edge of a polygon, with x along the edge and z outwards.
    pub(super) fn follow_edges(
        &mut self,
        (scope, site): Site,
        turtle: &Turtle,
        (slots, polygon): (&'p [u32], &'p Written),
        body: &'p Statement,
    ) -> Outcome<()> {
        let path = step(scope.path, site);
        let corners = self.written(scope, polygon)?;
        let corners = outline(&self.polygon(scope, polygon.at, &corners)?);
        for (i, &[x, z]) in corners.iter().enumerate() {
            let [to_x, to_z] = corners[(i + 1) % corners.len()];
            let (dx, dz) = (to_x - x, to_z - z);
            let length = (dx * dx + dz * dz).sqrt();
            if length == 0.0 {
                continue;
            }
            let (ux, uz) = (dx / length, dz / length);
            let edge = Affine {
                axes: [[ux, 0.0, uz], [0.0, 1.0, 0.0], [-uz, 0.0, ux]],
                origin: [x, 0.0, z],
            };
            let inner = Scope {
                path: step(path, i as u32),
                ..*scope
            };
            for (slot, value) in slots.iter().zip([length, i as f64]) {
                *self.local(scope, *slot) = Value::Number(value);
            }
            self.visit(
                &inner,
                &Turtle {
                    frame: turtle.frame.after(&edge),
                    ..*turtle
                },
                body,
            )?;
        }
        Ok(())
    }
}

/// Whether an item of a list gives a number to each of so many names.
fn gives(item: &Value, names: usize) -> bool {
    match item {
        Value::Number(_) => names == 1,
        Value::List(items, _) => {
            names > 1 && items.len() == names && items.iter().all(|item| matches!(item, Value::Number(_)))
        }
    }
}
