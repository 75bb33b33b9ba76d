//! `belvedere mesh smooth FILE`: what does each mesh cost as a smooth LOD, and how far is each of its rungs?

use std::{
    path::{Path, PathBuf},
    time::Instant,
};

use anyhow::Context;
use belvedere_bake::{
    defect::Defect,
    lod::LodSettings,
    smooth::{
        encode, publish,
        quantise::{Precision, QuantisedMesh},
        thesis,
    },
    source::{Primitive, SourceModel, SourceScene, Topology},
};
use belvedere_scene::smooth::{Decoder, Header};
use serde::Serialize;

use super::{ensure_in_reach, read_scene};
use crate::commands::output::{bytes, percent, print, print_json, table};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A glTF 2.0 scene (.glb, .gltf or a .zip of one) or a floor plan (.plan)
    file: PathBuf,
    /// Write each stream into this folder, as m0.slod, m1.slod …
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Bits of a coordinate; by default 14, or as many as a step of 1 mm takes
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=16))]
    bits: Option<u32>,
    /// Positions and triangles only: no normals, texture coordinates and colours
    #[arg(long)]
    no_attributes: bool,
    /// Write packets as Schmalstieg's thesis describes them (m0.slth …) instead of our own streams
    #[arg(long)]
    thesis: bool,
    /// Print the table as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct Report {
    meshes: Vec<MeshReport>,
    /// Names of meshes of lines and points, which have none.
    skipped: Vec<String>,
    /// Names of meshes that are too small for their lattice: no triangle is left of them.
    too_small: Vec<String>,
    /// What was wrong with the source.
    defects: Vec<Defect>,
}

#[derive(Debug, Serialize)]
struct MeshReport {
    mesh: String,
    /// What lengths are counted in.
    metres_per_unit: f64,
    /// The file that was written.
    file: Option<PathBuf>,
    vertices: usize,
    triangles: usize,
    /// Two of whose corners fall together on the lattice.
    triangles_left_out: usize,
    /// Which have no smooth LOD.
    lines_left_out: usize,
    points_left_out: usize,
    bytes: usize,
    /// Positions, triangles and materials as packets of the thesis; none where these cannot tell so many materials.
    thesis_bytes: Option<usize>,
    /// 12 bytes a vertex and 6 a triangle (thesis, table 7).
    object_bytes: usize,
    rungs: Vec<RungReport>,
    encode_s: f64,
    decode_s: f64,
}

#[derive(Debug, Serialize)]
struct RungReport {
    from: u32,
    to: u32,
    triangles: u32,
    geometric_error_m: f64,
    rms_error_m: f32,
}

pub(super) fn run(args: Args) -> anyhow::Result<()> {
    let (scene, defects) = read_scene(&args.file)?;
    if let Some(folder) = &args.out {
        std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    }
    let (with_triangles, without): (Vec<_>, Vec<_>) = scene
        .models
        .iter()
        .enumerate()
        .partition(|(_, model)| model.triangle_count() > 0);
    let skipped: Vec<String> = without.into_iter().map(|(_, model)| model.name.clone()).collect();
    anyhow::ensure!(
        !with_triangles.is_empty(),
        "{} has no triangles, and only triangles have smooth LODs",
        args.file.display()
    );
    let (mut meshes, mut too_small) = (Vec::new(), Vec::new());
    for (number, model) in with_triangles {
        match report(number, &scene, &args)? {
            Some(report) => meshes.push(report),
            None => too_small.push(model.name.clone()),
        }
    }
    anyhow::ensure!(
        !meshes.is_empty(),
        "{} {TOO_SMALL}: scale it up, or ask for more --bits",
        args.file.display()
    );
    if args.json {
        return print_json(&Report {
            meshes,
            skipped,
            too_small,
            defects,
        });
    }
    for name in &skipped {
        print(&format!("{name}: skipped, it has lines or points only"))?;
    }
    for name in &too_small {
        print(&format!("{name}: skipped, it {TOO_SMALL}"))?;
    }
    for mesh in &meshes {
        let name = &mesh.mesh;
        let (lines, points) = (mesh.lines_left_out, mesh.points_left_out);
        if lines + points > 0 {
            let (lines, points) = (counted(lines, "line"), counted(points, "point"));
            print(&format!(
                "{name}: {lines} and {points} left out, only triangles have smooth LODs"
            ))?;
        }
        if mesh.triangles_left_out > 0 {
            let triangles = counted(mesh.triangles_left_out, "triangle");
            let off = mesh.rungs.last().map_or(String::new(), |last| {
                let off_mm = 1000.0 * last.geometric_error_m;
                format!("; what is left is up to {off_mm:.3} mm off, which more --bits may mend, or to take out what lies far away")
            });
            print(&format!(
                "{name}: {triangles} left out, of which corners fall together on the lattice{off}"
            ))?;
        }
    }
    for mesh in &meshes {
        if let Some(note) = super::note_of_units(mesh.metres_per_unit) {
            print(&format!("{}: {note}", mesh.mesh))?;
        }
    }
    print(&summary(&meshes))
}

/// What is said of a mesh without a triangle whose corners are apart on the lattice.
const TOO_SMALL: &str =
    "is too small or has too few bits: the corners of all its triangles fall together on the lattice";

/// `1 line`, `2 lines`.
fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// `None` when no triangle is left on the lattice.
fn report(number: usize, scene: &SourceScene, args: &Args) -> anyhow::Result<Option<MeshReport>> {
    let (model, materials) = (&scene.models[number], &scene.materials);
    ensure_in_reach(model)?;
    anyhow::ensure!(
        args.no_attributes || publish::tells_attributes(model, materials),
        "{} has no smooth LOD: its pictures are repeated more often, or its colours brighter, than streams tell finely enough; \
         --no-attributes leaves both out",
        model.name
    );
    let chosen = publish::precision(model, materials, 1.0);
    let precision = Precision {
        position_bits: args.bits.unwrap_or(chosen.position_bits),
        with_attributes: !args.no_attributes,
        ..chosen
    };
    let started = Instant::now();
    let mesh = QuantisedMesh::new(model, precision);
    if mesh.triangles.is_empty() {
        return Ok(None);
    }
    let stream = encode(&mesh).with_context(|| {
        format!(
            "{} has no smooth LOD: so many of its triangles meet at few vertices that readers would refuse it",
            model.name
        )
    })?;
    let encode_s = started.elapsed().as_secs_f64();

    let started = Instant::now();
    let mut decoder = Decoder::new(u64::MAX);
    decoder.push(&stream)?;
    let decode_s = started.elapsed().as_secs_f64();

    let errors = publish::geometric_errors(model, &mesh, &stream, &LodSettings::default().for_materials(materials))?;
    // Packets of the thesis name no cuts.
    let header = Header::read(&stream)?.filter(|_| !args.thesis);
    let cuts = header.map_or(Vec::new(), |(header, _)| header.cuts);
    let packets = thesis::encode(&mesh);
    let (written, ext) = match (args.thesis, &packets) {
        (false, _) => (&stream, "slod"),
        (true, Some(packets)) => (packets, "slth"),
        (true, None) => anyhow::bail!(
            "{} has more than {} materials, which packets of the thesis cannot tell",
            model.name,
            thesis::MOST_MATERIALS
        ),
    };
    let mut from = 0;
    let rungs = cuts.iter().zip(errors).map(|(cut, geometric_error_m)| RungReport {
        from: std::mem::replace(&mut from, cut.bytes),
        to: cut.bytes,
        triangles: cut.triangles,
        geometric_error_m,
        rms_error_m: cut.rms_error,
    });
    Ok(Some(MeshReport {
        mesh: model.name.clone(),
        metres_per_unit: super::metres_per_unit(scene, number),
        rungs: rungs.collect(),
        file: args
            .out
            .as_deref()
            .map(|folder| write(folder, &format!("m{number}.{ext}"), written))
            .transpose()?,
        vertices: mesh.positions.len(),
        triangles: mesh.triangles.len(),
        triangles_left_out: mesh.degenerate,
        lines_left_out: count(model, Topology::Lines),
        points_left_out: count(model, Topology::Points),
        bytes: written.len(),
        thesis_bytes: packets.as_ref().map(Vec::len),
        object_bytes: 12 * mesh.positions.len() + 6 * mesh.triangles.len(),
        encode_s,
        decode_s,
    }))
}

/// How many shapes of a kind a mesh has.
fn count(model: &SourceModel, topology: Topology) -> usize {
    let of_topology = model.primitives.iter().filter(|p| p.topology == topology);
    of_topology.map(Primitive::count).sum()
}

fn write(folder: &Path, name: &str, stream: &[u8]) -> anyhow::Result<PathBuf> {
    let path = folder.join(name);
    std::fs::write(&path, stream).with_context(|| format!("cannot write {}", path.display()))?;
    Ok(path)
}

/// The table for a person: a row for each rung.
fn summary(meshes: &[MeshReport]) -> String {
    let head = [
        "mesh",
        "rung",
        "bytes so far",
        "of 12 B, 6 B",
        "triangles",
        "error",
        "RMS error",
    ];
    let mut rows = Vec::new();
    for mesh in meshes {
        if mesh.rungs.is_empty() {
            let share = percent(mesh.bytes as f64 / mesh.object_bytes as f64);
            let triangles = mesh.triangles.to_string();
            let blank = String::new;
            rows.push(vec![
                mesh.mesh.clone(),
                "all".to_owned(),
                bytes(mesh.bytes as u64),
                share,
                triangles,
                blank(),
                blank(),
            ]);
        }
        for (number, rung) in mesh.rungs.iter().enumerate() {
            rows.push(vec![
                if number == 0 { mesh.mesh.clone() } else { String::new() },
                format!("r{number}"),
                bytes(u64::from(rung.to)),
                percent(f64::from(rung.to) / mesh.object_bytes as f64),
                rung.triangles.to_string(),
                format!("{:.3} mm", 1000.0 * rung.geometric_error_m),
                format!("{:.3} mm", 1000.0 * rung.rms_error_m),
            ]);
        }
    }
    let sum = |of: fn(&MeshReport) -> f64| meshes.iter().map(of).sum::<f64>();
    let triangles = meshes.iter().map(|mesh| mesh.triangles).sum();
    let objects = sum(|mesh| mesh.object_bytes as f64);
    format!(
        "{}\n{}, {}, {} ({} of the objects, with attributes where there are any; positions and \
         triangles as the thesis writes them: {}); encoded in {:.2} s, decoded in {:.3} s",
        table(&head, &rows),
        if meshes.len() == 1 {
            "1 mesh".to_owned()
        } else {
            format!("{} meshes", meshes.len())
        },
        counted(triangles, "triangle"),
        bytes(sum(|mesh| mesh.bytes as f64) as u64),
        percent(sum(|mesh| mesh.bytes as f64) / objects),
        percent(sum(|mesh| mesh.thesis_bytes.map_or(0.0, |bytes| bytes as f64)) / objects),
        sum(|mesh| mesh.encode_s),
        sum(|mesh| mesh.decode_s),
    )
}
