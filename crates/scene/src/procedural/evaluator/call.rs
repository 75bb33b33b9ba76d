//! Where does a call lead? To the body of a rule, which draws into the part that it is called in; to a part; to a file.

use super::{Evaluator, Outcome, Scope, Turtle};
use crate::procedural::limits::reached;
use crate::procedural::random::step;
use crate::procedural::syntax::{At, Call, Formal, Rule};
use crate::procedural::value::Value;

impl<'p> Evaluator<'p> {
    /// Visits what a call leads to.
    pub(super) fn follow(&mut self, scope: &Scope, turtle: &Turtle, call: usize) -> Outcome<()> {
        let call = &self.program.modules[scope.module].calls[call];
        let depth = self.deeper(scope, call.at)?;
        let Some(index) = call.target.index else {
            return self.place_file(scope, turtle, call, depth);
        };
        let rule = self.rule(call.target.module, index);
        let inner = self.scope_of((scope, call), depth)?;
        self.bind((scope, call), &inner, (&rule.formals, rule.slots))?;
        self.go_on((scope, call.at), turtle, (rule, index), inner)
    }

    /// What the callee sees, so many calls deep.
    pub(super) fn scope_of(&mut self, (scope, call): (&Scope, &Call), depth: u32) -> Outcome<Scope> {
        Ok(Scope {
            module: call.target.module,
            instance: self.called_instance(scope, call)?,
            base: self.stack.len(),
            path: step(scope.path, call.site),
            depth,
            level: 0,
            held: self.held,
        })
    }

    /// Visits the rule of a call whose values are on the stack.
    pub(super) fn go_on(
        &mut self,
        (scope, at): (&Scope, At),
        turtle: &Turtle,
        (rule, index): (&'p Rule, usize),
        inner: Scope,
    ) -> Outcome<()> {
        let done = if rule.is_part {
            self.place_part((scope, at), turtle, rule, index, inner)
        } else {
            self.visit_rule(turtle, rule, index, inner)
        };
        done.map_err(|error| self.traced((scope.module, at), error))?;
        self.close_frame(&inner);
        Ok(())
    }

    /// The value of a function of the file.
    pub(super) fn apply(&mut self, scope: &Scope, call: usize) -> Outcome<Value> {
        let call = &self.program.modules[scope.module].calls[call];
        let depth = self.deeper_by((scope, call.at), "levels of calls, those of functions too")?;
        let function = &self.program.modules[call.target.module].functions[call.target.index.unwrap_or_default()];
        let inner = self.scope_of((scope, call), depth)?;
        self.bind((scope, call), &inner, (&function.formals, function.slots))?;
        let value = self.written(&inner, &function.value);
        let value = value.map_err(|error| self.traced((scope.module, call.at), error))?;
        self.close_frame(&inner);
        Ok(value)
    }

    pub(super) fn deeper(&mut self, scope: &Scope, at: At) -> Outcome<u32> {
        self.deeper_by((scope, at), "levels")
    }

    fn deeper_by(&mut self, (scope, at): (&Scope, At), what: &'static str) -> Outcome<u32> {
        let depth = scope.depth + 1;
        self.usage.levels = self.usage.levels.max(depth);
        let limit = self.settings.limits.levels;
        if depth > limit {
            return self.error(scope.module, at, reached(what, limit.into()));
        }
        Ok(depth)
    }

    /// Puts a frame on the stack: arguments as the caller computes them, then defaults.
    pub(super) fn bind(
        &mut self,
        (scope, call): (&Scope, &'p Call),
        inner: &Scope,
        (formals, slots): (&'p [Formal], u32),
    ) -> Outcome<()> {
        self.open_frame(inner.base, slots);
        for (slot, argument) in call.given() {
            let value = self.written(scope, &argument.value)?;
            self.put(inner.base + slot, value, (scope.module, argument.value.at))?;
        }
        self.bind_defaults((scope, call), inner, formals)
    }

    pub(super) fn bind_defaults(
        &mut self,
        (scope, call): (&Scope, &'p Call),
        inner: &Scope,
        formals: &'p [Formal],
    ) -> Outcome<()> {
        if call.given.len() == formals.len() {
            return Ok(());
        }
        for (slot, formal) in call.left(formals) {
            if let Some(default) = &formal.default {
                let value = self.written(inner, default);
                let put = value.and_then(|value| self.put(inner.base + slot, value, (inner.module, default.at)));
                put.map_err(|error| self.traced((scope.module, call.at), error))?;
            }
        }
        Ok(())
    }

    /// The body of a rule, or what stands in for it when its levels are used up.
    fn visit_rule(&mut self, turtle: &Turtle, rule: &'p Rule, index: usize, mut scope: Scope) -> Outcome<()> {
        let id = self.first_rule[scope.module] + index;
        scope.level = self.open[id];
        let body = match &rule.levels {
            Some(levels) if f64::from(scope.level) >= self.number(&scope, levels.at, &levels.of, "`levels`")? => {
                rule.then.as_ref()
            }
            _ => Some(&rule.body),
        };
        let Some(body) = body else { return Ok(()) };
        self.open[id] += 1;
        self.visit(&scope, turtle, body)?;
        self.open[id] -= 1;
        Ok(())
    }
}
