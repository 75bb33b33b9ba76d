//! What is learnt of how a server answers ranges, and who waits for whom meanwhile?

use std::time::Duration;

use tokio::time::timeout;

use super::*;
use crate::testing::{self, Bare};

/// A tree without rungs that answers ranges: of what is kept, or over a line.
struct Ranged {
    tree: Bare,
    carried: u64,
    /// Who hears meanwhile that it ignores them.
    meanwhile: Option<Arc<Manners>>,
}

impl ByteSource for Ranged {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        self.tree.get(path).await
    }

    async fn get_range(&self, _: Ask<'_>, range: Range<u64>) -> Result<(Part, u64), Error> {
        if let Some(manners) = &self.meanwhile {
            *manners.ranges() = Ranges::Ignored(BlobHash([2; 32]), Bytes::new());
        }
        let part = vec![1; (range.end - range.start) as usize];
        Ok((Part::Asked(part.into()), self.carried))
    }
}

#[tokio::test]
async fn only_what_came_over_a_line_tells_that_a_server_keeps_ranges_and_not_once_it_ignored_one() {
    let rung = RungName {
        hash: BlobHash([1; 32]),
        number: 1,
    };
    let stream = StreamRef {
        ends: vec![10, 30],
        is_needed: true,
    };
    for (carried, has_ignored, is_kept) in [(0, false, false), (20, false, true), (20, true, false)] {
        let manners = Arc::new(Manners::default());
        let scene = testing::open(Ranged {
            tree: Bare::new(),
            carried,
            meanwhile: has_ignored.then(|| manners.clone()),
        })
        .await;
        let mut fetched = Fetched::default();
        let came = rung_of(&scene, &manners, &rung, 20, Some(stream.clone()), &mut fetched).await;
        assert_eq!(came.expect("a part").len(), 20);
        assert_eq!(matches!(&*manners.ranges(), Ranges::Kept), is_kept);
    }
}

#[tokio::test(start_paused = true)]
async fn who_wants_another_stream_does_not_wait_and_who_wants_the_same_does() {
    let manners = Manners::default();
    let [one, other] = [1, 2].map(|byte| Some(BlobHash([byte; 32])));
    let soon = Duration::from_secs(1);
    let held = manners.turn(one).await;
    assert!(timeout(soon, manners.turn(other)).await.is_ok());
    assert!(timeout(soon, manners.turn(None)).await.is_ok());
    assert!(timeout(soon, manners.turn(one)).await.is_err());
    drop(held);
    assert!(timeout(soon, manners.turn(one)).await.is_ok());
}
