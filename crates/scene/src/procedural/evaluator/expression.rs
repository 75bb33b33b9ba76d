//! What is the value of an expression?

use super::{Evaluator, Outcome, Scope};
use crate::procedural::limits::{MAX_LIST, MAX_LIST_DEPTH, reached};
use crate::procedural::operation::{BuiltIn, MAX_OCTAVES, MAX_POWER, Operator, farthest, fractal, random, truth};
use crate::procedural::problem::Problem;
use crate::procedural::syntax::{At, Expr, Written};
use crate::procedural::value::Value;

impl<'p> Evaluator<'p> {
    pub(super) fn value(&mut self, scope: &Scope, at: At, expr: &'p Expr) -> Outcome<Value> {
        if let Expr::Plain(plain) = expr {
            return match plain.of {
                Expr::List(..) => self.value(scope, at, &plain.of),
                _ => Ok(Value::Number(self.plain(scope, at, plain, "this result")?)),
            };
        }
        self.descend(scope, at)?;
        let value = match expr {
            Expr::Local(slot) => self.local(scope, *slot).clone(),
            Expr::Global(index) => self.global(scope, *index)?,
            Expr::Colour(channels) => Value::numbers(*channels),
            Expr::List(items, at) => self.list(scope, *at, items)?,
            Expr::Item { at, of } => self.item(scope, *at, &of[0], &of[1])?,
            Expr::If(branches) => {
                let [condition, then, otherwise] = &**branches;
                let branch = if self.condition(scope, at, condition)? {
                    then
                } else {
                    otherwise
                };
                self.value(scope, at, branch)?
            }
            Expr::Call(index) => self.apply(scope, *index)?,
            Expr::BuiltIn {
                name: BuiltIn::Mix,
                at,
                arguments,
                ..
            } => self.mix(scope, *at, arguments)?,
            _ => Value::Number(self.computed(scope, at, expr)?),
        };
        self.ascend();
        Ok(value)
    }

    pub(super) fn written(&mut self, scope: &Scope, written: &'p Written) -> Outcome<Value> {
        self.value(scope, written.at, &written.of)
    }

    /// A value that must be a number; `what` it is for.
    pub(super) fn number(&mut self, scope: &Scope, at: At, expr: &'p Expr, what: &'static str) -> Outcome<f64> {
        match expr {
            Expr::Number(number) => Ok(*number),
            Expr::Plain(plain) => self.plain(scope, at, plain, what),
            Expr::Binary { .. } | Expr::Minus(_) | Expr::Detail | Expr::Level => {
                self.descend(scope, at)?;
                let number = self.computed(scope, at, expr)?;
                self.ascend();
                Ok(number)
            }
            Expr::Local(slot) => match self.local(scope, *slot) {
                Value::Number(number) => Ok(*number),
                Value::List(..) => self.error(scope.module, at, Problem::NotANumber(what)),
            },
            _ => match self.value(scope, at, expr)? {
                Value::Number(number) => Ok(number),
                Value::List(..) => self.error(scope.module, at, Problem::NotANumber(what)),
            },
        }
    }

    /// The same, said of where it is written.
    pub(super) fn number_of(&mut self, scope: &Scope, written: &'p Written, what: &'static str) -> Outcome<f64> {
        self.number(scope, written.at, &written.of, what)
    }

    fn condition(&mut self, scope: &Scope, at: At, expr: &'p Expr) -> Outcome<bool> {
        Ok(self.number(scope, at, expr, "a condition")? != 0.0)
    }

    /// A number within a range.
    pub(super) fn ranged(
        &mut self,
        scope: &Scope,
        written: &'p Written,
        what: &'static str,
        range: (f64, f64),
    ) -> Outcome<f64> {
        let value = self.number_of(scope, written, what)?;
        self.within((scope, written.at), value, what, range)
    }

    pub(super) fn within(
        &self,
        (scope, at): (&Scope, At),
        value: f64,
        what: &'static str,
        (min, max): (f64, f64),
    ) -> Outcome<f64> {
        if min <= value && value <= max {
            return Ok(value);
        }
        let what = what.to_owned();
        self.error(scope.module, at, Problem::OutOfRange { what, value, min, max })
    }

    pub(super) fn items(&mut self, scope: &Scope, at: At, expr: &'p Expr, what: &'static str) -> Outcome<Value> {
        match self.value(scope, at, expr)? {
            Value::Number(_) => self.error(scope.module, at, Problem::NotAList(what)),
            list => Ok(list),
        }
    }

    /// A list that is written out. Of one that becomes too long no more is computed.
    fn list(&mut self, scope: &Scope, at: At, items: &'p [Expr]) -> Outcome<Value> {
        let (mut values, mut size) = (Vec::with_capacity(items.len()), 0);
        for item in items {
            let value = self.value(scope, at, item)?;
            size += value.size();
            if size >= MAX_LIST {
                return self.error(scope.module, at, reached("numbers in a list", MAX_LIST as u64));
            }
            self.hold((scope.module, at), value.size())?;
            values.push(value);
        }
        self.release(size);
        let list = Value::list(values);
        if list.depth() > MAX_LIST_DEPTH {
            return self.error(
                scope.module,
                at,
                reached("lists inside each other", MAX_LIST_DEPTH.into()),
            );
        }
        Ok(list)
    }

    fn global(&mut self, scope: &Scope, index: usize) -> Outcome<Value> {
        let used = &self.program.modules[scope.module].uses[index];
        match &self.instances[scope.instance].values[used.slot] {
            Some(value) => Ok(value.clone()),
            None => {
                let values = &self.instances[scope.instance].values;
                let parameters = self.program.modules[scope.module].parameters.len();
                let way_out = if used.slot < parameters {
                    "move its `parameter` up"
                } else if values[..parameters].contains(&None) {
                    "defaults of parameters can use parameters above, and no `let`"
                } else {
                    "move its `let` up"
                };
                let name = used.name.clone();
                self.error(scope.module, used.at, Problem::NotComputed { name, way_out })
            }
        }
    }

    fn item(&mut self, scope: &Scope, at: At, list: &'p Expr, index: &'p Expr) -> Outcome<Value> {
        // A named list is counted where it is named; another only while the index is computed.
        let is_held = list.is_of_name();
        let list = self.items(scope, at, list, "what has items")?;
        let size = if is_held { 0 } else { list.size() };
        self.hold((scope.module, at), size)?;
        let index = self.number(scope, at, index, "the number of an item")?;
        self.release(size);
        let Value::List(items, _) = &list else {
            unreachable!("items gives lists")
        };
        let found = if index >= 0.0 {
            items.get(index.floor() as usize)
        } else {
            None
        };
        match found {
            Some(item) => Ok(item.clone()),
            None => self.error(
                scope.module,
                at,
                Problem::NoItem {
                    index,
                    count: items.len(),
                },
            ),
        }
    }

    /// Numbers that are made of numbers.
    fn computed(&mut self, scope: &Scope, at: At, expr: &'p Expr) -> Outcome<f64> {
        match expr {
            Expr::Number(number) => Ok(*number),
            Expr::Detail => Ok(self.settings.detail.into()),
            Expr::Level => Ok(scope.level.into()),
            Expr::Minus(of) => Ok(-self.number(scope, at, of, "what follows `-`")?),
            Expr::Not(of) => Ok(truth(!self.condition(scope, at, of)?)),
            Expr::And(sides) => Ok(truth(
                self.condition(scope, at, &sides[0])? && self.condition(scope, at, &sides[1])?,
            )),
            Expr::Or(sides) => Ok(truth(
                self.condition(scope, at, &sides[0])? || self.condition(scope, at, &sides[1])?,
            )),
            Expr::Binary { operator, at, sides } => {
                let left = self.number(scope, *at, &sides[0], "what is computed with")?;
                let right = self.number(scope, *at, &sides[1], "what is computed with")?;
                self.binary(scope, *at, *operator, left, right)
            }
            Expr::BuiltIn {
                name,
                at,
                site,
                arguments,
            } => self.built_in(scope, *at, *name, *site, arguments),
            Expr::Colour(_)
            | Expr::Local(_)
            | Expr::Global(_)
            | Expr::If(_)
            | Expr::List(..)
            | Expr::Item { .. }
            | Expr::Call(_)
            | Expr::Plain(_) => unreachable!("they were visited before"),
        }
    }

    fn binary(&self, scope: &Scope, at: At, operator: Operator, a: f64, b: f64) -> Outcome<f64> {
        if operator == Operator::Divide && b == 0.0 {
            return self.error(scope.module, at, Problem::DivisionByZero);
        }
        self.finite(scope, at, operator.of(a, b), "this result")
    }

    fn finite(&self, scope: &Scope, at: At, number: f64, what: &'static str) -> Outcome<f64> {
        if number.is_finite() {
            Ok(number)
        } else {
            self.error(scope.module, at, Problem::NotFinite(what))
        }
    }

    fn built_in(&mut self, scope: &Scope, at: At, name: BuiltIn, site: u32, arguments: &'p [Written]) -> Outcome<f64> {
        if name == BuiltIn::Count {
            let Written { at, of } = &arguments[0];
            let list = self.items(scope, *at, of, "what is counted")?;
            return Ok(if let Value::List(items, _) = list {
                items.len() as f64
            } else {
                0.0
            });
        }
        let mut numbers = [0.0; 3];
        for (number, argument) in numbers.iter_mut().zip(arguments) {
            *number = self.number_of(scope, argument, "an argument of this function")?;
        }
        let [a, b, c] = numbers;
        let wrong = |argument: usize, problem| self.error(scope.module, arguments[argument].at, problem);
        let result = match name {
            BuiltIn::Mod if b == 0.0 => return wrong(1, Problem::DivisionByZero),
            BuiltIn::Noise => self.fractal((scope, at), arguments, [a, b], 1.0)?,
            BuiltIn::Fractal => self.fractal((scope, at), arguments, [a, b], c)?,
            BuiltIn::Power => {
                self.within((scope, arguments[1].at), b, "a power", (-MAX_POWER, MAX_POWER))?;
                if b != b.floor() {
                    let (what, wanted) = ("a power", "a whole number; roots are taken by `sqrt`");
                    return wrong(1, Problem::Amount { what, wanted });
                }
                name.of(a, b, c)
            }
            BuiltIn::Random if arguments.is_empty() => random(scope.path, site),
            BuiltIn::Random => a + (b - a) * random(scope.path, site),
            BuiltIn::Sqrt if a < 0.0 => {
                let (what, wanted) = ("what a root is taken of", "0 or more");
                return wrong(0, Problem::Amount { what, wanted });
            }
            _ => name.of(a, b, c),
        };
        self.finite(scope, at, result, "this result")
    }

    fn fractal(
        &mut self,
        (scope, at): (&Scope, At),
        arguments: &[Written],
        place: [f64; 2],
        octaves: f64,
    ) -> Outcome<f64> {
        let octaves_at = arguments.get(2).map_or(at, |argument| argument.at);
        let octaves = self.within((scope, octaves_at), octaves, "octaves", (1.0, MAX_OCTAVES))?;
        let octaves = octaves.floor() as u32;
        self.count(scope, at, octaves.into())?;
        fractal(self.settings.seed, place, octaves).or_else(|axis| {
            let most = farthest(octaves);
            let what = match octaves {
                1 => "a coordinate of noise",
                _ => "a coordinate of noise with so many octaves",
            };
            self.within((scope, arguments[axis].at), place[axis], what, (-most, most))
        })
    }

    /// Between two numbers, or item by item between two lists.
    fn mix(&mut self, scope: &Scope, at: At, arguments: &'p [Written]) -> Outcome<Value> {
        let mut held = 0;
        let mut side = |evaluator: &mut Self, index: usize| -> Outcome<Value> {
            let value = evaluator.written(scope, &arguments[index])?;
            evaluator.hold((scope.module, arguments[index].at), value.listed())?;
            held += value.listed();
            Ok(value)
        };
        let (from, to) = (side(self, 0)?, side(self, 1)?);
        let part = self.number_of(scope, &arguments[2], "the third argument of `mix`")?;
        self.release(held);
        self.count(scope, at, from.size() as u64)?;
        self.mixed((scope, at), &from, &to, part)
    }

    fn mixed(&self, (scope, at): (&Scope, At), from: &Value, to: &Value, part: f64) -> Outcome<Value> {
        match (from, to) {
            (Value::Number(a), Value::Number(b)) => Ok(Value::Number(self.finite(
                scope,
                at,
                a + (b - a) * part,
                "this result",
            )?)),
            (Value::List(a, _), Value::List(b, _)) if a.len() == b.len() => {
                let items = a.iter().zip(b.iter()).map(|(a, b)| self.mixed((scope, at), a, b, part));
                Ok(Value::list(items.collect::<Outcome<_>>()?))
            }
            _ => {
                let (what, wanted) = ("what is mixed", "two numbers, or two lists of the same shape");
                self.error(scope.module, at, Problem::Shape { what, wanted })
            }
        }
    }
}
