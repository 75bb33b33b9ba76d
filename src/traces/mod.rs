//! Where does the time of a request or a bake go, among all that it passes through? Spans of OpenTelemetry, sent to a
//! collector by OTLP over HTTP, for who asks for it.
//!
//! * `settings`: which collector, and how many requests. `span`: what is said of a request and of a bake.
//! * `lossy`: a collector that is slow or away costs its spans and nothing else.
//!
//! Spans are made by hand where requests enter and bakes are followed. `tracing` is for the log alone: a layer in between
//! would be asked about every log line, and there is nothing else that it would carry.

mod lossy;
mod settings;
mod span;

use std::{sync::Arc, time::Duration};

use anyhow::Context as _;
use opentelemetry::{
    Context, KeyValue, TraceId,
    propagation::TextMapPropagator,
    trace::{SpanBuilder, SpanKind, TraceContextExt, Tracer, TracerProvider},
};
use opentelemetry_otlp::{SpanExporter, WithExportConfig};
use opentelemetry_sdk::{
    Resource,
    propagation::TraceContextPropagator,
    trace::{
        BatchConfigBuilder, BatchSpanProcessor, Sampler, SamplingResult, SdkTracer, SdkTracerProvider, ShouldSample,
    },
};

use self::lossy::{Bounded, Counting, Losses};
pub use self::{
    settings::{Collector, NotACollector, NotAShare, Share, TraceSettings},
    span::{BakeSpan, RequestSpan},
};

/// Spans that may wait for the collector; some 2 MiB.
const MOST_WAITING: usize = 4096;
/// How long one message to the collector may take.
const SEND_LIMIT: Duration = Duration::from_secs(5);
/// How long the last spans may take at the end.
const END_LIMIT: Duration = Duration::from_secs(3);

/// Where spans go; nowhere, by default, which costs one comparison a request. Cheap to clone.
#[derive(Debug, Clone, Default)]
pub struct Traces(Option<Arc<Inner>>);

#[derive(Debug)]
struct Inner {
    provider: SdkTracerProvider,
    tracer: SdkTracer,
    losses: Arc<Losses>,
}

/// What became of spans.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SpanCounts {
    /// The collector has them.
    pub sent: u64,
    /// The collector did not take them.
    pub refused: u64,
    /// They came while too many waited.
    pub dropped: u64,
}

impl Traces {
    /// Starts to send. Whether the collector answers shows later, in the log and in [`Traces::counts`].
    ///
    /// # Errors
    /// When no thread or no HTTP client can be had.
    pub fn start(settings: &TraceSettings, node: Option<String>) -> anyhow::Result<Self> {
        let exporter = SpanExporter::builder()
            .with_http()
            .with_endpoint(settings.collector.endpoint())
            .with_timeout(SEND_LIMIT)
            .build()
            .context("traces cannot be sent")?;
        let losses = Arc::new(Losses::new(MOST_WAITING));
        let batches = BatchConfigBuilder::default()
            .with_max_queue_size(MOST_WAITING)
            .with_scheduled_delay(Duration::from_secs(1))
            .build();
        let processor = BatchSpanProcessor::builder(Counting::new(exporter, losses.clone()))
            .with_batch_config(batches)
            .build();
        let provider = SdkTracerProvider::builder()
            .with_span_processor(Bounded::new(processor, losses.clone()))
            .with_sampler(Sampler::ParentBased(Box::new(Roots(settings.share.ratio()))))
            .with_resource(resource(node))
            .build();
        let tracer = provider.tracer("belvedere");
        Ok(Self(Some(Arc::new(Inner {
            provider,
            tracer,
            losses,
        }))))
    }

    /// Whether some are sent at all.
    #[must_use]
    pub fn are_sent(&self) -> bool {
        self.0.is_some()
    }

    /// The span of a request that begins now, if it is to be recorded. Whoever sent it may say so, and of which trace it is
    /// a part (W3C Trace Context).
    #[must_use]
    pub fn request(&self, method: &hyper::Method, headers: &hyper::HeaderMap) -> Option<RequestSpan> {
        let inner = self.0.as_ref()?;
        let parent = TraceContextPropagator::new().extract_with_context(&Context::new(), &span::TraceHeaders(headers));
        let method = span::known(method);
        let span = SpanBuilder::from_name(method).with_kind(SpanKind::Server);
        Some(RequestSpan::new(inner.begin(span, &parent)?, method))
    }

    /// The span of a bake that begins now.
    #[must_use]
    pub fn bake(&self, scene: &belvedere_scene::SceneName) -> Option<BakeSpan> {
        let inner = self.0.as_ref()?;
        let span = SpanBuilder::from_name("bake").with_attributes([KeyValue::new(span::SCENE, scene.to_string())]);
        let whole = inner.begin(span, &Context::new())?;
        Some(BakeSpan::new(inner.tracer.clone(), whole))
    }

    /// What became of spans, if there are some.
    #[must_use]
    pub fn counts(&self) -> Option<SpanCounts> {
        self.0.as_ref().map(|inner| inner.losses.counts())
    }

    /// Sends what still waits, as far as that goes in a few seconds. Spans that end later are lost.
    pub async fn finish(&self) {
        let Some(inner) = self.0.clone() else { return };
        let sending = tokio::task::spawn_blocking(move || inner.provider.shutdown_with_timeout(END_LIMIT));
        if let Ok(Err(error)) = sending.await {
            tracing::warn!(%error, "the last traces are lost");
        }
    }
}

impl Inner {
    fn begin(&self, span: SpanBuilder, parent: &Context) -> Option<Context> {
        let span = self.tracer.build_with_context(span, parent);
        let begun = Context::new().with_span(span);
        begun.span().is_recording().then_some(begun)
    }
}

/// Who sends them. `OTEL_RESOURCE_ATTRIBUTES` says more, as for every program that sends traces.
fn resource(node: Option<String>) -> Resource {
    let mut resource = Resource::builder()
        .with_service_name("belvedere")
        .with_attribute(KeyValue::new("service.version", env!("CARGO_PKG_VERSION")));
    if let Some(node) = node {
        resource = resource.with_attribute(KeyValue::new("service.instance.id", node));
    }
    resource.build()
}

/// Of what begins here: a share of the requests, and every bake, since bakes are few.
#[derive(Debug, Clone)]
struct Roots(f64);

impl ShouldSample for Roots {
    fn should_sample(
        &self,
        parent: Option<&Context>,
        trace: TraceId,
        name: &str,
        kind: &SpanKind,
        attributes: &[KeyValue],
        links: &[opentelemetry::trace::Link],
    ) -> SamplingResult {
        let sampler = match kind {
            SpanKind::Server => Sampler::TraceIdRatioBased(self.0),
            _ => Sampler::AlwaysOn,
        };
        sampler.should_sample(parent, trace, name, kind, attributes, links)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use opentelemetry::trace::{SpanId, Status};
    use opentelemetry_sdk::{
        error::OTelSdkResult,
        trace::{SpanData, SpanExporter},
    };

    use super::*;

    #[derive(Debug, Clone, Default)]
    struct Kept(Arc<Mutex<Vec<SpanData>>>);

    impl SpanExporter for Kept {
        async fn export(&self, batch: Vec<SpanData>) -> OTelSdkResult {
            self.0.lock().unwrap().extend(batch);
            Ok(())
        }
    }

    fn recorded(work: impl FnOnce(&Traces)) -> Vec<SpanData> {
        let kept = Kept::default();
        let provider = SdkTracerProvider::builder()
            .with_simple_exporter(kept.clone())
            .with_sampler(Sampler::ParentBased(Box::new(Roots(0.0))))
            .build();
        let tracer = provider.tracer("test");
        let losses = Arc::new(Losses::new(1));
        work(&Traces(Some(Arc::new(Inner {
            provider,
            tracer,
            losses,
        }))));
        kept.0.lock().unwrap().clone()
    }

    #[test]
    fn a_bake_is_recorded_stage_by_stage_whatever_share_of_requests_is() {
        let spans = recorded(|traces| {
            assert!(traces.request(&hyper::Method::GET, &hyper::HeaderMap::new()).is_none());
            let mut bake = traces.bake(&"town".parse().unwrap()).unwrap();
            for stage in ["cut", "cut", "look", "cut"] {
                bake.stage(stage);
            }
            bake.failed();
        });
        let names: Vec<_> = spans.iter().map(|span| span.name.as_ref()).collect();
        assert_eq!(names, ["cut", "look", "cut", "bake"]);
        let whole = &spans[3];
        assert!(
            spans[..3]
                .iter()
                .all(|stage| stage.parent_span_id == whole.span_context.span_id())
        );
        assert_eq!(whole.parent_span_id, SpanId::INVALID);
        assert_eq!(whole.attributes, [KeyValue::new(span::SCENE, "town")]);
        assert_eq!(whole.status, Status::error(""));
    }
}
