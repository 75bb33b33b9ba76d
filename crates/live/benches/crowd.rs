//! What does a crowd cost? The chart of the paper's figure 1, for a server: a square full of people who all look on, with partial
//! occluders and without. Prints Markdown; `cargo bench -p belvedere-live --bench crowd`.

#![allow(clippy::print_stdout, reason = "that is what a bench is for")]

use std::fs;

use belvedere_live::{
    Ms, World,
    aoi::Aoi,
    cells::{Cell, Cells},
    crowd::Crowding,
    event::{Event, FIRST_MOVER, SessionId},
    world::{Look, NewMover, Rules, Sent, Visitor},
};
use belvedere_scene::{Bounds, CellId, ObjectId};

const SIDE_M: f64 = 120.0;
const TICKS: i64 = 50;
/// So many of them look on.
const OBSERVERS: u32 = 20;

/// CPU time of this thread so far, in seconds: the machine may be busy with other things.
fn cpu_s() -> f64 {
    let stat = fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanoseconds = stat.split(' ').next().and_then(|n| n.parse::<f64>().ok());
    nanoseconds.unwrap_or(0.0) * 1e-9
}

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

struct Outcome {
    tick_ms: f64,
    told_a_tick: f64,
}

fn run(people: u32, crowd: Option<Crowding>) -> Outcome {
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

fn main() {
    println!(
        "| people on {SIDE_M} m × {SIDE_M} m, {OBSERVERS} of whom look on | poses told in a tick | by visibility value | culled below 5 % | CPU of a tick | by visibility value | culled |"
    );
    println!("|---|---|---|---|---|---|---|");
    for people in [250, 500, 1_000, 2_000, 4_000, 8_000] {
        let culling = Crowding {
            cull_below: 0.05,
            ..Crowding::default()
        };
        let [off, on, culled] = [None, Some(Crowding::default()), Some(culling)].map(|crowd| run(people, crowd));
        let told = [&off, &on, &culled]
            .map(|outcome| format!("{:.0}", outcome.told_a_tick))
            .join(" | ");
        let spent = [&off, &on, &culled]
            .map(|outcome| format!("{:.1} ms", outcome.tick_ms))
            .join(" | ");
        println!("| {people} | {told} | {spent} |");
    }
}
