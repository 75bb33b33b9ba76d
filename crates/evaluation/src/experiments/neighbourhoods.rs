//! How much does a street cell not see, and what does each acceleration save? (Cohen-Or & Zadicario 1998: tables 1 and 2.)
//!
//! Their algorithm on their scene: 2,128 buildings scattered in a plane, street cells of a quarter of a building. Times are CPU time of
//! one thread.

use belvedere_bake::{
    city::City,
    occluders::Region,
    visibility::{
        conservative::Scenery,
        epsilon::{Accelerations, Neighbourhoods},
    },
    world::World,
};
use serde::{Deserialize, Serialize};

use crate::{
    host::Host,
    page::{Comparison, Goal, Row, Section, Table, count, percent},
    papers::cohen_or::{ACCELERATIONS, CITIES, TABLE_1, TABLE_2},
    timing::timed,
};

/// Cells of table 1, and those of table 2.
const CELLS: usize = 48;
const TIMED_CELLS: usize = 8;

/// What was measured.
#[derive(Debug, Serialize, Deserialize)]
pub struct Measured {
    /// Cells of the first table, and of the second.
    pub cells: [usize; 2],
    /// In the order of the paper's.
    pub cities: Vec<Culled>,
    /// The paper's columns, in their order.
    pub columns: Vec<Column>,
    /// What the paper proposes and does not measure.
    pub more: Vec<Column>,
}

/// Means over the cells.
#[derive(Debug, Serialize, Deserialize)]
pub struct Culled {
    /// Triangles.
    pub triangles: u64,
    /// Hidden triangles.
    pub hidden_triangles: f64,
    /// Buildings.
    pub boxes: u64,
    /// Hidden buildings.
    pub hidden_boxes: f64,
    /// Hidden by the first occluder that was tried.
    pub first: f64,
}

/// Means for a cell.
#[derive(Debug, Serialize, Deserialize)]
pub struct Column {
    /// Its name.
    pub name: String,
    /// CPU milliseconds.
    pub ms: f64,
    /// Rays that traverse the scene.
    pub traversals: f64,
    /// Intersections of rays and bodies for boxes.
    pub box_tests: f64,
    /// The same for triangles.
    pub triangle_tests: f64,
    /// Triangles that are left.
    pub visible: f64,
}

/// Measures.
///
/// # Errors
/// When a city is too large to be flattened, which it is not.
pub fn run(host: &Host) -> anyhow::Result<Measured> {
    let mut cities = Vec::new();
    for (paper, city) in CITIES.iter().zip([City::DENSE, City::SPARSE]) {
        host.say(paper.name);
        let world = World::new(&city.scene())?;
        let scenery = Scenery::of(&world);
        let scene = Neighbourhoods::new(&world, &scenery.blocker.occluders.bodies);
        let (mut visible, mut boxes, mut first) = (0, 0, 0);
        for cell in regions(&world, &city) {
            let superset = scene.superset(&cell, Accelerations::ALL);
            visible += superset.triangles.len();
            boxes += u64::from(superset.hidden_boxes);
            first += u64::from(superset.first_occluders);
        }
        let triangles = world.triangle_count();
        cities.push(Culled {
            triangles: triangles as u64,
            hidden_triangles: triangles as f64 - visible as f64 / CELLS as f64,
            boxes: world.object_bounds().len() as u64,
            hidden_boxes: boxes as f64 / CELLS as f64,
            first: first as f64 / CELLS as f64,
        });
    }
    let city = City::DENSE;
    let world = World::new(&city.scene())?;
    let scenery = Scenery::of(&world);
    let scene = Neighbourhoods::new(&world, &scenery.blocker.occluders.bodies);
    let cells = &regions(&world, &city)[..TIMED_CELLS];
    let column = |name: &str, accelerations| {
        host.say(name);
        measure(&scene, cells, name, accelerations)
    };
    let (none, all) = (Accelerations::NONE, Accelerations::ALL);
    let boxes = Accelerations {
        boxes_first: true,
        ..none
    };
    let columns = [
        none,
        boxes,
        Accelerations {
            redundant_occluders: true,
            ..boxes
        },
        Accelerations {
            hull_rays_only: true,
            ..boxes
        },
        all,
    ];
    let more = [
        (
            "bounding box, only the first ray traverses",
            Accelerations {
                first_ray_traverses: true,
                ..boxes
            },
        ),
        (
            "fully optimised, cells halved twice",
            Accelerations { subcells: 2, ..all },
        ),
        (
            "fully optimised, occluders of 0.01 sr and more",
            Accelerations {
                least_occluder_sr: 0.01,
                ..all
            },
        ),
        (
            "fully optimised, first hit only (super-conservative)",
            Accelerations { first_hit: true, ..all },
        ),
    ];
    Ok(Measured {
        cells: [CELLS, TIMED_CELLS],
        cities,
        columns: ACCELERATIONS
            .iter()
            .zip(columns)
            .map(|(paper, a)| column(paper.0, a))
            .collect(),
        more: more.map(|(name, a)| column(name, a)).into(),
    })
}

fn regions(world: &World, city: &City) -> Vec<Region> {
    let relative = |p: glam::DVec3| world.relative(p.to_array());
    let cells = city.street_cells(CELLS).into_iter();
    cells
        .map(|[min, max]| Region::of_box(relative(min), relative(max)))
        .collect()
}

fn measure(scene: &Neighbourhoods, cells: &[Region], name: &str, accelerations: Accelerations) -> Column {
    let (ms, sums) = timed(|| {
        let mut sums = [0; 4];
        for cell in cells {
            let superset = scene.superset(cell, accelerations);
            let tally = superset.tally;
            let found = [
                tally.traversals,
                tally.box_tests,
                tally.triangle_tests,
                superset.triangles.len() as u64,
            ];
            sums = [0, 1, 2, 3].map(|i| sums[i] + found[i]);
        }
        sums
    });
    let [traversals, box_tests, triangle_tests, visible] = sums.map(|sum| sum as f64 / cells.len() as f64);
    Column {
        name: name.to_owned(),
        ms: ms / cells.len() as f64,
        traversals,
        box_tests,
        triangle_tests,
        visible,
    }
}

/// What it says.
#[must_use]
pub fn section(measured: &Measured) -> Section {
    let mut section = Section {
        how: vec![format!(
            "Their algorithm on their kind of city; means over {} street cells for table 1 and {} for table 2.",
            measured.cells[0], measured.cells[1]
        )],
        reasons: vec![
            "Their cities are described, not published: “buildings distributed evenly and randomly”, a quarter of three boxes. How wide streets are and how tall houses decides what they hide; \
             ours are one choice of each."
                .to_owned(),
            "Triangles: ours have ten for each box, which the paper's 21,280 polygons of 2,128 buildings do not allow where a quarter has three boxes; their stacked buildings must be simpler."
                .to_owned(),
            "Which occluder is tried first is not told; ours is the first body that the first ray comes upon. As in the paper, it is the right one most of the time.".to_owned(),
            "An SGI R4400 of 1998 beside a core of today: only shares of “no optimisation” compare.".to_owned(),
            format!(
                "The paper's intersections without optimisation are {:.1} for each polygon, about as many as there are rays from eight corners to three vertices: a ray seems to count once. Ours count each body that \
                 a ray is tested with; the rays themselves stand in the last table. Our rays find bodies in a grid, which the paper proposes. So our start is heavier than theirs, and what is saved looks larger.",
                ACCELERATIONS[0].3 as f64 / CITIES[0].polygons as f64
            ),
        ],
        ..Section::default()
    };
    for (paper, ours) in CITIES.iter().zip(&measured.cities) {
        let share = |part: f64, whole: u64| percent(part / whole as f64);
        let row = |what: &str, paper: String, ours: String, why: Vec<usize>| Row {
            what: what.to_owned(),
            paper,
            ours: vec![ours],
            why,
        };
        let hidden = ours.hidden_triangles / ours.triangles as f64;
        let papers = paper.hidden_polygons as f64 / paper.polygons as f64;
        section.goals.push(Goal::at_least(
            format!("{}: hidden triangles", paper.name),
            papers,
            hidden,
            percent,
        ));
        let boxes = ours.hidden_boxes / ours.boxes as f64;
        let papers_boxes = paper.hidden_boxes as f64 / paper.boxes as f64;
        section.goals.push(Goal::at_least(
            format!("{}: hidden buildings", paper.name),
            papers_boxes,
            boxes,
            percent,
        ));
        let rows = vec![
            row("polygons", count(paper.polygons), count(ours.triangles), vec![1]),
            row(
                "hidden polygons",
                format!("{} ({})", count(paper.hidden_polygons), percent(papers)),
                format!("{} ({})", count(ours.hidden_triangles.round() as u64), percent(hidden)),
                vec![0, 1],
            ),
            row("buildings", count(paper.boxes), count(ours.boxes), vec![0]),
            row(
                "hidden buildings",
                format!("{} ({})", count(paper.hidden_boxes), percent(papers_boxes)),
                format!("{:.0} ({})", ours.hidden_boxes, percent(boxes)),
                vec![0],
            ),
            row(
                "hidden by the first occluder, of these",
                format!(
                    "{} ({})",
                    count(paper.first),
                    share(paper.first as f64, paper.hidden_boxes)
                ),
                format!("{:.0} ({})", ours.first, percent(ours.first / ours.hidden_boxes)),
                vec![0, 2],
            ),
        ];
        section.comparisons.push(Comparison {
            source: TABLE_1,
            of: paper.name,
            ours: vec!["ours".to_owned()],
            rows,
        });
    }
    let base = measured.columns.first().map_or(f64::NAN, |column| column.ms);
    let base_tests = measured
        .columns
        .first()
        .map_or(f64::NAN, |c| c.box_tests + c.triangle_tests);
    let rows = ACCELERATIONS.iter().zip(&measured.columns).map(|(paper, ours)| {
        let [time, tests] = [
            paper.1 as f64 / ACCELERATIONS[0].1 as f64,
            (paper.2 + paper.3) as f64 / ACCELERATIONS[0].3 as f64,
        ];
        Row {
            what: paper.0.to_owned(),
            paper: format!(
                "{} ms ({}); {} tests ({})",
                count(paper.1),
                percent(time),
                count(paper.2 + paper.3),
                percent(tests)
            ),
            ours: vec![
                format!("{:.2} ms ({})", ours.ms, percent(ours.ms / base)),
                format!(
                    "{} ({})",
                    count((ours.box_tests + ours.triangle_tests).round() as u64),
                    percent((ours.box_tests + ours.triangle_tests) / base_tests)
                ),
            ],
            why: vec![3, 4],
        }
    });
    section.comparisons.push(Comparison {
        source: TABLE_2,
        of: "accelerations",
        ours: vec!["ours, a cell".to_owned(), "tests of rays with bodies".to_owned()],
        rows: rows.collect(),
    });
    if let (Some(all), Some(paper)) = (measured.columns.last(), ACCELERATIONS.last()) {
        let wanted = paper.1 as f64 / ACCELERATIONS[0].1 as f64;
        section.goals.push(Goal::at_most(
            "time with all optimisations, of that with none",
            wanted,
            all.ms / base,
            percent,
        ));
    }
    let cells = |c: &Column| {
        let mut cells = vec![c.name.clone(), format!("{:.2}", c.ms)];
        cells.extend([c.traversals, c.box_tests, c.triangle_tests, c.visible].map(|n| count(n.round() as u64)));
        cells
    };
    section.tables.push(Table {
        caption: "Everything that was counted, means for a cell; the last rows are what the paper proposes without measuring it".to_owned(),
        head: ["accelerations", "ms", "rays that traverse", "tests for boxes", "tests for triangles", "triangles left"]
            .map(str::to_owned)
            .into(),
        rows: measured.columns.iter().chain(&measured.more).map(cells).collect(),
    });
    section
}
