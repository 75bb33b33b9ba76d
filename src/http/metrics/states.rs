//! What becomes of things that end in one of a few ways: uploads and spans.

use prometheus_client::{
    metrics::{counter::Counter, gauge::Gauge},
    registry::Registry,
};

use super::counts::{Kinds, put_each, set_each};
use crate::{jobs::JobCounts, traces::SpanCounts};

/// Of uploads.
#[derive(Default)]
pub(super) struct JobMetrics {
    open: Kinds<Gauge>,
    ended: Kinds<Counter>,
}

impl JobMetrics {
    pub(super) fn register(&self, registry: &mut Registry) {
        registry.register(
            "jobs_open",
            "Uploads that wait, and that are baked here",
            self.open.clone(),
        );
        registry.register("jobs_ended", "Uploads that have ended here", self.ended.clone());
    }

    pub(super) fn set(&self, counts: &JobCounts) {
        let open = [("queued", counts.queued), ("running", counts.running)];
        set_each(&self.open, "state", open);
        let ended = [
            ("done", counts.done),
            ("failed", counts.failed),
            ("cancelled", counts.cancelled),
        ];
        put_each(&self.ended, "state", ended);
    }
}

/// Of traces.
#[derive(Default)]
pub(super) struct SpanMetrics(Kinds<Counter>);

impl SpanMetrics {
    pub(super) fn register(&self, registry: &mut Registry) {
        registry.register("trace_spans", "Spans by what became of them", self.0.clone());
    }

    pub(super) fn set(&self, counts: SpanCounts) {
        let became = [
            ("sent", counts.sent),
            ("refused", counts.refused),
            ("dropped", counts.dropped),
        ];
        put_each(&self.0, "state", became);
    }
}
