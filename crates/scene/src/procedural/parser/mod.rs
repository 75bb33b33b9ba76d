//! How do words become nodes? A parser that looks one word ahead (recursive descent).
//!
//! Local names become slots while they are read; see [`syntax`](super::syntax). This file holds what the parser knows;
//! [`declaration`] reads what a file consists of, [`statement`], [`enumerator`] and [`expression`] what stands inside of
//! that.

mod dangling;
mod declaration;
mod enumerator;
mod expression;
mod reach;
mod statement;
mod usage;

use std::collections::hash_map::Entry;
use std::collections::{HashMap, HashSet};

use super::error::{DcgError, Place, is_order, line_of};
use super::lexer::{Kind, Token, words};
use super::limits::{MAX_AROUND, MAX_NAME, MAX_NESTING, MAX_TEXT_BYTES, reached};
use super::problem::Problem;
use super::spelling::nearest;
use super::syntax::{Argument, At, Module, Written};
use super::wording::{is_hidden, is_unseen};
pub(super) use dangling::at_its_operator;
pub use declaration::tidied;
use declaration::{DECLARATIONS, is_blank};
use reach::Reach;

type Parsed<T> = Result<T, (At, Problem)>;

/// Words of expressions, which no value can be called.
const OPERATORS: [&str; 6] = ["if", "then", "else", "and", "or", "not"];

/// Reads a file.
pub(super) fn parse(file: &str, text: String) -> Result<Module, Box<DcgError>> {
    let parsed = if text.len() > MAX_TEXT_BYTES {
        Err((0, reached("bytes of text", MAX_TEXT_BYTES as u64)))
    } else {
        words(&text).and_then(|words| {
            let mut parser = Parser::new(&text, &words);
            parser.file()?;
            Ok(parser.module)
        })
    };
    let mut module = parsed.map_err(|wrong| {
        let (at, problem) = at_its_operator(&text, wrong);
        DcgError::at(file, &text, at, problem)
    })?;
    module.file = file.to_owned();
    module.text = text;
    Ok(module)
}

struct Parser<'t> {
    text: &'t str,
    words: &'t [Token<'t>],
    next: usize,
    module: Module,
    /// The values in reach.
    scope: Reach<'t>,
    /// Most values that were in reach at once.
    slots: u32,
    /// Calls, loops and random numbers so far in this rule.
    sites: u32,
    nesting: u32,
    /// Words of statements and values that stand around what is read.
    around: u32,
    /// Whether what is read belongs to a part.
    in_part: bool,
    /// Braces that are open.
    open: Vec<At>,
    /// Declared names and where, to find what is given twice.
    declared: Declared<'t>,
    /// Those by which files were imported.
    aliases: HashSet<&'t str>,
    /// Values of which a `let` is all that stands behind what it is for, and where the first of each is.
    lone: HashMap<&'t str, At>,
    /// Where a `let` of a block reads what it names, of which there may be another in the file.
    own: HashSet<At>,
}

impl<'t> Parser<'t> {
    fn new(text: &'t str, words: &'t [Token<'t>]) -> Self {
        Self {
            text,
            words,
            next: 0,
            module: Module::default(),
            scope: Reach::default(),
            slots: 0,
            sites: 0,
            nesting: 0,
            around: 0,
            in_part: false,
            open: Vec::new(),
            declared: Declared::default(),
            aliases: HashSet::new(),
            lone: HashMap::new(),
            own: HashSet::new(),
        }
    }

    fn peek(&self) -> Token<'t> {
        self.words[self.next.min(self.words.len() - 1)]
    }

    fn take(&mut self) -> Token<'t> {
        let token = self.peek();
        self.next += 1;
        token
    }

    fn is_symbol(&self, symbol: &str) -> bool {
        matches!(self.peek().kind, Kind::Symbol(found) if found == symbol)
    }

    fn takes(&mut self, symbol: &str) -> bool {
        let found = self.is_symbol(symbol);
        self.next += usize::from(found);
        found
    }

    fn is_word(&self, word: &str) -> bool {
        self.peek().kind == Kind::Name(word)
    }

    fn takes_word(&mut self, word: &str) -> bool {
        let found = self.is_word(word);
        self.next += usize::from(found);
        found
    }

    fn expected<T>(&self, what: impl Into<String>) -> Parsed<T> {
        let token = self.peek();
        let problem = Problem::Expected {
            expected: what.into(),
            found: token.kind.to_string(),
        };
        Err((token.at, problem))
    }

    fn expect(&mut self, symbol: &str) -> Parsed<()> {
        self.expect_for(symbol, &format!("`{symbol}`"))
    }

    /// A sign, without which `what` is missing.
    fn expect_for(&mut self, symbol: &str, what: &str) -> Parsed<()> {
        if self.takes(symbol) {
            Ok(())
        } else {
            self.expected(what)
        }
    }

    /// An opening brace, without which `what` is missing.
    fn opens(&mut self, what: &str) -> Parsed<()> {
        self.open.push(self.peek().at);
        self.expect_for("{", what)
    }

    /// Whether the brace that was opened last is closed here.
    fn closes(&mut self) -> bool {
        let found = self.takes("}");
        if found {
            self.open.pop();
        }
        found
    }

    /// The word of a declaration that begins here, where only something else may.
    fn declares(&self) -> Option<&'t str> {
        let Kind::Name(word) = self.peek().kind else {
            return None;
        };
        // Values may be called so, and whoever writes brackets means a rule.
        let behind = self.words.get(self.next + 1).map(|word| word.kind);
        let is_other = matches!(behind, Some(Kind::Symbol("(" | "." | "=")));
        (DECLARATIONS.contains(&word) && !is_other).then_some(word)
    }

    /// What is wrong where a declaration stands in braces, or behind what a statement belongs to.
    fn misplaced<T>(&self, word: &str) -> Parsed<T> {
        let problem = match self.open.last() {
            Some(opened) => {
                let Place { line, column, .. } = Place::of(self.text, *opened);
                Problem::DeclarationInside { line, column }
            }
            None => Problem::DeclarationBehind(word.to_owned()),
        };
        Err((self.peek().at, problem))
    }

    /// A word that stands where it does in `usage`.
    fn expect_word(&mut self, word: &str, usage: &str) -> Parsed<()> {
        if self.takes_word(word) {
            Ok(())
        } else {
            self.expected(format!("`{word}`, as in `{usage}`"))
        }
    }

    /// A comma between items, unless the bracket that was opened closes behind this one.
    fn separated(&mut self, opened: At, [open, close]: [&'static str; 2]) -> Parsed<()> {
        if self.is_symbol(close) || self.takes(",") {
            return Ok(());
        }
        if self.peek().kind == Kind::End {
            return Err((opened, Problem::Unclosed(open, close)));
        }
        self.expected(format!("`,` or `{close}`"))
    }

    fn name(&mut self, what: &str) -> Parsed<(&'t str, At)> {
        let token = self.peek();
        match token.kind {
            Kind::Name(name) if OPERATORS.contains(&name) => Err((token.at, Problem::Reserved(name.to_owned()))),
            Kind::Name(name) => {
                self.next += 1;
                Ok((name, token.at))
            }
            _ => self.expected(what),
        }
    }

    fn text(&mut self, what: &str) -> Parsed<&'t str> {
        match self.peek().kind {
            Kind::Text(text) => {
                self.next += 1;
                Ok(text)
            }
            _ => self.expected(what),
        }
    }

    /// The name of something, which people read or are read: `word` stands before it.
    fn named(&mut self, word: &'static str, what: &str) -> Parsed<String> {
        let at = self.peek().at;
        let name = self.text(what)?;
        if name.chars().all(|c| c == ' ' || is_unseen(c)) {
            return Err((at, Problem::EmptyName(word)));
        }
        refuse_unseen(name, at, "letters in a name", |c| is_order(c) || is_hidden(c))?;
        Ok(name.to_owned())
    }

    /// The path of a file.
    fn path(&mut self, what: &str) -> Parsed<String> {
        let at = self.peek().at;
        let path = tidied(self.text(what)?);
        if is_blank(&path) {
            return Err((at, Problem::NoFile));
        }
        refuse_unseen(&path, at, "letters in a path", is_order)?;
        Ok(path)
    }

    /// Runs `read` one level deeper.
    fn nested<T>(&mut self, read: impl FnOnce(&mut Self) -> Parsed<T>) -> Parsed<T> {
        if self.nesting == MAX_NESTING {
            return Err((
                self.peek().at,
                reached("brackets and blocks inside each other", MAX_NESTING.into()),
            ));
        }
        self.nesting += 1;
        let result = read(self);
        self.nesting -= 1;
        result
    }

    /// Counts what stands around what comes next, which is as deep in the tree as brackets make it.
    fn surrounds(&mut self) -> Parsed<()> {
        if self.around == MAX_AROUND {
            let reached = reached("transforms, loops and conditions around one another", MAX_AROUND.into());
            return Err((self.peek().at, reached));
        }
        self.around += 1;
        Ok(())
    }

    /// A number for a statement that may be done at one go.
    fn plan(&mut self) -> u32 {
        self.module.plans += 1;
        self.module.plans - 1
    }

    fn site(&mut self) -> u32 {
        self.sites += 1;
        self.sites
    }

    /// Brings a value into reach.
    fn bind(&mut self, name: &'t str) -> u32 {
        let slot = self.scope.push(name);
        self.slots = self.slots.max(slot + 1);
        slot
    }

    /// Runs `read` with nothing in reach, and says how many values it needed.
    fn framed<T>(&mut self, read: impl FnOnce(&mut Self) -> Parsed<T>) -> Parsed<(T, u32)> {
        let scope = std::mem::take(&mut self.scope);
        let (slots, sites) = (std::mem::take(&mut self.slots), std::mem::take(&mut self.sites));
        let result = read(self)?;
        let needed = std::mem::replace(&mut self.slots, slots);
        self.scope = scope;
        self.sites = sites;
        Ok((result, needed))
    }

    /// A value, and where it begins.
    fn written(&mut self) -> Parsed<Written> {
        let at = self.peek().at;
        let of = self.expression()?;
        Ok(Written { at, of })
    }

    /// The value of something that is called so, and where it reads that.
    fn value_of(&mut self, name: &str) -> Parsed<(Written, Vec<At>)> {
        let first = self.module.uses.len();
        let value = self.written()?;
        let own = self.module.uses[first..].iter().filter(|used| used.name == name);
        Ok((value, own.map(|used| used.at).collect()))
    }

    /// The same of something of the whole file, which must not read itself.
    fn value_without(&mut self, name: &str) -> Parsed<Written> {
        let (value, own) = self.value_of(name)?;
        match own.first() {
            Some(at) => Err((*at, Problem::OfItself(name.to_owned()))),
            None => Ok(value),
        }
    }

    /// Arguments in brackets.
    fn arguments(&mut self) -> Parsed<Vec<Argument>> {
        self.nested(Self::arguments_inside)
    }

    fn arguments_inside(&mut self) -> Parsed<Vec<Argument>> {
        let opened = self.peek().at;
        self.expect("(")?;
        let mut arguments: Vec<Argument> = Vec::new();
        while !self.takes(")") {
            let at = self.peek().at;
            let name = match (self.peek().kind, self.words.get(self.next + 1).map(|word| word.kind)) {
                (Kind::Name(name), Some(Kind::Symbol("="))) => {
                    self.next += 2;
                    Some(name.to_owned())
                }
                _ => None,
            };
            if name.is_none() && arguments.last().is_some_and(|last| last.name.is_some()) {
                return Err((at, Problem::UnnamedAfterNamed));
            }
            let of = self.expression()?;
            let value = Written { at, of };
            arguments.push(Argument { name, value });
            self.separated(opened, ["(", ")"])?;
        }
        Ok(arguments)
    }
}

/// Names, and where each was given.
#[derive(Default)]
struct Declared<'t>(HashMap<&'t str, At>);

impl<'t> Declared<'t> {
    /// Refuses a name of this text that was given before.
    fn add(&mut self, text: &str, (name, at): (&'t str, At)) -> Parsed<()> {
        match self.0.entry(name) {
            Entry::Vacant(entry) => {
                entry.insert(at);
                Ok(())
            }
            Entry::Occupied(first) => {
                let (name, first_line) = (name.to_owned(), line_of(text, *first.get()));
                Err((at, Problem::Twice { name, first_line }))
            }
        }
    }
}

/// Refuses a text that is longer than anybody reads, or has a character in it that is not for who reads it.
fn refuse_unseen(text: &str, at: At, letters: &'static str, is_other: impl Fn(char) -> bool) -> Parsed<()> {
    if text.chars().count() > MAX_NAME {
        return Err((at, reached(letters, MAX_NAME as u64)));
    }
    match text.chars().find(|c| is_other(*c)) {
        Some(other) => Err((at, Problem::Unseen(other))),
        None => Ok(()),
    }
}

fn unknown<'a>(kind: &'static str, name: &str, known: impl IntoIterator<Item = &'a str>) -> Problem {
    Problem::Unknown {
        kind,
        name: name.to_owned(),
        suggestion: nearest(name, known),
    }
}
