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
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

use anyhow::Context;
use async_nats::{Client, ConnectError, ConnectErrorKind, ConnectOptions, Event};
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
/// So long is waited for NATS by whoever asks whether it is there.
const PATIENCE: Duration = Duration::from_secs(5);
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
        let told = Arc::new(Told::default());
        let nats = settings.nats.clone();
        let options = settings
            .nats
            .log_in(ConnectOptions::new())
            .name(node.to_string())
            .no_echo()
            .ping_interval(PING)
            .subscription_capacity(WAITING)
            .reconnect_delay_callback(|attempts| AGAIN * attempts.clamp(1, LONGEST_AGAIN) as u32)
            .retry_on_initial_connect()
            .event_callback(move |event| {
                if note(&answers, &told, &event) {
                    tokio::spawn(tell_why(nats.clone(), event, told.clone()));
                }
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

    /// Whether NATS is there and takes the login; says nothing to anybody.
    ///
    /// # Errors
    /// When it does not, within seconds.
    pub async fn reach(nats: &NatsAddress) -> anyhow::Result<()> {
        let asking = async {
            let client = once(nats).await?;
            client.flush().await.map_err(anyhow::Error::from)
        };
        let answer = tokio::time::timeout(PATIENCE, asking).await;
        let answer = answer.unwrap_or_else(|_| anyhow::bail!("no answer within {PATIENCE:?}"));
        answer.map_err(|error| {
            let refused = error
                .downcast_ref()
                .is_some_and(|error: &ConnectError| is_refusal(&error.kind()));
            let way_out = if refused { "; look at its user and password" } else { "" };
            error.context(format!("`nats` cannot be reached: {nats}{way_out}"))
        })
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

    fn present(&self) -> MutexGuard<'_, BTreeMap<SceneName, Present>> {
        self.0.present.lock().expect("nobody panics while holding this lock")
    }
}

/// Reasons why NATS cannot be reached that were told since it answered last. The client names kinds of events, several of which may
/// have the same cause.
#[derive(Debug, Default)]
struct Told(Mutex<BTreeSet<String>>);

impl Told {
    /// Whether it was not told so far; from now on it was.
    fn is_new(&self, reason: &impl ToString) -> bool {
        self.reasons().insert(reason.to_string())
    }

    fn reasons(&self) -> MutexGuard<'_, BTreeSet<String>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Something has become of the connection. Only changes are logged, and no addresses: each kind of reason why NATS cannot be
/// reached once until it answers, however often it is asked. Says whether the reason is still to be told.
fn note(answers: &watch::Sender<bool>, told: &Told, event: &Event) -> bool {
    let change = match event {
        Event::Connected => Some(true),
        Event::Disconnected | Event::Closed => Some(false),
        Event::ClientError(error) => return told.is_new(error),
        Event::SlowConsumer(_) => {
            tracing::debug!("messages of other nodes came too fast; what is missing is asked for again");
            None
        }
        _ => None,
    };
    if let Some(connected) = change.filter(|connected| *connected != *answers.borrow()) {
        answers.send_replace(connected);
        if connected {
            told.reasons().clear();
            tracing::info!("NATS answers");
        } else {
            tracing::info!("NATS is away: sessions go on within this node");
        }
    }
    false
}

/// Tells why NATS cannot be reached, unless that was told.
async fn tell_why(nats: NatsAddress, event: Event, told: Arc<Told>) {
    match new_reason(&nats, &told).await {
        Some(error) if is_refusal(&error.kind()) => {
            tracing::warn!(%error, "NATS refuses this node: look at the user and password in `nats`; sessions go on within it");
        }
        Some(error) => tracing::info!(%error, "NATS cannot be reached: sessions go on within this node"),
        None => {
            tracing::debug!(error = %event, "NATS could not be reached for a moment, or for a reason that was told")
        }
    }
}

/// Why NATS cannot be reached, if it cannot and that was not told. The client's event names but the kind of error: one attempt more
/// has its causes.
async fn new_reason(nats: &NatsAddress, told: &Told) -> Option<ConnectError> {
    let error = once(nats).await.err()?;
    told.is_new(&error).then_some(error)
}

/// One attempt to connect.
async fn once(nats: &NatsAddress) -> Result<Client, ConnectError> {
    let options = nats.log_in(ConnectOptions::new().ignore_discovered_servers());
    options.connect(nats.servers()).await
}

fn is_refusal(kind: &ConnectErrorKind) -> bool {
    matches!(
        kind,
        ConnectErrorKind::AuthorizationViolation | ConnectErrorKind::Authentication
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn kinds_of_errors_that_have_one_cause_are_told_once_until_nats_answers() {
        let (answers, _connected) = watch::channel(false);
        let nobody = std::net::TcpListener::bind("127.0.0.1:0")
            .unwrap()
            .local_addr()
            .unwrap();
        let (nats, told): (NatsAddress, _) = (format!("nats://{nobody}").parse().unwrap(), Told::default());
        let kinds = ["timed out", "IO error", "timed out"].map(|kind| {
            let error = async_nats::ClientError::Other(kind.to_owned());
            note(&answers, &told, &Event::ClientError(error))
        });
        assert_eq!(kinds, [true, true, false]);
        let reason = new_reason(&nats, &told).await.map(|error| error.kind());
        assert_eq!(reason, Some(ConnectErrorKind::Io));
        assert!(new_reason(&nats, &told).await.is_none(), "it was told");
        note(&answers, &told, &Event::Connected);
        assert!(new_reason(&nats, &told).await.is_some());
    }
}
