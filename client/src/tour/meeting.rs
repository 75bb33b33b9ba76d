//! Whom does a visitor meet along its way? In a live scene, and so in real time: it opens a session, says where it is ten times
//! a second where that need be said, follows the events, and leaves. What is measured is counted by this side alone.
//!
//! How late events are is measured with one clock: when the visitors of one process tell each other of themselves, the
//! process knows when a pose was said and when somebody else heard it ([`Echoes`]).

use std::{
    collections::{HashMap, HashSet, VecDeque},
    sync::Mutex,
    time::Duration,
};

use belvedere_scene::{ObjectId, SceneName};
use serde::Serialize;
use tokio::time::{Instant, sleep_until, timeout_at};

use super::{outcome::Latency, script::Script};
use crate::{
    Error, HttpSource,
    live::{LiveEvent, Participant, Session, SessionEvent, Speech, Stand},
};

/// Between two looks at where one is.
const FRAME: Duration = Duration::from_millis(100);
/// Delays are counted by the millisecond, up to so many.
const MOST_MS: usize = 60_000;
/// So many poses of each visitor are remembered: all that are said in that time.
const REMEMBERED: usize = MOST_MS / FRAME.as_millis() as usize;
/// So many failures are told with their reasons.
const TOLD: usize = 5;

/// What became of visitors in a live scene.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Meeting {
    /// Sessions that were opened, those that were opened anew too.
    pub opened: u64,
    /// Visitors who had one at least once.
    pub inside: u64,
    /// Others who came into view, each once for each visitor who met it.
    pub movers_met: u64,
    /// Events that were told, …
    pub events: u64,
    /// … and poses in them.
    pub poses_told: u64,
    /// Poses that were said, …
    pub poses_said: u64,
    /// … that were not, because nobody might look, …
    pub poses_hushed: u64,
    /// … and moments at which others knew anyway.
    pub poses_known: u64,
    /// Moments at which nothing could be said: there was no session, no answer yet, or the server had asked for silence.
    pub poses_waited: u64,
    /// How often all that had been told was void.
    pub resyncs: u64,
    /// Streams that were cut and resumed.
    pub cuts: u64,
    /// Sessions that ended before their visitors left.
    pub lost: u64,
    /// What went wrong besides, each time …
    pub failures: u64,
    /// … and the first of all that went wrong, with their reasons.
    pub first_failures: Vec<String>,
    /// Moments that came later than they should by more than one: this side was too slow.
    pub late_frames: u64,
}

impl Meeting {
    /// Both together.
    #[must_use]
    pub fn and(mut self, other: Self) -> Self {
        self.first_failures.extend(other.first_failures);
        self.first_failures.truncate(TOLD);
        Self {
            opened: self.opened + other.opened,
            inside: self.inside + other.inside,
            movers_met: self.movers_met + other.movers_met,
            events: self.events + other.events,
            poses_told: self.poses_told + other.poses_told,
            poses_said: self.poses_said + other.poses_said,
            poses_hushed: self.poses_hushed + other.poses_hushed,
            poses_known: self.poses_known + other.poses_known,
            poses_waited: self.poses_waited + other.poses_waited,
            resyncs: self.resyncs + other.resyncs,
            cuts: self.cuts + other.cuts,
            lost: self.lost + other.lost,
            failures: self.failures + other.failures,
            first_failures: self.first_failures,
            late_frames: self.late_frames + other.late_frames,
        }
    }

    fn fail(&mut self, cause: &Error) {
        if self.first_failures.len() < TOLD {
            self.first_failures.push(cause.to_string());
        }
    }
}

/// Where a visitor said that it is, and when; the latest last.
type Said = VecDeque<([f64; 3], Instant)>;

/// When the visitors of this process said where they are, and how much later others of them heard it.
#[derive(Debug)]
pub struct Echoes {
    said: Mutex<HashMap<ObjectId, Said>>,
    /// How many were so many milliseconds late.
    heard: Mutex<Vec<u32>>,
}

impl Default for Echoes {
    fn default() -> Self {
        Self {
            said: Mutex::default(),
            heard: Mutex::new(vec![0; MOST_MS + 1]),
        }
    }
}

impl Echoes {
    /// Milliseconds from the moment at which a pose was said to that at which another visitor was told of it; none when nobody
    /// was. It holds the request, the server's tick, its pacing of those who are far away, and the stream. A place where
    /// somebody was more than once is not counted.
    #[must_use]
    pub fn delays(&self) -> Option<(u64, Latency)> {
        let heard = self.heard.lock().expect("nothing panics while it holds this lock");
        let count: u64 = heard.iter().map(|count| u64::from(*count)).sum();
        let below = |share: f64| {
            let (wanted, mut met) = (share * count as f64, 0.0);
            let at = heard.iter().position(|count| {
                met += f64::from(*count);
                met >= wanted
            });
            at.unwrap_or(MOST_MS) as f64
        };
        (count > 0).then(|| {
            let latency = Latency {
                p50: below(0.5),
                p99: below(0.99),
            };
            (count, latency)
        })
    }

    fn say(&self, object: ObjectId, position: [f64; 3]) {
        let mut said = self.said.lock().expect("nothing panics while it holds this lock");
        let poses = said.entry(object).or_default();
        if poses.len() == REMEMBERED {
            poses.pop_front();
        }
        poses.push_back((position, Instant::now()));
    }

    fn hear(&self, object: ObjectId, position: [f64; 3], now: Instant) {
        let said = self.said.lock().expect("nothing panics while it holds this lock");
        let poses = said.get(&object).into_iter().flatten();
        let mut there = poses.filter(|(place, _)| *place == position);
        // Nobody knows which of several poses at one place was heard, as of who turns on the spot.
        let (Some((_, when)), None) = (there.next(), there.next()) else {
            return;
        };
        let late_ms = now.saturating_duration_since(*when).as_millis() as usize;
        drop(said);
        let mut heard = self.heard.lock().expect("nothing panics while it holds this lock");
        heard[late_ms.min(MOST_MS)] += 1;
    }
}

/// Goes along a script in a live scene; `None` where the scene offers no sessions, as a static tree's.
///
/// # Errors
/// When there is no such scene, or its pointer cannot be fetched. What goes wrong later is counted.
pub async fn meet(
    source: HttpSource,
    scene: &SceneName,
    script: &Script,
    who: Participant,
    echoes: &Echoes,
) -> Result<Option<Meeting>, Error> {
    let Some(session) = Session::offered(source, scene, who).await? else {
        return Ok(None);
    };
    let guest = Guest {
        session,
        echoes,
        own: None,
        met: HashSet::new(),
        in_view: HashSet::new(),
        meeting: Meeting::default(),
    };
    Ok(Some(guest.walk(script).await))
}

/// One visitor.
struct Guest<'e> {
    session: Session,
    echoes: &'e Echoes,
    own: Option<ObjectId>,
    met: HashSet<ObjectId>,
    /// Those whose places one has been told since they came into view.
    in_view: HashSet<ObjectId>,
    meeting: Meeting,
}

impl Guest<'_> {
    async fn walk(mut self, script: &Script) -> Meeting {
        let [from_ms, to_ms] = script.times_ms();
        let started = Instant::now();
        let mut due = started;
        loop {
            let now = Instant::now();
            self.meeting.late_frames += u64::from(now > due + FRAME);
            let t_ms = from_ms + 1000.0 * (now - started).as_secs_f64();
            self.stand(script, t_ms.min(to_ms));
            if t_ms >= to_ms {
                break;
            }
            due = (due + FRAME).max(now);
            while let Ok(Some(event)) = timeout_at(due, self.session.advance()).await {
                self.take(event);
            }
            sleep_until(due).await;
        }
        self.meeting.inside = u64::from(self.meeting.opened > 0);
        self.meeting.movers_met = self.met.len() as u64;
        if let Err(cause) = self.session.close().await {
            self.meeting.failures += 1;
            self.meeting.fail(&cause);
        }
        self.meeting
    }

    fn stand(&mut self, script: &Script, t_ms: f64) {
        let stand = Stand {
            position: script.at(t_ms),
            orientation: script.orientation(t_ms),
        };
        let meeting = &mut self.meeting;
        match self.session.stand(stand, script.velocity_mps(t_ms)) {
            Speech::Said(pose) => {
                meeting.poses_said += 1;
                if let Some(own) = self.own {
                    self.echoes.say(own, pose.position);
                }
            }
            Speech::Hushed => meeting.poses_hushed += 1,
            Speech::Known => meeting.poses_known += 1,
            Speech::Waiting => meeting.poses_waited += 1,
        }
    }

    fn take(&mut self, event: SessionEvent) {
        match event {
            SessionEvent::Opened(own) => {
                self.own = Some(own);
                self.meeting.opened += 1;
            }
            SessionEvent::Told(event) => {
                self.meeting.events += 1;
                self.hear(&event);
            }
            SessionEvent::Cut(cause) => {
                self.meeting.cuts += 1;
                self.meeting.fail(&cause);
            }
            SessionEvent::Lost(cause) => {
                self.meeting.lost += 1;
                self.meeting.fail(&cause);
                self.in_view.clear();
            }
            SessionEvent::Problem(cause) => {
                self.meeting.failures += 1;
                self.meeting.fail(&cause);
            }
        }
    }

    fn hear(&mut self, event: &LiveEvent) {
        match event {
            LiveEvent::Appear(appearance) => {
                self.met.insert(appearance.info.object);
                self.in_view.insert(appearance.info.object);
            }
            LiveEvent::Move(poses) => {
                self.meeting.poses_told += poses.len() as u64;
                let now = Instant::now();
                for (object, pose) in poses {
                    // Where somebody is who comes into view again may have been said long ago.
                    if !self.in_view.insert(*object) {
                        self.echoes.hear(*object, pose.position, now);
                    }
                }
            }
            LiveEvent::Vanish { objects, .. } => objects.iter().for_each(|object| _ = self.in_view.remove(object)),
            LiveEvent::Resync => {
                self.meeting.resyncs += 1;
                self.in_view.clear();
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(start_paused = true)]
    async fn delays_are_those_of_poses_that_were_said_here() {
        let (echoes, [me, other]) = (Echoes::default(), [1, 2].map(ObjectId));
        assert_eq!(echoes.delays(), None);
        for second in 0..3 {
            echoes.say(me, [f64::from(second), 0.0, 0.0]);
            tokio::time::advance(Duration::from_secs(1)).await;
        }
        let now = Instant::now();
        echoes.hear(me, [2.0, 0.0, 0.0], now);
        echoes.hear(me, [1.0, 0.0, 0.0], now);
        echoes.hear(me, [7.0, 0.0, 0.0], now);
        echoes.hear(other, [2.0, 0.0, 0.0], now);
        let wanted = Latency {
            p50: 1000.0,
            p99: 2000.0,
        };
        assert_eq!(echoes.delays(), Some((2, wanted)));
    }

    #[tokio::test(start_paused = true)]
    async fn delays_are_as_long_as_they_are_and_those_of_who_stands_and_turns_are_not_counted() {
        let (echoes, me) = (Echoes::default(), ObjectId(1));
        for frame in 0..100 {
            echoes.say(me, [f64::from(frame), 0.0, 0.0]);
            tokio::time::advance(FRAME).await;
        }
        echoes.say(me, [50.0, 0.0, 0.0]);
        let now = Instant::now();
        echoes.hear(me, [50.0, 0.0, 0.0], now);
        assert_eq!(echoes.delays(), None);
        echoes.hear(me, [0.0; 3], now);
        let wanted = Latency {
            p50: 10_000.0,
            p99: 10_000.0,
        };
        assert_eq!(echoes.delays(), Some((1, wanted)));
    }
}
