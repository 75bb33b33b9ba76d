//! Worlds made by hand: what is wanted first, what comes how, and what goes.

use std::{
    collections::{HashMap, HashSet},
    sync::Arc,
};

use belvedere_scene::{
    BlobName, Bounds, CellId, ModelId, ObjectId,
    index::CellEntry,
    object::{Level, Model, PackRef, TextureRef},
    record::Portal,
    rung::{Rung, RungName, SmoothLod},
};

use super::{
    ahead::{Approach, Cells, approaches},
    file::{FileRef, Key},
    grade::{Form, Grade},
    memory::Terms,
    motion::Motion,
    order::{Budgets, Change, Order, View},
    plan::{self, Held, target_within},
    planner::Planner,
    priority::Cause,
    progress::{first_progress, sharp_progress},
    residency::Residency,
    sight::{Eye, Seen},
};

fn name(of: &str, ext: &str) -> BlobName {
    BlobName::of(of.as_bytes(), ext).unwrap()
}

fn level(model: u32, number: u32, bytes: u64, error: f64) -> Level {
    Level {
        level: number,
        url: name(&format!("m{model} level {number}"), "glb"),
        bytes,
        triangles: 1000 >> number,
        geometric_error_m: error,
        switch_distance_m: 0.0,
        textures: Vec::new(),
        pack: None,
    }
}

/// Three levels of 40,000, 8,000 and 2,000 bytes.
pub(super) fn model(number: u32) -> Model {
    Model {
        levels: vec![
            level(number, 0, 40_000, 0.0),
            level(number, 1, 8_000, 0.01),
            level(number, 2, 2_000, 0.1),
        ],
        smooth: None,
        impostor: None,
        procedural: None,
    }
}

pub(super) fn smooth(number: u32, ends: &[(u64, f64)]) -> SmoothLod {
    let url = name(&format!("m{number} stream"), "slod");
    let rung = |at: usize| Rung {
        url: RungName {
            hash: url.hash(),
            number: at as u8,
        },
        from: at.checked_sub(1).map_or(0, |before| ends[before].0),
        to: ends[at].0,
        triangles: 100,
        geometric_error_m: ends[at].1,
        rms_error_m: 0.0,
    };
    SmoothLod {
        bytes: ends.last().unwrap().0,
        materials: name("materials", "gltf"),
        materials_bytes: 300,
        textures: Vec::new(),
        rungs: (0..ends.len()).map(rung).collect(),
        url,
    }
}

pub(super) fn seen_at(object: u32, model_id: u32, away_m: f64, solid_angle_sr: f64, geometry: Model) -> Seen {
    Seen {
        object: ObjectId(object),
        bounds: Bounds {
            min: [away_m, 0.0, 0.0],
            max: [away_m + 1.0, 1.0, 1.0],
        },
        scale: 1.0,
        solid_angle_sr,
        model: ModelId(model_id),
        geometry: Arc::new(geometry),
    }
}

fn seen(number: u32, away_m: f64) -> Seen {
    seen_at(number, number, away_m, 1.0 / away_m, model(number))
}

fn eye() -> Eye {
    Eye::at([0.0; 3])
}

pub(super) fn view<'a>(here: &'a [Seen], ahead: Vec<(Approach, &'a [Seen])>) -> View<'a> {
    View {
        eye: eye(),
        here,
        is_all_known: true,
        ahead,
    }
}

pub(super) fn within(memory_bytes: u64) -> Planner {
    Planner::new(Budgets {
        memory_bytes,
        ..Budgets::default()
    })
}

/// Lets everything come that is asked for, planning anew in between; answers the orders.
fn fetch_all(planner: &mut Planner, view: &View, rate: f64) -> Vec<Order> {
    let (mut orders, mut changes) = (Vec::new(), Vec::new());
    planner.plan(view, rate);
    while let Some(order) = planner.next(&mut changes).or_else(|| {
        planner.plan(view, rate);
        planner.next(&mut changes)
    }) {
        for file in &order.files {
            planner.arrive(file, file.bytes);
        }
        planner.settle();
        orders.push(order);
        assert!(orders.len() < 1000, "it never ends");
    }
    orders
}

pub(super) fn need(planner: &mut Planner, here: &[Seen], next_door: &[Seen]) {
    let models: HashSet<_> = here.iter().map(|seen| seen.model).collect();
    let steps = next_door.iter().map(|seen| (seen.model, 1)).collect();
    planner.residency.need(models, steps);
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
    let mut asked = HashSet::new();
    assert!(
        orders
            .iter()
            .flat_map(|order| &order.files)
            .all(|file| asked.insert(file.name.key()))
    );
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
    let mut asked = HashSet::new();
    assert!(
        orders
            .iter()
            .flat_map(|order| &order.files)
            .all(|file| asked.insert(file.name.key()))
    );
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
    planner.residency.forgive();
    planner.lose_stream(&here[0].geometry);
    let orders = fetch_all(&mut planner, &no_level, f64::INFINITY);
    assert_eq!(
        planner.residency.held(ModelId(1)).map(|grade| grade.form),
        Some(Form::Level)
    );
    assert!(matches!(orders[0].wish.cause, Cause::Finer { .. }));
}

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

#[test]
fn small_files_come_together_and_each_once() {
    let mut textured = |number: u32| {
        let mut model = model(number);
        model.levels.drain(..2);
        let texture = |at: u32| TextureRef {
            url: name(&format!("picture {at}"), "png"),
            bytes: 3_000,
        };
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
    let mut asked = HashSet::new();
    assert!(
        orders
            .iter()
            .flat_map(|order| &order.files)
            .all(|file| asked.insert(file.name.key()))
    );
    assert!(here.iter().all(|seen| planner.residency.held(seen.model).is_some()));
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

pub(super) fn approach(cell: u32, step: u8, in_s: f64) -> Approach {
    Approach {
        cell: CellId(cell),
        step,
        in_s,
    }
}

#[test]
fn what_is_due_comes_before_what_is_finer_and_what_is_far_off_comes_last_or_not_at_all() {
    let (here, next, later, never) = ([seen(1, 1.0)], [seen(2, 9.0)], [seen(3, 9.0)], [seen(4, 9.0)]);
    let ahead = vec![
        (approach(2, 1, 2.0), &next[..]),
        (approach(3, 2, 20.0), &later[..]),
        (approach(4, 3, 60.0), &never[..]),
    ];
    let view = view(&here, ahead);
    let models = |rate: f64| {
        let orders = fetch_all(&mut within(u64::MAX), &view, rate);
        orders.iter().map(|order| order.wish.model.0).collect::<Vec<_>>()
    };
    assert_eq!(models(1e9), [1, 2, 1, 3]);
    // On a slow line, what lies further ahead is due as well.
    assert_eq!(models(200.0), [1, 2, 3, 1]);
    assert_eq!(models(10.0), [1, 2, 3, 4, 1]);
}

struct Corridor;

const UNKNOWN: &str = "record";

impl Corridor {
    fn entries() -> Vec<CellEntry> {
        let entry = |cell: u32| CellEntry {
            cell: CellId(cell),
            bounds: Bounds {
                min: [f64::from(cell) * 4.0, 0.0, 0.0],
                max: [f64::from(cell) * 4.0 + 4.0, 3.0, 4.0],
            },
            planes: Vec::new(),
            adjacent: [cell.checked_sub(1), Some(cell + 1).filter(|next| *next < 5)]
                .into_iter()
                .flatten()
                .map(CellId)
                .collect(),
            record: name(UNKNOWN, "cell"),
            record_bytes: 1,
            steps: None,
            steps_bytes: None,
            record_json: name(UNKNOWN, "json"),
        };
        (0..5).map(entry).collect()
    }
}

struct World(Vec<CellEntry>);

impl Cells for World {
    fn entry(&self, cell: CellId) -> Option<&CellEntry> {
        self.0.get(cell.index())
    }

    fn portals(&self, _: CellId) -> &[Portal] {
        &[]
    }
}

#[test]
fn cells_ahead_come_in_three_steps_with_the_time_that_they_take() {
    let world = World(Corridor::entries());
    let mut motion = Motion::default();
    for tick in 0..30 {
        motion.observe(f64::from(tick) * 0.1, [7.0 + f64::from(tick) * 0.1, 1.5, 2.0]);
    }
    let found = approaches(CellId(2), &world, [10.0, 1.5, 2.0], motion.velocity_mps());
    let told: Vec<_> = found.iter().map(|one| (one.cell.0, one.step)).collect();
    assert_eq!(told, [(3, 1), (1, 2), (4, 3)]);
    let in_s = |at: usize| found[at].in_s;
    assert!(
        (in_s(0) - 2.0).abs() < 0.1 && (in_s(1) - 3.0).abs() < 0.1 && in_s(2) > in_s(0),
        "{found:?}"
    );
    // Who stands may go either way.
    let standing = approaches(CellId(2), &world, [10.0, 1.5, 2.0], [0.0; 3]);
    assert!(
        standing.iter().all(|one| one.step == 2) && standing.len() == 2,
        "{standing:?}"
    );
}

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
            blunts: false,
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
    held.ask(&file(2));
    held.arrive(file(2).name.key(), 100);
    assert_eq!(held.evictions().again_bytes, 100);
    assert!(held.peak_bytes() <= 500);
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
    assert_eq!(text, "0.0 of 0.0 MB of what you can see");
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
    assert!(planner.is_wanted(&order));
    planner.plan(&view(&there, Vec::new()), 1e9);
    assert!(!planner.is_wanted(&order));
    let key: Key = order.files[0].name.key();
    planner.residency.withdraw(key);
    assert_eq!(planner.residency.asked_bytes(), 0);
    let again = plan::first_wishes(&here, &planner.residency);
    assert_eq!(again.len(), 1);
}
