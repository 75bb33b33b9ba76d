//! Doors, which whoever is in a scene may open and close.

use axum::{
    extract::{Request, State},
    http::StatusCode,
    response::Response,
};
use belvedere_scene::{ObjectId, SceneName};
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
    let info = published.reader.object_info(object).await?.filter(|info| info.door);
    let info = info.ok_or_else(|| ApiError::NotFound(format!("door {object} in scene `{scene}`")))?;
    let door = Door {
        object,
        bounds: info.bounds,
        open,
    };
    live.set_door(&scene, published.pointer.revision, door, token).await?;
    Ok(now(StatusCode::OK, &Answer { object, open }))
}
