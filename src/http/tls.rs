//! How does the server prove who it is? With a certificate and its key, which are read again whenever the files change, so
//! that a renewed certificate needs no restart.
//!
//! The crypto provider is named here: the clients of databases, buckets and others may bring several along, and rustls
//! refuses to choose. HTTP/2 and HTTP/1.1 are offered by ALPN.

use std::{
    fmt,
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

use tokio::{net::TcpStream, sync::watch};
use tokio_rustls::{
    TlsAcceptor,
    rustls::{
        self, ServerConfig,
        crypto::aws_lc_rs,
        pki_types::{
            CertificateDer, PrivateKeyDer,
            pem::{self, PemObject},
        },
    },
    server::TlsStream,
};
use tokio_util::sync::CancellationToken;

use super::cork::{Cork, Corked};

/// How often to look whether the files have changed. New ones are taken when they have stayed the same from one look to
/// the next, so that a certificate is not read without its key.
const LOOK_INTERVAL: Duration = Duration::from_secs(2);
/// How long a peer may take to agree on keys.
const HANDSHAKE: Duration = Duration::from_secs(10);

const HTTP2: &[u8] = b"h2";

/// A connection whose bytes nobody else reads.
pub(super) type Talk = Corked<TlsStream<TcpStream>>;

/// Where certificate and key are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TlsFiles {
    /// The certificate and those that lead to its root, in PEM.
    pub cert: PathBuf,
    /// The private key, in PEM.
    pub key: PathBuf,
}

/// Why there is no TLS.
#[derive(Debug, thiserror::Error)]
pub enum TlsError {
    /// A file cannot be read.
    #[error("cannot read {}: {source}", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file with the certificate holds none.
    #[error("{} holds no certificate in PEM (-----BEGIN CERTIFICATE-----)", .0.display())]
    NoCertificate(PathBuf),
    /// The file with the key holds none.
    #[error("{} holds no private key in PEM (-----BEGIN PRIVATE KEY-----)", .0.display())]
    NoKey(PathBuf),
    /// They do not belong together, or are of a kind that is not known.
    #[error("the certificate {} and the key {} cannot be used together: {source}", files.cert.display(), files.key.display())]
    Unusable {
        /// Both.
        files: TlsFiles,
        /// Why.
        source: rustls::Error,
    },
}

/// What the files hold.
#[derive(PartialEq, Eq)]
struct Pem {
    cert: Vec<u8>,
    key: Vec<u8>,
}

/// Shakes hands. Cheap to clone.
#[derive(Clone)]
pub struct Tls {
    config: watch::Receiver<Arc<ServerConfig>>,
}

impl fmt::Debug for Tls {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Tls").finish_non_exhaustive()
    }
}

impl TlsFiles {
    /// Whether they can be used.
    ///
    /// # Errors
    /// When they cannot.
    pub fn check(&self) -> Result<(), TlsError> {
        self.config(&self.read()?).map(drop)
    }

    fn read(&self) -> Result<Pem, TlsError> {
        let read = |file: &Path| {
            std::fs::read(file).map_err(|source| TlsError::Unreadable {
                file: file.to_owned(),
                source,
            })
        };
        Ok(Pem {
            cert: read(&self.cert)?,
            key: read(&self.key)?,
        })
    }

    fn config(&self, pem: &Pem) -> Result<ServerConfig, TlsError> {
        let chain: Result<Vec<_>, pem::Error> = CertificateDer::pem_slice_iter(&pem.cert).collect();
        let chain = chain.unwrap_or_default();
        if chain.is_empty() {
            return Err(TlsError::NoCertificate(self.cert.clone()));
        }
        let key = PrivateKeyDer::from_pem_slice(&pem.key).map_err(|_| TlsError::NoKey(self.key.clone()))?;
        let made = ServerConfig::builder_with_provider(Arc::new(aws_lc_rs::default_provider()))
            .with_safe_default_protocol_versions()
            .and_then(|builder| builder.with_no_client_auth().with_single_cert(chain, key));
        let mut config = made.map_err(|source| TlsError::Unusable {
            files: self.clone(),
            source,
        })?;
        config.alpn_protocols = vec![HTTP2.to_vec(), b"http/1.1".to_vec()];
        Ok(config)
    }
}

impl Tls {
    /// Reads the files, and again when they change, until `stopping`. What cannot be used then is told in the log, and the
    /// certificate before stays.
    ///
    /// # Errors
    /// When they cannot be used now.
    pub fn follow(files: TlsFiles, stopping: CancellationToken) -> Result<Self, TlsError> {
        let pem = files.read()?;
        let (sender, config) = watch::channel(Arc::new(files.config(&pem)?));
        let following = follow(files, pem, sender);
        tokio::spawn(async move { stopping.run_until_cancelled(following).await });
        Ok(Self { config })
    }

    /// Agrees with a peer on keys, and perhaps on HTTP/2, whose frames are then held back by a cork.
    pub(super) async fn shake_hands(&self, stream: TcpStream) -> std::io::Result<(Talk, Option<Cork>)> {
        let acceptor = TlsAcceptor::from(self.config.borrow().clone());
        let stream = tokio::time::timeout(HANDSHAKE, acceptor.accept(stream)).await??;
        let frames = stream.get_ref().1.alpn_protocol() == Some(HTTP2);
        let cork = frames.then(Cork::default);
        Ok((Corked::new(stream, cork.clone()), cork))
    }
}

async fn follow(files: TlsFiles, mut taken: Pem, sender: watch::Sender<Arc<ServerConfig>>) {
    let (mut seen, mut failing) = (None, false);
    loop {
        tokio::time::sleep(LOOK_INTERVAL).await;
        let reading = tokio::task::spawn_blocking({
            let files = files.clone();
            move || files.read()
        });
        let config = match reading.await.expect("reading does not panic and is not aborted") {
            Ok(pem) if pem == taken => continue,
            Ok(pem) if seen.as_ref() != Some(&pem) => {
                seen = Some(pem);
                continue;
            }
            Ok(pem) => {
                let config = files.config(&pem);
                // Wrong ones too: what is wrong with them is told once.
                taken = pem;
                config
            }
            Err(_) if failing => continue,
            Err(error) => Err(error),
        };
        failing = config.is_err();
        match config {
            Ok(config) => {
                tracing::info!(cert = %files.cert.display(), "a new certificate is in use");
                sender.send_replace(Arc::new(config));
            }
            Err(error) => tracing::error!(%error, "the certificate stays the one before"),
        }
    }
}
