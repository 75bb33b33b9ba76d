//! What if spans come faster than a collector takes them, or it takes none? At most so many wait, the others are lost, and
//! how many is counted; the log says it once when it begins and once when it is over.
//!
//! The SDK's queue is bounded as well, but does not tell what it loses.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering::Relaxed},
    },
    time::Duration,
};

use opentelemetry::Context;
use opentelemetry_sdk::{
    Resource,
    error::OTelSdkResult,
    trace::{Span, SpanData, SpanExporter, SpanProcessor},
};

use super::SpanCounts;

/// What became of spans.
#[derive(Debug)]
pub(super) struct Losses {
    most: usize,
    waiting: AtomicUsize,
    sent: AtomicU64,
    refused: AtomicU64,
    dropped: AtomicU64,
    away: AtomicBool,
    flooded: AtomicBool,
}

impl Losses {
    pub(super) fn new(most: usize) -> Self {
        Self {
            most,
            waiting: AtomicUsize::new(0),
            sent: AtomicU64::new(0),
            refused: AtomicU64::new(0),
            dropped: AtomicU64::new(0),
            away: AtomicBool::new(false),
            flooded: AtomicBool::new(false),
        }
    }

    pub(super) fn counts(&self) -> SpanCounts {
        SpanCounts {
            sent: self.sent.load(Relaxed),
            refused: self.refused.load(Relaxed),
            dropped: self.dropped.load(Relaxed),
        }
    }

    fn may_wait(&self) -> bool {
        let more = |waiting| (waiting < self.most).then_some(waiting + 1);
        if self.waiting.fetch_update(Relaxed, Relaxed, more).is_ok() {
            return true;
        }
        self.dropped.fetch_add(1, Relaxed);
        if !self.flooded.swap(true, Relaxed) {
            tracing::warn!("traces come faster than they can be sent; some are lost");
        }
        false
    }

    fn tried(&self, spans: usize, result: &OTelSdkResult) {
        let Err(error) = result else {
            self.sent.fetch_add(spans as u64, Relaxed);
            if self.away.swap(false, Relaxed) {
                tracing::info!("the collector takes traces again");
            }
            if self.waiting.load(Relaxed) == 0 {
                self.flooded.store(false, Relaxed);
            }
            return;
        };
        self.refused.fetch_add(spans as u64, Relaxed);
        if !self.away.swap(true, Relaxed) {
            tracing::warn!(%error, "the collector takes no traces; they are lost until it does");
        }
    }
}

/// Lets no more spans wait than may.
#[derive(Debug)]
pub(super) struct Bounded<P> {
    inner: P,
    losses: Arc<Losses>,
}

impl<P> Bounded<P> {
    pub(super) fn new(inner: P, losses: Arc<Losses>) -> Self {
        Self { inner, losses }
    }
}

impl<P: SpanProcessor> SpanProcessor for Bounded<P> {
    fn on_start(&self, span: &mut Span, context: &Context) {
        self.inner.on_start(span, context);
    }

    fn on_end(&self, span: SpanData) {
        if self.losses.may_wait() {
            self.inner.on_end(span);
        }
    }

    fn force_flush(&self) -> OTelSdkResult {
        self.inner.force_flush()
    }

    fn shutdown_with_timeout(&self, timeout: Duration) -> OTelSdkResult {
        self.inner.shutdown_with_timeout(timeout)
    }

    fn set_resource(&mut self, resource: &Resource) {
        self.inner.set_resource(resource);
    }
}

/// Counts what is sent.
#[derive(Debug)]
pub(super) struct Counting<E> {
    inner: E,
    losses: Arc<Losses>,
}

impl<E> Counting<E> {
    pub(super) fn new(inner: E, losses: Arc<Losses>) -> Self {
        Self { inner, losses }
    }
}

impl<E: SpanExporter> SpanExporter for Counting<E> {
    async fn export(&self, batch: Vec<SpanData>) -> OTelSdkResult {
        let spans = batch.len();
        self.losses.waiting.fetch_sub(spans, Relaxed);
        let result = self.inner.export(batch).await;
        self.losses.tried(spans, &result);
        result
    }

    fn shutdown_with_timeout(&self, timeout: Duration) -> OTelSdkResult {
        self.inner.shutdown_with_timeout(timeout)
    }

    fn shutdown(&self) -> OTelSdkResult {
        self.inner.shutdown()
    }

    fn force_flush(&self) -> OTelSdkResult {
        self.inner.force_flush()
    }

    fn set_resource(&mut self, resource: &Resource) {
        self.inner.set_resource(resource);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Mutex, mpsc};

    use opentelemetry::trace::{Tracer, TracerProvider};
    use opentelemetry_sdk::{
        error::OTelSdkError,
        trace::{BatchConfigBuilder, BatchSpanProcessor, SdkTracerProvider},
    };

    use super::*;

    /// Answers a batch as told, and not before; says when it has one.
    #[derive(Debug)]
    struct Collector {
        has: mpsc::Sender<usize>,
        answer: Mutex<mpsc::Receiver<bool>>,
    }

    impl SpanExporter for Collector {
        async fn export(&self, batch: Vec<SpanData>) -> OTelSdkResult {
            self.has.send(batch.len()).unwrap();
            let takes = self.answer.lock().unwrap().recv().unwrap();
            takes
                .then_some(())
                .ok_or(OTelSdkError::InternalFailure("no".to_owned()))
        }
    }

    #[test]
    fn what_a_collector_does_not_take_is_counted_and_nothing_waits_for_it() {
        let (has, had) = mpsc::channel();
        let (answers, answer) = mpsc::channel();
        let collector = Collector {
            has,
            answer: Mutex::new(answer),
        };
        let losses = Arc::new(Losses::new(3));
        let one_by_one = BatchConfigBuilder::default()
            .with_max_queue_size(3)
            .with_max_export_batch_size(1)
            .build();
        let processor = BatchSpanProcessor::builder(Counting::new(collector, losses.clone()))
            .with_batch_config(one_by_one)
            .build();
        let provider = SdkTracerProvider::builder()
            .with_span_processor(Bounded::new(processor, losses.clone()))
            .build();
        let tracer = provider.tracer("test");
        drop(tracer.start("held by the collector"));
        assert_eq!(had.recv().unwrap(), 1);
        for _ in 0..5 {
            drop(tracer.start("3 wait, 2 are too many"));
        }
        assert_eq!(losses.counts().dropped, 2);
        for takes in [false, true, true, true] {
            answers.send(takes).unwrap();
        }
        provider.shutdown().unwrap();
        let counts = SpanCounts {
            sent: 3,
            refused: 1,
            dropped: 2,
        };
        assert_eq!(losses.counts(), counts);
    }
}
