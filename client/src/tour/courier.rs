//! What comes over the line, and when? Requests of one visitor: fetched for real, charged to a simulated line, and here when
//! they would have come.

use std::collections::{HashSet, VecDeque};

use belvedere_scene::rung::RungName;
use bytes::Bytes;

use super::{
    ledger::Ledger,
    line::{HEADER_BYTES, Line, Traffic, Transfer},
    metered::{Answer, Metered},
    outcome::Tour,
};
use crate::{
    ByteSource, Error, Scene,
    fetch::{self, Manners, Streams},
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
    came: Vec<(FileRef, Option<u64>)>,
    /// The files in a pack that are not here yet, in the order in which the line carries them.
    members: VecDeque<(f64, Key, Member)>,
}

impl UnderWay {
    /// When more of it is here.
    fn next_ms(&self) -> f64 {
        self.members.front().map_or(self.there_ms, |(there_ms, ..)| *there_ms)
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
            there_ms = self.send(asked_ms, answer).there_ms;
            self.ledger.document(answer.bytes);
        }
        there_ms
    }

    fn send(&mut self, asked_ms: f64, answer: Answer) -> Transfer {
        self.tour.requests += 1;
        self.tour.latencies_ms.push(1000.0 * answer.took.as_secs_f64());
        let transfer = self.traffic.send(asked_ms, answer.bytes);
        self.arriving.push_back((transfer.there_ms, answer.bytes));
        let bytes = (answer.bytes + HEADER_BYTES) as f64;
        self.meter.came(asked_ms / 1000.0, transfer.there_ms / 1000.0, bytes);
        transfer
    }

    /// Carries out a request at a time.
    pub(super) async fn fetch(&mut self, order: &Order, planner: &mut Planner, now_ms: f64) {
        let ends = |rung: &RungName| {
            let smooth = planner.model_of_stream(rung.hash)?.smooth.as_ref()?;
            smooth.rungs.get(usize::from(rung.number)).map(|rung| rung.to)
        };
        // All of it is here at once; when which part of it would have come is computed.
        let fetched = fetch::fetch(self.scene, &self.manners, order, ends, &mut |_, _| {}).await;
        let (mut transfer, mut bytes, mut requests) = (Transfer::at(now_ms), 0, 0);
        for answer in self.scene.source().take() {
            transfer = self.send(now_ms, answer);
            (bytes, requests) = (bytes + answer.bytes, requests + 1);
        }
        self.ledger.came(order, bytes, requests);
        let mut there_ms = transfer.there_ms;
        if fetched.files.iter().any(|(_, result)| result.is_err()) {
            // Whatever comes of it, who fails does not fail again at the same moment.
            there_ms = there_ms.max(now_ms + FAILURE_MS);
        }
        let mut came = Vec::with_capacity(fetched.files.len());
        for (file, result) in fetched.files {
            let result = result.and_then(|bytes| self.check(&file, bytes, planner));
            match &result {
                Err(cause) => {
                    self.lost.insert(file.name.key());
                    self.fail(cause);
                }
                Ok(_) => {
                    self.lost.remove(&file.name.key());
                }
            }
            came.push((file, result.ok()));
        }
        let members = match &came[..] {
            [(pack, Some(bytes))] => self.unpack(pack.name.key(), *bytes, transfer, planner),
            _ => VecDeque::new(),
        };
        self.under_way.push(UnderWay {
            there_ms,
            line_bytes: order.line_bytes(),
            came,
            members,
        });
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
            && self.streams.take(rung, bytes, &model) == Some(false)
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
        let all = std::mem::take(&mut self.under_way);
        let (here, coming): (Vec<_>, Vec<_>) = all.into_iter().partition(|one| one.there_ms <= now_ms);
        self.under_way = coming;
        received.any |= !here.is_empty();
        for (file, length) in here.iter().flat_map(|one| &one.came) {
            match length {
                Some(bytes) => {
                    let members = planner.arrive(file, *bytes);
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
mod tests {
    use super::*;
    use crate::{
        strategy::{
            order::{Budgets, View},
            sight::Eye,
        },
        testing::{self, Bare, packed},
    };

    #[tokio::test]
    async fn files_in_a_pack_are_here_when_the_line_has_carried_the_pack_up_to_where_they_end() {
        let packed = packed(&[&[1; 150], &[2; 300], &[3; 150]]);
        let line = Line {
            bits_per_s: 8000.0,
            latency_ms: 100.0,
        };
        let tree = Bare::new().with(&packed.pack, packed.bytes.clone());
        let scene = testing::open(Metered::new(tree)).await;
        scene.source().take();
        for memory_bytes in [u64::MAX, 1_000] {
            let mut courier = Courier::on(line, &scene);
            let mut planner = Planner::new(Budgets {
                memory_bytes,
                ..Budgets::default()
            });
            let view = View {
                eye: Eye::at([0.0; 3]),
                here: &packed.seen,
                is_all_known: true,
                ahead: Vec::new(),
            };
            planner.plan(&view, f64::INFINITY);
            let order = planner.next(&mut Vec::new()).expect("a pack");
            courier.fetch(&order, &mut planner, 0.0).await;
            // 600 bytes and 400 of headers take a second, from 100 ms on.
            let mut came = Vec::new();
            while courier.next_ms() < f64::INFINITY {
                let now_ms = courier.next_ms();
                assert!(!courier.receive(&mut planner, now_ms - 1.0).any);
                assert!(courier.receive(&mut planner, now_ms).any);
                came.push((now_ms, planner.settle().len()));
            }
            assert_eq!(came, [(350.0, 1), (850.0, 1), (1100.0, 1)]);
            assert_eq!([planner.residency.bytes(), planner.residency.peak_bytes()], [600, 600]);
        }
    }
}
