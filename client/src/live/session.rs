//! How does one take part in a live scene? Opens a session, listens to its events, says where one is, and opens it anew when it
//! has ended.

use std::{
    collections::VecDeque,
    sync::Arc,
    time::{Duration, Instant},
};

use belvedere_scene::{ObjectId, SceneName};
use tokio::task::JoinSet;

use super::{
    ear::{Ear, Silence},
    state::{
        company::Company,
        event::{self, LiveEvent},
        motion::{Pose, Stand},
        speaker::{Speaker, Speech},
        sse::Message,
    },
    wire::{Answered, Opened, Participant, Wire},
};
use crate::{Error, HttpSource, source::about};

/// Before a session is opened anew.
const AGAIN_AFTER: Duration = Duration::from_secs(5);
/// After a pose that nobody answered nothing is said for so long.
const AFTER_A_FAILURE_MS: f64 = 1000.0;

/// Takes part in one scene. Dropped without [`Session::close`], it ends with its lease.
#[derive(Debug)]
pub struct Session {
    wire: Arc<Wire>,
    who: Participant,
    /// Where the clock begins.
    started: Instant,
    line: Line,
    company: Company,
    speaker: Speaker,
    tasks: JoinSet<Brought>,
    events: VecDeque<SessionEvent>,
}

#[derive(Debug)]
enum Line {
    Closed {
        again: Instant,
    },
    Opening,
    Open {
        opened: Arc<Opened>,
        /// A pose is under way.
        saying: bool,
        /// How often the stream has woken it.
        wakes: u32,
    },
}

/// What has happened.
#[derive(Debug)]
pub enum SessionEvent {
    /// One is in the scene, as this mover.
    Opened(ObjectId),
    /// The server has told something, and [`Session::company`] knows it.
    Told(LiveEvent),
    /// The stream of events was cut; it is resumed.
    Cut(Error),
    /// The session has ended, and nobody is known any more; it is opened anew when one stands somewhere about five seconds
    /// later.
    Lost(Error),
    /// Something went wrong, and the session goes on.
    Problem(Error),
}

/// What a task brings.
enum Brought {
    Opened(Result<Opened, Error>),
    Heard(Box<Ear>, Result<Vec<Message>, Silence>, Instant),
    Said(Result<Answered, Error>, u32),
}

impl Session {
    /// A session that is opened when one first stands somewhere; `None` where the scene offers none, as a static tree's.
    ///
    /// # Errors
    /// When there is no such scene, or its pointer cannot be fetched.
    pub async fn offered(source: HttpSource, scene: &SceneName, who: Participant) -> Result<Option<Self>, Error> {
        let wire = Wire::find(source, scene).await?;
        Ok(wire.map(|wire| {
            let started = Instant::now();
            Self {
                wire: Arc::new(wire),
                who,
                started,
                line: Line::Closed { again: started },
                company: Company::default(),
                speaker: Speaker::default(),
                tasks: JoinSet::new(),
                events: VecDeque::new(),
            }
        }))
    }

    /// Others and doors.
    #[must_use]
    pub fn company(&self) -> &Company {
        &self.company
    }

    /// This client's clock, milliseconds: that of [`Company::movers`].
    #[must_use]
    pub fn now_ms(&self) -> f64 {
        self.ms_at(Instant::now())
    }

    fn ms_at(&self, when: Instant) -> f64 {
        when.saturating_duration_since(self.started).as_secs_f64() * 1e3
    }

    /// Whether others may be told of one.
    #[must_use]
    pub fn is_open(&self) -> bool {
        matches!(self.line, Line::Open { .. })
    }

    /// One stands there now and moves so, metres a second: says so when that must be said, and opens the session where it is
    /// closed. To be called in every frame, inside a runtime.
    pub fn stand(&mut self, stand: Stand, velocity: [f64; 3]) -> Speech {
        let now_ms = self.now_ms();
        match &mut self.line {
            Line::Closed { again } if Instant::now() >= *again => {
                self.line = Line::Opening;
                let (wire, who) = (self.wire.clone(), self.who.clone());
                let t_ms = now_ms.round() as i64;
                self.tasks
                    .spawn(async move { Brought::Opened(wire.open(&who, stand, t_ms).await) });
                Speech::Waiting
            }
            Line::Open { opened, saying, wakes } if !*saying => {
                let speech = self.speaker.speak(now_ms, stand.position, stand.orientation, velocity);
                if let Speech::Said(pose) = speech {
                    *saying = true;
                    let (wire, opened, wakes) = (self.wire.clone(), opened.clone(), *wakes);
                    self.tasks.spawn(say(wire, opened, pose, wakes));
                }
                speech
            }
            Line::Open { .. } | Line::Closed { .. } | Line::Opening => Speech::Waiting,
        }
    }

    /// Waits until something has happened, and says what; `None` when nothing is under way, so that nothing will before the
    /// next [`Session::stand`]. May be called off at any time.
    pub async fn advance(&mut self) -> Option<SessionEvent> {
        loop {
            if let Some(event) = self.events.pop_front() {
                return Some(event);
            }
            match self.tasks.join_next().await? {
                Ok(brought) => self.take(brought),
                // Without its tasks a session would be deaf or mute for ever.
                Err(ended) if ended.is_panic() => std::panic::resume_unwind(ended.into_panic()),
                Err(_) => {}
            }
        }
    }

    /// Opens or closes a door for everybody. Whoever sees it is told so as an event.
    ///
    /// # Errors
    /// When it is no door, nobody answers, or no session is open.
    pub async fn set_door(&self, door: ObjectId, open: bool) -> Result<(), Error> {
        self.wire.set_door(self.opened()?, door, open).await
    }

    /// Tells the server how much of what is visible is here, 0 to 1; nobody but its operator hears of it.
    ///
    /// # Errors
    /// When nobody answers, or no session is open.
    pub async fn report(&self, quality: f64) -> Result<(), Error> {
        self.wire.report(self.opened()?, quality).await
    }

    /// Leaves, so that nobody sees one any more.
    ///
    /// # Errors
    /// When nobody answers; the session then ends with its lease.
    pub async fn close(self) -> Result<(), Error> {
        match self.opened() {
            Ok(opened) => self.wire.leave(opened).await,
            Err(_) => Ok(()),
        }
    }

    fn opened(&self) -> Result<&Arc<Opened>, Error> {
        match &self.line {
            Line::Open { opened, .. } => Ok(opened),
            Line::Closed { .. } | Line::Opening => Err(Error::NoSession),
        }
    }

    fn take(&mut self, brought: Brought) {
        match brought {
            Brought::Opened(Ok(opened)) => self.begin(opened),
            Brought::Opened(Err(cause)) => {
                self.line = self.again();
                self.events.push_back(SessionEvent::Problem(cause));
            }
            Brought::Heard(ear, heard, when) => self.hear(ear, heard, when),
            Brought::Said(said, wakes) => self.answered(said, wakes),
        }
    }

    fn begin(&mut self, opened: Opened) {
        self.speaker = Speaker::default();
        if let Some(hush) = opened.hush {
            self.speaker.keep_quiet(hush);
        }
        self.events.push_back(SessionEvent::Opened(opened.object));
        let opened = Arc::new(opened);
        self.line = Line::Open {
            opened: opened.clone(),
            saying: false,
            wakes: 0,
        };
        self.tasks.spawn(hear(self.wire.clone(), opened, Box::new(Ear::new())));
    }

    fn hear(&mut self, ear: Box<Ear>, heard: Result<Vec<Message>, Silence>, when: Instant) {
        match heard {
            Ok(messages) => messages.into_iter().for_each(|message| self.told(&message, when)),
            Err(Silence::Cut(cause)) => self.events.push_back(SessionEvent::Cut(cause)),
            Err(Silence::Ended(cause)) => return self.lose(cause),
        }
        if let Line::Open { opened, .. } = &self.line {
            self.tasks.spawn(hear(self.wire.clone(), opened.clone(), ear));
        }
    }

    fn told(&mut self, message: &Message, when: Instant) {
        let event = match event::read(&message.name, &message.data) {
            Ok(Some(event)) => event,
            Ok(None) => return,
            Err(cause) => {
                let path = format!("the event {}", message.name);
                let cause = cause.to_string();
                let problem = Error::Document { path, cause };
                return self.events.push_back(SessionEvent::Problem(problem));
            }
        };
        if let Line::Open { wakes, .. } = &mut self.line {
            if let LiveEvent::Hush(hush) = &event {
                self.speaker.keep_quiet(*hush);
            } else if event.voids_promises() {
                *wakes += 1;
                self.speaker.wake();
            }
        }
        self.company.take(&event, self.ms_at(when));
        self.events.push_back(SessionEvent::Told(event));
    }

    fn answered(&mut self, said: Result<Answered, Error>, wakes_before: u32) {
        let now_ms = self.now_ms();
        let Line::Open { saying, wakes, .. } = &mut self.line else {
            return;
        };
        *saying = false;
        match said {
            // Whoever was woken meanwhile is watched: the stream may overtake the answer.
            Ok(Answered::Heard { hush: Some(hush) }) if *wakes == wakes_before => self.speaker.keep_quiet(hush),
            Ok(Answered::Heard { .. }) => {}
            Ok(Answered::TooMuch { pause }) => self.speaker.pause(now_ms + pause.as_secs_f64() * 1e3),
            Err(
                cause @ (Error::Missing(_)
                | Error::Refused {
                    status: 401 | 403 | 421,
                    ..
                }),
            ) => self.lose(cause),
            // It may not have been heard: what is to be said then is said, though not at once.
            Err(cause) => {
                self.speaker.pause(now_ms + AFTER_A_FAILURE_MS);
                self.events.push_back(SessionEvent::Problem(cause));
            }
        }
    }

    fn lose(&mut self, cause: Error) {
        self.line = self.again();
        // What is under way concerns a session that is no more.
        self.tasks = JoinSet::new();
        let now_ms = self.now_ms();
        self.company.take(&LiveEvent::Resync, now_ms);
        self.events.push_back(SessionEvent::Lost(cause));
    }

    /// Not all at once, where many were refused together.
    fn again(&self) -> Line {
        let after = about(AGAIN_AFTER, (&self.who.name, self.now_ms().to_bits()));
        Line::Closed {
            again: Instant::now() + after,
        }
    }
}

async fn say(wire: Arc<Wire>, opened: Arc<Opened>, pose: Pose, wakes: u32) -> Brought {
    Brought::Said(wire.say(&opened, &pose).await, wakes)
}

async fn hear(wire: Arc<Wire>, opened: Arc<Opened>, mut ear: Box<Ear>) -> Brought {
    let heard = ear.hear(&wire, &opened).await;
    Brought::Heard(ear, heard, Instant::now())
}
