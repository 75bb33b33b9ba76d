//! What becomes of a scene when somebody goes away, or the catalogue does, between two steps? Asked without a wire.

use std::{
    future::Future,
    pin::{Pin, pin},
    sync::Arc,
    task::{Context, Poll, Waker},
    time::Duration,
};

use belvedere::{
    db::{Catalogue, FILE_NAME, Taking},
    live::{Door, Live, LiveError, LiveSettings, Opened, SessionHandle, Sources},
    published::Publications,
    store::BlobStore,
};
use belvedere_live::{
    aoi::Aoi,
    event::SessionId,
    world::{Look, NewMover, Sent, Visitor},
};
use belvedere_scene::{Bounds, ObjectId, SceneName};
use futures_util::StreamExt;
use object_store::{GetResult, ObjectStoreExt, limit::LimitStore, memory::InMemory, path::Path as Key};
use sqlx::{Connection, Executor, SqliteConnection};
use tokio::task::JoinSet;
use tokio_util::sync::CancellationToken;

use crate::scene::publish;

/// A scene without a server around it.
struct Inside {
    live: Live,
    publications: Publications,
    catalogue: Catalogue,
    blobs: BlobStore,
    data: tempfile::TempDir,
    stopping: CancellationToken,
}

impl Drop for Inside {
    fn drop(&mut self) {
        self.stopping.cancel();
    }
}

impl Inside {
    async fn new() -> Self {
        Self::start_with(LiveSettings::default()).await
    }

    async fn start_with(settings: LiveSettings) -> Self {
        let data = tempfile::tempdir().unwrap();
        let blobs = BlobStore::open_folder(data.path(), 1 << 20).await.unwrap();
        Self::begin(data, &blobs.clone(), blobs, settings).await
    }

    /// A store that answers as long as nobody holds all of its [`TURNS`].
    async fn over(store: &Arc<LimitStore<InMemory>>) -> Self {
        let open = async || BlobStore::open_over(store.clone(), 1 << 20).await.unwrap();
        // Whoever reads has in memory nothing of what was written.
        let settings = LiveSettings::default();
        Self::begin(tempfile::tempdir().unwrap(), &open().await, open().await, settings).await
    }

    async fn begin(data: tempfile::TempDir, written: &BlobStore, blobs: BlobStore, settings: LiveSettings) -> Self {
        let catalogue = Catalogue::open(data.path()).await.unwrap();
        publish(&catalogue, written, "A row").await;
        let stopping = CancellationToken::new();
        let (poll, ends) = (Duration::from_secs(3_600), stopping.clone());
        let publications = Publications::follow(catalogue.clone(), blobs.clone(), poll, ends)
            .await
            .unwrap();
        let sources = Sources {
            publications: publications.clone(),
            catalogue: catalogue.clone(),
            recorder: None,
            nodes: None,
        };
        let live = Live::new(sources, settings, stopping.clone()).await;
        Self {
            live: live.unwrap(),
            publications,
            catalogue,
            blobs,
            data,
            stopping,
        }
    }

    async fn enter(&self) -> Opened {
        self.live.open(&row(), visitor(), false, None).await.unwrap()
    }

    /// Somebody who has entered.
    async fn person(&self) -> SessionHandle {
        let opened = self.enter().await;
        self.live.session(opened.session, Some(opened.token)).await.unwrap()
    }

    fn revision(&self) -> belvedere_scene::Revision {
        self.publications.scene(&row()).unwrap().pointer.revision
    }
}

fn row() -> SceneName {
    "row".parse().unwrap()
}

fn sent(x: f64) -> Sent {
    Sent {
        t_ms: None,
        position: [x, 0.5, 0.5],
        orientation: [0.0, 0.0, 0.0, 1.0],
        velocity: None,
        acceleration: None,
    }
}

fn look() -> Look {
    Look {
        name: String::new(),
        model: None,
    }
}

fn visitor() -> Visitor {
    Visitor {
        pose: sent(0.5),
        aoi: Aoi {
            enter_m: 50.0,
            leave_m: 60.0,
        },
        max_speed_mps: 3.0,
        max_acceleration_mps2: None,
        radius_m: 0.1,
        look: look(),
        hears_movers: true,
        listens: false,
    }
}

fn mover() -> NewMover {
    NewMover {
        pose: sent(0.5),
        max_speed_mps: 3.0,
        max_acceleration_mps2: None,
        radius_m: 0.1,
        look: look(),
        way: None,
    }
}

fn door(number: u32, open: bool) -> Door {
    Door {
        object: ObjectId(number),
        bounds: Bounds {
            min: [6.2, 0.2, 0.2],
            max: [6.8, 0.8, 0.8],
        },
        open,
    }
}

/// Waits until it holds.
async fn until(holds: impl AsyncFn() -> bool) {
    let waiting = async {
        while !holds().await {
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    };
    let held = tokio::time::timeout(Duration::from_secs(30), waiting).await;
    held.expect("it never holds");
}

/// Asks, and goes away when the scene has answered and nobody has heard it.
async fn ask_and_go<T>(asked: impl Future<Output = T>, answered: impl Fn() -> bool) {
    let mut asked = pin!(asked);
    while !answered() {
        let polled = asked.as_mut().poll(&mut Context::from_waker(Waker::noop()));
        assert!(matches!(polled, Poll::Pending), "the answer was heard");
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
}

#[tokio::test]
async fn whoever_does_not_hear_the_answer_is_not_there() {
    let inside = Inside::new().await;
    let live = &inside.live;
    let now = || live.counts().now;
    for stays in [false, true] {
        ask_and_go(live.create(&row(), mover(), stays, None, None), || now().movers > 0).await;
        until(async || now().movers == 0).await;
    }
    ask_and_go(live.open(&row(), visitor(), false, None), || now().sessions > 0).await;
    until(async || now().sessions == 0).await;
    assert_eq!(inside.catalogue.kept_movers(&row()).await.unwrap(), []);
}

#[tokio::test]
async fn a_home_that_was_forgotten_keeps_the_sessions_that_nobody_has_taken() {
    let inside = Inside::new().await;
    let catalogue = &inside.catalogue;
    let [taken, stays] = [inside.enter().await, inside.enter().await].map(|opened| opened.session.0);
    let line = async |session| catalogue.kept_sessions(&[session]).await.unwrap().remove(0);
    until(async || line(stays).await.is_some() && line(taken).await.is_some()).await;
    let home = line(stays).await.unwrap().home;
    let beats = async || {
        let homes = catalogue.session_homes().await.unwrap();
        homes.iter().find(|known| known.home == home).map(|known| known.beats)
    };
    // Another server takes one, as it does from a server that was not heard of.
    until(async || {
        let takes = Taking {
            session: taken,
            from: home.clone(),
            beats: beats().await.unwrap(),
        };
        catalogue.take_sessions(&[takes], "other").await.unwrap()[0].is_some()
    })
    .await;
    until(async || inside.live.counts().now.sessions == 1).await;
    // And others forget the server, of which nothing was heard for minutes.
    until(async || {
        if let Some(beats) = beats().await {
            catalogue.forget_home(&home, beats).await.unwrap();
        }
        line(stays).await.is_none()
    })
    .await;
    until(async || line(stays).await.is_some_and(|line| line.home == home)).await;
    assert_eq!(line(taken).await.unwrap().home, "other");
    assert_eq!(inside.live.counts().now.sessions, 1);
    assert!(
        inside
            .live
            .session(SessionId(stays), None)
            .await
            .is_err_and(|error| matches!(error, LiveError::NoToken))
    );
}

#[tokio::test]
async fn doors_are_those_of_the_revision_that_people_are_in() {
    let inside = Inside::new().await;
    let live = &inside.live;
    let (token, old) = (inside.enter().await.token, inside.revision());
    publish(&inside.catalogue, &inside.blobs, "Another row").await;
    inside.publications.refresh().await;
    let new = inside.revision();
    assert_ne!(new, old);
    live.set_door(&row(), new, door(6, false), Some(token)).await.unwrap();
    assert!(!live.door_is_open(&row(), ObjectId(6)).await.unwrap());
    let late = live.set_door(&row(), old, door(6, true), Some(token)).await;
    assert!(
        matches!(late, Err(LiveError::Moved { current }) if current == new),
        "{late:?}"
    );
    // Were it a door of the old revision, it would be open when the next tick has gone on to the new one.
    tokio::time::sleep(LiveSettings::default().tick * 3).await;
    assert!(!live.door_is_open(&row(), ObjectId(6)).await.unwrap());
}

#[tokio::test]
async fn a_catalogue_that_does_not_answer_keeps_nobody_from_moving() {
    let inside = Inside::new().await;
    let (live, revision) = (&inside.live, inside.revision());
    let [a, b] = [inside.enter().await, inside.enter().await];
    let file = format!("sqlite:{}", inside.data.path().join(FILE_NAME).display());
    let mut beside = SqliteConnection::connect(&file).await.unwrap();
    beside.execute("BEGIN IMMEDIATE").await.unwrap();
    let mut doors = JoinSet::new();
    for (token, first) in [(a.token, 1_000), (b.token, 2_000)] {
        for number in first..first + 200 {
            let live = live.clone();
            doors.spawn(async move {
                let moved = live.set_door(&row(), revision, door(number, false), Some(token)).await;
                (ObjectId(number), moved)
            });
        }
    }
    let (object, refused) = doors.join_next().await.unwrap().unwrap();
    assert!(matches!(refused, Err(LiveError::Behind)), "{refused:?}");
    assert!(live.door_is_open(&row(), object).await.unwrap(), "it has not moved");
    let session = live.session(a.session, Some(a.token)).await.unwrap();
    session.pose(sent(1.5)).await.unwrap();
    beside.execute("ROLLBACK").await.unwrap();
    let mut kept = 0;
    while let Some(moved) = doors.join_next().await {
        kept += usize::from(moved.unwrap().1.is_ok());
    }
    assert!(kept > 0);
    assert_eq!(inside.catalogue.kept_doors(&row(), revision).await.unwrap().len(), kept);
}

/// So much of a store is read at once.
const TURNS: usize = 4;

/// Takes all turns of a store: nobody else is answered before they are given back.
async fn hold(store: &LimitStore<InMemory>) -> Vec<GetResult> {
    let key = Key::from("held");
    store.put(&key, "held".into()).await.unwrap();
    let mut held = Vec::new();
    for _ in 0..TURNS {
        held.push(store.get(&key).await.unwrap());
    }
    held
}

/// Asks, which nobody answers yet.
fn begin<'a, T>(asked: impl Future<Output = T> + Send + 'a) -> Pin<Box<dyn Future<Output = T> + Send + 'a>> {
    // Nobody else gets a turn meanwhile.
    let mut asked = Box::pin(tokio::task::unconstrained(asked));
    assert!(is_open(&mut asked.as_mut()), "it was answered at once");
    asked
}

/// Whether somebody is still waiting for an answer.
fn is_open<F: Future + ?Sized>(asked: &mut Pin<&mut F>) -> bool {
    asked
        .as_mut()
        .poll(&mut Context::from_waker(Waker::noop()))
        .is_pending()
}

fn at(t_ms: i64, x: f64) -> Sent {
    Sent {
        t_ms: Some(t_ms),
        ..sent(x)
    }
}

#[tokio::test]
async fn a_store_that_hangs_holds_up_who_needs_it_in_order_and_nobody_else() {
    let store = Arc::new(LimitStore::new(InMemory::new(), TURNS));
    let inside = Inside::over(&store).await;
    let (live, aoi) = (inside.live.clone(), visitor().aoi);
    let [here, goes] = [inside.person().await, inside.person().await];
    let held = hold(&store).await;
    // What is seen from there must be read first, and what comes after that waits for its turn.
    let mut poses: Vec<_> = [at(100, 6.5), at(200, 0.6)].map(|sent| begin(goes.pose(sent))).into();
    let mut looks = begin(goes.set_aoi(aoi));
    let mut ends = begin(goes.close());
    let mut after = begin(goes.pose(at(300, 0.5)));
    let newcomer = Visitor {
        pose: sent(6.5),
        ..visitor()
    };
    let comes = tokio::spawn(async move { live.open(&row(), newcomer, false, None).await });
    for step in 0..20 {
        here.pose(at(100 * step, 0.4 + 0.01 * step as f64)).await.unwrap();
        inside.person().await;
    }
    poses.push(after);
    assert!(poses.iter_mut().all(|pose| is_open(&mut pose.as_mut())));
    assert!(is_open(&mut looks.as_mut()) && is_open(&mut ends.as_mut()) && !comes.is_finished());
    drop(held);
    after = poses.pop().unwrap();
    let mut cells = Vec::new();
    for pose in poses {
        cells.push(pose.await.unwrap().place.cell.0);
    }
    assert_eq!(cells, [6, 0]);
    looks.await.unwrap();
    ends.await.unwrap();
    assert!(after.await.is_err(), "it came after the end");
    assert_eq!(comes.await.unwrap().unwrap().seen.place.cell.0, 6);
}

#[tokio::test]
async fn of_a_flood_of_poses_that_wait_for_a_store_few_are_kept_and_the_newest_counts() {
    const FLOOD: i64 = 900;
    let store = Arc::new(LimitStore::new(InMemory::new(), TURNS));
    let inside = Inside::over(&store).await;
    let [here, floods] = [inside.person().await, inside.person().await];
    let held = hold(&store).await;
    let place = |i| if i < FLOOD { 6.5 } else { 5.5 };
    let mut poses: Vec<_> = (1..=FLOOD).map(|i| begin(floods.pose(at(i, place(i))))).collect();
    here.pose(sent(0.5)).await.unwrap();
    let before = poses.len();
    let mut answered = 0;
    poses.retain_mut(
        |pose| match pose.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
            Poll::Pending => true,
            Poll::Ready(answer) => {
                assert!(matches!(answer, Err(LiveError::Flooded { .. })), "{answer:?}");
                answered += 1;
                false
            }
        },
    );
    assert!(answered > 0 && answered + poses.len() == before);
    drop(held);
    for pose in poses {
        assert_eq!(pose.await.unwrap().place.cell.0, 6);
    }
    let mut stream = floods.events(None);
    let there = async { while !String::from_utf8_lossy(&stream.next().await.unwrap()).contains(r#""cell":"c5""#) {} };
    tokio::time::timeout(Duration::from_secs(30), there)
        .await
        .expect("the newest counts");
}

#[tokio::test]
async fn one_address_has_no_more_than_its_share_and_others_come_in() {
    let inside = Inside::start_with(LiveSettings {
        sessions_of_an_address: 1,
        persistent: 2,
        ..LiveSettings::default()
    })
    .await;
    let live = &inside.live;
    let [one, other] = [1, 2].map(|last| Some(std::net::IpAddr::from([10, 0, 0, last])));
    let opened = live.open(&row(), visitor(), false, one).await.unwrap();
    let refused = live.open(&row(), visitor(), false, one).await;
    assert!(
        matches!(refused, Err(LiveError::Crowded { most: 1, .. })),
        "{refused:?}"
    );
    live.open(&row(), visitor(), false, other).await.unwrap();
    let session = live.session(opened.session, Some(opened.token)).await.unwrap();
    session.close().await.unwrap();
    live.open(&row(), visitor(), false, one).await.unwrap();
    live.create(&row(), mover(), true, None, one).await.unwrap();
    let refused = live.create(&row(), mover(), true, None, one).await;
    assert!(
        matches!(refused, Err(LiveError::Crowded { most: 1, .. })),
        "{refused:?}"
    );
    live.create(&row(), mover(), true, None, other).await.unwrap();
    assert_eq!(live.counts().crowded, 2);
}
