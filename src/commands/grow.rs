//! `belvedere grow FILE.dcg -o OUT.glb`: what grows out of rules, as a plain GLB, and what it took.

use std::{
    fs,
    path::PathBuf,
    time::{Duration, Instant},
};

use anyhow::Context;
use belvedere_bake::{
    defect::Defect,
    glb::write_whole,
    import::{
        Limits, is_gltf,
        procedural::{Ground, Growth, Sowing, plant},
    },
    world::MAX_PLACED_TRIANGLES,
};
use belvedere_scene::{
    Bounds,
    procedural::{Settings, limits::FINEST},
};
use serde::{Serialize, Serializer};

use super::{
    growing::Growing,
    output::{bytes, counted, print, print_json},
    sowing::{SowingArgs, told},
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
    sowing: SowingArgs,
    /// The level of detail, from 0 (coarsest) to 4 (finest)
    #[arg(long, default_value_t = FINEST, value_parser = detail, allow_negative_numbers = true)]
    detail: u32,
    /// Print the report as JSON
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
    /// A box that holds the model, what it has for the bake alone included.
    bounds: Bounds,
    /// Edges of a box around the objects, metres.
    size_m: [f64; 3],
    /// Cells, portals and occluders: no objects.
    shapes: usize,
    parameters: Vec<String>,
    /// The same with their ranges and defaults, for a person.
    #[serde(skip)]
    parameters_told: Vec<String>,
    /// For each limit what was used and what may be used.
    #[serde(serialize_with = "by_name")]
    limits: Vec<(&'static str, [u64; 2])>,
    /// Why nothing is drawn, for a person.
    #[serde(skip)]
    nothing: Option<&'static str>,
    /// Why a bake would refuse it, for a person.
    #[serde(skip)]
    refused: Option<String>,
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
    let Sowing { seed, parameters } = args.sowing.try_into()?;
    let settings = Settings {
        seed,
        detail: args.detail,
        parameters,
        ..Settings::default()
    };
    let started = Instant::now();
    let ground = Ground {
        files: &SourceFolder::beside(&args.file),
        limits: &limits,
        progress: &Growing::new(),
    };
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

fn detail(text: &str) -> Result<u32, String> {
    let detail = text.parse().ok().filter(|detail| *detail <= FINEST);
    detail.ok_or_else(|| format!("a level of detail is a whole number from 0 to {FINEST}"))
}

fn by_name<S: Serializer>(limits: &[(&'static str, [u64; 2])], to: S) -> Result<S::Ok, S::Error> {
    to.collect_map(limits.iter().copied())
}

/// Why a bake would refuse so many triangles, all copies counted; `None` where it does not.
pub(super) fn refusal(placed: usize) -> Option<String> {
    (placed > MAX_PLACED_TRIANGLES).then(|| {
        format!("a bake would refuse it, with more than {MAX_PLACED_TRIANGLES} placed triangles: bake it in parts")
    })
}

/// What two boxes that both hold something have in common, which holds it too.
fn common(a: &Bounds, b: &Bounds) -> Bounds {
    Bounds {
        min: std::array::from_fn(|axis| a.min[axis].max(b.min[axis])),
        max: std::array::from_fn(|axis| a.max[axis].min(b.max[axis])),
    }
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
        Self {
            rule_bytes: program.files().map(|(_, text)| text.len()).sum(),
            explicit_bytes: growth.explicit_bytes,
            parts: scene.models.len(),
            objects: scene.objects.len(),
            triangles: placed as u64,
            own_triangles: grown.usage.triangles,
            without_area: growth.without_area(),
            bounds: grown.parts[0].bounds,
            size_m: common(&scene.bounds(), &grown.parts[0].bounds).size_m(),
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
            refused: refusal(placed),
            bytes: None,
            defects: Vec::new(),
        }
    }

    /// The report for a person.
    pub(super) fn sentences(&self, name: &str) -> String {
        let limit = |(what, [used, limit]): &(&str, [u64; 2])| format!("{used} of {limit} {what}");
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
            format!(
                "  used {}",
                self.limits.iter().map(limit).collect::<Vec<_>>().join(", ")
            ),
        ];
        lines.extend(self.refused.iter().map(|refused| format!("  {refused}")));
        lines.extend(self.nothing.iter().map(|nothing| format!("  {nothing}")));
        if self.without_area > 0 {
            lines.push(format!(
                "  {} more triangles have no area and are left out of what is written",
                self.without_area
            ));
        }
        if self.shapes > 0 {
            lines.push(format!(
                "  {} cells, portals and occluders are for the bake and no objects",
                self.shapes
            ));
        }
        if !self.parameters_told.is_empty() {
            lines.push(format!("  parameters: {}", self.parameters_told.join("; ")));
        }
        lines.extend(self.defects.iter().map(|defect| format!("  {defect}")));
        lines.join("\n")
    }
}
