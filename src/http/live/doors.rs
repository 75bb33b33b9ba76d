//! Doors, which whoever is in a scene may open and close.

use axum::{
    extract::{Request, State},
    http::StatusCode,
    response::Response,
};
use belvedere_scene::{ObjectId, SceneName, object::ObjectInfo};
use serde::{Deserialize, Serialize};

use crate::{
    http::{
        body::json_body,
        error::ApiError,
        extract::{Path, Shown},
        momentary::now,
        visitor::Visitor,
    },
    live::{Door, Live},
    published::Published,
};

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Asked {
    open: bool,
}

#[derive(Serialize)]
struct Answer {
    object: ObjectId,
    open: bool,
}

/// What is published of a door.
async fn info(published: &Published, scene: &SceneName, object: ObjectId) -> Result<ObjectInfo, ApiError> {
    let info = published.reader.object_info(object).await?.filter(|info| info.door);
    info.ok_or_else(|| ApiError::NotFound(format!("door {object} in scene `{scene}`")))
}

/// `GET /v1/scenes/{scene}/doors/{object}`: how a door stands, for whoever may look at the scene.
pub(in crate::http) async fn get(
    State(live): State<Live>,
    visitor: Visitor,
    Path((scene, object)): Path<(SceneName, ObjectId)>,
) -> Result<Response, ApiError> {
    let published = visitor.scene(&scene).await?;
    info(&published, &scene, object).await?;
    let open = live.door_is_open(&scene, object).await?;
    Ok(now(StatusCode::OK, &Answer { object, open }))
}

/// `PUT /v1/scenes/{scene}/doors/{object}`: opens or closes a door.
pub(in crate::http) async fn set(
    State(live): State<Live>,
    visitor: Visitor,
    Path((scene, object)): Path<(SceneName, ObjectId)>,
    Shown(token): Shown,
    request: Request,
) -> Result<Response, ApiError> {
    let Asked { open } = json_body(request, r#"{"open": true}"#).await?;
    let published = visitor.scene(&scene).await?;
    let door = Door {
        object,
        bounds: info(&published, &scene, object).await?.bounds,
        open,
    };
    live.set_door(&scene, published.pointer.revision, door, token).await?;
    Ok(now(StatusCode::OK, &Answer { object, open }))
}
