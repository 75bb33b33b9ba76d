//! Program-driven movers: create, move one or many, delete.

use std::borrow::Cow;

use axum::{
    Extension,
    extract::{Request, State},
    http::StatusCode,
    response::Response,
};
use belvedere_live::{
    event::Hush,
    motion::{Key, Trajectory, TrajectoryError},
    world::NewMover,
};
use belvedere_scene::{ObjectId, SceneName};
use serde::{Deserialize, Serialize};

use super::{
    Pose, Time, UPRIGHT,
    avatar::{Avatar, look},
    sessions::DEFAULT_RADIUS_M,
};
use crate::{
    http::{
        body::{JSON, Object, body, json, json_body},
        error::ApiError,
        extract::{self, Path, Shown},
        momentary::{done, now},
        peer::Peer,
        visitor::Visitor,
    },
    live::{Live, LiveError, Token},
};

const NDJSON: &str = "application/x-ndjson";
const MAX_BATCH_BYTES: usize = 1 << 20;
const MOST_KEYS: usize = 1_000;
/// So many lines of a batch that cannot be read are told one by one.
const MOST_UNREADABLE: usize = 100;
const DEFAULT_SPEED_MPS: f64 = 10.0;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Asked {
    t_ms: Option<Time>,
    position: Option<[f64; 3]>,
    orientation: Option<[f64; 4]>,
    velocity: Option<[f64; 3]>,
    avatar: Option<Avatar>,
    name: Option<String>,
    radius_m: Option<f64>,
    max_speed_mps: Option<f64>,
    max_acceleration_mps2: Option<f64>,
    trajectory: Option<Object<Way>>,
    persistent: Option<bool>,
}

impl Asked {
    /// Refuses what a mover that follows a trajectory cannot have besides.
    fn refuse_pose(&self) -> Result<(), ApiError> {
        let given = [
            ("/position", self.position.is_some()),
            ("/orientation", self.orientation.is_some()),
            ("/velocity", self.velocity.is_some()),
            ("/t_ms", self.t_ms.is_some()),
            ("/max_speed_mps", self.max_speed_mps.is_some()),
            ("/max_acceleration_mps2", self.max_acceleration_mps2.is_some()),
        ];
        match given.iter().find(|(_, given)| *given) {
            Some((pointer, _)) => Err(ApiError::bad_body(
                *pointer,
                "the trajectory says where the mover is, and how fast; leave out position, orientation, velocity, t_ms and promises",
            )),
            None => Ok(()),
        }
    }
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Way {
    keys: Vec<Object<WayKey>>,
    #[serde(default)]
    repeat: bool,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct WayKey {
    t_ms: Time,
    position: [f64; 3],
    orientation: Option<[f64; 4]>,
}

impl WayKey {
    fn key(&self) -> Key {
        Key {
            t_ms: self.t_ms.0,
            position: self.position,
            orientation: self.orientation.unwrap_or(UPRIGHT),
        }
    }
}

#[derive(Serialize)]
struct Created {
    object: ObjectId,
    token: String,
    hush: Option<Hush>,
}

#[derive(Serialize)]
struct Moved {
    teleported: bool,
    hush: Option<Hush>,
}

/// `POST /v1/scenes/{scene}/movers`: adds a mover.
pub(in crate::http) async fn create(
    State(live): State<Live>,
    visitor: Visitor,
    Path(scene): Path<SceneName>,
    Shown(token): Shown,
    peer: Option<Extension<Peer>>,
    request: Request,
) -> Result<Response, ApiError> {
    const SHAPE: &str = r#"{"position": [x, y, z], "max_speed_mps": 3} or {"trajectory": {"keys": [{"t_ms": 0, "position": [x, y, z]}], "repeat": true}}"#;
    let asked: Asked = json_body(request, SHAPE).await?;
    let published = visitor.scene(&scene).await?;
    let keys = asked.trajectory.as_ref().map_or(&[][..], |Object(way)| &way.keys);
    if keys.len() > MOST_KEYS {
        let detail = format!("a trajectory has at most {MOST_KEYS} keys");
        return Err(ApiError::bad_body("/trajectory/keys", detail));
    }
    if asked.trajectory.is_some() {
        asked.refuse_pose()?;
    }
    let position = asked.position.or(keys.first().map(|Object(key)| key.position));
    let position = position.ok_or_else(|| match asked.trajectory {
        Some(_) => LiveError::from(TrajectoryError::Empty).into(),
        None => ApiError::bad_body("", format!("the body must be JSON, {SHAPE}")),
    })?;
    let pose = Pose {
        t_ms: asked.t_ms,
        position,
        orientation: asked.orientation,
        velocity: asked.velocity,
        acceleration: None,
    };
    let begin_ms = live.now_ms();
    let way = asked.trajectory.map(|Object(way)| {
        Trajectory::new(
            begin_ms,
            way.keys.iter().map(|Object(key)| key.key()).collect(),
            way.repeat,
        )
    });
    let new = NewMover {
        pose: pose.sent(),
        max_speed_mps: asked.max_speed_mps.unwrap_or(DEFAULT_SPEED_MPS),
        max_acceleration_mps2: asked.max_acceleration_mps2,
        radius_m: asked.radius_m.unwrap_or(DEFAULT_RADIUS_M),
        look: look(&visitor, &published, asked.avatar, asked.name).await?,
        way: way.transpose().map_err(LiveError::from)?,
    };
    let from = peer.map(|Extension(peer)| peer.household());
    let (moved, token) = live
        .create(&scene, new, asked.persistent.unwrap_or(false), token, from)
        .await?;
    let answer = Created {
        object: moved.object,
        token: token.reveal(),
        hush: moved.hush,
    };
    Ok(now(StatusCode::CREATED, &answer))
}

/// `PUT /v1/movers/{object}/pose`: where a mover is.
pub(in crate::http) async fn pose(
    State(live): State<Live>,
    Path(object): Path<ObjectId>,
    Shown(token): Shown,
    request: Request,
) -> Result<Response, ApiError> {
    let pose: Pose = json_body(request, Pose::SHAPE).await?;
    let moved = live.move_to(object, token, pose.sent()).await?;
    let answer = Moved {
        teleported: moved.teleported,
        hush: moved.hush,
    };
    Ok(now(StatusCode::OK, &answer))
}

/// `DELETE /v1/movers/{object}`: removes a mover.
pub(in crate::http) async fn destroy(
    State(live): State<Live>,
    Path(object): Path<ObjectId>,
    Shown(token): Shown,
) -> Result<Response, ApiError> {
    live.destroy(object, token).await?;
    Ok(done())
}

/// A line of a batch.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    object: ObjectId,
    token: Option<String>,
    t_ms: Option<Time>,
    position: [f64; 3],
    orientation: Option<[f64; 4]>,
    velocity: Option<[f64; 3]>,
    acceleration: Option<[f64; 3]>,
}

#[derive(Serialize)]
struct Batch {
    accepted: usize,
    refused: Vec<RefusedLine>,
    /// Lines that could not be read, besides those told.
    more_unreadable: usize,
    hushed: Vec<Hush>,
}

#[derive(Serialize)]
struct RefusedLine {
    line: usize,
    status: u16,
    detail: String,
    pointer: Option<Cow<'static, str>>,
}

impl RefusedLine {
    fn new(line: usize, error: ApiError) -> Self {
        let problem = error.problem();
        Self {
            line,
            status: problem.status.as_u16(),
            detail: problem.detail,
            pointer: problem.pointer,
        }
    }
}

/// `POST /v1/scenes/{scene}/movers/poses`: where many movers are, a JSON object a line. A bad line is refused by itself.
pub(in crate::http) async fn poses(
    State(live): State<Live>,
    visitor: Visitor,
    Path(scene): Path<SceneName>,
    Shown(token): Shown,
    request: Request,
) -> Result<Response, ApiError> {
    let body = body(request, &[NDJSON, JSON], MAX_BATCH_BYTES).await?;
    visitor.scene(&scene).await?;
    let (mut lines, mut moves, mut refused, mut more_unreadable) = (Vec::new(), Vec::new(), Vec::new(), 0);
    // Some tools begin a file with a mark of its byte order, which says nothing of UTF-8.
    let lines_sent = body.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&body);
    for (number, text) in (1..).zip(lines_sent.split(|byte| *byte == b'\n')) {
        if text.trim_ascii().is_empty() {
            continue;
        }
        match line(text, token) {
            Ok(admitted) => {
                lines.push(number);
                moves.push(admitted);
            }
            Err(error) if refused.len() < MOST_UNREADABLE => refused.push(RefusedLine::new(number, error)),
            Err(_) => more_unreadable += 1,
        }
    }
    if moves.is_empty() && refused.is_empty() {
        return Err(ApiError::bad_body("", format!("the body must hold {LINE}")));
    }
    let moved = live.move_all(&scene, moves).await?;
    let (mut accepted, mut hushed) = (0, Vec::new());
    for (number, moved) in lines.into_iter().zip(moved) {
        match moved {
            Ok(moved) => {
                accepted += 1;
                hushed.extend(moved.hush);
            }
            Err(error) => refused.push(RefusedLine::new(number, error.into())),
        }
    }
    refused.sort_by_key(|refused| refused.line);
    let batch = Batch {
        accepted,
        refused,
        more_unreadable,
        hushed,
    };
    Ok(now(StatusCode::OK, &batch))
}

const LINE: &str = r#"lines like {"object": "o100000000", "token": "…", "position": [x, y, z]}"#;

type Move = (ObjectId, Option<Token>, belvedere_live::world::Sent);

/// Reads a line; its token goes before that of the request.
fn line(text: &[u8], token: Option<Token>) -> Result<Move, ApiError> {
    let line: Line = json(text, LINE)?;
    let own = line
        .token
        .as_deref()
        .map(|text| extract::token(text, Some("/token")))
        .transpose()?;
    let pose = Pose {
        t_ms: line.t_ms,
        position: line.position,
        orientation: line.orientation,
        velocity: line.velocity,
        acceleration: line.acceleration,
    };
    Ok((line.object, own.or(token), pose.sent()))
}
