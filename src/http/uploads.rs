//! How does a scene come here? It is sent in one piece, becomes a job, and whoever knows the job's name follows it.

use std::{convert::Infallible, time::Duration};

use axum::{
    Extension,
    body::Body,
    extract::{Request, State},
    http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header},
    response::{IntoResponse, Response},
};
use belvedere_scene::SceneName;
use futures_util::StreamExt;
use http_body_util::BodyExt;
use serde::Serialize;
use tokio::time::{Instant, timeout_at};

use super::{
    AppState,
    body::is_unwrapped,
    error::ApiError,
    extract::{Path, Query},
    momentary::now,
    owner::Owner,
    peer::Peer,
};
use crate::{
    jobs::{Job, JobError, JobId, Jobs, Source, Upload},
    keys::Scope,
    links::LinkKey,
    publish::MOST_TITLE_BYTES,
};

/// An upload may take this long, and a second more for each KiB.
const HEAD_START: Duration = Duration::from_secs(60);
const LEAST_BYTES_PER_S: u64 = 1 << 10;
/// Between two signs of life of a stream.
const BEAT: Duration = Duration::from_secs(15);

#[derive(Serialize)]
struct Told {
    #[serde(flatten)]
    job: Job,
    url: String,
    events_url: String,
}

impl From<Job> for Told {
    fn from(job: Job) -> Self {
        Self {
            url: format!("/v1/jobs/{}", job.job),
            events_url: format!("/v1/jobs/{}/events", job.job),
            job,
        }
    }
}

/// `PUT /v1/scenes/{scene}`: a source scene; it is baked and published when it is its turn.
pub(super) async fn upload(
    State(state): State<AppState>,
    Path(scene): Path<SceneName>,
    owner: Owner,
    peer: Option<Extension<Peer>>,
    query: Query,
    request: Request,
) -> Result<Response, ApiError> {
    let grant = owner.may(Scope::Publish, &scene)?;
    let source = source(&query)?;
    let current = state.publications.current();
    if source.link_key.is_some() && current.scenes.contains_key(&scene) && !current.privacy.is_private(&scene) {
        return Err(JobError::Public(scene).into());
    }
    plain(request.headers())?;
    let announced: Option<u64> = request
        .headers()
        .get(header::CONTENT_LENGTH)
        .and_then(|length| length.to_str().ok()?.parse().ok());
    let upload = state
        .jobs
        .upload(scene.clone(), source, &grant, announced.unwrap_or(0))
        .await?;
    let mut time = peer.map(|Extension(peer)| peer.take_time());
    let upload = receive(upload, announced, request.into_body()).await?;
    if let Some(time) = &mut time {
        time.all_here();
    }
    let job = Told::from(upload.finish().await?);
    let location = HeaderValue::try_from(&job.url).expect("a job's name is hex digits");
    let mut response = now(StatusCode::ACCEPTED, &job);
    response.headers_mut().insert(header::LOCATION, location);
    Ok(response)
}

/// What the query says of the source. What it says besides would do nothing, and the scene might be seen by everybody where
/// that was to be otherwise.
fn source(query: &Query) -> Result<Source, ApiError> {
    query.only(&["title", "format", "private"])?;
    let title = match query.given("title") {
        "" => None,
        title if title.len() <= MOST_TITLE_BYTES && !title.chars().any(char::is_control) => Some(title.to_owned()),
        _ => {
            let detail = format!("a title has at most {MOST_TITLE_BYTES} bytes, none of them a control character");
            return Err(ApiError::bad_query("title", detail));
        }
    };
    let format = match query.given("format") {
        "" => None,
        text => {
            let wrong = |()| ApiError::bad_query("format", "`format` may be glb, gltf, zip, plan, dcg or missing");
            Some(text.parse().map_err(wrong)?)
        }
    };
    let link_key = if private(query)? {
        let key = LinkKey::random().map_err(ApiError::Internal)?;
        Some(key.secret().clone())
    } else {
        None
    };
    Ok(Source {
        title,
        format,
        link_key,
    })
}

/// Whether the scene shall be private from before it is baked on.
fn private(query: &Query) -> Result<bool, ApiError> {
    match query.given("private") {
        "" => Ok(false),
        "true" => Ok(true),
        _ => Err(ApiError::bad_query(
            "private",
            "`private` may be true or missing; a scene that is private stays so until `belvedere private SCENE --end`",
        )),
    }
}

/// What is sent is the file itself: found out by its content, so its media type does not matter unless it says that
/// the file is wrapped in something.
fn plain(headers: &HeaderMap) -> Result<(), ApiError> {
    let kind = headers.get(header::CONTENT_TYPE);
    let in_parts = kind.is_some_and(|kind| {
        let kind = kind.as_bytes().trim_ascii_start().to_ascii_lowercase();
        kind.starts_with(b"multipart/")
    });
    if in_parts || !is_unwrapped(headers) || headers.contains_key(header::CONTENT_RANGE) {
        return Err(ApiError::UnsupportedMediaType);
    }
    Ok(())
}

/// Takes the bytes as they come, all of those that were announced. Who is slower than a modem is given up.
async fn receive(mut upload: Upload, announced: Option<u64>, mut body: Body) -> Result<Upload, ApiError> {
    let (started, mut bytes) = (Instant::now(), 0);
    let broke_off = |bytes: u64| {
        let of = announced.map_or_else(String::new, |announced| format!(" of {announced}"));
        ApiError::bad_body(
            "",
            format!("the upload broke off after {bytes}{of} bytes: send it again, whole"),
        )
    };
    loop {
        let deadline = started + HEAD_START + Duration::from_secs(bytes / LEAST_BYTES_PER_S);
        let Ok(next) = timeout_at(deadline, body.frame()).await else {
            return Err(ApiError::UploadTooSlow);
        };
        match next {
            None if announced.is_some_and(|announced| announced != bytes) => return Err(broke_off(bytes)),
            None => return Ok(upload),
            Some(Err(_)) => return Err(broke_off(bytes)),
            Some(Ok(frame)) => {
                if let Ok(data) = frame.into_data() {
                    bytes += data.len() as u64;
                    upload.write(&data).await?;
                }
            }
        }
    }
}

/// `GET /v1/jobs/{job}`: how it is doing.
pub(super) async fn job(State(jobs): State<Jobs>, Path(id): Path<JobId>) -> Result<Response, ApiError> {
    Ok(now(StatusCode::OK, &Told::from(jobs.get(id).await?)))
}

/// `DELETE /v1/jobs/{job}`: ends it, unless it has ended by itself.
pub(super) async fn cancel(
    State(jobs): State<Jobs>,
    Path(id): Path<JobId>,
    owner: Owner,
) -> Result<Response, ApiError> {
    let job = jobs.get(id).await?;
    owner.may(Scope::Publish, &job.scene)?;
    Ok(now(StatusCode::OK, &Told::from(jobs.cancel(id).await?)))
}

/// `GET /v1/jobs/{job}/events`: how it is doing, now and whenever that changes, as server-sent events. Each holds all
/// that there is to know, so whoever comes back has missed nothing.
pub(super) async fn events(
    State(jobs): State<Jobs>,
    Path(id): Path<JobId>,
    method: Method,
) -> Result<Response, ApiError> {
    let following = jobs.follow(id).await?.map(|job| event(&Told::from(job)));
    let body = if method == Method::HEAD {
        Body::empty()
    } else {
        Body::from_stream(with_beats(following).map(Ok::<_, Infallible>))
    };
    let kept_apart = [
        (header::CONTENT_TYPE, HeaderValue::from_static("text/event-stream")),
        (
            header::CACHE_CONTROL,
            HeaderValue::from_static("no-store, no-transform"),
        ),
        (
            HeaderName::from_static("x-accel-buffering"),
            HeaderValue::from_static("no"),
        ),
    ];
    Ok((kept_apart, body).into_response())
}

fn event(told: &Told) -> String {
    let data = serde_json::to_string(told).expect("a job holds nothing that JSON cannot say");
    format!("event: {}\ndata: {data}\n\n", told.job.state.name())
}

/// The same with a comment whenever there was nothing for a while, so that nobody takes the stream for dead.
fn with_beats(
    events: impl futures_util::Stream<Item = String> + Send + 'static,
) -> impl futures_util::Stream<Item = String> + Send {
    futures_util::stream::unfold(Box::pin(events), async |mut events| {
        let next = tokio::time::timeout(BEAT, events.next()).await;
        let text = next.unwrap_or_else(|_| Some(":\n\n".to_owned()))?;
        Some((text, events))
    })
}
