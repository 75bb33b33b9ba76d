//! Which ids do new movers and sessions get? Ones that nobody else ever had, on whichever server of the catalogue: a server
//! draws a block of numbers when it has used up the last.

use belvedere_live::event::{FIRST_MOVER, SessionId};
use belvedere_scene::ObjectId;
use tokio::sync::Mutex;

use super::LiveError;
use crate::db::Catalogue;

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

#[derive(Debug)]
pub(super) struct Ids {
    catalogue: Catalogue,
    /// The next one, and how many are left.
    block: Mutex<(u32, u32)>,
}

impl Ids {
    pub(super) fn new(catalogue: Catalogue) -> Self {
        Self {
            catalogue,
            block: Mutex::new((0, 0)),
        }
    }

    /// A mover's id; an avatar's is that of its session too.
    pub(super) async fn draw(&self) -> Result<ObjectId, LiveError> {
        let mut block = self.block.lock().await;
        if block.1 == 0 {
            let first = self.catalogue.draw_mover_ids(BLOCK).await;
            *block = (first.map_err(LiveError::Unkept)?.0, BLOCK);
        }
        let (next, left) = *block;
        *block = (next + 1, left - 1);
        Ok(ObjectId(next))
    }
}
