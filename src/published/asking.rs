//! How does somebody who has just published hear that it is served? It asks for the catalogue to be read now, and waits for
//! the reading that began after it has asked.

use std::time::Duration;

use tokio::sync::{mpsc, oneshot};

/// So long a caller waits: a catalogue that is away holds nobody up, and is read when it is back.
const PATIENCE: Duration = Duration::from_secs(1);

/// Asks for readings. Cheap to clone.
#[derive(Debug, Clone)]
pub(super) struct Asking(mpsc::UnboundedSender<oneshot::Sender<()>>);

/// Hears what is asked for.
#[derive(Debug)]
pub(super) struct Asked(mpsc::UnboundedReceiver<oneshot::Sender<()>>);

/// Those who wait for a reading; they go on when this is dropped.
pub(super) struct Waiting(#[allow(dead_code, reason = "dropped")] Vec<oneshot::Sender<()>>);

pub(super) fn asking() -> (Asking, Asked) {
    let (sender, receiver) = mpsc::unbounded_channel();
    (Asking(sender), Asked(receiver))
}

impl Asking {
    pub(super) async fn ask(&self) {
        let (done, read) = oneshot::channel();
        if self.0.send(done).is_ok() {
            _ = tokio::time::timeout(PATIENCE, read).await;
        }
    }
}

impl Asked {
    /// Waits until somebody asks, for so long at most.
    pub(super) async fn wait(&mut self, most: Duration) -> Waiting {
        let mut waiting = Vec::new();
        tokio::select! {
            () = tokio::time::sleep(most) => {}
            Some(first) = self.0.recv() => waiting.push(first),
        }
        while let Ok(next) = self.0.try_recv() {
            waiting.push(next);
        }
        Waiting(waiting)
    }
}
