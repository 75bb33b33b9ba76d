//! Which nodes speak? One that the catalogue has lost, and that is heard over NATS, lives, and keeps its sessions.

use std::{
    collections::BTreeMap,
    sync::{Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use belvedere_live::nodes::{
    LEASE_MS, NodeId,
    message::{Said, Says},
};

const LEASE: Duration = Duration::from_millis(LEASE_MS.unsigned_abs());

/// When each node was heard last, in any scene.
#[derive(Debug, Default)]
pub(super) struct HeardOf(Mutex<BTreeMap<NodeId, Instant>>);

/// What is known of a node that was to speak after some moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::live) enum Voice {
    /// It has spoken since.
    Speaks,
    /// It spoke shortly before.
    Unsure,
    /// It is not heard.
    Silent,
}

impl HeardOf {
    pub(super) fn note(&self, said: &Said, now: Instant) {
        let mut heard = self.heard();
        if matches!(said.says, Says::Bye) {
            heard.remove(&said.from);
        } else if heard.insert(said.from.clone(), now).is_none() {
            heard.retain(|_, at| now.duration_since(*at) <= LEASE);
        }
    }

    pub(super) fn voice(&self, node: &NodeId, since: Instant, now: Instant) -> Voice {
        match self.heard().get(node) {
            Some(at) if *at > since => Voice::Speaks,
            Some(at) if now.duration_since(*at) <= LEASE => Voice::Unsure,
            Some(_) | None => Voice::Silent,
        }
    }

    fn heard(&self) -> MutexGuard<'_, BTreeMap<NodeId, Instant>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_has_spoken_since_lives_and_who_says_farewell_or_nothing_does_not() {
        let node: NodeId = "a-00000001".parse().unwrap();
        let says = |says| Said {
            from: node.clone(),
            says,
        };
        let (heard, start) = (HeardOf::default(), Instant::now());
        let after = |ms| start + Duration::from_millis(ms);
        assert_eq!(heard.voice(&node, start, start), Voice::Silent);
        heard.note(&says(Says::Again), start);
        assert_eq!(heard.voice(&node, after(1), after(3_500)), Voice::Unsure);
        assert_eq!(heard.voice(&node, after(1), after(3_501)), Voice::Silent);
        heard.note(&says(Says::Again), after(2));
        assert_eq!(heard.voice(&node, after(1), after(3)), Voice::Speaks);
        heard.note(&says(Says::Bye), after(4));
        assert_eq!(heard.voice(&node, after(1), after(5)), Voice::Silent);
    }
}
