//! How is a job doing? What is told of it, and its name.

use std::{fmt, str::FromStr};

use belvedere_scene::SceneName;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::db::StoredJob;

/// The name of a job: 128 random bits in hex, so that nobody comes upon it who was not told.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct JobId(u128);

/// The text is no name of a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the name of a job is `j` and 32 lower-case hex digits")]
pub struct NoJob;

impl JobId {
    pub(super) fn random() -> anyhow::Result<Self> {
        Ok(Self(random()?))
    }
}

pub(super) fn random() -> anyhow::Result<u128> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes).map_err(|error| anyhow::anyhow!("the system gives no random numbers: {error}"))?;
    Ok(u128::from_le_bytes(bytes))
}

impl fmt::Display for JobId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "j{:032x}", self.0)
    }
}

impl FromStr for JobId {
    type Err = NoJob;

    fn from_str(text: &str) -> Result<Self, NoJob> {
        let hex = text.strip_prefix('j').filter(|digits| {
            digits.len() == 32 && digits.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
        });
        let number = hex.and_then(|digits| u128::from_str_radix(digits, 16).ok());
        number.map(Self).ok_or(NoJob)
    }
}

impl Serialize for JobId {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for JobId {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = std::borrow::Cow::<'de, str>::deserialize(deserializer)?;
        text.parse().map_err(serde::de::Error::custom)
    }
}

/// Where a job stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// It waits.
    Queued,
    /// It is being baked.
    Running,
    /// It is published.
    Done,
    /// It ended with an error.
    Failed,
    /// Somebody ended it.
    Cancelled,
}

impl State {
    /// Whether nothing more will happen.
    #[must_use]
    pub fn has_ended(self) -> bool {
        matches!(self, Self::Done | Self::Failed | Self::Cancelled)
    }

    /// Its name, in documents, events and the catalogue.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Queued => "queued",
            Self::Running => "running",
            Self::Done => "done",
            Self::Failed => "failed",
            Self::Cancelled => "cancelled",
        }
    }
}

/// How far a bake is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Progress {
    /// The stage that it is in.
    pub stage: String,
    /// Steps of this stage that are done.
    pub done: u64,
    /// How many steps this stage has.
    pub of: u64,
}

/// Why a job failed, in the words of a problem (RFC 9457).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failure {
    /// `/problems/…`
    pub r#type: String,
    /// What kind of failure it is.
    pub title: String,
    /// What happened and what would help.
    pub detail: String,
}

impl Failure {
    pub(super) fn new(kind: &str, title: &str, detail: impl Into<String>) -> Self {
        Self {
            r#type: format!("/problems/{kind}"),
            title: title.to_owned(),
            detail: detail.into(),
        }
    }
}

/// A job as it is told.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Job {
    /// Its name.
    pub job: JobId,
    /// What it publishes.
    pub scene: SceneName,
    /// The scene's name for people, if one was given.
    pub title: Option<String>,
    /// Where it stands.
    pub state: State,
    /// How far its bake is, while it is running and has said so.
    pub progress: Option<Progress>,
    /// What was uploaded.
    pub source_bytes: u64,
    /// When it was uploaded.
    pub created_at: String,
    /// When its bake was first started.
    pub started_at: Option<String>,
    /// When it ended.
    pub ended_at: Option<String>,
    /// The revision that it published.
    pub revision: Option<Value>,
    /// The bake's report, as of `belvedere bake --json`.
    pub report: Option<Value>,
    /// Why it failed.
    pub error: Option<Failure>,
    /// How often a server has ended while it was baked.
    #[serde(skip)]
    pub(super) interrupted: u32,
}

impl Job {
    pub(super) fn read(stored: &StoredJob) -> anyhow::Result<Self> {
        let report: Option<Value> = stored.report.as_deref().map(serde_json::from_str).transpose()?;
        let state = serde_json::from_value(Value::String(stored.state.clone()))?;
        // Another version may say it differently.
        let progress = stored
            .progress
            .as_deref()
            .and_then(|said| serde_json::from_str(said).ok());
        Ok(Self {
            job: stored.job.parse()?,
            scene: stored.scene.clone(),
            title: stored.title.clone(),
            state,
            progress: progress.filter(|_| state == State::Running),
            source_bytes: stored.source_bytes,
            created_at: stored.created_at.clone(),
            started_at: stored.started_at.clone(),
            ended_at: stored.ended_at.clone(),
            revision: report.as_ref().and_then(|report| report.get("revision")).cloned(),
            report,
            error: stored.error.as_deref().map(serde_json::from_str).transpose()?,
            interrupted: stored.interrupted,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_differ_and_have_one_spelling() {
        let (a, b) = (JobId::random().unwrap(), JobId::random().unwrap());
        assert_ne!(a, b);
        assert_eq!(a.to_string().parse(), Ok(a));
        for text in [
            "",
            "j",
            "j0",
            "../../../../etc/passwd",
            "j+0000000000000000000000000000000",
            "J00000000000000000000000000000000",
        ] {
            assert_eq!(text.parse::<JobId>(), Err(NoJob), "{text}");
        }
    }
}
