//! What has the server been doing? Prometheus text at `/metrics`.

mod durations;
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
    durations::Durations,
    states::{JobMetrics, SpanMetrics},
};
use super::{
    AppState,
    error::ApiError,
    routes::{BUNDLE, IMMUTABLE_OBJECT},
};
use crate::{live::LiveCounts, spread::Spread};

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
    cache_bytes: Gauge,
    connections: Gauge,
    connections_refused: Counter,
    catalogue_up: Gauge,
    live: LiveMetrics,
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

/// Of live sessions.
#[derive(Default)]
struct LiveMetrics {
    sessions: Gauge,
    movers: Gauge,
    hushed: Gauge,
    events: Counter,
    at_once: Counter,
    resyncs: Counter,
    floods: Counter,
    expired: Counter,
    taken_up: Counter,
    quality_sessions: Gauge,
    quality_mean: Gauge<f64, AtomicU64>,
    quality_worst: Gauge<f64, AtomicU64>,
    abroad: Gauge,
    connected: Gauge,
    others: Gauge,
    sent: Counter,
    sent_bytes: Counter,
    heard: Counter,
    dropped: Counter,
}

impl LiveMetrics {
    fn register(&self, registry: &mut Registry) {
        let gauges = [
            ("live_sessions", "Open sessions", &self.sessions),
            ("live_movers", "Movers, avatars included", &self.movers),
            (
                "live_hushed_movers",
                "Movers that nobody may see, which cost nothing",
                &self.hushed,
            ),
            (
                "live_remote_movers",
                "Movers of other nodes that may be seen here",
                &self.abroad,
            ),
            (
                "live_quality_sessions",
                "Sessions that say how much of what they see they have downloaded",
                &self.quality_sessions,
            ),
            ("node_connected", "Whether NATS answers", &self.connected),
            ("node_others", "Other nodes, in the scene with most", &self.others),
        ];
        for (name, help, gauge) in gauges {
            registry.register(name, help, gauge.clone());
        }
        for (name, help, gauge) in [
            (
                "live_quality_mean",
                "What they have of what they see, mean",
                &self.quality_mean,
            ),
            ("live_quality_worst", "The same, of who has least", &self.quality_worst),
        ] {
            registry.register(name, help, gauge.clone());
        }
        let counters = [
            ("live_events", "Events for sessions", &self.events),
            (
                "live_events_at_once",
                "Events written into connections without waking their tasks",
                &self.at_once,
            ),
            ("live_resyncs", "Readers that had missed too much", &self.resyncs),
            ("live_floods", "Poses that came too fast", &self.floods),
            ("live_expired_sessions", "Sessions whose lease ran out", &self.expired),
            (
                "live_taken_up_sessions",
                "Sessions that came here when their server was gone",
                &self.taken_up,
            ),
            ("node_sent", "Messages to other nodes", &self.sent),
            ("node_sent_bytes", "Bytes of messages to other nodes", &self.sent_bytes),
            ("node_heard", "Messages of other nodes", &self.heard),
            (
                "node_dropped",
                "Messages to other nodes that could not wait",
                &self.dropped,
            ),
        ];
        for (name, help, counter) in counters {
            registry.register(name, help, counter.clone());
        }
    }

    fn set(&self, counts: &LiveCounts) {
        let gauge = |gauge: &Gauge, value: usize| gauge.set(i64::try_from(value).unwrap_or(i64::MAX));
        gauge(&self.sessions, counts.now.sessions);
        gauge(&self.movers, counts.now.movers);
        gauge(&self.hushed, counts.now.hushed);
        let counter = |counter: &Counter, value| counter.inner().store(value, Ordering::Relaxed);
        counter(&self.events, counts.events);
        counter(&self.at_once, counts.at_once);
        counter(&self.resyncs, counts.resyncs);
        counter(&self.floods, counts.floods);
        counter(&self.expired, counts.expired);
        counter(&self.taken_up, counts.taken_up);
        gauge(&self.quality_sessions, counts.quality.sessions);
        self.quality_mean.set(counts.quality.mean);
        self.quality_worst.set(counts.quality.worst);
        gauge(&self.abroad, counts.now.abroad);
        let nodes = counts.nodes.unwrap_or_default();
        gauge(&self.connected, usize::from(nodes.connected));
        gauge(&self.others, nodes.others);
        counter(&self.sent, nodes.sent);
        counter(&self.sent_bytes, nodes.sent_bytes);
        counter(&self.heard, nodes.heard);
        counter(&self.dropped, nodes.dropped);
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

impl Default for Metrics {
    fn default() -> Self {
        let mut registry = Registry::with_prefix("belvedere");
        let requests = Family::<RequestLabels, SpreadCounter>::default();
        let seconds = Family::<RouteLabel, Durations>::default();
        let sent_bytes = SpreadCounter::default();
        let (cache_hits, cache_misses, variants_damaged) = (Counter::default(), Counter::default(), Counter::default());
        let (cache_bytes, connections, catalogue_up) = (Gauge::default(), Gauge::default(), Gauge::default());
        let connections_refused = Counter::default();
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
        registry.register("blob_cache_bytes", "Bytes of blobs in memory", cache_bytes.clone());
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
                cache_bytes,
                connections,
                connections_refused,
                catalogue_up,
                live,
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
    inner.cache_hits.inner().store(cache.hits, Ordering::Relaxed);
    inner.cache_misses.inner().store(cache.misses, Ordering::Relaxed);
    let damaged = cache.damaged_variants;
    inner.variants_damaged.inner().store(damaged, Ordering::Relaxed);
    inner.cache_bytes.set(i64::try_from(cache.bytes).unwrap_or(i64::MAX));
    let up = state.publications.up_to_date() && state.catalogue.try_writing();
    inner.catalogue_up.set(up.into());
    inner.live.set(&state.live.counts());
    inner.jobs.set(&state.jobs.counts());
    if let Some(counts) = state.traces.counts() {
        inner.spans.set(counts);
    }
    let mut text = String::new();
    encode(&mut text, &inner.registry)?;
    Ok(text)
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
