//! What do doors hide and show, and who hears of them? Short stories on a plan: a row of rooms, each seeing its neighbours only.

use crate::plan::Stage;
use belvedere_live::{
    cells::Hidden,
    event::{Event, Gone, SessionId},
};
use belvedere_scene::{CellId, ObjectId};

/// Two people in adjacent rooms; the door between them was closed and has been opened since.
fn on_both_sides_of_a_door_that_opened_again() -> (Stage, SessionId, SessionId) {
    let mut stage = Stage::rooms(4);
    let (a, b) = (stage.enter(1.4), stage.enter(2.6));
    stage.gate(2, false);
    stage.gate(2, true);
    stage.stand(b);
    (stage, a, b)
}

#[test]
fn doors_are_told_to_whoever_comes_to_see_them() {
    let mut stage = Stage::rooms(6);
    let (near, far) = (stage.enter(0.5), stage.enter(5.5));
    stage.door(0.5, false);
    assert_eq!(
        (stage.heard(near, "door").len(), stage.heard(far, "door").len()),
        (1, 0)
    );
    stage.walk(far, 1.5, 2.0);
    assert_eq!(stage.heard(far, "door").len(), 1);
    stage.door(0.5, true);
    assert_eq!(
        (stage.heard(near, "door").len(), stage.heard(far, "door").len()),
        (2, 2)
    );
}

#[test]
fn a_closed_door_hides_who_is_behind_it_within_a_tick_and_hushes_both() {
    let mut stage = Stage::row(5, 4);
    let (a, b) = (stage.enter(0.5), stage.enter(3.5));
    stage.tick();
    assert_eq!(stage.seen_by(a), [stage.avatar(b)]);
    stage.gate(2, false);
    stage.tick();
    assert_eq!(stage.last_gone(a), Some((stage.avatar(b), Gone::Hidden)));
    for session in [a, b] {
        let told = stage.unread(session);
        assert!(told.iter().any(|event| matches!(event, Event::Hush(_))), "{told:?}");
    }
    let infos = stage.count(a, "object-info");
    stage.gate(2, true);
    for session in [a, b] {
        let told = stage.unread(session);
        assert!(told.iter().any(|event| matches!(event, Event::Wake { .. })), "{told:?}");
    }
    stage.stand(b);
    stage.tick();
    assert_eq!(stage.seen_by(a), [stage.avatar(b)]);
    assert_eq!(stage.count(a, "object-info"), infos, "its info was kept");
}

#[test]
fn behind_two_closed_doors_one_that_opens_shows_nobody() {
    let mut stage = Stage::row(5, 2);
    let (a, b) = (stage.enter(1.4), stage.enter(3.6));
    stage.gate(2, false);
    stage.gate(3, false);
    stage.tick();
    let told = stage.count(a, "object-info");
    for border in [2, 3, 2, 3] {
        stage.gate(border, true);
        stage.silence(500);
        stage.gate(border, false);
    }
    assert_eq!((stage.seen_by(a), stage.count(a, "object-info")), (vec![], told));
    stage.gate(2, true);
    stage.gate(3, true);
    stage.stand(b);
    stage.tick();
    assert_eq!(stage.seen_by(a), [stage.avatar(b)]);
}

#[test]
fn an_answer_about_a_door_that_has_opened_since_is_void() {
    let (mut stage, a, b) = on_both_sides_of_a_door_that_opened_again();
    stage.tick();
    let now_ms = stage.now_ms;
    let hidden = Hidden {
        cell: CellId(2),
        behind: vec![vec![ObjectId(1_002)]],
    };
    stage.world.screen(CellId(1), &[ObjectId(1_002)], &[hidden], now_ms);
    stage.tick();
    assert_eq!(stage.seen_by(a), [stage.avatar(b)]);
}

#[test]
fn a_door_that_closes_again_hides_at_once_and_nobody_is_asked() {
    let (mut stage, a, b) = on_both_sides_of_a_door_that_opened_again();
    stage.tick();
    assert_eq!(stage.seen_by(a), [stage.avatar(b)]);
    stage.gate_unanswered(2, false);
    assert_eq!(stage.world.next_unscreened(), None);
    stage.world.tick(stage.now_ms);
    stage.listen_unanswered();
    assert_eq!(stage.last_gone(a), Some((stage.avatar(b), Gone::Hidden)));
}

#[test]
fn what_is_asked_is_how_doors_stand_now() {
    let mut stage = Stage::row(5, 4);
    stage.enter(1.4);
    stage.gate_unanswered(2, false);
    stage.gate_unanswered(2, true);
    assert_eq!(stage.world.next_unscreened(), None, "nobody needs to know any more");
    stage.gate_unanswered(2, false);
    stage.gate_unanswered(3, false);
    stage.gate_unanswered(2, true);
    let asked: Vec<_> = std::iter::from_fn(|| stage.world.next_unscreened()).collect();
    assert!(!asked.is_empty() && asked.iter().all(|asked| asked.closed == [ObjectId(1_003)]));
}

#[test]
fn until_it_is_known_what_doors_hide_now_one_that_opens_shows_nobody_behind_another() {
    let mut stage = Stage::row(5, 3);
    let (a, near, far) = (stage.enter(1.4), stage.enter(2.5), stage.enter(3.6));
    stage.gate(2, false);
    stage.gate(3, false);
    stage.tick();
    assert_eq!(stage.seen_by(a), []);
    let now_ms = stage.now_ms;
    stage.gate_unanswered(2, true);
    for session in [near, far] {
        let sent = stage.sent(stage.x(session));
        stage.world.pose(session, sent, now_ms).unwrap();
    }
    stage.world.tick(now_ms);
    stage.listen_unanswered();
    assert_eq!(stage.seen_by(a), [stage.avatar(near)]);
    let mut asked = std::iter::from_fn(|| stage.world.next_unscreened());
    let here = asked.find(|asked| asked.cell == CellId(1)).unwrap();
    assert_eq!(here.closed, [ObjectId(1_003)], "what the other hides is asked anew");
}
