//! Who is told first of a crowd, and how fast? Stories of readers that take little.

use crate::plan::Stage;
use belvedere_live::world::ROOM;

#[test]
fn of_a_crowd_the_nearest_are_told_first_and_no_more_than_the_reader_takes() {
    let mut stage = Stage::hall(80);
    let crowd: Vec<_> = (0..300).map(|i| stage.park(79.5 - 0.25 * f64::from(i))).collect();
    stage.reads = false;
    let a = stage.enter(0.5);
    stage.silence(1_000);
    let nearest: Vec<_> = crowd[300 - ROOM..].to_vec();
    assert_eq!(stage.seen_by(a), nearest);
    // Who goes before anybody was told of it was never there.
    let now_ms = stage.now_ms;
    stage.world.destroy(crowd[0], now_ms);
    stage.silence(500);
    assert_eq!((stage.count(a, "object-gone"), stage.count(a, "rate")), (0, 0));
    // What is told anew begins anew.
    stage.resync(a);
    stage.silence(500);
    assert_eq!(stage.seen_by(a), nearest);
    stage.reads = true;
    stage.silence(100);
    assert_eq!(stage.seen_by(a).len(), 2 * ROOM);
    stage.silence(500);
    assert_eq!(stage.seen_by(a), crowd[1..]);
    assert_eq!(stage.count(a, "object-gone"), 0);
}

#[test]
fn who_waits_to_be_told_of_is_not_passed_over_for_ever_by_those_who_come_nearer() {
    let mut stage = Stage::hall(80);
    let a = stage.enter(0.5);
    stage.tick();
    (0..=ROOM).for_each(|_| _ = stage.park(5.5));
    let far = stage.park(40.5);
    // More come each tick than are told of, and all of them stand nearer.
    let tells = (0..150).position(|_| {
        (0..=ROOM).for_each(|_| _ = stage.park(5.5));
        stage.tick();
        stage.seen_by(a).contains(&far)
    });
    assert!(tells.is_some_and(|ticks| ticks > 1), "{tells:?}");
}
