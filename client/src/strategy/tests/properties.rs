//! Whatever is seen, and however little memory there is: limits are kept, nothing is fetched twice without need, and it ends.

use proptest::prelude::*;

use super::*;

/// An object of one of a few models, some of which have smooth LODs.
fn any_seen() -> impl Strategy<Value = Seen> {
    (0..40u32, 0..12u32, 0.5..300.0f64, 0.01..3.0f64).prop_map(|(object, number, away_m, solid_angle_sr)| {
        let mut geometry = model(number);
        if number % 3 == 0 {
            geometry.smooth = Some(smooth(number, &[(700, 0.09), (2_500, 0.02), (9_000, 0.0)]));
        }
        seen_at(object, number, away_m, solid_angle_sr, geometry)
    })
}

fn place() -> impl Strategy<Value = Vec<Seen>> {
    prop::collection::vec(any_seen(), 1..12).prop_map(|mut seen| {
        seen.sort_by(|a, b| b.solid_angle_sr.total_cmp(&a.solid_angle_sr));
        seen
    })
}

proptest! {
    #[test]
    fn a_walk_keeps_its_memory_and_ends(
        places in prop::collection::vec(place(), 2..5),
        memory_bytes in prop_oneof![Just(u64::MAX), 3_000..150_000u64],
    ) {
        let mut planner = within(memory_bytes);
        let (mut orders, mut fetched, mut gone) = (0, HashSet::new(), HashSet::new());
        for pair in places.windows(2) {
            need(&mut planner, &pair[0], &pair[1]);
            let ahead: Vec<(Approach, &[Seen])> = vec![(approach(1, 1, 2.0), &pair[1])];
            let view = view(&pair[0], ahead);
            let mut changes = planner.plan(&view, 1e5);
            let mut quiet = false;
            while !quiet {
                quiet = true;
                while let Some(order) = planner.next(&mut changes) {
                    quiet = false;
                    for file in &order.files {
                        let key = file.name.key();
                        prop_assert!(fetched.insert(key) || gone.remove(&key), "{file:?} came twice");
                        planner.arrive(file, file.bytes);
                    }
                    changes.extend(planner.settle());
                    prop_assert!(planner.residency.bytes() <= memory_bytes);
                    gone.extend(changes.drain(..).filter_map(|change| match change {
                        Change::Gone(key) => Some(key),
                        _ => None,
                    }));
                    orders += 1;
                    prop_assert!(orders < 5_000, "it never ends");
                }
                changes.extend(planner.plan(&view, 1e5));
            }
            prop_assert!(planner.residency.peak_bytes() <= memory_bytes);
            if memory_bytes == u64::MAX {
                prop_assert!(pair[0].iter().chain(&pair[1]).all(|seen| planner.residency.held(seen.model).is_some()));
            }
        }
    }

    #[test]
    fn something_of_all_that_fits_is_there_before_anything_finer(here in place()) {
        let firsts: HashMap<ModelId, u64> = here.iter().map(|seen| {
            let coarsest = Grade::coarsest(&seen.geometry).map_or(0, |grade| {
                grade.parts(&seen.geometry, &within(0).residency).map(|part| part.bytes).sum()
            });
            (seen.model, coarsest)
        }).collect();
        // A smooth LOD may be what comes first, with materials that all share.
        let memory_bytes = firsts.values().sum::<u64>() + 12 * 1_000;
        let mut planner = within(memory_bytes);
        need(&mut planner, &here, &[]);
        let view = view(&here, Vec::new());
        planner.plan(&view, 1e5);
        let mut changes = Vec::new();
        while let Some(order) = planner.next(&mut changes) {
            let all_here = here.iter().all(|seen| planner.residency.held(seen.model).is_some());
            let is_first = matches!(order.wish.cause, Cause::Missing { .. });
            prop_assert!(all_here || is_first, "{}", order.wish);
            for file in &order.files {
                planner.arrive(file, file.bytes);
            }
            planner.settle();
        }
        prop_assert!(here.iter().all(|seen| planner.residency.held(seen.model).is_some()));
    }
}
