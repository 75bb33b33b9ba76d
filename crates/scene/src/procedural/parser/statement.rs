//! What is done at a place? Groups, selections, values, transforms, materials, calls, solids and enumerators.

use super::{Parsed, Parser, unknown};
use crate::procedural::error::Problem;
use crate::procedural::lexer::Kind;
use crate::procedural::solid::{Formals, IMPOSTOR, SolidKind};
use crate::procedural::syntax::{At, Expr, Statement, Transform, Wanted};

impl<'t> Parser<'t> {
    pub(super) fn statement(&mut self) -> Parsed<Statement> {
        self.nested(Self::any_statement)
    }

    fn any_statement(&mut self) -> Parsed<Statement> {
        let token = self.peek();
        if token.kind == Kind::Symbol("{") {
            return self.block();
        }
        let Kind::Name(word) = token.kind else {
            return self.expected("a statement, such as `box(1, 2, 1)` or a rule with its arguments");
        };
        self.next += 1;
        match word {
            "let" => {
                let (name, _) = self.name("a name for the value")?;
                self.expect("=")?;
                let value = self.expression()?;
                let slot = self.bind(name);
                Ok(Statement::Let {
                    at: token.at,
                    slot,
                    value,
                })
            }
            "if" => self.selection(token.at),
            "choose" => {
                let number = self.expression()?;
                let of = self.statements()?;
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
            "move" => self.placed(Transform::Move, token.at, 3),
            "turn" => self.placed(Transform::Turn, token.at, 1),
            "tilt" => self.placed(Transform::Tilt, token.at, 1),
            "roll" => self.placed(Transform::Roll, token.at, 1),
            "scale" => self.placed(Transform::Scale, token.at, 3),
            "paint" => {
                let (name, at) = self.name("a material")?;
                let call = self.call(name, at, Wanted::Material)?;
                let body = self.inner()?;
                Ok(Statement::Paint { call, body })
            }
            "called" => {
                let name = self.text("a name in quotes")?.to_owned();
                let body = self.inner()?;
                Ok(Statement::Called { name, body })
            }
            "viewpoint" => Ok(Statement::Viewpoint(
                self.text("the viewpoint's name in quotes")?.to_owned(),
            )),
            "impostor" => Ok(Statement::Impostor {
                at: token.at,
                arguments: self.given("impostor", "parameter of an impostor", IMPOSTOR, token.at)?,
            }),
            "model" => {
                let path = self.text("a glTF file in quotes")?.to_owned();
                self.module.models.push((token.at, path.clone()));
                Ok(Statement::Model(path))
            }
            _ => match SolidKind::named(word) {
                Some(kind) => self.solid(kind, token.at),
                None if self.is_symbol("(") || self.is_symbol(".") => {
                    let call = self.call(word, token.at, Wanted::Shape)?;
                    let plan = self.plan();
                    Ok(Statement::Call { call, plan })
                }
                None => {
                    self.next -= 1;
                    self.expected("a statement, such as `box(1, 2, 1)` or a rule with its arguments")
                }
            },
        }
    }

    fn inner(&mut self) -> Parsed<Box<Statement>> {
        let reach = self.scope.len();
        let statement = self.statement()?;
        self.scope.truncate(reach);
        Ok(Box::new(statement))
    }

    /// Statements in braces; what they bind is out of reach behind them.
    fn statements(&mut self) -> Parsed<Vec<Statement>> {
        self.expect("{")?;
        let reach = self.scope.len();
        let mut statements = Vec::new();
        while !self.takes("}") {
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
        let condition = self.expression()?;
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

    fn placed(&mut self, transform: Transform, at: At, most: usize) -> Parsed<Statement> {
        let word = format!("{transform:?}").to_lowercase();
        let arguments = self.arguments()?;
        let fits = match transform {
            Transform::Scale => [1, 3].contains(&arguments.len()),
            _ => arguments.len() == most,
        };
        if !fits || arguments.iter().any(|argument| argument.name.is_some()) {
            let expected = match transform {
                Transform::Move => "`move(x, y, z)`".to_owned(),
                Transform::Scale => "`scale(factor)` or `scale(x, y, z)`".to_owned(),
                _ => format!("`{word}(degrees)`"),
            };
            let found = format!("`{word}` with {} arguments", arguments.len());
            return Err((at, Problem::Expected { expected, found }));
        }
        let by = arguments.into_iter().map(|argument| argument.value).collect();
        let body = self.inner()?;
        Ok(Statement::Place {
            transform,
            at,
            by,
            body,
            plan: self.plan(),
        })
    }

    fn solid(&mut self, kind: SolidKind, at: At) -> Parsed<Statement> {
        let arguments = self.given(kind.name(), "parameter of this solid", kind.formals(), at)?;
        let plan = self.plan();
        Ok(Statement::Solid {
            kind,
            at,
            arguments,
            plan,
        })
    }

    /// Arguments in brackets, each at the place of its formal.
    fn given(
        &mut self,
        callee: &'static str,
        formal: &'static str,
        formals: Formals,
        at: At,
    ) -> Parsed<Vec<Option<Expr>>> {
        let mut found: Vec<Option<Expr>> = vec![None; formals.len()];
        for (place, argument) in self.arguments()?.into_iter().enumerate() {
            let index = match &argument.name {
                None => place,
                Some(name) => formals.iter().position(|(known, _)| known == name).ok_or_else(|| {
                    let names = formals.iter().map(|(name, _)| *name);
                    (argument.at, unknown(formal, name, names))
                })?,
            };
            match found.get_mut(index) {
                None => {
                    let (callee, most) = (callee.to_owned(), formals.len());
                    return Err((argument.at, Problem::TooManyArguments { callee, most }));
                }
                Some(Some(_)) => return Err((argument.at, Problem::ArgumentTwice(formals[index].0.to_owned()))),
                Some(slot) => *slot = Some(argument.value),
            }
        }
        let missing = formals
            .iter()
            .zip(&found)
            .find(|((_, default), given)| default.is_none() && given.is_none());
        if let Some(((name, _), _)) = missing {
            let (callee, name) = (callee.to_owned(), (*name).to_owned());
            return Err((at, Problem::MissingArgument { callee, name }));
        }
        Ok(found)
    }

    /// Names of values, separated by commas, not yet in reach.
    fn names(&mut self) -> Parsed<Vec<&'t str>> {
        let mut names = vec![self.name("a name for the value")?.0];
        while self.takes(",") {
            names.push(self.name("a name for the value")?.0);
        }
        Ok(names)
    }

    fn two_names(&mut self) -> Parsed<[&'t str; 2]> {
        let (first, _) = self.name("a name for x")?;
        self.expect(",")?;
        Ok([first, self.name("a name for z")?.0])
    }

    /// `WIDTH by DEPTH`
    fn extent(&mut self) -> Parsed<[Expr; 2]> {
        let width = self.expression()?;
        self.expect_word("by")?;
        Ok([width, self.expression()?])
    }

    /// A statement in which these names are in reach.
    fn with<const N: usize>(&mut self, names: [&'t str; N]) -> Parsed<([u32; N], Box<Statement>)> {
        let reach = self.scope.len();
        let slots = names.map(|name| self.bind(name));
        let body = self.statement()?;
        self.scope.truncate(reach);
        Ok((slots, Box::new(body)))
    }

    fn with_all(&mut self, names: &[&'t str]) -> Parsed<(Vec<u32>, Box<Statement>)> {
        let reach = self.scope.len();
        let slots = names.iter().map(|name| self.bind(name)).collect();
        let body = self.statement()?;
        self.scope.truncate(reach);
        Ok((slots, Box::new(body)))
    }

    fn repetition(&mut self, at: At) -> Parsed<Statement> {
        let names = self.names()?;
        self.expect_word("in")?;
        let site = self.site();
        let over = self.expression()?;
        let (slots, body) = self.with_all(&names)?;
        Ok(Statement::For {
            at,
            site,
            slots,
            over,
            body,
            plan: self.plan(),
        })
    }

    fn scattering(&mut self, at: At) -> Parsed<Statement> {
        let site = self.site();
        let count = self.expression()?;
        self.expect_word("as")?;
        let names = self.two_names()?;
        self.expect_word("in")?;
        let over = self.extent()?;
        let (slots, body) = self.with(names)?;
        Ok(Statement::Scatter {
            at,
            site,
            slots,
            count,
            over,
            body,
        })
    }

    fn edges(&mut self, at: At) -> Parsed<Statement> {
        let names = self.names()?;
        if names.len() > 2 {
            return Err((
                at,
                Problem::Shape {
                    what: "edges",
                    wanted: "`edges length in …` or `edges length, number in …`",
                },
            ));
        }
        self.expect_word("in")?;
        let site = self.site();
        let polygon = self.expression()?;
        let (slots, body) = self.with_all(&names)?;
        Ok(Statement::Edges {
            at,
            site,
            slots,
            polygon,
            body,
        })
    }

    fn heights(&mut self, at: At) -> Parsed<Statement> {
        let names = self.two_names()?;
        self.expect_word("in")?;
        let over = self.extent()?;
        self.expect_word("steps")?;
        let steps = self.extent()?;
        self.expect("=")?;
        let reach = self.scope.len();
        let slots = names.map(|name| self.bind(name));
        let height = self.expression()?;
        self.scope.truncate(reach);
        Ok(Statement::Heights {
            at,
            slots,
            over,
            steps,
            height,
            plan: self.plan(),
        })
    }
}
