//! What is done at a place? Groups, selections, values, transforms, materials, calls, solids and enumerators.

use super::declaration::{DECLARATIONS, STATEMENTS, is_reserved};
use super::expression::unnamed;
use super::{Parsed, Parser};
use crate::procedural::lexer::Kind;
use crate::procedural::problem::Problem;
use crate::procedural::solid::{Formals, IMPOSTOR, SolidKind};
use crate::procedural::spelling::nearest;
use crate::procedural::syntax::{At, Statement, Transform, Wanted, Written};

/// Words that stand inside of a statement or declaration, with one that has them.
const LATER: [(&str, &str); 8] = [
    ("as", "scatter 60 as x, z in 180 by 180 box(1, 1, 1)"),
    ("by", "scatter 60 as x, z in 180 by 180 box(1, 1, 1)"),
    ("from", "parameter height = 8 from 3 to 20"),
    ("in", "for i in 10 box(1, 1, 1)"),
    ("levels", "rule branch() levels 4 { … }"),
    ("steps", "heights x, z in 50 by 50 steps 20 by 20 = 0"),
    ("to", "parameter height = 8 from 3 to 20"),
    ("within", "part tree() within [-1, 0, -1] to [1, 3, 1] { … }"),
];
const MATERIAL: &str = "the name of a material, declared as in `material red { colour = #f00 }`";

fn no_statement(word: &str) -> Problem {
    let later = LATER.into_iter().find(|(later, _)| *later == word);
    let suggestion = nearest(word, STATEMENTS.into_iter().chain(DECLARATIONS));
    let word = word.to_owned();
    match later {
        Some((_, usage)) => Problem::Later { word, usage },
        None => Problem::NoStatement { word, suggestion },
    }
}

impl<'t> Parser<'t> {
    pub(super) fn statement(&mut self) -> Parsed<Statement> {
        self.nested(Self::any_statement)
    }

    fn any_statement(&mut self) -> Parsed<Statement> {
        let token = self.peek();
        if token.kind == Kind::Symbol("{") {
            return self.block();
        }
        if let Some(word) = self.declares() {
            return self.misplaced(word);
        }
        let Kind::Name(word) = token.kind else {
            return self.expected("a statement, such as `box(1, 2, 1)` or a rule with its arguments");
        };
        self.next += 1;
        match word {
            "let" => {
                let (name, _) = self.name("a name for the value")?;
                self.expect("=")?;
                let value = self.written()?;
                let slot = self.bind(name);
                Ok(Statement::Let {
                    at: token.at,
                    slot,
                    value,
                })
            }
            "if" => self.selection(token.at),
            "choose" => {
                let number = self.written()?;
                let of = self.statements()?;
                // Only the chosen one is done: what a value of the braces were, would not be computed.
                if let Some(at) = of.iter().find_map(Statement::let_at) {
                    return Err((at, Problem::LetInChoose));
                }
                Ok(Statement::Choose {
                    at: token.at,
                    number,
                    of,
                })
            }
            "for" => self.repetition(token.at),
            "scatter" => self.scattering(token.at),
            "edges" => self.edges(token.at),
            "heights" => self.heights(token.at),
            "move" => self.placed(Transform::Move, token.at),
            "turn" => self.placed(Transform::Turn, token.at),
            "tilt" => self.placed(Transform::Tilt, token.at),
            "roll" => self.placed(Transform::Roll, token.at),
            "scale" => self.placed(Transform::Scale, token.at),
            "paint" => {
                if matches!(self.peek().kind, Kind::Name(name) if is_reserved(name)) {
                    return self.expected(MATERIAL);
                }
                let (name, at) = self.name(MATERIAL)?;
                let call = self.call(name, at, Wanted::Material)?;
                let body = self.behind(word, token.at)?;
                Ok(Statement::Paint { call, body })
            }
            "called" => {
                let name = self.text("a name in quotes")?.to_owned();
                let body = self.behind(word, token.at)?;
                let at = token.at;
                Ok(Statement::Called { at, name, body })
            }
            "viewpoint" => Ok(Statement::Viewpoint {
                at: token.at,
                name: self.text("the viewpoint's name in quotes")?.to_owned(),
            }),
            "impostor" => Ok(Statement::Impostor {
                at: token.at,
                arguments: self.given("impostor", IMPOSTOR, token.at)?,
            }),
            "model" => {
                let path = self.text("a glTF file in quotes")?.to_owned();
                self.module.models.push((token.at, path.clone()));
                let at = token.at;
                Ok(Statement::Model { at, path })
            }
            _ => match SolidKind::named(word) {
                Some(kind) => self.solid(kind, token.at),
                None if self.is_symbol("(") || self.is_symbol(".") => {
                    let call = self.call(word, token.at, Wanted::Shape)?;
                    let plan = self.plan();
                    Ok(Statement::Call { call, plan })
                }
                None if word == "else" => Err((token.at, Problem::Else)),
                None if word == "then" => Err((token.at, Problem::Then)),
                None if self.is_symbol("=") => Err((token.at, Problem::WithoutLet(word.to_owned()))),
                None => Err((token.at, no_statement(word))),
            },
        }
    }

    fn inner(&mut self) -> Parsed<Box<Statement>> {
        let reach = self.scope.len();
        let statement = self.statement()?;
        self.scope.truncate(reach);
        Ok(Box::new(statement))
    }

    /// The statement that a word changes.
    fn behind(&mut self, word: &str, at: At) -> Parsed<Box<Statement>> {
        if matches!(self.peek().kind, Kind::End | Kind::Symbol("}")) || self.declares().is_some() {
            return Err((at, Problem::NothingBehind(word.to_owned())));
        }
        self.inner()
    }

    /// Statements in braces; what they bind is out of reach behind them.
    fn statements(&mut self) -> Parsed<Vec<Statement>> {
        let opened = self.peek().at;
        self.opens()?;
        let reach = self.scope.len();
        let mut statements = Vec::new();
        while !self.closes() {
            if self.peek().kind == Kind::End {
                return Err((opened, Problem::Unclosed("{", "}")));
            }
            statements.push(self.statement()?);
        }
        self.scope.truncate(reach);
        Ok(statements)
    }

    pub(super) fn block(&mut self) -> Parsed<Statement> {
        let of = self.statements()?;
        let plan = self.plan();
        Ok(Statement::Group { of, plan })
    }

    fn selection(&mut self, at: At) -> Parsed<Statement> {
        let condition = self.written()?;
        let then = self.inner()?;
        let otherwise = if self.takes_word("else") {
            Some(self.inner()?)
        } else {
            None
        };
        Ok(Statement::If {
            at,
            condition,
            then,
            otherwise,
        })
    }

    fn placed(&mut self, transform: Transform, at: At) -> Parsed<Statement> {
        let word = format!("{transform:?}").to_lowercase();
        let arguments = self.arguments()?;
        let (counts, usage) = match transform {
            Transform::Move => (3..=3, "`move(x, y, z)`".to_owned()),
            Transform::Scale => {
                let counts = if arguments.len() == 1 { 1..=1 } else { 3..=3 };
                (counts, "`scale(factor)` or `scale(x, y, z)`".to_owned())
            }
            _ => (1..=1, format!("`{word}(degrees)`")),
        };
        let by = unnamed((&word, at), arguments, (counts, usage))?;
        let body = self.behind(&word, at)?;
        Ok(Statement::Place {
            transform,
            at,
            by,
            body,
            plan: self.plan(),
        })
    }

    fn solid(&mut self, kind: SolidKind, at: At) -> Parsed<Statement> {
        let arguments = self.given(kind.name(), kind.formals(), at)?;
        let plan = self.plan();
        Ok(Statement::Solid {
            kind,
            at,
            arguments,
            plan,
        })
    }

    /// Arguments in brackets, each at the place of its formal.
    fn given(&mut self, callee: &'static str, formals: Formals, at: At) -> Parsed<Vec<Option<Written>>> {
        let mut found: Vec<Option<Written>> = vec![None; formals.len()];
        for (place, argument) in self.arguments()?.into_iter().enumerate() {
            let index = match &argument.name {
                None => place,
                Some(name) => formals.iter().position(|(known, _)| known == name).ok_or_else(|| {
                    let names = || formals.iter().map(|(name, _)| *name);
                    let problem = Problem::UnknownArgument {
                        name: name.clone(),
                        callee: callee.to_owned(),
                        suggestion: nearest(name, names()),
                        known: names().map(str::to_owned).collect(),
                    };
                    (argument.value.at, problem)
                })?,
            };
            match found.get_mut(index) {
                None => {
                    let (callee, most) = (callee.to_owned(), formals.len());
                    return Err((argument.value.at, Problem::TooManyArguments { callee, most }));
                }
                Some(Some(_)) => return Err((argument.value.at, Problem::ArgumentTwice(formals[index].0.to_owned()))),
                Some(slot) => *slot = Some(argument.value),
            }
        }
        let missing = formals
            .iter()
            .zip(&found)
            .find(|((_, default), given)| default.is_none() && given.is_none());
        if let Some(((name, _), _)) = missing {
            let needed: Vec<&str> = formals
                .iter()
                .filter(|(_, default)| default.is_none())
                .map(|(name, _)| *name)
                .collect();
            let usage = format!("`{callee}({})`", needed.join(", "));
            let (callee, name) = (callee.to_owned(), (*name).to_owned());
            return Err((at, Problem::MissingNumber { callee, name, usage }));
        }
        Ok(found)
    }
}
