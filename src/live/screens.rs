//! What do closed doors hide? Proofs take milliseconds, so they are found beside the scene's task, which takes note of each
//! as soon as it is there; one batch at a time for each scene.

use std::sync::Arc;

use belvedere_live::{
    cells::{Cell, Hidden},
    world::Unscreened,
};
use belvedere_scene::{CellId, ObjectId};

use super::message::{Message, StageHandle};
use crate::published::{Blockers, Published, ReadError};

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

/// Answers questions about one revision, and tells the scene's task each answer and the end.
pub(super) fn find(published: Arc<Published>, questions: Vec<Unscreened>, stage: StageHandle) {
    tokio::spawn(async move {
        if let Err(error) = answer(&published, questions, &stage).await {
            tracing::error!(%error, "doors hide nothing: what hides in the scene cannot be read");
        }
        // Who has ended needs no answers.
        _ = stage.send(Message::ScreensFound).await;
    });
}

async fn answer(published: &Arc<Published>, questions: Vec<Unscreened>, stage: &StageHandle) -> Result<(), ReadError> {
    let Some(blockers) = published.reader.blockers().await? else {
        return Ok(());
    };
    for question in questions {
        if !stage.runs() {
            return Ok(());
        }
        let Some(screen) = prove(published, &blockers, question).await else {
            return Ok(());
        };
        _ = stage.send(Message::Screen(screen)).await;
    }
    Ok(())
}

/// `None` when the runtime is about to end.
async fn prove(published: &Arc<Published>, blockers: &Arc<Blockers>, question: Unscreened) -> Option<Screen> {
    let blockers = blockers.clone();
    let proved = tokio::task::spawn_blocking(move || {
        let region = |shape: &Cell| blockers.region(&shape.bounds, &shape.planes);
        let others = question.others.iter().map(|(cell, shape)| (*cell, region(shape)));
        let hidden = blockers.screened(&region(&question.shape), &others.collect::<Vec<_>>(), &question.closed);
        (question, hidden)
    });
    let (question, hidden) = proved.await.ok()?;
    Some(Screen {
        published: published.clone(),
        cell: question.cell,
        closed: question.closed,
        hidden,
    })
}
