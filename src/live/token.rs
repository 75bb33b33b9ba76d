//! Who may speak for a session or a mover? Whoever has its token: 128 random bits, shown as 32 hex digits.

use std::{fmt, str::FromStr};

use super::LiveError;

/// A secret.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Token(u128);

/// The text is no token.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a token is 32 lower-case hex digits")]
pub struct NotAToken;

impl Token {
    /// A new one.
    pub(super) fn random() -> Result<Self, LiveError> {
        let mut bytes = [0; 16];
        getrandom::fill(&mut bytes).map_err(|error| {
            tracing::error!(%error, "the system gives no random numbers");
            LiveError::Stopped
        })?;
        Ok(Self(u128::from_le_bytes(bytes)))
    }

    /// Whether the one that was shown is this one.
    pub(super) fn admit(self, shown: Option<Self>, whose: impl FnOnce() -> String) -> Result<(), LiveError> {
        match shown {
            None => Err(LiveError::NoToken),
            Some(shown) if shown == self => Ok(()),
            Some(_) => Err(LiveError::WrongToken(whose())),
        }
    }

    /// The digits, for whom it was made.
    #[must_use]
    pub fn reveal(self) -> String {
        format!("{:032x}", self.0)
    }
}

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(…)")
    }
}

impl FromStr for Token {
    type Err = NotAToken;

    fn from_str(text: &str) -> Result<Self, NotAToken> {
        let hex = text.len() == 32 && text.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'));
        let number = u128::from_str_radix(text, 16).ok().filter(|_| hex);
        number.map(Self).ok_or(NotAToken)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_differ_and_have_one_spelling_that_logs_do_not_show() {
        let (a, b) = (Token::random().unwrap(), Token::random().unwrap());
        assert_ne!(a, b);
        assert_eq!(a.reveal().parse(), Ok(a));
        assert!(!format!("{a:?}").contains(&a.reveal()));
        for text in [
            "",
            "0",
            "g0000000000000000000000000000000",
            "+0000000000000000000000000000000",
        ] {
            assert_eq!(text.parse::<Token>(), Err(NotAToken), "{text}");
        }
    }
}
