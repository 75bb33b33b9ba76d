//! Which sessions does this server hold, as far as others can know, and which servers are gone? Each session has a line in the
//! catalogue, so that another server, or the same one started again, goes on with it.
//!
//! All is written behind, by a task: nobody who opens, moves or leaves waits for the catalogue, and while that is away lines wait
//! here. A line is written soon after a session was opened, and where people stand now and then. Another task says each
//! second that this server is there, as long as it holds sessions, and looks who else is ([`Homes`]); writing holds it up in nothing.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{Arc, Mutex, MutexGuard},
    time::{Duration, Instant},
};

use anyhow::Context;
use belvedere_live::{
    event::SessionId,
    nodes::homes::{Homes, Life},
    world::{Stand, Visitor},
};
use belvedere_scene::SceneName;
use tokio::{
    sync::{Notify, watch},
    time::{MissedTickBehavior, timeout},
};

use super::{
    Live, LiveError, ask,
    message::{Message, Step},
    nodes::{Nodes, Voice},
    together::Together,
    token::Token,
};
use crate::db::{self, Beat, Catalogue, HousedSession, KeptSession, PATIENCE, SessionChanges, Taking};

/// Between two times that this server is heard of.
const BEAT: Duration = Duration::from_secs(1);
/// So many lines of a kind are written together.
const TOGETHER: usize = 500;
/// The last words may take so long.
const LAST_WORDS: Duration = Duration::from_secs(1);

#[derive(Debug)]
pub(super) struct Ledger {
    catalogue: Catalogue,
    /// What this run of the server is called; behind an `@` as a node, where there are several.
    home: String,
    nodes: Option<Nodes>,
    book: Mutex<Book>,
    /// Rung when a session was opened or has ended.
    rung: Notify,
    homes: watch::Sender<Homes>,
    /// Sessions that are looked for, and those that come here. When a server dies, those of all who were there are at once.
    finds: Together<u64, Option<HousedSession>>,
    takes: Together<Taking, Option<u64>>,
}

#[derive(Debug, Default)]
struct Book {
    /// The sessions that this server holds.
    held: BTreeMap<SessionId, Held>,
    unwritten: Unwritten,
}

/// All that its line says of a session.
#[derive(Debug)]
struct Held {
    line: Arc<KeptSession>,
    stand: Option<Stand>,
}

#[derive(Debug, Clone, Default)]
struct Unwritten {
    opened: BTreeMap<SessionId, Arc<KeptSession>>,
    stands: BTreeMap<SessionId, Stand>,
    ended: BTreeSet<SessionId>,
}

impl Unwritten {
    fn is_empty(&self) -> bool {
        self.opened.is_empty() && self.stands.is_empty() && self.ended.is_empty()
    }

    /// Some of it, to be written together.
    fn some(&self) -> Self {
        fn first<K: Ord + Copy, V: Clone>(all: &BTreeMap<K, V>) -> BTreeMap<K, V> {
            let some = all.iter().take(TOGETHER);
            some.map(|(key, value)| (*key, value.clone())).collect()
        }
        Self {
            opened: first(&self.opened),
            // Where somebody stands is said of a line that is there.
            stands: if self.opened.len() > TOGETHER {
                BTreeMap::new()
            } else {
                first(&self.stands)
            },
            ended: self.ended.iter().take(TOGETHER).copied().collect(),
        }
    }

    fn changes(&self) -> SessionChanges {
        SessionChanges {
            opened: self.opened.values().map(|kept| KeptSession::clone(kept)).collect(),
            stands: self.stands.iter().map(|(s, stand)| (s.0, json(stand))).collect(),
            ended: self.ended.iter().map(|session| session.0).collect(),
        }
    }

    /// All of this is written; what has come since stays.
    fn strike(&mut self, written: &Self) {
        self.opened.retain(|session, _| !written.opened.contains_key(session));
        self.stands
            .retain(|session, stand| written.stands.get(session) != Some(stand));
        self.ended.retain(|session| !written.ended.contains(session));
    }
}

impl Ledger {
    pub(super) fn new(catalogue: Catalogue, nodes: Option<Nodes>) -> Result<Self, LiveError> {
        let node = nodes.as_ref().map(|nodes| format!("@{}", nodes.id()));
        Ok(Self {
            catalogue,
            // As hard to meet twice.
            home: Token::random()?.reveal() + &node.unwrap_or_default(),
            nodes,
            book: Mutex::default(),
            rung: Notify::new(),
            homes: watch::Sender::default(),
            finds: Together::default(),
            takes: Together::default(),
        })
    }

    /// Only changes are told.
    fn note(&self, done: &Result<(), LiveError>, away: &mut bool) {
        match done {
            Err(error) if !*away => {
                let error = match error {
                    LiveError::Unkept(cause) => self.catalogue.why(cause),
                    other => other.to_string(),
                };
                tracing::warn!(error, "sessions go on here and cannot be taken up elsewhere");
                *away = true;
            }
            Ok(()) if *away => {
                tracing::info!("sessions can be taken up elsewhere again");
                *away = false;
            }
            Ok(()) | Err(_) => {}
        }
    }

    fn book(&self) -> MutexGuard<'_, Book> {
        self.book.lock().expect("nobody panics while holding this lock")
    }

    /// A line for a session that has been opened.
    pub(super) fn open(&self, session: SessionId, line: KeptSession) {
        let (line, stand) = (Arc::new(line), None);
        let mut book = self.book();
        book.unwritten.opened.insert(session, line.clone());
        book.held.insert(session, Held { line, stand });
        drop(book);
        self.rung.notify_one();
    }

    /// A session has come here with its line.
    pub(super) fn hold(&self, session: SessionId, line: KeptSession, stand: Option<Stand>) {
        let line = Arc::new(line);
        self.book().held.insert(session, Held { line, stand });
    }

    /// Where a session stands is written with whatever is written next.
    pub(super) fn stands(&self, session: SessionId, stand: Stand) {
        let mut book = self.book();
        if let Some(held) = book.held.get_mut(&session) {
            held.stand = Some(stand);
        }
        book.unwritten.stands.insert(session, stand);
    }

    /// No line any more for a session that has ended.
    pub(super) fn end(&self, session: SessionId) {
        self.part(session);
        // It may be under way.
        self.book().unwritten.ended.insert(session);
        self.rung.notify_one();
    }

    /// A session is here no more; its line is another home's.
    pub(super) fn part(&self, session: SessionId) {
        let mut book = self.book();
        book.held.remove(&session);
        book.unwritten.opened.remove(&session);
        book.unwritten.stands.remove(&session);
    }

    /// The sessions that are held here and whose lines are written.
    fn written(&self) -> Vec<SessionId> {
        let book = self.book();
        let held = book.held.keys();
        held.filter(|session| !book.unwritten.opened.contains_key(session))
            .copied()
            .collect()
    }

    /// Lines anew for sessions that are held here and have none any more.
    fn write_anew(&self, sessions: impl IntoIterator<Item = SessionId>) {
        let Book { held, unwritten } = &mut *self.book();
        for session in sessions {
            if let Some(Held { line, stand }) = held.get(&session) {
                unwritten.opened.insert(session, line.clone());
                unwritten.stands.extend(stand.map(|stand| (session, stand)));
            }
        }
        self.rung.notify_one();
    }

    /// The line of a session that this server does not hold, wherever it is at home.
    pub(super) async fn find(&self, session: SessionId) -> Result<Option<HousedSession>, LiveError> {
        if self.book().unwritten.ended.contains(&session) {
            return Ok(None);
        }
        let all = |sessions: Vec<u64>| in_time(async move { self.catalogue.kept_sessions(&sessions).await });
        self.finds.ask(session.0, all).await
    }

    /// Waits until it is known that the home of a session is gone; gives its number. Fails when it is heard of, in the catalogue
    /// or by other nodes: one that has lost the catalogue alone keeps its sessions.
    pub(super) async fn outlives(&self, line: &HousedSession) -> Result<i64, LiveError> {
        let (session, home) = (SessionId(line.kept.session), line.home.as_str());
        if home == self.home {
            return Ok(0);
        }
        let mut homes = self.homes.subscribe();
        let mut gone_since = None;
        let verdict = timeout(PATIENCE, async {
            loop {
                let (life, has_ended) = {
                    let homes = homes.borrow_and_update();
                    (homes.life(home, line.beats), homes.has_ended(home))
                };
                match life {
                    Life::Gone(beats) => {
                        let since = *gone_since.get_or_insert_with(Instant::now);
                        match self.voice(home, since) {
                            Voice::Speaks if !has_ended => return Err(LiveError::Elsewhere(session)),
                            Voice::Unsure if !has_ended => {}
                            _ => return Ok(beats),
                        }
                    }
                    Life::Lives => return Err(LiveError::Elsewhere(session)),
                    Life::Unsure => {}
                }
                homes.changed().await.map_err(|_| LiveError::Stopped)?;
            }
        });
        verdict
            .await
            .context("nobody knows whether another server lives")
            .map_err(LiveError::Unkept)?
    }

    /// Whether a home speaks to this node.
    fn voice(&self, home: &str, since: Instant) -> Voice {
        let node = home.split_once('@').and_then(|(_, node)| node.parse().ok());
        match (&self.nodes, node) {
            (Some(nodes), Some(node)) => nodes.voice(&node, since),
            _ => Voice::Silent,
        }
    }

    /// Makes this the home of a session whose last one is gone; says how often it has moved. None when another server was faster.
    pub(super) async fn take(&self, taking: Taking) -> Result<Option<u64>, LiveError> {
        let all =
            |takings: Vec<Taking>| in_time(async move { self.catalogue.take_sessions(&takings, &self.home).await });
        self.takes.ask(taking, all).await
    }

    /// Writes what waits; nothing is lost when that fails.
    async fn write(&self) -> Result<(), LiveError> {
        loop {
            let batch = self.book().unwritten.some();
            if batch.is_empty() {
                return Ok(());
            }
            in_time(self.catalogue.keep_sessions(&self.home, &batch.changes())).await?;
            self.book().unwritten.strike(&batch);
        }
    }

    /// Says that this server is there, if it holds sessions.
    async fn beat(&self, live: &Live) -> Result<Option<Beat>, LiveError> {
        if !live.0.registry.has_sessions() {
            return Ok(None);
        }
        let beat = in_time(self.catalogue.beat_home(&self.home)).await;
        if beat.is_err() {
            // Where this server cannot write, the silence of others says nothing.
            self.homes.send_modify(Homes::blink);
        }
        beat.map(Some)
    }

    /// Looks who else is there.
    async fn look(&self) -> Result<(), LiveError> {
        let homes = in_time(self.catalogue.session_homes()).await;
        match &homes {
            Ok(all) => {
                let all = all.iter().map(|home| (home.home.clone(), home.beats, home.ended));
                self.homes.send_modify(|homes| homes.look(all));
            }
            Err(_) => self.homes.send_modify(Homes::blink),
        }
        homes.map(drop)
    }

    async fn forget_forsaken(&self) -> Result<(), LiveError> {
        let forsaken: Vec<_> = {
            let homes = self.homes.borrow();
            let others = homes.forsaken().filter(|(home, _)| *home != self.home);
            others.map(|(home, beats)| (home.to_owned(), beats)).collect()
        };
        for (home, beats) in forsaken {
            in_time(self.catalogue.forget_home(&home, beats)).await?;
        }
        Ok(())
    }

    /// The last words: others need not wait until this server is missed, and what waits is written.
    pub(super) async fn close(&self) {
        let words = async {
            in_time(self.catalogue.end_home(&self.home)).await?;
            self.write().await
        };
        if !matches!(timeout(LAST_WORDS, words).await, Ok(Ok(()))) {
            tracing::info!("the catalogue does not answer: sessions can be taken up when this server is missed");
        }
    }
}

/// A line for a session that was opened so.
pub(super) fn line(session: SessionId, scene: &SceneName, visitor: &Visitor, statics: bool) -> KeptSession {
    KeptSession {
        session: session.0,
        scene: scene.clone(),
        visitor: json(visitor),
        statics,
    }
}

/// The visitor of a line, and where it stood last.
pub(super) fn visitor(line: &HousedSession) -> anyhow::Result<(Visitor, Option<Stand>)> {
    let visitor = serde_json::from_str(&line.kept.visitor)?;
    let stand = line.stand.as_deref().map(serde_json::from_str).transpose()?;
    Ok((visitor, stand))
}

/// Keeps the ledger until the server stops.
pub(super) async fn keep(live: Live) {
    tokio::join!(say_and_look(&live), write_behind(&live));
}

/// Says each second that this server is there, and looks who else is.
async fn say_and_look(live: &Live) {
    let mut beats = tokio::time::interval(BEAT);
    beats.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let (mut last, mut away) = (Beat { beats: 0, robbed: 0 }, false);
    loop {
        beats.tick().await;
        live.0.ledger.note(&round(live, &mut last).await, &mut away);
    }
}

/// Writes what waits as soon as there is something, and each second.
async fn write_behind(live: &Live) {
    let ledger = &live.0.ledger;
    let mut away = false;
    loop {
        // What rang meanwhile rings at once.
        _ = timeout(BEAT, ledger.rung.notified()).await;
        ledger.note(&ledger.write().await, &mut away);
        if away {
            tokio::time::sleep(BEAT).await;
        }
    }
}

async fn round(live: &Live, last: &mut Beat) -> Result<(), LiveError> {
    let ledger = &live.0.ledger;
    if let Some(beat) = ledger.beat(live).await? {
        if beat.beats <= last.beats {
            come_back(live).await?;
        } else if beat.robbed != last.robbed {
            part_from_lost(live).await?;
        }
        *last = beat;
    }
    ledger.look().await?;
    ledger.forget_forsaken().await
}

/// Others have taken sessions up that this server holds, since it was not heard of: these end here.
async fn part_from_lost(live: &Live) -> Result<(), LiveError> {
    let ledger = &live.0.ledger;
    let held = ledger.written();
    let ours = in_time(ledger.catalogue.sessions_at(&ledger.home)).await?;
    let lost = held.into_iter().filter(|session| !ours.contains(&session.0));
    part_from(live, lost).await
}

/// This server was not heard of for so long that it was forgotten, and with it the lines of its sessions: they are written anew,
/// but of those that others hold.
async fn come_back(live: &Live) -> Result<(), LiveError> {
    let ledger = &live.0.ledger;
    for held in ledger.written().chunks(TOGETHER) {
        let sessions: Vec<_> = held.iter().map(|session| session.0).collect();
        let lines = in_time(ledger.catalogue.kept_sessions(&sessions)).await?;
        let lines: Vec<_> = held.iter().copied().zip(lines).collect();
        ledger.write_anew(
            lines
                .iter()
                .filter(|(_, line)| line.is_none())
                .map(|(session, _)| *session),
        );
        let lost = lines.into_iter().filter_map(|(session, line)| Some((session, line?)));
        let lost = lost.filter(|(_, line)| line.home != ledger.home);
        part_from(live, lost.map(|(session, _)| session)).await?;
    }
    Ok(())
}

async fn part_from(live: &Live, lost: impl Iterator<Item = SessionId>) -> Result<(), LiveError> {
    for session in lost {
        if let Some(entry) = live.0.registry.session(session) {
            tracing::info!(%session, "another server has taken the session up");
            ask(&entry.stage, |reply| Message::Step(Step::PartFrom { session, reply })).await?;
        }
    }
    Ok(())
}

async fn in_time<T>(asked: impl Future<Output = anyhow::Result<T>>) -> Result<T, LiveError> {
    db::in_time(PATIENCE, asked).await.map_err(LiveError::Unkept)
}

fn json<T: serde::Serialize>(value: &T) -> String {
    serde_json::to_string(value).expect("what is kept holds nothing that JSON cannot say")
}
