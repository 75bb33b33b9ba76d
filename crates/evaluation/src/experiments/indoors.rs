//! What does a visitor of a building see on a line of 128 kb/s at 3 km/h? (Marvie & Bouatouch 2004, table 1.)

use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::walks::{LATENCY_MS, Tight, Walked, Way, World, walk_through};
use crate::{
    host::{Baked, Host},
    models::content,
    page::{
        Comparison, Goal, Plot, Row, Section, Table,
        chart::{Axis, Chart, Series},
        count, fine_percent, percent,
    },
    papers::marvie::{INDOORS, MODELS, TABLE_1},
};

/// Our worlds: which of the paper's models each stands beside, its scene, its file.
const WORLDS: [(usize, &str, &str); 4] = [
    (0, "gallery", "gallery.dcg"),
    (1, "temple", "temple.dcg"),
    (2, "university", "university.dcg"),
    (2, "museum", "museum.dcg"),
];

const WAY: Way = Way {
    line: INDOORS,
    walks: 5,
    seconds: 300.0,
};
/// No bake takes longer.
const BUDGET: Duration = Duration::from_secs(30 * 60);

/// What was measured: worlds with the place of the paper's model beside them.
#[derive(Debug, Serialize, Deserialize)]
pub struct Measured {
    /// In the order of the paper's.
    pub worlds: Vec<(usize, World)>,
}

/// Measures.
///
/// # Errors
/// When a world cannot be baked or walked through.
pub fn run(host: &Host) -> anyhow::Result<Measured> {
    let mut measured = Vec::new();
    for (paper, scene, file) in WORLDS {
        let baked = host.bake(&content().join(file), scene, &[], BUDGET)?;
        anyhow::ensure!(matches!(baked, Baked::Done), "the bake of {scene} took too long");
        measured.push((
            paper,
            walk_through(host, &host.data(), scene, scene, "the whole bake".to_owned(), WAY)?,
        ));
    }
    Ok(Measured { worlds: measured })
}

/// A share that may not be there.
pub fn shown(share: Option<f64>) -> String {
    share.map_or_else(|| "no frame".to_owned(), fine_percent)
}

/// Seconds that may never have come.
pub fn seconds(s: Option<f64>) -> String {
    s.map_or_else(|| "never".to_owned(), |s| format!("{s:.1} s"))
}

/// Quality over time, with prefetching and without, as lines.
pub fn quality_chart(title: String, world: &World) -> Chart {
    let line = |walked: &Walked| {
        walked
            .seconds
            .iter()
            .map(|[t, quality, _]| [*t, 100.0 * quality])
            .collect()
    };
    let bytes = |walked: &Walked| walked.seconds.iter().map(|[t, _, bytes]| [*t, bytes / 1e3]).collect();
    Chart {
        title,
        x: Axis::linear("seconds of the first walk"),
        y: Axis::linear("download quality, %").up_to(100.0),
        right: Some(Axis::linear("kB so far")),
        series: vec![
            Series::new("quality, no prefetching", 1, line(&world.without)),
            Series::new("quality, prefetching", 0, line(&world.with)),
            Series::new("kB, no prefetching", 1, bytes(&world.without))
                .dashed()
                .right(),
            Series::new("kB, prefetching", 0, bytes(&world.with)).dashed().right(),
        ],
    }
}

/// What it says.
#[must_use]
pub fn section(measured: &Measured) -> Section {
    let mut section = Section {
        how: vec![format!(
            "Walks from cell to cell, {} of {:.0} s each, at {} km/h on a line of {:.0} kb/s and {LATENCY_MS} ms (the paper names no latency). Download quality is the share of the objects in the \
             cell's set of which a level is there, over the frames after all in sight had been there for the first time.",
            WAY.walks,
            WAY.seconds,
            INDOORS.1,
            INDOORS.0 / 1e3
        )],
        reasons: vec![
            "The paper's buildings cannot be had; ours have about as many triangles, but other rooms, and furniture of which there are copies. Copies are sent once, as the paper plans in §7.1.2."
                .to_owned(),
            "The paper's file is VRML as text, ours is level 0 of everything as published, compressed. Starts are compared as shares of it."
                .to_owned(),
            "The first thing that comes of an object is its coarsest level; finer ones follow after what lies ahead. A first room holds one of many kinds of things, and our file holds each kind once, \
             so a first cell is a larger share of it than of a file that repeats them."
                .to_owned(),
            "Walks differ: the paper's ways are not told, and ours turn at random at every opening, which is harder to predict than a tour. The worst frame is that of all walks.".to_owned(),
            "Our worlds have grown from rules, and a client that knows their language fetches these instead of levels where they cost fewer bytes, and grows level 0 itself, as the paper's browser does with \
             its houses in §7.2; the paper's buildings came as geometry. How long growing takes is not counted. Rows with no rules are the same walks of a client that knows no rules."
                .to_owned(),
        ],
        ..Section::default()
    };
    let (mut rows, mut sizes, mut memories) = (Vec::new(), Vec::new(), Vec::new());
    for (place, world) in &measured.worlds {
        let paper = &MODELS[*place];
        let name = format!("{} / {}", paper.name, world.name);
        let start = |s: f64, whole: f64| format!("{s:.1} s, {} of the file's", percent(s / whole));
        let ours = world.with.convergence_s;
        rows.push(Row {
            what: format!("{name}: whole file"),
            paper: format!("{} s", paper.original_s),
            ours: vec![format!("{:.1} s", world.whole_s())],
            why: vec![0, 1],
        });
        rows.push(Row {
            what: "… all in sight for the first time".to_owned(),
            paper: start(paper.convergence_s, paper.original_s),
            ours: vec![ours.map_or_else(|| seconds(None), |s| start(s, world.whole_s()))],
            why: vec![1, 2, 4],
        });
        let without_rules = &world.without_rules;
        rows.push(Row {
            what: "… all in sight for the first time, no rules".to_owned(),
            paper: "no such thing".to_owned(),
            ours: vec![
                without_rules
                    .convergence_s
                    .map_or_else(|| seconds(None), |s| start(s, world.whole_s())),
            ],
            why: vec![1, 2, 4],
        });
        rows.push(Row {
            what: "… prefetching, no rules: minimum, mean".to_owned(),
            paper: "no such thing".to_owned(),
            ours: vec![format!("{}, {}", shown(without_rules.min), shown(without_rules.mean))],
            why: vec![0, 2, 3, 4],
        });
        for (words, papers, walked) in [
            ("no prefetching", paper.without, &world.without),
            ("prefetching", paper.with, &world.with),
        ] {
            rows.push(Row {
                what: format!("… {words}: minimum, mean"),
                paper: format!("{} %, {} %", papers[0], papers[1]),
                ours: vec![format!("{}, {}", shown(walked.min), shown(walked.mean))],
                why: vec![0, 2, 3, 4],
            });
            for (which, least, found) in [("minimum", papers[0], walked.min), ("mean", papers[1], walked.mean)] {
                section.goals.push(Goal::at_least(
                    format!("{name}, {words}: {which} quality"),
                    least / 100.0,
                    found.unwrap_or(f64::NAN),
                    fine_percent,
                ));
            }
        }
        section.goals.push(Goal::at_most(
            format!("{name}: start"),
            paper.convergence_s,
            ours.unwrap_or(f64::NAN),
            |s| seconds(Some(s)),
        ));
        section.goals.push(Goal::at_most(
            format!("{name}: start, of the whole file's time"),
            paper.convergence_s / paper.original_s,
            ours.map_or(f64::NAN, |s| s / world.whole_s()),
            percent,
        ));
        section.goals.push(Goal::at_least(
            format!("{name}, prefetching: minimum of the issue"),
            0.96,
            world.with.min.unwrap_or(f64::NAN),
            fine_percent,
        ));
        section.goals.push(Goal::at_least(
            format!("{name}, prefetching: mean of the issue"),
            0.999,
            world.with.mean.unwrap_or(f64::NAN),
            fine_percent,
        ));
        section.goals.push(Goal::at_most(
            format!("{name}: prefetched and never seen"),
            0.3,
            world.with.waste(),
            percent,
        ));
        if let Some(tight) = &world.tight {
            memories.push(memory_row(&name, tight));
            section.goals.extend(memory_goals(&name, tight));
        }
        sizes.push(vec![
            name,
            format!("{} / {}", count(paper.polygons), count(world.triangles)),
            count(world.objects),
            count(world.cells),
            format!("{:.1} MB", world.whole_bytes as f64 / 1e6),
            shown(world.with.perfect),
            percent(world.with.waste()),
            percent(world.without_rules.waste()),
            count(world.with.failures + world.without.failures + world.without_rules.failures),
        ]);
        section.plots.push(Plot {
            file: format!("table1-{}.svg", world.name),
            caption: format!("Download quality and bytes over time, {}", world.name),
            svg: quality_chart(format!("Download quality, {}", world.name), world).to_svg(),
        });
    }
    section.comparisons.push(Comparison {
        source: TABLE_1,
        of: "model (theirs / ours)",
        ours: vec!["ours".to_owned()],
        rows,
    });
    section.tables.push(Table {
        caption: "The worlds, and what else the walks showed".to_owned(),
        head: [
            "model",
            "triangles (theirs / ours)",
            "objects",
            "cells",
            "whole file",
            "frames with all there, prefetching",
            "prefetched and never seen",
            "… no rules",
            "failures",
        ]
        .map(str::to_owned)
        .into(),
        rows: sizes,
    });
    section.tables.push(Table {
        caption: "The walks with no rules once more, within the least memory that holds the coarsest of all that a cell and its neighbours see".to_owned(),
        head: [
            "model",
            "memory",
            "worst frame",
            "objects that found no room, over all frames",
            "went",
            "came again",
            "… near all the time",
            "sharp; without a limit",
        ]
        .map(str::to_owned)
        .into(),
        rows: memories,
    });
    section
}

fn memory_row(name: &str, tight: &Tight) -> Vec<String> {
    let [ample, sharp] = tight.sharp.map(shown);
    let mut row = vec![
        name.to_owned(),
        kilobytes(tight.limit_bytes),
        shown(tight.min),
        count(tight.missing),
    ];
    row.extend(tight.bytes.map(kilobytes));
    row.push(format!("{sharp}; {ample}"));
    row
}

fn memory_goals(name: &str, tight: &Tight) -> [Goal; 2] {
    let [_, _, near] = tight.bytes;
    let what = |what: &str| format!("{name}, within the least memory: {what}");
    [
        Goal::at_most(what("objects that found no room"), 0.0, tight.missing as f64, |found| {
            count(found as u64)
        }),
        Goal::at_most(what("came again though near all the time"), 0.0, near as f64, |found| {
            kilobytes(found as u64)
        }),
    ]
}

fn kilobytes(bytes: u64) -> String {
    format!("{:.1} kB", bytes as f64 / 1e3)
}
