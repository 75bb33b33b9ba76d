//! What does the octree make of a model, and from where on is each level good enough? (Schmalstieg 1997, §6.6: tables 3 and 4.)
//!
//! The generator with the thesis's order and measures is asked for the same shares of the source's triangles as the thesis's
//! levels have. Ranges follow §6.3: `d = s / (e · 2 · tan(α/2))` plus the radius, with the level's error for s.

use std::time::Instant;

use belvedere_bake::lod::{self, LodSettings, Measures, Method, OctreeSettings, Order, generate::Generator};
use belvedere_scene::{
    Bounds,
    object::{SCREEN_ERROR_PX, SCREEN_HEIGHT_PX, VIEW_ANGLE_DEG},
};
use serde::{Deserialize, Serialize};

use crate::{
    host::Host,
    models::Mesh,
    page::{
        Comparison, Plot, Row, Section,
        chart::{Axis, Chart, Series},
        count, percent,
    },
    papers::schmalstieg::{ENTERPRISE, ENTERPRISE_S, GALLEON, GALLEON_S, Level, TABLE_3, TABLE_4},
};

/// A table, its levels, its seconds; what stands for its model, and the rules of that; the picture's file.
type Pair = (
    &'static str,
    &'static [Level],
    f64,
    &'static str,
    &'static str,
    &'static str,
);

/// The paper's models and those of ours that stand for them.
const PAIRS: [Pair; 2] = [
    (
        TABLE_3,
        &ENTERPRISE,
        ENTERPRISE_S,
        "dinosaur",
        "import \"exhibits.dcg\" as x\nx.dinosaur()",
        "table3.svg",
    ),
    (
        TABLE_4,
        &GALLEON,
        GALLEON_S,
        "knot",
        "import \"exhibits.dcg\" as x\nx.knot(2, 3, 0)",
        "table4.svg",
    ),
];

/// What was measured, in the order of [`PAIRS`].
#[derive(Debug, Serialize, Deserialize)]
pub struct Measured {
    /// Our models.
    pub models: Vec<Model>,
}

/// A model of ours.
#[derive(Debug, Serialize, Deserialize)]
pub struct Model {
    /// Its name.
    pub name: String,
    /// Radius of the sphere around its box, metres.
    pub radius_m: f64,
    /// Seconds that all levels took, their errors included.
    pub seconds: f64,
    /// Finest first; none where the generator found nothing.
    pub levels: Vec<Option<Made>>,
}

/// A level of ours.
#[derive(Debug, Serialize, Deserialize)]
pub struct Made {
    /// Triangles that were asked for, lines included.
    pub asked: u64,
    /// Triangles in it.
    pub triangles: u64,
    /// Lines in it.
    pub lines: u64,
    /// From the middle, metres.
    pub range_m: f64,
}

/// Measures.
///
/// # Errors
/// When something does not grow.
pub fn run(host: &Host) -> anyhow::Result<Measured> {
    let mut models = Vec::new();
    for (source, paper, _, name, rules, _) in PAIRS {
        host.say(&format!("{name}, for {source}"));
        let mesh = Mesh::of_rules(name, rules)?;
        models.push(measure(&mesh, paper));
    }
    Ok(Measured { models })
}

fn measure(mesh: &Mesh, paper: &[Level]) -> Model {
    let settings = LodSettings {
        method: Method::Octree,
        octree: OctreeSettings {
            order: Order::MostVertices,
            measures: Measures::THESIS,
        },
        max_levels: paper.len(),
        ..LodSettings::default()
    };
    let positions = mesh.model.primitives.iter().flat_map(|p| &p.positions);
    let bounds = Bounds::around(positions.map(|p| p.map(f64::from)));
    let radius_m = 0.5 * bounds.size_m().iter().map(|side| side * side).sum::<f64>().sqrt();
    let tangent = 2.0 * (VIEW_ANGLE_DEG.to_radians() / 2.0).tan();
    let error = SCREEN_ERROR_PX / SCREEN_HEIGHT_PX;
    let started = Instant::now();
    let clean = lod::clean(&mesh.model, &settings);
    let mut generator = Generator::new(&clean, &settings);
    let whole = clean.triangle_count() as u64;
    let mut levels = vec![Some(Made {
        asked: whole,
        triangles: whole,
        lines: 0,
        range_m: radius_m,
    })];
    let mut worst = 0.0f64;
    for (triangles, ..) in &paper[1..] {
        let asked = (whole as f64 * *triangles as f64 / paper[0].0 as f64).round() as u64;
        levels.push(generator.level(asked as usize).map(|level| {
            // A coarser level is never said to be nearer to the source, as in a chain.
            worst = worst.max(level.geometric_error);
            Made {
                asked,
                triangles: level.triangles,
                lines: level.lines,
                range_m: worst / (error * tangent) + radius_m,
            }
        }));
    }
    let seconds = started.elapsed().as_secs_f64();
    Model {
        name: mesh.name.clone(),
        radius_m,
        seconds,
        levels,
    }
}

/// What it says.
#[must_use]
pub fn section(measured: &Measured) -> Section {
    let mut section = Section {
        how: vec![format!(
            "The octree, with the thesis's order and measures, is asked for the thesis's shares of triangles. Ranges are multiples of the finest level's, which is the radius of the model: \
             with an error of {SCREEN_ERROR_PX} of {SCREEN_HEIGHT_PX} pixels at {VIEW_ANGLE_DEG}°, and with the error at which the coarsest level has the thesis's range."
        )],
        reasons: vec![
            "The thesis's models cannot be had: the triangles differ because the sources do. Shares come near the paper's because they are asked for; where a level has fewer \
             triangles than that, closing one more cell made several fall together."
                .to_owned(),
            "The thesis leaves its largest error on the screen open, and takes for s the diagonal of the last cells, whose edges double from level to level; ours is a measured bound of the \
             distance between both surfaces. The last column takes the error on the screen from the coarsest level, so what compares is how ranges grow to it."
                .to_owned(),
            "Lines are triangles that collapsed and border no triangle that is left. How many there are depends on how thin the parts of a model are; table 3 does not count them."
                .to_owned(),
            "Other machines, an SGI Indy R4400/150 beside one of today; ours also measures the error of each level in both directions, which the thesis does not.".to_owned(),
        ],
        ..Section::default()
    };
    for ((source, paper, paper_s, _, _, file), model) in PAIRS.iter().zip(&measured.models) {
        let multiple = |made: &Made| made.range_m / model.radius_m;
        let [theirs, ours] = [
            paper[paper.len() - 1].2 as f64 / paper[0].2 as f64,
            model.levels.last().and_then(Option::as_ref).map_or(f64::NAN, multiple),
        ];
        // The error on the screen with which the coarsest levels have the same range, in pixels.
        let pixels = (ours - 1.0) / (theirs - 1.0) * SCREEN_ERROR_PX;
        let scaled = |made: &Made| 1.0 + (multiple(made) - 1.0) * SCREEN_ERROR_PX / pixels;
        let whole = model.levels[0].as_ref().map_or(1, |level| level.triangles) as f64;
        let lines = |lines: Option<u64>| lines.map_or_else(|| "not told".to_owned(), |lines| lines.to_string());
        let mut rows = Vec::new();
        for (number, ((triangles, paper_lines, range), made)) in paper.iter().zip(&model.levels).enumerate() {
            rows.push(Row {
                what: number.to_string(),
                paper: format!(
                    "{} ({}), {}, × {:.2}",
                    count(*triangles),
                    percent(*triangles as f64 / paper[0].0 as f64),
                    lines(*paper_lines),
                    *range as f64 / paper[0].2 as f64
                ),
                ours: made.as_ref().map_or_else(
                    || {
                        vec![
                            "nothing is left".to_owned(),
                            String::new(),
                            String::new(),
                            String::new(),
                        ]
                    },
                    |made| {
                        vec![
                            format!("{} ({})", count(made.triangles), percent(made.triangles as f64 / whole)),
                            made.lines.to_string(),
                            format!("× {:.2}", multiple(made)),
                            format!("× {:.2}", scaled(made)),
                        ]
                    },
                ),
                why: vec![0, 1, 2],
            });
        }
        rows.push(Row {
            what: "all levels".to_owned(),
            paper: format!("{paper_s} s"),
            ours: vec![
                format!("{:.2} s", model.seconds),
                String::new(),
                String::new(),
                String::new(),
            ],
            why: vec![3],
        });
        section.comparisons.push(Comparison {
            source,
            of: "level",
            ours: vec![
                format!("{}: triangles", model.name),
                "lines".to_owned(),
                format!("range at {SCREEN_ERROR_PX} px"),
                format!("range at {pixels:.1} px"),
            ],
            rows,
        });
        let shares = |of: &dyn Fn(usize) -> Option<[f64; 2]>| (0..paper.len()).filter_map(of).collect::<Vec<_>>();
        let chart = Chart {
            title: format!("Ranges of the levels of {}", model.name),
            x: Axis::log("triangles, % of the source"),
            y: Axis::log("range, of the finest level's"),
            right: None,
            series: vec![
                Series::new(
                    "paper",
                    1,
                    shares(&|i| {
                        Some([
                            100.0 * paper[i].0 as f64 / paper[0].0 as f64,
                            paper[i].2 as f64 / paper[0].2 as f64,
                        ])
                    }),
                )
                .dashed(),
                Series::new(
                    format!("ours, {}", model.name),
                    0,
                    shares(&|i| {
                        let made = model.levels[i].as_ref()?;
                        Some([100.0 * made.triangles as f64 / whole, scaled(made)])
                    }),
                ),
            ],
        };
        section.plots.push(Plot {
            file: (*file).to_owned(),
            caption: format!(
                "Ranges against triangles, {}",
                source.rsplit(", ").next().unwrap_or(source)
            ),
            svg: chart.to_svg(),
        });
    }
    section
}
