//! What does each name of a file lead to? Imports are read, calls are joined to what they call.

use std::collections::{BTreeMap, HashMap};

use super::error::DcgError;
use super::evaluator::Kept;
use super::limits::{MAX_ALL_TEXT_BYTES, MAX_MODULES, reached};
use super::operation::BuiltIn;
use super::parser::{at_its_operator, parse};
use super::problem::Problem;
use super::solid::SolidKind;
use super::spelling::nearest;
use super::syntax::{At, Call, Formal, Module, Target, Transform, Wanted};
use super::wording::cut;

/// Gives the texts of files. Whoever implements it decides what a path may lead to.
pub trait Loader {
    /// The text of a file. `path` is as an `import` wrote it.
    ///
    /// # Errors
    /// With a reason for the author, when there is no such file or it cannot be read.
    fn load(&self, path: &str) -> Result<String, String>;
}

/// No other files.
#[derive(Debug, Clone, Copy)]
pub struct NoImports;

impl Loader for NoImports {
    fn load(&self, _: &str) -> Result<String, String> {
        Err("there are no other files here".to_owned())
    }
}

/// A model that was read and found sound: the first file and all that it imports.
#[derive(Debug, Clone)]
pub struct Program {
    pub(super) modules: Vec<Module>,
    /// Of what models have grown before.
    pub(super) kept: Kept,
}

impl Program {
    /// Reads a file and what it imports.
    ///
    /// # Errors
    /// When one of them cannot be read or says something that has no meaning.
    pub fn read(file: &str, text: String, loader: &dyn Loader) -> Result<Self, Box<DcgError>> {
        let mut modules = vec![parse(file, text)?];
        let mut known = BTreeMap::from([(file.to_owned(), 0)]);
        let mut text_bytes = modules[0].text.len();
        let mut next = 0;
        while next < modules.len() {
            for i in 0..modules[next].imports.len() {
                let import = &modules[next].imports[i];
                let (path, at) = (import.path.clone(), import.at);
                let module = match known.get(&path) {
                    Some(&module) => module,
                    None if modules.len() == MAX_MODULES => {
                        return Err(modules[next].error(at, reached("files", MAX_MODULES as u64)));
                    }
                    None => {
                        let text = loader.load(&path).map_err(|reason| {
                            let path = path.clone();
                            modules[next].error(at, Problem::Import { path, reason })
                        })?;
                        text_bytes += text.len();
                        if text_bytes > MAX_ALL_TEXT_BYTES {
                            let reached = reached("bytes of text in all files", MAX_ALL_TEXT_BYTES as u64);
                            return Err(modules[next].error(at, reached));
                        }
                        modules.push(parse(&path, text)?);
                        known.insert(path, modules.len() - 1);
                        modules.len() - 1
                    }
                };
                modules[next].imports[i].module = module;
            }
            next += 1;
        }
        let program = Self {
            modules,
            kept: Kept::default(),
        };
        program.refuse_cycles()?;
        program.linked()
    }

    /// The parameters that the model can be given, with their names.
    pub fn parameters(&self) -> impl Iterator<Item = &str> {
        self.modules[0]
            .parameters
            .iter()
            .map(|parameter| parameter.formal.name.as_str())
    }

    /// The same as one would say it: `height from 3 to 20, else 8`, with the default as it is written.
    pub fn parameters_told(&self) -> impl Iterator<Item = String> {
        let module = &self.modules[0];
        module.parameters.iter().map(|parameter| {
            let default: Vec<&str> = module.text[parameter.default.clone()].split_whitespace().collect();
            format!("{}, else {}", parameter.shown, cut(&default.join(" ")))
        })
    }

    /// The files that it consists of, with their texts; the first is the model's own.
    pub fn files(&self) -> impl Iterator<Item = (&str, &str)> {
        self.modules
            .iter()
            .map(|module| (module.file.as_str(), module.text.as_str()))
    }

    /// Why a glTF file that a rule places cannot be had, said where it is placed first.
    #[must_use]
    pub fn model_error(&self, path: &str, reason: String) -> Box<DcgError> {
        let placed = |module: &&Module| module.models.iter().any(|(_, model)| model == path);
        let module = self.modules.iter().find(placed).unwrap_or(&self.modules[0]);
        let at = module
            .models
            .iter()
            .find(|(_, model)| model == path)
            .map_or(0, |(at, _)| *at);
        let path = path.to_owned();
        module.error(at, Problem::Model { path, reason })
    }

    /// Removes files that import nothing that is left, until none is left; what stays is in a cycle or leads to one.
    fn refuse_cycles(&self) -> Result<(), Box<DcgError>> {
        let mut left = vec![true; self.modules.len()];
        let is_open = |import: &super::syntax::Import, left: &[bool]| left[import.module];
        while let Some(free) =
            (0..left.len()).find(|&i| left[i] && !self.modules[i].imports.iter().any(|import| is_open(import, &left)))
        {
            left[free] = false;
        }
        // From a file that is left, go on along what is left: the first met twice is in a cycle.
        let Some(mut at) = left.iter().position(|left| *left) else {
            return Ok(());
        };
        let mut met = vec![false; left.len()];
        loop {
            met[at] = true;
            let module = &self.modules[at];
            let Some(import) = module.imports.iter().find(|import| is_open(import, &left)) else {
                return Ok(());
            };
            if met[import.module] {
                let path = self.modules[import.module].file.clone();
                return Err(module.error(import.at, Problem::ImportCycle(path)));
            }
            at = import.module;
        }
    }

    fn linked(mut self) -> Result<Self, Box<DcgError>> {
        let calls = self.modules.iter_mut().map(|module| std::mem::take(&mut module.calls));
        let mut calls: Vec<Vec<Call>> = calls.collect();
        let names: Vec<Names> = self.modules.iter().map(Names::of).collect();
        let mut callees = HashMap::new();
        for (from, calls) in calls.iter_mut().enumerate() {
            for call in calls {
                let found = self.target(from, call, &names).and_then(|target| {
                    let callee = callees
                        .entry((call.wanted, target.module, target.index))
                        .or_insert_with(|| Callee::of(self.formals(target, call.wanted)));
                    Ok((target, callee.given(call)?))
                });
                let (target, given) = found.map_err(|wrong| {
                    let (at, problem) = at_its_operator(&self.modules[from].text, wrong);
                    self.modules[from].error(at, problem)
                })?;
                call.target = target;
                call.given = given;
            }
        }
        for (module, calls) in self.modules.iter_mut().zip(calls) {
            module.calls = calls;
        }
        Ok(self)
    }

    /// What a call leads to.
    fn target(&self, from: usize, call: &Call, names: &[Names]) -> Result<Target, (At, Problem)> {
        let own = &self.modules[from];
        let import = |alias: &str| names[from].imports.get(alias).map(|index| &own.imports[*index]);
        Ok(match &call.module {
            None => match (names[from].index_of(call), import(&call.name)) {
                (Some(index), _) => Target {
                    module: from,
                    index: Some(index),
                },
                (None, Some(import)) if call.wanted == Wanted::Shape => Target {
                    module: import.module,
                    index: None,
                },
                _ => return Err((call.at, self.unknown(from, call))),
            },
            Some(alias) => {
                let Some(import) = import(alias) else {
                    let aliases = own.imports.iter().map(|import| import.alias.as_str());
                    let (kind, name, suggestion) = ("imported file", alias.clone(), nearest(alias, aliases));
                    return Err((call.at, Problem::Unknown { kind, name, suggestion }));
                };
                if call.is_value {
                    return Err((call.at, self.value_of_file(import.module, (alias, &call.name))));
                }
                match names[import.module].index_of(call) {
                    Some(index) => Target {
                        module: import.module,
                        index: Some(index),
                    },
                    None => return Err((call.at, self.unknown(import.module, call))),
                }
            }
        })
    }

    /// What a call can give.
    pub(super) fn formals(&self, target: Target, wanted: Wanted) -> Vec<&Formal> {
        let module = &self.modules[target.module];
        match (wanted, target.index) {
            (_, None) => module.parameters.iter().map(|parameter| &parameter.formal).collect(),
            (Wanted::Shape, Some(index)) => module.rules[index].formals.iter().collect(),
            (Wanted::Function, Some(index)) => module.functions[index].formals.iter().collect(),
            (Wanted::Material, Some(index)) => module.materials[index].formals.iter().collect(),
        }
    }

    fn names(&self, module: usize, wanted: Wanted) -> Vec<&str> {
        let module = &self.modules[module];
        match wanted {
            Wanted::Shape => module.rules.iter().map(|rule| rule.name.as_str()).collect(),
            Wanted::Function => module.functions.iter().map(|function| function.name.as_str()).collect(),
            Wanted::Material => module.materials.iter().map(|material| material.name.as_str()).collect(),
        }
    }

    /// What else a name is that was called as something that it is not.
    fn other_kind(&self, module: usize, call: &Call) -> Option<&'static str> {
        let has = |wanted| self.names(module, wanted).contains(&call.name.as_str());
        let is_own = call.module.is_none();
        if has(Wanted::Shape) {
            Some("rule")
        } else if has(Wanted::Function) || (is_own && BuiltIn::ALL.iter().any(|(known, ..)| *known == call.name)) {
            Some("function")
        } else if has(Wanted::Material) {
            Some("material")
        } else {
            (is_own && SolidKind::named(&call.name).is_some()).then_some("solid")
        }
    }

    fn unknown(&self, module: usize, call: &Call) -> Problem {
        let imports = self.modules[module].imports.iter().map(|import| import.alias.as_str());
        let own = self.names(module, call.wanted).into_iter();
        let names: Vec<&str> = match call.wanted {
            // Of an imported file only what it has itself can be called.
            _ if call.module.is_some() => own.collect(),
            Wanted::Shape => own
                .chain(imports)
                .chain(SolidKind::names())
                .chain(Transform::NAMES)
                .chain(["paint"])
                .collect(),
            Wanted::Function => own.chain(BuiltIn::ALL.map(|(name, ..)| name)).collect(),
            Wanted::Material => own.collect(),
        };
        let kind = match call.wanted {
            Wanted::Shape => "rule",
            Wanted::Function => "function",
            Wanted::Material => "material",
        };
        if let Some(is) = self.other_kind(module, call) {
            let (name, wanted) = (call.name.clone(), kind);
            return Problem::OtherKind { name, is, wanted };
        }
        let name = call.name.clone();
        let suggestion = nearest(&call.name, names.iter().copied());
        if call.module.is_some() {
            return Problem::UnknownOfFile {
                kind,
                name,
                file: self.modules[module].file.clone(),
                suggestion,
                known: names.into_iter().map(str::to_owned).collect(),
            };
        }
        Problem::Unknown { kind, name, suggestion }
    }
}

/// Where the names of a file lead, so that finding one takes as long however many there are.
struct Names<'m> {
    rules: HashMap<&'m str, usize>,
    functions: HashMap<&'m str, usize>,
    materials: HashMap<&'m str, usize>,
    imports: HashMap<&'m str, usize>,
}

impl<'m> Names<'m> {
    fn of(module: &'m Module) -> Self {
        /// No name is declared twice.
        fn by_name<'m, T>(items: &'m [T], name: impl Fn(&'m T) -> &'m str) -> HashMap<&'m str, usize> {
            items.iter().map(name).zip(0..).collect()
        }
        Self {
            rules: by_name(&module.rules, |rule| &rule.name),
            functions: by_name(&module.functions, |function| &function.name),
            materials: by_name(&module.materials, |material| &material.name),
            imports: by_name(&module.imports, |import| &import.alias),
        }
    }

    fn index_of(&self, call: &Call) -> Option<usize> {
        let known = match call.wanted {
            Wanted::Shape => &self.rules,
            Wanted::Function => &self.functions,
            Wanted::Material => &self.materials,
        };
        known.get(call.name.as_str()).copied()
    }
}

/// What a call can give, made once for all calls of it.
struct Callee<'m> {
    formals: Vec<&'m Formal>,
    places: HashMap<&'m str, usize>,
    /// Places of those without a default.
    needed: Vec<usize>,
}

impl<'m> Callee<'m> {
    fn of(formals: Vec<&'m Formal>) -> Self {
        let needed = (0..formals.len()).filter(|place| formals[*place].default.is_none());
        Self {
            places: formals.iter().map(|formal| formal.name.as_str()).zip(0..).collect(),
            needed: needed.collect(),
            formals,
        }
    }

    /// The formals that a call gives, and the argument of each. Takes no longer the more formals there are.
    fn given(&self, call: &Call) -> Result<Vec<(usize, usize)>, (At, Problem)> {
        let mut given: BTreeMap<usize, usize> = BTreeMap::new();
        for (i, argument) in call.arguments.iter().enumerate() {
            let place = match &argument.name {
                None => i,
                Some(name) => *self.places.get(name.as_str()).ok_or_else(|| {
                    let known = self.formals.iter().map(|formal| formal.name.clone());
                    let problem = Problem::UnknownArgument {
                        name: name.clone(),
                        callee: call.name.clone(),
                        suggestion: nearest(name, self.formals.iter().map(|formal| formal.name.as_str())),
                        known: known.collect(),
                    };
                    (argument.value.at, problem)
                })?,
            };
            let Some(formal) = self.formals.get(place) else {
                let (callee, most) = (call.name.clone(), self.formals.len());
                return Err((argument.value.at, Problem::TooManyArguments { callee, most }));
            };
            if given.insert(place, i).is_some() {
                return Err((argument.value.at, Problem::ArgumentTwice(formal.name.clone())));
            }
        }
        match self.needed.iter().find(|place| !given.contains_key(place)) {
            None => Ok(given.into_iter().collect()),
            Some(place) => {
                let (callee, name) = (call.name.clone(), self.formals[*place].name.clone());
                Err((call.at, Problem::MissingArgument { callee, name }))
            }
        }
    }
}

impl Module {
    /// An error at a place of this file.
    pub(super) fn error(&self, at: At, problem: Problem) -> Box<DcgError> {
        DcgError::at(&self.file, &self.text, at, problem)
    }
}
