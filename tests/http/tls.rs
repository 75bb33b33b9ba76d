//! Does the server speak TLS, with HTTP/2, and take a new certificate without a restart?

use std::{net::SocketAddr, path::Path, sync::Arc, time::Duration};

use belvedere::{config::Settings, http::tls::TlsFiles};
use belvedere_scene::BlobName;
use http_body_util::{BodyExt, Empty};
use hyper_util::rt::{TokioExecutor, TokioIo};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::TcpStream,
};
use tokio_rustls::{
    TlsConnector,
    client::TlsStream,
    rustls::{ClientConfig, RootCertStore, crypto::aws_lc_rs, pki_types::CertificateDer},
};

use crate::scene::{Server, glb};

/// Writes a new certificate of this machine with its key; gives it.
fn certify(folder: &Path) -> CertificateDer<'static> {
    let made = rcgen::generate_simple_self_signed(["localhost".to_owned()]).unwrap();
    std::fs::write(folder.join("key.pem"), made.signing_key.serialize_pem()).unwrap();
    std::fs::write(folder.join("cert.pem"), made.cert.pem()).unwrap();
    made.cert.der().clone()
}

fn files(folder: &Path) -> TlsFiles {
    TlsFiles {
        cert: folder.join("cert.pem"),
        key: folder.join("key.pem"),
    }
}

async fn start(folder: &Path) -> Server {
    let files = files(folder);
    Server::start_with(Settings {
        tls_cert: Some(files.cert),
        tls_key: Some(files.key),
        max_connections: Some(2),
        max_connections_per_address: Some(2),
        ..Settings::default()
    })
    .await
}

async fn connect(
    address: SocketAddr,
    trusted: &CertificateDer<'static>,
    protocol: &str,
) -> std::io::Result<TlsStream<TcpStream>> {
    let mut roots = RootCertStore::empty();
    roots.add(trusted.clone()).unwrap();
    let mut config = ClientConfig::builder_with_provider(Arc::new(aws_lc_rs::default_provider()))
        .with_safe_default_protocol_versions()
        .unwrap()
        .with_root_certificates(roots)
        .with_no_client_auth();
    config.alpn_protocols = vec![protocol.as_bytes().to_vec()];
    let stream = TcpStream::connect(address).await?;
    let stream = TlsConnector::from(Arc::new(config))
        .connect("localhost".try_into().unwrap(), stream)
        .await?;
    assert_eq!(stream.get_ref().1.alpn_protocol(), Some(protocol.as_bytes()));
    Ok(stream)
}

#[tokio::test]
async fn http_2_and_http_1_are_spoken_over_tls() {
    let folder = tempfile::tempdir().unwrap();
    let certificate = certify(folder.path());
    let server = start(folder.path()).await;
    let stream = connect(server.address, &certificate, "h2").await.unwrap();
    let (mut sender, connection) = hyper::client::conn::http2::handshake(TokioExecutor::new(), TokioIo::new(stream))
        .await
        .unwrap();
    let talking = tokio::spawn(connection);
    for _ in 0..3 {
        let request = hyper::Request::get("https://localhost/v1/scenes/row").body(Empty::<&[u8]>::new());
        let answer = sender.send_request(request.unwrap()).await.unwrap();
        assert_eq!(
            (answer.status(), answer.version()),
            (hyper::StatusCode::OK, hyper::Version::HTTP_2)
        );
        let body = answer.into_body().collect().await.unwrap().to_bytes();
        let pointer: serde_json::Value = serde_json::from_slice(&body).unwrap();
        assert_eq!(pointer["scene"], "row");
    }
    drop(sender);
    talking.await.unwrap().unwrap();

    let mut stream = connect(server.address, &certificate, "http/1.1").await.unwrap();
    let request = b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
    stream.write_all(request).await.unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).await.unwrap();
    assert!(answer.starts_with("HTTP/1.1 200 OK"), "{answer}");
}

#[tokio::test]
async fn many_streams_at_once_say_what_each_would_alone() {
    let folder = tempfile::tempdir().unwrap();
    let certificate = certify(folder.path());
    let server = start(folder.path()).await;
    let stream = connect(server.address, &certificate, "h2").await.unwrap();
    let (sender, connection) = hyper::client::conn::http2::handshake(TokioExecutor::new(), TokioIo::new(stream))
        .await
        .unwrap();
    tokio::spawn(connection);
    let (bytes, url) = (glb(), BlobName::of(&glb(), "glb").unwrap().url());
    let slices: Vec<u8> = bytes[..9].iter().chain(&bytes[20..30]).copied().collect();
    let name = &url[3..];
    let paths = [
        (url.clone(), bytes.clone()),
        (
            format!("/o/bundle/{name}@0-9+{name}@20-30"),
            [&b"BVBN\x01\0\x02\0\x09\0\0\0\x13\0\0\0"[..], &slices].concat(),
        ),
        // Of the router.
        (
            "/openapi.json".to_owned(),
            belvedere::http::OPENAPI_JSON.as_bytes().to_vec(),
        ),
    ];
    // The first ones come before the blob is in memory, the later ones after.
    for _ in 0..2 {
        let asked = (0..60).map(|i| {
            let (mut sender, (path, expected)) = (sender.clone(), &paths[i % paths.len()]);
            async move {
                let request = hyper::Request::get(format!("https://localhost{path}")).body(Empty::<&[u8]>::new());
                let answer = sender.send_request(request.unwrap()).await.unwrap();
                assert_eq!(answer.status(), hyper::StatusCode::OK, "{path}");
                let body = answer.into_body().collect().await.unwrap().to_bytes();
                assert!(body == *expected, "{path}: {} bytes", body.len());
            }
        });
        futures_util::future::join_all(asked).await;
    }
}

#[tokio::test]
async fn whoever_does_not_shake_hands_counts_as_a_connection_and_is_let_go() {
    let folder = tempfile::tempdir().unwrap();
    let certificate = certify(folder.path());
    let server = start(folder.path()).await;
    // As many as may be open; one of them in plain text.
    let mut silent = TcpStream::connect(server.address).await.unwrap();
    let mut plain = TcpStream::connect(server.address).await.unwrap();
    let third = connect(server.address, &certificate, "h2");
    tokio::pin!(third);
    let waits = tokio::time::timeout(Duration::from_millis(200), third.as_mut()).await;
    assert!(waits.is_err(), "a third one was taken");
    plain
        .write_all(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")
        .await
        .unwrap();
    let mut answer = vec![];
    plain.read_to_end(&mut answer).await.ok();
    assert!(!answer.starts_with(b"HTTP"), "it was answered in plain text");
    third.await.unwrap();
    // The silent one ends, too.
    tokio::time::timeout(Duration::from_secs(60), silent.read_to_end(&mut answer))
        .await
        .unwrap()
        .ok();
}

#[tokio::test]
async fn a_new_certificate_is_taken_and_a_wrong_one_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let first = certify(folder.path());
    let server = start(folder.path()).await;
    let old = connect(server.address, &first, "h2").await.unwrap();
    std::fs::write(folder.path().join("cert.pem"), "half of it").unwrap();
    drop(old);
    connect(server.address, &first, "h2").await.unwrap();
    let second = certify(folder.path());
    let renewed = async {
        while connect(server.address, &second, "h2").await.is_err() {
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    };
    tokio::time::timeout(Duration::from_secs(60), renewed)
        .await
        .expect("a new certificate within a minute");
    assert!(connect(server.address, &first, "h2").await.is_err());
}

#[test]
fn files_that_cannot_be_used_are_named() {
    let (folder, other) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    certify(folder.path());
    certify(other.path());
    let right = files(folder.path());
    right.check().unwrap();
    let wrong = |cert: &Path, key: &Path| {
        let files = TlsFiles {
            cert: cert.to_owned(),
            key: key.to_owned(),
        };
        files.check().unwrap_err().to_string()
    };
    let told = wrong(&right.cert, &files(other.path()).key);
    assert!(told.contains("cannot be used together"), "{told}");
    assert!(wrong(&right.key, &right.key).contains("key.pem holds no certificate"));
    assert!(wrong(&right.cert, &right.cert).contains("cert.pem holds no private key"));
    assert!(wrong(&folder.path().join("none"), &right.key).contains("cannot read"));
}
