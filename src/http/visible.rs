//! What may be seen from any place? `POST /v1/scenes/{scene}/visible`, answered on line from what hides in the revision.
//!
//! Answers take milliseconds of CPU, so they are computed beside the runtime, as many at once as there are cores; who has
//! to wait longer than a request may take hears 503.

use std::sync::Arc;

use axum::{
    extract::{Request, State},
    http::StatusCode,
    response::Response,
};
use belvedere_scene::{Bounds, ObjectId, Revision, SceneName, record::Guarantee};
use serde::{Deserialize, Serialize};
use tokio::sync::Semaphore;

use super::{
    body::{Object, json_body},
    error::ApiError,
    extract::{MOST_DOORS, Path},
    momentary::now,
    visitor::Visitor,
};
use crate::published::{NoDoor, NotHidden, Question};

const DEFAULT_LIMIT: f64 = 1000.0;
const MOST: f64 = 10_000.0;
/// Places further than this from the origin are refused: single precision holds no scene out there.
const FURTHEST_M: f64 = 1e9;

/// How many answers are computed at once.
#[derive(Debug, Clone)]
pub struct OnLine(Arc<Semaphore>);

impl Default for OnLine {
    fn default() -> Self {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        Self(Arc::new(Semaphore::new(cores)))
    }
}

impl OnLine {
    /// Computes beside the runtime, once it is this request's turn.
    pub(super) async fn run<T: Send + 'static>(self, work: impl FnOnce() -> T + Send + 'static) -> Result<T, ApiError> {
        let permit = self.0.acquire_owned().await;
        let permit = permit.map_err(|e| ApiError::Internal(e.into()))?;
        let done = tokio::task::spawn_blocking(move || {
            let done = work();
            drop(permit);
            done
        });
        done.await.map_err(|e| ApiError::Internal(e.into()))
    }
}

/// A body as it was sent.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Asked {
    #[serde(alias = "point")]
    position: Option<[f64; 3]>,
    #[serde(alias = "radius")]
    radius_m: Option<f64>,
    #[serde(alias = "bounds")]
    r#box: Option<Object<Corners>>,
    closed: Option<Vec<ObjectId>>,
    /// To JSON Schema 10.0 is an integer.
    limit: Option<f64>,
    after: Option<ObjectId>,
    revision: Option<Revision>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct Corners {
    min: [f64; 3],
    max: [f64; 3],
}

#[derive(Serialize)]
struct Answer<'a> {
    r#box: Bounds,
    revision: Revision,
    method: &'static str,
    guarantee: Guarantee,
    total: usize,
    objects: &'a [NotHidden],
    next_after: Option<ObjectId>,
}

impl Asked {
    const SHAPE: &str = r#"{"position": [x, y, z], "radius_m": r} or {"box": {"min": [x, y, z], "max": [x, y, z]}}"#;

    /// The box that holds every eye.
    fn eye(&self) -> Result<Bounds, ApiError> {
        if self.position.is_some() == self.r#box.is_some() {
            let detail = format!("the body must name one place, {}", Self::SHAPE);
            return Err(ApiError::bad_body("", detail));
        }
        let near = |x: &f64| x.abs() <= FURTHEST_M;
        let far = |pointer| {
            ApiError::bad_body(
                pointer,
                format!("numbers must lie between -{FURTHEST_M:e} and {FURTHEST_M:e} metres"),
            )
        };
        if let Some(Object(Corners { min, max })) = self.r#box {
            if self.radius_m.is_some() {
                return Err(ApiError::bad_body("/radius_m", "a box has no radius"));
            }
            if !min.iter().chain(&max).all(near) {
                return Err(far("/box"));
            }
            return Ok(Bounds::around([min, max]));
        }
        let (position, radius_m) = (self.position.unwrap_or_default(), self.radius_m.unwrap_or(0.0));
        if !position.iter().all(near) {
            return Err(far("/position"));
        }
        if !(0.0..=FURTHEST_M).contains(&radius_m) {
            let detail = format!("the radius must lie between 0 and {FURTHEST_M:e} metres");
            return Err(ApiError::bad_body("/radius_m", detail));
        }
        Ok(Bounds {
            min: position.map(|x| x - radius_m),
            max: position.map(|x| x + radius_m),
        })
    }

    fn limit(&self) -> Result<usize, ApiError> {
        let limit = self.limit.unwrap_or(DEFAULT_LIMIT);
        if limit.fract() == 0.0 && (1.0..=MOST).contains(&limit) {
            Ok(limit as usize)
        } else {
            let detail = format!("the limit must be a whole number from 1 to {MOST}; got {limit}");
            Err(ApiError::bad_body("/limit", detail))
        }
    }
}

/// `POST /v1/scenes/{scene}/visible`: objects that cannot be proved hidden from a ball or a box.
pub(super) async fn from_anywhere(
    visitor: Visitor,
    State(on_line): State<OnLine>,
    Path(scene): Path<SceneName>,
    request: Request,
) -> Result<Response, ApiError> {
    let asked: Asked = json_body(request, Asked::SHAPE).await?;
    let (eye, limit) = (asked.eye()?, asked.limit()?);
    let closed = asked.closed.unwrap_or_default();
    if closed.len() > MOST_DOORS {
        return Err(ApiError::bad_body(
            "/closed",
            format!("at most {MOST_DOORS} doors can be closed"),
        ));
    }
    let published = visitor.scene(&scene).await?;
    let current = published.pointer.revision;
    if asked.revision.is_some_and(|revision| revision != current) {
        return Err(ApiError::RevisionMoved { current });
    }
    let blockers = published.reader.blockers().await?;
    let blockers =
        blockers.ok_or_else(|| ApiError::NotFound(format!("occluders in scene `{scene}`: bake it again")))?;
    let question = Question { eye, closed };
    let found = on_line.run(move || blockers.not_hidden(&question)).await?;
    let found = found.map_err(|NoDoor(object)| {
        let detail = format!("{object} is no door of scene `{scene}`: a door's object info says `door: true`");
        ApiError::bad_body("/closed", detail)
    })?;
    let start = match asked.after {
        None => 0,
        Some(after) => match found.iter().position(|object| object.object == after) {
            Some(at) => at + 1,
            None => {
                return Err(ApiError::NotFound(format!(
                    "object {after} that may be seen from there"
                )));
            }
        },
    };
    let end = found.len().min(start + limit);
    let answer = Answer {
        r#box: eye,
        revision: current,
        method: "conservative",
        guarantee: Guarantee::Conservative,
        total: found.len(),
        objects: &found[start..end],
        next_after: (end < found.len()).then(|| found[end - 1].object),
    };
    Ok(now(StatusCode::OK, &answer))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::http::body::json;

    fn eye(body: &str) -> Result<Bounds, ApiError> {
        json::<Asked>(body.as_bytes(), Asked::SHAPE)?.eye()
    }

    #[test]
    fn a_ball_is_asked_about_as_the_box_around_it() {
        let bounds = eye(r#"{"position": [1, 2, 3], "radius_m": 0.5}"#).unwrap();
        assert_eq!((bounds.min, bounds.max), ([0.5, 1.5, 2.5], [1.5, 2.5, 3.5]));
        let with_nulls =
            r#"{"position": [1, 2, 3], "radius_m": null, "closed": null, "box": null, "limit": null, "after": null}"#;
        assert_eq!(eye(with_nulls).unwrap().min, [1.0, 2.0, 3.0]);
        let bounds = eye(r#"{"box": {"min": [4, 0, 6], "max": [1, 5, 3]}}"#).unwrap();
        assert_eq!((bounds.min, bounds.max), ([1.0, 0.0, 3.0], [4.0, 5.0, 6.0]));
    }

    #[test]
    fn what_is_no_place_is_refused() {
        for body in [
            "",
            "[]",
            "{}",
            r#"{"position": [1, 2]}"#,
            r#"{"position": [1, 2, 1e300]}"#,
            r#"{"position": [1, 2, 3], "radius_m": -1}"#,
            r#"{"position": [1, 2, 3], "radius_m": 1e10}"#,
            r#"{"position": [1, 2, 3], "box": {"min": [0, 0, 0], "max": [1, 1, 1]}}"#,
            r#"{"box": {"min": [0, 0, 0], "max": [1, 1, 1]}, "radius_m": 1}"#,
            r#"{"box": {"min": [0, 0, 0]}}"#,
            r#"{"position": [1, 2, 3], "radus": 1}"#,
        ] {
            assert!(eye(body).is_err(), "{body}");
        }
    }
}
