//! How large are smooth LODs beside their models? (Schmalstieg 1997, §7.7: table 7.)
//!
//! Sizes as the thesis counts them: 12 bytes a vertex and 6 a triangle; conventional levels reuse the vertices, so each costs 6 bytes
//! a triangle. Positions and triangles only.

use belvedere_bake::{
    lod::{self, LodSettings},
    smooth::{
        quantise::{Precision, QuantisedMesh},
        thesis,
    },
};
use belvedere_scene::smooth::thesis as packets;
use serde::{Deserialize, Serialize};

use crate::{
    host::Host,
    models::Mesh,
    page::{Comparison, Goal, Row, Section, Table, count, percent},
    papers::schmalstieg::{LEVELS_OF_TABLE_7, MODELS, TABLE_7},
};

/// What stands for the thesis's models, in their order: a name, and rules.
const THINGS: [(&str, &str); 9] = [
    ("chandelier", "import \"exhibits.dcg\" as x\nx.chandelier()"),
    (
        "tree",
        "import \"tree.dcg\" as tree\ntree(height = 8, variant = 0, richness = 2)",
    ),
    ("bookcase", "import \"exhibits.dcg\" as x\nx.bookcase(2.3, 3.4, 0)"),
    (
        "large tree",
        "import \"tree.dcg\" as tree\ntree(height = 12, variant = 0, richness = 4)",
    ),
    (
        "turned stool",
        "lathe([[0.2, 0], [0.22, 0.04], [0.08, 0.1], [0.05, 0.3], [0.08, 0.42], [0.24, 0.45], [0.25, 0.49], [0.23, 0.5], [0, 0.5]], sides = 100, smooth = 1)",
    ),
    (
        "turned tub",
        "lathe([[0.5, 0], [0.75, 0.05], [0.8, 0.3], [0.82, 0.6], [0.9, 0.62], [0.88, 0.66], [0.76, 0.62], [0.74, 0.3], [0.6, 0.1], [0, 0.08]], sides = 250, smooth = 1)",
    ),
    ("case of vases", "import \"exhibits.dcg\" as x\nx.case_of_vases(0)"),
    ("globe", "import \"exhibits.dcg\" as x\nx.globe()"),
    (
        "folded cloth",
        "heights x, z in 2 by 1.5 steps 90 by 48 = 0.1 * sin(900 * x) + 0.02 * sin(500 * z)",
    ),
];

/// What was measured, in the order of the paper's rows.
#[derive(Debug, Serialize, Deserialize)]
pub struct Measured {
    /// Our models.
    pub models: Vec<Model>,
}

/// A model of ours, sizes in bytes.
#[derive(Debug, Serialize, Deserialize)]
pub struct Model {
    /// Its name.
    pub name: String,
    /// Vertices, each position once.
    pub vertices: u64,
    /// Triangles.
    pub triangles: u64,
    /// As a list of vertices and triangles.
    pub object_bytes: u64,
    /// With conventional levels.
    pub levels_bytes: u64,
    /// As packets of the thesis.
    pub thesis_bytes: u64,
    /// As our own stream.
    pub slod_bytes: u64,
}

/// Measures.
///
/// # Errors
/// When something does not grow, or what was written is not read back.
pub fn run(host: &Host) -> anyhow::Result<Measured> {
    let mut models = Vec::new();
    for (name, rules) in THINGS {
        host.say(name);
        models.push(measure(&Mesh::of_rules(name, rules)?)?);
    }
    Ok(Measured { models })
}

fn measure(mesh: &Mesh) -> anyhow::Result<Model> {
    let precision = Precision {
        with_attributes: false,
        ..Precision::default()
    };
    let quantised = QuantisedMesh::new(&mesh.model, precision);
    let stream = mesh.stream(&quantised)?;
    let packed = thesis::encode(&quantised).ok_or_else(|| anyhow::anyhow!("{} has too many materials", mesh.name))?;
    let told = packets::decode(&packed)?;
    let (vertices, triangles) = (quantised.positions.len() as u64, quantised.triangles.len() as u64);
    anyhow::ensure!(
        (told.positions.len() as u64, told.triangles.len() as u64) == (vertices, triangles),
        "packets of {} do not hold it",
        mesh.name
    );
    let settings = LodSettings {
        max_levels: LEVELS_OF_TABLE_7,
        worthwhile_share: 1.0,
        dominated: 0.0,
        usual_share: 0.5,
        coarsest_shapes: (triangles as usize >> (LEVELS_OF_TABLE_7 - 1)).max(1),
        ..LodSettings::default()
    };
    let chain = lod::chain(&lod::clean(&mesh.model, &settings), &settings);
    let coarser: u64 = chain.levels[1..].iter().map(|level| level.triangles).sum();
    let object_bytes = 12 * vertices + 6 * triangles;
    Ok(Model {
        name: mesh.name.clone(),
        vertices,
        triangles,
        object_bytes,
        levels_bytes: object_bytes + 6 * coarser,
        thesis_bytes: packed.len() as u64,
        slod_bytes: stream.len() as u64,
    })
}

/// What it says.
#[must_use]
pub fn section(measured: &Measured) -> Section {
    let share = |part: u64, whole: u64| part as f64 / whole as f64;
    let rows = MODELS.iter().zip(&measured.models).map(|(paper, ours)| Row {
        what: format!("{} / {}", paper.0, ours.name),
        paper: format!(
            "{}, {}",
            percent(share(paper.5, paper.3)),
            percent(share(paper.5, paper.4))
        ),
        ours: vec![
            format!(
                "{}, {}",
                percent(share(ours.thesis_bytes, ours.object_bytes)),
                percent(share(ours.thesis_bytes, ours.levels_bytes))
            ),
            format!(
                "{}, {}",
                percent(share(ours.slod_bytes, ours.object_bytes)),
                percent(share(ours.slod_bytes, ours.levels_bytes))
            ),
        ],
        why: vec![0, 1, 2],
    });
    let sizes = MODELS.iter().zip(&measured.models).map(|(paper, ours)| {
        let mut cells = vec![format!("{} / {}", paper.0, ours.name)];
        let pairs = [
            (paper.1, ours.vertices),
            (paper.2, ours.triangles),
            (paper.3, ours.object_bytes),
            (paper.4, ours.levels_bytes),
        ];
        cells.extend(pairs.map(|(theirs, ours)| format!("{} / {}", count(theirs), count(ours))));
        cells.push(format!(
            "{:.2} / {:.2}",
            share(paper.1, paper.2),
            share(ours.vertices, ours.triangles)
        ));
        cells
    });
    let shares = |of: &dyn Fn(&Model) -> u64| {
        measured
            .models
            .iter()
            .map(|m| share(of(m), m.object_bytes))
            .fold(0.0, f64::max)
    };
    let papers = MODELS.map(|paper| share(paper.5, paper.3));
    let (least, most) = papers
        .iter()
        .fold((f64::INFINITY, 0.0f64), |(l, m), s| (l.min(*s), m.max(*s)));
    Section {
        how: vec![
            "Each model as a stream of which every beginning is a coarser mesh: as the thesis's packets, and as ours (`.slod`). Shares of 12 B a vertex and 6 B a triangle, then of the same \
             with five conventional levels."
                .to_owned(),
        ],
        comparisons: vec![Comparison {
            source: TABLE_7,
            of: "model (theirs / ours)",
            ours: vec!["as packets of the thesis".to_owned(), "as our stream".to_owned()],
            rows: rows.collect(),
        }],
        tables: vec![Table {
            caption: "Sizes behind these shares, theirs / ours".to_owned(),
            head: ["model", "vertices", "triangles", "object, B", "with levels, B", "vertices a triangle"].map(str::to_owned).into(),
            rows: sizes.collect(),
        }],
        reasons: vec![
            "Other models: the thesis's cannot be had, so each has one of ours beside it that is called alike. Each vertex is told by a packet, so shares rise with the vertices for each triangle, which stand in the table above; trees of ours consist of loose leaves."
                .to_owned(),
            "Coordinates have 14 bits on the longest side of a model; the thesis's packets give each cluster's offsets the precision of its depth and do not say how many bits their \
             finest has."
                .to_owned(),
            "Our streams are entropy-coded, with vertices predicted from their neighbours; the thesis's packets have fields of fixed sizes, so that a reader of 1997 could keep up.".to_owned(),
        ],
        goals: vec![
            Goal::at_most("the thesis's packets, worst of nine, of the object", most, shares(&|m| m.thesis_bytes), percent),
            Goal::at_most("our streams, worst of nine, of the object: below the thesis's best", least, shares(&|m| m.slod_bytes), percent),
        ],
        ..Section::default()
    }
}
