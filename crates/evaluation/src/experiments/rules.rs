//! How small are rules beside what grows out of them? (Schmalstieg 1997, §8.6.)

use serde::{Deserialize, Serialize};

use crate::{
    host::Host,
    models::grow_file,
    page::{Comparison, Goal, Row, Section, count},
    papers::schmalstieg::{GROWN, RULES, SHAPES},
};

/// Rules of ours, in the order of the paper's.
const FILES: [&str; 3] = ["tree.dcg", "conifer.dcg", "terrain.dcg"];

/// What was measured.
#[derive(Debug, Serialize, Deserialize)]
pub struct Measured {
    /// In the order of the paper's.
    pub models: Vec<Model>,
}

/// Rules and what they grow.
#[derive(Debug, Serialize, Deserialize)]
pub struct Model {
    /// Their file.
    pub file: String,
    /// Bytes of the text.
    pub rule_bytes: u64,
    /// Bytes of the geometry, 12 a vertex and 6 a triangle.
    pub explicit_bytes: u64,
    /// Triangles.
    pub triangles: u64,
}

/// Measures.
///
/// # Errors
/// When rules do not grow.
pub fn run(host: &Host) -> anyhow::Result<Measured> {
    let mut models = Vec::new();
    for file in FILES {
        host.say(file);
        let growth = grow_file(file)?;
        models.push(Model {
            file: file.to_owned(),
            rule_bytes: growth.program.files().map(|(_, text)| text.len() as u64).sum(),
            explicit_bytes: growth.grown.explicit_bytes(),
            triangles: growth.grown.triangles(),
        });
    }
    Ok(Measured { models })
}

/// What it says.
#[must_use]
pub fn section(measured: &Measured) -> Section {
    let ratio = |whole: u64, part: u64| whole as f64 / part as f64;
    let times = |ratio: f64| format!("{ratio:.0}×");
    let rows = GROWN
        .iter()
        .zip(&measured.models)
        .map(|((name, rules, geometry), ours)| Row {
            what: format!("{name} / {}", ours.file),
            paper: format!(
                "{} B for {} B, {}",
                count(*rules),
                count(*geometry),
                times(ratio(*geometry, *rules))
            ),
            ours: vec![
                format!("{} B for {} B", count(ours.rule_bytes), count(ours.explicit_bytes)),
                times(ratio(ours.explicit_bytes, ours.rule_bytes)),
                count(ours.triangles),
            ],
            why: if *name == SHAPES[0].0 { vec![0, 1] } else { vec![0] },
        });
    let (name, shapes, strips) = SHAPES[0];
    let goals = GROWN
        .iter()
        .zip(&measured.models)
        .map(|((name, rules, geometry), ours)| {
            let [least, found] = [ratio(*geometry, *rules), ratio(ours.explicit_bytes, ours.rule_bytes)];
            Goal::at_least(format!("{name}: geometry for each byte of rules"), least, found, times)
        });
    Section {
        how: vec!["Bytes of the rules' text as it stands in `content/`, comments included, and of the same geometry at 12 bytes a vertex and 6 a triangle.".to_owned()],
        comparisons: vec![Comparison {
            source: RULES,
            of: "model",
            ours: ["ours", "ratio", "triangles"].map(str::to_owned).into(),
            rows: rows.collect(),
        }],
        reasons: vec![
            "Other plants and another language, whose texts are shorter; the thesis counts a cone as 7 floats and a height field as one float a height, where ours counts the triangles that are drawn."
                .to_owned(),
            format!(
                "The thesis's size of the {name} does not follow from its own counts: {} cones and cylinders of 28 bytes and {} strips of 6 vertices take {} B; those of its conifer do.",
                count(shapes),
                count(strips),
                count(28 * shapes + 72 * strips)
            ),
        ],
        goals: goals.collect(),
        ..Section::default()
    }
}
