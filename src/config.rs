//! What can be set, and where is it set? One list, [`Settings`], which is read from flags, the environment and a TOML
//! file alike; a flag goes before the environment, that before the file, that before the default. What they come to is a
//! [`Config`].

pub(crate) mod environment;
pub(crate) mod file;
mod listen;
mod live;
mod usable;

#[cfg(test)]
mod defaults_tests;
#[cfg(test)]
mod tests;

use std::{net::SocketAddr, path::PathBuf};

use clap::{Args, ValueEnum};
use serde::Deserialize;

pub use self::{live::LiveArgs, usable::Config};
use crate::{
    http::NotAnOrigin,
    live::{
        NotAToken,
        nodes::{NotANodeName, NotNats},
    },
    place::PlaceArgs,
    store::NoBucket,
    traces::{NotACollector, NotAShare},
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
