//! Is the server alive, and can it do its work?

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use axum::{
    extract::State,
    http::header,
    response::{IntoResponse, Response},
};
use tokio::sync::Mutex;

use super::{AppState, error::ApiError};

/// Between two looks, however many ask.
const PAUSE: Duration = Duration::from_secs(1);

/// What was found when somebody looked last whether the server can do its work. Everybody may ask, so all who ask within a moment
/// are told the same: a look takes a connection of the catalogue and a request to the store. Cheap to clone.
#[derive(Debug, Clone)]
pub struct Readiness {
    last: Arc<Mutex<Option<Look>>>,
    pause: Duration,
}

impl Default for Readiness {
    fn default() -> Self {
        Self {
            last: Arc::default(),
            pause: PAUSE,
        }
    }
}

#[derive(Debug)]
struct Look {
    began: Instant,
    found: Found,
}

/// What can be told, or what does not do its part and why.
type Found = Result<&'static str, (&'static str, Arc<anyhow::Error>)>;

impl Readiness {
    async fn ask(&self, look: impl Future<Output = Found> + Send + 'static) -> Result<&'static str, ApiError> {
        let mut last = self.last.clone().lock_owned().await;
        let found = match &*last {
            Some(look) if look.began.elapsed() < self.pause => look.found.clone(),
            _ => {
                // In a task of its own: whoever asks and goes away costs no look more.
                let looking = tokio::spawn(async move {
                    let began = Instant::now();
                    let found = look.await;
                    *last = Some(Look {
                        began,
                        found: found.clone(),
                    });
                    found
                });
                looking.await.map_err(|error| ApiError::Internal(error.into()))?
            }
        };
        found.map_err(|(what, cause)| ApiError::Away {
            what,
            cause: anyhow::anyhow!("{cause:#}"),
        })
    }
}

/// `GET /healthz`: the process answers.
pub(super) async fn alive() -> Response {
    plain("ok\n")
}

/// `GET /readyz`: the catalogue and the store answer, and the catalogue can be written. A node that is cut off from others
/// serves on, and says so.
pub(super) async fn ready(State(state): State<AppState>) -> Result<Response, ApiError> {
    let readiness = state.readiness.clone();
    readiness.ask(look(state)).await.map(plain)
}

async fn look(state: AppState) -> Found {
    let pointers = async { state.catalogue.pointers().await.map(drop) };
    answers("the catalogue does not answer", pointers).await?;
    let writable = state.catalogue.writable().await;
    writable.map_err(|cause| ("the catalogue cannot be written", Arc::new(cause)))?;
    answers("the store does not answer", async { Ok(state.blobs.probe().await?) }).await?;
    Ok(match state.live.counts().nodes {
        None => "ready\n",
        Some(nodes) if nodes.connected => "ready\nnats: answers\n",
        Some(_) => "ready\nnats: away, live sessions go on within this node\n",
    })
}

async fn answers(
    what: &'static str,
    asking: impl Future<Output = anyhow::Result<()>>,
) -> Result<(), (&'static str, Arc<anyhow::Error>)> {
    const PATIENCE: Duration = Duration::from_secs(2);
    let answered = tokio::time::timeout(PATIENCE, asking).await;
    answered
        .unwrap_or_else(|_| Err(anyhow::anyhow!("no answer within {PATIENCE:?}")))
        .map_err(|cause| (what, Arc::new(cause)))
}

fn plain(text: &'static str) -> Response {
    let headers = [
        (header::CONTENT_TYPE, "text/plain; charset=utf-8"),
        (header::CACHE_CONTROL, "no-store"),
    ];
    (headers, text).into_response()
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU32, Ordering};

    use futures_util::future::join_all;

    use super::*;

    const LONG: Duration = Duration::from_secs(3600);

    async fn looks_of(pause: Duration, found: Found) -> (u32, Vec<Result<&'static str, ApiError>>) {
        let readiness = Readiness {
            pause,
            ..Readiness::default()
        };
        let looks = Arc::new(AtomicU32::new(0));
        let asking = (0..100).map(|_| {
            let (looks, found) = (looks.clone(), found.clone());
            readiness.ask(async move {
                looks.fetch_add(1, Ordering::Relaxed);
                tokio::task::yield_now().await;
                found
            })
        });
        let told = join_all(asking).await;
        (looks.load(Ordering::Relaxed), told)
    }

    #[tokio::test]
    async fn however_many_ask_one_looks_and_all_are_told() {
        let (looks, told) = looks_of(LONG, Ok("ready\n")).await;
        assert_eq!(looks, 1);
        assert!(told.iter().all(|told| matches!(told, Ok("ready\n"))));
        let away = Err(("it does not answer", Arc::new(anyhow::anyhow!("its machine is gone"))));
        let (looks, told) = looks_of(LONG, away).await;
        assert_eq!(looks, 1);
        let is_told = |error: &ApiError| {
            matches!(
                error,
                ApiError::Away {
                    what: "it does not answer",
                    ..
                }
            )
        };
        assert!(told.iter().all(|told| told.as_ref().is_err_and(is_told)));
        let (looks, _) = looks_of(Duration::ZERO, Ok("ready\n")).await;
        assert_eq!(looks, 100, "what was found before holds no longer");
    }

    #[tokio::test]
    async fn whoever_goes_away_leaves_what_was_found_to_the_next() {
        let readiness = Readiness {
            pause: LONG,
            ..Readiness::default()
        };
        let (begun, has_begun) = tokio::sync::oneshot::channel();
        let (go_on, may_go_on) = tokio::sync::oneshot::channel::<()>();
        let first = tokio::spawn({
            let readiness = readiness.clone();
            async move {
                let look = async move {
                    begun.send(()).unwrap();
                    may_go_on.await.unwrap();
                    Ok("found by the first")
                };
                readiness.ask(look).await
            }
        });
        has_begun.await.unwrap();
        first.abort();
        assert!(first.await.unwrap_err().is_cancelled());
        go_on.send(()).unwrap();
        let told = readiness.ask(async { Ok("found by the second") }).await;
        assert!(matches!(told, Ok("found by the first")));
    }
}
