//! What do closed doors hide? Proofs take milliseconds, so they are found beside the scene's task, which takes note of each
//! as soon as it is there; one at a time for each scene, so that each question is of how doors stand when its turn has come.

use std::{sync::Arc, time::Instant};

use belvedere_live::{
    cells::{Cell, Hidden},
    world::Unscreened,
};
use belvedere_scene::{CellId, ObjectId, Revision};

use super::message::{Message, StageHandle};
use crate::{
    published::{Published, ReadError},
    seldom::Seldom,
};

/// What cannot be seen from a cell.
#[derive(Debug)]
pub(super) struct Screen {
    /// The revision that the cells are of.
    pub(super) published: Arc<Published>,
    pub(super) cell: CellId,
    /// While these doors are closed.
    pub(super) closed: Vec<ObjectId>,
    pub(super) hidden: Vec<Hidden>,
}

/// Answers a question about one revision, and tells the scene's task.
pub(super) fn find(published: Arc<Published>, question: Unscreened, stage: StageHandle) {
    tokio::spawn(async move {
        let revision = published.pointer.revision;
        let screen = answer(published, question).await;
        // Who has ended needs no answer.
        _ = stage.send(Message::Screen { revision, screen }).await;
    });
}

/// Of which revision it was told that what hides in it cannot be read. Each question finds that anew, and the log need not say so each
/// time: it does once of each revision, and seldom of many.
#[derive(Debug, Default)]
pub(super) struct Unreadable {
    of: Option<Revision>,
    told: Seldom<()>,
}

impl Unreadable {
    /// Whether that is to be told now.
    pub(super) fn is_news(&mut self, revision: Revision, now: Instant) -> bool {
        let is_news = self.of != Some(revision) && self.told.is_due((), now);
        if is_news {
            self.of = Some(revision);
        }
        is_news
    }
}

/// `None` when nothing hides in the scene, or the runtime is about to end.
async fn answer(published: Arc<Published>, question: Unscreened) -> Result<Option<Screen>, ReadError> {
    let Some(blockers) = published.reader.blockers().await? else {
        return Ok(None);
    };
    let proved = tokio::task::spawn_blocking(move || {
        let region = |shape: &Cell| blockers.region(&shape.bounds, &shape.planes);
        let others = question.others.iter().map(|(cell, shape)| (*cell, region(shape)));
        let hidden = blockers.screened(&region(&question.shape), &others.collect::<Vec<_>>(), &question.closed);
        Screen {
            published,
            cell: question.cell,
            closed: question.closed,
            hidden,
        }
    });
    Ok(proved.await.ok())
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn that_screens_cannot_be_read_is_told_once_of_each_revision_and_seldom() {
        let (mut told, start) = (Unreadable::default(), Instant::now());
        let after = |s| start + Duration::from_secs(s);
        let [old, new] = [[1; 8], [2; 8]].map(Revision);
        assert!(told.is_news(old, start));
        assert!([1, 100, 100_000].iter().all(|s| !told.is_news(old, after(*s))));
        assert!(told.is_news(new, after(100_001)));
        assert!(!told.is_news(old, after(100_002)), "they take turns");
        assert!(told.is_news(old, after(100_061)));
    }
}
