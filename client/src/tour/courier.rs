//! What comes over the line, and when? Requests of one visitor: fetched for real, charged to a simulated line, and here when
//! they would have come.

use std::collections::{HashSet, VecDeque};

use bytes::Bytes;

use super::{
    ledger::Ledger,
    line::{HEADER_BYTES, Line, Traffic, Transfer},
    metered::{Answer, Metered},
    outcome::Tour,
    streams::Streams,
};
use crate::{
    ByteSource, Error, Scene,
    fetch::{self, Fetched, Manners},
    strategy::{
        file::{FileName, FileRef, Key},
        meter::Meter,
        order::{Member, Order},
        planner::Planner,
    },
};

/// A request that fails takes at least so long.
const FAILURE_MS: f64 = 1.0;

/// A request whose answer is on the line.
struct UnderWay {
    there_ms: f64,
    /// What it was expected to take on the line.
    line_bytes: f64,
    /// Files of so many bytes, or of which none came, and when they are here, in this order.
    came: VecDeque<(f64, FileRef, Option<u64>)>,
    /// The files in a pack that are not here yet, in the order in which the line carries them.
    members: VecDeque<(f64, Key, Member)>,
}

impl UnderWay {
    /// When more of it is here.
    fn next_ms(&self) -> f64 {
        let member = self.members.front().map(|(there_ms, ..)| *there_ms);
        let file = self.came.front().map(|(there_ms, ..)| *there_ms);
        [member, file].into_iter().flatten().fold(self.there_ms, f64::min)
    }
}

/// What came.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Received {
    /// Anything, or the news that it cannot be had.
    pub(super) any: bool,
    /// Something cannot be had …
    pub(super) lost: bool,
    /// … of which models were to grow.
    pub(super) lost_rules: bool,
}

/// Fetches for one visitor.
pub(super) struct Courier<'a, S> {
    scene: &'a Scene<Metered<S>>,
    traffic: Traffic,
    meter: Meter,
    manners: Manners,
    streams: Streams,
    under_way: Vec<UnderWay>,
    /// When answers are here, and how large they are, in the order in which they come.
    arriving: VecDeque<(f64, u64)>,
    arrived_bytes: u64,
    /// Files that could not be had or read, documents apart.
    lost: HashSet<Key>,
    /// Whether something of the revision was gone since somebody last asked.
    missed: bool,
    pub(super) ledger: Ledger,
    pub(super) tour: Tour,
}

impl<'a, S: ByteSource> Courier<'a, S> {
    pub(super) fn on(line: Line, scene: &'a Scene<Metered<S>>) -> Self {
        Self {
            scene,
            traffic: Traffic::on(line),
            meter: Meter::default(),
            manners: Manners::default(),
            streams: Streams::default(),
            under_way: Vec::new(),
            arriving: VecDeque::new(),
            arrived_bytes: 0,
            lost: HashSet::new(),
            missed: false,
            ledger: Ledger::default(),
            tour: Tour::default(),
        }
    }

    pub(super) fn bytes_per_s(&self) -> f64 {
        self.meter.bytes_per_s()
    }

    /// Whether one more request may be under way.
    pub(super) fn has_room(&self) -> bool {
        let bytes = self.under_way.iter().map(|one| one.line_bytes).sum();
        self.meter.has_room(self.under_way.len(), bytes)
    }

    pub(super) fn offers_bundles(&self) -> bool {
        self.scene.source().offers_bundles() && !self.manners.bundles_refused()
    }

    /// When the next answer is here, or the next file in a pack.
    pub(super) fn next_ms(&self) -> f64 {
        self.under_way
            .iter()
            .map(UnderWay::next_ms)
            .fold(f64::INFINITY, f64::min)
    }

    /// Bytes of all answers that are here by a time; asked for times that only grow.
    pub(super) fn arrived_bytes(&mut self, now_ms: f64) -> u64 {
        while let Some((_, bytes)) = self.arriving.pop_front_if(|(there_ms, _)| *there_ms <= now_ms) {
            self.arrived_bytes += bytes;
        }
        self.arrived_bytes
    }

    /// Takes note of what went wrong.
    pub(super) fn fail(&mut self, cause: &Error) {
        self.missed |= matches!(cause, Error::Missing(_));
        self.tour.tell(cause);
    }

    /// Whether something of the revision was found to be gone; told once.
    pub(super) fn has_missed(&mut self) -> bool {
        std::mem::take(&mut self.missed) | self.scene.has_missed()
    }

    /// What became of all.
    pub(super) async fn end(self) -> Tour {
        let lost_files = self.lost.len() + self.scene.lost_documents().await;
        Tour {
            bytes: self.ledger.causes(),
            ways: self.ledger.ways,
            lost_files: lost_files as u64,
            ..self.tour
        }
    }

    /// Lets all documents that were fetched since come over the line, asked for at this time; says when the last is there.
    pub(super) fn charge(&mut self, asked_ms: f64) -> f64 {
        let mut there_ms = asked_ms;
        for answer in self.scene.source().take() {
            there_ms = self.answered(asked_ms, answer).there_ms;
            self.ledger.document(answer.bytes);
        }
        there_ms
    }

    /// A request was answered: first with what came in vain, if anything did, then with what came in the end.
    fn answered(&mut self, asked_ms: f64, answer: Answer) -> Transfer {
        self.tour.requests += 1;
        self.tour.latencies_ms.push(1000.0 * answer.took.as_secs_f64());
        if answer.failed > 0 {
            self.ledger.failed(answer.failed);
            let transfer = self.send(asked_ms, answer.failed);
            if answer.bytes == 0 {
                return transfer;
            }
        }
        self.send(asked_ms, answer.bytes)
    }

    fn send(&mut self, asked_ms: f64, body_bytes: u64) -> Transfer {
        let transfer = self.traffic.send(asked_ms, body_bytes);
        self.arriving.push_back((transfer.there_ms, body_bytes));
        let bytes = (body_bytes + HEADER_BYTES) as f64;
        self.meter.came(asked_ms / 1000.0, transfer.there_ms / 1000.0, bytes);
        transfer
    }

    /// Carries out a request at a time.
    pub(super) async fn fetch(&mut self, order: &Order, planner: &mut Planner, now_ms: f64) {
        // All of it is here at once; when which part of it would have come is computed.
        let streams = |rung: &_| planner.stream_of(rung);
        let fetched = fetch::fetch(self.scene, &self.manners, order, streams, &mut |_, _| {}).await;
        let (mut transfer, mut bytes, mut requests) = (Transfer::at(now_ms), 0, 0);
        let mut bundle = None;
        let mut saved = fetched.saved;
        for mut answer in self.scene.source().take() {
            // Of a bundle that broke off, this came all the same.
            let of_use = std::mem::take(&mut saved).min(answer.failed);
            (answer.bytes, answer.failed) = (answer.bytes + of_use, answer.failed - of_use);
            transfer = self.answered(now_ms, answer);
            bundle.get_or_insert(transfer);
            (bytes, requests) = (bytes + answer.bytes, requests + 1);
        }
        let Fetched {
            files,
            shares,
            beside,
            mut failed,
            notes,
            ..
        } = fetched;
        notes.iter().for_each(|note| self.tour.tell(note));
        let mut there_ms = transfer.there_ms;
        if files.iter().any(|(_, result)| result.is_err()) {
            // Whatever comes of it, who fails does not fail again at the same moment.
            there_ms = there_ms.max(now_ms + FAILURE_MS);
        }
        let mut came = Vec::with_capacity(files.len() + beside.len());
        for ((file, result), share) in files.into_iter().zip(shares) {
            let length = result.as_ref().map_or(0, |bytes| bytes.len() as u64);
            let result = result.and_then(|bytes| self.check(&file, bytes, planner));
            match &result {
                Err(cause) => {
                    failed += length;
                    self.lose(&file, cause, planner);
                }
                Ok(_) => {
                    self.lost.remove(&file.name.key());
                }
            }
            let file_ms = share.and_then(|share| Some(bundle?.share_ms(share)));
            came.push((file_ms.unwrap_or(there_ms), file, result.ok()));
        }
        for (file, content) in beside {
            let length = content.len() as u64;
            let is_right = self.check(&file, content, planner).is_ok();
            match is_right && planner.welcomes(&file) {
                true => came.push((there_ms, file, Some(length))),
                false => failed += length,
            }
        }
        let failed = failed.min(bytes);
        self.ledger.failed(failed);
        self.ledger.came(order, bytes - failed, requests);
        let members = match &came[..] {
            [(_, pack, Some(bytes))] => self.unpack(pack.name.key(), *bytes, transfer, planner),
            _ => VecDeque::new(),
        };
        came.sort_by(|a, b| a.0.total_cmp(&b.0));
        self.under_way.push(UnderWay {
            there_ms,
            line_bytes: order.line_bytes(),
            came: came.into(),
            members,
        });
    }

    /// A file does not come. Where a server gives no parts of streams, nothing is lost that levels cannot take the place of.
    fn lose(&mut self, file: &FileRef, cause: &Error, planner: &mut Planner) {
        match (cause, &file.name) {
            (Error::Whole(_), FileName::Rung(rung)) => planner.lose_stream_of(rung.hash),
            _ => {
                self.lost.insert(file.name.key());
                self.fail(cause);
            }
        }
    }

    /// When those files are here that are missing of a pack of so many bytes, if it is one: each when the line has carried the share of
    /// the pack up to where it ends, as if all of a pack shrank alike.
    fn unpack(&mut self, pack: Key, bytes: u64, transfer: Transfer, planner: &Planner) -> VecDeque<(f64, Key, Member)> {
        let mut members = planner.members_of(pack);
        members.retain(|member| !planner.is_here(member.key));
        if !members.is_empty() {
            self.ledger.splits(pack, &members);
        }
        let share = |member: &Member| (member.to() as f64 / bytes as f64).min(1.0);
        members.sort_by_key(Member::to);
        let times = members.iter().map(|member| transfer.share_ms(share(member)));
        times
            .zip(&members)
            .map(|(there_ms, member)| (there_ms, pack, *member))
            .collect()
    }

    /// The length of what came; a stream whose last rung it is must be what its name promises.
    fn check(&mut self, file: &FileRef, bytes: Bytes, planner: &mut Planner) -> Result<u64, Error> {
        let length = bytes.len() as u64;
        if let FileName::Rung(rung) = &file.name
            && let Some(model) = planner.model_of_stream(rung.hash).cloned()
            && self.streams.take(rung, &bytes, &model) == Some(false)
        {
            planner.lose_stream(&model);
            self.scene.source().forget_parts(&rung.whole());
            return Err(Error::Stream(rung.whole()));
        }
        Ok(length)
    }

    /// Hands over what is here by a time.
    pub(super) fn receive(&mut self, planner: &mut Planner, now_ms: f64) -> Received {
        let mut received = Received::default();
        for one in &mut self.under_way {
            while let Some((_, pack, member)) = one.members.pop_front_if(|(there_ms, ..)| *there_ms <= now_ms) {
                received.any |= planner.arrive_out_of(pack, &member);
            }
        }
        let mut here = Vec::new();
        for one in &mut self.under_way {
            while let Some((_, file, length)) = one.came.pop_front_if(|(there_ms, ..)| *there_ms <= now_ms) {
                here.push((file, length));
            }
        }
        self.under_way.retain(|one| one.there_ms > now_ms);
        received.any |= !here.is_empty();
        for (file, length) in here {
            match length {
                Some(bytes) => {
                    let members = planner.arrive(&file, bytes);
                    if !members.is_empty() {
                        self.ledger.splits(file.name.key(), &members);
                    }
                }
                None => {
                    planner.residency.lose(file.name.key());
                    received.lost = true;
                    received.lost_rules |= file.is_rules();
                }
            }
        }
        received
    }
}

#[cfg(test)]
mod tests;
