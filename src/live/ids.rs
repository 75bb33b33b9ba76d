//! Which ids do new movers and sessions get? Ones that nobody else ever had, on whichever server of the catalogue: a server
//! draws a block of numbers when it has used up the last.

use belvedere_scene::ObjectId;
use tokio::sync::Mutex;

use super::LiveError;
use crate::db::Catalogue;

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
