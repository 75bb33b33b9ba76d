//! How does the world learn what is published?
//!
//! Handlers parse, ask and answer; everything that holds for all of them (caching headers, problem details, CORS,
//! limits, the log) stands once, in a layer or in a type.
//!
//! * [`routes`]: the table of routes. `openapi`: the same for machines.
//! * `extract`, `body`, `error`, `causes`: how requests are read, and the one shape of every error.
//! * `immutable`, `negotiate`, `conditional`, `ranges`: RFC 9110 for content-addressed bytes, whoever has read the `fields`.
//!   `heads`, `blob_body`: what is sent of them. `rungs`: slices of smooth LODs that are objects of their own. `bundle`:
//!   many of all these in one answer.
//! * `queries`: cells, objects and what is visible. `visible`: the same for any place, computed on line.
//! * `live`: sessions with their event streams, movers and doors.
//! * `uploads`, `rollback`: how what is published changes. `owner`: by whom. `pace`, `peer`: how often, and from where.
//! * [`front`]: the short way of objects that are in memory. `around`: what happens around every request. `metrics`, `cors`, `health`: operations.
//! * `cookie`: tokens of sessions that browsers keep. `visitor`: for whom what is there. `links`: who comes through a link into a private scene.
//! * `viewer`: its page and scripts. `policy`: what these may load, and from where.
//! * `momentary`: answers that no cache keeps. `date`: when they were given.
//! * [`accept`]: the accept loop with its limits, one of them for each of the `addresses`, and its `ending`. [`tls`]: certificates. `direct`: simple requests without TLS,
//!   answered in front of hyper, by the threads of `event_loops`. `streams`, `cork`: those of HTTP/2 are answered at once and sent together. `quiet`: how long a peer is waited for.

pub mod accept;
mod addresses;
mod around;
mod blob_body;
mod body;
mod bundle;
mod causes;
mod conditional;
mod cookie;
mod cork;
mod cors;
mod date;
mod direct;
mod documents;
mod ending;
mod error;
mod event_loops;
mod extract;
mod fields;
pub mod front;
mod heads;
mod health;
mod immutable;
mod links;
mod live;
mod metrics;
mod missing;
mod momentary;
mod negotiate;
mod openapi;
mod owner;
mod pace;
mod peer;
mod policy;
mod queries;
mod quiet;
mod ranges;
mod rollback;
pub mod routes;
mod rungs;
mod streams;
pub mod tls;
mod uploads;
mod viewer;
mod visible;
mod visitor;

use std::time::Duration;

use axum::extract::FromRef;

pub use error::ApiError;
pub use health::Readiness;
pub use metrics::{Metrics, metrics_text};
pub use missing::MissingObjects;
pub use openapi::OPENAPI_JSON;
pub use pace::Pace;
pub use policy::{NotAnOrigin, Origin, PagePolicy};
pub use visible::OnLine;

use crate::{
    db::Catalogue, jobs::Jobs, keys::Keys, live::Live, published::Publications, store::BlobStore, traces::Traces,
};

/// The handles that requests need; each is cheap to clone and none is a lock.
#[derive(Debug, Clone, FromRef)]
pub struct AppState {
    /// What is published.
    pub publications: Publications,
    /// Immutable objects.
    pub blobs: BlobStore,
    /// Asked by `/readyz`, rollbacks, and about objects that are missing.
    pub catalogue: Catalogue,
    /// Objects that are published and not there.
    pub missing: MissingObjects,
    /// Who may publish.
    pub keys: Keys,
    /// What is on its way to being published.
    pub jobs: Jobs,
    /// How often one may ask for what costs much.
    pub pace: Pace,
    /// Who is there.
    pub live: Live,
    /// Whether the server can do its work.
    pub readiness: Readiness,
    /// Counters.
    pub metrics: Metrics,
    /// Where spans go.
    pub traces: Traces,
    /// Limits on one request.
    pub limits: RequestLimits,
    /// Limits on what is computed on line.
    pub on_line: OnLine,
    /// From where the viewer's page may read.
    pub page_policy: PagePolicy,
}

/// Limits on one request.
#[derive(Debug, Clone, Copy)]
pub struct RequestLimits {
    /// A handler that takes longer is cut off with 503.
    pub timeout: Duration,
}
