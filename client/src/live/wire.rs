//! Which requests does a live session make? Those of `docs/LIVE.md`, each with its token.

use std::{fmt, time::Duration};

use belvedere_scene::{ObjectId, SceneName};
use reqwest::{
    Method, Response, StatusCode,
    header::{ACCEPT, AUTHORIZATION, CONTENT_TYPE, HeaderValue, LINK, RETRY_AFTER},
};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use serde_json::{Value, json};

use super::state::{
    event::Hush,
    motion::{Pose, Stand},
};
use crate::{
    Error, HttpSource,
    source::{failed, succeeded},
};

/// Whoever has said too much is silent no longer, whatever it was asked for.
const LONGEST_PAUSE: Duration = Duration::from_secs(30);
/// No answer but a stream is longer.
const MOST_ANSWER_BYTES: usize = 64 << 10;

/// Two radii: what comes nearer than the one is told of, what goes beyond the other no longer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Aoi {
    /// Metres.
    pub enter_m: f64,
    /// Metres, no less.
    pub leave_m: f64,
}

/// An object that does not move, and whose model can be worn.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Avatar {
    /// Another scene of the same server that one may read; none for the one where it is worn.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scene: Option<SceneName>,
    /// Its id there.
    pub object: ObjectId,
}

/// What one is to the others.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Participant {
    /// Shown to others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The object whose model is worn; without one, others draw what they like.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub avatar: Option<Avatar>,
    /// A ball of this radius around the position holds the avatar.
    pub radius_m: f64,
    /// A promise; who goes faster counts as jumping.
    pub max_speed_mps: f64,
    /// How far one looks.
    pub aoi: Aoi,
}

impl Default for Participant {
    /// A walker without a name.
    fn default() -> Self {
        let aoi = Aoi {
            enter_m: 50.0,
            leave_m: 60.0,
        };
        Self {
            name: None,
            avatar: None,
            radius_m: 0.5,
            max_speed_mps: 3.0,
            aoi,
        }
    }
}

/// A session as the server opened it.
#[derive(Debug, Deserialize)]
pub(super) struct Opened {
    pub(super) session: String,
    token: Token,
    pub(super) object: ObjectId,
    pub(super) events_url: String,
    pub(super) hush: Option<Hush>,
}

/// What a session's requests are believed by; it is not shown to who looks at a session.
#[derive(Deserialize)]
struct Token(String);

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(…)")
    }
}

impl Token {
    fn header(&self) -> String {
        format!("Bearer {}", self.0)
    }
}

/// What came of a pose.
pub(super) enum Answered {
    Heard {
        hush: Option<Hush>,
    },
    /// Too many were sent.
    TooMuch {
        pause: Duration,
    },
}

#[derive(Deserialize)]
struct Posed {
    hush: Option<Hush>,
}

/// Where the sessions of a scene are opened.
#[derive(Debug)]
pub(super) struct Wire {
    source: HttpSource,
    /// Path below the base address.
    sessions: String,
}

impl Wire {
    /// Asks the pointer of a scene whether there are sessions.
    pub(super) async fn find(source: HttpSource, scene: &SceneName) -> Result<Option<Self>, Error> {
        let path = format!("/v1/scenes/{scene}/index.json");
        let asked = source.request(Method::HEAD, &path).send().await;
        let answer = succeeded(&path, asked.map_err(|cause| failed(&path, &cause))?)?;
        let links = answer.headers().get_all(LINK).iter();
        let sessions = links
            .filter_map(|link| link.to_str().ok())
            .flat_map(|links| links.split(','))
            .find_map(sessions_of);
        Ok(sessions.map(|sessions| Self { source, sessions }))
    }

    pub(super) async fn open(&self, who: &Participant, stand: Stand, t_ms: i64) -> Result<Opened, Error> {
        let mut body = json!(who);
        body["position"] = json!(stand.position);
        body["orientation"] = json!(stand.orientation);
        body["t_ms"] = t_ms.into();
        let answer = self.send(Method::POST, &self.sessions, &body, None).await?;
        read(&self.sessions, succeeded(&self.sessions, answer)?).await
    }

    pub(super) async fn say(&self, opened: &Opened, pose: &Pose) -> Result<Answered, Error> {
        let path = format!("/v1/sessions/{}/pose", opened.session);
        let answer = self.send(Method::PUT, &path, &json!(pose), Some(opened)).await?;
        if answer.status() == StatusCode::TOO_MANY_REQUESTS {
            let after = answer.headers().get(RETRY_AFTER).and_then(|after| after.to_str().ok());
            let after_s = after.and_then(|after| after.parse().ok()).unwrap_or(1);
            return Ok(Answered::TooMuch {
                pause: Duration::from_secs(after_s).min(LONGEST_PAUSE),
            });
        }
        let Posed { hush } = read(&path, succeeded(&path, answer)?).await?;
        Ok(Answered::Heard { hush })
    }

    pub(super) async fn set_door(&self, opened: &Opened, door: ObjectId, open: bool) -> Result<(), Error> {
        let scene = self.sessions.trim_end_matches("sessions");
        let path = format!("{scene}doors/{door}");
        self.tell(Method::PUT, &path, &json!({ "open": open }), opened).await
    }

    pub(super) async fn report(&self, opened: &Opened, quality: f64) -> Result<(), Error> {
        let path = format!("/v1/sessions/{}/quality", opened.session);
        self.tell(Method::PUT, &path, &json!({ "quality": quality }), opened)
            .await
    }

    pub(super) async fn leave(&self, opened: &Opened) -> Result<(), Error> {
        let path = format!("/v1/sessions/{}", opened.session);
        self.tell(Method::DELETE, &path, &Value::Null, opened).await
    }

    /// The stream of events, from after the one with this id on.
    pub(super) async fn listen(&self, opened: &Opened, last_id: &str) -> Result<Response, Error> {
        let path = &opened.events_url;
        let mut request = self
            .source
            .request(Method::GET, path)
            .header(AUTHORIZATION, opened.token.header())
            .header(ACCEPT, "text/event-stream");
        // An id that no header can hold is none: the server tells everything anew.
        if let Ok(id) = HeaderValue::from_str(last_id)
            && !last_id.is_empty()
        {
            request = request.header("Last-Event-ID", id);
        }
        let answer = request.send().await.map_err(|cause| failed(path, &cause))?;
        let answer = succeeded(path, answer)?;
        let kind = answer.headers().get(CONTENT_TYPE).and_then(|kind| kind.to_str().ok());
        if kind.is_some_and(|kind| kind.starts_with("text/event-stream")) {
            return Ok(answer);
        }
        Err(Error::Document {
            path: path.clone(),
            cause: format!("no event stream but {}", kind.unwrap_or("nothing")),
        })
    }

    async fn tell(&self, method: Method, path: &str, body: &Value, opened: &Opened) -> Result<(), Error> {
        let answer = self.send(method, path, body, Some(opened)).await?;
        succeeded(path, answer).map(drop)
    }

    async fn send(&self, method: Method, path: &str, body: &Value, as_: Option<&Opened>) -> Result<Response, Error> {
        let mut request = self.source.request(method, path);
        if !body.is_null() {
            request = request.header(CONTENT_TYPE, "application/json").body(body.to_string());
        }
        if let Some(opened) = as_ {
            request = request.header(AUTHORIZATION, opened.token.header());
        }
        request.send().await.map_err(|cause| failed(path, &cause))
    }
}

/// The target of a link, if sessions are opened there.
fn sessions_of(link: &str) -> Option<String> {
    let (target, about) = link.trim().strip_prefix('<')?.split_once('>')?;
    let mut about = about.split(';').map(str::trim);
    about
        .any(|about| matches!(about, "rel=sessions" | "rel=\"sessions\""))
        .then(|| target.to_owned())
}

async fn read<T: DeserializeOwned>(path: &str, mut answer: Response) -> Result<T, Error> {
    let wrong = |cause: String| Error::Document {
        path: path.to_owned(),
        cause,
    };
    let mut bytes = Vec::new();
    while let Some(chunk) = answer.chunk().await.map_err(|cause| failed(path, &cause))? {
        if bytes.len() + chunk.len() > MOST_ANSWER_BYTES {
            return Err(wrong(format!("the answer has more than {MOST_ANSWER_BYTES} bytes")));
        }
        bytes.extend_from_slice(&chunk);
    }
    serde_json::from_slice(&bytes).map_err(|cause| wrong(cause.to_string()))
}
