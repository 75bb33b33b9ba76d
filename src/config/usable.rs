//! What do settings come to, and can they work? A [`Config`] cannot exist unless it is usable.

use std::{net::SocketAddr, path::PathBuf, time::Duration};

use super::{ConfigError, LogFormat, Settings};
use crate::{
    http::{Origin, accept::ConnectionLimits, tls::TlsFiles},
    jobs::JobSettings,
    live::{
        LiveSettings,
        nodes::{NodeName, NodeSettings},
    },
    place::Place,
    traces::{Share, TraceSettings},
};

/// Usable settings of a server.
#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// Where to listen.
    pub listen: SocketAddr,
    /// Where catalogue and blobs are.
    pub place: Place,
    /// Where the certificate is, if the server shall speak TLS.
    pub tls: Option<TlsFiles>,
    /// Memory for blobs.
    pub cache_bytes: u64,
    /// Limits on connections.
    pub connections: ConnectionLimits,
    /// Limit on one request.
    pub request_timeout: Duration,
    /// How many requests one address may send a second; 0 is any number.
    pub requests_per_s: u32,
    /// How often to look for new revisions.
    pub poll: Duration,
    /// Limits of uploads and their bakes.
    pub jobs: JobSettings,
    /// Limits of live sessions.
    pub live: LiveSettings,
    /// Other servers with sessions in the same scenes, if there may be some.
    pub nodes: Option<NodeSettings>,
    /// What this server is called, whether there are others or not.
    pub node: Option<NodeName>,
    /// Whose trees the viewer may show beside those of this server.
    pub base_origins: Vec<Origin>,
    /// Where live sessions are recorded, if they are.
    pub record: Option<PathBuf>,
    /// Where traces go, if they go anywhere.
    pub traces: Option<TraceSettings>,
    /// Of how many requests, if they go anywhere.
    pub share: Share,
    /// What to log.
    pub log: String,
    /// How to log.
    pub log_format: LogFormat,
}

/// A number in these limits, which are told where it is not.
pub(super) fn within(name: &'static str, value: u64, least: u64, most: u64) -> Result<u64, ConfigError> {
    let ok = (least..=most).contains(&value);
    ok.then_some(value).ok_or(ConfigError::OutOfRange {
        name,
        least,
        most,
        got: value,
    })
}

impl TryFrom<Settings> for Config {
    type Error = ConfigError;

    fn try_from(settings: Settings) -> Result<Self, ConfigError> {
        let limits = ConnectionLimits::default();
        let connections = settings.max_connections.unwrap_or(limits.connections);
        let of_an_address = settings.max_connections_per_address.map(|most| most as u64);
        let of_an_address = of_an_address.map(|most| within("max_connections_per_address", most, 1, 1_000_000));
        // Whether NATS answers is logged once, not with every attempt.
        let log = settings
            .log
            .unwrap_or_else(|| "info,sqlx=warn,async_nats=warn".to_owned());
        log.parse::<tracing_subscriber::filter::Targets>()
            .map_err(|error| ConfigError::Log(error.to_string()))?;
        let node: Option<NodeName> = settings.node.map(|name| name.parse()).transpose()?;
        let nats = settings.nats.map(|servers| servers.parse()).transpose()?;
        let nodes = nats.map(|nats| NodeSettings {
            nats,
            name: node.clone(),
        });
        // An empty variable is one that is not set, says OpenTelemetry.
        let collector = settings.otlp.filter(|collector| !collector.is_empty());
        let share = Share::percent(settings.otlp_sample_percent.unwrap_or(100.0))?;
        let traces = collector
            .map(|collector| collector.parse().map(|collector| TraceSettings { collector, share }))
            .transpose()?;
        let jobs = JobSettings::default();
        let upload_mib = settings.max_upload_mib.unwrap_or(jobs.upload_bytes >> 20);
        let memory_mib = settings.bake_memory_mib.unwrap_or(jobs.memory_bytes >> 20);
        let bakes = settings.max_bakes.unwrap_or(jobs.bakes) as u64;
        let minutes = settings.bake_minutes.unwrap_or(jobs.time.as_secs() / 60);
        let open_of_a_key = u64::from(settings.max_jobs_per_key.unwrap_or(jobs.open_of_a_key));
        let open_of_all = u64::from(settings.max_jobs.unwrap_or(jobs.open_of_all));
        let jobs = JobSettings {
            upload_bytes: within("max_upload_mib", upload_mib, 1, 1 << 20)? << 20,
            bakes: within("max_bakes", bakes, 0, 64)? as usize,
            memory_bytes: within("bake_memory_mib", memory_mib, 256, 1 << 20)? << 20,
            time: Duration::from_secs(60 * within("bake_minutes", minutes, 1, 1 << 20)?),
            open_of_a_key: within("max_jobs_per_key", open_of_a_key, 1, 10_000)? as u32,
            open_of_all: within("max_jobs", open_of_all, 1, 10_000)? as u32,
        };
        let request_timeout = within("request_timeout_s", settings.request_timeout_s.unwrap_or(30), 1, 3600)?;
        let request_timeout = Duration::from_secs(request_timeout);
        // A handler that takes its whole time must not look like a peer that is silent.
        let answer = limits.answer + request_timeout;
        Ok(Self {
            listen: settings
                .listen
                .unwrap_or_else(|| SocketAddr::from(([127, 0, 0, 1], 8080))),
            place: Place::try_from(&settings.place)?,
            tls: match (settings.tls_cert, settings.tls_key) {
                (Some(cert), Some(key)) => Some(TlsFiles { cert, key }),
                (None, None) => None,
                (Some(_), None) => return Err(ConfigError::HalfOfTls("tls_key")),
                (None, Some(_)) => return Err(ConfigError::HalfOfTls("tls_cert")),
            },
            cache_bytes: within("cache_mib", settings.cache_mib.unwrap_or(256), 1, 1 << 20)? << 20,
            connections: ConnectionLimits {
                connections: within("max_connections", connections as u64, 1, 1_000_000)? as usize,
                of_an_address: of_an_address.transpose()?.map(|most| most as usize),
                head: limits.head,
                drain: Duration::from_secs(within("drain_s", settings.drain_s.unwrap_or(10), 0, 3600)?),
                answer,
                quiet: limits.quiet.max(answer),
            },
            request_timeout,
            requests_per_s: settings.max_requests_per_s.unwrap_or(0),
            jobs,
            live: settings.live.try_into()?,
            nodes,
            node,
            base_origins: settings
                .base_origins
                .iter()
                .map(|origin| origin.trim())
                .filter(|origin| !origin.is_empty())
                .map(str::parse)
                .collect::<Result<_, _>>()?,
            record: settings.record,
            traces,
            share,
            poll: Duration::from_millis(within("poll_ms", settings.poll_ms.unwrap_or(500), 10, 3_600_000)?),
            log,
            log_format: settings.log_format.unwrap_or_default(),
        })
    }
}
