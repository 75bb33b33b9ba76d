//! What has happened in a scene? A [`Journal`] is a [`World`] that writes down what comes in and what goes out.
//!
//! The rules are a function of their inputs and the time, so inputs alone would bring everything back ([`replay`]). Outputs stand
//! beside them, so that it shows when they do not: because the rules have changed, or the journal has been.
//!
//! An entry is two lines: `[at_ms, input]` and an [`Output`], both JSON. What changes the world goes through the journal; what only
//! asks it goes to the world directly.

mod input;
mod ranges;
pub mod replay;

use std::ops::Deref;

use belvedere_scene::{Bounds, CellId, ObjectId, SceneName};

pub use self::input::{Answer, Ground, Input, Output};
use crate::{
    Ms, World,
    aoi::Aoi,
    cells::{Cells, Hidden},
    event::{Event, Gone, SessionId, Void},
    world::{Moved, NewMover, Refusal, Rules, Seen, Sent, Visitor},
};

/// A world that keeps a journal, if it is to.
#[derive(Debug)]
pub struct Journal {
    world: World,
    said: Vec<(SessionId, Event)>,
    /// Entries that nobody has taken yet; none when nothing is to be written.
    written: Option<String>,
}

impl Deref for Journal {
    type Target = World;

    fn deref(&self) -> &World {
        &self.world
    }
}

impl Journal {
    /// An empty scene.
    #[must_use]
    pub fn begin(scene: SceneName, ground: &Ground, rules: Rules, writes: bool, now_ms: Ms) -> Self {
        let mut journal = Self {
            world: ground.world(rules),
            said: Vec::new(),
            written: writes.then(String::new),
        };
        let input = journal.input(|| Input::Begin {
            scene,
            rules,
            ground: ground.clone(),
        });
        journal.write(now_ms, input, Answer::Done);
        journal
    }

    /// What sessions are told since the last call, in order.
    pub fn events(&mut self) -> Vec<(SessionId, Event)> {
        let (mut said, unwritten) = (std::mem::take(&mut self.said), self.world.events());
        if said.is_empty() {
            return unwritten;
        }
        said.extend(unwritten);
        said
    }

    /// What has been written since the last call: whole entries.
    pub fn written(&mut self) -> Option<String> {
        let written = self.written.as_mut().filter(|written| !written.is_empty())?;
        Some(std::mem::take(written))
    }

    /// [`World::next_unscreened`]; a question changes nothing.
    pub fn next_unscreened(&mut self) -> Option<crate::world::Unscreened> {
        self.world.next_unscreened()
    }

    /// [`World::unknown_ahead`]; a question changes nothing.
    pub fn unknown_ahead(&mut self) -> Vec<CellId> {
        self.world.unknown_ahead()
    }

    /// [`World::teach`].
    pub fn teach(&mut self, cell: CellId, sees: &[CellId], now_ms: Ms) {
        let input = self.input(|| Input::Teach {
            cell,
            sees: sees.to_vec(),
        });
        self.world.teach(cell, sees);
        self.write(now_ms, input, Answer::Done);
    }

    /// [`World::open`].
    ///
    /// # Errors
    /// As there.
    pub fn open(
        &mut self,
        session: SessionId,
        object: ObjectId,
        visitor: Visitor,
        now_ms: Ms,
    ) -> Result<Seen, Refusal> {
        let input = self.input(|| Input::Open {
            session,
            object,
            visitor: visitor.clone(),
        });
        let seen = self.world.open(session, object, visitor, now_ms);
        self.write(now_ms, input, &seen);
        seen
    }

    /// [`World::pose`].
    ///
    /// # Errors
    /// As there.
    pub fn pose(&mut self, session: SessionId, sent: Sent, now_ms: Ms) -> Result<Seen, Refusal> {
        let input = self.input(|| Input::Pose { session, sent });
        let seen = self.world.pose(session, sent, now_ms);
        self.write(now_ms, input, &seen);
        seen
    }

    /// [`World::set_aoi`].
    ///
    /// # Errors
    /// As there.
    pub fn set_aoi(&mut self, session: SessionId, aoi: Aoi, now_ms: Ms) -> Result<(), Refusal> {
        let input = self.input(|| Input::Aoi { session, aoi });
        let set = self.world.set_aoi(session, aoi, now_ms);
        self.write(now_ms, input, &set);
        set
    }

    /// [`World::close`].
    pub fn close(&mut self, session: SessionId, now_ms: Ms) {
        let input = self.input(|| Input::Close { session });
        self.world.close(session, now_ms);
        self.write(now_ms, input, Answer::Done);
    }

    /// [`World::create`].
    ///
    /// # Errors
    /// As there.
    pub fn create(
        &mut self,
        object: ObjectId,
        owner: Option<SessionId>,
        new: NewMover,
        now_ms: Ms,
    ) -> Result<Moved, Refusal> {
        let input = self.input(|| Input::Create {
            object,
            owner,
            new: new.clone(),
        });
        let moved = self.world.create(object, owner, new, now_ms);
        self.write(now_ms, input, &moved);
        moved
    }

    /// [`World::move_to`].
    ///
    /// # Errors
    /// As there.
    pub fn move_to(&mut self, object: ObjectId, sent: Sent, now_ms: Ms) -> Result<Moved, Refusal> {
        let input = self.input(|| Input::Move { object, sent });
        let moved = self.world.move_to(object, sent, now_ms);
        self.write(now_ms, input, &moved);
        moved
    }

    /// [`World::destroy`].
    pub fn destroy(&mut self, object: ObjectId, now_ms: Ms) {
        let input = self.input(|| Input::Destroy { object });
        self.world.destroy(object);
        self.write(now_ms, input, Answer::Done);
    }

    /// [`World::import`].
    ///
    /// # Errors
    /// As there.
    pub fn import(&mut self, object: ObjectId, new: NewMover, now_ms: Ms) -> Result<(), Refusal> {
        let input = self.input(|| Input::Import {
            object,
            new: new.clone(),
        });
        let imported = self.world.import(object, new, now_ms);
        self.write(now_ms, input, &imported);
        imported
    }

    /// [`World::withdraw`].
    pub fn withdraw(&mut self, object: ObjectId, reason: Gone, now_ms: Ms) {
        let input = self.input(|| Input::Withdraw { object, reason });
        self.world.withdraw(object, reason, now_ms);
        self.write(now_ms, input, Answer::Done);
    }

    /// [`World::watch_abroad`].
    pub fn watch_abroad(&mut self, begun: &[CellId], ended: &[CellId], now_ms: Ms) {
        let input = self.input(|| Input::WatchAbroad {
            begun: begun.to_vec(),
            ended: ended.to_vec(),
        });
        self.world.watch_abroad(begun, ended, now_ms);
        self.write(now_ms, input, Answer::Done);
    }

    /// [`World::set_door`].
    pub fn set_door(&mut self, object: ObjectId, bounds: &Bounds, open: bool, now_ms: Ms) {
        let input = self.input(|| Input::Door {
            object,
            bounds: *bounds,
            open,
        });
        self.world.set_door(object, bounds, open, now_ms);
        self.write(now_ms, input, Answer::Done);
    }

    /// [`World::screen`].
    pub fn screen(&mut self, cell: CellId, closed: &[ObjectId], hidden: &[Hidden], now_ms: Ms) {
        let input = self.input(|| Input::Screen {
            cell,
            closed: closed.to_vec(),
            hidden: hidden.to_vec(),
        });
        self.world.screen(cell, closed, hidden, now_ms);
        self.write(now_ms, input, Answer::Done);
    }

    /// [`World::resync`].
    pub fn resync(&mut self, session: SessionId, reason: Void, now_ms: Ms) {
        let input = self.input(|| Input::Resync { session, reason });
        self.world.resync(session, reason, now_ms);
        self.write(now_ms, input, Answer::Done);
    }

    /// [`World::make_room`].
    pub fn make_room(&mut self, session: SessionId, now_ms: Ms) {
        let input = self.input(|| Input::Room { session });
        self.world.make_room(session);
        self.write(now_ms, input, Answer::Done);
    }

    /// [`World::listens`].
    pub fn listens(&mut self, session: SessionId, listens: bool, now_ms: Ms) {
        let input = self.input(|| Input::Listens { session, listens });
        self.world.listens(session, listens, now_ms);
        self.write(now_ms, input, Answer::Done);
    }

    /// [`World::wakeable`].
    pub fn wakeable(&mut self, session: SessionId, wakeable: bool, now_ms: Ms) {
        let input = self.input(|| Input::Wakeable { session, wakeable });
        self.world.wakeable(session, wakeable, now_ms);
        self.write(now_ms, input, Answer::Done);
    }

    /// [`World::rebase`], to cells that see from wherever somebody stands what `sights` say.
    pub fn rebase(&mut self, ground: &Ground, sights: &[(CellId, Vec<CellId>)], now_ms: Ms) {
        let input = self.input(|| Input::Rebase {
            ground: ground.clone(),
            sights: sights.to_vec(),
        });
        self.world
            .rebase(taught(ground, sights), &ground.bounds, &ground.foliage, now_ms);
        self.write(now_ms, input, Answer::Done);
    }

    /// [`World::tick`].
    pub fn tick(&mut self, now_ms: Ms) {
        let input = self.input(|| Input::Tick);
        self.world.tick(now_ms);
        self.write(now_ms, input, Answer::Done);
    }

    /// An input as it is to be written, if it is.
    fn input(&self, input: impl FnOnce() -> Input) -> Option<Input> {
        self.written.as_ref().map(|_| input())
    }

    fn write(&mut self, now_ms: Ms, input: Option<Input>, answer: impl Into<Answer>) {
        let (Some(written), Some(input)) = (&mut self.written, input) else {
            return;
        };
        let said = self.world.events();
        let told = said
            .iter()
            .map(|(session, event)| (*session, event.name(), event.clone()));
        let output = Output {
            answer: answer.into(),
            told: told.collect(),
        };
        self.said.extend(said);
        written.push_str(&text(&(now_ms, &input)));
        written.push('\n');
        written.push_str(&text(&output));
        written.push('\n');
    }
}

fn text<T: serde::Serialize>(value: &T) -> String {
    serde_json::to_string(value).expect("an entry holds nothing that JSON cannot say")
}

/// Cells of which is known what is seen from some.
fn taught(ground: &Ground, sights: &[(CellId, Vec<CellId>)]) -> Cells {
    let mut cells = Cells::new(ground.cells.clone());
    for (cell, sees) in sights {
        cells.learn(*cell, sees);
    }
    cells
}
