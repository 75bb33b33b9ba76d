//! Who may speak for a session or a mover? Whoever has its token: 128 bits, shown as 32 hex digits. A mover's are random. A
//! session's are the signature of its name, so that every server that has the same [`Signet`] knows it, also one that has never
//! heard of the session.

use std::{fmt, str::FromStr};

use belvedere_live::event::SessionId;
use hmac::{Hmac, KeyInit, Mac};
use sha2::Sha256;

use super::LiveError;
use crate::{db::Catalogue, secret::Secret};

/// What tokens of sessions are signed with: the same for all servers of a catalogue.
#[derive(Debug)]
pub(super) struct Signet(Secret);

impl Signet {
    /// That of the catalogue, which gets one if it has none.
    pub(super) async fn of(catalogue: &Catalogue) -> anyhow::Result<Self> {
        let fresh = [Token::random()?, Token::random()?].map(Token::reveal).concat();
        Ok(Self(catalogue.session_secret(&fresh.as_str().into()).await?))
    }

    /// The token of a session: the first 16 bytes of HMAC-SHA256 (RFC 2104) of its name.
    pub(super) fn token(&self, session: SessionId) -> Token {
        let mut mac =
            Hmac::<Sha256>::new_from_slice(self.0.reveal().as_bytes()).expect("HMAC takes keys of any length");
        mac.update(format!("session {session}").as_bytes());
        let signature: [u8; 32] = mac.finalize().into_bytes().into();
        let (token, _) = signature.split_first_chunk().expect("32 bytes begin with 16");
        Token(u128::from_be_bytes(*token))
    }
}

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

    #[test]
    fn a_session_has_one_token_under_each_secret() {
        let [a, b] = ["a", "b"].map(|secret| Signet(secret.into()));
        let (one, other) = (SessionId(1), SessionId(11));
        assert_eq!(a.token(one), Signet("a".into()).token(one));
        assert_ne!(a.token(one), a.token(other));
        assert_ne!(a.token(one), b.token(one));
        // printf %s 'session s1' | openssl dgst -sha256 -hmac a
        assert_eq!(a.token(one).reveal(), "47286e4699bfa12a357521b54ac0d4f2");
    }
}
