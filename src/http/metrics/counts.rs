//! How does what is counted elsewhere get into a metric, and how where a label tells some kinds of it apart?

use std::sync::atomic::Ordering;

use prometheus_client::metrics::{counter::Counter, family::Family, gauge::Gauge};

/// Metrics of one name that one label tells apart.
pub(super) type Kinds<M> = Family<[(&'static str, &'static str); 1], M>;

pub(super) fn set(gauge: &Gauge, value: impl TryInto<i64>) {
    gauge.set(value.try_into().unwrap_or(i64::MAX));
}

pub(super) fn put(counter: &Counter, value: u64) {
    counter.inner().store(value, Ordering::Relaxed);
}

/// The same for each value of a label.
pub(super) fn set_each<const N: usize>(gauges: &Kinds<Gauge>, label: &'static str, values: [(&'static str, usize); N]) {
    for (kind, value) in values {
        set(&gauges.get_or_create_owned(&[(label, kind)]), value);
    }
}

/// The same for each value of a label.
pub(super) fn put_each<const N: usize>(
    counters: &Kinds<Counter>,
    label: &'static str,
    values: [(&'static str, u64); N],
) {
    for (kind, value) in values {
        put(&counters.get_or_create_owned(&[(label, kind)]), value);
    }
}

#[cfg(test)]
mod tests {
    use prometheus_client::{encoding::text::encode, registry::Registry};

    use super::*;

    #[test]
    fn kinds_are_told_apart_by_the_label_and_the_last_value_counts() {
        let (ended, open) = (Kinds::<Counter>::default(), Kinds::<Gauge>::default());
        let mut registry = Registry::default();
        registry.register("ended", "Ended", ended.clone());
        registry.register("open", "Open", open.clone());
        put_each(&ended, "why", [("cut", 1), ("over", 2)]);
        put_each(&ended, "why", [("cut", 7)]);
        set_each(&open, "state", [("queued", usize::MAX)]);
        let mut text = String::new();
        encode(&mut text, &registry).unwrap();
        for line in [
            "ended_total{why=\"cut\"} 7",
            "ended_total{why=\"over\"} 2",
            "open{state=\"queued\"} 9223372036854775807",
        ] {
            assert!(text.lines().any(|said| said == line), "{text}");
        }
    }
}
