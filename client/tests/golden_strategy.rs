//! Do Rust and TypeScript decide alike what to fetch? `tests/golden/strategy/situations.json` holds a small world and where
//! somebody is in it, with what is held and how fast the line is; `decisions.json` holds which way one goes, which cells one
//! may enter when, what is fetched one after the other, and how much that is. `viewer/core/strategy/golden.test.ts` reads both.
//! `make bless` writes the second.

#![allow(clippy::unwrap_used, reason = "a test may fail at any step")]

use std::{
    collections::{BTreeMap, HashMap},
    fs,
    path::PathBuf,
    sync::Arc,
};

use belvedere_client::strategy::{
    ahead::{Cells, approaches},
    grade::{Grade, State, Stock},
    motion::Motion,
    order::{Budgets, View},
    planner::Planner,
    priority::{Cause, Wish},
    progress::{first_progress, sharp_progress},
    sight::{Eye, Seen},
};
use belvedere_scene::{
    BlobName, Bounds, CellId, ModelId, ObjectId,
    index::CellEntry,
    object::{Level, Model, PackRef, Procedural, TextureRef},
    record::Portal,
    rung::{Rung, RungName, SmoothLod},
};
use serde::Deserialize;
use serde_json::{Value as Json, json};

#[derive(Deserialize)]
struct Situations {
    cells: Vec<Cell>,
    objects: Vec<Object>,
    models: Vec<Shape>,
    packs: Vec<Pack>,
    walks: Vec<Walk>,
}

#[derive(Deserialize)]
struct Cell {
    cell: u32,
    min: [f64; 3],
    max: [f64; 3],
    openings: Vec<Opening>,
    sees: Vec<u32>,
}

#[derive(Deserialize)]
struct Opening {
    to: u32,
    min: [f64; 3],
    max: [f64; 3],
}

#[derive(Deserialize)]
struct Object {
    model: u32,
    min: [f64; 3],
    max: [f64; 3],
    scale: f64,
}

/// Levels as bytes, triangles and error, with the bytes of their pictures; rungs as end, triangles and error; which pack
/// holds the coarsest level, and from where on; the bytes of the one file of rules from which all grow that do.
#[derive(Deserialize)]
struct Shape {
    levels: Vec<(u64, u64, f64)>,
    #[serde(default)]
    pictures: Vec<Vec<u64>>,
    #[serde(default)]
    rungs: Vec<(u64, u64, f64)>,
    pack: Option<(usize, u64)>,
    rules_bytes: Option<u64>,
}

#[derive(Deserialize)]
struct Pack {
    bytes: u64,
}

#[derive(Deserialize)]
struct Walk {
    name: String,
    cell: u32,
    poses: Vec<(f64, [f64; 3])>,
    bytes_per_s: Option<f64>,
    most_triangles: Option<u64>,
    #[serde(default)]
    held: Vec<(u32, String)>,
    #[serde(default)]
    lost: Vec<String>,
}

struct World {
    entries: Vec<CellEntry>,
    portals: Vec<Vec<Portal>>,
    seen: Vec<Vec<Seen>>,
}

impl Cells for World {
    fn entry(&self, cell: CellId) -> Option<&CellEntry> {
        self.entries.get(cell.index())
    }

    fn portals(&self, cell: CellId) -> &[Portal] {
        &self.portals[cell.index()]
    }
}

fn name(of: &str, ext: &str) -> BlobName {
    BlobName::of(of.as_bytes(), ext).unwrap()
}

fn model_of(number: usize, shape: &Shape, packs: &[Pack]) -> Model {
    let coarsest = shape.levels.len() - 1;
    let level = |(at, (bytes, triangles, error)): (usize, &(u64, u64, f64))| Level {
        level: at as u32,
        url: name(&format!("m{number} level {at}"), "glb"),
        bytes: *bytes,
        triangles: *triangles,
        geometric_error_m: *error,
        switch_distance_m: 0.0,
        textures: shape.pictures.get(at).map_or_else(Vec::new, |all| {
            let texture = |(i, bytes): (usize, &u64)| TextureRef {
                url: name(&format!("m{number} picture {at} {i}"), "png"),
                bytes: *bytes,
            };
            all.iter().enumerate().map(texture).collect()
        }),
        pack: shape.pack.filter(|_| at == coarsest).map(|(pack, from)| PackRef {
            url: name(&format!("pack {pack}"), "pack"),
            bytes: packs[pack].bytes,
            from,
        }),
    };
    Model {
        levels: shape.levels.iter().enumerate().map(level).collect(),
        smooth: (!shape.rungs.is_empty()).then(|| stream_of(number, &shape.rungs)),
        impostor: None,
        procedural: shape.rules_bytes.map(|rules_bytes| Procedural {
            rules: name("rules", "dcg"),
            rules_bytes,
            imports: BTreeMap::new(),
            part: None,
            parameters: BTreeMap::new(),
            seed: 0,
        }),
    }
}

fn stream_of(number: usize, rungs: &[(u64, u64, f64)]) -> SmoothLod {
    let url = name(&format!("m{number} stream"), "slod");
    let rung = |(at, (to, triangles, error)): (usize, &(u64, u64, f64))| Rung {
        url: RungName {
            hash: url.hash(),
            number: at as u8,
        },
        from: at.checked_sub(1).map_or(0, |before| rungs[before].0),
        to: *to,
        triangles: *triangles,
        geometric_error_m: *error,
        rms_error_m: 0.0,
    };
    SmoothLod {
        bytes: rungs.last().unwrap().0,
        materials: name(&format!("m{number} materials"), "gltf"),
        materials_bytes: 300,
        textures: Vec::new(),
        rungs: rungs.iter().enumerate().map(rung).collect(),
        url,
    }
}

impl World {
    fn of(situations: &Situations) -> Self {
        let shapes = situations.models.iter().enumerate();
        let models: Vec<_> = shapes
            .map(|(number, shape)| Arc::new(model_of(number, shape, &situations.packs)))
            .collect();
        let seen = |object: u32| {
            let Object { model, min, max, scale } = situations.objects[object as usize];
            Seen {
                object: ObjectId(object),
                bounds: Bounds { min, max },
                transform: std::array::from_fn(|i| if i % 5 == 0 { 1.0 } else { 0.0 }),
                scale,
                solid_angle_sr: 0.1,
                model: ModelId(model),
                geometry: models[model as usize].clone(),
            }
        };
        let entry = |cell: &Cell| CellEntry {
            cell: CellId(cell.cell),
            bounds: Bounds {
                min: cell.min,
                max: cell.max,
            },
            planes: Vec::new(),
            adjacent: cell.openings.iter().map(|opening| CellId(opening.to)).collect(),
            record: name("record", "cell"),
            record_bytes: 1,
            steps: None,
            steps_bytes: None,
            record_json: name("record", "json"),
        };
        let portal = |opening: &Opening| Portal {
            to: CellId(opening.to),
            polygon: vec![opening.min, opening.max],
            door: None,
        };
        let cells = &situations.cells;
        Self {
            entries: cells.iter().map(entry).collect(),
            portals: cells
                .iter()
                .map(|cell| cell.openings.iter().map(portal).collect())
                .collect(),
            seen: cells
                .iter()
                .map(|cell| cell.sees.iter().copied().map(seen).collect())
                .collect(),
        }
    }

    fn model(&self, model: u32) -> &Model {
        let all = self.seen.iter().flatten();
        let found = all.into_iter().find(|seen| seen.model == ModelId(model));
        &found.unwrap().geometry
    }
}

/// Six digits after the point: roundings reach less far.
fn rounded(x: f64) -> f64 {
    (x * 1e6).round() / 1e6 + 0.0
}

/// Files come, and their model is drawn with them.
fn hold(planner: &mut Planner, model: ModelId, grade: Grade, geometry: &Model) {
    let parts: Vec<_> = grade.parts(geometry, &planner.residency).collect();
    for part in &parts {
        if planner.residency.state(part.key()) != State::Here {
            planner.residency.arrive(part.key(), part.bytes);
        }
    }
    let keys = parts.iter().map(belvedere_client::strategy::grade::Part::key);
    planner.residency.hold(model, grade, keys.collect(), true);
}

fn told(wish: &Wish) -> String {
    let cause = match wish.cause {
        Cause::Missing { .. } => "missing".to_owned(),
        Cause::Finer { .. } => "finer".to_owned(),
        Cause::Ahead { cell, due, .. } => format!("{cell} {}", if due { "due" } else { "later" }),
    };
    format!("{cause}: {} {}", wish.model, wish.grade)
}

fn decide(world: &World, walk: &Walk) -> Json {
    let here = CellId(walk.cell);
    let mut motion = Motion::default();
    for (t_ms, position) in &walk.poses {
        motion.observe(t_ms / 1000.0, *position);
    }
    let (_, position) = walk.poses.last().unwrap();
    let velocity_mps = motion.velocity_mps();
    let mut planner = Planner::new(Budgets {
        triangles: walk.most_triangles.unwrap_or(u64::MAX),
        ..Budgets::default()
    });
    for (model, grade) in &walk.held {
        let geometry = world.model(*model);
        let grade = Grade::all(geometry).find(|one| one.to_string() == *grade).unwrap();
        hold(&mut planner, ModelId(*model), grade, geometry);
    }
    for lost in &walk.lost {
        match lost.strip_suffix(" stream") {
            Some(model) => planner.lose_stream(world.model(model[1..].parse().unwrap())),
            None => planner.residency.lose((&name(lost, "glb")).into()),
        }
    }
    let ahead = approaches(here, world, *position, velocity_mps);
    let view = View {
        eye: Eye::at(*position),
        here: &world.seen[here.index()],
        is_all_known: true,
        ahead: ahead
            .iter()
            .map(|one| (*one, &world.seen[one.cell.index()][..]))
            .collect(),
    };
    let first = first_progress(view.here, &planner.residency);
    let sharp = sharp_progress(view.here, &planner.residency, &view.eye, 1.0);
    let mut fetched = Vec::new();
    planner.plan(&view, walk.bytes_per_s.unwrap_or(f64::INFINITY));
    while let Some(wish) = planner.wishes().first().copied() {
        fetched.push(told(&wish));
        let geometry = planner.model(wish.model).unwrap().clone();
        hold(&mut planner, wish.model, wish.grade, &geometry);
        planner.plan(&view, walk.bytes_per_s.unwrap_or(f64::INFINITY));
        assert!(fetched.len() < 1000, "{}: it never ends", walk.name);
    }
    json!({
        "velocity_mps": velocity_mps.map(rounded),
        "approaches": ahead.iter().map(|one| json!([one.cell.0, one.step, rounded(one.in_s)])).collect::<Vec<_>>(),
        "first_bytes": [first.loaded_bytes, first.total_bytes],
        "sharp_bytes": [sharp.loaded_bytes, sharp.total_bytes],
        "fetched": fetched,
    })
}

#[test]
fn the_same_is_decided_as_before() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../tests/golden/strategy");
    let situations: Situations = serde_json::from_slice(&fs::read(folder.join("situations.json")).unwrap()).unwrap();
    let world = World::of(&situations);
    let decided: HashMap<_, _> = situations
        .walks
        .iter()
        .map(|walk| (walk.name.clone(), decide(&world, walk)))
        .collect();
    assert_eq!(decided.len(), situations.walks.len(), "two walks have one name");
    let text = format!("{:#}\n", json!(decided));
    let path = folder.join("decisions.json");
    if std::env::var_os("BELVEDERE_BLESS").is_some() {
        fs::write(&path, &text).unwrap();
    }
    let same = fs::read_to_string(&path).unwrap() == text;
    assert!(same, "decisions.json differs; if that is meant, `make bless`");
}
