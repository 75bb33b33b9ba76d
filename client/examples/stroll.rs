//! A stroll through a published scene: `cargo run -p belvedere-client --example stroll -- http://127.0.0.1:8080 museum`.
//!
//! Stands at the first viewpoint until all that can be seen from there is sharp, then walks for a minute, as people do, from opening to
//! opening, while what lies ahead is fetched before it is seen. It says of each cell what was there already when it was entered, and
//! what came since and why. What was fetched once is kept below `stroll-cache`: so the second stroll costs few bytes.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "that is what it is for")]

use std::{env, error::Error, process::ExitCode, time::Duration};

use belvedere_client::{
    ByteSource, Client, DiskCache, Event, Explorer, ExplorerOptions, HttpSource, Retrying,
    strategy::sight::Eye,
    tour::{Manner, Rambles},
};
use tokio::time::{Instant, sleep_until, timeout_at};

const CACHE_BYTES: u64 = 256 << 20;
const FRAME: Duration = Duration::from_millis(50);
const SPEED_MPS: f64 = 1.4;
const DURATION_S: f64 = 60.0;

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
    let name = name.parse()?;
    let source = DiskCache::open("stroll-cache", CACHE_BYTES, Retrying::new(HttpSource::new(&address)?))?;
    let client = Client::new(source);
    // The way is made up in a scene of its own: it tells the walker nothing.
    let map = client.open(&name).await?.giving_up();
    if map.pointer().viewpoints.is_empty() {
        return Err("the scene has no viewpoint".into());
    }
    let mut rambles = Rambles::through(&map, SPEED_MPS, DURATION_S);
    let way = rambles.script(Manner::Wander, 1).await?;

    // What fails now is not waited for: it is only a stroll.
    let options = ExplorerOptions {
        recovers: false,
        ..ExplorerOptions::default()
    };
    let mut explorer = Explorer::new(client.open(&name).await?, options);
    let mut seen = Seen::default();
    explorer.follow(Eye::at(way.at(0.0))).await;
    while let Some(events) = explorer.advance().await {
        seen.note(&explorer, events);
    }
    let begun = Instant::now();
    let [_, end_ms] = way.times_ms();
    let end = begun + Duration::from_secs_f64(end_ms / 1000.0);
    let mut next = begun;
    while next < end {
        next += FRAME;
        let t_ms = 1000.0 * begun.elapsed().as_secs_f64();
        explorer.follow(Eye::at(way.at(t_ms))).await;
        while let Ok(Some(events)) = timeout_at(next, explorer.advance()).await {
            seen.note(&explorer, events);
        }
        sleep_until(next).await;
    }
    seen.tell();
    println!("{}, {} bytes held", explorer.progress(), explorer.memory_bytes());
    if !map.is_current().await? {
        println!("the scene was published anew meanwhile: open it again to see it");
    }
    Ok(())
}

/// The meshes that have come since a cell was entered.
#[derive(Default)]
struct Seen {
    meshes: usize,
    first: Option<String>,
    ahead: usize,
    first_ahead: Option<String>,
}

impl Seen {
    fn note<S: ByteSource + 'static>(&mut self, explorer: &Explorer<S>, events: Vec<Event>) {
        for event in events {
            match event {
                Event::Entered(cell) => {
                    self.tell();
                    let (visible, missing) = (explorer.visible().len(), explorer.missing().unwrap_or_default());
                    let progress = explorer.progress();
                    println!("{cell}: {visible} objects in sight, of which {missing} are still missing; {progress}");
                }
                // What lies ahead is held before anybody sees it.
                Event::Drawn { why, .. } if why.starts_with("seen from") => {
                    self.ahead += 1;
                    self.first_ahead.get_or_insert(why);
                }
                Event::Drawn { why, .. } => {
                    self.meshes += 1;
                    self.first.get_or_insert(why);
                }
                Event::Problem(cause) => println!("  goes on without: {cause}"),
                Event::Superseded(revision) => println!("  the scene was published anew, as revision {revision}"),
                Event::Blunted(_) | Event::Dropped(_) => {}
            }
        }
    }

    fn tell(&mut self) {
        let seen = std::mem::take(self);
        for (meshes, what, first) in [
            (seen.meshes, "for what is in sight", seen.first),
            (seen.ahead, "ahead", seen.first_ahead),
        ] {
            if let Some(first) = first {
                println!("  {meshes} came {what}, first: {first}");
            }
        }
    }
}
