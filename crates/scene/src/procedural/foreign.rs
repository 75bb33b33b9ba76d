//! What is wrong where a value of an imported file is read? Only what a file makes by itself can be asked for: functions, not values.

use super::link::Program;
use super::problem::Problem;
use super::spelling::nearest;
use super::syntax::Module;

impl Program {
    /// Why `alias.name` is no value, of the module that is called so.
    pub(super) fn value_of_file(&self, module: usize, (alias, name): (&str, &str)) -> Problem {
        let module = &self.modules[module];
        let named = |known: &str| known == name;
        if let Some(function) = module.functions.iter().find(|function| named(&function.name)) {
            let formals: Vec<&str> = function.formals.iter().map(|formal| formal.name.as_str()).collect();
            return Problem::FunctionAsValue {
                name: format!("{alias}.{name}"),
                formals: formals.join(", "),
            };
        }
        let is = match module {
            _ if module.rules.iter().any(|rule| named(&rule.name)) => Some("rule"),
            _ if module.materials.iter().any(|material| named(&material.name)) => Some("material"),
            _ => None,
        };
        let name = name.to_owned();
        if let Some(is) = is {
            let wanted = "function";
            return Problem::OtherKind { name, is, wanted };
        }
        let file = module.file.clone();
        if values(module).any(named) {
            let getter = free_name(module, &name);
            let call = format!("{alias}.{getter}()");
            return Problem::ValueOfFile {
                file,
                name,
                getter,
                call,
            };
        }
        let functions = module.functions.iter().map(|function| function.name.as_str());
        let known: Vec<&str> = functions.chain(values(module)).collect();
        Problem::UnknownOfFile {
            kind: "value or function",
            suggestion: nearest(&name, known.iter().copied()),
            known: known.into_iter().map(str::to_owned).collect(),
            name,
            file,
        }
    }
}

/// The parameters and values of a file.
fn values(module: &Module) -> impl Iterator<Item = &str> {
    let parameters = module.parameters.iter().map(|parameter| parameter.formal.name.as_str());
    parameters.chain(module.globals.iter().map(|global| global.name.as_str()))
}

/// A name for a function that gives a value of the file, which nothing there has.
fn free_name(module: &Module, value: &str) -> String {
    let is_taken = |name: &str| {
        values(module).any(|known| known == name)
            || module.functions.iter().any(|known| known.name == name)
            || module.rules.iter().any(|known| known.name == name)
            || module.materials.iter().any(|known| known.name == name)
            || module.imports.iter().any(|known| known.alias == name)
    };
    let mut name = format!("get_{value}");
    while is_taken(&name) {
        name += "_";
    }
    name
}
