//! What does a visitor of a town see on a line of 56 kb/s at 15 km/h? (Marvie & Bouatouch 2004, fig 9.)
//!
//! The built-in town, if its bake ends in time, or its first revision with larger visible sets; else a generated city of
//! boxes of the same extent. The page says which it was.

use std::time::{Duration, Instant};

use belvedere_bake::{city::City, glb::write_whole};
use serde::{Deserialize, Serialize};

use super::{
    indoors::{quality_chart, seconds, shown},
    walks::{LATENCY_MS, Walked, Way, World, walk_through},
};
use crate::{
    host::{Baked, Host},
    models::{content, grow_file},
    page::{
        Comparison, Goal, Plot, Row, Section,
        chart::{Axis, Chart, Series},
        count, fine_percent, percent,
    },
    papers::marvie::{FIGURE_9, TOWN, TOWN_BYTES, TOWN_SIZE},
};

const WAY: Way = Way {
    line: TOWN,
    walks: 3,
    seconds: 240.0,
};
/// A city of the paper's extent: 26 × 27 m are 702 m.
const CITY: City = City {
    blocks: [26, 26],
    spacing_m: 27.0,
    ..City::DENSE
};
const BUDGET: Duration = Duration::from_secs(30 * 60);

/// What was measured.
#[derive(Debug, Serialize, Deserialize)]
pub struct Measured {
    /// The town.
    pub world: World,
    /// Bytes of the town's rules, and of what grows out of them, when it is the built-in one.
    pub rules: Option<[u64; 2]>,
    /// Seconds that growing all of it takes.
    pub growth_s: Option<f64>,
}

/// Measures.
///
/// # Errors
/// When no town can be baked or walked through.
pub fn run(host: &Host) -> anyhow::Result<Measured> {
    let town = |data: &std::path::Path, revision: &str| {
        let started = Instant::now();
        let growth = grow_file("town.dcg")?;
        let growth_s = Some(started.elapsed().as_secs_f64());
        let rule_bytes: usize = growth.program.files().map(|(_, text)| text.len()).sum();
        anyhow::Ok(Measured {
            world: walk_through(host, data, "town", "the built-in town", revision.to_owned(), WAY)?,
            rules: Some([rule_bytes as u64, growth.grown.explicit_bytes()]),
            growth_s,
        })
    };
    if let Some(data) = &host.town_data {
        // A preview has none of what takes longest.
        let is_preview = host.inspect(data, "town")?["report"]["bytes"]["smooth"] == 0;
        return town(
            data,
            if is_preview {
                "the first revision of `bake --preview`, with larger visible sets and without smooth LODs, as it was found in the data folder that was given"
            } else {
                "the whole bake, as it was found in the data folder that was given"
            },
        );
    }
    if !host.town_budget.is_zero() {
        let file = content().join("town.dcg");
        if let Baked::Done = host.bake(&file, "town", &["--preview"], host.town_budget)? {
            return town(&host.data(), "the whole bake");
        }
        let words = format!(
            "the first revision of `bake --preview`, with larger visible sets: the whole bake was not done after {} minutes",
            host.town_budget.as_secs() / 60
        );
        match town(&host.data(), &words) {
            Ok(measured) => return Ok(measured),
            Err(cause) => host.say(&format!("no town: {cause:#}; a generated city instead")),
        }
    }
    let file = host.work.join("city.glb");
    std::fs::write(&file, write_whole(&CITY.scene()))?;
    let baked = host.bake(&file, "city", &[], BUDGET)?;
    anyhow::ensure!(matches!(baked, Baked::Done), "the bake of the city took too long");
    Ok(Measured {
        world: walk_through(
            host,
            &host.data(),
            "city",
            "a generated city of boxes",
            "the whole bake".to_owned(),
            WAY,
        )?,
        rules: None,
        growth_s: None,
    })
}

/// Bytes of each second as kB, and quality, as in the paper's figure.
fn figure(title: &str, walked: &Walked) -> Chart {
    let each = walked
        .seconds
        .windows(2)
        .map(|pair| [pair[1][0], (pair[1][2] - pair[0][2]) / 1e3]);
    Chart {
        title: title.to_owned(),
        x: Axis::linear("seconds of the first walk"),
        y: Axis::linear("download quality, %").up_to(100.0),
        right: Some(Axis::linear("kB in a second")),
        series: vec![
            Series::new("downloading", 1, each.collect()).right(),
            Series::new(
                "download quality",
                0,
                walked.seconds.iter().map(|[t, q, _]| [*t, 100.0 * q]).collect(),
            ),
        ],
    }
}

/// What it says.
#[must_use]
pub fn section(measured: &Measured) -> Section {
    let world = &measured.world;
    let row = |what: &str, paper: String, ours: String, why: &[usize]| Row {
        what: what.to_owned(),
        paper,
        ours: vec![ours],
        why: why.to_vec(),
    };
    let not_told = || "not told".to_owned();
    let megabytes = |bytes: f64| format!("{:.1} MB", bytes / 1e6);
    let mut rows = vec![
        row(
            "polygons",
            count(TOWN_SIZE.1),
            format!(
                "{} in {} objects, {} cells",
                count(world.triangles),
                count(world.objects),
                count(world.cells)
            ),
            &[0],
        ),
        row(
            "rules and what grows out of them",
            format!("{:.1} kB (compressed), {}", TOWN_BYTES.0 / 1e3, megabytes(TOWN_BYTES.1)),
            measured.rules.map_or_else(
                || "no rules".to_owned(),
                |[rules, grown]| format!("{:.1} kB (as text), {}", rules as f64 / 1e3, megabytes(grown as f64)),
            ),
            &[1],
        ),
        row(
            "start: all in sight for the first time",
            not_told(),
            seconds(world.with.convergence_s),
            &[1, 2],
        ),
    ];
    for (words, paper, walked) in [
        ("no prefetching", "below 100 % again and again", &world.without),
        ("prefetching", "“100 % most of the time”", &world.with),
        ("prefetching, no rules", "no such thing", &world.without_rules),
    ] {
        rows.push(row(
            &format!("{words}: frames with all there"),
            paper.to_owned(),
            format!(
                "{}; mean quality {}, minimum {}",
                shown(walked.perfect),
                shown(walked.mean),
                shown(walked.min)
            ),
            &[1, 2, 3],
        ));
    }
    rows.push(row(
        "rewriting quality",
        "as download quality".to_owned(),
        measured.growth_s.map_or_else(
            || "not measured".to_owned(),
            |s| format!("not measured; all of the town grows in {s:.1} s"),
        ),
        &[1],
    ));
    Section {
        how: vec![
            format!(
                "World: {}, {}. Walks from cell to cell, {} of {:.0} s each, at {} km/h on a line of {:.0} kb/s and {LATENCY_MS} ms.",
                world.name,
                world.revision,
                world.walks.0,
                world.walks.1,
                world.line.1,
                world.line.0 / 1e3
            ),
        ],
        comparisons: vec![Comparison {
            source: FIGURE_9,
            of: "",
            ours: vec!["ours".to_owned()],
            rows,
        }],
        plots: vec![
            Plot {
                file: "fig9-without.svg".to_owned(),
                caption: "After fig 9, left: without prefetching".to_owned(),
                svg: figure("Without prefetching", &world.without).to_svg(),
            },
            Plot {
                file: "fig9-with.svg".to_owned(),
                caption: "After fig 9, right: with prefetching".to_owned(),
                svg: figure("With prefetching", &world.with).to_svg(),
            },
            Plot {
                file: "fig9-both.svg".to_owned(),
                caption: "Both, with bytes so far".to_owned(),
                svg: quality_chart("Both, with bytes so far".to_owned(), world).to_svg(),
            },
        ],
        reasons: vec![
            "Another town: theirs is generated from footprints and nine textures, and its cells are streets and crossings only; cells of ours are cut from all free space, also in courts and houses.".to_owned(),
            "In the paper houses arrive as rules of 300 B each and are grown by the browser, which it calls rewriting. So they do here, where that costs fewer bytes than levels, and where each stands comes as populations, \
             for all cells that see them. How long growing takes is not counted; the row with no rules is the same walks of a client that knows no rules."
                .to_owned(),
            "What an object is differs: theirs is a building, a road or a pavement, ours every part that is placed, so that more of them are in sight.".to_owned(),
            "Walks differ: ours turn at random at every opening. The figure's curves have no numbers that could be read.".to_owned(),
        ],
        goals: vec![
            Goal::at_least("prefetching: frames with all there", 1.0, world.with.perfect.unwrap_or(f64::NAN), fine_percent),
            Goal::at_most("prefetched and never seen", 0.3, world.with.waste(), percent),
        ],
        ..Section::default()
    }
}
