//! A stroll through a published scene: `cargo run -p belvedere-client --example stroll -- http://127.0.0.1:8080 museum`.
//!
//! Stands at the first viewpoint until all that can be seen from there is sharp, and goes on from cell to cell. It says what
//! has come, and why. What was fetched once is kept below `stroll-cache`, so the second stroll costs next to nothing.

#![allow(clippy::print_stdout, reason = "that is what it is for")]

use std::{collections::HashSet, env, error::Error};

use belvedere_client::{
    ByteSource, Client, DiskCache, Event, Explorer, ExplorerOptions, HttpSource, Retrying, strategy::sight::Eye,
};

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
    let mut eye = Eye::at(viewpoint.position);
    let mut explorer = Explorer::new(scene, ExplorerOptions::default());
    let mut been = HashSet::new();
    for _ in 0..CELLS {
        explorer.follow(eye).await;
        look(&mut explorer).await;
        let cell = explorer.scene().locate(eye.position).await?.cell;
        been.insert(cell.cell);
        let Some(next) = cell.adjacent.iter().find(|cell| !been.contains(cell)) else {
            break;
        };
        let next = explorer
            .scene()
            .cell(*next)
            .await?
            .ok_or("an adjacent cell is missing")?;
        eye.position = next.bounds.center();
    }
    if !explorer.scene().is_current().await? {
        println!("the scene was published anew meanwhile: open it again to see it");
    }
    Ok(())
}

/// Waits until nothing more is wanted, and says what came first and how much it was.
async fn look<S: ByteSource + 'static>(explorer: &mut Explorer<S>) {
    let (mut drawn, mut first) = (0, None);
    while let Some(events) = explorer.advance().await {
        for event in events {
            match event {
                Event::Entered(cell) => println!("{cell}: {} objects in sight", explorer.visible().len()),
                Event::Drawn { why, .. } => {
                    drawn += 1;
                    first.get_or_insert(why);
                }
                Event::Problem(cause) => println!("  goes on without: {cause}"),
                Event::Blunted(_) | Event::Dropped(_) => {}
            }
        }
    }
    println!(
        "  {drawn} meshes, {}, {} bytes held",
        explorer.progress(),
        explorer.memory_bytes()
    );
    if let Some(why) = first {
        println!("  first: {why}");
    }
}
