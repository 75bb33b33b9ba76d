//! How does a participant come into a scene: anew, or again after the server was gone that held its session?
//!
//! A session that this server does not hold is looked for in the [ledger] when its token is shown. While its
//! home lives it is not for this server; when that is gone, whoever is asked first takes it up under the same name, and
//! whoever listens is told all anew.

use std::{net::IpAddr, sync::atomic::Ordering};

use belvedere_live::{event::SessionId, world::Visitor};
use belvedere_scene::SceneName;
use tokio::sync::Mutex;

use super::{
    Live, LiveError, Opened, SessionHandle, Token, ask,
    ids::{avatar_of, session_of},
    ledger,
    message::{Entry, Message, Step},
    newcomer::{Newcomer, Who},
    registry::SessionEntry,
};
use crate::db::Taking;

/// Who takes a session up keeps others out who want the same one, and few besides.
#[derive(Debug)]
pub(super) struct Turns([Mutex<()>; 64]);

impl Default for Turns {
    fn default() -> Self {
        Self(std::array::from_fn(|_| Mutex::new(())))
    }
}

impl Turns {
    fn of(&self, session: SessionId) -> &Mutex<()> {
        &self.0[(session.0 % self.0.len() as u64) as usize]
    }
}

impl Live {
    /// Opens a session for somebody at this address, if that is known, which hears of static objects too if it wants.
    ///
    /// # Errors
    /// When there is no room, or the rules refuse it.
    pub async fn open(
        &self,
        scene: &SceneName,
        visitor: Visitor,
        with_statics: bool,
        from: Option<IpAddr>,
    ) -> Result<Opened, LiveError> {
        // Ids are never used again: whoever finds no room takes none.
        let room = self.0.registry.check_room(from, &self.0.settings);
        self.count_crowded(room)?;
        let session = session_of(self.0.ids.draw().await?);
        let line = ledger::line(session, scene, &visitor, with_statics);
        let opened = self.let_in(session, scene, visitor, (with_statics, 0), from).await?;
        self.0.ledger.open(session, line);
        Ok(opened)
    }

    /// A session, for whoever has its token. One whose home is gone has it here from now on.
    ///
    /// # Errors
    /// When there is none, it is at home elsewhere, the token is not its own, or the catalogue does not answer.
    pub async fn session(&self, session: SessionId, token: Option<Token>) -> Result<SessionHandle, LiveError> {
        let entry = match self.0.registry.session(session) {
            Some(entry) => entry,
            // Whoever has no token learns nothing of what others hold.
            None if token != Some(self.0.signet.token(session)) => return Err(no_session(session)),
            None => {
                // Whoever asks may go away; what is begun is done.
                let live = self.clone();
                let taking = tokio::spawn(async move { live.take_up(session).await });
                taking.await.map_err(|_| LiveError::Stopped)??
            }
        };
        entry.token.admit(token, || format!("session {session}"))?;
        Ok(SessionHandle {
            tally: self.0.tally.clone(),
            session,
            stage: entry.stage,
            outbox: entry.outbox,
            quality: entry.quality,
            lease: self.0.settings.lease,
        })
    }

    async fn take_up(&self, session: SessionId) -> Result<SessionEntry, LiveError> {
        let ledger = &self.0.ledger;
        if self.0.stopping.is_cancelled() {
            return Err(LiveError::Stopped);
        }
        // Nobody waits in turn for what can be known before.
        let line = ledger.find(session).await?.ok_or_else(|| no_session(session))?;
        let beats = ledger.outlives(&line).await?;
        let _turn = self.0.turns.of(session).lock().await;
        if let Some(entry) = self.0.registry.session(session) {
            return Ok(entry);
        }
        self.0.registry.check_room(None, &self.0.settings)?;
        let (visitor, stand) = ledger::visitor(&line).map_err(LiveError::Unkept)?;
        let taking = Taking {
            session: session.0,
            from: line.home,
            beats,
        };
        // It may have moved while others had their turn.
        let taken = ledger.take(taking).await?.ok_or(LiveError::Elsewhere(session))?;
        let (scene, statics) = (line.kept.scene.clone(), line.kept.statics);
        ledger.hold(session, line.kept, stand);
        let visitor = visitor.standing(stand);
        match self.let_in(session, &scene, visitor, (statics, taken), None).await {
            Ok(_) => {}
            Err(LiveError::Refused(refusal)) => {
                tracing::info!(%session, %refusal, "a session has no place any more");
                ledger.end(session);
                return Err(no_session(session));
            }
            Err(error) => {
                ledger.part(session);
                return Err(error);
            }
        }
        self.0.tally.taken_up.fetch_add(1, Ordering::Relaxed);
        self.0.registry.session(session).ok_or_else(|| no_session(session))
    }

    /// Lets somebody in whose session has come here so often.
    async fn let_in(
        &self,
        session: SessionId,
        scene: &SceneName,
        visitor: Visitor,
        (with_statics, taken): (bool, u64),
        from: Option<IpAddr>,
    ) -> Result<Opened, LiveError> {
        let object = avatar_of(session).ok_or_else(|| no_session(session))?;
        let (stage, token) = (self.stage(scene), self.0.signet.token(session));
        let entry = self
            .0
            .registry
            .new_session(&stage, (session, token), taken, from, &self.0.settings);
        let entry = self.count_crowded(entry)?;
        let mut newcomer = Newcomer::new(self, &stage, Who::Session(session));
        let message = |reply| {
            Message::Step(Step::Enter(Box::new(Entry {
                session,
                object,
                visitor,
                outbox: entry.outbox.clone(),
                with_statics,
                reply,
            })))
        };
        let (seen, now_ms) = newcomer.heed(ask(&stage, message).await?)?;
        newcomer.stay();
        Ok(Opened {
            session,
            object,
            token,
            seen,
            now_ms,
        })
    }
}

fn no_session(session: SessionId) -> LiveError {
    LiveError::NotFound(format!("session {session}: it has ended, or never was; open a new one"))
}
