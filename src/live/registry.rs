//! Which scene is a session or a mover in, and what is its token? One table for all scenes, locked for moments only.

use std::{
    collections::{BTreeMap, BTreeSet},
    net::IpAddr,
    sync::{Arc, Mutex, MutexGuard},
    time::{Duration, Instant},
};

use belvedere_live::{
    Ms,
    event::SessionId,
    world::{Counts, Seen},
};
use belvedere_scene::{Bounds, ObjectId, SceneName};

use super::{
    LiveError, LiveSettings,
    message::StageHandle,
    outbox::Outbox,
    quality::{Quality, Reported},
    shares::{Good, Shares},
    token::Token,
};

/// A session that was opened.
#[derive(Debug)]
pub struct Opened {
    /// The session.
    pub session: SessionId,
    /// Its avatar.
    pub object: ObjectId,
    /// What it must show from now on.
    pub token: Token,
    /// Where it is, and whether anybody sees it.
    pub seen: Seen,
    /// Server time.
    pub now_ms: Ms,
}

/// A door and what is to become of it.
#[derive(Debug, Clone, Copy)]
pub struct Door {
    /// A static object that is a door.
    pub object: ObjectId,
    /// The box around it.
    pub bounds: Bounds,
    /// Whether it is to be open.
    pub open: bool,
}

#[derive(Debug, Default)]
pub(super) struct Registry(Mutex<Tables>);

#[derive(Debug, Default)]
struct Tables {
    stages: BTreeMap<SceneName, StageHandle>,
    sessions: BTreeMap<SessionId, SessionEntry>,
    movers: BTreeMap<ObjectId, MoverEntry>,
    shares: Shares,
    /// Who has a token: looked up for every door, by whoever shows any.
    sessions_by_token: BTreeMap<Token, SessionId>,
    movers_by_token: BTreeMap<Token, BTreeSet<ObjectId>>,
}

#[derive(Debug, Clone)]
pub(super) struct SessionEntry {
    pub(super) session: SessionId,
    pub(super) token: Token,
    pub(super) stage: StageHandle,
    pub(super) outbox: Arc<Outbox>,
    pub(super) quality: Arc<Reported>,
    /// Whose share it is of.
    from: Option<IpAddr>,
}

#[derive(Debug)]
struct MoverEntry {
    token: Token,
    stage: StageHandle,
    /// It outlives the server.
    stays: bool,
    /// Whose share it is of.
    from: Option<IpAddr>,
    /// When its token was shown last.
    heard: Instant,
}

/// The mover is not here.
fn no_mover(object: ObjectId) -> LiveError {
    LiveError::NotFound(format!(
        "mover {object} on this node: it was deleted, never was, or is on another; send its requests to one node"
    ))
}

impl Tables {
    fn add_mover(
        &mut self,
        (object, token): (ObjectId, Token),
        stage: &StageHandle,
        stays: bool,
        from: Option<IpAddr>,
    ) {
        let (stage, heard) = (stage.clone(), Instant::now());
        self.remove_mover(object);
        goods(stays).for_each(|good| self.shares.add(good, from));
        self.movers_by_token.entry(token).or_default().insert(object);
        self.movers.insert(
            object,
            MoverEntry {
                token,
                stage,
                stays,
                from,
                heard,
            },
        );
    }

    fn check_movers(&self, stays: bool, from: Option<IpAddr>, settings: &LiveSettings) -> Result<(), LiveError> {
        goods(stays).try_for_each(|good| self.shares.check(good, from, settings))
    }

    fn remove_mover(&mut self, object: ObjectId) {
        let Some(mover) = self.movers.remove(&object) else {
            return;
        };
        goods(mover.stays).for_each(|good| self.shares.remove(good, mover.from));
        if let Some(same) = self.movers_by_token.get_mut(&mover.token) {
            same.remove(&object);
            if same.is_empty() {
                self.movers_by_token.remove(&mover.token);
            }
        }
    }

    fn add_session(&mut self, entry: &SessionEntry) {
        self.remove_session(entry.session);
        self.shares.add(Good::Sessions, entry.from);
        self.sessions_by_token.insert(entry.token, entry.session);
        self.sessions.insert(entry.session, entry.clone());
    }

    fn remove_session(&mut self, session: SessionId) {
        if let Some(entry) = self.sessions.remove(&session) {
            self.sessions_by_token.remove(&entry.token);
            self.shares.remove(Good::Sessions, entry.from);
            entry.outbox.close();
        }
    }

    fn session_of(&self, stage: &StageHandle, token: Token) -> Option<SessionId> {
        let entry = self.sessions.get(self.sessions_by_token.get(&token)?)?;
        entry.stage.is(stage).then_some(entry.session)
    }
}

/// What a mover is one of.
fn goods(stays: bool) -> impl Iterator<Item = Good> {
    [Good::Movers].into_iter().chain(stays.then_some(Good::Staying))
}

impl Registry {
    fn tables(&self) -> MutexGuard<'_, Tables> {
        self.0.lock().expect("nobody panics while holding this lock")
    }

    /// The task of a scene, started when there is none that runs.
    pub(super) fn stage(&self, scene: &SceneName, start: impl FnOnce() -> StageHandle) -> StageHandle {
        let mut tables = self.tables();
        let running = tables.stages.get(scene).filter(|stage| stage.runs()).cloned();
        running.unwrap_or_else(|| {
            let stage = start();
            tables.stages.insert(scene.clone(), stage.clone());
            stage
        })
    }

    pub(super) fn counts(&self) -> Counts {
        let each = self
            .tables()
            .stages
            .values()
            .map(StageHandle::counts)
            .collect::<Vec<_>>();
        each.into_iter().fold(Counts::default(), |sum, stage| Counts {
            sessions: sum.sessions + stage.sessions,
            movers: sum.movers + stage.movers,
            hushed: sum.hushed + stage.hushed,
            abroad: sum.abroad + stage.abroad,
        })
    }

    /// What participants say of their pictures, those that say it.
    pub(super) fn quality(&self) -> Quality {
        let tables = self.tables();
        tables
            .sessions
            .values()
            .filter_map(|entry| entry.quality.last())
            .collect()
    }

    /// Whether another session may be opened from there.
    pub(super) fn check_room(&self, from: Option<IpAddr>, settings: &LiveSettings) -> Result<(), LiveError> {
        self.tables().shares.check(Good::Sessions, from, settings)
    }

    /// Whether another mover may be created from there.
    pub(super) fn check_movers(
        &self,
        stays: bool,
        from: Option<IpAddr>,
        settings: &LiveSettings,
    ) -> Result<(), LiveError> {
        self.tables().check_movers(stays, from, settings)
    }

    /// A new session, or one that has moved here and was `taken` up so often.
    pub(super) fn new_session(
        &self,
        stage: &StageHandle,
        (session, token): (SessionId, Token),
        taken: u64,
        from: Option<IpAddr>,
        settings: &LiveSettings,
    ) -> Result<SessionEntry, LiveError> {
        let mut tables = self.tables();
        tables.shares.check(Good::Sessions, from, settings)?;
        let entry = SessionEntry {
            session,
            token,
            stage: stage.clone(),
            outbox: Arc::new(stage.outbox(taken)),
            quality: Arc::default(),
            from,
        };
        tables.add_session(&entry);
        Ok(entry)
    }

    pub(super) fn session(&self, session: SessionId) -> Option<SessionEntry> {
        self.tables().sessions.get(&session).cloned()
    }

    /// Whether anybody is here.
    pub(super) fn has_sessions(&self) -> bool {
        !self.tables().sessions.is_empty()
    }

    /// The session of a scene that has this token.
    pub(super) fn session_of(&self, stage: &StageHandle, token: Token) -> Result<SessionId, LiveError> {
        let session = self.tables().session_of(stage, token);
        session.ok_or_else(|| LiveError::WrongToken("a session in this scene".to_owned()))
    }

    /// This token, if anybody in a scene has it.
    pub(super) fn anybody(&self, stage: &StageHandle, token: Option<Token>) -> Result<Token, LiveError> {
        let token = token.ok_or(LiveError::NoToken)?;
        let tables = self.tables();
        let here = |object: &ObjectId| tables.movers.get(object).is_some_and(|mover| mover.stage.is(stage));
        let mut movers = tables.movers_by_token.get(&token).into_iter().flatten();
        if movers.any(here) || tables.session_of(stage, token).is_some() {
            Ok(token)
        } else {
            Err(LiveError::WrongToken("a session or a mover in this scene".to_owned()))
        }
    }

    /// Forgets a session; whoever reads its events hears the end.
    pub(super) fn end_session(&self, session: SessionId) {
        self.tables().remove_session(session);
    }

    pub(super) fn new_mover(
        &self,
        stage: &StageHandle,
        (object, token): (ObjectId, Option<Token>),
        stays: bool,
        from: Option<IpAddr>,
        settings: &LiveSettings,
    ) -> Result<Token, LiveError> {
        let token = token.map_or_else(Token::random, Ok)?;
        let mut tables = self.tables();
        tables.check_movers(stays, from, settings)?;
        tables.add_mover((object, token), stage, stays, from);
        Ok(token)
    }

    /// A mover is back that was there before. Refused when another one of its id lives here.
    pub(super) fn restore_mover(&self, stage: &StageHandle, object: ObjectId, token: Token) -> bool {
        let mut tables = self.tables();
        if let Some(known) = tables.movers.get(&object) {
            return known.token == token;
        }
        tables.add_mover((object, token), stage, true, None);
        true
    }

    /// The scene of a mover, for whoever has its token.
    pub(super) fn mover(&self, object: ObjectId, token: Option<Token>) -> Result<StageHandle, LiveError> {
        let mut tables = self.tables();
        let entry = tables.movers.get_mut(&object);
        let entry = entry.ok_or_else(|| no_mover(object))?;
        entry.token.admit(token, || format!("mover {object}"))?;
        entry.heard = Instant::now();
        Ok(entry.stage.clone())
    }

    /// The scene of a mover.
    pub(super) fn scene_of(&self, object: ObjectId) -> Result<StageHandle, LiveError> {
        let tables = self.tables();
        let entry = tables.movers.get(&object);
        Ok(entry.ok_or_else(|| no_mover(object))?.stage.clone())
    }

    /// Movers of a scene that nobody keeps and of which nobody has said anything for this long: neither who has their
    /// token, nor a session that drives them.
    pub(super) fn silent_movers(&self, stage: &StageHandle, lease: Duration) -> Vec<ObjectId> {
        let tables = self.tables();
        let driving: BTreeSet<_> = tables.sessions.values().map(|entry| entry.token).collect();
        let silent = tables.movers.iter().filter(|(_, mover)| {
            !mover.stays && mover.stage.is(stage) && mover.heard.elapsed() > lease && !driving.contains(&mover.token)
        });
        silent.map(|(object, _)| *object).collect()
    }

    /// The token of a mover that outlives the server.
    pub(super) fn kept_token(&self, object: ObjectId) -> Option<Token> {
        let tables = self.tables();
        let mover = tables.movers.get(&object).filter(|mover| mover.stays);
        mover.map(|mover| mover.token)
    }

    pub(super) fn end_mover(&self, object: ObjectId) {
        self.tables().remove_mover(object);
    }

    /// Forgets everybody in a scene whose task has ended.
    pub(super) fn end_stage(&self, stage: &StageHandle) {
        let mut tables = self.tables();
        tables.stages.retain(|_, other| !other.is(stage));
        let movers = tables.movers.iter().filter(|(_, mover)| mover.stage.is(stage));
        for object in movers.map(|(object, _)| *object).collect::<Vec<_>>() {
            tables.remove_mover(object);
        }
        let sessions = tables.sessions.values().filter(|entry| entry.stage.is(stage));
        for session in sessions.map(|entry| entry.session).collect::<Vec<_>>() {
            tables.remove_session(session);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_a_million_who_want_in_as_many_are_let_in_as_there_is_room_for() {
        const ROOM: usize = 100;
        let registry = Registry::default();
        let (stage, _inbox) = StageHandle::new("row".parse().unwrap());
        let (token, mut let_in) = (Token::random().unwrap(), 0);
        let settings = LiveSettings {
            sessions: ROOM,
            ..LiveSettings::default()
        };
        for i in 0..1_000_000 {
            let entered = registry.new_session(&stage, (SessionId(i), token), 0, None, &settings);
            match entered {
                // Some do not wait for an answer: what was kept for them is given back.
                Ok(entry) if i % 2 == 0 => registry.end_session(entry.session),
                Ok(_) => let_in += 1,
                Err(refused) => assert!(matches!(refused, LiveError::Full { most: ROOM, .. }), "{refused}"),
            }
        }
        assert_eq!((let_in, registry.tables().sessions.len()), (ROOM, ROOM));
        assert!(registry.check_room(None, &settings).is_err());
        assert!(registry.check_room(None, &LiveSettings::default()).is_ok());
    }

    #[test]
    fn a_token_is_known_where_and_as_long_as_somebody_has_it() {
        let registry = Registry::default();
        let [row, hall] = ["row", "hall"].map(|scene| StageHandle::new(scene.parse().unwrap()).0);
        let [one, two, three] = std::array::from_fn(|_| Token::random().unwrap());
        let settings = LiveSettings::default();
        let known = |stage, token| registry.anybody(stage, Some(token)).is_ok();
        for object in [1, 2] {
            let new = registry.new_mover(&row, (ObjectId(object), Some(one)), false, None, &settings);
            new.unwrap();
        }
        registry
            .new_mover(&hall, (ObjectId(3), Some(two)), true, None, &settings)
            .unwrap();
        registry
            .new_session(&row, (SessionId(7), three), 0, None, &settings)
            .unwrap();
        assert!(known(&row, one) && known(&hall, two) && known(&row, three));
        assert!(!known(&hall, one) && !known(&row, two) && !known(&hall, three));
        registry.end_mover(ObjectId(1));
        assert!(known(&row, one), "another one has it");
        registry.end_mover(ObjectId(2));
        registry.end_session(SessionId(7));
        assert!(!known(&row, one) && !known(&row, three));
        registry.end_stage(&hall);
        assert!(!known(&hall, two));
        let tables = registry.tables();
        assert!(tables.movers_by_token.is_empty() && tables.sessions_by_token.is_empty());
    }
}
