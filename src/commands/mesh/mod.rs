//! `belvedere mesh …`: the generators of levels of detail as tools for one file, without a scene around it.

mod decode;
mod eye;
mod lod;
mod smooth;

use std::path::Path;

use anyhow::Context;
use belvedere_bake::{
    defect::Defect,
    import::{self, Limits},
    progress::Silent,
    source::{SourceModel, SourceObject, SourceScene},
};

use super::output::printable;
use crate::publish::source_files::{MOST_OF_A_SOURCE, SourceFolder, read_named};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(subcommand)]
    tool: Tool,
}

#[derive(Debug, clap::Subcommand)]
enum Tool {
    /// Make the levels of detail of each mesh, and say from where on each is good enough
    Lod(lod::Args),
    /// Write the smooth LOD of each mesh, and say what its rungs cost
    Smooth(smooth::Args),
    /// Write the mesh that a smooth LOD, or its beginning, gives
    Decode(decode::Args),
}

pub(super) fn run(args: Args) -> anyhow::Result<()> {
    match args.tool {
        Tool::Lod(args) => lod::run(args),
        Tool::Smooth(args) => smooth::run(args),
        Tool::Decode(args) => decode::run(args),
    }
}

/// What a bake takes, a level of detail can hold.
const LARGEST_M: f32 = 1e9;

/// Refuses a mesh in whose space distances might overflow.
fn ensure_in_reach(model: &SourceModel) -> anyhow::Result<()> {
    let coordinates = model.primitives.iter().flat_map(|p| p.positions.iter().flatten());
    let reach_m = coordinates.fold(0.0f32, |reach_m, x| reach_m.max(x.abs()));
    anyhow::ensure!(
        reach_m <= LARGEST_M,
        "mesh {} reaches {reach_m:e} m from its origin; at most {LARGEST_M:e} m are possible: scale it down",
        model.name
    );
    Ok(())
}

/// How many metres a unit of a mesh's own space is where the scene shows it largest. What gltfpack or glTF-Transform have quantised
/// has steps of a lattice for units, and its node the scale.
fn metres_per_unit(scene: &SourceScene, model: usize) -> f64 {
    let placed = scene.objects.iter().filter(|object| object.model == model);
    placed.map(SourceObject::largest_scale).reduce(f64::max).unwrap_or(1.0)
}

/// Says so where that is not a metre; nothing where it is.
fn note_of_units(metres_per_unit: f64) -> Option<String> {
    let is_metre = (metres_per_unit - 1.0).abs() < 1e-6;
    (!is_metre).then(|| format!("lengths in its own units, one of which is {metres_per_unit:.4e} m in the scene"))
}

/// Reads a scene with all that stands beside it, and tells what is wrong with it.
fn read_scene(file: &Path) -> anyhow::Result<(SourceScene, Vec<Defect>)> {
    let limits = Limits::default();
    let bytes = read_named(file, (limits.memory_bytes, MOST_OF_A_SOURCE))?;
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let imported = import::import(&name, bytes, &SourceFolder::beside(file), &limits, &Silent)
        .with_context(|| format!("cannot import {name}"))?;
    let defects: Vec<_> = imported.defects.iter().collect();
    for defect in &defects {
        eprintln!("{}", printable(&format!("{name}: {defect}")));
    }
    Ok((imported.scene, defects))
}
