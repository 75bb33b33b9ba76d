//! Which collector gets traces, and of how many requests?

use std::{fmt, str::FromStr};

use hyper::Uri;

/// How a server sends traces.
#[derive(Debug, Clone, PartialEq)]
pub struct TraceSettings {
    /// Where to.
    pub collector: Collector,
    /// Of which share of the requests that nobody has decided about before.
    pub share: Share,
}

/// Where a collector listens: OTLP over HTTP, with protobuf.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Collector(String);

/// The text is no address of a collector. It is not quoted, since it may hold a password.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "it must be like `http://host:4318` or `https://host/path`, without a user or a query; what a collector wants to be \
     shown goes into OTEL_EXPORTER_OTLP_HEADERS"
)]
pub struct NotACollector;

impl Collector {
    /// Where traces are posted to.
    pub(super) fn endpoint(&self) -> String {
        format!("{}/v1/traces", self.0)
    }
}

impl FromStr for Collector {
    type Err = NotACollector;

    fn from_str(text: &str) -> Result<Self, NotACollector> {
        let uri: Uri = text.parse().map_err(|_| NotACollector)?;
        let meant = matches!(uri.scheme_str(), Some("http" | "https"))
            && uri.authority().is_some_and(|at| !at.as_str().contains('@'))
            && uri.host().is_some_and(|host| !host.is_empty())
            && uri.query().is_none()
            && !text.contains('#');
        meant
            .then(|| Self(text.trim_end_matches('/').to_owned()))
            .ok_or(NotACollector)
    }
}

impl fmt::Display for Collector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// A share of requests, in percent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share(f64);

/// The number is no share.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("`otlp_sample_percent` must be from 0 to 100; got {0}")]
pub struct NotAShare(f64);

impl Share {
    /// This many percent.
    ///
    /// # Errors
    /// When it is not from 0 to 100.
    pub fn percent(percent: f64) -> Result<Self, NotAShare> {
        let ok = (0.0..=100.0).contains(&percent);
        ok.then_some(Self(percent)).ok_or(NotAShare(percent))
    }

    pub(super) fn ratio(self) -> f64 {
        self.0 / 100.0
    }
}

impl fmt::Display for Share {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_collector_is_an_address_below_which_traces_are_posted() {
        let endpoint = |text: &str| text.parse::<Collector>().map(|collector| collector.endpoint());
        assert_eq!(endpoint("http://[::1]:4318"), Ok("http://[::1]:4318/v1/traces".into()));
        assert_eq!(endpoint("https://c/otlp/"), Ok("https://c/otlp/v1/traces".into()));
        for wrong in [
            "",
            "collector:4318",
            "/v1",
            "grpc://c:4317",
            "http://me:hush@c",
            "http://c/?key=hush",
            "http://c/#a",
            "http://:4318",
        ] {
            assert_eq!(endpoint(wrong), Err(NotACollector), "{wrong}");
        }
    }

    #[test]
    fn a_share_is_from_none_to_all() {
        assert_eq!(Share::percent(0.5).unwrap().ratio(), 0.005);
        for wrong in [-1.0, 100.1, f64::NAN] {
            assert!(Share::percent(wrong).is_err(), "{wrong}");
        }
    }
}
