//! What can a participant ask of its session?

use std::{sync::Arc, time::Duration};

use belvedere_live::{
    aoi::Aoi,
    event::SessionId,
    world::{Seen, Sent},
};
use belvedere_scene::SceneName;

use super::{
    EventReader, LiveError, Tally, ask,
    message::{Message, StageHandle, Step},
    outbox::Outbox,
    quality::{NoShare, Reported},
};

/// A session whose token was shown.
#[derive(Debug)]
pub struct SessionHandle {
    pub(super) session: SessionId,
    pub(super) stage: StageHandle,
    pub(super) outbox: Arc<Outbox>,
    pub(super) quality: Arc<Reported>,
    pub(super) lease: Duration,
    pub(super) tally: Arc<Tally>,
}

impl SessionHandle {
    /// The scene that it is in.
    #[must_use]
    pub fn scene(&self) -> &SceneName {
        self.stage.scene()
    }

    /// Takes the participant's pose.
    ///
    /// # Errors
    /// When the rules refuse it, or poses come too fast.
    pub async fn pose(&self, sent: Sent) -> Result<Seen, LiveError> {
        let session = self.session;
        ask(&self.stage, |reply| Message::Step(Step::Pose { session, sent, reply })).await?
    }

    /// Changes how far the participant looks.
    ///
    /// # Errors
    /// When the rules refuse it.
    pub async fn set_aoi(&self, aoi: Aoi) -> Result<(), LiveError> {
        let session = self.session;
        ask(&self.stage, |reply| Message::Step(Step::Aoi { session, aoi, reply })).await?
    }

    /// Takes note of the share of what can be seen that the participant has downloaded.
    ///
    /// # Errors
    /// When it is no share.
    pub fn report(&self, quality: f64) -> Result<(), NoShare> {
        self.quality.set(quality)
    }

    /// Ends the session.
    ///
    /// # Errors
    /// When the scene's task does not answer.
    pub async fn close(&self) -> Result<(), LiveError> {
        let session = self.session;
        ask(&self.stage, |reply| Message::Step(Step::Close { session, reply })).await
    }

    /// What the session is told, from the event after `last_seen` on. Ends an earlier stream of the same session.
    #[must_use]
    pub fn events(&self, last_seen: Option<u64>) -> EventReader {
        EventReader::attach(self.outbox.clone(), self.tally.clone(), last_seen, self.lease)
    }
}
