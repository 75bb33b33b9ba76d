//! What is a file with values for its parameters? An instance, whose globals its rules see, and a part when it is called.

use std::sync::Arc;

use super::part::PHASE;
use super::{Account, Evaluator, ModuleInstance, Outcome, Scope, Turtle, listed};
use crate::procedural::affine::Affine;
use crate::procedural::error::DcgError;
use crate::procedural::grown::Part;
use crate::procedural::problem::Problem;
use crate::procedural::recipe::Recipe;
use crate::procedural::syntax::{At, Call, Parameter};
use crate::procedural::value::Value;
use crate::procedural::wording::given_instead;

/// A value, and the module and place that say it; what is given from outside has none.
type Given = (Value, Option<(usize, At)>);

/// A file's name without its ending, in whatever case that is.
fn stem_of(name: &str) -> &str {
    match name.rsplit_once('.') {
        Some((stem, ending)) if ending.eq_ignore_ascii_case("dcg") => stem,
        _ => name,
    }
}

impl<'p> Evaluator<'p> {
    /// Grows the first file with the parameters from outside.
    pub(super) fn grow_model(&mut self) -> Outcome<()> {
        let turtle = Turtle {
            frame: Affine::IDENTITY,
            material: 0,
        };
        let given = self.given()?;
        self.grow_file(&turtle, 0, given, 0)?;
        Ok(())
    }

    /// The first file with the parameters from outside, and the path that belongs to them.
    pub(super) fn given(&mut self) -> Outcome<(usize, u32)> {
        self.program.refuse_unknown(self.settings.parameters.keys())?;
        let module = &self.program.modules[0];
        let given = module.parameters.iter().map(|Parameter { formal, .. }| {
            let value = self.settings.parameters.get(&formal.name)?;
            Some((value.clone(), None))
        });
        self.instance(0, &given.collect::<Vec<_>>(), None)
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
        let (instance, _) = self.instance(module, &given, Some((scope.module, call.at)))?;
        self.default_instances[module] = Some(instance);
        Ok(instance)
    }

    pub(super) fn place_file(&mut self, scope: &Scope, turtle: &Turtle, call: &'p Call, depth: u32) -> Outcome<()> {
        let module = call.target.module;
        let held = self.held;
        let mut given = vec![None; self.program.modules[module].parameters.len()];
        for (slot, argument) in call.given() {
            let value = self.written(scope, &argument.value)?;
            self.hold((scope.module, argument.value.at), value.listed())?;
            given[slot] = Some((value, Some((scope.module, argument.value.at))));
        }
        let made = self.instance(module, &given, Some((scope.module, call.at)));
        let placed = made.and_then(|made| {
            self.held = held;
            self.place_instance((scope, call), turtle, (module, made), depth)
        });
        placed.map_err(|mut error| {
            // What is given out of a range is named already.
            if error.problem.is_of_value() {
                let program = self.program;
                let odd = program.odd(module, |slot, _| given[slot].as_ref().map(|(value, _)| value));
                let told = |(name, is_list)| given_instead(name, is_list, Some(&program.modules[module].file));
                error.given = odd.map(told).or(error.given.take());
            }
            error
        })
    }

    fn place_instance(
        &mut self,
        (scope, call): (&Scope, &'p Call),
        turtle: &Turtle,
        (module, (instance, path)): (usize, (usize, u32)),
        depth: u32,
    ) -> Outcome<()> {
        let key = vec![2, instance as u64, turtle.material as u64];
        let part = match self.known.get(&key) {
            Some(&part) => part,
            None => {
                self.check_parts((scope, call.at))?;
                let part = self.grow_file(turtle, module, (instance, path), depth);
                let part = part.map_err(|error| self.traced((scope.module, call.at), error))?;
                self.known.insert(key, part);
                part
            }
        };
        self.place_known((scope, call.at), turtle, part)
    }

    /// The part that a file is as a whole.
    pub(super) fn grow_file(
        &mut self,
        turtle: &Turtle,
        module: usize,
        (instance, path): (usize, u32),
        depth: u32,
    ) -> Outcome<usize> {
        let body = &self.program.modules[module];
        let name = body.file.rsplit('/').next().unwrap_or_default();
        let part = self.parts.len();
        self.parts.push(Part::new(stem_of(name), None));
        self.accounts.push(Account {
            has_phase: body.parameters.iter().any(|parameter| parameter.formal.name == PHASE),
            ..Account::default()
        });
        let base = self.stack.len();
        let scope = Scope {
            module,
            instance,
            base,
            path,
            depth,
            level: 0,
            held: self.held,
        };
        self.open_frame(base, body.body_slots);
        self.inside(part, turtle.material, true, |e, turtle| {
            body.body
                .iter()
                .try_for_each(|statement| e.visit(&scope, turtle, statement))
        })?;
        self.close_frame(&scope);
        self.accounts[part].finished = true;
        self.note_recipe(part, turtle.material, |e| {
            let names = body.parameters.iter().map(|parameter| parameter.formal.name.clone());
            let values = e.instances[instance].values.iter().flatten().cloned();
            Recipe {
                file: body.file.clone(),
                given: Arc::default(),
                part: None,
                parameters: names.zip(values).collect(),
            }
        });
        Ok(part)
    }

    /// A file with values for its parameters, and the path that belongs to them. Equal values, same instance.
    pub(super) fn instance(
        &mut self,
        module: usize,
        given: &[Option<Given>],
        caller: Option<(usize, At)>,
    ) -> Outcome<(usize, u32)> {
        let file = &self.program.modules[module];
        let count = file.parameters.len() + file.globals.len();
        let instance = self.instances.len();
        let names = file.parameters.iter().map(|parameter| &parameter.formal.name);
        let those_given = names.zip(given).filter_map(|(name, given)| {
            let (value, _) = given.as_ref()?;
            Some((name.clone(), value.clone()))
        });
        self.instances_made += 1;
        self.instances.push(ModuleInstance {
            serial: self.instances_made,
            given: those_given.collect(),
            values: vec![None; count],
            surfaces: vec![None; file.materials.len()],
        });
        let mut scope = Scope {
            module,
            instance,
            base: self.stack.len(),
            path: self.settings.seed,
            depth: 0,
            level: 0,
            held: self.held,
        };
        for (slot, (parameter, given)) in file.parameters.iter().zip(given).enumerate() {
            let (value, place) = match (given, &parameter.formal.default) {
                (Some(given), _) => given.clone(),
                (None, Some(default)) => {
                    let value = self.written(&scope, default);
                    let value = value.map_err(|error| self.traced_to(caller, error))?;
                    (value, Some((module, default.at)))
                }
                (None, None) => (Value::NONE, Some((module, parameter.formal.at))),
            };
            self.hold(place.unwrap_or((module, parameter.formal.at)), value.listed())?;
            self.check_range(&scope, parameter, &value, place)?;
            scope.path = value.step(scope.path);
            self.instances[instance].values[slot] = Some(value);
        }
        self.held = scope.held;
        let parameters = &self.instances[instance].values[..file.parameters.len()];
        let mut key = vec![3, module as u64];
        parameters.iter().flatten().for_each(|value| value.key(&mut key));
        let place = caller.unwrap_or((module, 0));
        let lists = listed(parameters.iter().flatten());
        let called = Scope {
            module: place.0,
            ..scope
        };
        self.count(&called, place.1, lists)?;
        if let Some(&known) = self.known.get(&key) {
            self.instances.truncate(instance);
            return Ok((known, scope.path));
        }
        for (i, global) in file.globals.iter().enumerate() {
            let value = self.written(&scope, &global.value);
            let value = value.map_err(|error| self.traced_to(caller, error))?;
            self.keep((module, global.at), value.size())?;
            self.instances[instance].values[file.parameters.len() + i] = Some(value);
        }
        self.keep(place, key.len())?;
        self.known.insert(key, instance);
        Ok((instance, scope.path))
    }

    /// The error, with the call in which it happened if it was one.
    fn traced_to(&self, caller: Option<(usize, At)>, error: Box<DcgError>) -> Box<DcgError> {
        match caller {
            Some(place) => self.traced(place, error),
            None => error,
        }
    }

    fn check_range(
        &mut self,
        scope: &Scope,
        parameter: &'p Parameter,
        value: &Value,
        place: Option<(usize, At)>,
    ) -> Outcome<()> {
        let Some([least, most]) = &parameter.range else {
            return Ok(());
        };
        let min = self.number_of(scope, least, "the least value")?;
        let max = self.number_of(scope, most, "the most value")?;
        if min > max {
            let (what, wanted) = ("this range", "from the least value to the most");
            return self.error(scope.module, least.at, Problem::Amount { what, wanted });
        }
        let name = &parameter.formal.name;
        let problem = match *value {
            Value::Number(value) if min <= value && value <= max => return Ok(()),
            Value::Number(value) => {
                let what = format!("`{name}`");
                Problem::OutOfRange { what, value, min, max }
            }
            Value::List(..) => Problem::ListInRange(name.clone()),
        };
        match place {
            Some((module, at)) => self.error(module, at, problem),
            None => Err(DcgError::of_whole(&self.program.modules[scope.module].file, problem)),
        }
    }
}
