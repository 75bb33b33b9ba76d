//! What becomes of things that end in one of a few ways: uploads and spans.

use std::sync::atomic::Ordering;

use prometheus_client::{
    encoding::EncodeLabelSet,
    metrics::{counter::Counter, family::Family, gauge::Gauge},
    registry::Registry,
};

use crate::{jobs::JobCounts, traces::SpanCounts};

/// Of uploads.
#[derive(Default)]
pub(super) struct JobMetrics {
    open: Family<StateLabel, Gauge>,
    ended: Family<StateLabel, Counter>,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct StateLabel {
    state: &'static str,
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
        for (state, count) in [("queued", counts.queued), ("running", counts.running)] {
            let gauge = self.open.get_or_create_owned(&StateLabel { state });
            gauge.set(i64::try_from(count).unwrap_or(i64::MAX));
        }
        for (state, count) in [
            ("done", counts.done),
            ("failed", counts.failed),
            ("cancelled", counts.cancelled),
        ] {
            let counter = self.ended.get_or_create_owned(&StateLabel { state });
            counter.inner().store(count, Ordering::Relaxed);
        }
    }
}

/// Of traces.
#[derive(Default)]
pub(super) struct SpanMetrics(Family<StateLabel, Counter>);

impl SpanMetrics {
    pub(super) fn register(&self, registry: &mut Registry) {
        registry.register("trace_spans", "Spans by what became of them", self.0.clone());
    }

    pub(super) fn set(&self, counts: SpanCounts) {
        for (state, count) in [
            ("sent", counts.sent),
            ("refused", counts.refused),
            ("dropped", counts.dropped),
        ] {
            let counter = self.0.get_or_create_owned(&StateLabel { state });
            counter.inner().store(count, Ordering::Relaxed);
        }
    }
}
