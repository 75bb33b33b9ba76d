//! Who is seen among many, and behind leaves? Stories of a hall full of people.

use crate::plan::Stage;
use belvedere_live::{event::Event, journal::replay::Replay};
use belvedere_scene::foliage::{Foliage, FoliageSquare, Slab};

#[test]
fn deep_in_a_crowd_little_is_seen_and_told_less_often_and_a_few_people_are_no_crowd() {
    let seen = |people: u32| {
        let mut stage = Stage::hall(40);
        (0..people).for_each(|i| _ = stage.park(2.0 + 36.0 * f64::from(i) / f64::from(people)));
        let a = stage.enter(0.5);
        stage.silence(300);
        let told = stage.heard(a, "object-info").into_iter().map(|event| match event {
            Event::ObjectInfo(told) => told.moving.unwrap().attention,
            other => panic!("{other:?}"),
        });
        told.collect::<Vec<_>>()
    };
    let few = seen(20);
    assert!(few.len() == 20 && few.iter().all(|attention| attention.visibility.is_none()));
    let crowd = seen(120);
    assert_eq!(crowd.len(), 120, "nobody is culled unless that is asked for");
    let (near, far) = (crowd[0], crowd[119]);
    assert!(
        near.visibility > Some(0.9) && far.visibility < Some(0.3),
        "{near:?} {far:?}"
    );
    assert!(far.period_ms > few[19].period_ms, "{far:?} {:?}", few[19]);
}

#[test]
fn who_draws_nothing_hides_no_crowd_however_large_its_ball() {
    let seen_behind = |radius_m: f64| {
        let mut stage = Stage::hall(40);
        let people: Vec<_> = (0..60).map(|i| stage.park(20.0 + 0.3 * f64::from(i))).collect();
        stage.large(21.0, radius_m);
        let a = stage.enter(0.5);
        stage.tick();
        let told = stage.heard(a, "object-info").into_iter().find_map(|event| match event {
            Event::ObjectInfo(told) if told.info.object == people[59] => told.moving,
            _ => None,
        });
        told.and_then(|moving| moving.attention.visibility).unwrap()
    };
    assert_eq!(seen_behind(3.0), seen_behind(0.3));
}

#[test]
fn behind_a_hedge_less_is_seen_of_everybody_and_told_less_often() {
    let first_seen = |solidity: Option<f64>| {
        let slab = |solidity| Slab {
            from_m: 0.0,
            to_m: 2.0,
            solidity,
        };
        let hedge = (-6..=6).map(|z| FoliageSquare {
            at: [2, z],
            slabs: solidity.into_iter().map(slab).collect(),
        });
        let foliage = Foliage {
            side_m: 4.0,
            squares: hedge.collect(),
        };
        let mut stage = Stage::grove(foliage, 40);
        let people: Vec<_> = (0..60).map(|i| stage.park(20.0 + 0.3 * f64::from(i))).collect();
        let a = stage.enter(0.5);
        stage.tick();
        let told = stage.heard(a, "object-info").into_iter().find_map(|event| match event {
            Event::ObjectInfo(told) if told.info.object == people[0] => told.moving,
            _ => None,
        });
        stage
            .journal()
            .into_iter()
            .fold(Replay::default(), |mut replay, (input, output)| {
                assert_eq!(replay.take(&input).unwrap().output, output, "{input}");
                replay
            });
        told.unwrap().attention
    };
    let (free, behind) = (first_seen(None), first_seen(Some(0.9)));
    let (free_share, share) = (free.visibility.unwrap(), behind.visibility.unwrap());
    assert!(share < 0.6 * free_share, "{behind:?}, without a hedge {free:?}");
    assert!(
        behind.period_ms > free.period_ms,
        "{behind:?}, without a hedge {free:?}"
    );
}
