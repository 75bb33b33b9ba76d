//! What has the server been doing? Prometheus text at `/metrics`.

mod counts;
mod durations;
mod meeting;
mod states;

use std::{
    fmt,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

use axum::{
    extract::State,
    http::{StatusCode, header},
    response::{IntoResponse, Response},
};
use prometheus_client::{
    encoding::{EncodeLabelSet, text::encode},
    metrics::{
        counter::{self, Counter},
        family::Family,
        gauge::Gauge,
    },
    registry::{Registry, Unit},
};

use self::{
    counts::{put, set},
    durations::Durations,
    meeting::{LiveMetrics, NodeMetrics},
    states::{JobMetrics, SpanMetrics},
};
use super::{
    AppState,
    error::ApiError,
    routes::{BUNDLE, IMMUTABLE_OBJECT},
};
use crate::spread::Spread;

/// Counters of one server. Cheap to clone.
#[derive(Clone)]
pub struct Metrics {
    inner: Arc<Inner>,
}

struct Inner {
    registry: Registry,
    requests: Family<RequestLabels, SpreadCounter>,
    seconds: Family<RouteLabel, Durations>,
    immutable: FromMemory,
    bundles: FromMemory,
    sent_bytes: SpreadCounter,
    cache_hits: Counter,
    cache_misses: Counter,
    variants_damaged: Counter,
    blobs_missing: Counter,
    cache_bytes: Gauge,
    lent_bytes: Gauge,
    connections: Gauge,
    connections_refused: Counter,
    catalogue_up: Gauge,
    live: LiveMetrics,
    /// Where there may be other nodes.
    nodes: Option<NodeMetrics>,
    jobs: JobMetrics,
    spans: SpanMetrics,
}

/// What every request counts.
type SpreadCounter = Counter<u64, Spread<AtomicU64>>;

impl counter::Atomic<u64> for Spread<AtomicU64> {
    fn inc(&self) -> u64 {
        self.inc_by(1)
    }

    /// Nobody asks what this thread's own count was before.
    fn inc_by(&self, more: u64) -> u64 {
        self.own().fetch_add(more, Ordering::Relaxed)
    }

    fn get(&self) -> u64 {
        self.sum()
    }
}

/// The counters of what is answered from memory on one route, looked up once: a label lookup costs more than the answer.
struct FromMemory {
    whole: SpreadCounter,
    slices: SpreadCounter,
    unchanged: SpreadCounter,
    seconds: Durations,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct RequestLabels {
    route: &'static str,
    status: u16,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct RouteLabel {
    route: &'static str,
}

impl fmt::Debug for Metrics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Metrics").finish_non_exhaustive()
    }
}

impl Metrics {
    /// Counters of a server; of its dealings with others only where it is a node among them.
    #[must_use]
    pub fn new(among_nodes: bool) -> Self {
        let mut registry = Registry::with_prefix("belvedere");
        let requests = Family::<RequestLabels, SpreadCounter>::default();
        let seconds = Family::<RouteLabel, Durations>::default();
        let sent_bytes = SpreadCounter::default();
        let (cache_hits, cache_misses, variants_damaged) = (Counter::default(), Counter::default(), Counter::default());
        let (cache_bytes, connections, catalogue_up) = (Gauge::default(), Gauge::default(), Gauge::default());
        let lent_bytes = Gauge::default();
        let (connections_refused, blobs_missing) = (Counter::default(), Counter::default());
        registry.register(
            "http_requests",
            "Requests by route template and status",
            requests.clone(),
        );
        registry.register_with_unit(
            "http_request_duration",
            "Time until the head of the answer was ready",
            Unit::Seconds,
            seconds.clone(),
        );
        registry.register(
            "http_body_bytes",
            "Body bytes of answers, as announced",
            sent_bytes.clone(),
        );
        registry.register("blob_cache_hits", "Blobs answered from memory", cache_hits.clone());
        registry.register("blob_cache_misses", "Blobs read from the store", cache_misses.clone());
        registry.register(
            "blob_variants_damaged",
            "Content-coded forms of blobs that were found damaged, each once; the blobs are served in their other forms",
            variants_damaged.clone(),
        );
        registry.register(
            "blobs_missing",
            "Blobs of current revisions that were asked for and not in the store; one a second is looked up",
            blobs_missing.clone(),
        );
        registry.register("blob_cache_bytes", "Bytes of blobs in memory", cache_bytes.clone());
        registry.register(
            "blob_lent_bytes",
            "Bytes of blobs that readers hold beside those, of what they have still to get",
            lent_bytes.clone(),
        );
        registry.register("http_connections", "Open connections", connections.clone());
        registry.register(
            "http_connections_refused",
            "Connections of addresses that had too many",
            connections_refused.clone(),
        );
        registry.register(
            "catalogue_up",
            "Whether the catalogue has answered when it was last asked, and could be written; 0: served is what was known",
            catalogue_up.clone(),
        );
        let live = LiveMetrics::default();
        live.register(&mut registry);
        let nodes = among_nodes.then(NodeMetrics::default);
        if let Some(nodes) = &nodes {
            nodes.register(&mut registry);
        }
        let jobs = JobMetrics::default();
        jobs.register(&mut registry);
        let spans = SpanMetrics::default();
        spans.register(&mut registry);
        let from_memory = |route| {
            let answered = |status| requests.get_or_create_owned(&RequestLabels { route, status });
            FromMemory {
                whole: answered(200),
                slices: answered(206),
                unchanged: answered(304),
                seconds: seconds.get_or_create_owned(&RouteLabel { route }),
            }
        };
        let (immutable, bundles) = (from_memory(IMMUTABLE_OBJECT), from_memory(BUNDLE));
        Self {
            inner: Arc::new(Inner {
                immutable,
                bundles,
                registry,
                requests,
                seconds,
                sent_bytes,
                cache_hits,
                cache_misses,
                variants_damaged,
                blobs_missing,
                cache_bytes,
                lent_bytes,
                connections,
                connections_refused,
                catalogue_up,
                live,
                nodes,
                jobs,
                spans,
            }),
        }
    }
}

/// Counts one open connection until it is dropped.
#[derive(Debug)]
pub(super) struct OpenConnection(Gauge);

impl Drop for OpenConnection {
    fn drop(&mut self) {
        self.0.dec();
    }
}

impl Metrics {
    /// What was counted, as OpenMetrics text.
    ///
    /// # Errors
    /// Never, unless memory cannot be written to.
    pub fn text(&self) -> Result<String, fmt::Error> {
        let mut text = String::new();
        encode(&mut text, &self.inner.registry)?;
        Ok(text)
    }

    pub(super) fn connection(&self) -> OpenConnection {
        self.inner.connections.inc();
        OpenConnection(self.inner.connections.clone())
    }

    pub(super) fn connection_refused(&self) {
        self.inner.connections_refused.inc();
    }

    /// An immutable object was answered from memory.
    pub(super) fn immutable(&self, status: StatusCode, body_bytes: u64, took: Duration) {
        self.answered_from_memory(&self.inner.immutable, (status, body_bytes), took);
    }

    /// A bundle was answered from memory.
    pub(super) fn bundle(&self, status: StatusCode, body_bytes: u64, took: Duration) {
        self.answered_from_memory(&self.inner.bundles, (status, body_bytes), took);
    }

    fn answered_from_memory(&self, route: &FromMemory, (status, body_bytes): (StatusCode, u64), took: Duration) {
        match status {
            StatusCode::PARTIAL_CONTENT => &route.slices,
            StatusCode::NOT_MODIFIED => &route.unchanged,
            _ => &route.whole,
        }
        .inc();
        route.seconds.observe(took);
        self.inner.sent_bytes.inc_by(body_bytes);
    }

    pub(super) fn request(&self, route: &'static str, status: u16, body_bytes: u64, took: Duration) {
        self.inner
            .requests
            .get_or_create(&RequestLabels { route, status })
            .inc();
        self.inner.seconds.get_or_create(&RouteLabel { route }).observe(took);
        self.inner.sent_bytes.inc_by(body_bytes);
    }
}

/// What the server has been doing, as OpenMetrics text.
///
/// # Errors
/// Never, unless memory cannot be written to.
pub fn metrics_text(state: &AppState) -> Result<String, fmt::Error> {
    let (inner, cache) = (&state.metrics.inner, state.blobs.cache_use());
    put(&inner.cache_hits, cache.hits);
    put(&inner.cache_misses, cache.misses);
    put(&inner.variants_damaged, cache.damaged_variants);
    put(&inner.blobs_missing, state.missing.found());
    set(&inner.cache_bytes, cache.bytes);
    set(&inner.lent_bytes, cache.lent_bytes);
    let up = state.publications.up_to_date() && state.catalogue.try_writing();
    inner.catalogue_up.set(up.into());
    let live = state.live.counts();
    inner.live.set(&live);
    if let Some(nodes) = &inner.nodes {
        nodes.set(&live);
    }
    inner.jobs.set(&state.jobs.counts());
    if let Some(counts) = state.traces.counts() {
        inner.spans.set(counts);
    }
    state.metrics.text()
}

/// `GET /metrics`.
pub(super) async fn metrics(State(state): State<AppState>) -> Result<Response, ApiError> {
    // What is told is how it is, not how it was when somebody asked last.
    _ = state.catalogue.writable().await;
    let text = metrics_text(&state).map_err(|e| ApiError::Internal(e.into()))?;
    let headers = [
        (
            header::CONTENT_TYPE,
            "application/openmetrics-text; version=1.0.0; charset=utf-8",
        ),
        (header::CACHE_CONTROL, "no-store"),
    ];
    Ok((headers, text).into_response())
}
