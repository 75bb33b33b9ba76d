//! Who answers? Immutable objects that are in memory are answered at once; everything else takes the router.
//!
//! Most requests are for such objects, and beside two system calls each the router's own work would show. The short
//! way has no `await`, hence no time limit, and takes only what needs no explanation: errors, first reads and requests
//! that are traced go the long way, where the same code answers them.

use std::{convert::Infallible, sync::Arc, time::Instant};

use axum::{
    BoxError, Router,
    body::{Body, HttpBody},
    http::{Method, Request, StatusCode, header},
    response::Response,
};
use belvedere_scene::bundle;
use bytes::Bytes;
use http_body_util::Either;
use tokio::{runtime::Handle, task::JoinError};
use tokio_util::task::AbortOnDropHandle;
use tower::ServiceExt;

use super::{
    AppState, around,
    blob_body::BlobBody,
    bundle::{Bundle, bundle_in_memory},
    direct::{Ready, Simple},
    fields::Fields,
    immutable::{self, BlobResponse, Chosen},
    links,
    peer::Peer,
    routes,
};

/// The service of one server. Cheap to clone.
#[derive(Debug, Clone)]
pub struct Front(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    state: AppState,
    router: Router,
}

impl Front {
    /// Serves what this state knows.
    #[must_use]
    pub fn new(state: AppState) -> Self {
        let router = routes::router(state.clone());
        Self(Arc::new(Inner { state, router }))
    }

    /// The state that requests are answered from.
    pub(super) fn state(&self) -> &AppState {
        &self.0.state
    }

    pub(super) async fn answer<B>(
        self,
        mut request: Request<B>,
        peer: &Peer,
    ) -> Result<Response<Either<BlobBody, Body>>, Infallible>
    where
        B: HttpBody<Data = Bytes, Error: Into<BoxError>> + Send + 'static,
    {
        // Without the path, which may be that of a link.
        let span = self.0.state.traces.request(request.method(), request.headers());
        if let Some(span) = span {
            request.extensions_mut().insert(span);
        } else if let Some(response) = self.at_once(&request, peer) {
            return Ok(response.map(Either::Left));
        }
        links::take(&self.0.state.publications, &mut request);
        request.extensions_mut().insert(peer.clone());
        let mut response = self.0.router.clone().oneshot(request.map(Body::new)).await?;
        if matches!(response.status(), StatusCode::NOT_MODIFIED | StatusCode::NO_CONTENT) {
            // The router counts the body that is not there; a 304 may only tell the length of the 200 (RFC 9110 §8.6).
            response.headers_mut().remove(header::CONTENT_LENGTH);
        }
        Ok(response.map(Either::Right))
    }

    /// The same from an event loop: what is not in memory is answered on the runtime that all else shares.
    pub(super) async fn answer_beside<B>(
        self,
        request: Request<B>,
        peer: Peer,
        shared: &Handle,
    ) -> Result<Response<Either<BlobBody, Body>>, JoinError>
    where
        B: HttpBody<Data = Bytes, Error: Into<BoxError>> + Send + 'static,
    {
        if !self.0.state.traces.are_sent()
            && let Some(response) = self.at_once(&request, &peer)
        {
            return Ok(response.map(Either::Left));
        }
        let answering = async move {
            let Ok(response) = self.answer(request, &peer).await;
            response
        };
        AbortOnDropHandle::new(shared.spawn(answering)).await
    }

    fn at_once<B>(&self, request: &Request<B>, peer: &Peer) -> Option<Response<BlobBody>> {
        let (method, fields) = (request.method(), request.headers());
        if told_of(fields) || around::refused(request).is_some() {
            return None;
        }
        let started = Instant::now();
        let asked = (method, request.uri().path());
        let metrics = &self.0.state.metrics;
        if asked.1.starts_with(bundle::PATH) {
            let response = self.bundle(asked, fields, peer)?.response(&self.0.state.blobs);
            metrics.bundle(response.status(), response.body().len(), started.elapsed());
            return Some(response);
        }
        let answer = |object: &BlobResponse, chosen: &Chosen| object.respond(method, chosen);
        let response = immutable::object_now(&self.0.state, asked, fields, answer)?;
        metrics.immutable(response.status(), response.body().len(), started.elapsed());
        Some(response)
    }

    /// The same for a request whose head is simple, and hence neither long nor followed by a body, where none is traced.
    pub(super) fn ready<A>(&self, simple: &Simple, peer: &Peer, answer: impl FnOnce(Ready) -> A) -> Option<A> {
        if self.0.state.traces.are_sent() || told_of(&simple.fields) {
            return None;
        }
        let started = Instant::now();
        let asked = (&simple.method, simple.target);
        if simple.target.starts_with(bundle::PATH) {
            let ready = Ready::bundle(&self.0.state.blobs, self.bundle(asked, &simple.fields, peer)?, started);
            let metrics = &self.0.state.metrics;
            metrics.bundle(ready.status, ready.body_bytes(), started.elapsed());
            return Some(answer(ready));
        }
        immutable::object_now(&self.0.state, asked, &simple.fields, |object, chosen| {
            let ready = Ready::new(&simple.method, object, chosen, started);
            let metrics = &self.0.state.metrics;
            metrics.immutable(ready.status, ready.body_bytes(), started.elapsed());
            answer(ready)
        })
    }

    fn bundle(&self, asked: (&Method, &str), fields: &impl Fields, peer: &Peer) -> Option<Bundle> {
        let bundle = bundle_in_memory(&self.0.state, asked, fields)?;
        // Who asks too often is told so by the router.
        self.0.state.pace.request(peer).ok()?;
        Some(bundle)
    }
}

/// Whether somebody wants to hear of this request.
fn told_of(fields: &impl Fields) -> bool {
    fields.has(&around::X_REQUEST_ID) || tracing::enabled!(tracing::Level::DEBUG)
}
