//! How is an S3-compatible bucket reached? Where it is comes from the settings, who may use it from the `AWS_…` variables,
//! as with every other program.
//!
//! Requests are tried again with growing pauses, for seconds rather than minutes: whoever waits for an answer is told
//! before its own patience ends, also by a server that says nothing ([`first_bytes`]). What is sent carries its SHA-256, so that a store refuses what arrives damaged.

use std::{fmt, sync::Arc, time::Duration};

use object_store::{
    BackoffConfig, ClientOptions, ObjectStore, RetryConfig,
    aws::{AmazonS3Builder, AmazonS3ConfigKey, Checksum},
    prefix::PrefixStore,
};

use super::{StoreError, first_bytes};

/// What has failed is tried again if no more time has passed: a server that says nothing is asked twice.
const RETRY_FOR: Duration = Duration::from_secs(3);

/// A place in a bucket.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bucket {
    name: String,
    /// Without slashes at its ends; may be empty.
    prefix: String,
    /// The server, where it is not Amazon's.
    endpoint: Option<String>,
    plain_http: bool,
}

/// Why settings name no bucket.
#[derive(Debug, thiserror::Error)]
pub enum NoBucket {
    /// The address of the bucket.
    #[error("`store` must be an address like s3://bucket/prefix; got `{0}`")]
    Address(String),
    /// The address of the server.
    #[error("`store_endpoint` must be an address like https://s3.example, without a path and a password")]
    Endpoint,
    /// There is a server and no bucket on it.
    #[error(
        "`store_endpoint` says whose bucket holds the blobs, and `store` does not say which one; set `store` too, like \
         s3://bucket/prefix, or neither to keep blobs in the data folder"
    )]
    EndpointAlone,
    /// Keys and bytes would be readable on the way.
    #[error(
        "`store_endpoint` is plain HTTP and not on this machine: {0}; use https://, or set `store_plain_http` where the \
         network between is your own"
    )]
    PlainHttp(String),
}

impl Bucket {
    /// Reads `s3://bucket/prefix` and, for servers other than Amazon's, `https://server`.
    ///
    /// # Errors
    /// When either is none, or the server would be asked in plain text over a network and nobody has allowed that.
    pub fn new(address: &str, endpoint: Option<&str>, plain_http: bool) -> Result<Self, NoBucket> {
        let wrong = || NoBucket::Address(address.to_owned());
        let (name, prefix) = address
            .strip_prefix("s3://")
            .ok_or_else(wrong)?
            .split_once('/')
            .map_or_else(
                || (address.trim_start_matches("s3://"), ""),
                |(name, prefix)| (name, prefix.trim_matches('/')),
            );
        let of_a_name = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || matches!(c, '.' | '-' | '_');
        let of_a_prefix = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_' | '/');
        if name.is_empty() || !name.chars().all(of_a_name) || !prefix.chars().all(of_a_prefix) {
            return Err(wrong());
        }
        Ok(Self {
            name: name.to_owned(),
            prefix: prefix.to_owned(),
            endpoint: endpoint.map(|endpoint| server(endpoint, plain_http)).transpose()?,
            plain_http,
        })
    }

    /// What is below a folder of this place.
    pub(super) fn open(&self, folder: &str) -> Result<Arc<dyn ObjectStore>, StoreError> {
        let mut builder = AmazonS3Builder::from_env()
            .with_bucket_name(&self.name)
            .with_checksum_algorithm(Checksum::SHA256)
            .with_retry(RetryConfig {
                backoff: BackoffConfig {
                    init_backoff: Duration::from_millis(100),
                    max_backoff: Duration::from_secs(1),
                    base: 2.0,
                },
                max_retries: 5,
                retry_timeout: RETRY_FOR,
            })
            .with_http_connector(first_bytes::Impatient);
        let mut client = patience();
        let set = |key| builder.get_config_value(&key);
        // Others know it by a variable.
        let endpoint = self.endpoint.clone().or_else(|| set(AmazonS3ConfigKey::Endpoint));
        let keys = [
            AmazonS3ConfigKey::AccessKeyId,
            AmazonS3ConfigKey::WebIdentityTokenFile,
            AmazonS3ConfigKey::ContainerCredentialsRelativeUri,
            AmazonS3ConfigKey::ContainerCredentialsFullUri,
        ];
        if endpoint.is_some() && !keys.into_iter().any(|key| set(key).is_some()) {
            // Only Amazon's machines have a service that gives keys.
            let source = object_store::Error::Generic {
                store: "S3",
                source: "AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY are not set".into(),
            };
            return Err(super::io(format!("use {self}"), source));
        }
        if let Some(endpoint) = endpoint {
            client = client.with_allow_http(self.plain_http || is_here(&endpoint));
            builder = builder
                .with_endpoint(endpoint)
                // Servers of one machine have one name.
                .with_virtual_hosted_style_request(false);
        }
        let bucket = builder
            .with_client_options(client)
            .build()
            .map_err(|source| super::io(format!("use {self}"), source))?;
        let root = [self.prefix.as_str(), folder].join("/");
        Ok(Arc::new(PrefixStore::new(bucket, root.trim_start_matches('/'))))
    }
}

/// A large upload may take long to come, as long as it comes.
fn patience() -> ClientOptions {
    ClientOptions::new()
        .with_connect_timeout(first_bytes::FIRST_BYTE)
        .with_timeout_disabled()
        .with_read_timeout(Duration::from_secs(60))
}

impl fmt::Display for Bucket {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "s3://{}/{}", self.name, self.prefix)?;
        match &self.endpoint {
            Some(endpoint) => write!(f, " at {endpoint}"),
            None => Ok(()),
        }
    }
}

fn server(endpoint: &str, plain_http: bool) -> Result<String, NoBucket> {
    let wrong = || NoBucket::Endpoint;
    let uri: hyper::Uri = endpoint.parse().map_err(|_| wrong())?;
    if uri.path() != "/" || uri.query().is_some() || uri.authority().is_none_or(|a| a.as_str().contains('@')) {
        return Err(wrong());
    }
    match uri.scheme_str() {
        Some("https") => {}
        Some("http") if plain_http || is_here(endpoint) => {}
        Some("http") => return Err(NoBucket::PlainHttp(endpoint.to_owned())),
        _ => return Err(wrong()),
    }
    Ok(endpoint.trim_end_matches('/').to_owned())
}

/// Whether a server is on this machine.
fn is_here(endpoint: &str) -> bool {
    let Ok(uri) = endpoint.parse::<hyper::Uri>() else {
        return false;
    };
    let host = uri.host().unwrap_or_default().trim_matches(['[', ']']);
    host == "localhost"
        || host
            .parse::<std::net::IpAddr>()
            .is_ok_and(|address| address.is_loopback())
}

/// What of the environment a child process needs for the same bucket, as names and values. Secret.
#[must_use]
pub fn credentials() -> Vec<(String, String)> {
    use AmazonS3ConfigKey as K;
    const NEEDED: [K; 14] = [
        K::AccessKeyId,
        K::SecretAccessKey,
        K::Token,
        K::Region,
        K::DefaultRegion,
        K::Endpoint,
        K::ContainerCredentialsRelativeUri,
        K::ContainerCredentialsFullUri,
        K::ContainerAuthorizationTokenFile,
        K::WebIdentityTokenFile,
        K::RoleArn,
        K::RoleSessionName,
        K::StsEndpoint,
        K::ImdsV1Fallback,
    ];
    let given = AmazonS3Builder::from_env();
    let value = |key: &K| Some((key.as_ref().to_ascii_uppercase(), given.get_config_value(key)?));
    NEEDED.iter().filter_map(value).collect()
}

#[cfg(test)]
mod tests {
    use object_store::ClientConfigKey;

    use super::*;

    #[test]
    fn an_address_is_a_bucket_with_or_without_a_prefix() {
        for (address, shown) in [
            ("s3://worlds", "s3://worlds/"),
            ("s3://worlds/", "s3://worlds/"),
            ("s3://worlds/a/b/", "s3://worlds/a/b"),
        ] {
            assert_eq!(Bucket::new(address, None, false).unwrap().to_string(), shown);
        }
        for wrong in [
            "worlds",
            "s3://",
            "s3:///a",
            "http://worlds",
            "s3://a b",
            "s3://worlds/a?b",
        ] {
            assert!(
                matches!(Bucket::new(wrong, None, false), Err(NoBucket::Address(_))),
                "{wrong}"
            );
        }
    }

    #[test]
    fn a_body_may_take_long_and_silence_may_not() {
        let of = |key| patience().get_config_value(&key);
        assert_eq!(of(ClientConfigKey::Timeout), None);
        assert!(of(ClientConfigKey::ReadTimeout).is_some() && of(ClientConfigKey::ConnectTimeout).is_some());
    }

    #[test]
    fn plain_http_is_for_this_machine_or_whoever_asks_for_it() {
        let at = |endpoint, plain| Bucket::new("s3://worlds", Some(endpoint), plain);
        for here in [
            "http://127.0.0.1:9000",
            "http://localhost:9000/",
            "http://[::1]:9000",
            "https://s3.example",
        ] {
            assert!(at(here, false).is_ok(), "{here}");
        }
        assert!(matches!(at("http://minio:9000", false), Err(NoBucket::PlainHttp(_))));
        assert!(at("http://minio:9000", true).is_ok());
        for wrong in [
            "minio:9000",
            "ftp://minio",
            "http://localhost/path",
            "http://me:word@localhost",
        ] {
            assert!(matches!(at(wrong, true), Err(NoBucket::Endpoint)), "{wrong}");
        }
    }
}
