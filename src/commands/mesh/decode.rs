//! `belvedere mesh decode FILE -o OUT.glb`: what does a smooth LOD, or its beginning, look like in any glTF viewer?

use std::path::{Path, PathBuf};

use anyhow::Context;
use belvedere_bake::{
    glb::write_whole,
    smooth::drawn,
    source::{Material, Role, SourceModel, SourceObject, SourceScene},
};
use belvedere_scene::{
    BlobHash,
    smooth::{Decoder, Header, SmoothError, Snapshot, thesis},
};
use serde_json::json;

use super::eye;
use crate::{
    commands::output::{bytes, print},
    publish::source_files::read_named,
};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A smooth LOD (.slod), or packets of Schmalstieg's thesis (.slth)
    file: PathBuf,
    /// Decode only so many bytes from the beginning
    #[arg(long, value_name = "N")]
    bytes: Option<usize>,
    /// The GLB to write; its materials have numbers only
    #[arg(short, long, value_name = "OUT.glb")]
    out: PathBuf,
    /// The most memory that the mesh may take, in MiB
    #[arg(long, default_value_t = 4096, value_parser = clap::value_parser!(u64).range(1..=1 << 20))]
    memory_mib: u64,
    #[command(flatten)]
    eye: eye::EyeArgs,
}

pub(super) fn run(args: Args) -> anyhow::Result<()> {
    args.eye.ensure_direction()?;
    let shown = args.file.display();
    let places = [&args.file, &args.out].map(|path| path.canonicalize().ok());
    anyhow::ensure!(
        places[0].is_none() || places[0] != places[1],
        "the GLB would take the place of {shown} itself: name another file with -o"
    );
    let stream = read_named(&args.file, (args.memory_mib << 20, "--memory-mib"))?;
    let wanted = args.bytes.unwrap_or(stream.len());
    let beginning = stream
        .get(..wanted)
        .with_context(|| format!("{shown} has {} bytes, not {wanted}", stream.len()))?;
    ensure_encoded(&stream)
        .and_then(|()| ensure_told(&stream, args.memory_mib << 20))
        .with_context(|| format!("cannot decode {shown}"))?;
    let (snapshot, seen) = snapshot_of(beginning, &args).with_context(|| format!("cannot decode {shown}"))?;
    let (vertices, triangles) = (snapshot.positions.len(), triangles_of(&snapshot));
    if let Some(seen) = seen {
        print(&seen)?;
    }
    std::fs::write(&args.out, glb_of(snapshot)).with_context(|| format!("cannot write {}", args.out.display()))?;
    print(&format!(
        "{} of {}: {vertices} vertices, {triangles} triangles, in {}",
        bytes(wanted as u64),
        bytes(stream.len() as u64),
        args.out.display(),
    ))
}

/// What the other commands of meshes take is easily given to this one.
fn ensure_encoded(file: &[u8]) -> anyhow::Result<()> {
    anyhow::ensure!(
        !file.starts_with(b"glTF"),
        "this is a GLB, which is not decoded but can be shown as it is; `belvedere mesh smooth FILE.glb -o DIR` makes smooth LODs of its meshes"
    );
    Ok(())
}

/// A file that claims more than is allowed, and more than its bytes can tell, is damaged, and no limit helps.
fn ensure_told(file: &[u8], most_bytes: u64) -> anyhow::Result<()> {
    let Ok(Some((header, _))) = Header::read(file) else {
        return Ok(());
    };
    let claimed = [header.vertices, header.triangles, header.wedges].into_iter().max();
    let can_be_told = MOST_A_BYTE * file.len() as u64;
    if header.memory_bytes() > most_bytes && claimed.is_some_and(|most| u64::from(most) > can_be_told) {
        return Err(SmoothError::Damaged("its header tells of more than its bytes have room for").into());
    }
    Ok(())
}

/// No decision takes less than 1/360 of a bit, and each vertex, triangle and wedge takes one at least.
const MOST_A_BYTE: u64 = 8 * 360;

/// The mesh, and what an eye sees of it in words.
fn snapshot_of(beginning: &[u8], args: &Args) -> anyhow::Result<(Snapshot, Option<String>)> {
    // Three bytes tell the two apart.
    let is_thesis =
        beginning.len() > 2 && (beginning.starts_with(&thesis::MAGIC) || thesis::MAGIC.starts_with(beginning));
    let not_whole = || {
        format!(
            "its header is not whole in {} bytes: there is no mesh in them yet",
            beginning.len()
        )
    };
    if is_thesis {
        anyhow::ensure!(beginning.len() >= thesis::HEADER_BYTES, not_whole());
        anyhow::ensure!(
            !args.eye.is_given(),
            "packets of the thesis are decoded whole: leave out --eye"
        );
        return Ok((thesis::decode(beginning)?.into(), None));
    }
    let mut decoder = Decoder::new(args.memory_mib << 20);
    decoder.push(beginning)?;
    anyhow::ensure!(decoder.header().is_some(), not_whole());
    if !decoder.is_complete() {
        let all = decoder.header().map_or(0, |header| header.total_bytes);
        eprintln!("{} of {all} bytes: the mesh is not whole yet", beginning.len());
    } else {
        ensure_named(&args.file, beginning)?;
    }
    Ok(match args.eye.look(&decoder) {
        Some((snapshot, seen)) => (snapshot, Some(seen)),
        None => (decoder.snapshot(), None),
    })
}

/// Nothing in a stream tells that a position is another one than was written, but published files are named by their hash.
fn ensure_named(file: &Path, stream: &[u8]) -> anyhow::Result<()> {
    let stem = file.file_stem().and_then(|stem| stem.to_str());
    let named: Option<BlobHash> = stem.and_then(|stem| stem.parse().ok());
    let is_damaged = named.is_some_and(|named| named != BlobHash::of(stream));
    anyhow::ensure!(
        !is_damaged,
        "its bytes do not have the hash that is its name: it is damaged, fetch it again"
    );
    Ok(())
}

fn triangles_of(snapshot: &Snapshot) -> usize {
    snapshot.indices.iter().map(Vec::len).sum::<usize>() / 3
}

/// The mesh as a file.
fn glb_of(snapshot: Snapshot) -> Vec<u8> {
    let material = |number| Material {
        gltf: json!({"name": format!("material {number}")}),
        see_through: false,
        double_sided: false,
    };
    let numbers: Vec<_> = (0..snapshot.indices.len()).map(Some).collect();
    let model = SourceModel {
        primitives: drawn::primitives(snapshot, &numbers),
        ..SourceModel::default()
    };
    let mut scene = SourceScene {
        materials: (0..numbers.len()).map(material).collect(),
        ..SourceScene::default()
    };
    // glTF has no empty mesh.
    if !model.primitives.is_empty() {
        scene.models.push(model);
        scene.objects.push(SourceObject {
            source_node: "mesh".to_owned(),
            part: 0,
            model: 0,
            world_from_object: glam::DMat4::IDENTITY,
            role: Role::default(),
        });
    }
    write_whole(&scene)
}
