//! What can a client ask about the current revision without reading its index? Cells, objects and what is visible.
//!
//! Answers are small, may be kept for seconds, and carry a tag made of the revision: an address and a revision give
//! one answer. Pages link to the next one with the revision in the link, so that a client never mixes two revisions.

use axum::{
    extract::State,
    http::{HeaderMap, Method},
    response::Response,
};
use belvedere_bake::glb;
use belvedere_scene::{BlobName, CellId, ObjectId, SceneName};
use bytes::Bytes;
use serde::Serialize;

use super::{
    conditional::{self, Verdict},
    error::ApiError,
    extract::{Form, Path, Query},
    immutable::{self, BlobResponse, Life, current_answer, json_answer},
    visible::OnLine,
    visitor::Visitor,
};
use crate::{
    published::{Published, ReadError},
    store::BlobStore,
};

#[derive(Serialize)]
struct CellAt {
    cell: CellId,
    contains: bool,
    distance_m: f64,
}

#[derive(Serialize)]
struct PageOf<T> {
    objects: Vec<T>,
    next: Option<String>,
}

/// `GET /v1/scenes/{scene}/cells?at=x,y,z`: the cell at a point, or the nearest one.
pub(super) async fn cell_at(
    visitor: Visitor,
    Path(scene): Path<SceneName>,
    query: Query,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let point = query.point("at")?;
    let published = visitor.scene(&scene).await?;
    let located = published.reader.cell_at(point).await?;
    let located = located.ok_or_else(|| ApiError::NotFound(format!("view cell in scene `{scene}`")))?;
    let answer = CellAt {
        cell: located.cell.cell,
        contains: located.distance_m == 0.0,
        distance_m: located.distance_m,
    };
    json(&headers, &published, &answer)
}

/// `GET /v1/scenes/{scene}/cells/{cell}`: the JSON form of its record.
pub(super) async fn cell(
    State(blobs): State<BlobStore>,
    visitor: Visitor,
    Path((scene, cell)): Path<(SceneName, CellId)>,
    method: Method,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let published = visitor.scene(&scene).await?;
    let entry = published.reader.cell_entry(cell).await?;
    let entry = entry.ok_or_else(|| no_cell(&scene, cell))?;
    blob(&blobs, &entry.record_json, &method, &headers).await
}

/// `GET /v1/scenes/{scene}/cells/{cell}/visible?closed=o7,o9`: what can be seen from it, most important first, without
/// what one of the closed doors hides.
pub(super) async fn visible(
    visitor: Visitor,
    Path((scene, cell)): Path<(SceneName, CellId)>,
    query: Query,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let (closed, after, limit) = (query.closed()?, query.after()?, query.limit()?);
    let published = visitor.scene(&scene).await?;
    same_revision(&query, &published)?;
    for door in &closed {
        let info = published.reader.object_info(*door).await?;
        if !info.is_some_and(|info| info.door) {
            let detail =
                format!("{door} in `closed` is no door of scene `{scene}`: a door's object info says `door: true`");
            return Err(ApiError::bad_query("closed", detail));
        }
    }
    let page = published.reader.visible(cell, &closed, after, limit).await?;
    let page = page.ok_or_else(|| match after {
        Some(after) => ApiError::NotFound(format!("object {after} that can be seen from cell {cell} of `{scene}`")),
        None => no_cell(&scene, cell),
    })?;
    let base = match closed.as_slice() {
        [] => format!("/v1/scenes/{scene}/cells/{cell}/visible?"),
        // As it was given: its grammar leaves nothing to escape.
        _ => format!(
            "/v1/scenes/{scene}/cells/{cell}/visible?closed={}&",
            query.given("closed")
        ),
    };
    let next = page.more_after.map(|after| next_page(&base, &published, after, limit));
    json(
        &headers,
        &published,
        &PageOf {
            objects: page.objects,
            next,
        },
    )
}

/// `GET /v1/scenes/{scene}/objects?bbox=…`: objects whose boxes meet a box, by id.
pub(super) async fn objects(
    visitor: Visitor,
    Path(scene): Path<SceneName>,
    query: Query,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let (bounds, after, limit) = (query.bounds("bbox")?, query.after()?, query.limit()?);
    let published = visitor.scene(&scene).await?;
    same_revision(&query, &published)?;
    let page = published.reader.objects_in(&bounds, after, limit).await?;
    // As it was given: its grammar leaves nothing to escape.
    let base = format!("/v1/scenes/{scene}/objects?bbox={}&", query.given("bbox"));
    let next = page.more_after.map(|after| next_page(&base, &published, after, limit));
    json(
        &headers,
        &published,
        &PageOf {
            objects: page.objects,
            next,
        },
    )
}

/// `GET /v1/scenes/{scene}/objects/{object}`: its info.
pub(super) async fn object(
    visitor: Visitor,
    Path((scene, object)): Path<(SceneName, ObjectId)>,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let published = visitor.scene(&scene).await?;
    let info = published.reader.object_info(object).await?;
    json(&headers, &published, &info.ok_or_else(|| no_object(&scene, object))?)
}

/// `GET /v1/scenes/{scene}/objects/{object}/lods/{level}?form=plain`: that level's bytes, as they were published or for
/// a reader that knows no extensions.
pub(super) async fn level(
    State(blobs): State<BlobStore>,
    visitor: Visitor,
    State(on_line): State<OnLine>,
    Path((scene, object, level)): Path<(SceneName, ObjectId, String)>,
    query: Query,
    method: Method,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let digits = level.len() <= 9 && level.bytes().all(|b| b.is_ascii_digit());
    let number: Option<u32> = level.parse().ok().filter(|_| digits);
    let number = number.ok_or_else(|| ApiError::bad_request("a level of detail is a whole number; 0 is the finest"))?;
    let form = query.form()?;
    let published = visitor.scene(&scene).await?;
    let info = published.reader.object_info(object).await?;
    let info = info.ok_or_else(|| no_object(&scene, object))?;
    let found = info.levels.iter().find(|level| level.level == number);
    let found = found.ok_or_else(|| ApiError::NotFound(format!("level {number} of object {object} in `{scene}`")))?;
    match form {
        Form::Published => blob(&blobs, &found.url, &method, &headers).await,
        Form::Plain => plain(&blobs, on_line, &found.url, &headers).await,
    }
}

/// A level without extensions for geometry, made for this request.
async fn plain(blobs: &BlobStore, on_line: OnLine, name: &BlobName, headers: &HeaderMap) -> Result<Response, ApiError> {
    // From the route of a level to `/o/`, wherever the tree is mounted.
    const PICTURES: &str = "../../../../../../o/";
    const PLAIN: &str = "model/gltf-binary";
    let etag = Bytes::from(format!("\"{}-plain-{}\"", name.hash(), env!("CARGO_PKG_VERSION")));
    if conditional::evaluate(headers, &etag) != Verdict::Proceed {
        // Who has it needs none.
        return current_answer(headers, etag, PLAIN, Bytes::new());
    }
    let published = blobs.get(name).await?;
    let published = published.ok_or_else(|| ReadError::Missing(name.clone()))?;
    let plain = on_line.run(move || glb::plain(&published, PICTURES)).await?;
    let plain = plain.map_err(|e| ApiError::Internal(anyhow::Error::new(e).context(format!("blob {name}"))))?;
    current_answer(headers, etag, PLAIN, Bytes::from(plain))
}

async fn blob(blobs: &BlobStore, name: &BlobName, method: &Method, headers: &HeaderMap) -> Result<Response, ApiError> {
    let forms = blobs.forms(name, immutable::wished(headers)).await?;
    let forms = forms.ok_or_else(|| ReadError::Missing(name.clone()))?;
    let object = BlobResponse {
        blobs,
        name,
        forms: &forms,
        from: 0,
        life: Life::Current,
    };
    object.answer(&forms, method, headers).await
}

fn json<T: Serialize>(headers: &HeaderMap, published: &Published, answer: &T) -> Result<Response, ApiError> {
    let bytes = serde_json::to_vec(answer).map_err(|e| ApiError::Internal(e.into()))?;
    let etag = format!("\"{}-{}\"", published.pointer.revision, env!("CARGO_PKG_VERSION"));
    json_answer(headers, Bytes::from(etag), Bytes::from(bytes))
}

fn same_revision(query: &Query, published: &Published) -> Result<(), ApiError> {
    let current = published.pointer.revision;
    match query.revision()? {
        Some(revision) if revision != current => Err(ApiError::RevisionMoved { current }),
        _ => Ok(()),
    }
}

fn next_page(base: &str, published: &Published, after: ObjectId, limit: usize) -> String {
    let revision = published.pointer.revision;
    format!("{base}limit={limit}&after={after}&revision={revision}")
}

fn no_cell(scene: &SceneName, cell: CellId) -> ApiError {
    ApiError::NotFound(format!("view cell {cell} in scene `{scene}`"))
}

fn no_object(scene: &SceneName, object: ObjectId) -> ApiError {
    ApiError::NotFound(format!("object {object} in scene `{scene}`"))
}
