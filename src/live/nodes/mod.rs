//! How do the nodes of a scene reach each other? Over NATS, whose subjects carry what [`belvedere_live::nodes`] has to say.
//!
//! * [`Nodes`]: this server's connection, and what has gone through it.
//! * [`Link`]: what one scene says and hears. `heard`: which nodes speak at all.
//! * `settings`: where that is. `subject`: which subject is whose.

mod heard;
mod link;
mod settings;
mod subject;

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

use anyhow::Context;
use async_nats::{Client, ConnectErrorKind, ConnectOptions, Event};
use belvedere_live::nodes::{BEAT_MS, Exchange, LEASE_MS, NodeId};
use belvedere_scene::{Revision, SceneName};
use tokio::sync::watch;

use self::heard::HeardOf;
pub use self::settings::{NatsAddress, NodeName, NodeSettings, NotANodeName, NotNats};
pub(super) use self::{heard::Voice, link::Link};
use super::Clock;

/// The client asks NATS so often whether it is there, and is cut off at the third time without an answer: before anybody else
/// can be missed, since what is not heard is not gone.
const PING: Duration = Duration::from_millis(700);
const _: () = assert!(
    3 * PING.as_millis() < (LEASE_MS - BEAT_MS) as u128,
    "others would have left before"
);
/// Between two attempts to come back; longer after each one, up to so many times.
const AGAIN: Duration = Duration::from_millis(250);
const LONGEST_AGAIN: usize = 8;
/// So many messages of one subject may wait to be heard.
const WAITING: usize = 4_096;
/// How long the last words may take.
const LAST_WORDS: Duration = Duration::from_secs(1);

/// One node among others. Cheap to clone.
#[derive(Debug, Clone)]
pub struct Nodes(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    node: NodeId,
    client: Client,
    connected: watch::Receiver<bool>,
    /// Where it is known, and in which revision.
    present: Mutex<BTreeMap<SceneName, Present>>,
    heard_of: HeardOf,
    tally: Tally,
}

#[derive(Debug, Clone, Copy)]
struct Present {
    revision: Revision,
    /// How many others are there.
    others: usize,
}

/// What has been counted since the start.
#[derive(Debug, Default)]
struct Tally {
    sent: AtomicU64,
    sent_bytes: AtomicU64,
    heard: AtomicU64,
    dropped: AtomicU64,
}

/// How it stands between this node and others, and what has been counted since the start.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct NodeCounts {
    /// NATS answers.
    pub connected: bool,
    /// Other nodes, in the scene where there are most.
    pub others: usize,
    /// Messages to other nodes.
    pub sent: u64,
    /// Their bytes.
    pub sent_bytes: u64,
    /// Messages of other nodes.
    pub heard: u64,
    /// Messages that could not wait any longer.
    pub dropped: u64,
}

impl Nodes {
    /// Begins to connect, and goes on trying in the background: a server starts without NATS too.
    ///
    /// # Errors
    /// When the system gives no random numbers, or the settings cannot work.
    pub async fn join(settings: &NodeSettings) -> anyhow::Result<Self> {
        let mut number = [0; 4];
        getrandom::fill(&mut number).context("the system gives no random numbers")?;
        let node = NodeName::run(settings.name.as_ref(), u32::from_le_bytes(number));
        let (answers, connected) = watch::channel(false);
        let told = Mutex::default();
        let options = ConnectOptions::new()
            .name(node.to_string())
            .no_echo()
            .ping_interval(PING)
            .subscription_capacity(WAITING)
            .reconnect_delay_callback(|attempts| AGAIN * attempts.clamp(1, LONGEST_AGAIN) as u32)
            .retry_on_initial_connect()
            .event_callback(move |event| {
                note(&answers, &told, &event);
                std::future::ready(())
            });
        let client = options.connect(settings.nats.servers()).await;
        let client = client.with_context(|| format!("`nats` cannot be used: {}", settings.nats))?;
        tracing::info!(%node, nats = %settings.nats, "joins other nodes");
        Ok(Self(Arc::new(Inner {
            node,
            client,
            connected,
            present: Mutex::default(),
            heard_of: HeardOf::default(),
            tally: Tally::default(),
        })))
    }

    /// Whether NATS answers; it may be waited for that this changes.
    pub(super) fn connected(&self) -> watch::Receiver<bool> {
        self.0.connected.clone()
    }

    /// What this run of the server is called.
    pub(super) fn id(&self) -> &NodeId {
        &self.0.node
    }

    /// Whether a node has spoken since some moment.
    pub(super) fn voice(&self, node: &NodeId, since: Instant) -> Voice {
        self.0.heard_of.voice(node, since, Instant::now())
    }

    /// This node in a scene.
    pub(super) fn exchange(&self, clock: Clock) -> Exchange {
        Exchange::new(self.0.node.clone(), clock.now_ms())
    }

    /// How it stands.
    #[must_use]
    pub fn counts(&self) -> NodeCounts {
        let tally = &self.0.tally;
        let present = self.present();
        NodeCounts {
            connected: *self.0.connected.borrow(),
            others: present.values().map(|present| present.others).max().unwrap_or(0),
            sent: tally.sent.load(Ordering::Relaxed),
            sent_bytes: tally.sent_bytes.load(Ordering::Relaxed),
            heard: tally.heard.load(Ordering::Relaxed),
            dropped: tally.dropped.load(Ordering::Relaxed),
        }
    }

    /// Takes note of how many others are in a scene.
    pub(super) fn count_others(&self, scene: &SceneName, others: usize) {
        if let Some(present) = self.present().get_mut(scene) {
            present.others = others;
        }
    }

    /// Tells everybody that this node goes, so that nobody waits for it.
    pub async fn leave(&self) {
        let present: Vec<_> = self
            .present()
            .iter()
            .map(|(scene, at)| (scene.clone(), at.revision))
            .collect();
        let words = async {
            for (scene, revision) in present {
                let bye = Exchange::new(self.0.node.clone(), 0).bye();
                let (subject, bytes) = link::post(&scene, revision, &bye);
                // Who cannot be told finds out.
                _ = self.0.client.publish(subject, bytes).await;
            }
            _ = self.0.client.flush().await;
        };
        if *self.0.connected.borrow() {
            _ = tokio::time::timeout(LAST_WORDS, words).await;
        }
    }

    fn present(&self) -> std::sync::MutexGuard<'_, BTreeMap<SceneName, Present>> {
        self.0.present.lock().expect("nobody panics while holding this lock")
    }
}

/// Something has become of the connection. Only changes are logged, and no addresses: each reason why NATS cannot be reached
/// once until it answers, however often it is asked.
fn note(answers: &watch::Sender<bool>, told: &Mutex<BTreeSet<String>>, event: &Event) {
    let mut told = told.lock().unwrap_or_else(PoisonError::into_inner);
    let change = match event {
        Event::Connected => Some(true),
        Event::Disconnected | Event::Closed => Some(false),
        Event::ClientError(error) => {
            let text = error.to_string();
            let refused = [
                ConnectErrorKind::AuthorizationViolation,
                ConnectErrorKind::Authentication,
            ];
            let refused = refused.iter().any(|kind| text.ends_with(&kind.to_string()));
            if !told.insert(text) {
                return;
            }
            if refused {
                tracing::warn!(%error, "NATS refuses this node: look at the user and password in `nats`; sessions go on within it");
            } else {
                tracing::info!(%error, "NATS cannot be reached: sessions go on within this node");
            }
            None
        }
        Event::SlowConsumer(_) => {
            tracing::debug!("messages of other nodes came too fast; what is missing is asked for again");
            None
        }
        _ => None,
    };
    if let Some(connected) = change.filter(|connected| *connected != *answers.borrow()) {
        answers.send_replace(connected);
        if connected {
            told.clear();
            tracing::info!("NATS answers");
        } else {
            tracing::info!("NATS is away: sessions go on within this node");
        }
    }
}
