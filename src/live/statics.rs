//! What stands around a participant? For clients that read no cells: infos of the objects that can be seen from the
//! participant's cell and that its area of interest reaches, each told once.
//!
//! One task for each session that asked for it, since it reads blobs; it waits while the session has much to hear still, and what it
//! tells stands aside of all else (`super::outbox`).

use std::{collections::BTreeSet, sync::Arc, time::Duration};

use belvedere_live::event::{Event, Told};
use belvedere_scene::ObjectId;
use tokio::sync::watch;

use super::outbox::Outbox;
use crate::published::{Published, ReadError};

/// From where, and how far, a session looks.
#[derive(Debug, Clone)]
pub(super) struct View {
    pub(super) published: Arc<Published>,
    pub(super) closed: Vec<ObjectId>,
    pub(super) position: [f64; 3],
    pub(super) enter_m: f64,
    /// What was told in an earlier round is void.
    pub(super) round: u64,
}

impl View {
    /// The scene was published anew, with all doors open.
    pub(super) fn turn_to(&mut self, published: Arc<Published>) {
        self.published = published;
        self.closed.clear();
        self.round += 1;
    }
}

/// Between two looks.
const PAUSE: Duration = Duration::from_millis(250);

/// Tells a session what comes into view until nobody changes the view any more.
pub(super) async fn tell(mut view: watch::Receiver<View>, outbox: Arc<Outbox>) {
    let (mut round, mut told) = (0, BTreeSet::new());
    loop {
        let now = view.borrow_and_update().clone();
        if now.round != round {
            (round, told) = (now.round, BTreeSet::new());
        }
        match in_view(&now).await {
            Ok(infos) => {
                for info in infos {
                    if !told.insert(info.info.object) {
                        continue;
                    }
                    while !outbox.has_room() && view.has_changed().is_ok() {
                        tokio::time::sleep(PAUSE).await;
                    }
                    // Nobody changes the view while this is told.
                    let current = view.borrow();
                    if current.round != round {
                        break;
                    }
                    outbox.push(&Event::ObjectInfo(Box::new(info)));
                }
            }
            Err(error) => tracing::error!(%error, "cannot read what stands around a participant"),
        }
        tokio::time::sleep(PAUSE).await;
        if view.changed().await.is_err() {
            return;
        }
    }
}

async fn in_view(view: &View) -> Result<Vec<Told>, ReadError> {
    let reader = &view.published.reader;
    let Some(located) = reader.cell_at(view.position).await? else {
        return Ok(Vec::new());
    };
    let page = reader
        .visible(located.cell.cell, &view.closed, None, usize::MAX)
        .await?;
    let seen = page.map_or_else(Vec::new, |page| page.objects);
    let near = seen.into_iter().map(|seen| seen.info);
    let near = near.filter(|info| info.bounds.distance_m(view.position) <= view.enter_m);
    let told = near.map(|info| Told {
        info: info.into(),
        moving: None,
    });
    Ok(told.collect())
}
