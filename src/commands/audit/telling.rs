//! What was a session told of, and had it anything to do with that? What is told of a mover that it may see is for
//! [`judge`](super::judge) to decide; the rest can be decided at once.

use belvedere_live::{Ms, event::SessionId};
use belvedere_scene::ObjectId;
use serde::Serialize;
use serde_json::Value;

use super::{account::Account, poses::Untrue};

/// A session was told of a mover.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Telling {
    pub(super) session: SessionId,
    pub(super) object: ObjectId,
    /// The name of the event.
    pub(super) event: &'static str,
}

/// Something was told that nobody could be told.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(super) struct Astray {
    /// Unix time of the server.
    pub(super) at_ms: Ms,
    /// As it is written.
    pub(super) session: String,
    pub(super) event: String,
    /// As it is written, if a mover is named.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) object: Option<String>,
    pub(super) why: &'static str,
}

/// What is wrong with what was told, whatever can be seen.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Wrong {
    /// What is there concerns others alone.
    Leak(Telling),
    Astray(Astray),
    /// It is not so.
    Untrue(Untrue),
}

/// Events that say something of movers.
const OF_MOVERS: [&str; 6] = ["object-info", "object-pos", "object-gone", "rate", "hush", "wake"];

impl Account {
    /// Sessions have been told something: `[session, event, data]`.
    pub(super) fn tell(&mut self, told: &Value, at_ms: Ms) -> Vec<Wrong> {
        let text = |at: usize| told.get(at).and_then(Value::as_str).unwrap_or_default();
        let (event, data) = (text(1), told.get(2).unwrap_or(&Value::Null));
        let astray = |object: Option<&str>, why| {
            Wrong::Astray(Astray {
                at_ms,
                session: text(0).to_owned(),
                event: event.to_owned(),
                object: object.map(str::to_owned),
                why,
            })
        };
        let session = text(0).parse::<SessionId>().ok();
        let Some(session) = session.filter(|session| self.people.contains_key(session)) else {
            let ended = session.is_some_and(|session| self.ended.contains(&session));
            let why = if ended {
                "the session has ended"
            } else {
                "there never was such a session"
            };
            return vec![astray(None, why)];
        };
        if let Some(person) = self.people.get_mut(&session).filter(|_| event == "resync") {
            person.forget();
            self.end_promises_to(session);
        }
        if event == "door" {
            let object = data["object"].as_str().unwrap_or_default();
            let door = object.parse().ok().filter(|door| self.doors.contains_key(door));
            return match door {
                Some(door) => self.tell_door(session, door, data, at_ms).into_iter().collect(),
                None => vec![astray(Some(object), "no such door was ever moved")],
            };
        }
        let Some(event) = OF_MOVERS.into_iter().find(|name| *name == event) else {
            return Vec::new();
        };
        let mut wrong = Vec::new();
        for (named, said) in named(event, data) {
            let object = named.parse::<ObjectId>().ok();
            let was_told = |object: &ObjectId| event == "object-gone" && self.people[&session].known.contains(object);
            match object.filter(|object| self.movers.contains_key(object) || was_told(object)) {
                Some(object) => wrong.extend(self.tell_of(Telling { session, object, event }, said, at_ms)),
                None => wrong.push(astray(Some(named), "there is no such mover")),
            }
        }
        wrong
    }

    /// Takes note of it, and says what is wrong with it at once.
    fn tell_of(&mut self, told: Telling, said: &Value, at_ms: Ms) -> Option<Wrong> {
        let Telling { session, object, event } = told;
        let person = self.people.get_mut(&session)?;
        let concerns = match event {
            "hush" | "wake" => self.movers[&object].owner == Some(session),
            "rate" => person.shown.contains_key(&object),
            "object-gone" => {
                person.shown.remove(&object);
                match said.as_str() {
                    Some("hidden") => person.known.contains(&object),
                    _ => person.known.remove(&object),
                }
            }
            _ => {
                if event == "object-info" {
                    person.known.insert(object);
                }
                person.room = person.room.saturating_sub(usize::from(event == "object-info"));
                self.told.push(told);
                let untrue = self.tell_pose((session, object), event, said, at_ms);
                return untrue.map(Wrong::Untrue);
            }
        };
        if !concerns {
            return Some(Wrong::Leak(told));
        }
        match event {
            "rate" => self.tell_period(session, object, said),
            "hush" => return self.promise(object, said, at_ms).map(Wrong::Untrue),
            "wake" => self.movers.get_mut(&object)?.promise = None,
            _ => {}
        }
        None
    }
}

/// The movers that an event names, as they are written, with what it says of each; of those that are gone, why.
fn named<'a>(event: &str, data: &'a Value) -> Vec<(&'a str, &'a Value)> {
    let one = |value: &'a Value| value.as_str().unwrap_or_default();
    let objects = data["objects"].as_array().map_or(&[][..], Vec::as_slice).iter();
    match event {
        "object-pos" | "rate" => objects.map(|told| (one(&told["object"]), told)).collect(),
        "object-gone" => objects.map(|object| (one(object), &data["reason"])).collect(),
        _ => vec![(one(&data["object"]), data)],
    }
}

#[cfg(test)]
mod tests {
    use belvedere_live::{
        aoi::Aoi,
        journal::{Ground, Input},
        world::{Look, NewMover, Rules, Sent, Visitor},
    };
    use belvedere_scene::{Bounds, Revision, foliage::Foliage};
    use serde_json::json;

    use super::*;

    const MINE: ObjectId = ObjectId(100_000_001);
    const DRIVEN: ObjectId = ObjectId(100_000_002);
    const OTHER: ObjectId = ObjectId(100_000_003);

    /// One session, which drives a mover, and a mover that nobody drives.
    fn account() -> Account {
        let ground = Ground {
            revision: Revision([0; 8]),
            bounds: Bounds::around([[0.0; 3], [1.0; 3]]),
            cells: Vec::new(),
            foliage: Foliage::default(),
        };
        let mut account = Account::begin(Rules::default(), &ground);
        let pose = Sent {
            t_ms: None,
            position: [0.5; 3],
            orientation: [0.0, 0.0, 0.0, 1.0],
            velocity: None,
            acceleration: None,
        };
        let visitor = Visitor {
            pose,
            aoi: Aoi {
                enter_m: 5.0,
                leave_m: 6.0,
            },
            max_speed_mps: 1.0,
            max_acceleration_mps2: None,
            radius_m: 0.3,
            look: Look::default(),
            hears_movers: true,
            listens: true,
        };
        let (session, object) = (SessionId(0), MINE);
        account.hear(
            &Input::Open {
                session,
                object,
                visitor,
            },
            0,
        );
        for (object, owner) in [(DRIVEN, Some(session)), (OTHER, None)] {
            let new = NewMover {
                pose,
                max_speed_mps: 1.0,
                max_acceleration_mps2: None,
                radius_m: 0.3,
                look: Look::default(),
                way: None,
            };
            account.hear(&Input::Create { object, owner, new }, 0);
        }
        account
    }

    fn leaks(account: &mut Account, event: &str, data: &Value) -> usize {
        let wrong = account.tell(&json!(["s0", event, data]), 7);
        let leaks = wrong.iter().filter(|wrong| matches!(wrong, Wrong::Leak(_)));
        leaks.count()
    }

    #[test]
    fn who_is_hushed_or_woken_for_a_mover_of_others_is_told_what_concerns_them_alone() {
        let mut account = account();
        for event in ["hush", "wake"] {
            let leaks = [MINE, DRIVEN, OTHER].map(|object| leaks(&mut account, event, &json!({"object": object})));
            assert_eq!(leaks, [0, 0, 1], "{event}");
        }
    }

    #[test]
    fn the_rate_of_who_is_not_shown_is_a_leak() {
        let mut account = account();
        let rate = json!({"objects": [{"object": OTHER, "period_ms": 100}]});
        assert_eq!(leaks(&mut account, "rate", &rate), 1);
        assert_eq!(leaks(&mut account, "object-info", &json!({"object": OTHER})), 0);
        assert_eq!(leaks(&mut account, "rate", &rate), 0);
        let gone = json!({"objects": [OTHER], "reason": "hidden"});
        assert_eq!(leaks(&mut account, "object-gone", &gone), 0);
        assert_eq!(leaks(&mut account, "rate", &rate), 1);
    }

    #[test]
    fn who_is_told_that_somebody_is_gone_was_told_that_they_were_there() {
        let mut account = account();
        let gone = |object: ObjectId, reason: &str| json!({"objects": [object], "reason": reason});
        assert_eq!(
            leaks(&mut account, "object-gone", &gone(OTHER, "hidden")),
            1,
            "it never was shown"
        );
        leaks(&mut account, "object-info", &json!({"object": OTHER}));
        // It may come back, and be hidden again, before there was a pose to tell.
        for reason in ["hidden", "hidden", "left"] {
            assert_eq!(leaks(&mut account, "object-gone", &gone(OTHER, reason)), 0, "{reason}");
        }
        assert_eq!(
            leaks(&mut account, "object-gone", &gone(OTHER, "left")),
            1,
            "it had left"
        );
        leaks(&mut account, "object-info", &json!({"object": OTHER}));
        account.hear(&Input::Destroy { object: OTHER }, 8);
        let mut wrong = || account.tell(&json!(["s0", "object-gone", gone(OTHER, "destroyed")]), 9);
        assert_eq!(wrong(), []);
        assert!(matches!(&wrong()[..], [Wrong::Astray(astray)] if astray.why == "there is no such mover"));
    }

    #[test]
    fn what_is_told_to_nobody_or_of_nobody_goes_astray() {
        let mut account = account();
        let mut why = |session: &str, object: &str| {
            let wrong = account.tell(&json!([session, "object-info", {"object": object}]), 7);
            match &wrong[..] {
                [Wrong::Astray(astray)] => astray.why,
                wrong => panic!("{wrong:?}"),
            }
        };
        assert_eq!(why("s7", "o100000003"), "there never was such a session");
        assert_eq!(why("", "o100000003"), "there never was such a session");
        assert_eq!(why("s0", "o100000009"), "there is no such mover");
        account.hear(&Input::Close { session: SessionId(0) }, 8);
        let wrong = account.tell(&json!(["s0", "cell", {"cell": "c0"}]), 9);
        assert!(
            matches!(
                &wrong[..],
                [Wrong::Astray(Astray {
                    why: "the session has ended",
                    ..
                })]
            ),
            "{wrong:?}"
        );
    }
}
