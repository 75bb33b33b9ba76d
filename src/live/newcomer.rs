//! What becomes of whoever comes in and does not wait for the answer? It goes again: out of the table, the scene and the
//! catalogue.

use belvedere_live::event::SessionId;
use belvedere_scene::ObjectId;

use super::{
    Live, LiveError, Token, ask,
    message::{Message, StageHandle, Step},
};

/// A session or mover with a place in the table, which goes again unless it is let stay. Held from before the scene is asked,
/// so that at every step all that has been done of it is undone.
pub(super) struct Newcomer {
    live: Live,
    stage: StageHandle,
    who: Option<Who>,
}

#[derive(Debug, Clone, Copy)]
pub(super) enum Who {
    Session(SessionId),
    /// With its token if it is to outlive the server.
    Mover(ObjectId, Option<Token>),
}

impl Newcomer {
    /// For whoever has got a place in the table.
    pub(super) fn new(live: &Live, stage: &StageHandle, who: Who) -> Self {
        Self {
            live: live.clone(),
            stage: stage.clone(),
            who: Some(who),
        }
    }

    /// It stays.
    pub(super) fn stay(mut self) {
        self.who = None;
    }

    /// What the scene has answered. Whoever it does not take has a place in the table alone, and asks it for nothing more: another
    /// may come under the same name.
    pub(super) fn heed<T>(&mut self, answer: Result<T, LiveError>) -> Result<T, LiveError> {
        if answer.is_err()
            && let Some(who) = self.who.take()
        {
            self.leave_table(who);
        }
        answer
    }

    fn leave_table(&self, who: Who) {
        match who {
            Who::Session(session) => self.live.0.registry.end_session(session),
            Who::Mover(object, _) => self.live.0.registry.end_mover(object),
        }
    }
}

impl Drop for Newcomer {
    fn drop(&mut self) {
        let Some(who) = self.who.take() else {
            return;
        };
        self.leave_table(who);
        let (stage, catalogue) = (self.stage.clone(), self.live.0.sources.catalogue.clone());
        tokio::spawn(async move {
            // A scene that has ended holds nobody.
            match who {
                Who::Session(session) => {
                    _ = ask(&stage, |reply| Message::Step(Step::PartFrom { session, reply })).await
                }
                Who::Mover(object, kept) => {
                    _ = ask(&stage, |reply| Message::Destroy { object, reply }).await;
                    if let Some(token) = kept
                        && let Err(error) = catalogue.forget_mover(object, &token.reveal()).await
                    {
                        tracing::error!(%object, %error, "a mover that nobody waited for comes back after a restart");
                    }
                }
            }
        });
    }
}
