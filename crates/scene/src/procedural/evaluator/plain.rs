//! What is an expression of numbers, computed at one go? Most of what rules compute is: sums and products of locals. It is
//! known beforehand what that takes, so limits are asked once for all of it. Where anything is amiss the nodes are visited
//! one by one, and that says what and where.

use std::ops::RangeInclusive;

use super::terminal::MAX_LENGTH;
use super::{Evaluator, Outcome, Scope};
use crate::procedural::limits::MAX_LIST;
use crate::procedural::operation::{BuiltIn, MAX_OCTAVES, MAX_POWER, fractal, random, truth};
use crate::procedural::solid::Faces;
use crate::procedural::syntax::{At, Cost, Expr, Plain};
use crate::procedural::value::Value;

impl Expr {
    /// The same, made ready to be computed at one go where that is possible and worth it. `settled` counts those that need no
    /// more than the values of the file.
    pub(in crate::procedural) fn made_plain(self, settled: &mut u32) -> Self {
        let cost = match &self {
            Self::Binary { .. } | Self::Minus(_) | Self::Not(_) | Self::BuiltIn { .. } => self.cost(),
            // As many steps as it has items, and as many more as these take.
            Self::List(..) => self.cost_as_value().filter(|cost| cost.steps as usize <= MAX_LIST),
            _ => None,
        };
        match cost {
            Some(cost) => {
                let number = self.is_settled().then(|| {
                    *settled += 1;
                    *settled - 1
                });
                Self::Plain(Box::new(Plain {
                    of: self,
                    cost,
                    settled: number,
                }))
            }
            None => self,
        }
    }

    /// Whether it is a number that is made of values of the file, `detail` and numbers alone.
    fn is_settled(&self) -> bool {
        match self {
            Self::Number(_) | Self::Global(_) | Self::Detail => true,
            Self::Plain(plain) => plain.settled.is_some(),
            Self::Minus(of) | Self::Not(of) => of.is_settled(),
            Self::Binary { sides, .. } => sides.iter().all(Self::is_settled),
            Self::BuiltIn { name, arguments, .. } => {
                *name != BuiltIn::Random && arguments.iter().all(|argument| argument.of.is_settled())
            }
            _ => false,
        }
    }

    /// What a visit takes where any value will do.
    fn cost_as_value(&self) -> Option<Cost> {
        match self {
            Self::Number(_) | Self::Local(_) => Some(Cost { steps: 1, nesting: 1 }),
            Self::List(items, _) => Some(Cost::of(items.iter(), Self::cost_as_value)?.and(1)),
            Self::Plain(plain) => Some(plain.cost),
            _ => self.cost(),
        }
    }

    /// What a visit takes where a number is wanted; `None` when that depends on values, or it may be a list.
    fn cost(&self) -> Option<Cost> {
        let (inner, own) = match self {
            Self::Number(_) | Self::Local(_) => return Some(Cost::default()),
            Self::Plain(plain) if matches!(plain.of, Self::List(..)) => return None,
            Self::Plain(plain) => return Some(plain.cost),
            Self::Detail | Self::Level | Self::Global(_) => (Cost::default(), 1),
            Self::Minus(of) | Self::Not(of) => (of.cost()?, 1),
            Self::Binary { sides, .. } => (Cost::of(sides.iter(), Self::cost)?, 1),
            Self::BuiltIn { name, arguments, .. } => {
                let octaves = match (name, arguments.get(2).map(|argument| &argument.of)) {
                    (BuiltIn::Count | BuiltIn::Mix, _) => return None,
                    (BuiltIn::Noise, _) => 1,
                    (BuiltIn::Fractal, Some(Self::Number(octaves))) if (1.0..=MAX_OCTAVES).contains(octaves) => {
                        *octaves as u32
                    }
                    (BuiltIn::Fractal, _) => return None,
                    _ => 0,
                };
                (
                    Cost::of(arguments.iter().map(|argument| &argument.of), Self::cost)?,
                    1 + octaves,
                )
            }
            _ => return None,
        };
        Some(inner.and(own))
    }

    /// The items of a list that is written out.
    pub(super) fn items(&self) -> Option<&[Self]> {
        match self {
            Self::List(items, _) => Some(items),
            Self::Plain(plain) => plain.of.items(),
            _ => None,
        }
    }
}

impl Cost {
    /// Of all of these, one after the other.
    fn of<'e>(mut all: impl Iterator<Item = &'e Expr>, cost: impl Fn(&Expr) -> Option<Self>) -> Option<Self> {
        all.try_fold(Self::default(), |sum, expr| {
            let cost = cost(expr)?;
            Some(Self {
                steps: sum.steps + cost.steps,
                nesting: sum.nesting.max(cost.nesting),
            })
        })
    }

    /// With the node around it.
    fn and(self, steps: u32) -> Self {
        Self {
            steps: self.steps + steps,
            nesting: self.nesting + 1,
        }
    }
}

impl<'p> Evaluator<'p> {
    /// A number; `what` it is for.
    pub(super) fn plain(&mut self, scope: &Scope, at: At, plain: &'p Plain, what: &'static str) -> Outcome<f64> {
        let Some(settled) = plain.settled else {
            return match self.charged(plain.cost, |known| known.at_one_go(scope, &plain.of)) {
                Some(number) => Ok(number),
                None => self.number(scope, at, &plain.of, what),
            };
        };
        let serial = self.instances[scope.instance].serial;
        let place = (scope.module, settled as usize);
        let known = self.settled[place.0][place.1].filter(|(of, _)| *of == serial);
        let number = known.and_then(|(_, number)| self.charged(plain.cost, |_| Some(number)));
        if let Some(number) = number {
            return Ok(number);
        }
        let number = match self.charged(plain.cost, |known| known.at_one_go(scope, &plain.of)) {
            Some(number) => number,
            None => self.number(scope, at, &plain.of, what)?,
        };
        self.settled[place.0][place.1] = Some((serial, number));
        Ok(number)
    }

    /// A list of so many rows of `N` numbers that a solid is made of; `None` when it is not, or not to be computed at one go.
    pub(super) fn plain_rows<const N: usize>(
        &mut self,
        scope: &Scope,
        plain: &'p Plain,
        lengths: RangeInclusive<usize>,
    ) -> Option<Vec<[f64; N]>> {
        if !self.has_room_for_lists() {
            return None;
        }
        self.charged(plain.cost, |known| {
            let rows = plain.of.items().filter(|rows| lengths.contains(&rows.len()))?;
            let mut found = Vec::with_capacity(rows.len());
            for row in rows {
                let mut numbers = [0.0; N];
                let items = row.items().filter(|items| items.len() == N)?;
                for (number, item) in numbers.iter_mut().zip(items) {
                    *number = known
                        .at_one_go(scope, item)
                        .filter(|number| number.abs() <= MAX_LENGTH)?;
                }
                found.push(numbers);
            }
            Some(found)
        })
    }

    /// The same for faces, lists of any number of `points` each.
    pub(super) fn plain_faces(&mut self, scope: &Scope, plain: &'p Plain, points: usize) -> Option<Faces> {
        if !self.has_room_for_lists() {
            return None;
        }
        self.charged(plain.cost, |known| {
            let mut faces = Faces::default();
            for face in plain.of.items()? {
                for corner in face.items()? {
                    faces.corner(known.at_one_go(scope, corner)?, points)?;
                }
                faces.end();
            }
            Some(faces)
        })
    }

    /// What is computed at one go, if it is within limits; it is paid for when it succeeds.
    fn charged<T>(&mut self, cost: Cost, compute: impl FnOnce(&Self) -> Option<T>) -> Option<T> {
        let limits = &self.settings.limits;
        let steps = self.usage.steps.saturating_add(cost.steps.into());
        let nesting = self.nesting.saturating_add(cost.nesting);
        if steps > limits.steps || nesting > limits.nesting {
            return None;
        }
        let computed = compute(self)?;
        self.usage.steps = steps;
        self.usage.nesting = self.usage.nesting.max(nesting);
        self.tell();
        Some(computed)
    }

    /// A finite number, unless there is something to be said about a place. Half of all nodes are numbers and locals, for
    /// which nothing is called.
    #[inline(always)]
    fn at_one_go(&self, scope: &Scope, expr: &Expr) -> Option<f64> {
        match expr {
            Expr::Number(number) => Some(*number),
            Expr::Local(slot) => of_number(&self.stack[scope.base + *slot as usize]),
            _ => self.made_of_numbers(scope, expr),
        }
    }

    fn made_of_numbers(&self, scope: &Scope, expr: &Expr) -> Option<f64> {
        let number = match expr {
            Expr::Global(index) => {
                let used = &self.program.modules[scope.module].uses[*index];
                return of_number(self.instances[scope.instance].values[used.slot].as_ref()?);
            }
            Expr::Plain(plain) => return self.at_one_go(scope, &plain.of),
            Expr::Detail => self.settings.detail.into(),
            Expr::Level => scope.level.into(),
            Expr::Minus(of) => -self.at_one_go(scope, of)?,
            Expr::Not(of) => truth(self.at_one_go(scope, of)? == 0.0),
            Expr::Binary { operator, sides, .. } => {
                let (a, b) = (self.at_one_go(scope, &sides[0])?, self.at_one_go(scope, &sides[1])?);
                operator.of(a, b)
            }
            Expr::BuiltIn {
                name, site, arguments, ..
            } => {
                let mut numbers = [0.0; 3];
                for (number, argument) in numbers.iter_mut().zip(arguments) {
                    *number = self.at_one_go(scope, &argument.of)?;
                }
                let [a, b, c] = numbers;
                match name {
                    BuiltIn::Noise => fractal(self.settings.seed, [a, b], 1).ok()?,
                    BuiltIn::Fractal => fractal(self.settings.seed, [a, b], c as u32).ok()?,
                    BuiltIn::Random if arguments.is_empty() => random(scope.path, *site),
                    BuiltIn::Random => a + (b - a) * random(scope.path, *site),
                    BuiltIn::Power if b.abs() > MAX_POWER || b != b.floor() => return None,
                    _ => name.of(a, b, c),
                }
            }
            _ => return None,
        };
        number.is_finite().then_some(number)
    }
}

fn of_number(value: &Value) -> Option<f64> {
    match value {
        Value::Number(number) => Some(*number),
        Value::List(..) => None,
    }
}

#[cfg(test)]
mod tests {
    use crate::procedural::{Grown, Limits, NoImports, Program, Settings, grow};

    const PYRAMID: &str = "let w = 3 parameter h = 2
mesh([[-w / 2, 0, -w / 2], [w / 2, 0, -w / 2], [0, sqrt(h * h) + noise(w, 1) * 0, 0]], [[0, 2, 1], [0, 1, 2]])";

    fn grown(text: &str, limits: Limits) -> Result<Grown, String> {
        let program = Program::read("test.dcg", text.to_owned(), &NoImports).unwrap();
        let settings = Settings {
            limits,
            ..Settings::default()
        };
        grow(&program, &settings).map_err(|error| error.to_string())
    }

    #[test]
    fn what_is_computed_at_one_go_costs_what_its_nodes_cost() {
        let all = grown(PYRAMID, Limits::default()).unwrap();
        // The same with a condition in each number, which is visited node by node.
        let slow = PYRAMID.replace("w / 2", "(if 1 then w else 0) / 2");
        let slow = grown(&slow, Limits::default()).unwrap();
        assert_eq!(slow.parts[0].meshes, all.parts[0].meshes);
        // Four numbers, and each `if` is a node more.
        assert_eq!(slow.usage.steps - all.usage.steps, 4);
        for (least, one_less) in [
            (
                "steps",
                Limits {
                    steps: all.usage.steps - 1,
                    ..Limits::default()
                },
            ),
            (
                "nesting",
                Limits {
                    nesting: all.usage.nesting - 1,
                    ..Limits::default()
                },
            ),
        ] {
            let error = grown(PYRAMID, one_less).unwrap_err();
            assert!(error.contains(least), "{error}");
        }
    }

    #[test]
    fn what_is_amiss_is_found_where_it_stands() {
        for (from, to, column, what) in [
            ("w / 2, 0, -w / 2], [w", "w / (w - 3), 0, 1], [w", 11, "division"),
            ("sqrt(h * h)", "sqrt(-h)", 57, "root"),
            ("sqrt(h * h)", "[h][0] * [1]", 59, "list"),
            ("noise(w, 1)", "noise(w, 2 * power(10, 9))", 75, "noise"),
            ("[0, 2, 1]", "[0, 2, h + 1]", 88, "points"),
            ("[0, 2, 1]", "[0, 2]", 88, "three"),
        ] {
            let text = PYRAMID.replacen(from, to, 1);
            assert_ne!(text, PYRAMID);
            let error = grown(&text, Limits::default()).unwrap_err();
            let place = format!("line 2, column {column}: ");
            assert!(error.contains(&place) && error.contains(what), "{what}: {error}");
        }
    }
}
