//! The token of a session in a cookie, for pages whose scripts are not to hold it. Browsers send cookies whoever asks: so one
//! counts only where nothing says that a page of another origin does.
//!
//! `Sec-Fetch-Site` (W3C Fetch Metadata) says it where pages are trustworthy, `Origin` (RFC 6454) where they are not, and programs
//! send neither. Answers to other origins stay without `Access-Control-Allow-Credentials`, so a browser hands them nothing that a cookie
//! has opened, and sends no `PUT` or `DELETE` with one.

use axum::{
    extract::FromRequestParts,
    http::{HeaderName, Uri, header, request::Parts},
};

use super::{
    error::ApiError,
    extract::{Shown, token},
};
use crate::live::Token;

/// Its name.
const NAME: &str = "belvedere_token";
const SEC_FETCH_SITE: HeaderName = HeaderName::from_static("sec-fetch-site");

/// The token of a session that a request shows: as [`Shown`], and else in its cookie.
#[derive(Debug)]
pub(super) struct ShownOfSession(pub(super) Option<Token>);

impl<S: Sync> FromRequestParts<S> for ShownOfSession {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, ApiError> {
        let Shown(shown) = Shown::from_request_parts(parts, state).await?;
        let kept = || kept(parts).filter(|_| is_of_our_origin(parts));
        match shown {
            Some(shown) => Ok(Self(Some(shown))),
            None => kept().map(|text| token(text, None)).transpose().map(Self),
        }
    }
}

/// What the cookie says; the first one, which browsers send for the longest path (RFC 6265 §5.4).
fn kept(parts: &Parts) -> Option<&str> {
    let fields = parts.headers.get_all(header::COOKIE).iter();
    let pairs = fields
        .filter_map(|field| field.to_str().ok())
        .flat_map(|field| field.split(';'));
    let mut named = pairs.filter_map(|pair| pair.trim().split_once('='));
    named.find(|(name, _)| *name == NAME).map(|(_, value)| value)
}

/// Whether nothing says that a page of another origin asks.
fn is_of_our_origin(parts: &Parts) -> bool {
    let mut sites = parts.headers.get_all(SEC_FETCH_SITE).iter().peekable();
    if sites.peek().is_some() {
        return sites.all(|site| site == "same-origin");
    }
    let host = parts.headers.get(header::HOST).and_then(|host| host.to_str().ok());
    let host = host.or_else(|| parts.uri.authority().map(|authority| authority.as_str()));
    let ours = |origin: &str| {
        let origin: Option<Uri> = origin.parse().ok();
        let authority = origin.as_ref().and_then(Uri::authority);
        authority
            .zip(host)
            .is_some_and(|(theirs, ours)| theirs.as_str().eq_ignore_ascii_case(ours))
    };
    // A picture on a foreign page is asked for without an origin, but with the address of the page.
    let said = [header::ORIGIN, header::REFERER];
    let mut said = said.iter().flat_map(|name| parts.headers.get_all(name));
    said.all(|page| page.to_str().is_ok_and(ours))
}

#[cfg(test)]
mod tests {
    use axum::http::Request;

    use super::*;

    const TOKEN: &str = "00112233445566778899aabbccddeeff";

    async fn shown(fields: &[(&str, &str)]) -> Result<Option<String>, u16> {
        use axum::response::IntoResponse;
        let mut request = Request::get("/v1/sessions/s1/events");
        for (name, value) in fields {
            request = request.header(*name, *value);
        }
        let (mut parts, ()) = request.body(()).unwrap().into_parts();
        let shown = ShownOfSession::from_request_parts(&mut parts, &()).await;
        let shown = shown.map_err(|error| error.into_response().status().as_u16())?;
        Ok(shown.0.map(Token::reveal))
    }

    #[tokio::test]
    async fn a_cookie_shows_the_token_where_no_header_does() {
        let cookie = format!("theme=dark; belvedere_token={TOKEN}");
        assert_eq!(shown(&[("cookie", &cookie)]).await, Ok(Some(TOKEN.to_owned())));
        let split = [("cookie", "a=b"), ("cookie", &cookie)];
        assert_eq!(shown(&split).await, Ok(Some(TOKEN.to_owned())), "HTTP/2 may split it");
        let other = TOKEN.replace('0', "1");
        let both = [
            ("cookie", cookie.as_str()),
            ("authorization", &format!("Bearer {other}")),
        ];
        assert_eq!(shown(&both).await, Ok(Some(other)));
        assert_eq!(shown(&[("cookie", "belvedere_token=7")]).await, Err(401));
        for none in ["", "token=7", "xbelvedere_token=7", "belvedere_token"] {
            assert_eq!(shown(&[("cookie", none)]).await, Ok(None), "{none}");
        }
    }

    #[tokio::test]
    async fn a_cookie_counts_for_pages_of_the_same_origin_alone() {
        let cookie = format!("belvedere_token={TOKEN}");
        for (fields, counts) in [
            (
                &[("sec-fetch-site", "same-origin"), ("origin", "https://behind.a.proxy")][..],
                true,
            ),
            (&[("origin", "https://t:8080")], true),
            (&[("origin", "http://T:8080")], true),
            (&[("sec-fetch-site", "cross-site")], false),
            (&[("sec-fetch-site", "same-site"), ("origin", "https://t:8080")], false),
            (
                &[("sec-fetch-site", "same-origin"), ("sec-fetch-site", "cross-site")],
                false,
            ),
            (&[("sec-fetch-site", "none")], false),
            (&[("origin", "https://t")], false),
            (&[("origin", "https://evil.example")], false),
            (&[("origin", "https://t:8080.evil.example")], false),
            (&[("origin", "null")], false),
            (&[("origin", "")], false),
        ] {
            let fields = [&[("host", "t:8080"), ("cookie", &cookie)], fields].concat();
            assert_eq!(
                shown(&fields).await.map(|token| token.is_some()),
                Ok(counts),
                "{fields:?}"
            );
        }
    }
}
