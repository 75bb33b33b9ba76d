//! What becomes of a walk when rules, or a cell ahead, are lost under way? Places are handed over by hand, from a tree that answers nothing.

mod bundles;
mod newer;
mod packs;
mod recovery;
mod streams;

use belvedere_scene::{BlobName, Bounds};

use super::*;
use crate::{
    atlas::{Place, Uses},
    fetch::Fetched,
    strategy::{
        file::FileRef,
        grade::Form,
        order::Budgets,
        tests::{grown, seen_at},
    },
    testing::{self, Bare},
};

async fn explorer<S: ByteSource + 'static>(source: S, memory_bytes: u64) -> Explorer<S> {
    let options = ExplorerOptions {
        budgets: Budgets {
            memory_bytes,
            ..Budgets::default()
        },
        rules: true,
        recovers: false,
        ..ExplorerOptions::default()
    };
    Explorer::new(testing::open(source).await, options)
}

/// A cell from which one sees an object that grows, of which levels are known or not.
fn place(cell: u32, knows_levels: bool) -> Place {
    let mut model = grown(1);
    if !knows_levels {
        model.levels.clear();
    }
    place_with(cell, vec![seen_at(1, 1, 9.0, 1.0, model)])
}

fn place_with(cell: u32, seen: Vec<Seen>) -> Place {
    let name = |ext| BlobName::of(b"record", ext).expect("a name");
    Place {
        entry: CellEntry {
            cell: CellId(cell),
            bounds: Bounds {
                min: [0.0; 3],
                max: [4.0; 3],
            },
            planes: Vec::new(),
            adjacent: Vec::new(),
            record: name("cell"),
            record_bytes: 1,
            steps: None,
            steps_bytes: None,
            record_json: name("json"),
        },
        portals: Vec::new(),
        seen,
        lost: 0,
        is_unknown: false,
    }
}

impl<S: ByteSource + 'static> Explorer<S> {
    /// One stands in a cell that was read of.
    fn stand_in(&mut self, place: Place) {
        (self.at, self.shown) = (Some(place.entry.clone()), Some(place.entry.cell));
        self.eye = Some(Eye::at([1.0; 3]));
        self.asked.insert(place.entry.cell);
        self.atlas.add(place);
    }

    /// A place comes that was read while rules were used.
    fn bring(&mut self, place: Place) {
        let uses = Uses {
            smooth: true,
            rules: true,
        };
        let id = tokio::spawn(async {}).id();
        self.take(id, Brought::Place(Box::new(place), Vec::new(), uses));
    }
}

#[tokio::test]
async fn what_comes_full_of_stand_ins_after_rules_were_lost_is_read_again() {
    let mut explorer = explorer(Bare::new(), u64::MAX).await;
    explorer.without_rules();
    explorer.bring(place(1, true));
    assert!(explorer.atlas.place(CellId(1)).is_some() && explorer.tasks.is_empty());
    explorer.bring(place(2, false));
    assert!(explorer.atlas.place(CellId(2)).is_none());
    assert_eq!(explorer.tasks.len(), 1);
    // This time it comes as it can be had without rules, and so it stays.
    while explorer.advance().await.is_some() {}
    assert!(explorer.atlas.place(CellId(2)).is_some());
}

#[tokio::test]
async fn levels_are_asked_for_as_soon_as_rules_are_lost() {
    let mut explorer = explorer(Bare::new(), u64::MAX).await;
    explorer.stand_in(place(1, true));
    assert!(explorer.tasks.is_empty());
    explorer.without_rules();
    assert_eq!(explorer.planner.wishes()[0].grade.form, Form::Level);
    assert_eq!(explorer.tasks.len(), 1);
}

#[tokio::test]
async fn what_had_come_already_when_it_was_called_off_does_not_count() {
    let mut explorer = explorer(Bare::new(), 100).await;
    let name = BlobName::of(b"level", "glb").expect("a name");
    let file = FileRef::object(&name, 5);
    // Somebody has asked for it again since.
    explorer.planner.residency.ask(&file);
    let came = [Ok(Bytes::from_static(b"level")), Err(Error::Missing(name.url()))];
    for result in came {
        let fetched = Fetched {
            files: vec![(file.clone(), result)],
            ..Fetched::default()
        };
        let called_off = tokio::spawn(async {}).id();
        explorer.take(called_off, Brought::Files(fetched));
        let residency = &explorer.planner.residency;
        assert_eq!((residency.bytes(), residency.asked_bytes()), (0, 5));
        assert!(explorer.files.is_empty() && explorer.events.is_empty());
    }
}

/// A tree that is out of its mind.
struct Mad(Bare);

impl ByteSource for Mad {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        assert!(!path.starts_with("/o/") || path.ends_with(".json"), "it is mad");
        self.0.get(path).await
    }
}

#[tokio::test]
async fn a_source_that_panics_is_not_waited_for_for_ever() {
    let mut explorer = explorer(Mad(Bare::new()), u64::MAX).await;
    explorer.stand_in(place(1, true));
    explorer.replan();
    let walk = tokio::spawn(async move { while explorer.advance().await.is_some() {} });
    assert!(walk.await.expect_err("it says so").is_panic());
}

#[tokio::test]
async fn a_cell_that_could_not_be_found_from_afar_is_read_of_once_one_is_there() {
    let mut explorer = explorer(Bare::new(), u64::MAX).await;
    explorer.asked.insert(CellId(1));
    let id = tokio::spawn(async {}).id();
    explorer.take(id, Brought::NoPlace(CellId(1), Error::NoCell(CellId(1))));
    assert!(explorer.tasks.is_empty());
    explorer.at = Some(place(1, true).entry);
    for reads in [1, 0] {
        explorer.follow(Eye::at([1.0; 3])).await;
        assert_eq!(explorer.tasks.len(), reads);
        while explorer.advance().await.is_some() {}
    }
}
