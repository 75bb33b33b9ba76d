//! What is asked for again, how often, and when is it given up?

use std::sync::atomic::{AtomicU32, Ordering};

use tokio::time::Instant;

use super::*;
use crate::testing::silence;

/// Fails so many times, each in its own way, then answers.
struct Shaky {
    failures: u32,
    asked: AtomicU32,
    asked_fresh: AtomicU32,
    failure: fn(&str) -> Result<Bytes, Error>,
}

impl ByteSource for Shaky {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        if self.asked.fetch_add(1, Ordering::Relaxed) < self.failures {
            (self.failure)(path)
        } else {
            Ok(Bytes::from_static(b"right"))
        }
    }

    async fn get_watched(&self, ask: Ask<'_>, watch: &mut Watch<'_>) -> Result<(Bytes, u64), Error> {
        self.asked_fresh.fetch_add(u32::from(ask.fresh), Ordering::Relaxed);
        let bytes = self.get(ask.path).await?;
        watch(&bytes);
        Ok((bytes, 5))
    }
}

fn shaky(failures: u32, failure: fn(&str) -> Result<Bytes, Error>) -> Retrying<Shaky> {
    Retrying::new(Shaky {
        failures,
        asked: AtomicU32::new(0),
        asked_fresh: AtomicU32::new(0),
        failure,
    })
}

fn away(path: &str) -> Result<Bytes, Error> {
    Err(silence(path))
}

#[tokio::test(start_paused = true)]
async fn what_may_pass_is_asked_again() {
    let name = BlobName::of(b"right", "cell").unwrap().url();
    let source = shaky(TRIES - 1, away);
    assert_eq!(source.get(&name).await.unwrap(), Bytes::from_static(b"right"));
    let source = shaky(TRIES, away);
    assert!(source.get(&name).await.unwrap_err().is_transient());
    assert_eq!(source.source.asked.load(Ordering::Relaxed), TRIES);
}

#[tokio::test(start_paused = true)]
async fn what_came_damaged_is_asked_for_once_more_past_all_caches() {
    let name = BlobName::of(b"right", "cell").unwrap().url();
    let damaged = |_: &str| Ok(Bytes::from_static(b"wrong"));
    let begun = tokio::time::Instant::now();
    for (failures, comes) in [(1, true), (2, false)] {
        let source = shaky(failures, damaged);
        assert_eq!(source.get(&name).await.is_ok(), comes);
        let asked = [&source.source.asked, &source.source.asked_fresh].map(|asked| asked.load(Ordering::Relaxed));
        assert_eq!(asked, [2, 1]);
    }
    assert_eq!(begun.elapsed(), Duration::ZERO);
}

#[tokio::test(start_paused = true)]
async fn who_asks_past_all_caches_is_answered_so() {
    let source = shaky(1, away);
    let ask = Ask::of("/v1/scenes/town/index.json").fresh();
    assert_eq!(source.get_watched(ask, &mut unwatched).await.unwrap().1, 5);
    let asked = [&source.source.asked, &source.source.asked_fresh].map(|asked| asked.load(Ordering::Relaxed));
    assert_eq!(asked, [2, 2]);
}

/// What becomes of so many files of a source, of which those that end in 1, 4 or 7 fail for so many tries.
async fn walk(files: u32, failures: u32, failure: Failure) -> (u32, Duration) {
    let source = Retrying::new(Sick {
        failures,
        failure,
        tried: Mutex::default(),
    });
    let begun = Instant::now();
    let mut lost = 0;
    for file in 0..files {
        lost += u32::from(source.get(&format!("/v1/{file}")).await.is_err());
    }
    (lost, begun.elapsed())
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Failure {
    Refuses,
    Busy,
    Hangs,
    Trickles,
}

struct Sick {
    failures: u32,
    failure: Failure,
    tried: Mutex<std::collections::BTreeMap<String, u32>>,
}

impl ByteSource for Sick {
    async fn get(&self, path: &str) -> Result<Bytes, Error> {
        Ok(self.get_watched(Ask::of(path), &mut unwatched).await?.0)
    }

    async fn get_watched(&self, ask: Ask<'_>, watch: &mut Watch<'_>) -> Result<(Bytes, u64), Error> {
        sleep(Duration::from_millis(1)).await;
        let tried = {
            let mut tried = self.tried.lock().expect("the notes");
            let tried = tried.entry(ask.path.to_owned()).or_default();
            *tried += 1;
            *tried
        };
        if ask.path.ends_with(['1', '4', '7']) && tried <= self.failures {
            match self.failure {
                Failure::Refuses => return Err(silence(ask.path)),
                Failure::Busy => {
                    return Err(Error::Busy {
                        path: ask.path.to_owned(),
                        status: 429,
                        after: Duration::from_hours(1),
                    });
                }
                Failure::Hangs => std::future::pending().await,
                Failure::Trickles => {
                    for bytes in 0..10_000 {
                        watch(&vec![0; 20 * bytes]);
                        sleep(Duration::from_millis(200)).await;
                    }
                }
            }
        }
        watch(b"right");
        Ok((Bytes::from_static(b"right"), 5))
    }
}

#[tokio::test(start_paused = true)]
async fn files_that_never_come_cost_little_more_than_a_minute_together() {
    for failure in [Failure::Refuses, Failure::Busy, Failure::Hangs, Failure::Trickles] {
        let (lost, took) = walk(800, u32::MAX, failure).await;
        assert_eq!(lost, 240, "{failure:?}");
        assert!(took < Duration::from_secs(105), "{failure:?}: {took:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn files_that_fail_twice_and_then_come_are_not_lost() {
    for failures in [1, 2] {
        let (lost, took) = walk(800, failures, Failure::Refuses).await;
        assert_eq!(lost, 0);
        assert!(took < Duration::from_secs(60), "{took:?}");
    }
    assert_eq!(walk(100, 1, Failure::Hangs).await.0, 0);
}

#[tokio::test(start_paused = true)]
async fn a_server_that_falls_silent_is_left_alone_and_asked_again_later() {
    let source = Retrying::new(Sick {
        failures: 250,
        failure: Failure::Hangs,
        tried: Mutex::default(),
    });
    source.get("/v1/right").await.unwrap();
    let begun = Instant::now();
    for _ in 0..1000 {
        source.get("/v1/1").await.unwrap_err();
        source.get("/v1/other-1").await.unwrap_err();
    }
    assert!(begun.elapsed() < Duration::from_mins(2), "{:?}", begun.elapsed());
    sleep(Duration::from_secs(10)).await;
    source.get("/v1/right").await.unwrap();
}

/// Takes a second for each answer, one after the other for whoever asks at once, and counts who does.
#[derive(Clone, Default)]
struct Queueing {
    line: Arc<tokio::sync::Mutex<()>>,
    waiting: Arc<AtomicU32>,
    most: Arc<AtomicU32>,
}

impl ByteSource for Queueing {
    async fn get(&self, _: &str) -> Result<Bytes, Error> {
        let waiting = 1 + self.waiting.fetch_add(1, Ordering::Relaxed);
        self.most.fetch_max(waiting, Ordering::Relaxed);
        let turn = self.line.lock().await;
        sleep(Duration::from_secs(1)).await;
        drop(turn);
        self.waiting.fetch_sub(1, Ordering::Relaxed);
        Ok(Bytes::from_static(b"right"))
    }
}

#[tokio::test(start_paused = true)]
async fn many_visitors_at_once_take_turns_and_lose_nothing_by_waiting_for_theirs() {
    for (most, lost) in [(8, 0), (200, 170)] {
        let server = Queueing::default();
        let source = Retrying::new(server.clone()).at_most(most);
        let mut visitors = tokio::task::JoinSet::new();
        for visitor in 0..200 {
            let source = source.clone();
            visitors.spawn(async move { source.get(&format!("/v1/{visitor}")).await.is_err() });
        }
        let failed = visitors.join_all().await.into_iter().filter(|failed| *failed).count();
        assert_eq!(failed, lost, "of 200, with {most} at once");
        assert_eq!(server.most.load(Ordering::Relaxed), most as u32);
    }
}

#[tokio::test(start_paused = true)]
async fn a_silent_server_is_found_out_by_all_at_once() {
    #[derive(Clone)]
    struct Mute;

    impl ByteSource for Mute {
        async fn get(&self, _: &str) -> Result<Bytes, Error> {
            std::future::pending().await
        }
    }

    let source = Retrying::new(Mute).at_most(8);
    let mut visitors = tokio::task::JoinSet::new();
    for _ in 0..80 {
        let source = source.clone();
        visitors.spawn(async move { source.get("/v1/1").await.is_err() });
    }
    let begun = Instant::now();
    assert!(visitors.join_all().await.into_iter().all(|failed| failed));
    assert!(begun.elapsed() < Duration::from_mins(3), "{:?}", begun.elapsed());
}

/// Says nothing for ever, or sends a stream of which a part was asked for whole, so many bytes each second.
struct Streaming(u64);

impl ByteSource for Streaming {
    async fn get(&self, _: &str) -> Result<Bytes, Error> {
        std::future::pending().await
    }

    async fn get_range(&self, ask: Ask<'_>, _: Range<u64>) -> Result<(Part, u64), Error> {
        let whole = ask.bytes.expect("it is known");
        for _ in 0..whole.checked_div(self.0).unwrap_or(u64::MAX) {
            sleep(Duration::from_secs(1)).await;
            ask.count.expect("somebody counts").note(self.0);
        }
        Ok((Part::Whole(vec![0; whole as usize].into()), whole))
    }
}

#[tokio::test(start_paused = true)]
async fn a_part_is_waited_for_as_long_as_it_takes_and_the_whole_as_long_as_it_comes() {
    for (bytes_per_s, comes, within_s) in [(0, false, 45), (50_000, true, 101), (100, false, 60)] {
        let source = Retrying::new(Streaming(bytes_per_s));
        let begun = Instant::now();
        let ask = Ask::of("/o/stream").having(Some(5_000_000));
        let came = source.get_range(ask, 20_000..30_000).await;
        assert_eq!(came.is_ok(), comes, "{bytes_per_s}");
        assert!(
            begun.elapsed() <= Duration::from_secs(within_s),
            "{:?}",
            begun.elapsed()
        );
        assert_eq!(
            source.patience.hopes(),
            bytes_per_s > 0,
            "a range that is silent is silence"
        );
    }
}

#[tokio::test(start_paused = true)]
async fn what_could_not_be_had_is_tried_once_when_it_is_wanted_again() {
    let source = shaky(TRIES + 2, away);
    let mut asked = 0;
    let mut tries = async |source: &Retrying<Shaky>| {
        let came = source.get("/v1/file").await.is_ok();
        let before = std::mem::replace(&mut asked, source.source.asked.load(Ordering::Relaxed));
        (came, asked - before)
    };
    assert_eq!(tries(&source).await, (false, TRIES));
    assert_eq!(tries(&source).await, (false, 1));
    assert_eq!(tries(&source).await, (false, 1));
    assert_eq!(tries(&source).await, (true, 1));
    assert!(source.lost().is_empty());
}

#[tokio::test(start_paused = true)]
async fn what_will_not_pass_is_asked_once() {
    let refused = |path: &str| {
        Err(Error::Refused {
            path: path.to_owned(),
            status: 403,
        })
    };
    for failure in [refused, |path: &str| Err(Error::Missing(path.to_owned()))] {
        let source = shaky(1, failure);
        source.get("/v1/scenes/town/index.json").await.unwrap_err();
        assert_eq!(source.source.asked.load(Ordering::Relaxed), 1);
    }
}

#[test]
fn waits_grow_and_differ() {
    let waits = |path: &str| (1..TRIES).map(|tried| wait(path, tried)).collect::<Vec<_>>();
    assert_ne!(waits("/a"), waits("/b"));
    for (tried, wait) in (0..).zip(waits("/a")) {
        let mean = FIRST_WAIT * LONGER.pow(tried);
        assert!((mean / 2..=mean * 3 / 2).contains(&wait), "{wait:?}");
    }
}
