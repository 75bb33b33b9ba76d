//! How is a request read? Our own `Path` and `Query`, so that whatever is wrong with them is told as a problem.
//!
//! Numbers follow one grammar, [`coordinate`], which `openapi.json` states as a pattern: what matches it is accepted,
//! nothing else is.

use axum::{
    extract::{FromRequestParts, path::ErrorKind, rejection::PathRejection},
    http::{header, request::Parts},
};
use belvedere_scene::{Bounds, ObjectId, Revision};
use percent_encoding::percent_decode_str;

use super::{error::ApiError, owner};
use crate::{live::Token, spelling};

/// The token that a request shows: `Authorization: Bearer …`, or `?token=…` for readers that cannot set headers.
#[derive(Debug)]
pub(super) struct Shown(pub(super) Option<Token>);

impl<S: Sync> FromRequestParts<S> for Shown {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, ApiError> {
        let query = Query::from_request_parts(parts, state).await?;
        let header = match parts.headers.get(header::AUTHORIZATION) {
            // Whoever shows an API key there shows the token in the query.
            Some(_) if owner::key_shown(&parts.headers).is_some() => query.text("token")?,
            Some(value) => {
                let text = value.to_str().unwrap_or_default();
                let bearer = text
                    .split_once(' ')
                    .filter(|(scheme, _)| scheme.eq_ignore_ascii_case("bearer"));
                Some(bearer.ok_or(ApiError::BadToken { pointer: None })?.1.trim())
            }
            None => query.text("token")?,
        };
        header.map(|text| token(text, None)).transpose().map(Self)
    }
}

/// A token as it is written, and where in a body, if it was in one.
pub(super) fn token(text: &str, pointer: Option<&'static str>) -> Result<Token, ApiError> {
    text.parse().map_err(|_| ApiError::BadToken { pointer })
}

/// So many characters of a parameter that cannot be read are said back.
const MOST_ECHOED: usize = 80;
/// So many doors a query may close.
pub(super) const MOST_DOORS: usize = 64;

/// Path parameters; a segment that cannot be read is a 400 that says why.
#[derive(Debug, FromRequestParts)]
#[from_request(via(axum::extract::Path), rejection(ApiError))]
pub(super) struct Path<T>(pub(super) T);

impl From<PathRejection> for ApiError {
    fn from(rejection: PathRejection) -> Self {
        let PathRejection::FailedToDeserializePathParams(failed) = rejection else {
            return Self::Internal(anyhow::Error::new(rejection));
        };
        match failed.into_kind() {
            ErrorKind::Message(detail)
            | ErrorKind::ParseErrorAtKey {
                key: _, value: detail, ..
            }
            | ErrorKind::DeserializeError { message: detail, .. } => Self::bad_request(detail),
            ErrorKind::InvalidUtf8InPathParam { key } => Self::bad_request(format!("`{key}` in the path is not UTF-8")),
            ErrorKind::ParseErrorAtIndex { value, .. } | ErrorKind::ParseError { value, .. } => {
                Self::bad_request(format!("`{value}` in the path cannot be read"))
            }
            other => Self::Internal(anyhow::anyhow!("a route and its handler disagree: {other}")),
        }
    }
}

/// How a level of detail is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    /// As it is stored.
    Published,
    /// Without extensions for geometry.
    Plain,
}

/// The query's parameters, decoded. A known one that comes twice is an error; unknown ones are ignored, but where
/// [`Query::only`] is asked.
#[derive(Debug)]
pub(super) struct Query(Vec<(String, String)>);

impl<S: Sync> FromRequestParts<S> for Query {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, ApiError> {
        Self::parse(parts.uri.query().unwrap_or_default())
    }
}

impl Query {
    fn parse(query: &str) -> Result<Self, ApiError> {
        let decode = |text: &str| {
            let decoded = percent_decode_str(text).decode_utf8();
            decoded.map(|text| text.into_owned()).map_err(|_| {
                ApiError::bad_request(format!(
                    "`{text}` in the query is not UTF-8 when its escapes are decoded"
                ))
            })
        };
        let pairs = query.split('&').filter(|pair| !pair.is_empty()).map(|pair| {
            let (name, value) = pair.split_once('=').unwrap_or((pair, ""));
            Ok((decode(name)?, decode(value)?))
        });
        pairs.collect::<Result<_, _>>().map(Self)
    }

    fn text(&self, name: &'static str) -> Result<Option<&str>, ApiError> {
        let mut values = self
            .0
            .iter()
            .filter(|(n, _)| n == name)
            .map(|(_, value)| value.as_str());
        match (values.next(), values.next()) {
            (_, Some(_)) => Err(ApiError::bad_query(name, format!("`{name}` is given more than once"))),
            (value, None) => Ok(value),
        }
    }

    /// A point `x,y,z` in metres.
    pub(super) fn point(&self, name: &'static str) -> Result<[f64; 3], ApiError> {
        let text = self.text(name)?;
        text.and_then(coordinates).ok_or_else(|| {
            let got = text.map_or_else(
                || "it is missing".to_owned(),
                |text| format!("got `{}`", shortened(text, MOST_ECHOED)),
            );
            ApiError::bad_query(
                name,
                format!("`{name}` must be three decimal numbers x,y,z in metres; {got}"),
            )
        })
    }

    /// A box, given by two opposite corners `x,y,z,x,y,z` in metres.
    pub(super) fn bounds(&self, name: &'static str) -> Result<Bounds, ApiError> {
        let text = self.text(name)?;
        let corners: Option<[f64; 6]> = text.and_then(coordinates);
        let [ax, ay, az, bx, by, bz] = corners.ok_or_else(|| {
            let got = text.map_or_else(
                || "it is missing".to_owned(),
                |text| format!("got `{}`", shortened(text, MOST_ECHOED)),
            );
            let detail = format!("`{name}` must be six decimal numbers minx,miny,minz,maxx,maxy,maxz in metres; {got}");
            ApiError::bad_query(name, detail)
        })?;
        Ok(Bounds::around([[ax, ay, az], [bx, by, bz]]))
    }

    /// Ids of objects, separated by commas, at most [`MOST_DOORS`]; none when it is missing.
    pub(super) fn closed(&self) -> Result<Vec<ObjectId>, ApiError> {
        let Some(text) = self.text("closed")? else {
            return Ok(Vec::new());
        };
        let doors: Result<Vec<ObjectId>, _> = text.split(',').take(MOST_DOORS + 1).map(str::parse).collect();
        let doors = doors.map_err(|error| {
            let detail = format!("`closed` must be doors separated by commas, such as o7,o9: {error}");
            ApiError::bad_query("closed", detail)
        })?;
        if doors.len() > MOST_DOORS {
            let detail = format!("`closed` must name at most {MOST_DOORS} doors");
            return Err(ApiError::bad_query("closed", detail));
        }
        Ok(doors)
    }

    /// A parameter as it was given, escapes decoded; empty when it is missing.
    pub(super) fn given(&self, name: &str) -> &str {
        let found = self.0.iter().find(|(n, _)| n == name);
        found.map_or("", |(_, value)| value)
    }

    /// Refuses whatever is none of these, or comes twice.
    pub(super) fn only(&self, known: &[&'static str]) -> Result<(), ApiError> {
        for name in known {
            self.text(name)?;
        }
        let Some((strange, _)) = self.0.iter().find(|(name, _)| !known.contains(&name.as_str())) else {
            return Ok(());
        };
        let nearest = spelling::nearest_of(&strange.to_ascii_lowercase(), known.iter().copied(), strange.len());
        let meant = match nearest {
            Some(nearest) => format!("did you mean `{nearest}`?"),
            None => format!("there are `{}`", known.join("`, `")),
        };
        let strange = shortened(strange, MOST_ECHOED);
        let detail = format!("there is no parameter `{strange}`; {meant}");
        Err(ApiError::bad_query(strange, detail))
    }

    /// How many entries a page may have.
    pub(super) fn limit(&self) -> Result<usize, ApiError> {
        const DEFAULT: usize = 100;
        const MOST: usize = 1000;
        let Some(text) = self.text("limit")? else {
            return Ok(DEFAULT);
        };
        let digits = text.bytes().all(|b| b.is_ascii_digit());
        let limit = text.parse().ok().filter(|limit| digits && (1..=MOST).contains(limit));
        limit.ok_or_else(|| {
            ApiError::bad_query(
                "limit",
                format!(
                    "`limit` must be a whole number from 1 to {MOST}; got `{}`",
                    shortened(text, MOST_ECHOED)
                ),
            )
        })
    }

    /// How a level of detail is wanted.
    pub(super) fn form(&self) -> Result<Form, ApiError> {
        match self.text("form")? {
            None => Ok(Form::Published),
            Some("plain") => Ok(Form::Plain),
            Some(other) => {
                let detail = format!(
                    "`form` may be `plain` or missing; got `{}`",
                    shortened(other, MOST_ECHOED)
                );
                Err(ApiError::bad_query("form", detail))
            }
        }
    }

    /// The object after which a page starts.
    pub(super) fn after(&self) -> Result<Option<ObjectId>, ApiError> {
        let text = self.text("after")?;
        text.map(str::parse)
            .transpose()
            .map_err(|error| ApiError::bad_query("after", error))
    }

    /// The revision that earlier pages were read from.
    pub(super) fn revision(&self) -> Result<Option<Revision>, ApiError> {
        let text = self.text("revision")?;
        text.map(str::parse)
            .transpose()
            .map_err(|error| ApiError::bad_query("revision", error))
    }
}

pub(super) fn shortened(text: &str, most_chars: usize) -> String {
    let mut short: String = text.chars().take(most_chars).collect();
    if short.len() < text.len() {
        short.push('…');
    }
    short
}

fn coordinates<const N: usize>(text: &str) -> Option<[f64; N]> {
    let mut parts = text.split(',');
    let mut numbers = [0.0; N];
    for number in &mut numbers {
        *number = coordinate(parts.next()?)?;
    }
    parts.next().is_none().then_some(numbers)
}

/// `-?[0-9]{1,16}(\.[0-9]{1,32})?([eE][+-]?[0-9]{1,2})?`, which is always finite.
fn coordinate(text: &str) -> Option<f64> {
    let digits = |part: &str, most: usize| (1..=most).contains(&part.len()) && part.bytes().all(|b| b.is_ascii_digit());
    let (mantissa, exponent) = match text.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, Some(exponent)),
        None => (text, None),
    };
    let mantissa = mantissa.strip_prefix('-').unwrap_or(mantissa);
    let (whole, fraction) = match mantissa.split_once('.') {
        Some((whole, fraction)) => (whole, Some(fraction)),
        None => (mantissa, None),
    };
    let exponent_ok = exponent.is_none_or(|e| digits(e.strip_prefix(['+', '-']).unwrap_or(e), 2));
    let ok = digits(whole, 16) && fraction.is_none_or(|f| digits(f, 32)) && exponent_ok;
    ok.then(|| text.parse().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_three_finite_decimal_numbers() {
        for (text, point) in [("1,2,3", [1.0, 2.0, 3.0]), ("-0.5,1e-7,2.5E+3", [-0.5, 1e-7, 2500.0])] {
            assert_eq!(coordinates(text), Some(point), "{text}");
        }
        for text in [
            "",
            "1,2",
            "1,2,3,4",
            "1,2,3,",
            ",1,2",
            "1,,3",
            "NaN,0,0",
            "inf,0,0",
            "-inf,0,0",
            "1e999,0,0",
            " 1,2,3",
            "0x1,0,0",
            "1.,0,0",
            ".5,0,0",
            "+1,0,0",
            "--1,0,0",
            "1e,0,0",
            "１,0,0",
        ] {
            assert_eq!(coordinates::<3>(text), None, "accepted {text:?}");
        }
    }

    #[test]
    fn escapes_are_decoded_and_must_be_utf8() {
        assert_eq!(
            Query::parse("at=1%2C2%2c3&x=%20").unwrap().point("at").unwrap(),
            [1.0, 2.0, 3.0]
        );
        assert!(Query::parse("at=%ff").is_err());
        assert!(Query::parse("at=1,2,3&at=1,2,3").unwrap().point("at").is_err());
        assert_eq!(Query::parse("&&").unwrap().limit().unwrap(), 100);
    }

    #[test]
    fn limits_outside_one_to_a_thousand_are_refused() {
        for (text, ok) in [
            ("1", true),
            ("1000", true),
            ("0", false),
            ("1001", false),
            ("+5", false),
            ("", false),
            ("9999999999999999999999", false),
        ] {
            assert_eq!(
                Query::parse(&format!("limit={text}")).unwrap().limit().is_ok(),
                ok,
                "{text}"
            );
        }
    }

    #[test]
    fn the_corners_of_a_box_may_come_in_any_order() {
        let bounds = Query::parse("bbox=4,0,6,1,5,3").unwrap().bounds("bbox").unwrap();
        assert_eq!((bounds.min, bounds.max), ([1.0, 0.0, 3.0], [4.0, 5.0, 6.0]));
    }
}
