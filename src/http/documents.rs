//! How are the two mutable documents answered? From the newest snapshot, with bytes that are ready.

use axum::{
    http::{HeaderMap, HeaderValue, header},
    response::Response,
};
use belvedere_scene::{SceneName, bundle};

use super::{error::ApiError, extract::Path, immutable::json_answer, visitor::Visitor};

/// `GET /v1/scenes` and `/v1/scenes/index.json`: the scenes that this visitor may see.
pub(super) async fn scenes(visitor: Visitor, headers: HeaderMap) -> Result<Response, ApiError> {
    let list = visitor.list().await?;
    json_answer(&headers, list.etag, list.bytes)
}

/// `GET /v1/scenes/{scene}` and `/v1/scenes/{scene}/index.json`: the pointer.
pub(super) async fn scene(
    visitor: Visitor,
    Path(scene): Path<SceneName>,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let document = visitor.scene(&scene).await?.document.clone();
    let mut answer = json_answer(&headers, document.etag, document.bytes)?;
    answer.headers_mut().insert(header::LINK, offers(&scene));
    Ok(answer)
}

/// Where sessions in a scene are opened, and below which address many objects are answered at once. A static tree says
/// nothing of the kind, so clients need not try.
fn offers(scene: &SceneName) -> HeaderValue {
    let offers = format!("</v1/scenes/{scene}/sessions>; rel=\"sessions\", {}", bundle::OFFER);
    HeaderValue::try_from(offers).expect("a scene's name is letters, digits and dashes")
}
