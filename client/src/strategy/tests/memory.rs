//! What goes when memory is short.

use super::*;

#[test]
fn memory_is_never_exceeded_and_what_is_furthest_goes_first() {
    let file = |number: u32| FileRef::object(&name(&format!("file {number}"), "glb"), 100);
    let grade = Grade::coarsest(&model(0)).unwrap();
    let mut held = Residency::within(500);
    for number in 0..4 {
        held.ask(&file(number));
        held.arrive(file(number).name.key(), 100);
    }
    // Files 0 to 2 have users, and one of them two; nobody uses the last.
    for (number, files) in [(0, vec![0]), (1, vec![1, 2]), (2, vec![2])] {
        held.hold(
            ModelId(number),
            grade,
            files.iter().map(|at| file(*at).name.key()).collect(),
            true,
        );
    }
    held.need(
        HashSet::from([ModelId(0)]),
        HashMap::from([(ModelId(1), 1), (ModelId(2), 3)]),
    );
    let mut room = |bytes: u64, within_steps: u32| {
        let terms = Terms {
            spare_bytes: 0,
            within_steps,
            sharp_within_steps: Some(0),
        };
        held.make_room(bytes, &[], terms)
            .map(|gone| (gone.models, gone.files.len(), held.bytes()))
    };
    assert_eq!(room(100, 0), Some((vec![], 0, 400)));
    assert_eq!(room(200, 0), Some((vec![], 1, 300)), "the file without users");
    assert_eq!(
        room(300, 1),
        None,
        "what is near stays, and what it shares with what is far"
    );
    assert_eq!(room(400, 0), Some((vec![ModelId(2), ModelId(1)], 2, 100)));
    assert_eq!(room(401, 0), None, "what is visible stays");
    // What went from next door is told apart from what went from far away, when it comes again; not after a way there and back.
    let comes_again = |held: &mut Residency, number: u32| {
        let key = file(number).name.key();
        held.ask(&file(number));
        held.arrive(key, 100);
        held.hold(ModelId(number), grade, vec![key], true);
        (held.evictions().again_bytes, held.evictions().cycle_bytes)
    };
    assert_eq!(comes_again(&mut held, 2), (100, 0));
    let (near, far) = (HashMap::from([(ModelId(1), 1)]), HashMap::from([(ModelId(1), 2)]));
    let mut left_and_returned = held.clone();
    left_and_returned.need(HashSet::new(), far);
    left_and_returned.need(HashSet::new(), near.clone());
    assert_eq!(comes_again(&mut left_and_returned, 1), (200, 0));
    held.need(HashSet::from([ModelId(1)]), HashMap::new());
    held.need(HashSet::new(), near);
    assert_eq!(comes_again(&mut held, 1), (200, 100));
    assert!(held.peak_bytes() <= 500);
}

#[test]
fn what_goes_with_the_last_that_is_drawn_with_it_is_no_loss_of_who_was_before() {
    let grade = |number: usize| Grade::all(&model(0)).nth(number).unwrap();
    let file = |number: u32| FileRef::object(&name(&format!("file {number}"), "glb"), 100);
    let key = |number: u32| file(number).name.key();
    let mut held = Residency::within(400);
    let bring = |held: &mut Residency, number: u32| {
        held.ask(&file(number));
        held.arrive(key(number), 100);
    };
    (0..4).for_each(|number| bring(&mut held, number));
    // Both have a base of their own, and a detail of which they share a part: of it, the first has another.
    for (number, files, at) in [(1, vec![1], 2), (2, vec![2], 2), (2, vec![0], 0), (1, vec![0, 3], 0)] {
        held.hold(ModelId(number), grade(at), files.into_iter().map(key).collect(), true);
    }
    let any = Terms {
        spare_bytes: 0,
        within_steps: 0,
        sharp_within_steps: None,
    };
    let mut goes = |near: u32, far: u32| {
        held.need(HashSet::from([ModelId(near)]), HashMap::from([(ModelId(far), 3)]));
        let gone = held.make_room(400 - held.bytes() + 100, &[], any).expect("room");
        (gone.details, gone.files)
    };
    assert_eq!(goes(2, 1), (vec![ModelId(1)], vec![key(3)]));
    assert_eq!(goes(1, 2), (vec![ModelId(2)], vec![key(0)]));
    bring(&mut held, 0);
    held.hold(ModelId(1), grade(0), vec![key(0)], true);
    assert_eq!((held.evictions().again_bytes, held.evictions().cycle_bytes), (100, 0));
}

#[test]
fn details_go_before_anything_that_is_seen_next_door_and_leave_no_hole() {
    let (here, next) = ([seen(1, 1.0)], [seen_at(2, 2, 9.0, 1.0, model(2))]);
    let mut planner = within(43_000);
    need(&mut planner, &here, &next);
    fetch_all(&mut planner, &view(&here, Vec::new()), 1e9);
    assert_eq!(planner.residency.held(ModelId(1)).map(|grade| grade.number), Some(0));
    let soon = view(&here, vec![(approach(2, 1, 1.0), &next[..])]);
    planner.plan(&soon, 1e9);
    let mut changes = Vec::new();
    let order = planner.next(&mut changes).unwrap();
    assert_eq!(order.wish.model, ModelId(2));
    assert!(changes.contains(&Change::Blunted(ModelId(1))), "{changes:?}");
    assert_eq!(planner.residency.held(ModelId(1)).map(|grade| grade.number), Some(2));
    planner.arrive(&order.files[0], order.files[0].bytes);
    planner.settle();
    // And it does not come back for as long as there is no room for both.
    let finer = fetch_all(&mut planner, &soon, 1e9);
    assert!(finer.iter().all(|order| order.wish.grade.number != 0), "{finer:?}");
}

#[test]
fn whoever_paces_between_two_rooms_fetches_nothing_again() {
    let room = |first: u32| [first, first + 1].map(|number| seen_at(number, number, 1.0, 1.0, model(number)));
    let (west, east) = (room(1), room(3));
    // From all that the two rooms cannot do without to all that there is in them.
    for memory_bytes in (8_000..=200_000).step_by(8_000) {
        let mut planner = within(memory_bytes);
        for turn in 0..20 {
            let (here, next) = if turn % 2 == 0 { (&west, &east) } else { (&east, &west) };
            need(&mut planner, here, next);
            fetch_all(&mut planner, &view(here, vec![(approach(2, 1, 1.0), &next[..])]), 1e9);
        }
        let evictions = planner.residency.evictions();
        assert_eq!(evictions.again_bytes, 0, "within {memory_bytes} bytes: {evictions:?}");
    }
}

#[test]
fn what_had_to_go_comes_back_for_what_is_far() {
    let (here, far) = ([seen(1, 1.0)], [seen_at(2, 2, 1.0, 1.0, model(2))]);
    let mut planner = within(60_000);
    let mut sharp = |here: &[Seen], steps: HashMap<ModelId, u32>| {
        planner
            .residency
            .need(here.iter().map(|seen| seen.model).collect(), steps);
        fetch_all(&mut planner, &view(here, Vec::new()), 1e9);
        planner.residency.held(here[0].model).map(|grade| grade.number) == Some(0)
    };
    assert!(sharp(&here, HashMap::new()) && sharp(&far, HashMap::from([(ModelId(1), 1)])));
    assert!(
        !sharp(&here, HashMap::from([(ModelId(2), 2)])),
        "what is near stays sharp"
    );
    assert!(sharp(&here, HashMap::from([(ModelId(2), 3)])));
}

#[test]
fn what_went_while_it_was_seen_comes_back_where_memory_is_free_or_after_a_way_there_and_back() {
    let (here, next) = ([seen(1, 1.0)], [seen_at(2, 2, 9.0, 1.0, model(2))]);
    let mut planner = within(43_000);
    let sharpness = |planner: &Planner| planner.residency.held(ModelId(1)).map(|grade| grade.number);
    let wants_finer = |planner: &Planner| {
        planner
            .wishes()
            .iter()
            .any(|wish| matches!(wish.cause, Cause::Finer { .. }))
    };
    let stand = |planner: &mut Planner| {
        let steps = HashMap::from([(ModelId(2), 1)]);
        planner.residency.need(HashSet::from([ModelId(1)]), steps);
        fetch_all(planner, &view(&here, Vec::new()), 1e9);
    };
    stand(&mut planner);
    assert_eq!(sharpness(&planner), Some(0));
    fetch_all(&mut planner, &view(&here, vec![(approach(2, 1, 1.0), &next[..])]), 1e9);
    assert_eq!(sharpness(&planner), Some(2), "it went for what is next door");
    // What is near takes little …
    planner.plan(&view(&here, Vec::new()), 1e9);
    assert!(wants_finer(&planner));
    // … until a quarter of the memory is on its way to here.
    planner.residency.ask(&FileRef::object(&name("much", "glb"), 10_750));
    planner.plan(&view(&here, Vec::new()), 1e9);
    assert!(!wants_finer(&planner));
    // Whoever has been away begins anew.
    planner.residency.need(HashSet::new(), HashMap::from([(ModelId(1), 2)]));
    planner.residency.need(HashSet::from([ModelId(1)]), HashMap::new());
    planner.plan(&view(&here, Vec::new()), 1e9);
    assert!(wants_finer(&planner));
}
