//! What is said of a request, and of a bake? Names and attributes are those of OpenTelemetry's semantic conventions for HTTP
//! (stable since 1.23), but for paths, addresses and user agents: a path may hold what opens a private scene, and visitors are nobody's
//! business.

use belvedere_scene::SceneName;
use hyper::{HeaderMap, Method, StatusCode};
use opentelemetry::{
    Context, KeyValue, TraceId,
    propagation::Extractor,
    trace::{SpanBuilder, Status, TraceContextExt, Tracer},
};
use opentelemetry_sdk::trace::SdkTracer;

/// The attribute that names a scene.
pub(super) const SCENE: &str = "belvedere.scene";

/// Longer ones are left out, as W3C Trace Context permits.
const MOST_STATE_BYTES: usize = 512;

/// A method by its name, or `_OTHER`: names that anybody makes up are not repeated.
pub(super) fn known(method: &Method) -> &'static str {
    let known = [
        "GET", "HEAD", "PUT", "POST", "DELETE", "OPTIONS", "PATCH", "TRACE", "CONNECT",
    ];
    known
        .into_iter()
        .find(|known| *known == method.as_str())
        .unwrap_or("_OTHER")
}

/// Of which trace a request says that it is a part.
pub(super) struct TraceHeaders<'a>(pub(super) &'a HeaderMap);

impl Extractor for TraceHeaders<'_> {
    fn get(&self, key: &str) -> Option<&str> {
        let value = self.0.get(key).and_then(|value| value.to_str().ok());
        value.filter(|value| value.len() <= MOST_STATE_BYTES)
    }

    fn keys(&self) -> Vec<&str> {
        self.0.keys().map(hyper::header::HeaderName::as_str).collect()
    }
}

/// The span of a request. When nobody ends it, as when a client goes away, it ends with its last clone.
#[derive(Debug, Clone)]
pub struct RequestSpan {
    span: Context,
    method: &'static str,
}

impl RequestSpan {
    pub(super) fn new(span: Context, method: &'static str) -> Self {
        span.span().set_attribute(KeyValue::new("http.request.method", method));
        Self { span, method }
    }

    /// The trace that it is a part of, for the log.
    #[must_use]
    pub fn trace_id(&self) -> TraceId {
        self.span.span().span_context().trace_id()
    }

    /// The answer is ready. The route is a template, and none where no route was met.
    pub fn end(&self, route: Option<&'static str>, scene: Option<&SceneName>, status: StatusCode) {
        let span = self.span.span();
        if let Some(route) = route {
            span.update_name(format!("{} {route}", self.method));
            span.set_attribute(KeyValue::new("http.route", route));
        }
        if let Some(scene) = scene {
            span.set_attribute(KeyValue::new(SCENE, scene.to_string()));
        }
        span.set_attribute(KeyValue::new("http.response.status_code", i64::from(status.as_u16())));
        if status.is_server_error() {
            // Why, the log says; it may be a secret.
            span.set_attribute(KeyValue::new("error.type", status.as_u16().to_string()));
            span.set_status(Status::error(""));
        }
        span.end();
    }
}

/// The span of a bake, with one inside for each stage. They end when it is dropped.
#[derive(Debug)]
pub struct BakeSpan {
    tracer: SdkTracer,
    /// Goes before the whole.
    stage: Option<(String, Context)>,
    whole: Context,
}

impl BakeSpan {
    pub(super) fn new(tracer: SdkTracer, whole: Context) -> Self {
        Self {
            tracer,
            stage: None,
            whole,
        }
    }

    /// The bake is in this stage.
    pub fn stage(&mut self, name: &str) {
        if self.stage.as_ref().is_some_and(|(current, _)| current == name) {
            return;
        }
        self.stage = None;
        let span = SpanBuilder::from_name(name.to_owned());
        let span = self.tracer.build_with_context(span, &self.whole);
        self.stage = Some((name.to_owned(), Context::new().with_span(span)));
    }

    /// The bake has not published.
    pub fn failed(&self) {
        self.whole.span().set_status(Status::error(""));
    }
}
