//! Who hears what, told as short stories on a plan: a row of rooms, each seeing its neighbours only.

use std::sync::Arc;

use crate::plan::{RADIUS_M, SPEED_MPS, Stage};
use belvedere_live::{
    cells::distance_m,
    event::{Event, Gone, Void},
    world::{Rules, Sent},
};

#[test]
fn two_in_one_room_hear_of_each_other_and_not_of_themselves() {
    let mut stage = Stage::rooms(3);
    let (a, b) = (stage.enter(0.5), stage.enter(0.7));
    stage.tick();
    assert_eq!(stage.seen_by(a), [stage.avatar(b)]);
    assert_eq!(stage.seen_by(b), [stage.avatar(a)]);
}

#[test]
fn who_may_be_over_the_border_before_it_hears_is_told_what_is_seen_from_there() {
    let mut stage = Stage::rooms(5);
    let (back, at_the_border, b) = (stage.enter(0.4), stage.enter(0.9), stage.enter(2.5));
    stage.tick();
    assert!(!stage.seen_by(back).contains(&stage.avatar(b)));
    assert!(stage.seen_by(at_the_border).contains(&stage.avatar(b)));
}

#[test]
fn who_goes_on_as_it_said_is_told_on_its_way_what_it_comes_to_see() {
    let mut stage = Stage::rooms(8);
    let (a, parked) = (stage.enter(0.4), stage.park(4.5));
    stage.silence(500);
    // It says so once: 2 m/s, so it comes to x = 2.5, a round trip before what sees into the mover's room, 1 s later.
    stage.go(a, SPEED_MPS);
    stage.silence(900);
    assert_eq!(stage.seen_by(a), []);
    stage.silence(400);
    assert_eq!(stage.seen_by(a), [parked]);
    // Nobody else goes on: it is where it was heard of last, and stands where that has led.
    stage.silence(10_000);
    assert_eq!(stage.seen_by(a), [parked]);
    stage.state(a, [0.0; 3], [0.0; 3]);
    stage.tick();
    assert_eq!(stage.seen_by(a), []);
}

#[test]
fn who_may_have_stopped_before_a_wall_is_still_told_what_is_seen_from_there() {
    let mut stage = Stage::rooms(8);
    let (a, behind) = (stage.enter(2.5), stage.park(1.5));
    stage.silence(500);
    stage.go(a, SPEED_MPS);
    stage.silence(3_000);
    assert_eq!(stage.seen_by(a), [behind]);
}

#[test]
fn who_walks_behind_a_wall_is_gone_and_its_owner_is_hushed() {
    let mut stage = Stage::rooms(5);
    let (a, b) = (stage.enter(0.4), stage.enter(1.5));
    stage.tick();
    assert_eq!(stage.seen_by(a), [stage.avatar(b)]);
    let hush = stage.walk(b, 3.5, 1.0);
    assert!(stage.seen_by(a).is_empty());
    assert_eq!(stage.last_gone(a), Some((stage.avatar(b), Gone::Hidden)));
    let hush = hush.expect("nobody can see b");
    assert!(hush.tbv.holds([3.5, 0.5, 0.5]) && hush.until_ms > stage.now_ms);
}

#[test]
fn who_comes_to_see_a_hushed_mover_wakes_it_and_gets_it_without_a_second_info() {
    let mut stage = Stage::rooms(5);
    let (a, b) = (stage.enter(0.4), stage.enter(1.5));
    stage.tick();
    stage.walk(b, 3.5, 1.0);
    let infos = stage.count(a, "object-info");
    stage.silence(2_000);
    let slept = stage.heard(b, "wake").len();
    stage.walk(a, 2.5, 1.0);
    assert!(stage.heard(b, "wake").len() > slept);
    stage.stand(b);
    stage.tick();
    assert_eq!(stage.seen_by(a), [stage.avatar(b)]);
    assert_eq!(stage.count(a, "object-info"), infos, "its info was kept");
}

#[test]
fn a_hushed_owner_may_talk_on_and_nobody_hears_of_it() {
    let mut stage = Stage::rooms(8);
    let (a, b) = (stage.enter(0.5), stage.enter(6.5));
    stage.tick();
    for _ in 0..50 {
        assert!(stage.stand(b).is_some());
        stage.tick();
    }
    assert_eq!(
        stage.heard(a, "object-info").len() + stage.heard(a, "object-pos").len(),
        0
    );
}

#[test]
fn a_teleport_breaks_the_promise_and_is_seen_at_once() {
    let mut stage = Stage::rooms(8);
    let (a, b) = (stage.enter(0.5), stage.enter(6.5));
    stage.tick();
    assert!(stage.stand(b).is_some());
    assert!(stage.jump(b, 1.5).is_none(), "it is visible there");
    stage.tick();
    assert_eq!(stage.seen_by(a), [stage.avatar(b)]);
}

#[test]
fn two_poses_within_a_moment_do_not_make_a_rocket() {
    let mut stage = Stage::rooms(3);
    let (a, b) = (stage.enter(0.5), stage.enter(0.7));
    stage.now_ms += 1;
    stage.pose(b, 0.8);
    stage.silence(1_000);
    assert_eq!(stage.seen_by(a), [stage.avatar(b)]);
    let shown = stage.beliefs[&a].shown[&stage.avatar(b)];
    assert!(distance_m(shown.velocity, [0.0; 3]) <= SPEED_MPS + 1e-9, "{shown:?}");
}

#[test]
fn who_falls_silent_in_full_stride_stands_where_it_was_heard_of_last() {
    let mut stage = Stage::rooms(3);
    let (a, b) = (stage.enter(0.5), stage.enter(0.6));
    for step in 1..=5 {
        stage.tick();
        stage.pose(b, 0.6 + 0.05 * f64::from(step));
    }
    stage.tick();
    let belief = |stage: &Stage| stage.beliefs[&a].shown[&stage.avatar(b)];
    assert!(!belief(&stage).is_resting());
    stage.silence(1_500);
    let shown = belief(&stage);
    assert!(shown.is_resting(), "{shown:?}");
    assert!((shown.position[0] - 0.85).abs() < 1e-9, "{shown:?}");
}

#[test]
fn between_the_radii_nothing_flickers() {
    let mut stage = Stage::hall(40);
    let (a, b) = (stage.enter(0.5), stage.enter(12.0));
    stage.set_aoi(a, 10.0, 14.0);
    stage.silence(1_000);
    assert!(stage.seen_by(a).is_empty());
    stage.walk(b, 10.0, 2.0);
    assert_eq!(stage.seen_by(a), [stage.avatar(b)]);
    stage.walk(b, 13.5, 2.0);
    assert_eq!(stage.seen_by(a), [stage.avatar(b)]);
    stage.walk(b, 15.5, 2.0);
    assert_eq!(stage.last_gone(a), Some((stage.avatar(b), Gone::Left)));
}

#[test]
fn a_mover_that_nobody_answers_for_is_where_it_was() {
    let mut stage = Stage::rooms(8);
    let a = stage.enter(0.5);
    let parked = stage.park(6.5);
    stage.silence(120_000);
    stage.walk(a, 5.5, 2.0);
    stage.silence(2_000);
    assert_eq!(stage.seen_by(a), [parked]);
}

#[test]
fn a_known_way_is_followed_without_anybody_saying_a_word() {
    let mut stage = Stage::rooms(9);
    let a = stage.enter(0.5);
    let tram = stage.tram(0.5, 8.5, 16_000);
    let mut seen = Vec::new();
    for _ in 0..320 {
        stage.tick();
        seen.push(stage.seen_by(a) == [tram]);
    }
    let times = seen.iter().filter(|seen| **seen).count();
    assert!(
        (60..120).contains(&times),
        "in sight about a quarter of the time: {times}"
    );
    assert!(seen[0] && !seen[160] && seen[315]);
    assert!(stage.count(a, "object-pos") < 40, "a straight way needs few words");
}

#[test]
fn many_who_come_to_see_it_are_told_one_info_as_it_stands() {
    let mut stage = Stage::hall(2);
    let (a, b) = (stage.enter(0.5), stage.enter(0.6));
    let c = stage.enter(1.5);
    stage.tick();
    let avatar = stage.avatar(c);
    let infos = |stage: &mut Stage| {
        let told = stage
            .world
            .events()
            .into_iter()
            .filter_map(|(session, event)| match event {
                Event::ObjectInfo(told) if told.info.object == avatar => Some((session, told.info)),
                _ => None,
            });
        told.collect::<Vec<_>>()
    };
    let now_ms = stage.now_ms;
    for session in [a, b] {
        stage.world.resync(session, Void::Unknown, now_ms);
    }
    let [(to_a, first), (to_b, second)] = infos(&mut stage).try_into().unwrap();
    assert_eq!((to_a, to_b), (a, b));
    assert!(Arc::ptr_eq(&first, &second), "held once");
    // Elsewhere it is another.
    let sent = stage.sent(1.6);
    stage.world.pose(c, sent, now_ms + 50).unwrap();
    stage.world.resync(a, Void::Unknown, now_ms + 50);
    let moved = infos(&mut stage).pop().unwrap().1;
    assert_eq!([first.transform[12], moved.transform[12]], [1.5, 1.6]);
}

#[test]
fn the_end_of_a_session_destroys_its_avatar() {
    let mut stage = Stage::rooms(3);
    let (a, b) = (stage.enter(0.5), stage.enter(0.7));
    stage.tick();
    stage.leave(b);
    stage.tick();
    assert_eq!(stage.last_gone(a), Some((stage.avatar(b), Gone::Destroyed)));
    let counts = stage.world.counts();
    assert_eq!((counts.sessions, counts.movers), (1, 1));
}

#[test]
fn after_a_resync_everything_is_told_again() {
    let mut stage = Stage::rooms(3);
    let (a, b) = (stage.enter(0.5), stage.enter(0.7));
    stage.tick();
    stage.resync(a);
    let events = stage.all(a);
    let names: Vec<_> = events.iter().rev().take(2).rev().map(Event::name).collect();
    assert_eq!(names, ["resync", "object-info"]);
    assert_eq!(stage.seen_by(a), [stage.avatar(b)]);
}

#[test]
fn a_new_revision_voids_what_was_promised_and_says_so() {
    let mut stage = Stage::rooms(60);
    let (a, b) = (stage.enter(0.5), stage.enter(30.5));
    stage.silence(1_000);
    assert!(stage.stand(a).is_some() && stage.stand(b).is_some());
    stage.publish();
    assert_eq!([a, b].map(|session| stage.count(session, "wake")), [1, 1]);
    // Who was woken is hushed again when nobody looks.
    stage.tick();
    let hushed = [a, b].map(|session| stage.count(session, "hush") > 0);
    assert_eq!(hushed, [true; 2]);
}

#[test]
fn what_moves_by_itself_is_told_of_before_it_comes_into_view_however_its_volumes_end() {
    for begins in 0..40 {
        let mut stage = Stage::rooms(9);
        let a = stage.enter(0.4);
        // 2 m/s towards the border of what is seen, at x = 2.
        let from = 8.5 - 0.025 * f64::from(begins);
        let tram = stage.tram(from, 0.5, (500.0 * (from - 0.5)) as i64);
        let x = |ms: i64| from - SPEED_MPS * 1e-3 * ms as f64;
        for ms in (100..3_500).step_by(100) {
            stage.tick();
            let soon = x(ms + 100) - RADIUS_M <= 2.0;
            assert!(!soon || stage.seen_by(a) == [tram], "{ms} ms after {from}");
        }
    }
}

#[test]
fn who_does_not_listen_is_told_nothing_and_wakes_nobody_and_is_told_all_when_it_does() {
    let mut stage = Stage::rooms(5);
    let (deaf, other) = (stage.enter(0.4), stage.enter(0.6));
    stage.ears(deaf, false);
    stage.tick();
    let told = stage.all(deaf).len();
    assert!(stage.stand(other).is_some(), "who is not told of it cannot see it");
    stage.walk(deaf, 1.4, 1.0);
    assert_eq!(stage.seen_by(other), [stage.avatar(deaf)], "its poses move its avatar");
    assert_eq!((stage.count(other, "wake"), stage.seen_by(deaf)), (0, vec![]));
    assert_eq!(stage.all(deaf).len(), told + 1, "the cell that it has come to");
    stage.ears(deaf, true);
    assert_eq!(stage.count(other, "wake"), 1);
    stage.stand(other);
    stage.tick();
    assert_eq!(stage.seen_by(deaf), [stage.avatar(other)]);
    // Whose owner does not hear cannot be woken.
    let third = stage.enter(4.5);
    stage.ears(other, false);
    stage.tick();
    stage.leave(deaf);
    stage.silence(3_000);
    assert!(stage.seen_by(third).is_empty());
    let comes = stage.enter(1.5);
    stage.tick();
    assert_eq!(stage.seen_by(comes), [stage.avatar(other)]);
    assert_eq!(stage.count(other, "wake"), 2, "it is told when somebody listens again");
}

#[test]
fn what_stays_in_a_corner_is_silent_for_minutes_and_what_leaves_it_gets_a_larger_one() {
    let mut stage = Stage::rooms(60);
    let owner = stage.enter(0.5);
    let (b, corner) = stage.own(owner, 30.5);
    let corner = corner.expect("nobody can see b");
    let told = |stage: &mut Stage| {
        let events = stage.unread(owner);
        let of_b = |event: &&Event| match event {
            Event::Wake { object } => *object == b,
            Event::Hush(hush) => hush.object == b,
            _ => false,
        };
        events.iter().filter(of_b).count()
    };
    stage.silence(60_000);
    assert_eq!(stage.drive(b, 30.5, None), Some(corner), "it lasts");
    // Its owner knows when it ends, and speaks a tick before.
    stage.silence(corner.until_ms - stage.now_ms - 100);
    assert_eq!(told(&mut stage), 0);
    let again = stage.drive(b, 30.7, None).expect("nobody can see b");
    assert_eq!(again.tbv, corner.tbv, "what has not left it may rely on it again");
    assert_eq!(again.until_ms, stage.now_ms + Rules::default().longest_tbv_ms);
    let (beyond, mut x) = (corner.tbv.center[0] + corner.tbv.radius_m + 0.5, 30.7);
    let mut larger = None;
    while x < beyond {
        x = beyond.min(x + 0.1 * SPEED_MPS);
        larger = stage.drive(b, x, None);
        stage.tick();
    }
    let larger = larger.expect("nobody can see b there either");
    assert!(!corner.tbv.holds([beyond, 0.5, 0.5]) && larger.tbv.holds([beyond, 0.5, 0.5]));
    assert!(
        larger.tbv.radius_m > 1.5 * corner.tbv.radius_m,
        "{larger:?} after {corner:?}"
    );
}

#[test]
fn who_stays_in_a_room_that_nobody_looks_into_says_nothing_for_minutes() {
    let mut stage = Stage::rooms(60);
    stage.enter(0.5);
    let b = stage.enter(30.5);
    let room = stage.stand(b).expect("nobody can see b");
    stage.silence(600_000);
    assert_eq!(stage.count(b, "wake"), 0);
    assert_eq!(stage.stand(b), Some(room), "it lasts");
}

#[test]
fn who_need_not_speak_is_told_of_all_that_is_seen_from_wherever_it_may_go() {
    let mut promised = 0;
    for tenths in 65..135 {
        let mut stage = Stage::rooms(20);
        let walker = stage.enter(0.1 * f64::from(tenths));
        let others: Vec<_> = (0..20).map(|room| stage.park(f64::from(room) + 0.5)).collect();
        stage.tick();
        // Where it is, and then where it may go, which it says though it need not.
        for _ in 0..3 {
            let Some(hush) = stage.stand(walker) else { break };
            promised += 1;
            stage.tick();
            let ends = [-1.0, 1.0].map(|side| hush.tbv.center[0] + side * hush.tbv.radius_m);
            for room in ends.map(|end| end.floor() as usize) {
                for there in &others[room - 1..=room + 1] {
                    assert!(stage.seen_by(walker).contains(there), "{there} from {hush:?}");
                }
            }
            stage.pose(walker, ends[1] - 0.05);
            stage.tick();
        }
    }
    assert_eq!(promised, 3 * 70);
}

#[test]
fn who_cannot_be_woken_is_put_away_for_moments_only() {
    let rules = Rules::default();
    let mut stage = Stage::rooms(60);
    stage.enter(0.5);
    let b = stage.enter(30.5);
    let heard = stage.walk(b, 30.6, SPEED_MPS).expect("nobody can see b");
    assert!(
        heard.until_ms > stage.now_ms + rules.longest_unheard_tbv_ms,
        "{heard:?}"
    );
    stage.ears(b, false);
    stage.now_ms += 100;
    let deaf = stage.walk(b, 30.7, SPEED_MPS).expect("nobody can see b");
    assert!(deaf.until_ms <= stage.now_ms + rules.longest_unheard_tbv_ms, "{deaf:?}");
    stage.ears(b, true);
    stage.now_ms += rules.longest_unheard_tbv_ms;
    let again = stage.walk(b, 30.8, SPEED_MPS).expect("nobody can see b");
    assert!(
        again.until_ms > stage.now_ms + rules.longest_unheard_tbv_ms,
        "{again:?}"
    );
}

#[test]
fn who_says_how_it_moves_and_how_fast_that_changes_is_put_away_in_a_smaller_volume() {
    let mut stage = Stage::rooms(60);
    stage.enter(0.5);
    let mut lazy = |velocity_mps: Option<f64>| {
        let sent = Sent {
            velocity: velocity_mps.map(|mps| [mps, 0.0, 0.0]),
            ..stage.sent(30.5)
        };
        let (object, hush) = stage.create(sent, 5.0, Some(0.5));
        (object, hush.expect("nobody can see it").tbv.radius_m)
    };
    // Half of 0.5 m/s² in two seconds, squared; what comes with 5 m/s.
    let ((said, by_acceleration), (unsaid, by_speed)) = (lazy(Some(0.0)), lazy(None));
    assert_eq!([by_acceleration, by_speed], [1.0, 10.0]);
    let smaller = stage.drive(unsaid, 30.6, Some(0.0)).expect("nobody can see it");
    assert_eq!(
        (smaller.tbv.center[0], smaller.tbv.radius_m),
        (30.6, 1.0),
        "once it says how it moves"
    );
    // It does not change with each pose.
    stage.now_ms += 100;
    let same = stage.drive(unsaid, 30.7, Some(0.0)).expect("nobody can see it");
    assert_eq!(same.tbv, smaller.tbv);
    let same = stage.drive(said, 30.7, Some(1.0)).expect("nobody can see it");
    assert_eq!((same.tbv.center[0], same.tbv.radius_m), (30.5, 1.0));
}

#[test]
fn who_rests_is_hushed_when_the_last_who_could_see_it_goes() {
    for goes in [Stage::leave, |stage: &mut Stage, a| _ = stage.walk(a, 7.5, 1.0)] {
        let mut stage = Stage::rooms(9);
        let (a, b) = (stage.enter(0.5), stage.enter(0.7));
        // Long enough that nobody looks at either any more.
        stage.silence(1_000);
        assert_eq!(stage.count(b, "hush"), 0, "a sees b");
        goes(&mut stage, a);
        stage.tick();
        assert_eq!(stage.count(b, "hush"), 1);
    }
}

#[test]
fn who_has_long_been_at_rest_is_told_of_as_soon_as_it_moves_or_whoever_looks_does() {
    let mut stage = Stage::hall(80);
    let (a, b) = (stage.enter(0.5), stage.enter(8.5));
    stage.silence(3_000);
    let told = stage.count(a, "object-pos");
    stage.silence(1_000);
    assert_eq!(stage.count(a, "object-pos"), told, "there is nothing to tell");
    stage.pose(b, 8.7);
    stage.tick();
    assert_eq!(stage.count(a, "object-pos"), told + 1);
    stage.silence(3_000);
    let rates = stage.count(a, "rate");
    stage.walk(a, 0.5 - 0.4, 1.0);
    stage.jump(a, 60.0);
    stage.tick();
    assert!(stage.count(a, "rate") > rates, "b is far away now");
}

#[test]
fn who_is_cut_off_counts_by_its_last_pose_at_once_and_hears_that_its_promise_has_ended() {
    let rules = Rules::default();
    let mut stage = Stage::rooms(60);
    let a = stage.enter(0.5);
    let b = stage.enter(30.5);
    let long = stage.stand(b).expect("nobody can see b");
    assert!(long.until_ms > stage.now_ms + rules.longest_unheard_tbv_ms);
    stage.silence(3_000);
    stage.reach(b, false);
    assert_eq!(stage.count(b, "wake"), 1, "it is there when b comes back");
    let short = stage.stand(b).expect("nobody can see b");
    assert!(
        short.until_ms <= stage.now_ms + rules.longest_unheard_tbv_ms,
        "{short:?}"
    );
    stage.silence(5_000);
    assert_eq!(
        stage.count(b, "hush"),
        0,
        "nothing is promised that b might hear of too late"
    );
    stage.jump(a, 30.6);
    stage.tick();
    assert_eq!(stage.seen_by(a), [stage.avatar(b)]);
    stage.jump(a, 0.5);
    stage.tick();
    stage.reach(b, true);
    stage.silence(3_000);
    let again = stage.stand(b).expect("nobody can see b");
    assert!(
        again.until_ms > stage.now_ms + rules.longest_unheard_tbv_ms,
        "{again:?}"
    );
    // Whoever was asked when it was cut off is waited for no longer.
    stage.silence(3_000);
    stage.jump(a, 30.6);
    assert_eq!(stage.seen_by(a), []);
    stage.reach(b, false);
    stage.tick();
    assert_eq!(stage.seen_by(a), [stage.avatar(b)]);
}

#[test]
fn a_giant_that_has_gone_is_looked_for_no_more() {
    let mut stage = Stage::hall(40);
    let a = stage.enter(0.5);
    stage.set_aoi(a, 2.0, 3.0);
    let small = stage.enter(30.5);
    stage.set_aoi(small, 2.0, 3.0);
    stage.silence(2_000);
    assert!(stage.stand(small).is_some(), "nobody is near");
    let giant = stage.mover(20.5, 1_000.0, None);
    stage.silence(500);
    assert!(
        stage.stand(small).is_none(),
        "a tick takes it beyond the border of where somebody looks"
    );
    stage.world.destroy(giant, stage.now_ms);
    stage.silence(2_000);
    assert!(stage.stand(small).is_some(), "nobody is near again");
}
