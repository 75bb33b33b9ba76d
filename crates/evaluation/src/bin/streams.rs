//! `make streams`: event streams beside nchan, as tables.

use std::{path::PathBuf, time::Duration};

use anyhow::Context;
use belvedere_evaluation::streams::{
    process::most_files,
    readers::Readers,
    runs::{EACH_BOOTH, Load, Outcome, deliver, idle},
    servers::{self, Kind, Server},
    table::{Column, markdown, median},
};
use clap::{Parser, ValueEnum};

/// Events of the runs with one message in flight, about.
const EVENTS: usize = 100_000;
/// Events a second of the runs at a rate.
const EVENTS_PER_S: f64 = 15_000.0;
/// Poses of a message in which updates are merged.
const MANY: usize = 20;
/// Poses of an event of 4 kB.
const OF_4_KB: usize = 29;

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Part {
    /// One message in flight
    Flight,
    /// 15,000 events a second
    Rate,
    /// 20 updates in each message, one in flight
    Merged,
    /// 20 movers at 10 Hz
    Ticks,
    /// A quarter of the readers stalled
    Stalled,
    /// Memory of idle streams
    Idle,
}

#[derive(Debug, Parser)]
#[command(about = "Measures event streams beside nchan")]
struct Args {
    /// The program, in a release build
    #[arg(long)]
    belvedere: PathBuf,
    /// Where the world is baked, once
    #[arg(long)]
    work: Option<PathBuf>,
    /// Only these
    #[arg(long, value_delimiter = ',', value_enum)]
    only: Vec<Part>,
    /// Numbers of readers
    #[arg(long, value_delimiter = ',', default_values_t = [500, 2_000, 5_000])]
    readers: Vec<usize>,
    /// How many streams are idle
    #[arg(long, default_value_t = 20_000)]
    idle: usize,
    /// How often each is run
    #[arg(long, default_value_t = 3)]
    rounds: usize,
    /// The shortest tick that is measured
    #[arg(long, default_value_t = 1)]
    tick_ms: u64,
}

struct Bench {
    args: Args,
    data: PathBuf,
    nchan: bool,
}

#[allow(clippy::print_stdout, reason = "a tool of the command line")]
fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    let work = args
        .work
        .clone()
        .unwrap_or_else(|| std::env::temp_dir().join("belvedere-streams"));
    let bench = Bench {
        data: work.join("data"),
        nchan: servers::has_nchan(),
        args,
    };
    servers::bake(&bench.args.belvedere, &bench.data)?;
    if !bench.nchan {
        println!("nginx with nchan is not here (Debian: libnginx-mod-nchan); nothing is compared.\n");
    }
    let parts = if bench.args.only.is_empty() {
        Part::value_variants()
    } else {
        &bench.args.only
    };
    for part in parts {
        match part {
            Part::Flight => bench.flight(1)?,
            Part::Merged => bench.flight(MANY)?,
            Part::Rate => bench.rate()?,
            Part::Ticks => bench.ticks()?,
            Part::Stalled => bench.stalled()?,
            Part::Idle => bench.idle()?,
        }
    }
    Ok(())
}

#[allow(clippy::print_stdout, reason = "a tool of the command line")]
impl Bench {
    fn ours(&self, tick_ms: u64) -> Kind {
        Kind::Belvedere {
            binary: self.args.belvedere.clone(),
            data: self.data.clone(),
            tick_ms,
        }
    }

    /// Ours with these ticks, and nchan last.
    fn kinds(&self, ticks_ms: &[u64]) -> Vec<Kind> {
        let ours = ticks_ms.iter().map(|tick_ms| self.ours(*tick_ms));
        ours.chain(self.nchan.then_some(Kind::Nchan)).collect()
    }

    /// Runs loads in turns, each with a fresh server.
    fn compare(&self, runs: &[(Kind, usize, usize, Load)]) -> anyhow::Result<()> {
        let column = |(kind, readers, stalled, load): &(Kind, usize, usize, Load)| Column {
            name: kind.name(),
            what: what(*readers, *stalled, load),
            updates: load.poses,
            runs: Vec::new(),
        };
        let mut columns: Vec<_> = runs.iter().map(column).collect();
        for round in 0..self.args.rounds {
            for at in 0..runs.len() {
                let at = (at + round) % runs.len();
                let (kind, readers, stalled, load) = &runs[at];
                let outcome = run(kind, *readers, *stalled, *load);
                columns[at].runs.push(outcome.with_context(|| kind.name())?);
            }
        }
        println!("{}", markdown(&columns));
        Ok(())
    }

    fn flight(&self, poses: usize) -> anyhow::Result<()> {
        println!("### One message of {poses} poses in flight: the next is published when all have heard it\n");
        for readers in self.args.readers.clone() {
            let load = |poses| Load {
                poses,
                messages: (EVENTS / readers).max(20) as u32,
                every: None,
            };
            let kinds = self.kinds(&[self.args.tick_ms]).into_iter();
            // What nchan is compared by is its messages.
            let runs = kinds.map(|kind| {
                let load = load(if matches!(kind, Kind::Nchan) { 1 } else { poses });
                (kind, readers, 0, load)
            });
            self.compare(&runs.collect::<Vec<_>>())?;
        }
        Ok(())
    }

    fn rate(&self) -> anyhow::Result<()> {
        println!("### Messages at a rate that makes {EVENTS_PER_S} events a second\n");
        for readers in self.args.readers.clone() {
            let every = Duration::from_secs_f64(readers as f64 / EVENTS_PER_S);
            let load = Load {
                poses: 1,
                messages: (4.0 / every.as_secs_f64()) as u32,
                every: Some(every),
            };
            let kinds = self.kinds(&[self.args.tick_ms, 10]).into_iter();
            self.compare(&kinds.map(|kind| (kind, readers, 0, load)).collect::<Vec<_>>())?;
        }
        Ok(())
    }

    fn ticks(&self) -> anyhow::Result<()> {
        println!("### {MANY} movers in sight of everybody, 10 poses a second of each, ticks of 100 ms\n");
        let load = Load {
            poses: MANY,
            messages: 50,
            every: Some(Duration::from_millis(100)),
        };
        let numbers = self.args.readers.iter().flat_map(|readers| [*readers, readers / 2]);
        for readers in numbers.collect::<Vec<_>>() {
            let kinds = self.kinds(&[100]).into_iter();
            self.compare(&kinds.map(|kind| (kind, readers, 0, load)).collect::<Vec<_>>())?;
        }
        Ok(())
    }

    fn stalled(&self) -> anyhow::Result<()> {
        println!("### A quarter of 200 readers stalled, 3,000 messages of 4 kB, one in flight\n");
        let load = Load {
            poses: OF_4_KB,
            messages: 3_000,
            every: None,
        };
        for kind in self.kinds(&[self.args.tick_ms]) {
            self.compare(&[(kind.clone(), 200, 50, load), (kind, 150, 0, load)])?;
        }
        Ok(())
    }

    fn idle(&self) -> anyhow::Result<()> {
        // Some files are open besides.
        let most = most_files().saturating_sub(EACH_BOOTH + 300);
        for count in [2_000, self.args.idle.min(most)] {
            let each = |kind: &Kind| -> anyhow::Result<f64> {
                let runs = (0..self.args.rounds).map(|_| idle(&Server::start(kind, count + EACH_BOOTH, 0)?, count));
                Ok(median(runs.collect::<anyhow::Result<Vec<_>>>()?.into_iter()))
            };
            for kind in self.kinds(&[100]) {
                println!(
                    "{count} idle streams of {}: {:.1} kB each\n",
                    kind.name(),
                    each(&kind)? * 1e-3
                );
            }
        }
        Ok(())
    }
}

fn run(kind: &Kind, readers: usize, stalled: usize, load: Load) -> anyhow::Result<Outcome> {
    let server = Server::start(kind, readers, load.poses)?;
    let mut readers = Readers::open(&server, readers, stalled, true)?;
    deliver(&server, &mut readers, load)
}

fn what(readers: usize, stalled: usize, load: &Load) -> String {
    let pace = load.every.map_or_else(
        || "one in flight".to_owned(),
        |every| format!("{:.0} a second", 1.0 / every.as_secs_f64()),
    );
    let stalled = if stalled > 0 {
        format!(", {stalled} of them stalled")
    } else {
        String::new()
    };
    format!("{pace}, {} poses each, to {readers} readers{stalled}", load.poses)
}
