//! How is a value written? Operators by rising strength: `or`, `and`, `not`, comparisons, `+ −`, `* /`, a sign, `[item]`.

use std::ops::RangeInclusive;

use super::{OPERATORS, Parsed, Parser, usage};
use crate::procedural::lexer::Kind;
use crate::procedural::limits::{MAX_CHAIN, reached};
use crate::procedural::operation::{BuiltIn, Operator};
use crate::procedural::problem::Problem;
use crate::procedural::syntax::{Argument, At, Call, Expr, Target, Use, Wanted, Written};

/// Operators that may stand between two sides, by their symbols.
const COMPARISONS: [(&str, Operator); 6] = [
    ("==", Operator::Equal),
    ("!=", Operator::Unequal),
    ("<=", Operator::AtMost),
    (">=", Operator::AtLeast),
    ("<", Operator::Less),
    (">", Operator::More),
];
const SUMS: [(&str, Operator); 2] = [("+", Operator::Add), ("-", Operator::Subtract)];
const PRODUCTS: [(&str, Operator); 2] = [("*", Operator::Multiply), ("/", Operator::Divide)];

impl Parser<'_> {
    pub(super) fn expression(&mut self) -> Parsed<Expr> {
        let value = self.value_before_sign()?;
        if self.is_symbol("=") {
            let problem = match self.words.get(self.next + 1).map(|word| word.kind) {
                Some(Kind::Symbol("<")) => Problem::Comparison("=<", "<="),
                Some(Kind::Symbol(">")) => Problem::Comparison("=>", ">="),
                _ => Problem::Equals,
            };
            return Err((self.peek().at, problem));
        }
        Ok(value)
    }

    /// A value behind which `=` may stand.
    pub(super) fn value_before_sign(&mut self) -> Parsed<Expr> {
        let mut chain = Vec::new();
        while self.takes_word("if") {
            let [condition, then] = self.nested(|parser| {
                let condition = parser.expression()?;
                parser.expect_word("then", usage::IF)?;
                Ok([condition, parser.expression()?])
            })?;
            self.expect_word("else", usage::IF)?;
            self.surrounds()?;
            chain.push([condition, then]);
        }
        let last = self.disjunction()?.made_plain(&mut self.module.settled);
        self.around -= chain.len() as u32;
        let branches = chain.into_iter().rev();
        Ok(branches.fold(last, |otherwise, [condition, then]| {
            Expr::If(Box::new([condition, then, otherwise]))
        }))
    }

    fn disjunction(&mut self) -> Parsed<Expr> {
        let mut left = self.conjunction()?;
        let mut count = 0;
        while self.takes_word("or") {
            count = self.chained(count)?;
            left = Expr::Or(Box::new([left, self.conjunction()?]));
        }
        Ok(left)
    }

    fn conjunction(&mut self) -> Parsed<Expr> {
        let mut left = self.negation()?;
        let mut count = 0;
        while self.takes_word("and") {
            count = self.chained(count)?;
            left = Expr::And(Box::new([left, self.negation()?]));
        }
        Ok(left)
    }

    fn negation(&mut self) -> Parsed<Expr> {
        if self.takes_word("not") {
            return self.nested(|parser| Ok(Expr::Not(Box::new(parser.negation()?))));
        }
        let left = self.sum()?;
        match self.operator(&COMPARISONS) {
            None => Ok(left),
            Some((Operator::Less, at)) if self.is_symbol(">") => Err((at, Problem::Comparison("<>", "!="))),
            Some((operator, at)) => {
                let sides = Box::new([left, self.sum()?]);
                match self.operator(&COMPARISONS) {
                    None => Ok(Expr::Binary { operator, at, sides }),
                    Some((_, at)) => Err((at, Problem::Compared)),
                }
            }
        }
    }

    fn sum(&mut self) -> Parsed<Expr> {
        let mut left = self.product()?;
        let mut count = 0;
        while let Some((operator, at)) = self.operator(&SUMS) {
            count = self.chained(count)?;
            let sides = Box::new([left, self.product()?]);
            left = Expr::Binary { operator, at, sides };
        }
        Ok(left)
    }

    fn product(&mut self) -> Parsed<Expr> {
        let mut left = self.signed()?;
        let mut count = 0;
        while let Some((operator, at)) = self.operator(&PRODUCTS) {
            count = self.chained(count)?;
            let sides = Box::new([left, self.signed()?]);
            left = Expr::Binary { operator, at, sides };
        }
        Ok(left)
    }

    fn signed(&mut self) -> Parsed<Expr> {
        if self.takes("-") {
            return self.nested(|parser| Ok(Expr::Minus(Box::new(parser.signed()?))));
        }
        let mut value = self.atom()?;
        let mut count = 0;
        while self.is_symbol("[") {
            count = self.chained(count)?;
            let (at, index) = self.nested(|parser| {
                let at = parser.take().at;
                let index = parser.expression()?;
                parser.expect("]")?;
                Ok((at, index))
            })?;
            let of = Box::new([value, index]);
            value = Expr::Item { at, of };
        }
        Ok(value)
    }

    fn atom(&mut self) -> Parsed<Expr> {
        let token = self.peek();
        match token.kind {
            Kind::Number(number) => {
                self.next += 1;
                Ok(Expr::Number(number))
            }
            Kind::Colour(channels) => {
                self.next += 1;
                Ok(Expr::Colour(channels))
            }
            Kind::Symbol("(") => self.nested(|parser| {
                parser.next += 1;
                let value = parser.expression()?;
                parser.expect_for(")", usage::BRACKETS)?;
                Ok(value)
            }),
            Kind::Symbol("[") => self.nested(|parser| {
                parser.next += 1;
                let mut items = Vec::new();
                while !parser.takes("]") {
                    items.push(parser.expression()?);
                    parser.separated(token.at, ["[", "]"])?;
                }
                Ok(Expr::List(items, token.at))
            }),
            Kind::Symbol(".") => self.expected("a value; a number begins with a digit, as in `0.5`"),
            Kind::Name("if") => self.expected("a value; put brackets around `if … then … else …` here"),
            Kind::Name("not") => self.expected("a value; put brackets around `not …` here"),
            Kind::Name(name) if !OPERATORS.contains(&name) => {
                let (name, at) = self.name("a value")?;
                if self.is_symbol("(") || self.is_symbol(".") {
                    self.application(name, at)
                } else {
                    Ok(self.variable(name, at))
                }
            }
            _ => self.expected("a value"),
        }
    }

    /// The nearest value of that name: of the rule, else of the file or the language.
    fn variable(&mut self, name: &str, at: At) -> Expr {
        if let Some(slot) = self.scope.slot_of(name) {
            return Expr::Local(slot);
        }
        match name {
            "detail" => Expr::Detail,
            "level" => Expr::Level,
            _ => {
                let name = name.to_owned();
                self.module.uses.push(Use { name, at, slot: 0 });
                Expr::Global(self.module.uses.len() - 1)
            }
        }
    }

    /// A function with its arguments.
    fn application(&mut self, name: &str, at: At) -> Parsed<Expr> {
        let built_in = BuiltIn::ALL.iter().find(|(known, ..)| *known == name);
        if let Some(&(name, function, least, formals)) = built_in {
            let site = self.site();
            let (arguments, most) = (self.arguments()?, formals.len());
            let is_half = function == BuiltIn::Random && arguments.len() == 1;
            let usage = format!("`{name}({})`", formals.join(", "));
            let least = if is_half { most } else { least };
            let arguments = unnamed((name, at), arguments, (least..=most, usage))?;
            return Ok(Expr::BuiltIn {
                name: function,
                at,
                site,
                arguments,
            });
        }
        Ok(Expr::Call(self.call(name, at, Wanted::Function)?))
    }

    /// The rest of a call, from behind its first name on; its place in the table of calls.
    pub(super) fn call(&mut self, first: &str, at: At, wanted: Wanted) -> Parsed<usize> {
        let (module, name) = if self.takes(".") {
            let (name, _) = self.name("a name of the imported file")?;
            (Some(first.to_owned()), name.to_owned())
        } else {
            (None, first.to_owned())
        };
        let site = self.site();
        let has_brackets = self.is_symbol("(");
        let is_value = wanted == Wanted::Function && module.is_some() && !has_brackets && self.aliases.contains(first);
        let takes_arguments = has_brackets || wanted != Wanted::Material && !is_value;
        let arguments = if takes_arguments { self.arguments()? } else { Vec::new() };
        self.module.calls.push(Call {
            at,
            module,
            name,
            arguments,
            site,
            wanted,
            is_value,
            target: Target::default(),
            given: Vec::new(),
        });
        Ok(self.module.calls.len() - 1)
    }

    fn operator(&mut self, known: &[(&str, Operator)]) -> Option<(Operator, At)> {
        let token = self.peek();
        let found = known.iter().find(|(symbol, _)| self.is_symbol(symbol))?;
        self.next += 1;
        Some((found.1, token.at))
    }

    /// A long chain of operators is as deep a tree as brackets make.
    fn chained(&mut self, count: u32) -> Parsed<u32> {
        if count >= MAX_CHAIN {
            return Err((self.peek().at, reached("operators in a row", MAX_CHAIN.into())));
        }
        Ok(count + 1)
    }
}

/// Arguments of what has no names for them: so many of them, or else it is to be called like `usage`.
pub(super) fn unnamed(
    (callee, at): (&str, At),
    arguments: Vec<Argument>,
    (counts, usage): (RangeInclusive<usize>, String),
) -> Parsed<Vec<Written>> {
    let callee = callee.to_owned();
    let most = *counts.end();
    if let Some(named) = arguments.iter().find(|argument| argument.name.is_some()) {
        return Err((named.value.at, Problem::NamedArgument { callee, usage }));
    }
    if let Some(surplus) = arguments.get(most) {
        return Err((surplus.value.at, Problem::TooManyArguments { callee, most }));
    }
    if arguments.len() < *counts.start() {
        return Err((at, Problem::TooFewArguments { callee, usage }));
    }
    Ok(arguments.into_iter().map(|argument| argument.value).collect())
}
