//! What is done at a place? Groups, selections, values, transforms, materials, calls, solids and enumerators.

use super::declaration::{DECLARATIONS, STATEMENTS, is_reserved};
use super::enumerator::Many;
use super::expression::unnamed;
use super::usage::{self, LATER, MATERIAL};
use super::{Parsed, Parser};
use crate::procedural::lexer::Kind;
use crate::procedural::problem::Problem;
use crate::procedural::solid::{Formals, IMPOSTOR, SolidKind};
use crate::procedural::spelling::nearest;
use crate::procedural::syntax::{At, Statement, Transform, Wanted, Written};

fn no_statement(word: &str) -> Problem {
    let later = LATER.into_iter().find(|(later, _)| *later == word);
    let suggestion = nearest(word, STATEMENTS.into_iter().chain(DECLARATIONS));
    let word = word.to_owned();
    match later {
        Some((_, usage)) => Problem::Later { word, usage },
        None => Problem::NoStatement { word, suggestion },
    }
}

/// What stands before a statement and is for it.
enum Around {
    Then {
        at: At,
        condition: Written,
    },
    Else {
        at: At,
        condition: Written,
        then: Box<Statement>,
    },
    Place {
        transform: Transform,
        at: At,
        by: Vec<Written>,
    },
    Paint(usize),
    Called {
        at: At,
        name: String,
    },
    Many(Many),
}

/// What begins at a word.
enum Begun {
    /// A statement that is read to its end.
    Whole(Statement),
    /// Something for the statement behind it; and how many values are in reach without what it binds.
    Around(Around, usize),
}

fn transform_named(word: &str) -> Option<Transform> {
    Some(match word {
        "move" => Transform::Move,
        "turn" => Transform::Turn,
        "tilt" => Transform::Tilt,
        "roll" => Transform::Roll,
        "scale" => Transform::Scale,
        _ => return None,
    })
}

impl<'t> Parser<'t> {
    /// A statement, with all that stands before it. In a loop: rows of transforms and chains of `else if` are as long as they
    /// may be without a machine's stack that is as deep.
    pub(super) fn statement(&mut self) -> Parsed<Statement> {
        let mut around: Vec<(Around, usize)> = Vec::new();
        loop {
            let mut statement = match self.begun()? {
                Begun::Whole(statement) => statement,
                Begun::Around(outer, reach) => {
                    self.surrounds()?;
                    around.push((outer, reach));
                    continue;
                }
            };
            if let (Some(at), Some(name)) = (statement.let_at(), self.scope.last())
                && !around.is_empty()
            {
                self.lone.entry(name).or_insert(at);
            }
            loop {
                let Some((outer, reach)) = around.pop() else {
                    return Ok(statement);
                };
                self.scope.truncate(reach);
                statement = match outer {
                    Around::Then { at, condition } if self.takes_word("else") => {
                        let then = Box::new(statement);
                        around.push((Around::Else { at, condition, then }, reach));
                        break;
                    }
                    outer => self.joined(outer, Box::new(statement)),
                };
                self.around -= 1;
            }
        }
    }

    fn joined(&mut self, outer: Around, inner: Box<Statement>) -> Statement {
        match outer {
            Around::Then { at, condition } => Statement::If {
                at,
                condition,
                then: inner,
                otherwise: None,
            },
            Around::Else { at, condition, then } => Statement::If {
                at,
                condition,
                then,
                otherwise: Some(inner),
            },
            Around::Place { transform, at, by } => Statement::Place {
                transform,
                at,
                by,
                body: inner,
                plan: self.plan(),
            },
            Around::Paint(call) => Statement::Paint { call, body: inner },
            Around::Called { at, name } => Statement::Called { at, name, body: inner },
            Around::Many(many) => self.repeated(many, inner),
        }
    }

    fn begun(&mut self) -> Parsed<Begun> {
        let token = self.peek();
        let Kind::Name(word) = token.kind else {
            return self.whole().map(Begun::Whole);
        };
        if self.declares().is_some() {
            return self.whole().map(Begun::Whole);
        }
        let (at, reach) = (token.at, self.scope.len());
        let many = match word {
            "for" => Self::repetition,
            "scatter" => Self::scattering,
            "edges" => Self::edges,
            "if" => {
                self.next += 1;
                let condition = self.written()?;
                return Ok(Begun::Around(Around::Then { at, condition }, reach));
            }
            "paint" => {
                self.next += 1;
                if matches!(self.peek().kind, Kind::Name(name) if is_reserved(name)) {
                    return self.expected(MATERIAL);
                }
                let (name, name_at) = self.name(MATERIAL)?;
                let call = self.call(name, name_at, Wanted::Material)?;
                return self
                    .behind(word, at)
                    .map(|()| Begun::Around(Around::Paint(call), reach));
            }
            "called" => {
                self.next += 1;
                let name = self.named("called", "a name in quotes")?;
                self.behind(word, at)?;
                return Ok(Begun::Around(Around::Called { at, name }, reach));
            }
            _ => {
                let Some(transform) = transform_named(word) else {
                    return self.whole().map(Begun::Whole);
                };
                self.next += 1;
                let by = self.numbers_of(transform, word, at)?;
                self.behind(word, at)?;
                return Ok(Begun::Around(Around::Place { transform, at, by }, reach));
            }
        };
        self.next += 1;
        Ok(Begun::Around(Around::Many(many(self, at)?), reach))
    }

    /// A statement that is for no other.
    fn whole(&mut self) -> Parsed<Statement> {
        let token = self.peek();
        if token.kind == Kind::Symbol("{") {
            return self.block();
        }
        if let Some(word) = self.declares() {
            return self.misplaced(word);
        }
        let Kind::Name(word) = token.kind else {
            return self.expected(usage::STATEMENT);
        };
        self.next += 1;
        match word {
            "let" => {
                let (name, _) = self.name("a name for the value")?;
                self.expect_for("=", usage::VALUE)?;
                let (value, own) = self.value_of(name)?;
                self.own.extend(own);
                let slot = self.bind(name);
                Ok(Statement::Let {
                    at: token.at,
                    slot,
                    value,
                })
            }
            "choose" => {
                let number = self.written()?;
                let of = self.statements(usage::CHOICES)?;
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
            "heights" => self.heights(token.at),
            "viewpoint" => Ok(Statement::Viewpoint {
                at: token.at,
                name: self.named("viewpoint", "the viewpoint's name in quotes")?,
            }),
            "impostor" if !self.is_symbol("(") => self.expected(usage::ASKS_FOR_PICTURES),
            "impostor" => Ok(Statement::Impostor {
                at: token.at,
                arguments: self.given("impostor", IMPOSTOR, token.at)?,
            }),
            "model" => {
                let path = self.path("a glTF file in quotes")?;
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
                None if word == "levels" && self.in_part => Err((token.at, Problem::LevelsOfPart)),
                None => Err((token.at, no_statement(word))),
            },
        }
    }

    /// Refuses a word that changes the statement behind it where there is none.
    fn behind(&self, word: &str, at: At) -> Parsed<()> {
        if matches!(self.peek().kind, Kind::End | Kind::Symbol("}")) || self.declares().is_some() {
            return Err((at, Problem::NothingBehind(word.to_owned())));
        }
        Ok(())
    }

    /// Statements in braces, without which `what` is missing; what they bind is out of reach behind them.
    fn statements(&mut self, what: &str) -> Parsed<Vec<Statement>> {
        let opened = self.peek().at;
        self.nested(|parser| {
            parser.opens(what)?;
            let reach = parser.scope.len();
            let mut statements = Vec::new();
            while !parser.closes() {
                if parser.peek().kind == Kind::End {
                    return Err((opened, Problem::Unclosed("{", "}")));
                }
                statements.push(parser.statement()?);
            }
            parser.scope.truncate(reach);
            Ok(statements)
        })
    }

    pub(super) fn block(&mut self) -> Parsed<Statement> {
        let of = self.statements(usage::BODY)?;
        let plan = self.plan();
        Ok(Statement::Group { of, plan })
    }

    fn numbers_of(&mut self, transform: Transform, word: &str, at: At) -> Parsed<Vec<Written>> {
        let arguments = self.arguments()?;
        let (counts, usage) = match transform {
            Transform::Move => (3..=3, "`move(x, y, z)`".to_owned()),
            Transform::Scale => {
                let counts = if arguments.len() == 1 { 1..=1 } else { 3..=3 };
                (counts, "`scale(factor)` or `scale(x, y, z)`".to_owned())
            }
            _ => (1..=1, format!("`{word}(degrees)`")),
        };
        unnamed((word, at), arguments, (counts, usage))
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
        let needed = formals.iter().filter(|(_, default)| default.is_none());
        let needed: Vec<&str> = needed.map(|(name, _)| *name).collect();
        let usage = format!("`{callee}({})`", needed.join(", "));
        if !self.is_symbol("(") {
            return self.expected(format!("`(`, as in {usage}"));
        }
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
            let (callee, name) = (callee.to_owned(), (*name).to_owned());
            return Err((at, Problem::MissingNumber { callee, name, usage }));
        }
        Ok(found)
    }
}
