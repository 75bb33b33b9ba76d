//! Was what came ahead worth it? Bytes that were fetched before they could be seen, until they are seen or go.

use std::collections::HashMap;

use super::outcome::{Causes, Ways};
use crate::strategy::{
    file::Key,
    order::{Member, Order},
};

/// What came, and why.
#[derive(Debug, Default)]
pub(super) struct Ledger {
    ahead: HashMap<Key, u64>,
    bytes: Causes,
    pub(super) ways: Ways,
}

impl Ledger {
    /// Documents came.
    pub(super) fn document(&mut self, bytes: u64) {
        self.bytes.needed += bytes;
        self.ways.document_bytes += bytes;
    }

    /// Bytes came that could not be used.
    pub(super) fn failed(&mut self, bytes: u64) {
        self.bytes.failed += bytes;
    }

    /// Files of an order came, so many bytes over the line with so many requests.
    pub(super) fn came(&mut self, order: &Order, bytes: u64, requests: u64) {
        let way = match &order.files[..] {
            [file] if file.name.file_name().ends_with(".pack") => &mut self.ways.packs,
            [_] => &mut self.ways.alone,
            members => {
                self.ways.bundled_files += members.len() as u64;
                &mut self.ways.bundles
            }
        };
        way.requests += requests;
        way.bytes += bytes;
        if !order.wish.cause.is_ahead() {
            self.bytes.needed += bytes;
            return;
        }
        let (all, mut left) = (order.bytes().max(1), bytes);
        for (at, file) in order.files.iter().enumerate() {
            let is_last = at + 1 == order.files.len();
            let share = if is_last {
                left
            } else {
                left.min(bytes * file.bytes / all)
            };
            left -= share;
            *self.ahead.entry(file.name.key()).or_default() += share;
        }
    }

    /// A pack became the files in it, each of which may go by itself.
    pub(super) fn splits(&mut self, pack: Key, members: &[Member]) {
        let Some(bytes) = self.ahead.remove(&pack) else { return };
        let all: u64 = members.iter().map(|member| member.bytes).sum();
        let mut left = bytes;
        for (at, member) in members.iter().enumerate() {
            let is_last = at + 1 == members.len();
            let share = if is_last {
                left
            } else {
                left.min(bytes * member.bytes / all.max(1))
            };
            left -= share;
            *self.ahead.entry(member.key).or_default() += share;
        }
        self.bytes.prefetched_wasted += left;
    }

    /// Files are used for what can be seen now.
    pub(super) fn sees(&mut self, files: &[Key]) {
        for file in files {
            self.bytes.prefetched_used += self.ahead.remove(file).unwrap_or(0);
        }
    }

    /// A file went.
    pub(super) fn goes(&mut self, file: Key) {
        self.bytes.prefetched_wasted += self.ahead.remove(&file).unwrap_or(0);
    }

    /// Why bytes came; what was not seen so far counts as wasted.
    pub(super) fn causes(&self) -> Causes {
        Causes {
            prefetched_wasted: self.bytes.prefetched_wasted + self.ahead.values().sum::<u64>(),
            ..self.bytes
        }
    }
}
