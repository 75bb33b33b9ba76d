//! A stroll through a published scene: `cargo run -p belvedere-client --example stroll -- http://127.0.0.1:8080 museum`.
//!
//! Stands at the first viewpoint, fetches the coarsest level of all that can be seen from there, and goes on from cell to
//! cell. What was fetched once is kept below `stroll-cache`, so the second stroll costs next to nothing.

#![allow(clippy::print_stdout, reason = "that is what it is for")]

use std::{collections::HashSet, env, error::Error};

use belvedere_client::{ByteSource, Client, DiskCache, HttpSource, Retrying, Scene, Walk};
use belvedere_scene::{BlobName, record::CellRecord};

/// How far it goes.
const CELLS: usize = 8;
const CACHE_BYTES: u64 = 256 << 20;

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = env::args().skip(1);
    let (Some(address), Some(name)) = (arguments.next(), arguments.next()) else {
        return Err("usage: stroll ADDRESS SCENE".into());
    };
    let source = DiskCache::open("stroll-cache", CACHE_BYTES, Retrying::new(HttpSource::new(&address)?))?;
    let scene = Client::new(source).open(&name.parse()?).await?;
    let viewpoint = scene.pointer().viewpoints.first().ok_or("the scene has no viewpoint")?;
    let start = scene.locate(viewpoint.position).await?;
    let mut walk = Walk::start(&scene, start.cell).await?;
    let (mut been, mut here) = (HashSet::new(), HashSet::new());
    for _ in 0..CELLS {
        look(&scene, walk.record(), &mut here).await?;
        been.insert(walk.cell().cell);
        let Some(next) = walk.cell().adjacent.iter().find(|cell| !been.contains(cell)) else {
            break;
        };
        let next = scene.cell(*next).await?.ok_or("an adjacent cell is missing")?;
        walk.enter(next).await?;
    }
    Ok(())
}

/// Fetches the coarsest level of everything visible that is not here, and says what that took.
async fn look<S: ByteSource>(
    scene: &Scene<S>,
    record: &CellRecord,
    here: &mut HashSet<BlobName>,
) -> Result<(), Box<dyn Error>> {
    let objects = scene.visible(record).await?;
    let coarsest = objects.iter().filter_map(|object| object.levels.last());
    let missing: Vec<_> = coarsest.filter(|level| here.insert(level.url.clone())).collect();
    let bytes: usize = scene.glbs(&missing).await?.iter().map(|glb| glb.len()).sum();
    println!(
        "{}: {} objects in sight, {} models new, {bytes} bytes of them",
        record.cell,
        objects.len(),
        missing.len()
    );
    Ok(())
}
