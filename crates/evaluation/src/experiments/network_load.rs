//! How much does demand-driven transmission save when objects have levels? (Schmalstieg 1997, §5.7: fig 20 and table 2.)
//!
//! Objects stand at random places of a plane. A visitor walks for 500 frames; what enters its area of interest is fetched, what
//! leaves is dropped. With levels, the radius is cut into as many equal zones as there are levels, and the level of the
//! object's zone is fetched unless it or a finer one is there. Without, all levels are fetched as the object enters.
//!
//! *In theory*: the nearest distance at which a straight way passes an object of the area is evenly spread, so level x of k
//! (1 the finest) is fetched for a share x/k of the objects. With sizes ∝ 1/x, each level costs on average 1/k, all of them 1, and
//! the load fraction is 1/(1 + 1/2 + … + 1/k).

mod walk;

use belvedere_bake::{
    lod::{self, LodSettings},
    smooth::{publish::precision, quantise::QuantisedMesh},
};
use belvedere_scene::smooth::Decoder;
use serde::{Deserialize, Serialize};

use self::walk::{Ladder, OBJECTS_IN_AREA, WALKS, sums, total, walk};
use crate::{
    host::Host,
    models::{Mesh, carried_bytes},
    page::{
        Comparison, Goal, Plot, Row, Section,
        chart::{Axis, Chart, Series},
        percent,
    },
    papers::schmalstieg::{FRAMES, FRAMES_SHOWN, LEVELS_SHOWN, LOAD, TABLE_2},
};

/// A level of our own has at least so many triangles.
const COARSEST: usize = 50;

/// Things of which our own objects are made.
const THINGS: [(&str, &str); 4] = [
    ("dinosaur", "import \"exhibits.dcg\" as x\nx.dinosaur()"),
    ("knot", "import \"exhibits.dcg\" as x\nx.knot(2, 3, 0)"),
    ("ammonite", "import \"exhibits.dcg\" as x\nx.ammonite(0)"),
    ("globe", "import \"exhibits.dcg\" as x\nx.globe()"),
];

/// What was measured.
#[derive(Debug, Serialize, Deserialize)]
pub struct Measured {
    /// For each number of levels of the paper.
    pub rows: Vec<Load>,
    /// Bytes of each frame that figure 20 shows: complete, by levels (the thesis's objects), by smooth LODs (ours, scaled to
    /// the same bytes of complete objects).
    pub frames: Vec<[f64; 3]>,
    /// Things that our objects are, with their triangles.
    pub things: Vec<(String, u64)>,
    /// Walks, each of 500 frames.
    pub walks: u64,
    /// Objects in an area of interest.
    pub objects_in_area: f64,
}

/// Shares of what complete objects, with all their levels, would take.
#[derive(Debug, Serialize, Deserialize)]
pub struct Load {
    /// Levels of an object.
    pub levels: usize,
    /// The thesis's objects: mean, least and most of the walks.
    pub thesis: [f64; 3],
    /// Our levels.
    pub ours: f64,
    /// How many of them there are, mean of the things.
    pub our_levels: f64,
    /// Smooth LODs, cut where they have as many triangles as our levels.
    pub smooth: f64,
    /// The same as a share of whole smooth LODs.
    pub smooth_of_whole: f64,
}

/// Our levels and smooth LODs of a mesh, with so many levels at most.
fn ladders(mesh: &Mesh, levels: usize) -> anyhow::Result<[Ladder; 2]> {
    let settings = LodSettings {
        max_levels: levels,
        usual_share: (COARSEST as f64 / mesh.model.triangle_count() as f64).powf(1.0 / (levels - 1) as f64),
        coarsest_shapes: COARSEST,
        worthwhile_share: 1.0,
        dominated: 0.0,
        ..LodSettings::default()
    };
    let chain = lod::chain(&lod::clean(&mesh.model, &settings), &settings);
    let bytes = chain
        .levels
        .iter()
        .map(|level| carried_bytes(mesh, level) as f64)
        .collect();
    let precision = precision(&mesh.model, &mesh.materials, 1.0);
    let stream = mesh.stream(&QuantisedMesh::new(&mesh.model, precision))?;
    let mut cuts = vec![stream.len() as f64];
    for level in &chain.levels[1..] {
        cuts.push(bytes_to(&stream, level.triangles)? as f64);
    }
    Ok([
        Ladder { bytes, nested: false },
        Ladder {
            bytes: cuts,
            nested: true,
        },
    ])
}

/// How many bytes of a smooth LOD give so many triangles, within a hundredth; all of them where it has fewer.
fn bytes_to(stream: &[u8], triangles: u64) -> anyhow::Result<usize> {
    let (mut low, mut high) = (0, stream.len());
    while high - low > 16.max(high / 100) {
        let middle = low.midpoint(high);
        let mut decoder = Decoder::new(u64::MAX);
        decoder.push(&stream[..middle])?;
        if decoder.counts().1 as u64 >= triangles {
            high = middle;
        } else {
            low = middle;
        }
    }
    Ok(high)
}

/// Measures.
///
/// # Errors
/// When something does not grow.
pub fn run(host: &Host) -> anyhow::Result<Measured> {
    let meshes = THINGS
        .iter()
        .map(|(name, rules)| Mesh::of_rules(name, rules))
        .collect::<anyhow::Result<Vec<_>>>()?;
    let mut rows = Vec::new();
    let mut frames = Vec::new();
    for (levels, _) in LOAD {
        host.say(&format!("{levels} levels, {WALKS} walks"));
        let thesis_kinds = [Ladder::of_thesis(levels)];
        let thesis = sums(&thesis_kinds);
        let shares = thesis.iter().map(|[with, without]| with / without);
        let (mut ours, mut smooth) = (Vec::new(), Vec::new());
        for mesh in &meshes {
            let [own, stream] = ladders(mesh, levels)?;
            ours.push(own);
            smooth.push(stream);
        }
        let own = sums(&ours);
        let streams = sums(&smooth);
        if levels == LEVELS_SHOWN {
            let scale = |frames: Vec<[f64; 2]>, by: f64| frames.into_iter().map(move |[a, b]| [a / by, b / by]);
            let complete = thesis_kinds[0].complete();
            let own_complete = ours.iter().map(Ladder::complete).sum::<f64>() / ours.len() as f64;
            let pairs = scale(walk(&thesis_kinds, 0), complete).zip(scale(walk(&smooth, 0), own_complete));
            frames = pairs
                .map(|([with, all], [smooth, _])| [all, with, smooth])
                .take(FRAMES_SHOWN + 1)
                .collect();
        }
        rows.push(Load {
            levels,
            thesis: [
                total(&thesis, 0) / total(&thesis, 1),
                shares.clone().fold(f64::INFINITY, f64::min),
                shares.fold(0.0, f64::max),
            ],
            ours: total(&own, 0) / total(&own, 1),
            our_levels: ours.iter().map(|ladder| ladder.bytes.len() as f64).sum::<f64>() / ours.len() as f64,
            smooth: total(&streams, 0) / total(&own, 1),
            smooth_of_whole: total(&streams, 0) / total(&streams, 1),
        });
    }
    let things = meshes
        .iter()
        .map(|mesh| (mesh.name.clone(), mesh.model.triangle_count() as u64));
    Ok(Measured {
        rows,
        frames,
        things: things.collect(),
        walks: WALKS,
        objects_in_area: OBJECTS_IN_AREA,
    })
}

/// Levels for which a goal is set.
const JUDGED: [usize; 2] = [6, 10];

/// What it says.
#[must_use]
pub fn section(measured: &Measured) -> Section {
    let harmonic = |levels: usize| (1..=levels).map(|x| 1.0 / x as f64).sum::<f64>();
    let paper = |levels: usize| {
        LOAD.iter()
            .find(|(k, _)| *k == levels)
            .map_or(f64::NAN, |(_, share)| share / 100.0)
    };
    let row = |load: &Load| Row {
        what: load.levels.to_string(),
        paper: percent(paper(load.levels)),
        ours: vec![
            format!(
                "{} ({}–{})",
                percent(load.thesis[0]),
                percent(load.thesis[1]),
                percent(load.thesis[2])
            ),
            percent(1.0 / harmonic(load.levels)),
            format!("{} ({:.1} levels)", percent(load.ours), load.our_levels),
            percent(load.smooth),
            percent(load.smooth_of_whole),
        ],
        why: vec![0, 1, 2, 3],
    };
    let mut goals = Vec::new();
    for load in measured.rows.iter().filter(|load| JUDGED.contains(&load.levels)) {
        let (levels, most) = (load.levels, paper(load.levels));
        goals.push(Goal::at_most(
            format!("load with the thesis's objects, {levels} levels, mean of the walks"),
            most,
            load.thesis[0],
            percent,
        ));
        goals.push(Goal::at_most(
            format!("load with our levels, {levels}"),
            most,
            load.ours,
            percent,
        ));
        goals.push(Goal::at_most(
            format!("load with smooth LODs, {levels} cuts"),
            most,
            load.smooth,
            percent,
        ));
    }
    let curve = |i: usize| {
        // The first area is there before the walk begins.
        let later = measured.frames.iter().enumerate().skip(1);
        later.map(|(frame, bytes)| [frame as f64, bytes[i]]).collect::<Vec<_>>()
    };
    let load_chart = Chart {
        title: "Network load with and without levels".to_owned(),
        x: Axis::linear("frame of the walk"),
        y: Axis::linear("load, complete objects"),
        right: None,
        series: vec![
            Series::new("without level management", 1, curve(0)).dashed(),
            Series::new("with six levels, the thesis's objects", 0, curve(1)),
            Series::new("smooth LODs of ours", 2, curve(2)),
        ],
    };
    let by_levels = |of: &dyn Fn(&Load) -> f64| {
        measured
            .rows
            .iter()
            .map(|load| [load.levels as f64, 100.0 * of(load)])
            .collect()
    };
    let share_chart = Chart {
        title: "Load fraction against the number of levels".to_owned(),
        x: Axis::linear("levels of an object"),
        y: Axis::linear("% of all bytes"),
        right: None,
        series: vec![
            Series::new("paper", 1, by_levels(&|load| paper(load.levels))).dashed(),
            Series::new("the thesis's objects", 0, by_levels(&|load| load.thesis[0])),
            Series::new("our levels", 3, by_levels(&|load| load.ours)),
            Series::new("smooth LODs", 2, by_levels(&|load| load.smooth)),
        ],
    };
    let things: Vec<_> = measured
        .things
        .iter()
        .map(|(name, triangles)| format!("{name} ({triangles} triangles)"))
        .collect();
    Section {
        how: vec![
            format!(
                "A visitor walks through a plane of scattered objects for {FRAMES} frames, {} walks; about {:.0} objects are in its area of interest. \
                 Shown is what is sent with levels, as a share of what complete objects with all their levels would take.",
                measured.walks, measured.objects_in_area
            ),
            format!("Our own objects are {}: their GLBs as they are sent, compressed, and their smooth LODs up to where these have as many triangles.", things.join(", ")),
        ],
        comparisons: vec![Comparison {
            source: TABLE_2,
            of: "levels",
            ours: ["the thesis's objects, mean (least–most)", "the same in theory", "our levels", "smooth LODs", "smooth LODs, of whole ones"]
                .map(str::to_owned)
                .into(),
            rows: measured.rows.iter().map(row).collect(),
        }],
        plots: vec![
            Plot {
                file: "fig20.svg".to_owned(),
                caption: format!("After fig 20: load of the first {FRAMES_SHOWN} frames"),
                svg: load_chart.to_svg(),
            },
            Plot {
                file: "table2.svg".to_owned(),
                caption: "Table 2 as curves".to_owned(),
                svg: share_chart.to_svg(),
            },
        ],
        reasons: vec![
            "The thesis's objects (sizes ∝ 1/x, equal zones) are repeated as described; places, way and radius are not in the paper, so ours are others. \
             A straight way gives 1/(1 + 1/2 + … + 1/k) in theory, which is the paper's row to within the spread of walks: it shows that the row follows from the set-up."
                .to_owned(),
            "The theory counts ways that pass each object wholly. A walk begins amid objects, half of which it leaves behind, and ends before it has come near those that entered last; these cost less than the theory says.".to_owned(),
            "Our levels shrink by equal ratios instead of by 1/x, down to a few dozen triangles, so that each holds another share of the bytes; compression and headers of files count, too. Where as many levels cannot be made, their mean number says so.".to_owned(),
            "A smooth LOD tells nothing twice: a finer cut costs only what is new. The last column has the smaller denominator of whole streams, so it is no saving over levels but over fetching streams whole."
                .to_owned(),
        ],
        goals,
        ..Section::default()
    }
}
