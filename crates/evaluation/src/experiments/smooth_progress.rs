//! How soon is there something to look at? (Schmalstieg 1997, §7.7: figs 35 and 36.)
//!
//! Triangles that can be drawn against bytes that have come: a smooth LOD from its first byte on, beside conventional levels of
//! which one is shown when all of it has come, coarsest first. The levels are counted twice: as GLBs that are published, and as the thesis
//! counts them, 12 bytes for each vertex that is new and 6 for each triangle.

use std::collections::BTreeSet;

use belvedere_bake::{
    lod::{self, LodSettings},
    smooth::quantise::{Precision, QuantisedMesh},
    source::Primitive,
};
use belvedere_scene::smooth::Decoder;
use serde::{Deserialize, Serialize};

use crate::{
    host::Host,
    models::{Mesh, carried_bytes},
    page::{
        Comparison, Plot, Row, Section,
        chart::{Axis, Chart, Series},
        count,
        mesh::{Stage, Triangle, stages},
        percent,
    },
    papers::schmalstieg::FIGURES_35_36,
};

const THINGS: [(&str, &str, &str); 2] = [
    ("globe", "import \"exhibits.dcg\" as x\nx.globe()", "globe"),
    (
        "bookcase",
        "import \"exhibits.dcg\" as x\nx.bookcase(2.3, 3.4, 0)",
        "bookcase",
    ),
];
/// Places of a stream that are looked at.
const STEPS: usize = 60;
/// Shares of the conventional levels' bytes at which the pictures of figure 36 are taken.
const STAGES: [f64; 3] = [0.05, 0.15, 0.4];

/// What was measured.
#[derive(Debug, Serialize, Deserialize)]
pub struct Measured {
    /// Our models.
    pub models: Vec<Model>,
}

/// A model: bytes and the triangles that these give.
#[derive(Debug, Serialize, Deserialize)]
pub struct Model {
    /// Its name.
    pub name: String,
    /// Its picture's file begins with this.
    pub file: String,
    /// Triangles of the whole.
    pub triangles: u64,
    /// Of the smooth LOD.
    pub smooth: Vec<[u64; 2]>,
    /// Of the levels as published, where each is complete.
    pub levels: Vec<[u64; 2]>,
    /// Of the levels as the thesis counts them.
    pub counted: Vec<[u64; 2]>,
    /// Pictures of its stages.
    pub stages: Vec<Stage>,
}

/// Measures.
///
/// # Errors
/// When something does not grow or a stream is not read back.
pub fn run(host: &Host) -> anyhow::Result<Measured> {
    let mut models = Vec::new();
    for (number, (name, rules, file)) in THINGS.into_iter().enumerate() {
        host.say(name);
        // One set of pictures shows enough and is large.
        let pictures = if number == 0 { &STAGES[..] } else { &[] };
        models.push(measure(&Mesh::of_rules(name, rules)?, file, pictures)?);
    }
    Ok(Measured { models })
}

fn measure(mesh: &Mesh, file: &str, shares: &[f64]) -> anyhow::Result<Model> {
    // Levels as published have normals, so smooth LODs of this picture have them, too.
    let stream = mesh.stream(&QuantisedMesh::new(&mesh.model, Precision::default()))?;
    let mut decoder = Decoder::new(u64::MAX);
    let mut smooth = vec![[0, 0]];
    let mut pushed = 0;
    for step in 1..=STEPS {
        let end = stream.len() * step / STEPS;
        decoder.push(&stream[pushed..end])?;
        pushed = end;
        smooth.push([end as u64, decoder.counts().1 as u64]);
    }
    let settings = LodSettings {
        max_levels: 5,
        dominated: 0.0,
        ..LodSettings::default()
    };
    let chain = lod::chain(&lod::clean(&mesh.model, &settings), &settings);
    let (mut levels, mut counted) = (vec![[0, 0]], vec![[0, 0]]);
    let mut known = BTreeSet::new();
    for level in chain.levels.iter().rev() {
        let before = known.len();
        known.extend(corners(&level.primitives).map(|p| p.map(f32::to_bits)));
        let fresh = (known.len() - before) as u64;
        levels.push([
            levels[levels.len() - 1][0] + carried_bytes(mesh, level),
            level.triangles,
        ]);
        let bytes = counted[counted.len() - 1][0] + 12 * fresh + 6 * level.triangles;
        counted.push([bytes, level.triangles]);
    }
    let all = levels[levels.len() - 1][0];
    let mut pictures = Vec::new();
    for share in shares {
        let bytes = (share * all as f64) as u64;
        let mut decoder = Decoder::new(u64::MAX);
        decoder.push(&stream[..stream.len().min(bytes as usize)])?;
        let whole = levels.iter().rposition(|[needs, _]| *needs <= bytes).unwrap_or(0);
        let conventional = whole
            .checked_sub(1)
            .map(|i| &chain.levels[chain.levels.len() - 1 - i].primitives);
        pictures.push(Stage {
            bytes,
            smooth: lattice_triangles(&decoder),
            levels: conventional.map_or_else(Vec::new, |p| triangles(p)),
        });
    }
    Ok(Model {
        name: mesh.name.clone(),
        file: file.to_owned(),
        triangles: mesh.model.triangle_count() as u64,
        smooth,
        levels,
        counted,
        stages: pictures,
    })
}

fn corners(primitives: &[Primitive]) -> impl Iterator<Item = [f32; 3]> {
    primitives.iter().flat_map(Primitive::triangles).flatten()
}

/// Millimetres are enough for a picture.
fn rounded(p: [f32; 3]) -> [i32; 3] {
    p.map(|x| (1000.0 * x).round() as i32)
}

fn triangles(primitives: &[Primitive]) -> Vec<Triangle> {
    let all = primitives.iter().flat_map(Primitive::triangles);
    all.map(|triangle| triangle.map(rounded)).collect()
}

/// What a stream gives so far, in model space.
fn lattice_triangles(decoder: &Decoder) -> Vec<Triangle> {
    let Some(header) = decoder.header() else {
        return Vec::new();
    };
    let lattice = decoder.lattice();
    let place = |v: u32| {
        let p = lattice.twice_positions[v as usize];
        rounded([0, 1, 2].map(|i| header.origin[i] + 0.5 * header.step * p[i] as f32))
    };
    lattice.triangles.iter().map(|t| t.map(place)).collect()
}

/// The bytes at which a share of all triangles is there.
fn bytes_at(curve: &[[u64; 2]], triangles: u64, share: f64) -> Option<u64> {
    curve
        .iter()
        .find(|[_, there]| *there as f64 >= share * triangles as f64)
        .map(|[bytes, _]| *bytes)
}

/// What it says.
#[must_use]
pub fn section(measured: &Measured) -> Section {
    let mut rows = Vec::new();
    let mut plots = Vec::new();
    for model in &measured.models {
        for (share, paper) in [
            (0.25, "earlier than conventional"),
            (1.0, "“reached much earlier using the smooth LODs”"),
        ] {
            let shown = |curve: &[[u64; 2]]| {
                bytes_at(curve, model.triangles, share)
                    .map_or_else(|| "never".to_owned(), |bytes| format!("{} B", count(bytes)))
            };
            rows.push(Row {
                what: format!(
                    "{}: bytes to {} of {} triangles",
                    model.name,
                    percent(share),
                    count(model.triangles)
                ),
                paper: paper.to_owned(),
                ours: vec![shown(&model.smooth), shown(&model.levels), shown(&model.counted)],
                why: vec![0, 1],
            });
        }
        // Levels are there when they are complete, so their curves go in steps.
        let steps = |curve: &[[u64; 2]]| {
            let mut points = Vec::new();
            for pair in curve.windows(2) {
                points.push([pair[1][0] as f64 / 1e3, pair[0][1] as f64]);
                points.push([pair[1][0] as f64 / 1e3, pair[1][1] as f64]);
            }
            points
        };
        let all = model.levels.last().map_or(0, |[bytes, _]| *bytes);
        // What is complete stays so.
        let line = |curve: &[[u64; 2]]| {
            let end = curve.last().map(|[_, triangles]| [all, *triangles]);
            curve
                .iter()
                .copied()
                .chain(end)
                .map(|[b, t]| [b as f64 / 1e3, t as f64])
                .collect()
        };
        let chart = Chart {
            title: format!("Triangles against bytes, {}", model.name),
            x: Axis::linear("kB received"),
            y: Axis::linear("triangles that can be drawn"),
            right: None,
            series: vec![
                Series::new("smooth LOD", 0, line(&model.smooth)),
                Series::new("levels as published", 3, steps(&model.levels)),
                Series::new("levels at 12 B a vertex, 6 B a triangle", 1, steps(&model.counted)).dashed(),
            ],
        };
        plots.push(Plot {
            file: format!("fig35-{}.svg", model.file),
            caption: format!("After fig 35: {}", model.name),
            svg: chart.to_svg(),
        });
        if model.stages.is_empty() {
            continue;
        }
        plots.push(Plot {
            file: format!("fig36-{}.svg", model.file),
            caption: format!(
                "After fig 36: {}, smooth LOD at the left, levels at the right, after the same bytes",
                model.name
            ),
            svg: stages(&model.stages, model.triangles as usize),
        });
    }
    Section {
        how: vec![
            "Triangles that can be drawn against bytes that have come, with normals. In the pictures, bars at the sides are the share of all triangles that is there, as in the paper."
                .to_owned(),
        ],
        comparisons: vec![Comparison {
            source: FIGURES_35_36,
            of: "model",
            ours: ["smooth LOD", "levels as published", "levels as the thesis counts"].map(str::to_owned).into(),
            rows,
        }],
        plots,
        reasons: vec![
            "The figures have no numbers; that the smooth curve reaches the top earlier, because the stream is smaller than the levels, is what can be checked.".to_owned(),
            "Levels as published are files of their own, whose vertices, normals and materials stand in each of them again, with a header; the thesis counts positions once and triangles as three indices of two bytes. \
             So small models take more than it counts, although what is sent is compressed."
                .to_owned(),
        ],
        goals: Vec::new(),
        ..Section::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_is_reached_at_the_first_place_that_has_it() {
        let curve = [[0, 0], [10, 20], [30, 50], [90, 100]];
        assert_eq!(bytes_at(&curve, 100, 0.25), Some(30));
        assert_eq!(bytes_at(&curve, 100, 1.0), Some(90));
        assert_eq!(bytes_at(&curve, 200, 1.0), None);
    }
}
