//! Sessions: open, pose, area of interest, events, close.

use std::convert::Infallible;

use axum::{
    Extension, RequestPartsExt,
    body::Body,
    extract::{FromRequestParts, Request, State},
    http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header, request::Parts},
    response::{IntoResponse, Response},
};
use belvedere_live::{
    Ms,
    aoi::Aoi,
    event::{Hush, SessionId},
    world::{self, Seen},
};
use belvedere_scene::{CellId, ObjectId, SceneName};
use futures_util::StreamExt;
use serde::{Deserialize, Serialize};

use super::{
    Pose, Time,
    avatar::{Avatar, look},
};
use crate::{
    http::{
        AppState,
        body::{Object, json_body},
        cookie::ShownOfSession,
        error::ApiError,
        extract::Path,
        momentary::{done, now},
        peer::Peer,
        visitor::Visitor,
    },
    live::{Live, SessionHandle},
};

const LAST_EVENT_ID: HeaderName = HeaderName::from_static("last-event-id");
const X_ACCEL_BUFFERING: HeaderName = HeaderName::from_static("x-accel-buffering");

/// What a participant is if it does not say.
const DEFAULT_AOI: Aoi = Aoi {
    enter_m: 50.0,
    leave_m: 60.0,
};
const DEFAULT_SPEED_MPS: f64 = 3.0;
pub(super) const DEFAULT_RADIUS_M: f64 = 0.5;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Asked {
    t_ms: Option<Time>,
    position: [f64; 3],
    orientation: Option<[f64; 4]>,
    velocity: Option<[f64; 3]>,
    aoi: Option<Object<Aoi>>,
    avatar: Option<Avatar>,
    name: Option<String>,
    radius_m: Option<f64>,
    max_speed_mps: Option<f64>,
    max_acceleration_mps2: Option<f64>,
    include: Option<Vec<Included>>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Included {
    Movers,
    Static,
}

#[derive(Serialize)]
struct Opened {
    session: SessionId,
    token: String,
    object: ObjectId,
    cell: CellId,
    events_url: String,
    now_ms: Ms,
    hush: Option<Hush>,
}

#[derive(Serialize)]
struct Posed {
    cell: CellId,
    contains: bool,
    distance_m: f64,
    teleported: bool,
    hush: Option<Hush>,
}

impl From<Seen> for Posed {
    fn from(seen: Seen) -> Self {
        Self {
            cell: seen.place.cell,
            contains: seen.place.distance_m == 0.0,
            distance_m: seen.place.distance_m,
            teleported: seen.moved.teleported,
            hush: seen.moved.hush,
        }
    }
}

/// `POST /v1/scenes/{scene}/sessions`: enters a scene.
pub(in crate::http) async fn open(
    State(live): State<Live>,
    visitor: Visitor,
    Path(scene): Path<SceneName>,
    peer: Option<Extension<Peer>>,
    request: Request,
) -> Result<Response, ApiError> {
    const SHAPE: &str = r#"{"position": [x, y, z], "aoi": {"enter_m": 50, "leave_m": 60}, "max_speed_mps": 3}"#;
    let asked: Asked = json_body(request, SHAPE).await?;
    let published = visitor.scene(&scene).await?;
    let pose = Pose {
        t_ms: asked.t_ms,
        position: asked.position,
        orientation: asked.orientation,
        velocity: asked.velocity,
        acceleration: None,
    };
    let wants = |what| match &asked.include {
        Some(included) => included.contains(&what),
        None => what == Included::Movers,
    };
    let participant = world::Visitor {
        pose: pose.sent(),
        aoi: asked.aoi.map_or(DEFAULT_AOI, |Object(aoi)| aoi),
        max_speed_mps: asked.max_speed_mps.unwrap_or(DEFAULT_SPEED_MPS),
        max_acceleration_mps2: asked.max_acceleration_mps2,
        radius_m: asked.radius_m.unwrap_or(DEFAULT_RADIUS_M),
        hears_movers: wants(Included::Movers),
        listens: false,
        look: look(&visitor, &published, asked.avatar, asked.name).await?,
    };
    let from = peer.map(|Extension(peer)| peer.household());
    let opened = live.open(&scene, participant, wants(Included::Static), from).await?;
    let session = opened.session;
    let answer = Opened {
        session,
        token: opened.token.reveal(),
        object: opened.object,
        cell: opened.seen.place.cell,
        events_url: format!("/v1/sessions/{session}/events"),
        now_ms: opened.now_ms,
        hush: opened.seen.moved.hush,
    };
    Ok(now(StatusCode::CREATED, &answer))
}

/// A session, for whoever has its token and may see its scene still: when a link expires or the scene becomes private, its
/// sessions end with their leases.
pub(in crate::http) struct Own(SessionHandle);

impl FromRequestParts<AppState> for Own {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> Result<Self, ApiError> {
        let Path(session): Path<SessionId> = parts.extract_with_state(state).await?;
        let ShownOfSession(token) = parts.extract().await?;
        let own = state.live.session(session, token).await?;
        let Ok(visitor) = parts.extract_with_state::<Visitor, _>(state).await;
        visitor.scene(own.scene()).await?;
        Ok(Self(own))
    }
}

/// `DELETE /v1/sessions/{session}`: leaves.
pub(in crate::http) async fn close(
    State(live): State<Live>,
    Path(session): Path<SessionId>,
    ShownOfSession(token): ShownOfSession,
) -> Result<Response, ApiError> {
    live.session(session, token).await?.close().await?;
    Ok(done())
}

/// `PUT /v1/sessions/{session}/pose`: where the participant is.
pub(in crate::http) async fn pose(Own(session): Own, request: Request) -> Result<Response, ApiError> {
    let pose: Pose = json_body(request, Pose::SHAPE).await?;
    let seen = session.pose(pose.sent()).await?;
    Ok(now(StatusCode::OK, &Posed::from(seen)))
}

/// `PUT /v1/sessions/{session}/aoi`: how far the participant looks.
pub(in crate::http) async fn aoi(Own(session): Own, request: Request) -> Result<Response, ApiError> {
    let shape = r#"{"enter_m": 50, "leave_m": 60}"#;
    let aoi: Aoi = json_body(request, shape).await?;
    let set = session.set_aoi(aoi).await;
    set.map_err(|error| ApiError::from(error).of_member("/aoi"))?;
    Ok(now(StatusCode::OK, &aoi))
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Report {
    quality: f64,
}

/// `PUT /v1/sessions/{session}/quality`: how much of what can be seen the participant has downloaded, if it likes to say so.
pub(in crate::http) async fn quality(Own(session): Own, request: Request) -> Result<Response, ApiError> {
    let Report { quality } = json_body(request, r#"{"quality": 0.97}"#).await?;
    let noted = session.report(quality);
    noted.map_err(|error| ApiError::bad_body("/quality", error))?;
    Ok(done())
}

/// `GET /v1/sessions/{session}/events`: what the session is told, as server-sent events.
pub(in crate::http) async fn events(
    Own(session): Own,
    visitor: Visitor,
    method: Method,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    // An id that is none of ours was never read here.
    let last_seen = headers.get(LAST_EVENT_ID).map(|value| {
        value
            .to_str()
            .ok()
            .and_then(|text| text.parse().ok())
            .unwrap_or(u64::MAX)
    });
    let (body, shortcut) = if method == Method::HEAD {
        (Body::empty(), None)
    } else {
        let events = session.events(last_seen);
        let shortcut = events.shortcut();
        let told = events.map(Ok::<_, Infallible>);
        let admitted = told.take_until(visitor.refused(session.scene().clone()));
        (Body::from_stream(admitted), Some(shortcut))
    };
    let kept_apart = [
        (header::CONTENT_TYPE, HeaderValue::from_static("text/event-stream")),
        (
            header::CACHE_CONTROL,
            HeaderValue::from_static("no-store, no-transform"),
        ),
        (X_ACCEL_BUFFERING, HeaderValue::from_static("no")),
    ];
    Ok((kept_apart, shortcut.map(Extension), body).into_response())
}
