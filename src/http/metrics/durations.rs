//! How long did things take? A histogram into which every thread counts in a place of its own.

use std::{
    fmt,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

use prometheus_client::{
    encoding::{EncodeMetric, MetricEncoder, NoLabelSet},
    metrics::{MetricType, TypedMetric},
};

use crate::spread::Spread;

/// What took at most so long falls into the first bucket; each further one takes four times as much, the last one all.
const FIRST: Duration = Duration::from_micros(100);
const BUCKETS: usize = 10;

/// Durations that were observed. Cheap to clone.
#[derive(Debug, Clone, Default)]
pub(super) struct Durations(Arc<Spread<Counts>>);

#[derive(Debug, Default)]
struct Counts {
    buckets: [AtomicU64; BUCKETS],
    nanoseconds: AtomicU64,
}

impl Durations {
    pub(super) fn observe(&self, took: Duration) {
        let bucket = bounds().position(|bound| took <= bound).unwrap_or(BUCKETS - 1);
        let own = self.0.own();
        own.buckets[bucket].fetch_add(1, Ordering::Relaxed);
        let nanoseconds = u64::try_from(took.as_nanos()).unwrap_or(u64::MAX);
        own.nanoseconds.fetch_add(nanoseconds, Ordering::Relaxed);
    }
}

/// Of all buckets but the last one.
fn bounds() -> impl Iterator<Item = Duration> {
    (0..BUCKETS - 1).map(|i| FIRST * (1 << (2 * i)))
}

impl EncodeMetric for Durations {
    fn encode(&self, mut encoder: MetricEncoder) -> Result<(), fmt::Error> {
        let sum = |of: &dyn Fn(&Counts) -> &AtomicU64| -> u64 {
            self.0.all().map(|counts| of(counts).load(Ordering::Relaxed)).sum()
        };
        let bounds_s = bounds().map(|bound| bound.as_secs_f64()).chain([f64::INFINITY]);
        let buckets: Vec<_> = bounds_s
            .enumerate()
            .map(|(i, bound_s)| (bound_s, sum(&|counts| &counts.buckets[i])))
            .collect();
        let count = buckets.iter().map(|(_, count)| count).sum();
        let seconds = sum(&|counts| &counts.nanoseconds) as f64 / 1e9;
        encoder.encode_histogram::<NoLabelSet>(seconds, count, &buckets, None)
    }

    fn metric_type(&self) -> MetricType {
        Self::TYPE
    }
}

impl TypedMetric for Durations {
    const TYPE: MetricType = MetricType::Histogram;
}

#[cfg(test)]
mod tests {
    use prometheus_client::{encoding::text::encode, registry::Registry};

    use super::*;

    #[test]
    fn each_duration_is_in_the_buckets_that_are_wide_enough() {
        let durations = Durations::default();
        for micros in [1, 100, 101, 7_000_000, 6_553_600] {
            durations.observe(Duration::from_micros(micros));
        }
        let mut registry = Registry::default();
        registry.register("took", "Time", durations);
        let mut text = String::new();
        encode(&mut text, &registry).unwrap();
        for line in [
            "took_sum 13.553802\n",
            "took_count 5\n",
            "took_bucket{le=\"0.0001\"} 2\n",
            "took_bucket{le=\"0.0004\"} 3\n",
            "took_bucket{le=\"6.5536\"} 4\n",
            "took_bucket{le=\"+Inf\"} 5\n",
        ] {
            assert!(text.contains(line), "no {line} in {text}");
        }
    }
}
