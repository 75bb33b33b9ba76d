//! What is done many times, and where? Loops, populations, edges of polygons and height fields.

use super::{Declared, Parsed, Parser, usage};
use crate::procedural::lexer::Kind;
use crate::procedural::problem::Problem;
use crate::procedural::syntax::{At, Statement, Written};

/// What is done many times, without the statement that is.
pub(super) enum Many {
    For {
        at: At,
        site: u32,
        slots: Vec<u32>,
        over: Written,
    },
    Scatter {
        at: At,
        site: u32,
        slots: [u32; 2],
        count: Written,
        over: [Written; 2],
    },
    Edges {
        at: At,
        site: u32,
        slots: Vec<u32>,
        polygon: Written,
    },
}

impl<'t> Parser<'t> {
    /// Names of values, separated by commas, not yet in reach.
    fn names(&mut self) -> Parsed<Vec<&'t str>> {
        let (mut names, mut given) = (Vec::new(), Declared::default());
        loop {
            let (name, at) = self.name("a name for the value")?;
            given.add(self.text, (name, at))?;
            names.push(name);
            if !self.takes(",") {
                return Ok(names);
            }
        }
    }

    fn two_names(&mut self) -> Parsed<[&'t str; 2]> {
        let mut given = Declared::default();
        let first = self.name("a name for x")?;
        given.add(self.text, first)?;
        self.expect_for(",", usage::SECOND_NAME)?;
        let second = self.name("a name for z")?;
        given.add(self.text, second)?;
        Ok([first.0, second.0])
    }

    fn bind_all(&mut self, names: &[&'t str]) -> Vec<u32> {
        names.iter().map(|name| self.bind(name)).collect()
    }

    /// Whether what was read goes on as a range, and not with a call of what is called `to`.
    fn is_range(&self) -> bool {
        let behind = self.words.get(self.next + 1).map(|word| word.kind);
        self.is_word("to") && !matches!(behind, Some(Kind::Symbol("(" | ".")))
    }

    pub(super) fn repetition(&mut self, at: At) -> Parsed<Many> {
        let names = self.names()?;
        self.expect_word("in", usage::FOR)?;
        let site = self.site();
        let over = self.written()?;
        let slots = self.bind_all(&names);
        if self.is_range() {
            return Err((self.peek().at, Problem::RangeOfLoop));
        }
        Ok(Many::For { at, site, slots, over })
    }

    pub(super) fn scattering(&mut self, at: At) -> Parsed<Many> {
        let site = self.site();
        let count = self.written()?;
        self.expect_word("as", usage::SCATTER)?;
        let names = self.two_names()?;
        self.expect_word("in", usage::SCATTER)?;
        let width = self.written()?;
        self.expect_word("by", usage::SCATTER)?;
        let over = [width, self.written()?];
        let slots = names.map(|name| self.bind(name));
        Ok(Many::Scatter {
            at,
            site,
            slots,
            count,
            over,
        })
    }

    pub(super) fn edges(&mut self, at: At) -> Parsed<Many> {
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
        self.expect_word("in", usage::EDGES)?;
        let site = self.site();
        let polygon = self.written()?;
        let slots = self.bind_all(&names);
        Ok(Many::Edges {
            at,
            site,
            slots,
            polygon,
        })
    }

    /// The same with its statement.
    pub(super) fn repeated(&mut self, many: Many, body: Box<Statement>) -> Statement {
        match many {
            Many::For { at, site, slots, over } => Statement::For {
                at,
                site,
                slots,
                over,
                body,
                plan: self.plan(),
            },
            Many::Scatter {
                at,
                site,
                slots,
                count,
                over,
            } => Statement::Scatter {
                at,
                site,
                slots,
                count,
                over,
                body,
            },
            Many::Edges {
                at,
                site,
                slots,
                polygon,
            } => Statement::Edges {
                at,
                site,
                slots,
                polygon,
                body,
            },
        }
    }

    /// `WIDTH by DEPTH` or `ALONG by ACROSS`, where `=` may stand behind.
    fn two_before_sign(&mut self) -> Parsed<[Written; 2]> {
        let first = self.written_before_sign()?;
        self.expect_word("by", usage::HEIGHTS)?;
        Ok([first, self.written_before_sign()?])
    }

    fn written_before_sign(&mut self) -> Parsed<Written> {
        let at = self.peek().at;
        let of = self.value_before_sign()?;
        Ok(Written { at, of })
    }

    pub(super) fn heights(&mut self, at: At) -> Parsed<Statement> {
        let names = self.two_names()?;
        self.expect_word("in", usage::HEIGHTS)?;
        let over = self.two_before_sign()?;
        self.expect_word("steps", usage::HEIGHTS)?;
        let steps = self.two_before_sign()?;
        self.expect_for("=", usage::VALUE)?;
        let reach = self.scope.len();
        let slots = names.map(|name| self.bind(name));
        let height = self.written()?;
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
