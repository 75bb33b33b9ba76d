//! What does an error look like to a caller? RFC 9457 problem details, everywhere the same.
//!
//! An [`ApiError`] becomes a response that carries its [`Problem`]; the layer `around` adds `instance`, writes the body
//! and logs internal causes, once. Internals never reach the caller.

use std::{borrow::Cow, sync::Arc};

use axum::{
    body::Body,
    http::{HeaderValue, Response, StatusCode, header},
    response::IntoResponse,
};
use belvedere_scene::Revision;
use serde::Serialize;

/// Why a request is not answered as asked.
#[derive(Debug)]
pub enum ApiError {
    /// No such route or file.
    NoRoute,
    /// No such thing; what was looked for.
    NotFound(String),
    /// A path segment or the query cannot be read.
    BadRequest {
        /// The query parameter, when it was one.
        parameter: Option<Cow<'static, str>>,
        /// What is wrong and what would be right.
        detail: String,
    },
    /// The body cannot be read.
    BadBody {
        /// A JSON pointer to what is wrong.
        pointer: Cow<'static, str>,
        /// What is wrong and what would be right.
        detail: String,
    },
    /// The body is no JSON.
    UnsupportedMediaType,
    /// The route is there, but not for this method. `Allow` is set by the router.
    MethodNotAllowed,
    /// None of the stored codings is acceptable.
    NotAcceptable,
    /// The scene has moved on while its pages were read.
    RevisionMoved {
        /// The revision that is current.
        current: Revision,
    },
    /// `If-Match` names something else.
    PreconditionFailed,
    /// A body where none is wanted, or too large a one.
    BodyTooLarge {
        /// How large it may be.
        most_bytes: u64,
    },
    /// No token was shown.
    NoToken,
    /// No token was shown where only the operator's will do.
    NoOperator,
    /// What was shown is no token; where, if it was in a body.
    BadToken {
        /// A JSON pointer to it.
        pointer: Option<&'static str>,
    },
    /// The token is another one; of whom it is not.
    WrongToken(String),
    /// A writing route was asked for without an API key.
    NoKey,
    /// The API key is none, or is valid no more.
    WrongKey,
    /// The API key is valid, but not for this; why.
    NotGranted(String),
    /// The link was signed, and its time is over.
    LinkExpired,
    /// The bytes of an upload came too slowly.
    UploadTooSlow,
    /// A body did not come whole in time.
    BodyTooSlow {
        /// How long it may take, in seconds.
        most_s: u64,
    },
    /// What is asked for cannot be, as things are; why.
    Conflict(String),
    /// It is for another server to answer; what to do.
    Misdirected(String),
    /// Too many requests in a row.
    Flooded {
        /// What became of this one.
        detail: String,
        /// When the next one is welcome.
        retry_s: u64,
    },
    /// An API key has all that it may have; of what.
    QuotaMet(String),
    /// No room for another one; of what.
    Full(String),
    /// The server is about to end.
    Stopping,
    /// The target is too long.
    UriTooLong,
    /// The header fields are too long.
    HeadersTooLarge,
    /// No part of the range lies inside the bytes.
    RangeNotSatisfiable {
        /// How many bytes there are.
        len: u64,
        /// Whether the object has encoded forms, so that a cache must tell requests apart.
        varies: bool,
    },
    /// It took too long.
    TimedOut,
    /// Something that is needed does not answer.
    Unavailable(anyhow::Error),
    /// The same, where it is told what.
    Away {
        /// That the catalogue or the store does not do its part.
        what: &'static str,
        /// Why, for the log.
        cause: anyhow::Error,
    },
    /// The server is at fault.
    Internal(anyhow::Error),
}

/// The problem that a response tells of; `around` writes it as the body.
#[derive(Debug, Clone)]
pub(super) struct Problem {
    pub(super) status: StatusCode,
    pub(super) kind: &'static str,
    pub(super) title: &'static str,
    pub(super) detail: String,
    pub(super) parameter: Option<Cow<'static, str>>,
    pub(super) pointer: Option<Cow<'static, str>>,
    pub(super) cause: Option<Arc<anyhow::Error>>,
}

#[derive(Serialize)]
struct Document<'a> {
    r#type: String,
    title: &'a str,
    status: u16,
    detail: &'a str,
    instance: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    parameter: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pointer: Option<&'a str>,
}

impl Problem {
    /// The body of the response.
    pub(super) fn json(&self, instance: &str) -> Vec<u8> {
        let document = Document {
            r#type: format!("/problems/{}", self.kind),
            title: self.title,
            status: self.status.as_u16(),
            detail: &self.detail,
            instance,
            parameter: self.parameter.as_deref(),
            pointer: self.pointer.as_deref(),
        };
        serde_json::to_vec(&document).expect("a problem holds nothing that JSON cannot say")
    }
}

impl ApiError {
    /// What is wrong with no parameter in particular.
    pub(super) fn bad_request(detail: impl ToString) -> Self {
        Self::BadRequest {
            parameter: None,
            detail: detail.to_string(),
        }
    }

    /// A query parameter that cannot be read.
    pub(super) fn bad_query(parameter: impl Into<Cow<'static, str>>, detail: impl ToString) -> Self {
        Self::BadRequest {
            parameter: Some(parameter.into()),
            detail: detail.to_string(),
        }
    }

    /// A body in which the member at a JSON pointer is wrong.
    pub(super) fn bad_body(pointer: impl Into<Cow<'static, str>>, detail: impl ToString) -> Self {
        Self::BadBody {
            pointer: pointer.into(),
            detail: detail.to_string(),
        }
    }

    /// The same for who sent only the member at a JSON pointer as its body.
    pub(super) fn of_member(self, member: &str) -> Self {
        match self {
            Self::BadBody { pointer, detail } => {
                let inside = pointer.strip_prefix(member).map(str::to_owned);
                Self::bad_body(inside.map_or(pointer, Cow::Owned), detail)
            }
            other => other,
        }
    }

    pub(super) fn problem(self) -> Problem {
        use StatusCode as S;
        let (status, kind, title, detail) = match &self {
            Self::NoRoute => (
                S::NOT_FOUND,
                "no-route",
                "There is nothing at this address",
                "see /openapi.json for what there is".to_owned(),
            ),
            Self::NotFound(what) => (S::NOT_FOUND, "not-found", "Not found", format!("there is no {what}")),
            Self::BadRequest { detail, .. } | Self::BadBody { detail, .. } => (
                S::BAD_REQUEST,
                "bad-request",
                "The request cannot be read",
                detail.clone(),
            ),
            Self::UnsupportedMediaType => (
                S::UNSUPPORTED_MEDIA_TYPE,
                "unsupported-media-type",
                "The body has another media type than this address takes",
                "send JSON with Content-Type: application/json, batches of poses with application/x-ndjson, both in UTF-8, a scene as the \
                 file itself: whole, without multipart; nothing with Content-Encoding".to_owned(),
            ),
            Self::MethodNotAllowed => (
                S::METHOD_NOT_ALLOWED,
                "method-not-allowed",
                "This address does not take this method",
                "the Allow header names the methods that it takes".to_owned(),
            ),
            Self::NotAcceptable => (
                S::NOT_ACCEPTABLE,
                "not-acceptable",
                "No stored encoding is acceptable",
                "Accept-Encoding refuses every encoding of this object; allow identity, zstd or gzip".to_owned(),
            ),
            Self::RevisionMoved { current } => (
                S::CONFLICT,
                "revision-moved",
                "The scene has a new revision",
                format!("the scene is now at revision {current}; start again with that one"),
            ),
            Self::PreconditionFailed => (
                S::PRECONDITION_FAILED,
                "precondition-failed",
                "The object is not the one that If-Match names",
                "fetch it again without If-Match".to_owned(),
            ),
            Self::BodyTooLarge { most_bytes } => (
                S::PAYLOAD_TOO_LARGE,
                "body-too-large",
                "The request has too large a body",
                format!("send at most {most_bytes} bytes; GET and HEAD need none"),
            ),
            Self::NoToken => (
                S::UNAUTHORIZED,
                "no-token",
                "A token is needed",
                "send the token that came with the session or mover as `Authorization: Bearer`, or as `?token=`; a session's may come in the cookie `belvedere_token` from pages of this origin"
                    .to_owned(),
            ),
            Self::NoOperator => (
                S::UNAUTHORIZED,
                "no-token",
                "A token is needed",
                "only the operator makes persistent movers here; send the token that the server was started with as `--operator-token`"
                    .to_owned(),
            ),
            Self::BadToken { .. } => (
                S::UNAUTHORIZED,
                "bad-token",
                "What was sent is no token",
                "a token is 32 lower-case hex digits, as they came with the session or mover; send it as `Authorization: Bearer`, or as `?token=`"
                    .to_owned(),
            ),
            Self::WrongToken(whose) => (
                S::FORBIDDEN,
                "wrong-token",
                "The token is another one",
                format!("it is not that of {whose}"),
            ),
            Self::NoKey => (
                S::UNAUTHORIZED,
                "no-key",
                "An API key is needed",
                "send a key that `belvedere keys create` has made as `Authorization: Bearer`".to_owned(),
            ),
            Self::WrongKey => (
                S::UNAUTHORIZED,
                "wrong-key",
                "The API key is not valid",
                "it is unknown, was revoked or has expired".to_owned(),
            ),
            Self::NotGranted(detail) => (
                S::FORBIDDEN,
                "not-granted",
                "The API key does not cover this",
                detail.clone(),
            ),
            Self::LinkExpired => (
                S::FORBIDDEN,
                "link-expired",
                "This link has expired",
                "ask whoever gave it to you for another one".to_owned(),
            ),
            Self::UploadTooSlow => (
                S::REQUEST_TIMEOUT,
                "upload-too-slow",
                "The upload came too slowly",
                "send at least 1024 bytes a second".to_owned(),
            ),
            Self::BodyTooSlow { most_s } => (
                S::REQUEST_TIMEOUT,
                "body-too-slow",
                "The body came too slowly",
                format!("send all of it within {most_s} seconds"),
            ),
            Self::Conflict(detail) => (S::CONFLICT, "conflict", "This cannot be done now", detail.clone()),
            Self::Misdirected(detail) => (
                S::MISDIRECTED_REQUEST,
                "misdirected",
                "Another node answers this",
                detail.clone(),
            ),
            Self::Flooded { detail, .. } => (
                S::TOO_MANY_REQUESTS,
                "too-many-requests",
                "Too many requests in a row",
                detail.clone(),
            ),
            Self::QuotaMet(detail) => (
                S::TOO_MANY_REQUESTS,
                "quota-met",
                "The API key has no room left",
                detail.clone(),
            ),
            Self::Full(detail) => (S::SERVICE_UNAVAILABLE, "full", "There is no room", detail.clone()),
            Self::Stopping => (
                S::SERVICE_UNAVAILABLE,
                "stopping",
                "The live part of the scene is not running",
                "the server is about to end, or cannot read the scene; try again later".to_owned(),
            ),
            Self::UriTooLong => (
                S::URI_TOO_LONG,
                "uri-too-long",
                "The address is too long",
                "addresses here have up to 8192 bytes".to_owned(),
            ),
            Self::HeadersTooLarge => (
                S::REQUEST_HEADER_FIELDS_TOO_LARGE,
                "headers-too-large",
                "The header fields are too long",
                "send up to 16384 bytes of header fields".to_owned(),
            ),
            Self::RangeNotSatisfiable { len, .. } => (
                S::RANGE_NOT_SATISFIABLE,
                "range-not-satisfiable",
                "No part of the range lies inside the object",
                format!("the object has {len} bytes"),
            ),
            Self::TimedOut => (
                S::SERVICE_UNAVAILABLE,
                "timed-out",
                "The answer took too long",
                "try again later".to_owned(),
            ),
            Self::Unavailable(_) => (
                S::SERVICE_UNAVAILABLE,
                "unavailable",
                "The server is not ready",
                "something that the server needs does not answer; its log says what".to_owned(),
            ),
            Self::Away { what, .. } => (
                S::SERVICE_UNAVAILABLE,
                "unavailable",
                "The server is not ready",
                format!("{what}; what is known is served meanwhile"),
            ),
            Self::Internal(_) => (
                S::INTERNAL_SERVER_ERROR,
                "internal",
                "The server failed",
                "the fault is on this side; the server's log says what happened".to_owned(),
            ),
        };
        let parameter = match &self {
            Self::BadRequest { parameter, .. } => parameter.clone(),
            _ => None,
        };
        let pointer = match &self {
            Self::BadBody { pointer, .. } => Some(pointer.clone()),
            Self::BadToken { pointer } => pointer.map(Cow::Borrowed),
            _ => None,
        };
        let cause = match self {
            Self::Unavailable(cause) | Self::Internal(cause) | Self::Away { cause, .. } => Some(Arc::new(cause)),
            _ => None,
        };
        Problem {
            status,
            kind,
            title,
            detail,
            parameter,
            pointer,
            cause,
        }
    }
}

impl IntoResponse for ApiError {
    fn into_response(self) -> Response<Body> {
        let content_range = match &self {
            Self::RangeNotSatisfiable { len, .. } => HeaderValue::try_from(format!("bytes */{len}")).ok(),
            _ => None,
        };
        let retry_s = match &self {
            Self::TimedOut | Self::Unavailable(_) | Self::Away { .. } | Self::Stopping => Some(1),
            Self::Flooded { retry_s, .. } => Some(*retry_s),
            Self::QuotaMet(_) | Self::Full(_) => Some(10),
            _ => None,
        };
        let unauthorized = matches!(
            self,
            Self::NoToken | Self::NoOperator | Self::BadToken { .. } | Self::NoKey | Self::WrongKey
        );
        let varies = matches!(
            self,
            Self::NotAcceptable | Self::RangeNotSatisfiable { varies: true, .. }
        );
        let problem = self.problem();
        let mut response = Response::new(Body::empty());
        *response.status_mut() = problem.status;
        let headers = response.headers_mut();
        headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
        if let Some(content_range) = content_range {
            headers.insert(header::CONTENT_RANGE, content_range);
        }
        if let Some(retry_s) = retry_s {
            headers.insert(header::RETRY_AFTER, retry_s.into());
        }
        if unauthorized {
            headers.insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
        }
        if varies {
            headers.insert(header::VARY, HeaderValue::from_static("Accept-Encoding"));
        }
        response.extensions_mut().insert(problem);
        response
    }
}
