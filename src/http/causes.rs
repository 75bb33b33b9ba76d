//! What do errors of other rooms become for a caller? What is the caller's fault is told with its place; what is ours is
//! kept for the log.

use belvedere_live::world::Refusal;

use super::error::ApiError;
use crate::{
    db, jobs::JobError, live::LiveError, publish::rollback::RollbackError, published::ReadError, store::StoreError,
};

impl From<StoreError> for ApiError {
    fn from(error: StoreError) -> Self {
        match error {
            StoreError::Corrupt { .. }
            | StoreError::CorruptVariant { .. }
            | StoreError::Missing(_)
            | StoreError::Misnamed { .. }
            | StoreError::TooLarge { .. }
            | StoreError::Encode { .. } => Self::Internal(error.into()),
            StoreError::Changed { .. } | StoreError::Io { .. } => Self::Unavailable(error.into()),
        }
    }
}

impl From<ReadError> for ApiError {
    fn from(error: ReadError) -> Self {
        match error {
            ReadError::Store(error) => error.into(),
            ReadError::Missing(_) | ReadError::Malformed { .. } => Self::Internal(error.into()),
        }
    }
}

impl From<LiveError> for ApiError {
    fn from(error: LiveError) -> Self {
        match error {
            LiveError::NotFound(what) => Self::NotFound(what),
            LiveError::Elsewhere(_) => Self::Misdirected(error.to_string()),
            LiveError::NoToken => Self::NoToken,
            LiveError::NoOperator => Self::NoOperator,
            LiveError::WrongToken(whose) => Self::WrongToken(whose),
            LiveError::Refused(refusal) => refusal.into(),
            LiveError::Trajectory(ref error) => Self::bad_body(error.pointer(), error),
            LiveError::Flooded { retry_ms } | LiveError::Rattled { retry_ms } => Self::Flooded {
                detail: error.to_string(),
                // Whole seconds are all that the header can say.
                retry_s: retry_ms.unsigned_abs().div_ceil(1000).max(1),
            },
            LiveError::Crowded { .. } => Self::Flooded {
                detail: error.to_string(),
                retry_s: 10,
            },
            LiveError::Full { .. } => Self::Full(error.to_string()),
            LiveError::Behind | LiveError::Unreadable => Self::Unavailable(error.into()),
            LiveError::Moved { current } => Self::RevisionMoved { current },
            LiveError::Stopped => Self::Stopping,
            LiveError::Unkept(cause) => unkept(cause),
            LiveError::Read(error) => error.into(),
        }
    }
}

/// What should have been kept is not. That there is no room may be told to anybody.
fn unkept(cause: anyhow::Error) -> ApiError {
    if db::found_no_room(&cause) {
        let what = "the disk that holds the catalogue is full, so nothing new can be kept";
        return ApiError::Away { what, cause };
    }
    ApiError::Unavailable(cause)
}

impl From<JobError> for ApiError {
    fn from(error: JobError) -> Self {
        match error {
            JobError::NoJob(id) => Self::NotFound(format!("job {id}")),
            JobError::TooLarge { most_bytes } => Self::BodyTooLarge { most_bytes },
            JobError::Empty => Self::bad_body(
                "",
                "the body must be the source scene: a .glb, .gltf, .zip, .plan or .dcg",
            ),
            JobError::QuotaMet { .. } => Self::QuotaMet(error.to_string()),
            JobError::Full { .. } => Self::Full(error.to_string()),
            JobError::Public(_) => Self::Conflict(error.to_string()),
            JobError::Internal(cause) => unkept(cause),
        }
    }
}

impl From<RollbackError> for ApiError {
    fn from(error: RollbackError) -> Self {
        match error {
            RollbackError::NoScene(scene) => Self::NotFound(format!("scene `{scene}`")),
            RollbackError::NoRevision { .. } => Self::bad_body("/revision", error),
            RollbackError::NoEarlier(_) | RollbackError::NotWhole { .. } => Self::Conflict(error.to_string()),
            RollbackError::Unavailable(cause) => Self::Unavailable(cause),
        }
    }
}

impl From<Refusal> for ApiError {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::NoSession => Self::NotFound("session of this name: it has ended".to_owned()),
            Refusal::NoMover => Self::NotFound("mover of this name: it was deleted".to_owned()),
            Refusal::NoCells => Self::NotFound("view cell in this scene".to_owned()),
            _ => Self::bad_body(refusal.pointer(), refusal),
        }
    }
}

#[cfg(test)]
mod tests {
    use sqlx::{AnyConnection, Connection, Executor};

    use super::*;

    #[tokio::test]
    async fn that_the_disk_is_full_is_told_and_what_else_is_wrong_with_the_catalogue_is_not() {
        sqlx::any::install_default_drivers();
        let mut small = AnyConnection::connect("sqlite::memory:").await.unwrap();
        small
            .execute("PRAGMA max_page_count = 4; CREATE TABLE much (it)")
            .await
            .unwrap();
        let detail = |error: sqlx::Error| {
            let cause = anyhow::Error::from(error).context("no ids could be drawn");
            let problem = ApiError::from(LiveError::Unkept(cause)).problem();
            assert_eq!(problem.status, 503);
            problem.detail
        };
        let full = small.execute("INSERT INTO much VALUES (zeroblob(1000000))").await;
        let told = detail(full.unwrap_err());
        assert!(told.starts_with("the disk that holds the catalogue is full"), "{told}");
        let other = small.execute("INSERT INTO little VALUES (1)").await;
        let told = detail(other.unwrap_err());
        assert!(told.contains("its log says what"), "{told}");
    }
}
