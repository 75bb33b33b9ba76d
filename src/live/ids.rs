//! Which ids do new movers and sessions get? Ones that nobody else ever had, on whichever server of the catalogue: a server
//! draws numbers from there for many at once, and more before it has used up the last. So who comes while the catalogue is away, or its disk
//! full, is let in as long as there are any; the first are drawn when the server starts.

use std::{
    collections::VecDeque,
    ops::Range,
    sync::{Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use anyhow::Context;
use belvedere_live::event::{FIRST_MOVER, SessionId};
use belvedere_scene::ObjectId;

use super::LiveError;
use crate::{
    db::{self, Catalogue},
    seldom::Seldom,
};

/// The session of an avatar: nothing else ever had its number.
pub(super) fn session_of(avatar: ObjectId) -> SessionId {
    SessionId(u64::from(avatar.0.saturating_sub(FIRST_MOVER)))
}

/// The avatar of a session; none when no session has such a name.
pub(super) fn avatar_of(session: SessionId) -> Option<ObjectId> {
    let number = u32::try_from(session.0).ok()?;
    FIRST_MOVER.checked_add(number).map(ObjectId)
}

/// So many are drawn at once; a server that ends loses those that are left.
const BLOCK: u32 = 10_000;
/// So many at the start: servers that start again and again lose few.
const FIRST: u32 = 1_000;
/// When no more than so many are left, more are drawn.
const FEW: u32 = 500;
/// So long may the catalogue take to give some.
const PATIENCE: Duration = Duration::from_secs(5);

#[derive(Debug)]
pub(super) struct Ids {
    catalogue: Catalogue,
    stock: Mutex<Stock>,
    /// Whoever draws; who waits for that shares what came of it.
    drawing: tokio::sync::Mutex<Option<Failure>>,
}

/// Why none could be drawn, the last time.
#[derive(Debug)]
struct Failure {
    at: Instant,
    why: String,
}

/// What was drawn, and not used yet.
#[derive(Debug, Default)]
struct Stock {
    blocks: VecDeque<Range<u32>>,
    /// While some are left, more are asked for seldom: whoever is to be let in waits for that.
    asked: Seldom<()>,
}

impl Stock {
    fn left(&self) -> u32 {
        self.blocks.iter().map(|block| block.end - block.start).sum()
    }

    fn take(&mut self) -> Option<ObjectId> {
        while let Some(block) = self.blocks.front_mut() {
            if let Some(next) = block.next() {
                return Some(ObjectId(next));
            }
            self.blocks.pop_front();
        }
        None
    }

    /// Whether more are to be asked for.
    fn is_low(&mut self, now: Instant) -> bool {
        self.left() <= FEW && self.asked.is_due((), now)
    }
}

impl Ids {
    pub(super) fn new(catalogue: Catalogue) -> Self {
        Self {
            catalogue,
            stock: Mutex::default(),
            drawing: tokio::sync::Mutex::default(),
        }
    }

    /// Draws the first ones.
    pub(super) async fn lay_in(&self) -> anyhow::Result<()> {
        self.lay_in_more(FIRST).await
    }

    /// A mover's id; an avatar's is that of its session too.
    pub(super) async fn draw(&self) -> Result<ObjectId, LiveError> {
        let since = Instant::now();
        let (id, is_low) = {
            let mut stock = self.stock();
            (stock.take(), stock.is_low(since))
        };
        if let Some(id) = id {
            // One who comes now waits for more; the others take of what is there.
            if is_low && let Ok(mut failure) = self.drawing.try_lock() {
                self.draw_more(&mut failure).await.unwrap_or_else(|error| {
                    let left = self.stock().left();
                    let error = self.catalogue.why(&error);
                    tracing::warn!(error, left, "when these are used up nobody is let in");
                });
            }
            return Ok(id);
        }
        let mut failure = self.drawing.lock().await;
        if let Some(id) = self.stock().take() {
            return Ok(id);
        }
        if let Some(Failure { why, .. }) = failure.as_ref().filter(|failure| failure.at >= since) {
            return Err(LiveError::Unkept(anyhow::anyhow!("{why}")));
        }
        self.draw_more(&mut failure).await.map_err(LiveError::Unkept)?;
        self.stock().take().ok_or(LiveError::Stopped)
    }

    async fn draw_more(&self, failure: &mut Option<Failure>) -> anyhow::Result<()> {
        let drawn = self.lay_in_more(BLOCK).await;
        *failure = drawn.as_ref().err().map(|error| Failure {
            at: Instant::now(),
            why: format!("{error:#}"),
        });
        drawn
    }

    async fn lay_in_more(&self, many: u32) -> anyhow::Result<()> {
        let drawn = db::in_time(PATIENCE, self.catalogue.draw_mover_ids(many)).await;
        let ObjectId(first) = drawn.context("no ids for new sessions and movers could be drawn from the catalogue")?;
        self.stock().blocks.push_back(first..first + many);
        Ok(())
    }

    fn stock(&self) -> MutexGuard<'_, Stock> {
        self.stock.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use sqlx::{AnyConnection, Connection, Executor};

    use super::*;

    /// A catalogue whose disk may be full.
    struct Disk {
        _data: tempfile::TempDir,
        ids: Ids,
        beside: AnyConnection,
    }

    impl Disk {
        async fn new() -> Self {
            let data = tempfile::tempdir().unwrap();
            let ids = Ids::new(Catalogue::open(data.path()).await.unwrap());
            let file = format!("sqlite:{}?mode=rw", data.path().join(db::FILE_NAME).display());
            let beside = AnyConnection::connect(&file).await.unwrap();
            Self {
                _data: data,
                ids,
                beside,
            }
        }

        async fn is_full(&mut self) {
            let full = "CREATE TRIGGER full BEFORE UPDATE ON mover_ids BEGIN SELECT RAISE(ABORT, 'full'); END";
            self.beside.execute(full).await.unwrap();
        }

        async fn has_room(&mut self) {
            self.beside.execute("DROP TRIGGER full").await.unwrap();
        }

        async fn draw(&self, many: u32) -> BTreeSet<ObjectId> {
            let mut drawn = BTreeSet::new();
            for _ in 0..many {
                assert!(drawn.insert(self.ids.draw().await.unwrap()), "nobody else ever had it");
            }
            drawn
        }
    }

    #[tokio::test]
    async fn who_comes_while_nothing_can_be_kept_is_let_in_by_what_was_laid_in() {
        let mut disk = Disk::new().await;
        disk.ids.lay_in().await.unwrap();
        disk.is_full().await;
        let mut drawn = disk.draw(FIRST).await;
        let error = disk.ids.draw().await.unwrap_err();
        assert!(
            matches!(&error, LiveError::Unkept(cause) if format!("{cause:#}").contains("full")),
            "{error:?}"
        );
        disk.has_room().await;
        drawn.extend(disk.draw(BLOCK).await);
        assert_eq!(drawn.len(), (FIRST + BLOCK) as usize);
    }

    #[tokio::test]
    async fn who_waits_while_the_catalogue_says_nothing_is_refused_with_whoever_asks_it() {
        let mut disk = Disk::new().await;
        disk.beside.execute("BEGIN IMMEDIATE").await.unwrap();
        tokio::time::pause();
        let begun = tokio::time::Instant::now();
        let asked = futures_util::future::join_all((0..100).map(|_| disk.ids.draw())).await;
        assert!(asked.iter().all(|drawn| matches!(drawn, Err(LiveError::Unkept(_)))));
        assert!(begun.elapsed() < 2 * PATIENCE, "nobody waits for all who came before");
        tokio::time::resume();
        disk.beside.execute("ROLLBACK").await.unwrap();
        disk.draw(1).await;
    }

    #[tokio::test]
    async fn more_are_drawn_before_the_last_is_used_up() {
        let mut disk = Disk::new().await;
        disk.ids.lay_in().await.unwrap();
        disk.draw(FIRST - FEW + 1).await;
        disk.is_full().await;
        disk.draw(FEW - 1 + BLOCK).await;
        disk.ids.draw().await.unwrap_err();
    }
}
