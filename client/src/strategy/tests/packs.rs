//! Many coarsest levels in one file: when it is asked for, and what of it counts as here while it comes.

use super::*;

/// Six models whose coarsest levels stand in one pack.
fn packed(pack_bytes: u64) -> Vec<Seen> {
    let inside = |number: u32| {
        let mut model = model(number);
        model.levels[2].pack = Some(PackRef {
            url: name("pack", "pack"),
            bytes: pack_bytes,
            from: u64::from(number) * 2_000,
        });
        seen_at(number, number, 300.0, 1.0, model)
    };
    (0..6).map(inside).collect()
}

#[test]
fn a_pack_comes_where_most_of_it_is_wanted() {
    let here = packed(12_000);
    let mut planner = within(u64::MAX);
    assert_eq!(
        fetch_all(&mut planner, &view(&here, Vec::new()), f64::INFINITY).len(),
        1
    );
    assert!(here.iter().all(|seen| planner.residency.held(seen.model).is_some()));
    let mut planner = within(u64::MAX);
    let few = &here[..2];
    assert_eq!(fetch_all(&mut planner, &view(few, Vec::new()), f64::INFINITY).len(), 2);
    // Where memory is limited, each of its levels can go by itself, and what does not fit together comes alone.
    let mut planner = within(9_000);
    need(&mut planner, &here, &[]);
    let orders = fetch_all(&mut planner, &view(&here, Vec::new()), f64::INFINITY);
    assert_eq!(orders.len(), 4);
    assert!(planner.is_short() && planner.residency.peak_bytes() <= 9_000);
}

/// A pack that was asked for, and its files.
fn asked(planner: &mut Planner, here: &[Seen]) -> (FileRef, Vec<Member>) {
    need(planner, here, &[]);
    planner.plan(&view(here, Vec::new()), f64::INFINITY);
    let order = planner.next(&mut Vec::new()).unwrap();
    let [pack] = &order.files[..] else { panic!("{order:?}") };
    (pack.clone(), planner.members_of(pack.name.key()))
}

#[test]
fn what_comes_out_of_a_pack_takes_its_share_of_what_was_promised() {
    let here = packed(12_000);
    for memory_bytes in [u64::MAX, 12_000] {
        let mut planner = within(memory_bytes);
        let (pack, members) = asked(&mut planner, &here);
        for (came, member) in (1..).zip(&members[..4]) {
            assert!(planner.arrive_out_of(pack.name.key(), member));
            assert_eq!(planner.settle().len(), 1);
            let bytes = [planner.residency.bytes(), planner.residency.asked_bytes()];
            assert_eq!(bytes, [2_000 * came, 12_000 - 2_000 * came]);
        }
        assert!(!planner.arrive_out_of(pack.name.key(), &members[0]), "it is here");
        planner.arrive(&pack, pack.bytes);
        assert_eq!(planner.settle().len(), 2);
        let bytes = [planner.residency.bytes(), planner.residency.peak_bytes()];
        assert_eq!((bytes, planner.residency.asked_bytes()), ([12_000, 12_000], 0));
    }
}

#[test]
fn what_had_come_out_of_a_pack_that_is_lost_is_not_asked_for_again() {
    let here = packed(12_000);
    for memory_bytes in [u64::MAX, 12_000] {
        let mut planner = within(memory_bytes);
        let (pack, members) = asked(&mut planner, &here);
        planner.arrive_out_of(pack.name.key(), &members[0]);
        planner.settle();
        planner.residency.lose(pack.name.key());
        assert_eq!(planner.residency.asked_bytes(), 0);
        let orders = fetch_all(&mut planner, &view(&here, Vec::new()), f64::INFINITY);
        let alone: HashSet<Key> = orders.iter().map(|order| order.files[0].name.key()).collect();
        assert_eq!(alone, members[1..].iter().map(|member| member.key).collect());
    }
}

#[test]
fn what_could_not_be_had_alone_is_here_once_it_comes_out_of_a_pack() {
    let here = packed(12_000);
    let mut planner = within(12_000);
    let (pack, members) = asked(&mut planner, &here);
    planner.residency.lose(members[0].key);
    planner.arrive_out_of(pack.name.key(), &members[0]);
    assert!(planner.is_here(members[0].key));
}

#[test]
fn what_comes_a_second_time_is_still_used_by_whom_it_was_used() {
    let here = packed(12_000);
    let mut planner = within(12_000);
    let (pack, members) = asked(&mut planner, &here);
    planner.arrive_out_of(pack.name.key(), &members[0]);
    planner.settle();
    planner.residency.withdraw(pack.name.key());
    planner.residency.arrive(members[0].key, members[0].bytes);
    need(&mut planner, &[], &[]);
    let terms = Terms {
        spare_bytes: 0,
        within_steps: 0,
        sharp_within_steps: None,
    };
    let gone = planner.residency.make_room(12_000, &[], terms).unwrap();
    assert_eq!(gone.models, [here[0].model]);
    assert_eq!(planner.residency.bytes(), 0);
}

#[test]
fn what_went_while_its_pack_was_coming_takes_no_memory_that_was_promised_to_others() {
    let here = packed(12_000);
    let mut planner = within(12_000);
    let (pack, members) = asked(&mut planner, &here);
    planner.arrive_out_of(pack.name.key(), &members[0]);
    planner.settle();
    need(&mut planner, &[], &[]);
    let terms = Terms {
        spare_bytes: 0,
        within_steps: 0,
        sharp_within_steps: None,
    };
    planner.residency.make_room(2_000, &[], terms).unwrap();
    planner.residency.ask(&FileRef::object(&name("another", "glb"), 2_000));
    assert_eq!(planner.arrive(&pack, pack.bytes).len(), members.len() - 1);
    assert_eq!(planner.residency.peak_bytes(), 12_000);
}
