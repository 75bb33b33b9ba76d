//! What do the metrics say at one moment? Reads the OpenMetrics text that `/metrics` gives.

use std::collections::BTreeMap;

/// The figures of one moment.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Reading {
    pub(super) requests: f64,
    /// Of them, those answered with 304.
    pub(super) unchanged: f64,
    /// … and with 5xx.
    pub(super) failed: f64,
    pub(super) sent_bytes: f64,
    pub(super) connections: f64,
    pub(super) cache_hits: f64,
    pub(super) cache_misses: f64,
    pub(super) cache_bytes: f64,
    pub(super) catalogue_up: bool,
    pub(super) sessions: f64,
    pub(super) movers: f64,
    pub(super) hushed: f64,
    pub(super) events: f64,
    pub(super) reporting: f64,
    pub(super) quality_mean: f64,
    pub(super) quality_worst: f64,
    pub(super) bakes: f64,
    pub(super) waiting: f64,
    /// How many answers took at most so long, by the bound in seconds; all routes together.
    pub(super) took: BTreeMap<Bound, f64>,
}

/// An upper bound of a histogram in seconds, ordered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bound(pub(super) f64);

impl Eq for Bound {}

impl PartialOrd for Bound {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Bound {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

impl Reading {
    /// Takes what it knows; other lines are not its business.
    pub(super) fn of(text: &str) -> Self {
        let mut reading = Self::default();
        for (name, labels, value) in text.lines().filter_map(sample) {
            let label = |wanted: &str| {
                labels
                    .split(',')
                    .find_map(|one| one.strip_prefix(wanted)?.strip_prefix('='))
            };
            let label = |wanted: &str| label(wanted).map(|quoted| quoted.trim_matches('"'));
            match name {
                "http_requests_total" => {
                    reading.requests += value;
                    match label("status") {
                        Some("304") => reading.unchanged += value,
                        Some(status) if status.starts_with('5') => reading.failed += value,
                        _ => {}
                    }
                }
                "http_request_duration_seconds_bucket" => {
                    let bound = label("le").and_then(|le| le.replace("+Inf", "inf").parse().ok());
                    if let Some(bound) = bound {
                        *reading.took.entry(Bound(bound)).or_default() += value;
                    }
                }
                "http_body_bytes_total" => reading.sent_bytes = value,
                "http_connections" => reading.connections = value,
                "blob_cache_hits_total" => reading.cache_hits = value,
                "blob_cache_misses_total" => reading.cache_misses = value,
                "blob_cache_bytes" => reading.cache_bytes = value,
                "catalogue_up" => reading.catalogue_up = value > 0.0,
                "live_sessions" => reading.sessions = value,
                "live_movers" => reading.movers = value,
                "live_hushed_movers" => reading.hushed = value,
                "live_quality_sessions" => reading.reporting = value,
                "live_quality_mean" => reading.quality_mean = value,
                "live_quality_worst" => reading.quality_worst = value,
                "live_events_total" => reading.events = value,
                "jobs_open" => match label("state") {
                    Some("running") => reading.bakes = value,
                    _ => reading.waiting = value,
                },
                _ => {}
            }
        }
        reading
    }
}

/// `belvedere_name{labels} value`.
fn sample(line: &str) -> Option<(&str, &str, f64)> {
    let (series, value) = line.strip_prefix("belvedere_")?.rsplit_once(' ')?;
    let (name, labels) = match series.split_once('{') {
        Some((name, labels)) => (name, labels.strip_suffix('}')?),
        None => (series, ""),
    };
    Some((name, labels, value.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_of_all_routes_are_added_up() {
        let reading = Reading::of(
            "# HELP belvedere_http_requests Requests.\n\
             belvedere_http_requests_total{route=\"/o/{name}\",status=\"200\"} 6\n\
             belvedere_http_requests_total{route=\"/o/{name}\",status=\"304\"} 3\n\
             belvedere_http_requests_total{route=\"/\",status=\"503\"} 1\n\
             belvedere_http_request_duration_seconds_bucket{le=\"0.1\",route=\"/\"} 4\n\
             belvedere_http_request_duration_seconds_bucket{le=\"+Inf\",route=\"/\"} 5\n\
             belvedere_http_request_duration_seconds_bucket{le=\"0.1\",route=\"/o/{name}\"} 2\n\
             belvedere_catalogue_up 1\nbelvedere_jobs_open{state=\"running\"} 2\nnonsense\n# EOF\n",
        );
        assert_eq!((reading.requests, reading.unchanged, reading.failed), (10.0, 3.0, 1.0));
        assert_eq!(reading.took.get(&Bound(0.1)), Some(&6.0));
        assert_eq!(reading.took.get(&Bound(f64::INFINITY)), Some(&5.0));
        assert!(reading.catalogue_up && reading.bakes == 2.0);
    }
}
