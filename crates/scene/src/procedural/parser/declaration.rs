//! What does a file declare? Imports, parameters, values, materials, functions and rules; all else is its body.

use std::collections::HashMap;

use super::{Declared, Parsed, Parser, unknown, usage};
use crate::procedural::lexer::Kind;
use crate::procedural::operation::BuiltIn;
use crate::procedural::problem::Problem;
use crate::procedural::solid::SolidKind;
use crate::procedural::spelling::nearest;
use crate::procedural::syntax::{
    At, Formal, Function, Import, MaterialRule, Named, Parameter, Property, Rule, Written,
};

/// Words with which a statement begins.
pub(super) const STATEMENTS: [&str; 18] = [
    "called",
    "choose",
    "edges",
    "else",
    "for",
    "heights",
    "if",
    "impostor",
    "let",
    "model",
    "move",
    "paint",
    "roll",
    "scale",
    "scatter",
    "tilt",
    "turn",
    "viewpoint",
];
/// Words with which a declaration begins.
pub(super) const DECLARATIONS: [&str; 6] = ["import", "parameter", "material", "function", "rule", "part"];

/// What opens and what closes.
const PAIRS: [(&str, &str); 3] = [("{", "}"), ("(", ")"), ("[", "]")];

/// Values that the language gives, whatever a file calls its own.
const OWN_VALUES: [&str; 2] = ["detail", "level"];

/// Words that nothing else can be called by, since statements and values begin with them.
pub(super) fn is_reserved(name: &str) -> bool {
    let is_function = BuiltIn::ALL.iter().any(|(known, ..)| *known == name);
    is_function || SolidKind::named(name).is_some() || STATEMENTS.contains(&name) || DECLARATIONS.contains(&name)
}

impl<'t> Parser<'t> {
    pub(super) fn file(&mut self) -> Parsed<()> {
        loop {
            match self.peek().kind {
                Kind::End => break,
                Kind::Name(word) if DECLARATIONS.contains(&word) => {
                    self.next += 1;
                    self.declaration(word)?;
                }
                Kind::Name("let") => {
                    self.next += 1;
                    let (name, at) = self.file_value("a name for the value")?;
                    self.expect_for("=", usage::VALUE)?;
                    let value = self.value_without(name)?;
                    let name = name.to_owned();
                    self.module.globals.push(Named { name, at, value });
                }
                _ => {
                    self.refuse_unopened()?;
                    let statement = self.statement()?;
                    self.module.body.push(statement);
                }
            }
        }
        self.module.body_slots = self.slots;
        self.resolve_uses()
    }

    /// Refuses what closes something where nothing is open.
    fn refuse_unopened(&self) -> Parsed<()> {
        let found = PAIRS.iter().find(|(_, close)| self.is_symbol(close));
        found.map_or(Ok(()), |(open, close)| {
            Err((self.peek().at, Problem::Unopened(close, open)))
        })
    }

    fn declaration(&mut self, word: &str) -> Parsed<()> {
        match word {
            "import" => self.import(),
            "parameter" => self.parameter(),
            "material" => self.material(),
            "function" => self.function(),
            _ => self.rule(word == "part"),
        }
    }

    /// A name for what is called by a word of its own.
    fn declared(&mut self, what: &str) -> Parsed<(&'t str, At)> {
        let (name, at) = self.declared_value(what)?;
        if is_reserved(name) {
            return Err((at, Problem::Reserved(name.to_owned())));
        }
        Ok((name, at))
    }

    /// A name for something of the whole file.
    fn declared_value(&mut self, what: &str) -> Parsed<(&'t str, At)> {
        let (name, at) = self.name(what)?;
        self.declared.add(self.text, (name, at))?;
        Ok((name, at))
    }

    /// The same for a value, which is read by that name alone.
    fn file_value(&mut self, what: &str) -> Parsed<(&'t str, At)> {
        let (name, at) = self.declared_value(what)?;
        if OWN_VALUES.contains(&name) {
            return Err((at, Problem::OwnValue(name.to_owned())));
        }
        Ok((name, at))
    }

    fn import(&mut self) -> Parsed<()> {
        let path_at = self.peek().at;
        let path = self.path("the file to import, in quotes")?;
        if !self.takes_word("as") {
            return self.expected("`as` and a name for the file");
        }
        let (alias, _) = self.declared("a name for the file")?;
        self.aliases.insert(alias);
        let alias = alias.to_owned();
        self.module.imports.push(Import {
            alias,
            at: path_at,
            path,
            module: 0,
        });
        Ok(())
    }

    fn parameter(&mut self) -> Parsed<()> {
        let (name, at) = self.file_value("a name for the parameter")?;
        self.expect_for("=", usage::VALUE)?;
        let from = self.peek().at as usize;
        let default = Some(self.value_without(name)?);
        let to = self.peek().at as usize;
        let range = if self.takes_word("from") {
            Some(self.span(usage::RANGE)?)
        } else {
            None
        };
        let shown = on_one_line(&self.text[to..self.peek().at as usize]);
        let shown = if range.is_some() && shown.len() <= MOST_SHOWN {
            format!("{name} {shown}")
        } else {
            name.to_owned()
        };
        let name = name.to_owned();
        let formal = Formal { name, at, default };
        self.module.parameters.push(Parameter {
            formal,
            range,
            default: from..to,
            shown,
        });
        Ok(())
    }

    /// `LEAST to MOST`
    fn span(&mut self, usage: &str) -> Parsed<[Written; 2]> {
        let least = self.written()?;
        self.expect_word("to", usage)?;
        Ok([least, self.written()?])
    }

    fn formals(&mut self) -> Parsed<Vec<Formal>> {
        let opened = self.peek().at;
        self.expect_for("(", usage::FORMALS)?;
        let (mut formals, mut given) = (Vec::new(), Declared::default());
        while !self.takes(")") {
            let (name, at) = self.name("a name for a parameter")?;
            given.add(self.text, (name, at))?;
            let default = if self.takes("=") { Some(self.written()?) } else { None };
            self.bind(name);
            let name = name.to_owned();
            formals.push(Formal { name, at, default });
            self.separated(opened, ["(", ")"])?;
        }
        Ok(formals)
    }

    fn material(&mut self) -> Parsed<()> {
        let (name, _) = self.declared("a name for the material")?;
        let ((formals, properties), slots) = self.framed(|parser| {
            let formals = if parser.is_symbol("(") {
                parser.formals()?
            } else {
                Vec::new()
            };
            parser.opens(usage::PROPERTIES)?;
            let mut properties = Vec::new();
            while !parser.closes() {
                if let Some(word) = parser.declares() {
                    return parser.misplaced(word);
                }
                let (name, at) = parser.name("a property, such as `colour`")?;
                let known = Property::ALL.iter().find(|(known, _)| *known == name);
                let Some((_, property)) = known else {
                    let names = Property::ALL.iter().map(|(name, _)| *name);
                    let (suggestion, known) = (nearest(name, names.clone()), names.map(str::to_owned).collect());
                    let name = name.to_owned();
                    let problem = Problem::UnknownProperty {
                        name,
                        suggestion,
                        known,
                    };
                    return Err((at, problem));
                };
                if properties.iter().any(|(given, _)| given == property) {
                    return Err((at, Problem::ArgumentTwice(name.to_owned())));
                }
                parser.expect_for("=", usage::VALUE)?;
                properties.push((*property, parser.written()?));
                parser.takes(",");
            }
            Ok((formals, properties))
        })?;
        let name = name.to_owned();
        self.module.materials.push(MaterialRule {
            name,
            formals,
            properties,
            slots,
        });
        Ok(())
    }

    fn function(&mut self) -> Parsed<()> {
        let (name, _) = self.declared("a name for the function")?;
        let ((formals, value), slots) = self.framed(|parser| {
            let formals = parser.formals()?;
            parser.expect_for("=", usage::VALUE_OF_FUNCTION)?;
            Ok((formals, parser.written()?))
        })?;
        let name = name.to_owned();
        self.module.functions.push(Function {
            name,
            formals,
            value,
            slots,
        });
        Ok(())
    }

    fn rule(&mut self, is_part: bool) -> Parsed<()> {
        let (name, at) = self.declared("a name for the rule")?;
        self.in_part = is_part;
        let (mut rule, slots) = self.framed(|parser| {
            let formals = parser.formals()?;
            let levels_at = parser.peek().at;
            let levels = if parser.takes_word("levels") {
                Some(parser.written()?)
            } else {
                None
            };
            if is_part && levels.is_some() {
                return Err((levels_at, Problem::LevelsOfPart));
            }
            let within_at = parser.peek().at;
            let within = if parser.takes_word("within") {
                if !is_part {
                    return Err((within_at, Problem::WithinOfRule));
                }
                Some(parser.span(usage::WITHIN)?)
            } else {
                None
            };
            let body = parser.block()?;
            let then_at = parser.peek().at;
            let then = if parser.takes_word("then") {
                if levels.is_none() {
                    return Err((then_at, Problem::ThenWithoutLevels));
                }
                Some(parser.statement()?)
            } else {
                None
            };
            let name = name.to_owned();
            Ok(Rule {
                name,
                at,
                is_part,
                formals,
                levels,
                within,
                body,
                then,
                slots: 0,
            })
        })?;
        self.in_part = false;
        rule.slots = slots;
        self.module.rules.push(rule);
        Ok(())
    }

    /// Finds the globals that were used, now that all of them are known.
    fn resolve_uses(&mut self) -> Parsed<()> {
        let module = &mut self.module;
        let parameters = module.parameters.iter().map(|parameter| parameter.formal.name.as_str());
        let names: Vec<&str> = parameters
            .chain(module.globals.iter().map(|global| global.name.as_str()))
            .collect();
        let slots: HashMap<&str, usize> = names.iter().copied().zip(0..).collect();
        for used in &mut module.uses {
            match slots.get(used.name.as_str()) {
                Some(slot) => used.slot = *slot,
                None => {
                    let name = used.name.clone();
                    let is_lone = self.lone.get(name.as_str()).is_some_and(|at| *at < used.at);
                    let problem = match formals_of(&name, &module.functions) {
                        _ if is_lone => Problem::LoneLet(name),
                        Some(formals) => Problem::FunctionAsValue { name, formals },
                        None if self.own.contains(&used.at) => Problem::OfItself(name),
                        None => unknown("value", &name, names.into_iter().chain(OWN_VALUES)),
                    };
                    return Err((used.at, problem));
                }
            }
        }
        Ok(())
    }
}

/// What a function of the language or of these takes, where one is called so.
fn formals_of(name: &str, functions: &[Function]) -> Option<String> {
    if let Some((.., formals)) = BuiltIn::ALL.iter().find(|(known, ..)| *known == name) {
        return Some(formals.join(", "));
    }
    let function = functions.iter().find(|function| function.name == name)?;
    let formals: Vec<&str> = function.formals.iter().map(|formal| formal.name.as_str()).collect();
    Some(formals.join(", "))
}

/// The same file, however its path is written: with `./` before it, or through folders that it leaves again. One that leaves
/// the folder of the first file keeps what it leaves it by.
#[must_use]
pub fn tidied(path: &str) -> String {
    let path = path.trim_start_matches("./");
    let mut parts: Vec<&str> = Vec::new();
    if !path.split('/').any(|part| part == "..") {
        return path.to_owned();
    }
    for part in path.split('/').filter(|part| *part != ".") {
        match parts.last() {
            Some(last) if part == ".." && !matches!(*last, "" | "..") => _ = parts.pop(),
            _ => parts.push(part),
        }
    }
    parts.join("/")
}

/// Whether a path names nothing: there are only the blanks of the language in it.
pub(super) fn is_blank(path: &str) -> bool {
    path.bytes().all(|byte| matches!(byte, b' ' | b'\t' | b'\r' | b'\n'))
}

/// Longest range of a parameter that is shown, letters.
const MOST_SHOWN: usize = 60;

/// Values as they are written, without comments.
fn on_one_line(written: &str) -> String {
    let lines = written.split(['\n', '\r']);
    let lines = lines.map(|line| line.split_once("//").map_or(line, |(before, _)| before));
    let words: Vec<_> = lines.flat_map(str::split_ascii_whitespace).collect();
    words.join(" ")
}
