//! When somebody says where it is.

use belvedere_scene::ObjectId;

use super::super::{
    event::{self, Ball, Hush},
    speaker::{Speaker, Speech},
};

const UPRIGHT: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// Whether somebody at this place along x who walks so fast has something to say.
fn says(speaker: &mut Speaker, now_ms: f64, x: f64, speed: f64) -> bool {
    let speech = speaker.speak(now_ms, [x, 0.0, 0.0], UPRIGHT, [speed, 0.0, 0.0]);
    matches!(speech, Speech::Said(_))
}

fn hush() -> Hush {
    Hush {
        object: ObjectId(1),
        tbv: Ball {
            center: [0.0; 3],
            radius_m: 2.0,
        },
        until_ms: 5000,
    }
}

#[test]
fn who_goes_on_as_others_believe_says_nothing() {
    let mut speaker = Speaker::default();
    assert!(says(&mut speaker, 0.0, 0.0, 1.0));
    assert!(!says(&mut speaker, 50.0, 1.0, 1.0), "too soon after the last one");
    assert!(!says(&mut speaker, 1000.0, 1.0, 1.0));
    assert!(!says(&mut speaker, 1100.0, 1.13, 1.0));
    assert!(says(&mut speaker, 1200.0, 1.25, 1.0));
    // Others stop extrapolating after two seconds.
    assert!(!says(&mut speaker, 3200.0, 3.25, 1.0));
    assert!(says(&mut speaker, 3300.0, 3.35, 1.0));
    let turned = [0.0, 0.05, 0.0, 0.99875];
    let speech = speaker.speak(3400.0, [3.45, 0.0, 0.0], turned, [1.0, 0.0, 0.0]);
    assert!(matches!(speech, Speech::Said(_)));
}

#[test]
fn what_nobody_need_hear_is_told_from_what_others_know_anyway() {
    let mut speaker = Speaker::default();
    let speak = |speaker: &mut Speaker, now_ms: f64, x: f64| speaker.speak(now_ms, [x, 0.0, 0.0], UPRIGHT, [0.0; 3]);
    assert!(matches!(speak(&mut speaker, 0.0, 0.0), Speech::Said(_)));
    assert_eq!(speak(&mut speaker, 1000.0, 0.0), Speech::Known);
    speaker.keep_quiet(hush());
    assert_eq!(speak(&mut speaker, 1100.0, 1.0), Speech::Hushed);
    assert_eq!(
        speak(&mut speaker, 1200.0, 1.0),
        Speech::Known,
        "it would have been said once"
    );
    speaker.pause(2000.0);
    assert_eq!(speak(&mut speaker, 1300.0, 1.5), Speech::Waiting);
}

#[test]
fn whom_nobody_sees_says_nothing_while_it_keeps_to_its_ball() {
    let mut speaker = Speaker::default();
    assert!(says(&mut speaker, 0.0, 0.0, 0.0));
    speaker.keep_quiet(hush());
    assert!(!says(&mut speaker, 1000.0, 1.9, 0.0));
    assert!(says(&mut speaker, 1100.0, 2.1, 0.0), "it has left");
    assert!(says(&mut speaker, 1200.0, 1.0, 0.0), "that has ended the promise");
    speaker.keep_quiet(hush());
    assert!(says(&mut speaker, 5000.0, 1.0, 0.0), "so has time");
    speaker.keep_quiet(hush());
    speaker.wake();
    assert!(says(&mut speaker, 5010.0, 1.0, 0.0), "somebody looks");
}

#[test]
fn a_promise_is_void_when_somebody_may_look_among_other_cells_and_when_all_is_told_anew() {
    let voids = |name: &str, data: &str| event::read(name, data).unwrap().unwrap().voids_promises();
    assert!(voids("wake", r#"{"object": "o100000001"}"#));
    assert!(voids("revision", r#"{"revision": "0011223344556677"}"#));
    assert!(voids("resync", r#"{"reason": "missed"}"#));
    assert!(!voids("cell", r#"{"cell": "c3"}"#));
}

#[test]
fn who_is_asked_for_silence_keeps_it_and_then_speaks() {
    let mut speaker = Speaker::default();
    assert!(says(&mut speaker, 0.0, 0.0, 0.0));
    speaker.pause(1000.0);
    assert!(!says(&mut speaker, 999.0, 5.0, 0.0));
    assert!(says(&mut speaker, 1000.0, 0.0, 0.0), "the last pose was refused");
}
