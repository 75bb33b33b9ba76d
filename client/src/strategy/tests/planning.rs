//! What is wanted first, and how it comes.

use super::*;

fn assert_each_file_once(orders: &[Order]) {
    let mut asked = HashSet::new();
    let mut files = orders.iter().flat_map(|order| &order.files);
    assert!(files.all(|file| asked.insert(file.name.key())));
}

#[test]
fn something_of_everything_comes_before_anything_finer() {
    let here = [seen(1, 1.0), seen(2, 12.0), seen(3, 400.0)];
    let mut planner = within(u64::MAX);
    let orders = fetch_all(&mut planner, &view(&here, Vec::new()), f64::INFINITY);
    let told: Vec<_> = orders
        .iter()
        .map(|order| (order.wish.model.0, order.wish.grade.number))
        .collect();
    // The nearest is the largest; far away the coarsest level will do.
    assert_eq!(told, [(1, 2), (2, 2), (3, 2), (1, 0), (2, 1)]);
    let [first, .., finer] = [&orders[0], &orders[3]];
    assert!(first.wish.priority < finer.wish.priority);
    assert!(
        first
            .wish
            .to_string()
            .starts_with("not here yet, 1.00 sr: m1 level 2, "),
        "{}",
        first.wish
    );
    assert!(finer.wish.to_string().contains("px off: m1 level 0"), "{}", finer.wish);
    assert!(first.wish.benefit_per_byte() > 0.0);
}

#[test]
fn objects_that_share_a_model_share_its_files_and_the_nearest_decides() {
    let here = [
        seen_at(1, 7, 300.0, 0.4, model(7)),
        seen_at(2, 7, 2.0, 0.3, model(7)),
        seen_at(3, 7, 300.0, 0.2, model(7)),
    ];
    let mut planner = within(u64::MAX);
    let orders = fetch_all(&mut planner, &view(&here, Vec::new()), f64::INFINITY);
    let told: Vec<_> = orders
        .iter()
        .map(|order| (order.wish.grade.number, order.wish.object.0))
        .collect();
    assert_eq!(told, [(2, 1), (0, 2)]);
    assert_each_file_once(&orders);
}

#[test]
fn rungs_are_appended_where_they_cost_less_and_levels_where_not() {
    let mut streamed = model(1);
    streamed.smooth = Some(smooth(1, &[(900, 0.09), (3_000, 0.02), (30_000, 0.0)]));
    let here = [seen_at(1, 1, 12.0, 1.0, streamed), seen(2, 12.0)];
    let mut planner = within(u64::MAX);
    let orders = fetch_all(&mut planner, &view(&here, Vec::new()), f64::INFINITY);
    // `n` behind a wish's grade is a rung; m1's coarsest level takes 2,000 · 0.47 bytes, its rung and materials more.
    let grades: Vec<_> = orders
        .iter()
        .map(|order| (order.wish.model.0, order.wish.grade.form))
        .collect();
    assert!(
        grades.contains(&(1, Form::Level)) && !grades.contains(&(2, Form::Rung)),
        "{grades:?}"
    );
    let drawn = planner.residency.held(ModelId(1)).unwrap();
    assert!(
        drawn.will_do(&here[0].geometry, here[0].error_of_px(1.0, &eye())),
        "{drawn}"
    );
    assert_each_file_once(&orders);
}

#[test]
fn rules_come_once_and_grow_what_they_draw_for_fewer_bytes_than_levels() {
    let mut tree = grown(3);
    tree.levels[0].triangles = 20_000;
    let here = [
        seen_at(1, 1, 1.0, 1.0, grown(1)),
        seen_at(2, 2, 2.0, 0.9, grown(2)),
        seen_at(3, 3, 900.0, 0.1, tree),
    ];
    let mut planner = within(u64::MAX);
    let orders = fetch_all(&mut planner, &view(&here, Vec::new()), f64::INFINITY);
    let held = |number: u32| planner.residency.held(ModelId(number)).unwrap();
    // 2,000 · 0.47 + 400 bytes for a coarsest level, 2,000 · 0.29 + 400 for the rules; and a thousand triangles, or 20,000.
    assert_eq!(orders[0].wish.grade.form, Form::Grown);
    assert_eq!([held(1).form, held(2).form], [Form::Grown; 2]);
    assert_eq!(
        (held(3).form, held(3).number),
        (Form::Level, 2),
        "far away a coarse level is enough"
    );
    assert_eq!(orders.iter().filter(|order| order.path().ends_with(".dcg")).count(), 1);
    assert_each_file_once(&orders);
}

#[test]
fn models_grow_where_their_levels_take_more_than_the_rules_that_all_of_them_share() {
    let waiting = |number: u32| {
        let mut model = grown(number);
        model.procedural.as_mut().unwrap().rules_bytes = 4_000;
        seen_at(number, number, 300.0, 1.0, model)
    };
    let forms = |count: u32| -> Vec<Form> {
        let here: Vec<_> = (0..count).map(waiting).collect();
        let wishes = plan::first_wishes(&here, &within(u64::MAX).residency);
        wishes.iter().map(|wish| wish.grade.form).collect()
    };
    // A level takes 2,000 · 0.47 + 400 bytes; the rules 4,000 · 0.29 + 400, and a thousand triangles count 250.
    assert_eq!(forms(1), [Form::Level]);
    assert_eq!(forms(2), [Form::Grown; 2]);
}

#[test]
fn what_can_only_be_grown_grows_and_levels_take_its_place_where_it_cannot() {
    let mut standing_in = grown(1);
    standing_in.levels.clear();
    let here = [seen_at(1, 1, 300.0, 1.0, standing_in)];
    let mut planner = within(u64::MAX);
    fetch_all(&mut planner, &view(&here, Vec::new()), f64::INFINITY);
    assert_eq!(
        planner.residency.held(ModelId(1)).map(|grade| grade.form),
        Some(Form::Grown)
    );
    // Somebody has found that the rules are wrong, and has read what else there is.
    planner.lose_rules();
    let known = [seen_at(1, 1, 300.0, 1.0, grown(1))];
    let orders = fetch_all(&mut planner, &view(&known, Vec::new()), f64::INFINITY);
    assert_eq!(orders.len(), 1);
    assert_eq!(
        planner.residency.held(ModelId(1)).map(|grade| grade.form),
        Some(Form::Level)
    );
}

#[test]
fn rules_stay_lost_for_what_is_learnt_later_and_when_all_else_is_tried_again() {
    let mut planner = within(u64::MAX);
    planner.lose_rules();
    let forms = |planner: &mut Planner| {
        planner.plan(&view(&[seen_at(1, 1, 1.0, 1.0, grown(1))], Vec::new()), f64::INFINITY);
        planner.wishes().iter().map(|wish| wish.grade.form).collect::<Vec<_>>()
    };
    assert_eq!(forms(&mut planner), [Form::Level]);
    planner.residency.forgive_all();
    assert_eq!(forms(&mut planner), [Form::Level]);
}

#[test]
fn what_can_only_be_grown_counts_with_its_rules() {
    let mut standing_in = grown(1);
    standing_in.levels.clear();
    let here = [seen_at(1, 1, 300.0, 1.0, standing_in)];
    let mut planner = within(u64::MAX);
    assert_eq!(plan::least_bytes(&here, &planner.residency), 2_000);
    let of = |planner: &Planner| {
        let progress = first_progress(&here, &planner.residency);
        [progress.loaded_bytes, progress.total_bytes]
    };
    assert_eq!(of(&planner), [0, 2_000]);
    fetch_all(&mut planner, &view(&here, Vec::new()), f64::INFINITY);
    assert_eq!(of(&planner), [2_000, 2_000]);
}

#[test]
fn a_stream_that_is_damaged_leaves_its_model_to_levels() {
    let mut streamed = model(1);
    streamed.levels.truncate(1);
    streamed.smooth = Some(smooth(1, &[(900, 0.09), (40_000, 0.0)]));
    let here = [seen_at(1, 1, 1.0, 1.0, streamed)];
    let mut planner = within(u64::MAX);
    let no_level = view(&here, Vec::new());
    planner.plan(&no_level, f64::INFINITY);
    let wish = planner.wishes()[0];
    assert_eq!(
        wish.grade.form,
        Form::Level,
        "level 0 takes 40,000 · 0.47 bytes, the stream all of its own"
    );
    planner.residency.lose((&here[0].geometry.levels[0].url).into());
    let orders = fetch_all(&mut planner, &no_level, f64::INFINITY);
    assert!(orders.iter().all(|order| order.wish.grade.form == Form::Rung) && !orders.is_empty());
    planner.residency.forgive_all();
    planner.lose_stream(&here[0].geometry);
    let orders = fetch_all(&mut planner, &no_level, f64::INFINITY);
    assert_eq!(
        planner.residency.held(ModelId(1)).map(|grade| grade.form),
        Some(Form::Level)
    );
    assert!(matches!(orders[0].wish.cause, Cause::Finer { .. }));
}

#[test]
fn small_files_come_together_and_each_once() {
    let mut textured = |number: u32| {
        let mut model = model(number);
        model.levels.drain(..2);
        let texture = |at: u32| TextureRef {
            url: name(&format!("picture {at}"), "png"),
            bytes: 3_000,
        };
        model.levels[0].bytes = 400;
        model.levels[0].textures = vec![texture(number), texture(number / 2)];
        seen_at(number, number, 300.0, 1.0, model)
    };
    let here: Vec<_> = (0..6).map(&mut textured).collect();
    let mut planner = within(u64::MAX);
    planner.offer_bundles(true);
    let orders = fetch_all(&mut planner, &view(&here, Vec::new()), f64::INFINITY);
    assert!(
        orders
            .iter()
            .any(|order| order.files.len() > 3 && order.path().starts_with("/o/bundle/"))
    );
    assert_each_file_once(&orders);
    assert!(here.iter().all(|seen| planner.residency.held(seen.model).is_some()));
    // Servers compress files, and no bundles.
    for order in &orders {
        let travels_whole = order.files.len() > 1 || order.path().ends_with(".png");
        assert_eq!(
            order.line_bytes() == order.bytes() as f64,
            travels_whole,
            "{}",
            order.path()
        );
    }
}

#[test]
fn what_cannot_be_had_is_done_without() {
    let here = [seen(1, 1.0)];
    let mut planner = within(u64::MAX);
    let lose =
        |planner: &mut Planner, number: usize| planner.residency.lose((&here[0].geometry.levels[number].url).into());
    lose(&mut planner, 2);
    let orders = fetch_all(&mut planner, &view(&here, Vec::new()), f64::INFINITY);
    assert_eq!(orders[0].wish.grade.number, 1, "the next finer one");
    let mut planner = within(u64::MAX);
    (0..3).for_each(|number| lose(&mut planner, number));
    assert!(fetch_all(&mut planner, &view(&here, Vec::new()), f64::INFINITY).is_empty());
}

#[test]
fn progress_is_exact_and_its_total_does_not_depend_on_what_is_here() {
    let here = [seen(1, 1.0), seen(2, 300.0)];
    let mut planner = within(u64::MAX);
    let of = |planner: &Planner| {
        let first = first_progress(&here, &planner.residency);
        let sharp = sharp_progress(&here, &planner.residency, &eye(), 1.0);
        [
            first.loaded_bytes,
            first.total_bytes,
            sharp.loaded_bytes,
            sharp.total_bytes,
        ]
    };
    assert_eq!(of(&planner), [0, 4_000, 0, 42_000]);
    planner.plan(&view(&here, Vec::new()), 1e9);
    let order = planner.next(&mut Vec::new()).unwrap();
    planner.arrive(&order.files[0], order.files[0].bytes);
    planner.settle();
    assert_eq!(of(&planner), [2_000, 4_000, 0, 42_000]);
    fetch_all(&mut planner, &view(&here, Vec::new()), 1e9);
    assert_eq!(of(&planner), [4_000, 4_000, 42_000, 42_000]);
    let text = first_progress(&here, &planner.residency).to_string();
    assert_eq!(text, "4.0 of 4.0 kB of what you can see");
}

#[test]
fn triangles_have_a_budget() {
    let here: Vec<_> = (1..9).map(|number| seen(number, 2.0)).collect();
    assert_eq!(target_within(&here, &eye(), 1.0, u64::MAX), 1.0);
    let blunt = target_within(&here, &eye(), 1.0, 8 * 300);
    assert!(blunt > 1.0, "{blunt}");
    let mut planner = Planner::new(Budgets {
        triangles: 8 * 300,
        ..Budgets::default()
    });
    fetch_all(&mut planner, &view(&here, Vec::new()), 1e9);
    let drawn = here.iter().filter_map(|seen| planner.residency.held(seen.model));
    assert!(drawn.map(|grade| grade.triangles).sum::<u64>() <= 8 * 300);
}

#[test]
fn a_wish_that_nobody_has_any_more_is_told_from_one_that_stands() {
    let (here, there) = ([seen(1, 1.0)], [seen(2, 1.0)]);
    let mut planner = within(u64::MAX);
    planner.plan(&view(&here, Vec::new()), 1e9);
    let order = planner.next(&mut Vec::new()).unwrap();
    assert!(!planner.wanted_of(&order).is_empty());
    planner.plan(&view(&there, Vec::new()), 1e9);
    assert_eq!(planner.wanted_of(&order), []);
    let key: Key = order.files[0].name.key();
    planner.residency.withdraw(key);
    assert_eq!(planner.residency.asked_bytes(), 0);
    let again = plan::first_wishes(&here, &planner.residency);
    assert_eq!(again.len(), 1);
}

#[test]
fn what_cannot_be_had_alone_comes_with_its_pack_or_not_at_all() {
    let mut here = [seen(1, 1.0)];
    let model = Arc::make_mut(&mut here[0].geometry);
    model.levels.truncate(1);
    let alone = FileRef::object(&model.levels[0].url, model.levels[0].bytes);
    let pack = PackRef {
        url: name("pack", "pack"),
        bytes: 100 * model.levels[0].bytes,
        from: 0,
    };
    model.levels[0].pack = Some(pack.clone());
    let mut planner = within(u64::MAX);
    let mut asked = Vec::new();
    for _ in 0..4 {
        planner.plan(&view(&here, Vec::new()), f64::INFINITY);
        let Some(order) = planner.next(&mut Vec::new()) else {
            break;
        };
        for file in order.files {
            planner.residency.lose(file.name.key());
            asked.push(file.name.key());
        }
    }
    assert_eq!(asked, [alone.name.key(), (&pack.url).into()]);
}
