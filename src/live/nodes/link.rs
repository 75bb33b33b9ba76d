//! What does a scene say to other nodes, and hear of them? One task for each scene, so that the scene's own waits for no
//! wire: what is said waits in a bounded queue, and is dropped when that is full or nobody answers. The exchange finds out
//! and mends that.
//!
//! Cells are listened to before others hear that they are watched, and what is meant for this node alone is read before
//! what is said to cells, so that a mover is introduced before it moves.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{Arc, atomic::Ordering},
    time::{Duration, Instant},
};

use async_nats::{Message as Post, Subscriber};
use belvedere_live::nodes::message::{Letter, Said};
use belvedere_scene::{CellId, Revision, SceneName};
use bytes::Bytes;
use futures_util::{
    StreamExt,
    stream::{SelectAll, select_all},
};
use tokio::sync::{mpsc, watch};
use tokio_util::sync::{CancellationToken, DropGuard};

use super::{Nodes, Present, subject};
use crate::live::message::{Message, StageHandle};

/// So many messages may wait for the wire.
const QUEUE: usize = 1_024;

/// How soon a scene tries again to listen.
const AGAIN: Duration = Duration::from_secs(1);

type Cells = Arc<BTreeSet<CellId>>;

/// A scene's way to other nodes; they cannot be heard any more when it is dropped.
#[derive(Debug)]
pub(in crate::live) struct Link {
    nodes: Nodes,
    scene: SceneName,
    revision: Revision,
    wanted: watch::Sender<Cells>,
    queue: mpsc::Sender<(String, Bytes)>,
}

impl Link {
    /// Begins to listen on behalf of a scene's task.
    pub(in crate::live) fn start(
        nodes: &Nodes,
        scene: &SceneName,
        revision: Revision,
        stage: &StageHandle,
        stopping: &CancellationToken,
    ) -> Self {
        let present = Present { revision, others: 0 };
        nodes.present().insert(scene.clone(), present);
        let (wanted, cells) = watch::channel(Cells::default());
        let (queue, posts) = mpsc::channel(QUEUE);
        let mut listener = Listener {
            nodes: nodes.clone(),
            scene: scene.clone(),
            revision,
            stage: stage.clone(),
            open: BTreeMap::new(),
            cells: SelectAll::new(),
        };
        let stopping = stopping.clone();
        tokio::spawn(stopping.run_until_cancelled_owned(async move {
            let (mut cells, mut posts) = (cells, posts);
            while let Err(error) = listener.run(&mut cells, &mut posts).await {
                tracing::error!(%error, scene = %listener.scene, "other nodes are not heard; tried again soon");
                listener.open.clear();
                listener.cells.clear();
                cells.mark_changed();
                tokio::time::sleep(AGAIN).await;
            }
        }));
        Self {
            nodes: nodes.clone(),
            scene: scene.clone(),
            revision,
            wanted,
            queue,
        }
    }

    /// From now on listens to these cells.
    pub(in crate::live) fn listen_to(&self, cells: &BTreeSet<CellId>) {
        self.wanted.send_if_modified(|wanted| {
            let changed = **wanted != *cells;
            if changed {
                *wanted = Arc::new(cells.clone());
            }
            changed
        });
    }

    /// Says something, if it can be said soon.
    pub(in crate::live) fn send(&self, letter: &Letter) {
        if self.queue.try_send(post(&self.scene, self.revision, letter)).is_err() {
            self.nodes.0.tally.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// A message as it travels.
pub(super) fn post(scene: &SceneName, revision: Revision, letter: &Letter) -> (String, Bytes) {
    let text = serde_json::to_vec(&letter.said).expect("a message holds nothing that JSON cannot say");
    (subject::of(scene, revision, &letter.to), text.into())
}

struct Listener {
    nodes: Nodes,
    scene: SceneName,
    revision: Revision,
    stage: StageHandle,
    /// Cells that are listened to; dropping ends that.
    open: BTreeMap<CellId, DropGuard>,
    cells: SelectAll<futures_util::stream::BoxStream<'static, Post>>,
}

impl Listener {
    async fn run(
        &mut self,
        wanted: &mut watch::Receiver<Cells>,
        posts: &mut mpsc::Receiver<(String, Bytes)>,
    ) -> anyhow::Result<()> {
        let client = self.nodes.0.client.clone();
        let own = subject::node(&self.scene, self.revision, &self.nodes.0.node);
        let own = client.subscribe(own).await?;
        let all = client.subscribe(subject::all(&self.scene, self.revision)).await?;
        let mut ours = select_all([own, all]);
        loop {
            tokio::select! {
                biased;
                changed = wanted.changed() => {
                    if changed.is_err() {
                        return Ok(());
                    }
                    let cells = wanted.borrow_and_update().clone();
                    self.listen_to(&cells).await?;
                }
                Some(post) = ours.next() => self.hear(&post).await,
                Some((subject, bytes)) = posts.recv() => self.say(subject, bytes).await,
                Some(post) = self.cells.next() => self.hear(&post).await,
            }
        }
    }

    async fn listen_to(&mut self, cells: &BTreeSet<CellId>) -> anyhow::Result<()> {
        self.open.retain(|cell, _| cells.contains(cell));
        for cell in cells {
            if !self.open.contains_key(cell) {
                let subject = subject::cell(&self.scene, self.revision, *cell);
                let stream: Subscriber = self.nodes.0.client.subscribe(subject).await?;
                let ended = CancellationToken::new();
                self.cells
                    .push(stream.take_until(ended.clone().cancelled_owned()).boxed());
                self.open.insert(*cell, ended.drop_guard());
            }
        }
        Ok(())
    }

    /// While NATS is away nothing waits for it: what is old by then would be in the way.
    async fn say(&mut self, subject: String, bytes: Bytes) {
        let tally = &self.nodes.0.tally;
        if !*self.nodes.0.connected.borrow() {
            tally.dropped.fetch_add(1, Ordering::Relaxed);
            return;
        }
        let length = bytes.len() as u64;
        match self.nodes.0.client.publish(subject.clone(), bytes).await {
            Ok(()) => {
                tally.sent.fetch_add(1, Ordering::Relaxed);
                tally.sent_bytes.fetch_add(length, Ordering::Relaxed);
            }
            Err(error) => {
                tally.dropped.fetch_add(1, Ordering::Relaxed);
                tracing::warn!(%subject, length, %error, "a message to other nodes is not sent");
            }
        }
    }

    async fn hear(&mut self, post: &Post) {
        self.nodes.0.tally.heard.fetch_add(1, Ordering::Relaxed);
        match serde_json::from_slice::<Said>(&post.payload) {
            Ok(said) => {
                self.nodes.0.heard_of.note(&said, Instant::now());
                let (revision, said) = (self.revision, Box::new(said));
                // A scene whose task has ended hears nothing.
                _ = self.stage.send(Message::Heard { revision, said }).await;
            }
            Err(error) => {
                tracing::warn!(subject = %post.subject, %error, "a message of another node is not understood")
            }
        }
    }
}
