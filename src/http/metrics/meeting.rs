//! Who meets in scenes, and what is said between nodes for that?

use std::sync::atomic::AtomicU64;

use prometheus_client::{
    metrics::{counter::Counter, gauge::Gauge},
    registry::Registry,
};

use super::counts::{Kinds, put, put_each, set};
use crate::live::LiveCounts;

/// Of live sessions.
#[derive(Default)]
pub(super) struct LiveMetrics {
    sessions: Gauge,
    movers: Gauge,
    hushed: Gauge,
    events: Counter,
    at_once: Counter,
    resyncs: Kinds<Counter>,
    streams_ended: Kinds<Counter>,
    floods: Counter,
    expired: Counter,
    taken_up: Counter,
    unscreened: Counter,
    crowded: Counter,
    quality_sessions: Gauge,
    quality_mean: Gauge<f64, AtomicU64>,
    quality_worst: Gauge<f64, AtomicU64>,
}

impl LiveMetrics {
    pub(super) fn register(&self, registry: &mut Registry) {
        let gauges = [
            ("live_sessions", "Open sessions", &self.sessions),
            ("live_movers", "Movers, avatars included", &self.movers),
            (
                "live_hushed_movers",
                "Movers that nobody may see, which cost nothing",
                &self.hushed,
            ),
            (
                "live_quality_sessions",
                "Sessions that say how much of what they see they have downloaded",
                &self.quality_sessions,
            ),
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
        for (name, help, counter) in [
            ("live_events", "Events for sessions", &self.events),
            (
                "live_events_at_once",
                "Events written into connections without waking their tasks",
                &self.at_once,
            ),
            ("live_floods", "Poses that came too fast", &self.floods),
            ("live_expired_sessions", "Sessions whose lease ran out", &self.expired),
            (
                "live_taken_up_sessions",
                "Sessions that came here when their server was gone",
                &self.taken_up,
            ),
            (
                "live_unreadable_screens",
                "Questions what closed doors hide that had no answer, since what hides could not be read",
                &self.unscreened,
            ),
            (
                "live_crowded",
                "Sessions and movers that were refused, since their address had its share",
                &self.crowded,
            ),
        ] {
            registry.register(name, help, counter.clone());
        }
        for (name, help, counters) in [
            (
                "live_resyncs",
                "Readers that were told all anew, by what was not known of them",
                &self.resyncs,
            ),
            (
                "live_streams_ended",
                "Event streams that have ended, by why",
                &self.streams_ended,
            ),
        ] {
            registry.register(name, help, counters.clone());
        }
    }

    pub(super) fn set(&self, counts: &LiveCounts) {
        let (resyncs, streams) = (&counts.resyncs, &counts.streams);
        let voids = [("missed", resyncs.missed), ("unknown", resyncs.unknown)];
        put_each(&self.resyncs, "reason", voids);
        let ends = [
            ("cut", streams.cut),
            ("replaced", streams.replaced),
            ("over", streams.over),
        ];
        put_each(&self.streams_ended, "reason", ends);
        set(&self.sessions, counts.now.sessions);
        set(&self.movers, counts.now.movers);
        set(&self.hushed, counts.now.hushed);
        put(&self.events, counts.events);
        put(&self.at_once, counts.at_once);
        put(&self.floods, counts.floods);
        put(&self.expired, counts.expired);
        put(&self.taken_up, counts.taken_up);
        put(&self.unscreened, counts.unscreened);
        put(&self.crowded, counts.crowded);
        set(&self.quality_sessions, counts.quality.sessions);
        self.quality_mean.set(counts.quality.mean);
        self.quality_worst.set(counts.quality.worst);
    }
}

/// Of a node among others. A server that is alone has none of these: who is told that NATS does not answer it would look for one.
#[derive(Default)]
pub(super) struct NodeMetrics {
    abroad: Gauge,
    connected: Gauge,
    others: Gauge,
    sent: Counter,
    sent_bytes: Counter,
    heard: Counter,
    dropped: Counter,
}

impl NodeMetrics {
    pub(super) fn register(&self, registry: &mut Registry) {
        for (name, help, gauge) in [
            (
                "live_remote_movers",
                "Movers of other nodes that may be seen here",
                &self.abroad,
            ),
            ("node_connected", "Whether NATS answers", &self.connected),
            ("node_others", "Other nodes, in the scene with most", &self.others),
        ] {
            registry.register(name, help, gauge.clone());
        }
        for (name, help, counter) in [
            ("node_sent", "Messages to other nodes", &self.sent),
            ("node_sent_bytes", "Bytes of messages to other nodes", &self.sent_bytes),
            ("node_heard", "Messages of other nodes", &self.heard),
            (
                "node_dropped",
                "Messages to other nodes that could not wait",
                &self.dropped,
            ),
        ] {
            registry.register(name, help, counter.clone());
        }
    }

    pub(super) fn set(&self, counts: &LiveCounts) {
        let nodes = counts.nodes.unwrap_or_default();
        set(&self.abroad, counts.now.abroad);
        set(&self.connected, usize::from(nodes.connected));
        set(&self.others, nodes.others);
        put(&self.sent, nodes.sent);
        put(&self.sent_bytes, nodes.sent_bytes);
        put(&self.heard, nodes.heard);
        put(&self.dropped, nodes.dropped);
    }
}
