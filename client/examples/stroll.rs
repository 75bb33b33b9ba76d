//! A stroll through a published scene: `cargo run -p belvedere-client --example stroll -- http://127.0.0.1:8080 museum`.
//!
//! Stands at the first viewpoint until all that can be seen from there is sharp, then walks from cell to cell while the rest is still
//! coming, and what lies ahead is fetched before it is seen. It says what has come, and why. What was fetched once is kept below
//! `stroll-cache`, all but rungs, which have no hash of their own: so the second stroll costs few bytes.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "that is what it is for")]

use std::{collections::HashSet, env, error::Error, process::ExitCode, time::Duration};

use belvedere_client::{
    ByteSource, Client, DiskCache, Event, Explorer, ExplorerOptions, HttpSource, Retrying, strategy::sight::Eye,
};
use tokio::time::{Instant, timeout_at};

/// How far it goes.
const CELLS: usize = 8;
const CACHE_BYTES: u64 = 256 << 20;
const FRAME: Duration = Duration::from_millis(50);
const SPEED_MPS: f64 = 3.0;

#[tokio::main(flavor = "current_thread")]
async fn main() -> ExitCode {
    match stroll().await {
        Ok(()) => ExitCode::SUCCESS,
        Err(cause) => {
            eprintln!("stroll: {cause}");
            ExitCode::FAILURE
        }
    }
}

async fn stroll() -> Result<(), Box<dyn Error>> {
    let mut arguments = env::args().skip(1);
    let (Some(address), Some(name)) = (arguments.next(), arguments.next()) else {
        return Err("usage: stroll ADDRESS SCENE".into());
    };
    let source = DiskCache::open("stroll-cache", CACHE_BYTES, Retrying::new(HttpSource::new(&address)?))?;
    let scene = Client::new(source).open(&name.parse()?).await?;
    let viewpoint = scene.pointer().viewpoints.first().ok_or("the scene has no viewpoint")?;
    let mut eye = Eye::at(viewpoint.position);
    // What fails now is not waited for: it is only a stroll.
    let options = ExplorerOptions {
        recovers: false,
        ..ExplorerOptions::default()
    };
    let mut explorer = Explorer::new(scene, options);
    explorer.follow(eye).await;
    let mut seen = Seen::default();
    while let Some(events) = explorer.advance().await {
        seen.note(&explorer, events);
    }
    seen.tell(&explorer);

    let mut cell = explorer.scene().locate(eye.position).await?.cell;
    let mut been = HashSet::from([cell.cell]);
    while been.len() < CELLS
        && let Some(next) = cell.adjacent.iter().find(|cell| !been.contains(cell))
    {
        let next = explorer.scene().cell(*next).await?;
        cell = next.ok_or("an adjacent cell is missing")?;
        been.insert(cell.cell);
        walk(&mut explorer, &mut eye, cell.bounds.center(), &mut seen).await;
        seen.tell(&explorer);
    }
    if !explorer.scene().is_current().await? {
        println!("the scene was published anew meanwhile: open it again to see it");
    }
    Ok(())
}

/// Goes straight to a point, and looks from frame to frame what has come.
async fn walk<S: ByteSource + 'static>(explorer: &mut Explorer<S>, eye: &mut Eye, to: [f64; 3], seen: &mut Seen) {
    let from = eye.position;
    let distance_m = (0..3).map(|i| (to[i] - from[i]).powi(2)).sum::<f64>().sqrt();
    let frames = (distance_m / (SPEED_MPS * FRAME.as_secs_f64())).ceil().max(1.0);
    let begun = Instant::now();
    for frame in 1..=frames as u32 {
        let share = f64::from(frame) / frames;
        eye.position = std::array::from_fn(|i| from[i] + share * (to[i] - from[i]));
        explorer.follow(*eye).await;
        let next = begun + FRAME * frame;
        while let Ok(Some(events)) = timeout_at(next, explorer.advance()).await {
            seen.note(explorer, events);
        }
        tokio::time::sleep_until(next).await;
    }
}

/// What has happened since it was told last.
#[derive(Default)]
struct Seen {
    drawn: usize,
    first: Option<String>,
}

impl Seen {
    fn note<S: ByteSource + 'static>(&mut self, explorer: &Explorer<S>, events: Vec<Event>) {
        for event in events {
            match event {
                Event::Entered(cell) => {
                    let (visible, missing) = (explorer.visible().len(), explorer.missing().unwrap_or_default());
                    println!("{cell}: {visible} objects in sight, of which {missing} are still missing");
                }
                Event::Drawn { why, .. } => {
                    self.drawn += 1;
                    self.first.get_or_insert(why);
                }
                Event::Problem(cause) => println!("  goes on without: {cause}"),
                Event::Blunted(_) | Event::Dropped(_) => {}
            }
        }
    }

    fn tell<S: ByteSource + 'static>(&mut self, explorer: &Explorer<S>) {
        let Self { drawn, first } = std::mem::take(self);
        let (progress, held) = (explorer.progress(), explorer.memory_bytes());
        println!("  {drawn} meshes came, {progress}, {held} bytes held");
        if let Some(why) = first {
            println!("  first: {why}");
        }
    }
}
