//! Does a walk go on, and say so, where a part of the map of cells never comes, whichever way it fails?

use std::{cell::Cell, sync::Arc};

use bytes::Bytes;

use super::{Manner, Rambles, Script, TourSettings, frames, walk};
use crate::{
    ByteSource, Error,
    testing::{self, FAULTS, Faulty},
};

/// A source of which the test keeps hold.
#[derive(Clone)]
struct Shared(Arc<Faulty>);

impl ByteSource for Shared {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        self.0.get(path).await
    }
}

#[tokio::test(start_paused = true)]
async fn a_page_that_never_comes_is_asked_for_once_and_told_once() {
    let way = "{\"t_ms\": 0, \"position\": [0, 0, 0]}\n{\"t_ms\": 6000, \"position\": [6, 0, 0]}";
    let way = Script::parse(way).expect("a way");
    for fault in FAULTS {
        let source = Shared(Arc::new(Faulty::new(fault)));
        let bare = "bare".parse().expect("a name");
        let (settings, heard) = (TourSettings::default(), Cell::new(0));
        let hear = || heard.set(heard.get() + 1);
        let walked = walk(source.clone(), &bare, &way, &settings, hear).await;
        let tour = walked.expect("the scene opens");
        assert_eq!(heard.get(), frames(&way, &settings));
        assert_eq!(source.0.asked(), 1, "{:?}", tour.first_failures);
        assert_eq!(tour.frames.len(), 61);
        assert!(tour.frames.iter().all(|frame| frame.unknown));
        let told = tour.first_failures.iter().filter(|told| told.contains("map of cells"));
        assert_eq!(told.count(), 1, "{:?}", tour.first_failures);
    }
}

#[tokio::test(start_paused = true)]
async fn no_way_is_made_up_where_no_cell_is_known() {
    for fault in FAULTS {
        let scene = testing::open(Faulty::new(fault)).await.giving_up();
        let mut rambles = Rambles::through(&scene, 1.0, 60.0);
        for manner in [Manner::Wander, Manner::StreetTour] {
            let told = rambles.script(manner, 1).await.expect_err("nobody knows where to go");
            assert!(matches!(told, Error::Uncharted { .. }), "{told}");
        }
        assert_eq!(scene.source().asked(), 1);
    }
}
