//! Worlds made by hand: what is wanted first, what comes how, and what goes.

mod ahead;
mod memory;
mod packs;
mod planning;
mod properties;

use std::{
    collections::{HashMap, HashSet},
    sync::Arc,
};

use belvedere_scene::{
    BlobName, Bounds, CellId, ModelId, ObjectId,
    index::CellEntry,
    object::{Level, Model, PackRef, Procedural, TextureRef},
    record::Portal,
    rung::{Rung, RungName, SmoothLod},
};

use super::{
    ahead::{Approach, Cells, approaches},
    file::{FileRef, Key},
    grade::{Form, Grade},
    memory::Terms,
    motion::Motion,
    order::{Budgets, Change, Member, Order, View},
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
fn model(number: u32) -> Model {
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

/// The same for models of one file of 2,000 bytes.
pub(crate) fn grown(number: u32) -> Model {
    Model {
        procedural: Some(Procedural {
            rules: name("rules", "dcg"),
            rules_bytes: 2_000,
            imports: Default::default(),
            part: None,
            parameters: Default::default(),
            seed: number,
        }),
        ..model(number)
    }
}

pub(crate) fn smooth(number: u32, ends: &[(u64, f64)]) -> SmoothLod {
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

pub(crate) fn seen_at(object: u32, model_id: u32, away_m: f64, solid_angle_sr: f64, geometry: Model) -> Seen {
    Seen {
        object: ObjectId(object),
        bounds: Bounds {
            min: [away_m, 0.0, 0.0],
            max: [away_m + 1.0, 1.0, 1.0],
        },
        transform: std::array::from_fn(|i| if i % 5 == 0 { 1.0 } else { 0.0 }),
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

fn view<'a>(here: &'a [Seen], ahead: Vec<(Approach, &'a [Seen])>) -> View<'a> {
    View {
        eye: eye(),
        here,
        is_all_known: true,
        ahead,
    }
}

fn within(memory_bytes: u64) -> Planner {
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

fn need(planner: &mut Planner, here: &[Seen], next_door: &[Seen]) {
    let models: HashSet<_> = here.iter().map(|seen| seen.model).collect();
    let steps = next_door.iter().map(|seen| (seen.model, 1)).collect();
    planner.residency.need(models, steps);
}

fn approach(cell: u32, step: u8, in_s: f64) -> Approach {
    Approach {
        cell: CellId(cell),
        step,
        in_s,
    }
}
