//! What does a crowd cost? (Poster on crowds with partial visibility, fig 1), for a server: a square full of people who all look on, with
//! partial occluders and without.

use belvedere_live::{
    Ms, World,
    aoi::Aoi,
    cells::{Cell, Cells},
    crowd::Crowding,
    event::{Event, FIRST_MOVER, SessionId},
    world::{Look, NewMover, Rules, Sent, Visitor},
};
use belvedere_scene::{Bounds, CellId, ObjectId};
use serde::{Deserialize, Serialize};

use crate::{
    host::Host,
    page::{
        Comparison, Goal, Plot, Row, Section,
        chart::{Axis, Chart, Series},
        count,
    },
    papers::crowd::{FIGURE_1, WITH_VALUES, WITHOUT},
    timing::cpu_s,
};

const SIDE_M: f64 = 120.0;
const TICKS: i64 = 50;
/// So many of them look on.
const OBSERVERS: u32 = 20;

/// Evenly spread, the same each time; everybody walks in a small circle.
fn sent(i: u32, people: u32, now_ms: Ms) -> Sent {
    let rows = f64::from(people).sqrt().ceil();
    let [column, row] = [f64::from(i) % rows, (f64::from(i) / rows).floor()];
    let place = |at: f64| (at + 0.5) / rows * SIDE_M;
    let angle = now_ms as f64 * 1e-3 + f64::from(i);
    Sent {
        t_ms: Some(now_ms),
        position: [place(column) + 0.3 * angle.cos(), 1.5, place(row) + 0.3 * angle.sin()],
        orientation: [0.0, 0.0, 0.0, 1.0],
        velocity: None,
        acceleration: None,
    }
}

/// A tick of the server.
#[derive(Debug, Serialize, Deserialize)]
pub struct Outcome {
    /// CPU milliseconds.
    pub tick_ms: f64,
    /// Poses told.
    pub told_a_tick: f64,
}

fn simulate(people: u32, crowd: Option<Crowding>) -> Outcome {
    let bounds = Bounds {
        min: [0.0; 3],
        max: [SIDE_M, 3.0, SIDE_M],
    };
    let mut cells = Cells::new(vec![Cell { bounds, planes: vec![] }]);
    cells.learn(CellId(0), &[]);
    let rules = Rules {
        bytes_per_s: 1e9,
        crowd,
        ..Rules::default()
    };
    let mut world = World::new(cells, &bounds, rules);
    let mut now_ms = 1_000_000;
    for i in 0..people {
        let (object, pose) = (ObjectId(FIRST_MOVER + i), sent(i, people, now_ms));
        // Observers stand all over the place.
        if i % (people / OBSERVERS).max(1) == 0 {
            let visitor = Visitor {
                pose,
                aoi: Aoi {
                    enter_m: 200.0,
                    leave_m: 220.0,
                },
                max_speed_mps: 1.0,
                max_acceleration_mps2: None,
                radius_m: 0.3,
                look: Look::default(),
                hears_movers: true,
                listens: true,
            };
            world
                .open(SessionId(u64::from(i)), object, visitor, now_ms)
                .expect("a session");
        } else {
            let new = NewMover {
                pose,
                max_speed_mps: 1.0,
                max_acceleration_mps2: None,
                radius_m: 0.3,
                look: Look::default(),
                way: None,
            };
            world.create(object, None, new, now_ms).expect("a mover");
        }
    }
    let (mut told, mut spent_s) = (0, 0.0);
    for tick in 0..TICKS + 20 {
        now_ms += rules.tick_ms;
        let start_s = cpu_s();
        for i in 0..people {
            let session = SessionId(u64::from(i));
            let pose = sent(i, people, now_ms);
            if world.standpoint(session).is_some() {
                world.pose(session, pose, now_ms).expect("a pose");
            } else {
                world.move_to(ObjectId(FIRST_MOVER + i), pose, now_ms).expect("a pose");
            }
        }
        world.tick(now_ms);
        // Everybody reads at once what is told, and in the first ticks learns of all others.
        while world.wants_room().next().is_some() {
            let waiting: Vec<_> = world.wants_room().collect();
            waiting.into_iter().for_each(|session| world.make_room(session));
            world.tick(now_ms);
        }
        let events = world.events();
        if tick >= 20 {
            spent_s += cpu_s() - start_s;
            told += events.iter().map(|(_, event)| poses(event)).sum::<usize>();
        }
    }
    Outcome {
        tick_ms: spent_s * 1e3 / TICKS as f64,
        told_a_tick: told as f64 / TICKS as f64,
    }
}

fn poses(event: &Event) -> usize {
    match event {
        Event::ObjectPos { objects, .. } => objects.len(),
        Event::ObjectInfo(_) => 1,
        _ => 0,
    }
}

const PEOPLE: [u32; 6] = [250, 500, 1_000, 2_000, 4_000, 8_000];
/// People of whom less can be seen are not told of, in the column that culls.
const CULL_BELOW: f64 = 0.05;
/// “Nearly flat”: from the first crowd to the last, cost grows at most so much of how the crowd grows.
const NEARLY_FLAT: f64 = 0.25;

/// What was measured.
#[derive(Debug, Serialize, Deserialize)]
pub struct Measured {
    /// For each crowd.
    pub rows: Vec<Crowd>,
    /// How many look on.
    pub observers: u32,
    /// Edge of the square.
    pub side_m: f64,
}

/// A crowd.
#[derive(Debug, Serialize, Deserialize)]
pub struct Crowd {
    /// People.
    pub people: u32,
    /// All told alike.
    pub alike: Outcome,
    /// Told as often as they can be seen.
    pub by_value: Outcome,
    /// The same, and not told of at all when hardly visible.
    pub culled: Outcome,
}

/// Measures.
///
/// # Errors
/// None; people that cannot be made end the program.
pub fn run(host: &Host) -> anyhow::Result<Measured> {
    let culling = Crowding {
        cull_below: CULL_BELOW,
        ..Crowding::default()
    };
    let crowd = |people: u32| {
        host.say(&format!("{people} people"));
        Crowd {
            people,
            alike: simulate(people, None),
            by_value: simulate(people, Some(Crowding::default())),
            culled: simulate(people, Some(culling)),
        }
    };
    Ok(Measured {
        rows: PEOPLE.map(crowd).into(),
        observers: OBSERVERS,
        side_m: SIDE_M,
    })
}

/// What it says.
#[must_use]
pub fn section(measured: &Measured) -> Section {
    let both = |outcome: &Outcome| format!("{:.1} ms, {:.0} poses", outcome.tick_ms, outcome.told_a_tick);
    let row = |crowd: &Crowd| Row {
        what: count(u64::from(crowd.people)),
        paper: format!("{WITH_VALUES} with values; {WITHOUT} without"),
        ours: vec![both(&crowd.alike), both(&crowd.by_value), both(&crowd.culled)],
        why: vec![0, 1],
    };
    let curve = |of: &dyn Fn(&Crowd) -> f64| {
        measured
            .rows
            .iter()
            .map(|crowd| [f64::from(crowd.people), of(crowd)])
            .collect::<Vec<_>>()
    };
    let chart = |title: &str, label: &str, of: &dyn Fn(&Outcome) -> f64| Chart {
        title: title.to_owned(),
        x: Axis::linear("people"),
        y: Axis::linear(label),
        right: None,
        series: vec![
            Series::new("all alike", 1, curve(&|crowd| of(&crowd.alike))).dashed(),
            Series::new("by visibility value", 3, curve(&|crowd| of(&crowd.by_value))),
            Series::new("culled below a value", 0, curve(&|crowd| of(&crowd.culled))),
        ],
    };
    // How much of the crowd's growth something follows.
    let growth = |of: &dyn Fn(&Crowd) -> f64| match (measured.rows.first(), measured.rows.last()) {
        (Some(first), Some(last)) => of(last) / of(first) / (f64::from(last.people) / f64::from(first.people)),
        _ => f64::NAN,
    };
    let shown = |x: f64| format!("{x:.2} of the crowd's growth");
    let last = measured.rows.last();
    Section {
        how: vec![format!(
            "People walk in small circles, evenly spread over an open square of {:.0} m; {} of them are told of all whom they may see. A tick's CPU and the poses told in it.",
            measured.side_m, measured.observers
        )],
        comparisons: vec![Comparison {
            source: FIGURE_1,
            of: "people",
            ours: ["all alike", "by visibility value", "culled below a value"].map(str::to_owned).into(),
            rows: measured.rows.iter().map(row).collect(),
        }],
        plots: vec![
            Plot {
                file: "fig1-cpu.svg".to_owned(),
                caption: "After fig 1: CPU of a tick against people".to_owned(),
                svg: chart("CPU of a tick against people", "CPU of a tick, ms", &|o| o.tick_ms).to_svg(),
            },
            Plot {
                file: "fig1-poses.svg".to_owned(),
                caption: "The same for what is told".to_owned(),
                svg: chart("Poses told in a tick against people", "poses told in a tick", &|o| o.told_a_tick).to_svg(),
            },
        ],
        reasons: vec![
            "The poster measures frames of a renderer and gives a curve without readable numbers; a server does not draw, so what is saved here is messages, and the CPU that writing them takes.".to_owned(),
            "Every person's pose comes in and moves occluders, whoever sees it: that part grows with the crowd in any case, and values themselves cost CPU. So the server's CPU cannot be flat; what is told can.".to_owned(),
        ],
        goals: vec![
            Goal::at_most("growth of what is told, culled", NEARLY_FLAT, growth(&|crowd| crowd.culled.told_a_tick), shown),
            Goal::at_most("growth of a tick's CPU, culled", NEARLY_FLAT, growth(&|crowd| crowd.culled.tick_ms), shown),
            Goal::at_most(
                "CPU of the largest crowd, culled, of that with all alike",
                1.0,
                last.map_or(f64::NAN, |crowd| crowd.culled.tick_ms / crowd.alike.tick_ms),
                |x| format!("{:.0} %", 100.0 * x),
            ),
        ],
        ..Section::default()
    }
}
