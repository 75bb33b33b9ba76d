//! Who explores a revision that goes meanwhile hears of the newer one, and takes along what both share.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use super::*;
use crate::{
    Ask, Watch,
    testing::{Packed, packed, silence},
};

const POINTER: &str = "/v1/scenes/bare/index.json";

/// A tree with two revisions, of which the second may be published, and the files of the first gone.
struct Anew {
    first: Bare,
    second: Bare,
    is_published: AtomicBool,
    /// Whether caches on the way hold the old pointer.
    is_cached: bool,
    is_away: AtomicBool,
    looks: AtomicU32,
}

impl Anew {
    /// The map of cells of the first hangs on a page that nobody has.
    fn with(first: Bare, second: Bare) -> Self {
        Self {
            first,
            second,
            is_published: AtomicBool::new(false),
            is_cached: false,
            is_away: AtomicBool::new(false),
            looks: AtomicU32::new(0),
        }
    }

    fn publish(&self) {
        self.is_published.store(true, Ordering::Relaxed);
        self.looks.store(0, Ordering::Relaxed);
    }

    fn looks(&self) -> u32 {
        self.looks.load(Ordering::Relaxed)
    }
}

impl ByteSource for Anew {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        let (bytes, _) = self.get_watched(Ask::of(path), &mut |_| {}).await?;
        Ok(bytes)
    }

    async fn get_watched(&self, ask: Ask<'_>, _: &mut Watch<'_>) -> Result<(Bytes, u64), Error> {
        let is_new = self.is_published.load(Ordering::Relaxed) && (ask.fresh || !self.is_cached);
        let found = if ask.path == POINTER {
            self.looks.fetch_add(1, Ordering::Relaxed);
            match self.is_away.load(Ordering::Relaxed) {
                true => Err(silence(POINTER)),
                false if is_new => self.second.get(POINTER).await,
                false => self.first.get(POINTER).await,
            }
        } else {
            match self.first.get(ask.path).await {
                Ok(bytes) => Ok(bytes),
                Err(_) => self.second.get(ask.path).await,
            }
        };
        found.map(|bytes| (bytes, 0))
    }
}

/// A manifest that no other has, and a map of cells that cannot be had.
fn unmapped(number: usize) -> Bare {
    let page = BlobName::of(b"a page", "json").expect("a name");
    Bare::mapped_by(&page, number)
}

impl Explorer<Anew> {
    async fn superseded(&mut self) -> usize {
        let mut told = 0;
        while let Some(events) = self.advance().await {
            told += events
                .iter()
                .filter(|event| matches!(event, Event::Superseded(_)))
                .count();
        }
        assert_eq!(told > 0, self.newer_revision().is_some());
        told
    }
}

#[tokio::test(start_paused = true)]
async fn a_level_that_is_gone_leads_to_the_newer_revision_past_caches_and_is_told_once() {
    let mut tree = Anew::with(Bare::new(), unmapped(1));
    tree.is_cached = true;
    let mut explorer = explorer(tree, u64::MAX).await;
    explorer.scene.source().publish();
    explorer.stand_in(place_with(1, packed(&[b"one"]).seen));
    explorer.replan();
    assert_eq!(explorer.superseded().await, 1);
    assert_eq!(explorer.missing(), Some(1), "one goes on without it");
    tokio::time::advance(std::time::Duration::from_mins(1)).await;
    explorer.retry().await;
    explorer.look_for_newer();
    while explorer.advance().await.is_some() {}
    assert_eq!(explorer.scene.source().looks(), 1, "it is known");
}

#[tokio::test(start_paused = true)]
async fn so_does_a_page_of_the_map_that_is_gone() {
    let mut explorer = explorer(Anew::with(unmapped(1), unmapped(2)), u64::MAX).await;
    explorer.scene.source().publish();
    explorer.follow(Eye::at([0.5; 3])).await;
    assert_eq!(explorer.superseded().await, 1);
}

#[tokio::test(start_paused = true)]
async fn where_nothing_is_newer_one_looks_again_when_more_is_gone_and_not_at_once() {
    let mut explorer = explorer(Anew::with(unmapped(1), unmapped(2)), u64::MAX).await;
    explorer.scene.source().looks.store(0, Ordering::Relaxed);
    for (waits_s, looks) in [(0, 1), (1, 1), (10, 2)] {
        tokio::time::advance(std::time::Duration::from_secs(waits_s)).await;
        explorer.retry().await;
        explorer.follow(Eye::at([0.5; 3])).await;
        assert_eq!(explorer.superseded().await, 0);
        assert_eq!(explorer.scene.source().looks(), looks);
    }
}

#[tokio::test(start_paused = true)]
async fn who_cannot_look_looks_later() {
    let mut explorer = explorer(Anew::with(unmapped(1), unmapped(2)), u64::MAX).await;
    explorer.scene.source().publish();
    explorer.scene.source().is_away.store(true, Ordering::Relaxed);
    explorer.follow(Eye::at([0.5; 3])).await;
    assert_eq!(explorer.superseded().await, 0);
    explorer.scene.source().is_away.store(false, Ordering::Relaxed);
    tokio::time::advance(std::time::Duration::from_secs(10)).await;
    explorer.follow(Eye::at([0.5; 3])).await;
    assert_eq!(explorer.superseded().await, 1);
}

#[tokio::test]
async fn who_asks_hears_of_a_newer_revision_before_anything_is_gone() {
    let mut explorer = explorer(Anew::with(Bare::new(), unmapped(1)), u64::MAX).await;
    explorer.look_for_newer();
    assert_eq!(explorer.superseded().await, 0);
    assert!(explorer.successor().await.expect("a pointer").is_none());
    explorer.scene.source().publish();
    explorer.look_for_newer();
    assert_eq!(explorer.superseded().await, 1);
}

/// An explorer that has all of this pack, in a tree that was published anew since.
async fn sated(packed: &Packed, memory_bytes: u64) -> Explorer<Anew> {
    let first = Bare::new().with(&packed.pack, packed.bytes.clone());
    let mut explorer = explorer(Anew::with(first, unmapped(1)), memory_bytes).await;
    explorer.stand_in(place_with(1, packed.seen.clone()));
    explorer.replan();
    while explorer.advance().await.is_some() {}
    assert_eq!(explorer.missing(), Some(0));
    explorer.scene.source().publish();
    explorer
}

#[tokio::test]
async fn what_both_revisions_share_is_taken_along_within_memory() {
    let packed = packed(&[&[1; 100], &[2; 100], &[3; 100]]);
    for memory_bytes in [u64::MAX, 300] {
        let old = sated(&packed, memory_bytes).await;
        let mut new = old.successor().await.expect("a pointer").expect("it was published");
        assert_eq!(new.memory_bytes(), 300);
        let asked = new.scene.source().first.asked();
        new.bring(place_with(7, packed.seen[..2].to_vec()));
        new.stand_in(place_with(7, packed.seen[..2].to_vec()));
        new.replan();
        assert_eq!(new.missing(), Some(0));
        assert_eq!(new.scene.source().first.asked(), asked);
        assert!(new.memory_bytes() <= 300);
        assert!(new.mesh(ModelId(1)).is_some() && old.mesh(ModelId(2)).is_some());
    }
}

#[tokio::test]
async fn what_is_inherited_and_not_wanted_makes_room() {
    let old = sated(&packed(&[&[1; 100], &[2; 100], &[3; 100]]), 300).await;
    let mut new = old.successor().await.expect("a pointer").expect("it was published");
    new.stand_in(place_with(7, packed(&[&[4; 150]]).seen));
    new.replan();
    assert!((1..=300).contains(&new.memory_bytes()));
    assert_eq!(new.planner.residency.asked_bytes(), 150);
    assert!(new.memory_bytes() <= 150);
}
