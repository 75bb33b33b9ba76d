//! What does a node do when the traversal comes to it?

use super::terminal::outline_at;
use super::wish::frames_at;
use super::{Evaluator, Outcome, Scope, Turtle};
use crate::procedural::grown::SaidInFile;
use crate::procedural::problem::Problem;
use crate::procedural::syntax::{At, Statement, Transform, Written};
use crate::procedural::value::Value;

/// Farthest move and largest scale, so that a model stays within reach of numbers.
pub(super) const MAX_LENGTH: f64 = 1e9;
/// Smallest scale, either way.
pub(super) const MIN_SCALE: f64 = 1e-6;

impl<'p> Evaluator<'p> {
    pub(super) fn visit(&mut self, scope: &Scope, turtle: &Turtle, statement: &'p Statement) -> Outcome<()> {
        if let Some(plan) = statement.plan()
            && self.at_once(scope, turtle, plan, statement)?
        {
            return Ok(());
        }
        if !self.enters() {
            return self.refused(scope, self.place(scope, statement));
        }
        self.act(scope, turtle, statement)?;
        self.ascend();
        Ok(())
    }

    fn act(&mut self, scope: &Scope, turtle: &Turtle, statement: &'p Statement) -> Outcome<()> {
        match statement {
            Statement::Group { of, .. } => of.iter().try_for_each(|inner| self.visit(scope, turtle, inner)),
            Statement::Let { slot, value, .. } => {
                let place = (scope.module, value.at);
                let value = self.written(scope, value)?;
                self.put(scope.base + *slot as usize, value, place)
            }
            Statement::If {
                condition,
                then,
                otherwise,
                ..
            } => match (self.number_of(scope, condition, "a condition")? != 0.0, otherwise) {
                (true, _) => self.visit(scope, turtle, then),
                (false, Some(otherwise)) => self.visit(scope, turtle, otherwise),
                (false, None) => Ok(()),
            },
            Statement::Choose { number, of, .. } => {
                let number = self.number_of(scope, number, "what is chosen by")?.floor();
                let last = of.len() as f64 - 1.0;
                match of.get(number.clamp(0.0, last.max(0.0)) as usize) {
                    Some(chosen) => self.visit(scope, turtle, chosen),
                    None => Ok(()),
                }
            }
            Statement::Place {
                transform,
                at,
                by,
                body,
                ..
            } => {
                let turtle = self.placed((scope, *at), turtle, *transform, by)?;
                self.visit(scope, &turtle, body)
            }
            Statement::Paint { call, body } => {
                let material = self.surface(scope, *call)?;
                self.visit(scope, &Turtle { material, ..*turtle }, body)
            }
            Statement::Called { at, name, body } => self.visit_called((scope, *at), turtle, name, body),
            Statement::Call { call, .. } => self.follow(scope, turtle, *call),
            Statement::Solid {
                kind, at, arguments, ..
            } => {
                let solid = self.solid((scope, *at), *kind, arguments)?;
                self.add((scope, *at, outline_at(*kind, arguments, *at)), turtle, &solid)
            }
            Statement::Viewpoint { at, name } => {
                self.count_placements((scope, *at), 1)?;
                self.keep_name((scope.module, *at), name)?;
                self.parts[self.part].viewpoints.push((name.clone(), turtle.frame));
                Ok(())
            }
            Statement::Impostor { at, arguments } => {
                let wish = self.impostor((scope, *at), arguments)?;
                let part = &mut self.parts[self.part];
                part.impostor = Some(wish);
                part.asked = Some(SaidInFile {
                    file: scope.module,
                    at: frames_at(arguments, *at),
                });
                Ok(())
            }
            Statement::Model { at, path } => {
                self.count_placements((scope, *at), 1)?;
                self.keep_name((scope.module, *at), path)?;
                self.accounts[self.part].models.push((scope.module, *at));
                let reach = (self.boxes)(path).map(|bounds| turtle.frame.bounds(&bounds));
                let part = &mut self.parts[self.part];
                part.models.push((path.clone(), turtle.frame));
                part.bounds = reach.iter().fold(part.bounds, |all, reach| all.union(reach));
                Ok(())
            }
            Statement::For {
                site,
                slots,
                over,
                body,
                plan,
                ..
            } => self.repeat((scope, *site), turtle, (slots, over), (*plan, body)),
            Statement::Scatter {
                site,
                slots,
                count,
                over,
                body,
                ..
            } => self.scatter((scope, *site), turtle, (*slots, count, over), body),
            Statement::Edges {
                site,
                slots,
                polygon,
                body,
                ..
            } => self.follow_edges((scope, *site), turtle, (slots, polygon), body),
            Statement::Heights {
                at,
                slots,
                over,
                steps,
                height,
                plan,
            } => {
                let solid = self.heights((scope, *at), *slots, (over, steps), (*plan, height))?;
                self.add((scope, *at, *at), turtle, &solid)
            }
        }
    }

    fn placed(
        &mut self,
        (scope, at): (&Scope, At),
        turtle: &Turtle,
        transform: Transform,
        by: &'p [Written],
    ) -> Outcome<Turtle> {
        let mut numbers = [0.0; 3];
        for (number, written) in numbers.iter_mut().zip(by) {
            *number = self.ranged(scope, written, "a transform", (-MAX_LENGTH, MAX_LENGTH))?;
        }
        let [x, y, z] = numbers;
        let frame = match transform {
            Transform::Move => turtle.frame.moved(numbers),
            Transform::Turn => turtle.frame.turned(1, x),
            Transform::Tilt => turtle.frame.turned(0, x),
            Transform::Roll => turtle.frame.turned(2, x),
            Transform::Scale => {
                let factors = if by.len() == 1 { [x; 3] } else { [x, y, z] };
                if let Some(least) = by.iter().zip(numbers).find(|(_, factor)| factor.abs() < MIN_SCALE) {
                    let (what, wanted) = ("a scale", "0.000001 or more, or as much below 0");
                    return self.error(scope.module, least.0.at, Problem::Amount { what, wanted });
                }
                turtle.frame.scaled(factors)
            }
        };
        let is_near = |near: bool, along: &f64| near & (along.abs() <= MAX_LENGTH);
        if !frame.numbers().iter().fold(true, is_near) {
            let (what, wanted) = (
                "the place to which this leads",
                "within 1000000000 m, and no more times as large",
            );
            return self.error(scope.module, at, Problem::Amount { what, wanted });
        }
        Ok(Turtle { frame, ..*turtle })
    }

    /// Where a node stands in the text, to say that something ended there.
    fn place(&self, scope: &Scope, statement: &Statement) -> At {
        match statement {
            Statement::Let { at, .. }
            | Statement::Called { at, .. }
            | Statement::Viewpoint { at, .. }
            | Statement::Model { at, .. }
            | Statement::If { at, .. }
            | Statement::Choose { at, .. }
            | Statement::Place { at, .. }
            | Statement::Solid { at, .. }
            | Statement::Impostor { at, .. }
            | Statement::For { at, .. }
            | Statement::Scatter { at, .. }
            | Statement::Edges { at, .. }
            | Statement::Heights { at, .. } => *at,
            Statement::Call { call, .. } | Statement::Paint { call, .. } => {
                self.program.modules[scope.module].calls[*call].at
            }
            Statement::Group { of, .. } => of.first().map_or(0, |first| self.place(scope, first)),
        }
    }
}

impl Value {
    /// What a value is before it is computed.
    pub(super) const NONE: Self = Self::Number(0.0);
}
