//! What does a collector of traces get to see, and what if there is none?

use std::sync::{Arc, Mutex};

use axum::{Router, body::Bytes, extract::State, http::HeaderMap, routing::post};
use belvedere::{config::Settings, links::LinkKey};
use opentelemetry_proto::tonic::{
    collector::trace::v1::ExportTraceServiceRequest,
    common::v1::{KeyValue, any_value::Value},
    trace::v1::Span,
};
use prost::Message;

use crate::{
    scene::{Server, publish_as},
    wire::{get, send},
};

const TRACE: &str = "4bf92f3577b34da6a3ce929d0e0e4736";
const PARENT: &str = "00f067aa0ba902b7";

/// A collector on a free port; what was posted to it.
#[derive(Clone, Default)]
struct Collector(Arc<Mutex<Vec<Bytes>>>);

impl Collector {
    /// The address that a server sends to, below a path.
    async fn start(&self) -> String {
        async fn take(State(collector): State<Collector>, headers: HeaderMap, body: Bytes) {
            assert_eq!(headers["content-type"], "application/x-protobuf");
            collector.0.lock().unwrap().push(body);
        }
        let router = Router::new().route("/below/v1/traces", post(take));
        let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        tokio::spawn(axum::serve(listener, router.with_state(self.clone())).into_future());
        format!("http://{address}/below/")
    }

    async fn server(&self, percent: f64) -> Server {
        Server::start_with(Settings {
            otlp: Some(self.start().await),
            otlp_sample_percent: Some(percent),
            max_bakes: Some(0),
            ..Settings::default()
        })
        .await
    }

    /// Everything that has come once the server has ended, which sends the last.
    async fn spans_of(&self, mut server: Server) -> Vec<Span> {
        end(&mut server).await;
        let bodies = self.0.lock().unwrap();
        let requests = bodies
            .iter()
            .map(|body| ExportTraceServiceRequest::decode(body.clone()).unwrap());
        let resources: Vec<_> = requests.flat_map(|request| request.resource_spans).collect();
        for resource in &resources {
            let of = &resource.resource.as_ref().unwrap().attributes;
            assert_eq!(text(of, "service.name"), Some("belvedere"));
        }
        let scopes = resources.into_iter().flat_map(|resource| resource.scope_spans);
        scopes.flat_map(|scope| scope.spans).collect()
    }
}

async fn end(server: &mut Server) {
    server.stopping.cancel();
    (&mut server.running).await.unwrap().unwrap();
}

fn value<'a>(attributes: &'a [KeyValue], key: &str) -> Option<&'a Value> {
    let found = attributes.iter().find(|attribute| attribute.key == key)?;
    found.value.as_ref()?.value.as_ref()
}

fn text<'a>(attributes: &'a [KeyValue], key: &str) -> Option<&'a str> {
    match value(attributes, key) {
        Some(Value::StringValue(text)) => Some(text),
        _ => None,
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn traceparent(sampled: bool) -> String {
    format!("00-{TRACE}-{PARENT}-0{}", u8::from(sampled))
}

#[tokio::test]
async fn a_request_is_a_span_of_the_trace_that_it_names() {
    let collector = Collector::default();
    let server = collector.server(0.0).await;
    let path = "/v1/scenes/row/cells/c3";
    let answer = send(server.address, "GET", path, &[("traceparent", &traceparent(true))]).await;
    assert_eq!(answer.status, 200);
    let metrics = String::from_utf8(get(server.address, "/metrics").await.body).unwrap();
    assert!(
        metrics.contains(r#"belvedere_trace_spans_total{state="dropped"} 0"#),
        "{metrics}"
    );
    let spans = collector.spans_of(server).await;
    let [span] = &spans[..] else {
        panic!("one of the two requests was to be recorded: {spans:?}");
    };
    assert_eq!(
        (hex(&span.trace_id), hex(&span.parent_span_id)),
        (TRACE.to_owned(), PARENT.to_owned())
    );
    assert_eq!(span.name, "GET /v1/scenes/{scene}/cells/{cell}");
    assert_eq!(span.kind, 2, "a server's");
    let attributes = &span.attributes;
    assert_eq!(text(attributes, "http.request.method"), Some("GET"));
    assert_eq!(text(attributes, "http.route"), Some("/v1/scenes/{scene}/cells/{cell}"));
    assert_eq!(text(attributes, "belvedere.scene"), Some("row"));
    assert_eq!(
        value(attributes, "http.response.status_code"),
        Some(&Value::IntValue(200))
    );
    assert_eq!(attributes.len(), 4, "{attributes:?}");
}

#[tokio::test]
async fn who_sends_a_request_says_whether_it_is_recorded_and_else_the_server() {
    let collector = Collector::default();
    let server = collector.server(100.0).await;
    send(
        server.address,
        "GET",
        "/v1/scenes/row",
        &[("traceparent", &traceparent(false))],
    )
    .await;
    let made_up = [("traceparent", "not one")];
    assert_eq!(send(server.address, "BREW", "/nowhere", &made_up).await.status, 404);
    let spans = collector.spans_of(server).await;
    let [span] = &spans[..] else {
        panic!("only the second was to be recorded: {spans:?}");
    };
    assert!(span.parent_span_id.is_empty());
    assert_eq!(span.name, "_OTHER");
    assert_eq!(text(&span.attributes, "http.route"), None);
}

#[tokio::test]
async fn objects_in_memory_are_recorded_as_well() {
    let collector = Collector::default();
    let server = collector.server(100.0).await;
    let pointer = get(server.address, "/v1/scenes/row").await.json();
    let manifest = pointer["manifest"].as_str().unwrap();
    for _ in 0..3 {
        assert_eq!(get(server.address, manifest).await.status, 200);
    }
    let spans = collector.spans_of(server).await;
    let objects = spans.iter().filter(|span| span.name == "GET /o/{name}");
    assert_eq!(objects.count(), 3, "{spans:?}");
}

#[tokio::test]
async fn no_signature_of_a_link_reaches_the_collector() {
    let collector = Collector::default();
    let server = collector.server(100.0).await;
    let (cellar, key) = ("cellar".parse().unwrap(), LinkKey::random().unwrap());
    server.catalogue.make_private(&cellar, key.secret()).await.unwrap();
    publish_as(&server.catalogue, &server.blobs, "cellar", "A cellar").await;
    let link = key.sign(&cellar, 4_000_000_000);
    let inside = format!("{}/v1/scenes/cellar", link.trim_end_matches('/'));
    for _ in 0..500 {
        if get(server.address, &inside).await.status == 200 {
            break;
        }
        tokio::time::sleep(std::time::Duration::from_millis(20)).await;
    }
    let spans = collector.spans_of(server).await;
    let last = spans.last().unwrap();
    assert_eq!(last.name, "GET /v1/scenes/{scene}");
    assert_eq!(text(&last.attributes, "belvedere.scene"), Some("cellar"));
    let secret = link.split('/').max_by_key(|part| part.len()).unwrap();
    assert!(secret.len() > 20, "{link}");
    let bodies = collector.0.lock().unwrap();
    let leaks = |body: &Bytes| body.windows(secret.len()).any(|bytes| bytes == secret.as_bytes());
    assert!(!bodies.iter().any(leaks));
}

#[tokio::test]
async fn a_collector_that_is_away_is_missed_by_nobody() {
    // Nobody listens there once it is dropped.
    let free = std::net::TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let mut server = Server::start_with(Settings {
        otlp: Some(format!("http://{free}")),
        ..Settings::default()
    })
    .await;
    let mut refused = 0;
    for _ in 0..500 {
        let answer = get(server.address, "/metrics").await;
        assert_eq!(answer.status, 200);
        let metrics = String::from_utf8(answer.body).unwrap();
        let count = metrics
            .lines()
            .find_map(|line| line.strip_prefix(r#"belvedere_trace_spans_total{state="refused"} "#));
        refused = count.unwrap().parse().unwrap();
        if refused > 0 {
            break;
        }
        tokio::time::sleep(std::time::Duration::from_millis(20)).await;
    }
    assert!(refused > 0, "lost spans are not counted");
    end(&mut server).await;
}
