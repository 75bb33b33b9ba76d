//! Do programs meet each other through the client crate? Two of them, in two rooms with a door between them.

use std::{
    net::SocketAddr,
    sync::{Arc, Mutex},
    time::Duration,
};

use belvedere_client::{
    Error, HttpSource,
    live::{Gone, LiveEvent, Participant, Session, SessionEvent, Stand},
};
use belvedere_scene::ObjectId;
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::{TcpListener, TcpStream},
    task::JoinSet,
    time::{Instant, timeout_at},
};

use crate::{
    boxes::two_rooms,
    doors::{document, names},
    program::{Data, Server},
};

const PATIENCE: Duration = Duration::from_secs(30);
const FRAME: Duration = Duration::from_millis(10);

/// Somebody who stands somewhere and keeps what it was told.
pub(crate) struct Person {
    pub(crate) session: Session,
    pub(crate) position: [f64; 3],
    pub(crate) told: Vec<SessionEvent>,
}

impl Person {
    pub(crate) async fn enter(base: &str, name: &str, position: [f64; 3]) -> Self {
        let source = HttpSource::new(base).expect("an address");
        let who = Participant {
            name: Some(name.to_owned()),
            radius_m: 0.3,
            max_speed_mps: 1.5,
            ..Participant::default()
        };
        let rooms = "rooms".parse().expect("a name");
        let offered = Session::offered(source, &rooms, who).await.expect("an answer");
        Self {
            session: offered.expect("sessions"),
            position,
            told: Vec::new(),
        }
    }

    /// Stands there for a frame.
    pub(crate) async fn live(&mut self) {
        self.session.stand(Stand::upright(self.position), [0.0; 3]);
        let end = Instant::now() + FRAME;
        while let Ok(Some(event)) = timeout_at(end, self.session.advance()).await {
            self.told.push(event);
        }
        tokio::time::sleep_until(end).await;
    }

    /// Names and places of those who can be seen.
    fn sees(&self) -> Vec<(&str, [f64; 3])> {
        let movers = self.session.company().movers(self.session.now_ms());
        movers
            .map(|mover| (mover.info.source_node.as_str(), mover.stand.position))
            .collect()
    }

    fn sees_near(&self, name: &str, position: [f64; 3]) -> bool {
        let is_near = |at: [f64; 3]| (0..3).all(|a| (at[a] - position[a]).abs() < 0.05);
        matches!(self.sees()[..], [(seen, at)] if seen == name && is_near(at))
    }

    pub(crate) fn was_told(&self, matches: impl Fn(&LiveEvent) -> bool) -> usize {
        let told = self.told.iter();
        told.filter(|event| matches!(event, SessionEvent::Told(event) if matches(event)))
            .count()
    }
}

/// Both live until something is so.
async fn until(what: &str, west: &mut Person, east: &mut Person, is_so: impl Fn(&Person, &Person) -> bool) {
    let end = Instant::now() + PATIENCE;
    while !is_so(west, east) {
        assert!(
            Instant::now() < end,
            "never {what}: {:?} and {:?}",
            west.told,
            east.told
        );
        west.live().await;
        east.live().await;
    }
}

/// A line to a server that can be cut, as by a proxy that says 502 while its server is away.
pub(crate) struct Cable {
    pub(crate) base: String,
    server: Arc<Mutex<Option<SocketAddr>>>,
    carried: Arc<Mutex<JoinSet<()>>>,
}

impl Cable {
    pub(crate) async fn to(server: SocketAddr) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
        let base = format!("http://{}", listener.local_addr().expect("an address"));
        let carried = Arc::new(Mutex::new(JoinSet::new()));
        let (all, leads_to) = (carried.clone(), Arc::new(Mutex::new(Some(server))));
        let server = leads_to.clone();
        tokio::spawn(async move {
            while let Ok((mut near, _)) = listener.accept().await {
                let server = *leads_to.lock().expect("nobody panics");
                let carry = async move {
                    let Some(server) = server else {
                        _ = near.read(&mut [0; 4096]).await;
                        let gone = b"HTTP/1.1 502 Bad Gateway\r\nContent-Length: 0\r\nConnection: close\r\n\r\n";
                        _ = near.write_all(gone).await;
                        return;
                    };
                    let mut far = TcpStream::connect(server).await.expect("the server");
                    _ = tokio::io::copy_bidirectional(&mut near, &mut far).await;
                };
                all.lock().expect("nobody panics").spawn(carry);
            }
        });
        Self { base, server, carried }
    }

    fn cut(&self) {
        self.carried.lock().expect("nobody panics").abort_all();
    }

    /// From the next connection on.
    pub(crate) fn lead_to(&self, server: Option<SocketAddr>) {
        *self.server.lock().expect("nobody panics") = server;
    }
}

async fn door_of(server: &Server) -> ObjectId {
    let source = HttpSource::new(&server.base).expect("an address");
    let around = document(&source, "/v1/scenes/rooms/objects?bbox=5,0,2,5.2,2.2,3").await;
    let door = names(&around).into_iter().find(|(node, _)| node == "door:between");
    door.expect("a door").1.parse().expect("an id")
}

fn hidden(event: &LiveEvent) -> bool {
    matches!(
        event,
        LiveEvent::Vanish {
            reason: Gone::Hidden,
            ..
        }
    )
}

fn appears(event: &LiveEvent) -> bool {
    matches!(event, LiveEvent::Appear(_))
}

#[tokio::test(flavor = "multi_thread")]
async fn two_programs_meet_lose_each_other_behind_a_door_and_survive_a_cut() {
    let data = Data::new();
    data.bake(&data.write("rooms.glb", two_rooms()), "rooms");
    let server = data.serve();
    let door = door_of(&server).await;
    let cable = Cable::to(server.address()).await;
    let mut west = Person::enter(&cable.base, "West", [2.5, 1.5, 2.5]).await;
    let mut east = Person::enter(&server.base, "East", [8.0, 1.5, 2.5]).await;
    assert!(matches!(
        west.session.set_door(door, false).await,
        Err(Error::NoSession)
    ));

    until("met", &mut west, &mut east, |west, east| {
        west.sees_near("East", [8.0, 1.5, 2.5]) && east.sees_near("West", [2.5, 1.5, 2.5])
    })
    .await;
    east.position[0] = 8.3;
    until("moved", &mut west, &mut east, |west, _| {
        west.sees_near("East", [8.3, 1.5, 2.5])
    })
    .await;

    west.session.set_door(door, false).await.expect("it closes");
    until("hidden", &mut west, &mut east, |west, east| {
        west.sees().is_empty() && east.sees().is_empty()
    })
    .await;
    for person in [&west, &east] {
        assert!(person.session.company().closed_doors().contains(&door));
        assert_eq!(person.was_told(hidden), 1);
    }
    // Where it goes meanwhile is not told.
    east.position[0] = 8.5;
    let told_before = west.was_told(|event| matches!(event, LiveEvent::Move(_)));
    for _ in 0..50 {
        west.live().await;
        east.live().await;
    }
    let told = west.was_told(|event| matches!(event, LiveEvent::Move(_)));
    assert_eq!((west.sees(), told), (vec![], told_before));
    assert!(east.was_told(|event| matches!(event, LiveEvent::Hush(_))) > 0);

    east.session.set_door(door, true).await.expect("it opens");
    until("found again", &mut west, &mut east, |west, east| {
        west.sees_near("East", [8.5, 1.5, 2.5]) && east.sees_near("West", [2.5, 1.5, 2.5])
    })
    .await;
    assert_eq!(west.was_told(appears), 1, "its info was kept");

    cable.cut();
    until("cut", &mut west, &mut east, |west, _| {
        west.told.iter().any(|event| matches!(event, SessionEvent::Cut(_)))
    })
    .await;
    east.position[0] = 8.7;
    until("resumed", &mut west, &mut east, |west, _| {
        west.sees_near("East", [8.7, 1.5, 2.5])
    })
    .await;
    let resync = west.was_told(|event| matches!(event, LiveEvent::Resync));
    assert_eq!((resync, west.was_told(appears)), (0, 1), "{:?}", west.told);

    east.session.close().await.expect("it leaves");
    let left = |event: &LiveEvent| {
        matches!(
            event,
            LiveEvent::Vanish {
                reason: Gone::Destroyed,
                ..
            }
        )
    };
    let end = Instant::now() + PATIENCE;
    while west.was_told(left) == 0 {
        assert!(Instant::now() < end, "it never left: {:?}", west.told);
        west.live().await;
    }
    assert!(west.sees().is_empty());
    west.session.close().await.expect("it leaves");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_that_has_ended_is_opened_anew_after_a_while() {
    let data = Data::new();
    data.bake(&data.write("rooms.glb", two_rooms()), "rooms");
    let server = data.serve_with(&["--lease-s", "1"]);
    let cable = Cable::to(server.address()).await;
    let mut person = Person::enter(&cable.base, "West", [2.5, 1.5, 2.5]).await;
    let end = Instant::now() + PATIENCE;
    while person.was_told(|event| matches!(event, LiveEvent::Hello(_))) == 0 {
        assert!(Instant::now() < end, "never greeted: {:?}", person.told);
        person.live().await;
    }
    cable.cut();
    // Nobody listens and nobody speaks for longer than the lease.
    tokio::time::sleep(Duration::from_millis(2500)).await;
    let opened = |person: &Person| {
        let told = person.told.iter();
        told.filter(|event| matches!(event, SessionEvent::Opened(_))).count()
    };
    let end = Instant::now() + PATIENCE;
    while opened(&person) < 2 {
        assert!(Instant::now() < end, "never again: {:?}", person.told);
        person.live().await;
    }
    let lost = person
        .told
        .iter()
        .filter(|event| matches!(event, SessionEvent::Lost(_)));
    assert_eq!(lost.count(), 1, "{:?}", person.told);
}
