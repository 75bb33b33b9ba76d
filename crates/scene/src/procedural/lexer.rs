//! Which words does a text consist of?

use super::limits::{MAX_NAME, reached};
use super::problem::Problem;
use super::wording::{cut, shown};

/// A word and where it begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Token<'t> {
    pub(super) kind: Kind<'t>,
    /// Byte in the text.
    pub(super) at: u32,
}

/// What a word is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind<'t> {
    Name(&'t str),
    Number(f64),
    /// Between quotes.
    Text(&'t str),
    /// sRGB channels, 0 to 1.
    Colour([f64; 3]),
    Symbol(&'static str),
    End,
}

impl std::fmt::Display for Kind<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::Name(name) => write!(f, "`{name}`"),
            Self::Number(number) => write!(f, "the number {}", shown(*number)),
            Self::Text(text) => write!(f, "\"{}\"", cut(text)),
            Self::Colour(_) => write!(f, "a colour"),
            Self::Symbol(symbol) => write!(f, "`{symbol}`"),
            Self::End => write!(f, "the end of the file"),
        }
    }
}

/// Longer ones first, so that `<=` is not read as `<`.
const SYMBOLS: [&str; 19] = [
    "<=", ">=", "==", "!=", "(", ")", "[", "]", "{", "}", ",", "=", "<", ">", "+", "-", "*", "/", ".",
];

/// The words of a text, with an end behind the last; or what is wrong, and at which byte.
pub(super) fn words(text: &str) -> Result<Vec<Token<'_>>, (u32, Problem)> {
    let mut lexer = Lexer { text, at: 0 };
    let mut words = Vec::new();
    loop {
        lexer.skip_blank();
        let at = lexer.at as u32;
        let kind = lexer.next().map_err(|problem| (at, problem))?;
        words.push(Token { kind, at });
        if kind == Kind::End {
            return Ok(words);
        }
    }
}

struct Lexer<'t> {
    text: &'t str,
    at: usize,
}

impl<'t> Lexer<'t> {
    fn rest(&self) -> &'t str {
        &self.text[self.at..]
    }

    fn skip_blank(&mut self) {
        loop {
            let rest = self.rest();
            let blank = rest.len() - rest.trim_start_matches([' ', '\t', '\r', '\n', '\u{feff}']).len();
            let comment = if rest[blank..].starts_with("//") {
                rest[blank..].find(['\n', '\r']).unwrap_or(rest.len() - blank)
            } else {
                0
            };
            if blank + comment == 0 {
                return;
            }
            self.at += blank + comment;
        }
    }

    fn take_while(&mut self, fits: impl Fn(char) -> bool) -> &'t str {
        let rest = self.rest();
        let length = rest.find(|c| !fits(c)).unwrap_or(rest.len());
        self.at += length;
        &rest[..length]
    }

    fn next(&mut self) -> Result<Kind<'t>, Problem> {
        let Some(first) = self.rest().chars().next() else {
            return Ok(Kind::End);
        };
        match first {
            'a'..='z' | 'A'..='Z' | '_' => {
                let name = self.take_while(|c| c.is_ascii_alphanumeric() || c == '_');
                if name.len() > MAX_NAME {
                    return Err(reached("letters in a name", MAX_NAME as u64));
                }
                Ok(Kind::Name(name))
            }
            '0'..='9' => self.number(),
            '#' => self.colour(),
            '"' => {
                self.at += 1;
                let text = self.take_while(|c| c != '"' && c != '\n' && c != '\r');
                if !self.rest().starts_with('"') {
                    return Err(Problem::OpenText);
                }
                self.at += 1;
                Ok(Kind::Text(text))
            }
            '/' if self.rest().starts_with("/*") => Err(Problem::Comment),
            _ => {
                let symbol = SYMBOLS.into_iter().find(|symbol| self.rest().starts_with(symbol));
                let symbol = symbol.ok_or(Problem::Character(first))?;
                self.at += symbol.len();
                Ok(Kind::Symbol(symbol))
            }
        }
    }

    fn number(&mut self) -> Result<Kind<'t>, Problem> {
        let start = self.at;
        self.take_while(|c| c.is_ascii_alphanumeric() || c == '.' || c == '_');
        if self.text[..self.at].ends_with(['e', 'E']) && self.rest().starts_with(['-', '+']) {
            self.at += 1;
            self.take_while(|c| c.is_ascii_alphanumeric());
        }
        let found = &self.text[start..self.at];
        let is_plain = found.bytes().all(|b| b.is_ascii_digit() || b"+-.eE".contains(&b));
        let is_plain = is_plain && !found.contains(".e") && !found.contains(".E");
        let number = found
            .parse()
            .ok()
            .filter(|number: &f64| is_plain && number.is_finite() && !found.ends_with('.'));
        number
            .map(Kind::Number)
            .ok_or_else(|| Problem::Number(found.to_owned()))
    }

    fn colour(&mut self) -> Result<Kind<'t>, Problem> {
        self.at += 1;
        let found = self.take_while(|c| c.is_ascii_alphanumeric());
        let digits: Option<Vec<u32>> = found.chars().map(|c| c.to_digit(16)).collect();
        let channel = |high: u32, low: u32| f64::from(16 * high + low) / 255.0;
        match digits.as_deref() {
            Some(&[r, g, b]) => Ok(Kind::Colour([channel(r, r), channel(g, g), channel(b, b)])),
            Some(&[r, s, g, h, b, c]) => Ok(Kind::Colour([channel(r, s), channel(g, h), channel(b, c)])),
            _ => Err(Problem::Colour(found.to_owned())),
        }
    }
}
