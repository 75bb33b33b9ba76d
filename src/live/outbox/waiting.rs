//! Which poses wait for a reader? The newest of each mover. While those of one tick wait alone, they are held as all sessions
//! hold them that are told the same.

use std::{collections::BTreeMap, sync::Arc};

use belvedere_live::Ms;
use belvedere_scene::ObjectId;
use bytes::Bytes;

use super::told::Said;
use crate::live::poses::{self, Written};

/// Poses that wait.
#[derive(Debug, Default)]
pub(super) enum Waiting {
    #[default]
    None,
    /// Those of one tick, as others are told of them too.
    Shared(Arc<Written>),
    /// The newest of each mover.
    Newest(Box<(Ms, BTreeMap<ObjectId, Bytes>)>),
}

impl Waiting {
    pub(super) fn is_none(&self) -> bool {
        matches!(self, Self::None)
    }

    pub(super) fn add(&mut self, written: &Arc<Written>) {
        if self.is_none() {
            *self = Self::Shared(written.clone());
            return;
        }
        let newest = self.newest();
        newest.0 = written.t_ms;
        newest.1.extend(written.entries.iter().cloned());
    }

    pub(super) fn remove(&mut self, objects: &[ObjectId]) {
        if self.is_none() {
            return;
        }
        let newest = self.newest();
        for object in objects {
            newest.1.remove(object);
        }
        if newest.1.is_empty() {
            *self = Self::None;
        }
    }

    fn newest(&mut self) -> &mut (Ms, BTreeMap<ObjectId, Bytes>) {
        let shared = match self {
            Self::Shared(written) => Some(written.clone()),
            _ => None,
        };
        if !matches!(self, Self::Newest(_)) {
            let all = shared.map(|written| (written.t_ms, written.entries.iter().cloned().collect()));
            *self = Self::Newest(Box::new(all.unwrap_or_default()));
        }
        match self {
            Self::Newest(newest) => newest,
            Self::None | Self::Shared(_) => unreachable!("it was made just now"),
        }
    }

    /// All of them as an event, if there are some.
    pub(super) fn take(&mut self) -> Option<Said> {
        Some(match std::mem::take(self) {
            Self::None => return None,
            Self::Shared(written) => Said::poses(written.data.clone()),
            Self::Newest(newest) => Said::poses(poses::data(newest.0, newest.1.values()).into()),
        })
    }
}
