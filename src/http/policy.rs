//! What may the viewer's page load, and from where? Everything of its own origin; trees of other origins (`?base=`) where
//! whoever runs the server says so.

use std::{fmt, str::FromStr};

use axum::http::HeaderValue;

/// three.js needs no `eval`, but mesh decoders are WebAssembly, which has a keyword of its own. Textures and parts of GLBs come as
/// blobs, which are read and never run; the page's icon is a `data:` URL.
const SOURCES: &str = "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; \
img-src 'self' blob: data:; style-src 'self'; font-src 'self'; object-src 'none'; base-uri 'none'; \
form-action 'none'; frame-ancestors 'self'; connect-src 'self' blob: data:";

/// A server that the viewer's page may read from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Origin(String);

/// What should be an origin is none.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is no origin like `https://worlds.example.org` or `http://127.0.0.1:8080`")]
pub struct NotAnOrigin(String);

impl FromStr for Origin {
    type Err = NotAnOrigin;

    fn from_str(text: &str) -> Result<Self, NotAnOrigin> {
        let origin = text.strip_suffix('/').unwrap_or(text);
        let host = origin
            .strip_prefix("https://")
            .or_else(|| origin.strip_prefix("http://"));
        // Whatever else stood in the policy would be a directive of its own.
        // No brackets: a policy cannot name addresses of IPv6.
        let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | ':');
        match host {
            Some(host) if !host.is_empty() && host.chars().all(plain) => Ok(Self(origin.to_owned())),
            _ => Err(NotAnOrigin(text.to_owned())),
        }
    }
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// The `Content-Security-Policy` of the viewer's page.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PagePolicy(HeaderValue);

impl PagePolicy {
    /// With trees of these origins beside its own.
    #[must_use]
    pub fn reading(others: &[Origin]) -> Self {
        let others: String = others.iter().map(|origin| format!(" {origin}")).collect();
        let policy = HeaderValue::try_from(SOURCES.to_owned() + &others);
        Self(policy.expect("origins are plain characters"))
    }

    pub(super) fn header(&self) -> HeaderValue {
        self.0.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn origins_that_are_named_are_read_from_and_no_others() {
        let policy = |origins: &[&str]| {
            let origins: Vec<Origin> = origins.iter().map(|origin| origin.parse().unwrap()).collect();
            PagePolicy::reading(&origins).0
        };
        let told = policy(&["https://worlds.example.org/", "http://127.0.0.1:8080"]);
        assert!(
            told.to_str()
                .unwrap()
                .ends_with("; connect-src 'self' blob: data: https://worlds.example.org http://127.0.0.1:8080")
        );
        assert!(
            policy(&[])
                .to_str()
                .unwrap()
                .ends_with("; connect-src 'self' blob: data:")
        );
    }

    #[test]
    fn what_is_no_origin_is_refused_before_it_becomes_a_directive() {
        for text in [
            "",
            "*",
            "worlds.example.org",
            "https://",
            "ftp://worlds.example.org",
            "https://worlds.example.org/tree",
            "https://a.example; script-src *",
            "https://a.example https://b.example",
        ] {
            assert_eq!(text.parse::<Origin>(), Err(NotAnOrigin(text.to_owned())));
        }
    }
}
