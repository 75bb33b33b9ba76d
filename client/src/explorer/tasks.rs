//! What is under way, beside all else? Cells that are read of, and requests; what comes of them is taken in one by one.

use std::collections::HashMap;

use belvedere_scene::{BlobHash, CellId, Revision, index::CellEntry, object::Model, rung::RungName};
use bytes::Bytes;
use tokio::task::{AbortHandle, Id};

use super::{
    Event, Explorer,
    members::{Come, Parts, Unpacking, tell_member},
};
use crate::{
    ByteSource, Error,
    atlas::{self, Place, Uses},
    fetch::{self, Fetched},
    strategy::{
        file::{FileName, FileRef, Key, StreamRef},
        order::Order,
    },
};

/// What a task brings.
pub(super) enum Brought {
    /// What is known of a cell, what of it could not be read, and what it was read for.
    Place(Box<Place>, Vec<Error>, Uses),
    NoPlace(CellId, Error),
    Files(Fetched),
    /// The revision that took the place of this one, if any.
    Newer(Result<Option<Revision>, Error>),
}

/// Of a pack that makes room for what waits more than so many bytes are still to come: to call off a request may cost its connection.
const WORTH_CALLING_OFF_BYTES: u64 = 16 << 10;

pub(super) struct UnderWay {
    order: Order,
    /// What was wanted of it when it was asked for.
    wanted: Vec<Key>,
    /// Behind the last file that has come out of it, if it is a pack.
    came_to: u64,
    asked_s: f64,
    abort: AbortHandle,
}

impl UnderWay {
    /// Whether it is a pack of which enough is still to come that it had better make room.
    fn is_in_the_way(&self) -> bool {
        let bytes: u64 = self.order.files.iter().map(|file| file.bytes).sum();
        self.came_to > 0 && bytes.saturating_sub(self.came_to) > WORTH_CALLING_OFF_BYTES
    }
}

impl<S: ByteSource + 'static> Explorer<S> {
    /// Reads what can be seen from a cell, beside all else.
    pub(super) fn read(&mut self, entry: Result<CellEntry, CellId>) {
        let (scene, uses) = (self.scene.clone(), self.uses());
        self.tasks.spawn(async move {
            let entry = match entry {
                Ok(entry) => entry,
                Err(cell) => match scene.cell(cell).await {
                    Ok(Some(entry)) => entry,
                    Ok(None) => return Brought::NoPlace(cell, Error::NoCell(cell)),
                    Err(cause) => return Brought::NoPlace(cell, cause),
                },
            };
            let (record, mut failures) = scene.record_somehow(&entry).await;
            let (place, others) = atlas::look(&scene, entry, record, uses).await;
            failures.extend(others);
            Brought::Place(Box::new(place), failures, uses)
        });
    }

    fn uses(&self) -> Uses {
        Uses {
            smooth: self.options.smooth,
            rules: self.options.rules,
        }
    }

    pub(super) fn take(&mut self, id: Id, brought: Brought) {
        let under_way = self.under_way.remove(&id);
        match brought {
            // Rules were lost meanwhile, and of some objects it says no more than how they grow.
            Brought::Place(place, _, uses) if uses.rules && !self.options.rules && place.has_stand_ins() => {
                self.read(Ok(place.entry));
            }
            Brought::Place(place, failures, _) => {
                let cell = place.entry.cell;
                for cause in failures {
                    self.lose(cause, |losses| _ = losses.cells.insert(cell));
                }
                if !self.atlas.place(cell).is_some_and(|known| place.says_less_than(known)) {
                    self.inherit(&place.seen);
                    self.atlas.add(*place);
                }
                self.show(cell);
                if let Some(shown) = self.shown {
                    self.look_around(shown);
                }
            }
            // It is asked for again when one is there, and not before.
            Brought::NoPlace(cell, cause) => {
                self.lose(cause, |losses| _ = losses.cells.insert(cell));
                self.unfound.insert(cell);
            }
            // It had come to its end when it was called off: who asks again gets it anew, within what is promised then.
            Brought::Files(Fetched { notes, .. }) if under_way.is_none() => {
                self.events.extend(notes.into_iter().map(Event::Problem));
            }
            Brought::Files(Fetched {
                files,
                beside,
                carried,
                notes,
                ..
            }) => {
                // What was kept on disk, and what failed, says nothing of the line.
                if let Some(one) = under_way.filter(|_| carried > 0) {
                    let came_s = self.started.elapsed().as_secs_f64();
                    self.meter.came(one.asked_s, came_s, carried as f64);
                }
                let mut lost_rules = false;
                let is_bundle = files.len() > 1;
                for (file, result) in files {
                    // What came out of a bundle is here already.
                    if !(is_bundle && self.planner.is_here(file.name.key())) {
                        lost_rules |= self.take_file(&file, result) && file.is_rules();
                    }
                }
                for (file, bytes) in beside {
                    if self.planner.welcomes(&file) {
                        self.take_file(&file, Ok(bytes));
                    }
                }
                self.events.extend(notes.into_iter().map(Event::Problem));
                if lost_rules {
                    self.without_rules();
                }
                let changes = self.planner.settle();
                self.note(changes);
            }
            Brought::Newer(found) => self.take_newer(found),
        }
        self.look_where_missed();
        self.replan();
    }

    /// Takes in a file, or that it cannot be had; answers whether it is lost.
    fn take_file(&mut self, file: &FileRef, result: Result<Bytes, Error>) -> bool {
        let Err(cause) = result.and_then(|bytes| self.keep(file, bytes)) else {
            return false;
        };
        let key = file.name.key();
        self.planner.residency.lose(key);
        match (&cause, &file.name) {
            // That was said when it was found out.
            (Error::Whole(_), FileName::Rung(rung)) => self.planner.lose_stream_of(rung.hash),
            _ => self.lose(cause, |losses| _ = losses.files.insert(key)),
        }
        true
    }

    /// Takes in what has come of packs and bundles so far, of those that are still wanted.
    pub(super) fn take_members(&mut self, come: Come) {
        let Some(one) = self.under_way.get_mut(&come.task) else {
            return;
        };
        match come.what {
            Parts::Levels { pack, members } => {
                for (member, bytes) in members {
                    one.came_to = one.came_to.max(member.to());
                    if self.planner.arrive_out_of(pack, &member) {
                        self.files.insert(member.key, bytes);
                    }
                }
            }
            Parts::Member(file, bytes) => {
                if !self.planner.is_here(file.name.key()) {
                    self.take_file(&file, Ok(bytes));
                }
            }
        }
        let changes = self.planner.settle();
        self.note(changes);
        self.replan();
    }

    /// A stream is not what its name promises: levels take its place, and nothing of it is kept for another visit.
    pub(super) fn lose_damaged(&mut self, rung: &RungName, model: &Model) {
        self.planner.lose_stream(model);
        self.scene.source().forget_parts(&rung.whole());
    }

    /// Takes in a file. A stream whose last rung it is must be what its name promises.
    fn keep(&mut self, file: &FileRef, bytes: Bytes) -> Result<(), Error> {
        if let FileName::Rung(rung) = &file.name
            && let Some(model) = self.planner.model_of_stream(rung.hash).cloned()
            && self.spoils(rung, &bytes, &model)
        {
            self.lose_damaged(rung, &model);
            return Err(Error::Stream(rung.whole()));
        }
        let key = file.name.key();
        for member in self.planner.arrive(file, bytes.len() as u64) {
            if let Some(part) = member.out_of(&bytes) {
                // A copy, so that what stays does not keep the others in memory.
                self.files.insert(member.key, Bytes::copy_from_slice(part));
            }
        }
        if self.planner.is_here(key) {
            // What came out of a pack before is a part of it now, so that nothing is in memory twice.
            for member in self.planner.members_of(key) {
                self.files.remove(&member.key);
            }
            self.files.insert(key, bytes);
        }
        Ok(())
    }

    /// Whether a rung is the last to come of a stream that is not what its name promises. One that goes and comes again is the last once more.
    pub(super) fn spoils(&self, rung: &RungName, bytes: &Bytes, model: &Model) -> bool {
        let here = |other: &RungName| match other == rung {
            true => Some(bytes),
            false => self.files.get(&other.into()),
        };
        let smooth = model.smooth.as_ref();
        smooth.and_then(|smooth| fetch::is_as_named(smooth, here)) == Some(false)
    }

    /// Whether one more request may be under way.
    pub(super) fn has_room(&self) -> bool {
        let bytes = self.under_way.values().map(|one| one.order.line_bytes()).sum();
        self.meter.has_room(self.under_way.len(), bytes)
    }

    /// Calls off what nobody needs any more. A pack of which all has come that was wanted comes to its end, as somebody may want more
    /// of it, unless something waits that the line has no room for (`viewer/core/fetch/fetchqueue.ts`).
    pub(super) fn cancel(&mut self) {
        let is_crowded = !self.has_room() && self.planner.has_more_to_ask();
        let planner = &mut self.planner;
        let is_done = |one: &UnderWay| one.wanted.iter().all(|file| planner.is_here(*file));
        let is_useless =
            |one: &UnderWay| !planner.is_wanted(&one.order) && (!is_done(one) || is_crowded && one.is_in_the_way());
        let useless = self.under_way.iter().filter(|(_, one)| is_useless(one));
        let useless: Vec<Id> = useless.map(|(id, _)| *id).collect();
        for id in useless {
            let Some(one) = self.under_way.remove(&id) else {
                continue;
            };
            one.abort.abort();
            self.cancelled += 1;
            for file in &one.order.files {
                planner.residency.withdraw(file.name.key());
            }
        }
    }

    pub(super) fn start(&mut self, order: Order) {
        let rungs = order.files.iter().filter_map(|file| match &file.name {
            FileName::Rung(rung) => Some(rung),
            FileName::Object(_) => None,
        });
        let streams: HashMap<BlobHash, StreamRef> = rungs
            .filter_map(|rung| Some((rung.hash, self.planner.stream_of(rung)?)))
            .collect();
        let packs = order.files.iter().map(|file| file.name.key());
        let waiting = packs.map(|pack| (pack, self.planner.members_of(pack)));
        let mut unpacking: HashMap<Key, Unpacking> = waiting
            .filter(|(_, members)| !members.is_empty())
            .map(|(pack, members)| (pack, Unpacking::of(pack, members, self.tell.clone())))
            .collect();
        let (scene, manners, asked) = (self.scene.clone(), self.manners.clone(), order.clone());
        let (tell, is_bundle) = (self.tell.clone(), order.files.len() > 1);
        let abort = self.tasks.spawn(async move {
            let mut watch = |file: &FileRef, so_far: &[u8]| {
                if let Some(unpacking) = unpacking.get_mut(&file.name.key()) {
                    unpacking.look(so_far);
                } else if is_bundle && fetch::is_right(file, so_far) {
                    tell_member(&tell, file, so_far);
                }
            };
            let streams = |rung: &RungName| streams.get(&rung.hash).cloned();
            let fetched = fetch::fetch(&scene, &manners, &asked, streams, &mut watch).await;
            Brought::Files(fetched)
        });
        let one = UnderWay {
            wanted: self.planner.wanted_of(&order),
            came_to: 0,
            order,
            asked_s: self.started.elapsed().as_secs_f64(),
            abort,
        };
        self.under_way.insert(one.abort.id(), one);
    }
}
