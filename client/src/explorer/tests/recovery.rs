//! Does what could not be had come by itself when the server answers again?

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use super::*;
use crate::testing::{FAULTS, Faulty, packed, silence};

/// A tree whose server can be taken away.
struct Shaky {
    tree: Bare,
    is_away: AtomicBool,
    refused: AtomicU32,
}

impl ByteSource for Shaky {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        if self.is_away.load(Ordering::Relaxed) {
            self.refused.fetch_add(1, Ordering::Relaxed);
            return Err(silence(path));
        }
        self.tree.get(path).await
    }
}

/// An explorer that looks at one object in a tree that has it, or not.
async fn looking(has_it: bool, recovers: bool) -> Explorer<Shaky> {
    let packed = packed(&[b"level"]);
    let (name, level) = packed.levels[0].clone();
    let tree = match has_it {
        true => Bare::new().with(&packed.pack, packed.bytes.clone()).with(&name, level),
        false => Bare::new(),
    };
    let shaky = Shaky {
        tree,
        is_away: AtomicBool::new(false),
        refused: AtomicU32::new(0),
    };
    let mut explorer = explorer(shaky, u64::MAX).await;
    explorer.options.recovers = recovers;
    explorer.stand_in(place_with(1, packed.seen));
    explorer
}

impl Explorer<Shaky> {
    fn is_away(&self, away: bool) {
        self.scene.source().is_away.store(away, Ordering::Relaxed);
    }
}

#[tokio::test(start_paused = true)]
async fn what_failed_for_a_reason_that_passes_is_tried_again_until_it_comes() {
    let mut explorer = looking(true, true).await;
    explorer.is_away(true);
    explorer.replan();
    for _ in 0..3 {
        let events = explorer.advance().await.expect("more is tried");
        assert!(
            matches!(events[..], [Event::Problem(Error::Fetch { .. }), ..]),
            "{events:?}"
        );
    }
    assert_eq!(explorer.missing(), Some(1));
    explorer.is_away(false);
    while explorer.advance().await.is_some() {}
    assert_eq!(explorer.missing(), Some(0));
}

#[tokio::test(start_paused = true)]
async fn a_new_try_that_is_called_off_before_it_began_is_made_the_next_time() {
    let mut explorer = looking(true, true).await;
    explorer.is_away(true);
    explorer.replan();
    explorer.advance().await.expect("it was told");
    explorer.is_away(false);
    let scene = explorer.scene.clone();
    let held = scene.hold_lost().await;
    let waits = tokio::time::timeout(std::time::Duration::from_secs(60), explorer.advance()).await;
    assert!(waits.is_err(), "it is due, and waits");
    drop(held);
    while explorer.advance().await.is_some() {}
    assert_eq!(explorer.missing(), Some(0));
}

#[tokio::test(start_paused = true)]
async fn what_is_not_there_is_not_tried_again_and_who_wants_no_new_try_gets_none() {
    for (has_it, recovers) in [(false, true), (true, false)] {
        let mut explorer = looking(has_it, recovers).await;
        explorer.is_away(has_it);
        explorer.replan();
        let begun = tokio::time::Instant::now();
        while explorer.advance().await.is_some() {}
        assert_eq!((explorer.missing(), begun.elapsed().as_secs()), (Some(1), 0));
        // Told to, it does.
        explorer.is_away(false);
        explorer.retry().await;
        while explorer.advance().await.is_some() {}
        assert_eq!(explorer.missing(), Some(usize::from(!has_it)));
    }
}

#[tokio::test(start_paused = true)]
async fn a_cell_of_which_something_could_not_be_read_is_read_again() {
    let mut explorer = looking(true, true).await;
    explorer.is_away(true);
    explorer.read(Ok(place(2, true).entry));
    let events = explorer.advance().await.expect("the record cannot be had");
    assert!(
        events.iter().all(|event| matches!(event, Event::Problem(_))),
        "{events:?}"
    );
    let lost = explorer.atlas.place(CellId(2)).expect("what is around instead").lost;
    let before = explorer.scene.source().refused.load(Ordering::Relaxed);
    explorer.advance().await.expect("it is tried again");
    let refused = explorer.scene.source().refused.load(Ordering::Relaxed) - before;
    assert!(lost > 0 && refused > 0, "{refused} of {lost}");
}

#[tokio::test(start_paused = true)]
async fn the_picture_stays_while_nothing_can_be_had_of_where_one_has_gone() {
    let mut explorer = looking(true, false).await;
    explorer.replan();
    while explorer.advance().await.is_some() {}
    assert_eq!((explorer.visible().len(), explorer.missing()), (1, Some(0)));
    explorer.is_away(true);
    let next = place(2, true).entry;
    explorer.at = Some(next.clone());
    explorer.read(Ok(next));
    while explorer.advance().await.is_some() {}
    assert_eq!((explorer.visible().len(), explorer.missing()), (1, None));
}

#[tokio::test(start_paused = true)]
async fn what_is_known_of_a_cell_stays_when_it_is_read_again_in_vain() {
    let mut explorer = looking(true, true).await;
    explorer.replan();
    while explorer.advance().await.is_some() {}
    explorer.is_away(true);
    explorer.read(Ok(explorer.at.clone().expect("a cell")));
    for _ in 0..2 {
        let events = explorer.advance().await.expect("it is tried again");
        assert!(
            events.iter().all(|event| matches!(event, Event::Problem(_))),
            "{events:?}"
        );
        assert_eq!((explorer.visible().len(), explorer.missing()), (1, Some(0)));
    }
}

#[tokio::test(start_paused = true)]
async fn who_has_gone_where_nobody_knows_hears_so_and_is_found_again() {
    let mut explorer = looking(true, true).await;
    explorer.replan();
    while explorer.advance().await.is_some() {}
    explorer.lose(silence("/v1/chunk"), |losses| losses.is_astray = true);
    explorer.is_astray = true;
    assert_eq!(explorer.missing(), None);
    explorer.advance().await.expect("it was told");
    while explorer.advance().await.is_some() {}
    assert!(!explorer.is_astray && !explorer.recovery.is_waiting());
}

#[tokio::test(start_paused = true)]
async fn a_page_of_the_map_that_does_not_come_is_not_asked_for_again_by_who_goes_on() {
    for (fault, recovers) in FAULTS.into_iter().flat_map(|fault| [(fault, false), (fault, true)]) {
        let mut explorer = explorer(Faulty::new(fault), u64::MAX).await;
        explorer.options.recovers = recovers;
        for step in 0..10 {
            explorer.follow(Eye::at([f64::from(step), 0.0, 0.0])).await;
        }
        assert_eq!(explorer.scene.source().asked(), 1);
        let told = explorer.advance().await.expect("it was told");
        let told = told.iter().filter(|event| matches!(event, Event::Problem(_)));
        assert!(told.count() > 0);
    }
}

#[tokio::test(start_paused = true)]
async fn a_page_of_the_map_comes_once_its_server_answers_again() {
    let silent = |page: &BlobName| silence(&page.url());
    let mut explorer = explorer(Faulty::new(silent), u64::MAX).await;
    explorer.options.recovers = true;
    explorer.follow(Eye::at([0.5; 3])).await;
    explorer.advance().await.expect("it was told");
    // Who finds the way back meanwhile, and loses it again, is waited for as well.
    explorer.recovery.found();
    explorer.follow(Eye::at([0.5; 3])).await;
    assert!(explorer.is_astray && explorer.recovery.is_waiting());
    explorer.scene.source().is_well.store(true, Ordering::Relaxed);
    while explorer.advance().await.is_some() {}
    assert_eq!((explorer.scene.source().asked(), explorer.is_astray), (2, false));
}
