//! `belvedere grow FILE.dcg -o OUT.glb`: what grows out of rules, as a plain GLB, and what it took.

use std::{
    fs,
    path::PathBuf,
    time::{Duration, Instant},
};

use anyhow::Context;
use belvedere_bake::{
    cells::author,
    defect::Defect,
    glb::write_whole,
    import::{
        Limits, is_gltf,
        procedural::{Ground, Growth, measure, plant},
    },
    source::SourceScene,
    world::MAX_PLACED_TRIANGLES,
};
use belvedere_scene::{
    Bounds,
    procedural::{Settings, limits::Usage},
};
use serde::{Serialize, Serializer};

use super::{
    growing::Growing,
    output::{bytes, counted, print, print_json},
    sowing::{GrowthArgs, told},
};
use crate::publish::source_files::{MOST_OF_A_SOURCE, SourceFolder, read_named};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A file of rules (.dcg)
    file: PathBuf,
    /// Where to write the model, as a plain GLB; without it only the report is printed
    #[arg(short, long)]
    output: Option<PathBuf>,
    #[command(flatten)]
    growth: GrowthArgs,
    /// Grow no triangle: find a box that holds the model, parts that say `within` taken by their word
    #[arg(long, conflicts_with = "output")]
    bounds: bool,
    /// Print the report as JSON; of a model in which nothing is drawn, `bounds` is null
    #[arg(long)]
    json: bool,
}

/// What grew, and what it took.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    /// Bytes of the rules, imported files included.
    rule_bytes: usize,
    /// The same geometry, and that of placed glTF files, at 12 bytes for each vertex and 6 for each triangle.
    explicit_bytes: u64,
    parts: usize,
    objects: usize,
    /// Those of every object, of placed glTF files too; and those that the rules made, each part once.
    triangles: u64,
    own_triangles: u64,
    /// Those of the stored ones that have no area and are left out of what is written.
    without_area: u64,
    /// The box around the objects, those of placed glTF files too; null where there are none. And its edges, metres.
    bounds: Option<Bounds>,
    size_m: [f64; 3],
    /// Cells, portals and occluders: no objects.
    shapes: usize,
    parameters: Vec<String>,
    /// The same with their ranges and defaults, for a person.
    #[serde(skip)]
    parameters_told: Vec<String>,
    /// For each limit what was used and what may be used.
    #[serde(serialize_with = "by_name")]
    limits: Vec<Taken>,
    /// Why nothing is drawn, for a person.
    #[serde(skip)]
    nothing: Option<&'static str>,
    /// Why a bake would refuse it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) refused: Option<String>,
    seconds: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    bytes: Option<usize>,
    /// What was wrong, where nobody else tells.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    defects: Vec<Defect>,
}

pub(super) fn run(args: Args) -> anyhow::Result<()> {
    if let Some(output) = &args.output {
        anyhow::ensure!(
            output.extension().is_some_and(|ext| ext.eq_ignore_ascii_case("glb")),
            "cannot write {}: what grows is written as a .glb, so give `-o` a name that ends with it",
            output.display()
        );
    }
    // What is longer than rules may be is told in the words in which all mistakes of rules are.
    let limits = Limits::default();
    let read = read_named(&args.file, (limits.memory_bytes, MOST_OF_A_SOURCE))?;
    let name = args.file.file_name().unwrap_or_default().to_string_lossy();
    anyhow::ensure!(
        !is_gltf(&read),
        "cannot grow {name}: this is glTF or an archive, and `grow` takes rules (.dcg); `belvedere inspect` tells what is in it, \
         `belvedere bake` publishes it, and rules place it with `model`"
    );
    let settings = args.growth.try_into()?;
    let started = Instant::now();
    let ground = Ground {
        files: &SourceFolder::beside(&args.file),
        limits: &limits,
        progress: &Growing::new(),
    };
    if args.bounds {
        let measured = measure(&name, read, &settings, ground)
            .map_err(told)
            .with_context(|| format!("cannot measure {name}"))?;
        let found = Found::of(&measured, &settings, started.elapsed());
        return if args.json {
            print_json(&found)
        } else {
            print(&found.sentences(&name))
        };
    }
    let growth = plant(&name, read, &settings, ground)
        .map_err(told)
        .with_context(|| format!("cannot grow {name}"))?;
    let mut report = Report::of(&growth, &settings, started.elapsed());
    report.defects = growth.defects.iter().collect();
    if let Some(output) = &args.output {
        let glb = write_whole(&growth.scene);
        fs::write(output, &glb).with_context(|| format!("cannot write {}", output.display()))?;
        report.bytes = Some(glb.len());
    }
    if args.json {
        return print_json(&report);
    }
    print(&report.sentences(&name))
}

type Taken = (&'static str, [u64; 2]);

fn by_name<S: Serializer>(limits: &[Taken], to: S) -> Result<S::Ok, S::Error> {
    to.collect_map(limits.iter().copied())
}

fn used(limits: &[Taken]) -> String {
    let limit = |(what, [used, limit]): &Taken| format!("{used} of {limit} {what}");
    format!("  used {}", limits.iter().map(limit).collect::<Vec<_>>().join(", "))
}

/// Why a bake would refuse a scene, for its triangles with all copies or for the cells that its author has drawn; `None`
/// where it does not.
pub(super) fn refusal(scene: &SourceScene) -> Option<String> {
    if scene.placed_triangles() > MAX_PLACED_TRIANGLES {
        return Some(format!(
            "a bake would refuse it, with more than {MAX_PLACED_TRIANGLES} placed triangles: bake it in parts"
        ));
    }
    let refusal = author::refusal(&scene.authored)?;
    Some(format!("a bake would refuse it: {refusal}"))
}

/// A box that holds what is not grown, what is for the bake alone too, and what it took to find it.
#[derive(Debug, Serialize)]
struct Found {
    /// Null where nothing is held.
    bounds: Option<Bounds>,
    size_m: [f64; 3],
    #[serde(serialize_with = "by_name")]
    limits: Vec<Taken>,
    seconds: f64,
}

impl Found {
    fn of((bounds, usage): &(Bounds, Usage), settings: &Settings, time: Duration) -> Self {
        let limits = usage.of(&settings.limits).into_iter();
        // Nothing is grown of these.
        let limits = limits.filter(|(name, ..)| *name != "triangles");
        Self {
            bounds: holding(*bounds),
            size_m: bounds.size_m(),
            limits: limits.map(|(name, used, limit)| (name, [used, limit])).collect(),
            seconds: time.as_secs_f64(),
        }
    }

    fn sentences(&self, name: &str) -> String {
        let held = match self.bounds {
            None => "  there is nothing to hold".to_owned(),
            Some(Bounds { min, max }) => {
                let size = self.size_m.map(|length| format!("{length:.1}")).join(" × ");
                format!("  within {min:?} and {max:?}, {size} m, found in {:.3} s", self.seconds)
            }
        };
        format!(
            "{name}: a box that holds it, without growing it\n{held}\n{}",
            used(&self.limits)
        )
    }
}

/// A box, if it holds anything.
fn holding(bounds: Bounds) -> Option<Bounds> {
    (!bounds.is_empty()).then_some(bounds)
}

impl Report {
    /// The report of what grew in this time.
    pub(super) fn of(growth: &Growth, settings: &Settings, time: Duration) -> Self {
        let Growth {
            program, grown, scene, ..
        } = growth;
        let usage = grown.usage.of(&settings.limits);
        let placed = scene.placed_triangles();
        let authored = &scene.authored;
        let bounds = scene.exact_bounds();
        Self {
            rule_bytes: program.files().map(|(_, text)| text.len()).sum(),
            explicit_bytes: growth.explicit_bytes,
            parts: scene.models.len(),
            objects: scene.objects.len(),
            triangles: placed as u64,
            own_triangles: grown.usage.triangles,
            without_area: growth.without_area(),
            bounds: holding(bounds),
            size_m: bounds.size_m(),
            shapes: authored.cells.len() + authored.portals.len() + authored.occluders.len(),
            parameters: program.parameters().map(str::to_owned).collect(),
            parameters_told: program.parameters_told().collect(),
            limits: usage
                .into_iter()
                .chain([("placed triangles", placed as u64, MAX_PLACED_TRIANGLES as u64)])
                .map(|(name, used, limit)| (name, [used, limit]))
                .collect(),
            seconds: time.as_secs_f64(),
            nothing: scene.objects.is_empty().then(|| growth.nothing_drawn()),
            refused: refusal(scene),
            bytes: None,
            defects: Vec::new(),
        }
    }

    /// The report for a person.
    pub(super) fn sentences(&self, name: &str) -> String {
        let size = self.size_m;
        let mut lines = vec![
            format!(
                "{name}: {} of rules for {} of geometry (12 B a vertex, 6 B a triangle)",
                bytes(self.rule_bytes as u64),
                bytes(self.explicit_bytes)
            ),
            format!(
                "  {} in {} of {}, {:.1} × {:.1} × {:.1} m, in {:.3} s",
                counted(self.triangles as usize, "triangle"),
                counted(self.objects, "object"),
                counted(self.parts, "part"),
                size[0],
                size[1],
                size[2],
                self.seconds
            ),
            used(&self.limits),
        ];
        lines.extend(self.refused.iter().map(|refused| format!("  {refused}")));
        lines.extend(self.nothing.iter().map(|nothing| format!("  {nothing}")));
        if self.without_area > 0 {
            lines.push(format!(
                "  {} more triangles have no area and are left out of what is written",
                self.without_area
            ));
        }
        match self.shapes {
            0 => {}
            1 => lines.push("  1 cell, portal or occluder is for the bake and no object".to_owned()),
            shapes => lines.push(format!(
                "  {shapes} cells, portals and occluders are for the bake and no objects"
            )),
        }
        if !self.parameters_told.is_empty() {
            lines.push(format!("  parameters: {}", self.parameters_told.join("; ")));
        }
        lines.extend(self.defects.iter().map(|defect| format!("  {defect}")));
        lines.join("\n")
    }
}
