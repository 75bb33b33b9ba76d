//! Where does a call lead? Rules draw into the part they are called in; parts and files are parts of their own.
//!
//! What a part looks like depends on its parameters and its material alone: its random numbers begin anew from the seed,
//! its name and its parameters. So equal calls share one part, and a population costs no more than its placements
//! (Schmalstieg 1997, §8.3: the enumerator node).

use super::{Account, Evaluator, ModuleInstance, Outcome, Scope, Turtle};
use crate::Bounds;
use crate::procedural::affine::Affine;
use crate::procedural::error::Problem;
use crate::procedural::grown::{Part, Placement};
use crate::procedural::limits::reached;
use crate::procedural::random::{step, step_name};
use crate::procedural::recipe::Recipe;
use crate::procedural::syntax::{At, Call, Expr, Formal, Rule, Statement};
use crate::procedural::value::Value;

/// By how much geometry may go beyond what a part declares: rounding to single precision, relative and in metres.
const SLACK: f64 = 1e-6;

impl<'p> Evaluator<'p> {
    /// Grows the first file with the parameters from outside.
    pub(super) fn grow_model(&mut self) -> Outcome<()> {
        let module = &self.program.modules[0];
        let names = module.parameters.iter().map(|parameter| parameter.formal.name.as_str());
        for name in self.settings.parameters.keys() {
            if !names.clone().any(|known| known == name) {
                let (kind, suggestion) = ("parameter", crate::procedural::error::nearest(name, names));
                return self.error(
                    0,
                    0,
                    Problem::Unknown {
                        kind,
                        name: name.clone(),
                        suggestion,
                    },
                );
            }
        }
        let given = module
            .parameters
            .iter()
            .map(|p| self.settings.parameters.get(&p.formal.name).cloned());
        let turtle = Turtle {
            frame: Affine::IDENTITY,
            material: 0,
        };
        let (instance, path) = self.instance(0, given.collect(), (0, 0))?;
        self.grow_file(&turtle, 0, (instance, path), 0)?;
        Ok(())
    }

    /// Visits what a call leads to.
    pub(super) fn follow(&mut self, scope: &Scope, turtle: &Turtle, call: usize) -> Outcome<()> {
        let module = &self.program.modules[scope.module];
        let call = &module.calls[call];
        let depth = self.deeper(scope, call.at)?;
        let Some(index) = call.target.index else {
            return self.place_file(scope, turtle, call, depth);
        };
        let rule = self.rule(call.target.module, index);
        let instance = self.called_instance(scope, call)?;
        let inner = Scope {
            module: call.target.module,
            instance,
            base: self.stack.len(),
            path: step(scope.path, call.site),
            depth,
            level: 0,
        };
        self.bind((scope, call), &inner, (&rule.formals, rule.slots))?;
        if rule.is_part {
            self.place_part((scope, call.at), turtle, rule, index, inner)?;
        } else {
            self.visit_rule(turtle, rule, index, inner)?;
        }
        self.stack.truncate(inner.base);
        Ok(())
    }

    /// The value of a function of the file.
    pub(super) fn apply(&mut self, scope: &Scope, call: usize) -> Outcome<Value> {
        let call = &self.program.modules[scope.module].calls[call];
        let depth = self.deeper(scope, call.at)?;
        let function = &self.program.modules[call.target.module].functions[call.target.index.unwrap_or_default()];
        let inner = Scope {
            module: call.target.module,
            instance: self.called_instance(scope, call)?,
            base: self.stack.len(),
            path: step(scope.path, call.site),
            depth,
            level: 0,
        };
        self.bind((scope, call), &inner, (&function.formals, function.slots))?;
        let value = self.value(&inner, function.at, &function.value)?;
        self.stack.truncate(inner.base);
        Ok(value)
    }

    fn deeper(&mut self, scope: &Scope, at: At) -> Outcome<u32> {
        let depth = scope.depth + 1;
        self.usage.levels = self.usage.levels.max(depth);
        let limit = self.settings.limits.levels;
        if depth > limit {
            return self.error(scope.module, at, reached("levels", limit.into()));
        }
        Ok(depth)
    }

    /// Whose globals the callee sees: those of the caller, or an imported file's with its defaults.
    pub(super) fn called_instance(&mut self, scope: &Scope, call: &Call) -> Outcome<usize> {
        if call.module.is_none() {
            return Ok(scope.instance);
        }
        let module = call.target.module;
        if let Some(instance) = self.default_instances[module] {
            return Ok(instance);
        }
        let given = vec![None; self.program.modules[module].parameters.len()];
        let (instance, _) = self.instance(module, given, (scope.module, call.at))?;
        self.default_instances[module] = Some(instance);
        Ok(instance)
    }

    /// Puts a frame on the stack: arguments as the caller computes them, then defaults.
    pub(super) fn bind(
        &mut self,
        (scope, call): (&Scope, &'p Call),
        inner: &Scope,
        (formals, slots): (&'p [Formal], u32),
    ) -> Outcome<()> {
        self.stack.resize(inner.base + slots as usize, Value::NONE);
        for (slot, given) in call.given.iter().enumerate() {
            if let Some(argument) = given.map(|i| &call.arguments[i]) {
                self.stack[inner.base + slot] = self.value(scope, argument.at, &argument.value)?;
            }
        }
        for (slot, (formal, given)) in formals.iter().zip(&call.given).enumerate() {
            if let (None, Some(default)) = (given, &formal.default) {
                self.stack[inner.base + slot] = self.value(inner, formal.at, default)?;
            }
        }
        Ok(())
    }

    /// The body of a rule, or what stands in for it when its levels are used up.
    fn visit_rule(&mut self, turtle: &Turtle, rule: &'p Rule, index: usize, mut scope: Scope) -> Outcome<()> {
        let id = self.first_rule[scope.module] + index;
        scope.level = self.open[id];
        let body = match &rule.levels {
            Some(levels) if f64::from(scope.level) >= self.number(&scope, rule.at, levels, "`levels`")? => {
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

    fn place_part(
        &mut self,
        (caller, at): (&Scope, At),
        turtle: &Turtle,
        rule: &'p Rule,
        index: usize,
        inner: Scope,
    ) -> Outcome<()> {
        let arguments = &self.stack[inner.base..inner.base + rule.formals.len()];
        let mut key = vec![
            1,
            inner.module as u64,
            index as u64,
            inner.instance as u64,
            turtle.material as u64,
        ];
        arguments.iter().for_each(|argument| argument.key(&mut key));
        let path = step_name(self.settings.seed, &rule.name);
        let path = arguments.iter().fold(path, |path, argument| argument.step(path));
        let part = match self.known.get(&key) {
            Some(&part) if self.accounts[part].finished => part,
            Some(_) => return self.error(caller.module, at, Problem::PartInItself(rule.name.clone())),
            None => {
                let part = self.begin((caller, at), &rule.name, false)?;
                self.known.insert(key, part);
                let scope = Scope { path, ..inner };
                let declared = self.declared_bounds(&scope, rule)?;
                match declared {
                    Some(bounds) if self.measuring => self.parts[part].bounds = bounds,
                    _ => self.inside(part, turtle.material, true, |e, turtle| {
                        e.visit(&scope, turtle, &rule.body)
                    })?,
                }
                if declared.is_some_and(|bounds| exceeds(&self.parts[part].bounds, &bounds)) {
                    return self.error(inner.module, rule.at, Problem::BeyondDeclared(rule.name.clone()));
                }
                self.accounts[part].finished = true;
                if self.instances[inner.instance].is_default {
                    let formals = rule.formals.iter().map(|formal| formal.name.clone());
                    let values = self.stack[inner.base..].iter().cloned();
                    self.note_recipe(
                        part,
                        turtle.material,
                        inner.module,
                        Some(&rule.name),
                        formals.zip(values).collect(),
                    );
                }
                part
            }
        };
        self.place_known((caller, at), turtle, part)
    }

    fn declared_bounds(&mut self, scope: &Scope, rule: &'p Rule) -> Outcome<Option<Bounds>> {
        let Some((least, most)) = &rule.within else {
            return Ok(None);
        };
        let mut corner = |expr: &'p Expr| {
            let value = self.value(scope, rule.at, expr)?;
            self.point3(scope, rule.at, &value)
        };
        Ok(Some(Bounds::around([corner(least)?, corner(most)?])))
    }

    fn place_file(&mut self, scope: &Scope, turtle: &Turtle, call: &'p Call, depth: u32) -> Outcome<()> {
        let mut given = Vec::new();
        for argument in &call.given {
            given.push(match argument.map(|i| &call.arguments[i]) {
                Some(argument) => Some(self.value(scope, argument.at, &argument.value)?),
                None => None,
            });
        }
        let module = call.target.module;
        let (instance, path) = self.instance(module, given, (scope.module, call.at))?;
        let key = vec![2, instance as u64, turtle.material as u64];
        let part = match self.known.get(&key) {
            Some(&part) => part,
            None => {
                self.check_parts((scope, call.at))?;
                let part = self.grow_file(turtle, module, (instance, path), depth)?;
                self.known.insert(key, part);
                part
            }
        };
        self.place_known((scope, call.at), turtle, part)
    }

    /// The part that a file is as a whole.
    fn grow_file(
        &mut self,
        turtle: &Turtle,
        module: usize,
        (instance, path): (usize, u32),
        depth: u32,
    ) -> Outcome<usize> {
        let body = &self.program.modules[module];
        let name = body.file.rsplit('/').next().unwrap_or_default();
        let part = self.parts.len();
        self.parts
            .push(Part::new(name.strip_suffix(".dcg").unwrap_or(name), false));
        self.accounts.push(Account::default());
        let base = self.stack.len();
        self.stack.resize(base + body.body_slots as usize, Value::NONE);
        let scope = Scope {
            module,
            instance,
            base,
            path,
            depth,
            level: 0,
        };
        self.inside(part, turtle.material, true, |e, turtle| {
            body.body
                .iter()
                .try_for_each(|statement| e.visit(&scope, turtle, statement))
        })?;
        self.stack.truncate(base);
        self.accounts[part].finished = true;
        let names = body.parameters.iter().map(|parameter| parameter.formal.name.clone());
        let values = self.instances[instance].values.iter().flatten().cloned();
        let parameters = names.zip(values).collect();
        self.note_recipe(part, turtle.material, module, None, parameters);
        Ok(part)
    }

    /// Notes how a part can be made alone: when it places nothing, and nothing in it has taken on paint from outside.
    fn note_recipe(
        &mut self,
        part: usize,
        material: usize,
        module: usize,
        rule: Option<&str>,
        parameters: Vec<(String, Value)>,
    ) {
        let made = &mut self.parts[part];
        let is_alone = made.placements.is_empty() && made.models.is_empty() && !made.meshes.is_empty();
        if is_alone && (material == 0 || made.meshes.iter().all(|mesh| mesh.material != material)) {
            let (file, part) = (self.program.modules[module].file.clone(), rule.map(str::to_owned));
            made.recipe = Some(Recipe { file, part, parameters });
        }
    }

    /// A file with values for its parameters, and the path that belongs to them. Equal values, same instance.
    fn instance(
        &mut self,
        module: usize,
        given: Vec<Option<Value>>,
        (caller, at): (usize, At),
    ) -> Outcome<(usize, u32)> {
        let file = &self.program.modules[module];
        let count = file.parameters.len() + file.globals.len();
        let instance = self.instances.len();
        let is_default = given.iter().all(Option::is_none);
        self.instances.push(ModuleInstance {
            is_default,
            values: vec![None; count],
        });
        let mut scope = Scope {
            module,
            instance,
            base: self.stack.len(),
            path: self.settings.seed,
            depth: 0,
            level: 0,
        };
        for (slot, (parameter, given)) in file.parameters.iter().zip(given).enumerate() {
            let is_given = given.is_some();
            let value = match (given, &parameter.formal.default) {
                (Some(value), _) => value,
                (None, Some(default)) => self.value(&scope, parameter.formal.at, default)?,
                (None, None) => Value::NONE,
            };
            if let Some((least, most)) = &parameter.range {
                let min = self.number(&scope, parameter.formal.at, least, "the least value")?;
                let max = self.number(&scope, parameter.formal.at, most, "the most value")?;
                let Value::Number(number) = value else {
                    return self.error(
                        module,
                        parameter.formal.at,
                        Problem::NotANumber("a parameter with a range"),
                    );
                };
                if number < min || number > max {
                    let what = format!("`{}`", parameter.formal.name);
                    let (module, at) = if is_given {
                        (caller, at)
                    } else {
                        (module, parameter.formal.at)
                    };
                    return self.error(
                        module,
                        at,
                        Problem::OutOfRange {
                            what,
                            value: number,
                            min,
                            max,
                        },
                    );
                }
            }
            scope.path = value.step(scope.path);
            self.instances[instance].values[slot] = Some(value);
        }
        let parameters = &self.instances[instance].values[..file.parameters.len()];
        let mut key = vec![3, module as u64];
        parameters.iter().flatten().for_each(|value| value.key(&mut key));
        if let Some(&known) = self.known.get(&key) {
            self.instances.truncate(instance);
            return Ok((known, scope.path));
        }
        for (i, global) in file.globals.iter().enumerate() {
            let value = self.value(&scope, global.at, &global.value)?;
            self.instances[instance].values[file.parameters.len() + i] = Some(value);
        }
        self.known.insert(key, instance);
        Ok((instance, scope.path))
    }

    /// Statements whose geometry is named: a part of its own that is not shared.
    pub(super) fn visit_called(
        &mut self,
        scope: &Scope,
        turtle: &Turtle,
        name: &str,
        body: &'p Statement,
    ) -> Outcome<()> {
        let part = self.begin((scope, 0), name, true)?;
        self.inside(part, turtle.material, false, |e, turtle| e.visit(scope, turtle, body))?;
        self.accounts[part].finished = true;
        self.place_known((scope, 0), turtle, part)
    }

    fn check_parts(&self, (scope, at): (&Scope, At)) -> Outcome<()> {
        let limit = self.settings.limits.parts;
        if self.parts.len() as u64 >= limit {
            return self.error(scope.module, at, reached("parts", limit));
        }
        Ok(())
    }

    fn begin(&mut self, place: (&Scope, At), name: &str, is_called: bool) -> Outcome<usize> {
        self.check_parts(place)?;
        self.parts.push(Part::new(name, is_called));
        self.accounts.push(Account::default());
        Ok(self.parts.len() - 1)
    }

    /// Visits what is inside of a part, in its own space; a part that is shared does not see which rules are open.
    fn inside(
        &mut self,
        part: usize,
        material: usize,
        is_shared: bool,
        visit: impl FnOnce(&mut Self, &Turtle) -> Outcome<()>,
    ) -> Outcome<()> {
        let outer = std::mem::replace(&mut self.part, part);
        let shut = vec![0; if is_shared { self.open.len() } else { 0 }];
        let open = is_shared.then(|| std::mem::replace(&mut self.open, shut));
        visit(
            self,
            &Turtle {
                frame: Affine::IDENTITY,
                material,
            },
        )?;
        if let Some(open) = open {
            self.open = open;
        }
        self.part = outer;
        Ok(())
    }

    fn place_known(&mut self, (scope, at): (&Scope, At), turtle: &Turtle, part: usize) -> Outcome<()> {
        let inner = self.parts[part].bounds;
        let placements = self.accounts[part].placements.saturating_add(1);
        let account = &mut self.accounts[self.part];
        account.placements = account.placements.saturating_add(placements);
        let limit = self.settings.limits.placements;
        if self.accounts[self.part].placements > limit {
            return self.error(scope.module, at, reached("placements", limit));
        }
        let outer = &mut self.parts[self.part];
        outer.placements.push(Placement {
            part,
            frame: turtle.frame,
        });
        outer.bounds = outer.bounds.union(&placed(&inner, &turtle.frame));
        Ok(())
    }
}

/// A box around a box in a frame.
pub(super) fn placed(bounds: &Bounds, frame: &Affine) -> Bounds {
    if bounds.is_empty() {
        return Bounds::EMPTY;
    }
    Bounds::around(bounds.corners().map(|corner| frame.point(corner)))
}

fn exceeds(inner: &Bounds, outer: &Bounds) -> bool {
    let slack = SLACK * (1.0 + outer.diagonal_m());
    (0..3).any(|a| inner.min[a] < outer.min[a] - slack || inner.max[a] > outer.max[a] + slack)
}
