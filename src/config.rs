//! What can be set, and where is it set? One list, [`Settings`], which is read from flags, the environment and a TOML
//! file alike; a flag goes before the environment, that before the file, that before the default. A [`Config`] cannot
//! exist unless it is usable.

pub(crate) mod environment;
pub(crate) mod file;
mod listen;
mod live;

use std::{net::SocketAddr, path::PathBuf, time::Duration};

use clap::{Args, ValueEnum};
use serde::Deserialize;

pub use self::live::LiveArgs;
use crate::{
    http::{NotAnOrigin, Origin, accept::ConnectionLimits, tls::TlsFiles},
    jobs::JobSettings,
    live::{
        LiveSettings, NotAToken,
        nodes::{NodeName, NodeSettings, NotANodeName, NotNats},
    },
    place::{Place, PlaceArgs},
    store::NoBucket,
    traces::{NotACollector, NotAShare, Share, TraceSettings},
};

/// Everything that can be set. In the file the names are the same, with `_` for `-`.
#[derive(Debug, Clone, Default, PartialEq, Args, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Address to listen on; port 0 takes a free one and prints it [default: 127.0.0.1:8080]
    #[arg(long, value_name = "ADDR", env = "BELVEDERE_LISTEN", value_parser = listen::address)]
    #[serde(default, deserialize_with = "listen::deserialize")]
    pub listen: Option<SocketAddr>,
    /// Where catalogue and blobs are.
    #[command(flatten)]
    #[serde(flatten)]
    pub place: PlaceArgs,
    /// Certificate in PEM, with those that lead to its root: speak TLS; read again when it changes
    #[arg(long, value_name = "FILE", env = "BELVEDERE_TLS_CERT")]
    pub tls_cert: Option<PathBuf>,
    /// The certificate's private key in PEM
    #[arg(long, value_name = "FILE", env = "BELVEDERE_TLS_KEY")]
    pub tls_key: Option<PathBuf>,
    /// Memory for blobs, in MiB [default: 256]
    #[arg(long, value_name = "MIB", env = "BELVEDERE_CACHE_MIB")]
    pub cache_mib: Option<u64>,
    /// How many connections may be open [default: 10000]
    #[arg(long, value_name = "N", env = "BELVEDERE_MAX_CONNECTIONS")]
    pub max_connections: Option<usize>,
    /// How many of them from one address; as many as all where a proxy stands in front [default: half of all]
    #[arg(long, value_name = "N", env = "BELVEDERE_MAX_CONNECTIONS_PER_ADDRESS")]
    pub max_connections_per_address: Option<usize>,
    /// How long a request may take, in seconds [default: 30]
    #[arg(long, value_name = "S", env = "BELVEDERE_REQUEST_TIMEOUT_S")]
    pub request_timeout_s: Option<u64>,
    /// How many requests one address may send a second, twice as many in a row; immutable objects do not count, and 0 is
    /// any number [default: 0]
    #[arg(long, value_name = "N", env = "BELVEDERE_MAX_REQUESTS_PER_S")]
    pub max_requests_per_s: Option<u32>,
    /// How long open requests may take to finish at shutdown, in seconds [default: 10]
    #[arg(long, value_name = "S", env = "BELVEDERE_DRAIN_S")]
    pub drain_s: Option<u64>,
    /// How often to look for new revisions, in milliseconds [default: 500]
    #[arg(long, value_name = "MS", env = "BELVEDERE_POLL_MS")]
    pub poll_ms: Option<u64>,
    /// Limits of live sessions.
    #[command(flatten)]
    #[serde(flatten)]
    pub live: LiveArgs,
    /// How large an uploaded scene may be, in MiB [default: 1024]
    #[arg(long, value_name = "MIB", env = "BELVEDERE_MAX_UPLOAD_MIB")]
    pub max_upload_mib: Option<u64>,
    /// How many uploaded scenes may be baked at once; 0 leaves them to another server of the same data folder
    /// [default: 1]
    #[arg(long, value_name = "N", env = "BELVEDERE_MAX_BAKES")]
    pub max_bakes: Option<usize>,
    /// How much memory the bake of an upload may take, in MiB of address space [default: 8192]
    #[arg(long, value_name = "MIB", env = "BELVEDERE_BAKE_MEMORY_MIB")]
    pub bake_memory_mib: Option<u64>,
    /// How long the bake of an upload may take, in minutes [default: 360]
    #[arg(long, value_name = "MIN", env = "BELVEDERE_BAKE_MINUTES")]
    pub bake_minutes: Option<u64>,
    /// How many uploads of one key may wait or be baked [default: 8]
    #[arg(long, value_name = "N", env = "BELVEDERE_MAX_JOBS_PER_KEY")]
    pub max_jobs_per_key: Option<u32>,
    /// How many uploads may wait or be baked [default: 64]
    #[arg(long, value_name = "N", env = "BELVEDERE_MAX_JOBS")]
    pub max_jobs: Option<u32>,
    /// Let the viewer show trees of these origins too (`?base=`), like `https://worlds.example.org`; with commas between
    /// [default: those of its own only]
    #[arg(long, value_name = "ORIGIN", env = "BELVEDERE_BASE_ORIGINS", value_delimiter = ',')]
    #[serde(default, deserialize_with = "file::texts")]
    pub base_origins: Vec<String>,
    /// Record what happens in live sessions into this file, or go on with it, for `belvedere audit`
    #[arg(long, value_name = "FILE", env = "BELVEDERE_RECORD")]
    pub record: Option<PathBuf>,
    /// NATS servers through which live sessions of several servers meet, like `nats://host:4222`; the servers share one data
    /// folder or catalogue [default: this server is alone]
    #[arg(long, value_name = "URL", env = "BELVEDERE_NATS", hide_env_values = true)]
    pub nats: Option<String>,
    /// What this server is called among others: lower-case letters, digits and hyphens [default: node]
    #[arg(long, value_name = "NAME", env = "BELVEDERE_NODE")]
    pub node: Option<String>,
    /// Send traces to this collector, by OTLP over HTTP, like `http://host:4318` [default: no traces]
    #[arg(
        long,
        value_name = "URL",
        env = "OTEL_EXPORTER_OTLP_ENDPOINT",
        hide_env_values = true
    )]
    pub otlp: Option<String>,
    /// Of how many requests, in percent, where `traceparent` does not say; of all bakes [default: 100]
    #[arg(long, value_name = "PERCENT", env = "BELVEDERE_OTLP_SAMPLE_PERCENT")]
    pub otlp_sample_percent: Option<f64>,
    /// What to log, like `info` or `warn,belvedere=debug` [default: info,sqlx=warn,async_nats=warn]
    #[arg(long, value_name = "FILTER", env = "BELVEDERE_LOG")]
    pub log: Option<String>,
    /// How to log [default: text]
    #[arg(long, value_name = "FORMAT", env = "BELVEDERE_LOG_FORMAT")]
    pub log_format: Option<LogFormat>,
}

/// The form of a log line.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LogFormat {
    /// For people.
    #[default]
    Text,
    /// One JSON object a line.
    Json,
}

/// Why settings cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("cannot read the configuration {}: {source}", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file does not hold settings. The line itself is not repeated: it may be a secret.
    #[error("the configuration {} is not right in line {line}: {what}", file.display())]
    Malformed {
        /// The file.
        file: PathBuf,
        /// Where, from 1 on.
        line: usize,
        /// Why.
        what: String,
    },
    /// A number that cannot work.
    #[error("`{name}` must be from {least} to {most}; got {got}")]
    OutOfRange {
        /// The setting.
        name: &'static str,
        /// The smallest usable value.
        least: u64,
        /// The largest usable value.
        most: u64,
        /// What was given.
        got: u64,
    },
    /// What should be the operator's token is none.
    #[error("`operator_token` is not right: {0}")]
    OperatorToken(#[from] NotAToken),
    /// There is a certificate without a key, or a key without a certificate; what is missing.
    #[error("TLS needs `tls_cert` and `tls_key`; `{0}` is missing")]
    HalfOfTls(&'static str),
    /// The bucket's address cannot be used.
    #[error(transparent)]
    Bucket(#[from] NoBucket),
    /// What should be an origin of trees is none.
    #[error("`base_origins` is not right: {0}")]
    Origin(#[from] NotAnOrigin),
    /// What should be the address of NATS servers is none.
    #[error("`nats` is not right: {0}")]
    Nats(#[from] NotNats),
    /// What should be the name of a node is none.
    #[error("`node` is not right: {0}")]
    Node(#[from] NotANodeName),
    /// What should be the address of a collector is none.
    #[error("`otlp` is not right: {0}")]
    Otlp(#[from] NotACollector),
    /// What should be a share of requests is none.
    #[error(transparent)]
    Sample(#[from] NotAShare),
    /// The log filter cannot be read.
    #[error("`log` is not a filter like `info` or `warn,belvedere=debug`: {0}")]
    Log(String),
}

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

impl Settings {
    /// These settings, and those of `fallback` where there are none.
    #[must_use]
    pub fn or(self, fallback: Self) -> Self {
        Self {
            listen: self.listen.or(fallback.listen),
            place: self.place.or(fallback.place),
            tls_cert: self.tls_cert.or(fallback.tls_cert),
            tls_key: self.tls_key.or(fallback.tls_key),
            cache_mib: self.cache_mib.or(fallback.cache_mib),
            max_connections: self.max_connections.or(fallback.max_connections),
            max_connections_per_address: self
                .max_connections_per_address
                .or(fallback.max_connections_per_address),
            request_timeout_s: self.request_timeout_s.or(fallback.request_timeout_s),
            max_requests_per_s: self.max_requests_per_s.or(fallback.max_requests_per_s),
            drain_s: self.drain_s.or(fallback.drain_s),
            poll_ms: self.poll_ms.or(fallback.poll_ms),
            live: self.live.or(fallback.live),
            max_upload_mib: self.max_upload_mib.or(fallback.max_upload_mib),
            max_bakes: self.max_bakes.or(fallback.max_bakes),
            bake_memory_mib: self.bake_memory_mib.or(fallback.bake_memory_mib),
            bake_minutes: self.bake_minutes.or(fallback.bake_minutes),
            max_jobs_per_key: self.max_jobs_per_key.or(fallback.max_jobs_per_key),
            max_jobs: self.max_jobs.or(fallback.max_jobs),
            base_origins: if self.base_origins.is_empty() {
                fallback.base_origins
            } else {
                self.base_origins
            },
            record: self.record.or(fallback.record),
            nats: self.nats.or(fallback.nats),
            node: self.node.or(fallback.node),
            otlp: self.otlp.or(fallback.otlp),
            otlp_sample_percent: self.otlp_sample_percent.or(fallback.otlp_sample_percent),
            log: self.log.or(fallback.log),
            log_format: self.log_format.or(fallback.log_format),
        }
    }
}

fn within(name: &'static str, value: u64, least: u64, most: u64) -> Result<u64, ConfigError> {
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

#[cfg(test)]
mod defaults_tests;
#[cfg(test)]
mod tests {
    use super::*;

    fn file(text: &str) -> Result<Settings, ConfigError> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        Settings::from_file(file.path())
    }

    #[test]
    fn the_file_fills_what_flags_leave_open() {
        let flags = Settings {
            cache_mib: Some(7),
            ..Settings::default()
        };
        let merged = flags.or(file("cache_mib = 9\ndrain_s = 3\nlog_format = \"json\"").unwrap());
        let config = Config::try_from(merged).unwrap();
        assert_eq!(
            (config.cache_bytes, config.connections.drain),
            (7 << 20, Duration::from_secs(3))
        );
        assert_eq!(config.log_format, LogFormat::Json);
    }

    #[test]
    fn a_line_that_is_wrong_is_named_and_not_repeated() {
        let error = file("cache_mib = 9\ndatabase = postgres://me:hush@host/db").unwrap_err();
        let told = error.to_string();
        assert!(told.contains("line 2") && !told.contains("hush"), "{told}");
        let set = file("database = \"postgres://me:hush@host/db\"\nstore = \"s3://worlds\"").unwrap();
        let config = Config::try_from(set).unwrap();
        assert!(!format!("{config:?}").contains("hush"));
        assert_eq!(config.place.bucket.unwrap().to_string(), "s3://worlds/");
    }

    #[test]
    fn a_certificate_needs_its_key() {
        let settings = Settings {
            tls_cert: Some("cert.pem".into()),
            ..Settings::default()
        };
        let error = Config::try_from(settings).unwrap_err().to_string();
        assert_eq!(error, "TLS needs `tls_cert` and `tls_key`; `tls_key` is missing");
    }

    #[test]
    fn numbers_that_cannot_work_are_refused_by_name() {
        let settings = Settings {
            max_connections: Some(0),
            ..Settings::default()
        };
        let error = Config::try_from(settings).unwrap_err().to_string();
        assert_eq!(error, "`max_connections` must be from 1 to 1000000; got 0");
    }

    #[test]
    fn origins_of_other_trees_are_named_or_none() {
        let with = |origins: &[&str]| {
            Config::try_from(Settings {
                base_origins: origins.iter().map(ToString::to_string).collect(),
                ..Settings::default()
            })
        };
        let origins = with(&["https://worlds.example.org/", " http://127.0.0.1:9000", ""]).unwrap();
        let told: Vec<_> = origins.base_origins.iter().map(ToString::to_string).collect();
        assert_eq!(told, ["https://worlds.example.org", "http://127.0.0.1:9000"]);
        assert!(
            with(&["*"])
                .unwrap_err()
                .to_string()
                .starts_with("`base_origins` is not right: \"*\"")
        );
        let listed = file("base_origins = [\"https://a.example\", \"https://b.example\"]").unwrap();
        assert_eq!(
            file("base_origins = \"https://a.example,https://b.example\"").unwrap(),
            listed
        );
        let merged = Settings::default().or(file("base_origins = [\"https://a.example\"]").unwrap());
        assert_eq!(Config::try_from(merged).unwrap().base_origins.len(), 1);
    }

    #[test]
    fn an_address_has_half_of_the_sessions_unless_somebody_says_otherwise() {
        let of_an_address = |max_sessions, max_sessions_per_address| {
            let live = LiveArgs {
                max_sessions,
                max_sessions_per_address,
                ..LiveArgs::default()
            };
            LiveSettings::try_from(live).unwrap().sessions_of_an_address
        };
        assert_eq!(
            of_an_address(None, None),
            LiveSettings::default().sessions_of_an_address
        );
        assert_eq!((of_an_address(Some(7), None), of_an_address(Some(7), Some(7))), (4, 7));
    }

    #[test]
    fn an_operators_token_must_be_one() {
        let with = |token: &str| {
            Config::try_from(Settings {
                live: LiveArgs {
                    operator_token: Some(token.to_owned()),
                    ..LiveArgs::default()
                },
                ..Settings::default()
            })
        };
        assert!(with(&"0a".repeat(16)).unwrap().live.operator.is_some());
        let error = with("secret").unwrap_err().to_string();
        assert!(error.contains("operator_token") && !error.contains("secret"), "{error}");
    }

    #[test]
    fn a_collector_is_asked_for_and_must_be_one() {
        let with = |collector: &str, percent| {
            Config::try_from(Settings {
                otlp: Some(collector.to_owned()),
                otlp_sample_percent: Some(percent),
                ..Settings::default()
            })
        };
        assert_eq!(Config::try_from(Settings::default()).unwrap().traces, None);
        assert_eq!(with("", 1.0).unwrap().traces, None);
        let traces = with("http://collector:4318", 0.1).unwrap().traces.unwrap();
        assert_eq!(
            (traces.collector.to_string(), traces.share.to_string()),
            ("http://collector:4318".to_owned(), "0.1".to_owned())
        );
        let told = with("http://me:hush@collector", 1.0).unwrap_err().to_string();
        assert!(told.contains("`otlp`") && !told.contains("hush"), "{told}");
        let told = with("http://collector:4318", 101.0).unwrap_err().to_string();
        assert_eq!(told, "`otlp_sample_percent` must be from 0 to 100; got 101");
    }
}
