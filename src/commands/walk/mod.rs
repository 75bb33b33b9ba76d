//! `belvedere walk URL --scene S`: what do visitors get to see while the bytes are still coming? A test of a deployment, and
//! of a scene before it is deployed.

mod chart;
mod live;
mod losses;
mod machine;
mod quantity;
mod strides;

use std::{path::PathBuf, sync::Arc};

use anyhow::Context;
use belvedere_client::{
    ByteSource, Client, Error, FolderSource, HttpSource, Pulse, Retrying,
    tour::{self, Line, Manner, Outcome, Rambles, Script, Tour, TourSettings},
};
use belvedere_scene::{Revision, SceneName};
use losses::Counted;
use machine::Machine;
use strides::Strides;

use super::output::{bytes, percent, print, print_json, table};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A server or CDN, or a folder that `belvedere publish` wrote
    #[arg(value_name = "URL|DIR")]
    tree: String,
    /// The scene
    #[arg(long)]
    scene: SceneName,
    /// The way: JSON lines {"t_ms": 0, "position": [x, y, z]}, as the viewer records them; by default a made-up way
    #[arg(long)]
    script: Option<PathBuf>,
    /// A made-up way: at random from cell to cell, or a tour that visits as many cells as it can, streets before houses
    #[arg(long, value_enum, default_value_t, conflicts_with = "script")]
    way: MadeUp,
    /// Bandwidth of each visitor's simulated line, in bits a second: 128k, 5M; by default without limit
    #[arg(long, value_parser = quantity::bits_per_s, allow_hyphen_values = true)]
    bandwidth: Option<f64>,
    /// Time from a request to its answer on that line: 50ms, 0.2s
    #[arg(long, value_parser = quantity::milliseconds, allow_hyphen_values = true, default_value = "0ms")]
    latency: f64,
    /// Walk at this speed: 3km/h, 1.5m/s; by default as the script says, or 5km/h
    #[arg(long, value_parser = quantity::metres_per_s, allow_hyphen_values = true)]
    speed: Option<f64>,
    /// Whether what lies ahead is fetched before it is seen
    #[arg(long, value_enum, default_value_t = Switch::On)]
    prefetch: Switch,
    /// Whether smooth LODs are used where they cost less than levels
    #[arg(long, value_enum, default_value_t = Switch::On)]
    smooth: Switch,
    /// Whether models are grown from rules where that costs less than levels
    #[arg(long, value_enum, default_value_t = Switch::On)]
    rules: Switch,
    /// Whether small files come together where the server offers that
    #[arg(long, value_enum, default_value_t = Switch::On)]
    bundles: Switch,
    /// Memory of each visitor for what it has fetched: 64M, 500k; by default without limit
    #[arg(long, value_parser = quantity::bytes, allow_hyphen_values = true)]
    memory: Option<u64>,
    /// Visitors at once; made-up walks differ, and of a script each starts a second later
    #[arg(long, default_value_t = 1, value_parser = quantity::sessions, allow_hyphen_values = true)]
    sessions: u32,
    /// How long a made-up walk takes, in seconds of its own time
    #[arg(long, default_value_t = 120.0, value_parser = quantity::seconds, allow_hyphen_values = true)]
    duration: f64,
    /// Made-up walks of another number are other walks
    #[arg(long, default_value_t = 1, value_parser = quantity::seed, allow_hyphen_values = true)]
    seed: u64,
    /// Whether each visitor also opens a live session: then all walk their ways once more, in real time, and meet each other
    #[arg(long, value_enum, default_value_t = Switch::Off)]
    live: Switch,
    /// Fail when the mean download quality after convergence is lower: 95%
    #[arg(long, value_parser = quantity::share, allow_hyphen_values = true)]
    min_quality: Option<f64>,
    /// Draw quality and bytes of the first visitor over time
    #[arg(long, value_name = "SVG")]
    plot: Option<PathBuf>,
    /// Write the first visitor's way as a script
    #[arg(long, value_name = "FILE")]
    save_script: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

/// How a made-up way goes.
#[derive(Debug, Clone, Copy, Default, clap::ValueEnum)]
enum MadeUp {
    #[default]
    Random,
    Streets,
}

/// Whether something is done.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Switch {
    On,
    Off,
}

impl Switch {
    fn is_on(self) -> bool {
        matches!(self, Self::On)
    }
}

/// Made-up walks are as fast as people, in metres a second.
const WALKING_MPS: f64 = 5.0 / 3.6;
/// So many requests of all visitors are under way at once: enough to keep a server busy, and few enough that they do not wait for each other.
const MOST_REQUESTS: usize = 64;
/// So many scenes are named to who asks for another.
const NAMED_SCENES: usize = 20;
/// No walk takes longer, in seconds.
const LONGEST_S: f64 = quantity::DAY_S;

pub(super) async fn run(args: Args) -> anyhow::Result<()> {
    if args.tree.contains("://") {
        let source = HttpSource::new(&args.tree)?;
        let live = args.live.is_on().then(|| source.clone());
        let source = Retrying::new(source).at_most(MOST_REQUESTS);
        let pulse = source.pulse();
        let source = Counted::new(source);
        tokio::select! {
            walked = walk(args, source.clone(), live, Some(pulse.clone())) => walked,
            () = source.tell() => Ok(()),
            () = pulse.beat() => Ok(()),
        }
    } else {
        anyhow::ensure!(
            std::path::Path::new(&args.tree).is_dir(),
            "`{}` is neither an address, like http://127.0.0.1:8080, nor a folder",
            args.tree
        );
        anyhow::ensure!(
            !args.live.is_on(),
            "a folder has no live sessions: name the address of a server, or walk without --live on"
        );
        let source = FolderSource::new(&args.tree);
        walk(args, source, None, None).await
    }
}

/// Walks through what a source has, and through what is live there where that is wanted. The pulse tells how busy this machine is.
async fn walk<S: ByteSource + Clone + 'static>(
    args: Args,
    source: S,
    live_source: Option<HttpSource>,
    pulse: Option<Arc<Pulse>>,
) -> anyhow::Result<()> {
    if let Some(live_source) = &live_source {
        live::ensure_offered(live_source, &args.scene, args.sessions as usize).await?;
    }
    let settings = TourSettings {
        line: Line {
            bits_per_s: args.bandwidth.unwrap_or(f64::INFINITY),
            latency_ms: args.latency,
        },
        prefetch: args.prefetch.is_on(),
        smooth: args.smooth.is_on(),
        rules: args.rules.is_on(),
        bundles: args.bundles.is_on(),
        memory_bytes: args.memory.unwrap_or(u64::MAX),
        ..TourSettings::default()
    };
    let scripts = scripts(&args, &source).await?;
    if let Some(file) = &args.save_script {
        std::fs::write(file, scripts[0].to_text()).with_context(|| format!("cannot write {}", file.display()))?;
    }
    let frames = scripts.iter().map(|script| tour::frames(script, &settings));
    let strides = Arc::new(Strides::new(frames.sum(), args.json)?);
    let telling = Arc::clone(&strides);
    let telling = tokio::spawn(async move { telling.tell().await });
    let visitors = scripts.iter().map(|script| {
        let (source, scene, script) = (source.clone(), args.scene.clone(), script.clone());
        let strides = Arc::clone(&strides);
        tokio::spawn(async move { tour::walk(source, &scene, &script, &settings, || strides.step()).await })
    });
    let visitors: Vec<_> = visitors.collect();
    let mut tours: Vec<Tour> = Vec::with_capacity(visitors.len());
    for visitor in visitors {
        match visitor.await? {
            Ok(tour) => tours.push(tour),
            Err(cause) => return Err(cannot_open(&args, &source, cause).await),
        }
    }
    telling.abort();
    strides.end();
    if let Some(file) = &args.plot {
        std::fs::write(file, chart::draw(&chart::title(&args.scene, &settings.line), &tours[0]))
            .with_context(|| format!("cannot write {}", file.display()))?;
    }
    let live = match &live_source {
        Some(live_source) => Some(live::meet(live_source, &args.scene, &scripts).await?),
        None => None,
    };
    let report = Report {
        outcome: Outcome::of(&tours),
        machine: pulse.map(|pulse| Machine::of(&pulse.lateness())),
        live,
    };
    let short = args
        .memory
        .and_then(|limit_bytes| short_of_memory(&report.outcome, limit_bytes));
    if let Some(short) = &short {
        eprintln!("belvedere: {short}");
    }
    if let Some(busy) = report.machine.as_ref().and_then(Machine::warning) {
        eprintln!("belvedere: {busy}");
    }
    if args.json {
        print_json(&report)?;
    } else {
        print(&summary(&report))?;
    }
    if let Some(live) = &report.live {
        live.ensure_inside()?;
    }
    let outcome = &report.outcome;
    if let Some(least) = args.min_quality {
        anyhow::ensure!(
            outcome.memory.missing == 0,
            "memory does not suffice, so things are missing, {} of them summed over frames: {} was asked for",
            outcome.memory.missing,
            exact(least)
        );
        anyhow::ensure!(
            outcome.convergence_s.is_some(),
            "not every visitor ever had all that was in sight: {} was asked for",
            exact(least)
        );
        let mean = outcome.quality.mean.with_context(|| {
            format!(
                "no frame was looked at after that, so nobody knows whether visitors have {}; give a --script or a longer --duration",
                exact(least)
            )
        })?;
        anyhow::ensure!(
            mean >= least,
            "the mean download quality is {}, less than {}",
            exact(mean),
            exact(least)
        );
    }
    Ok(())
}

/// Where memory did not even hold the coarsest of a cell and its neighbours: what would.
fn short_of_memory(outcome: &Outcome, limit_bytes: u64) -> Option<String> {
    let memory = &outcome.memory;
    let cell = memory.needed_in.filter(|_| memory.short_cells > 0)?;
    Some(format!(
        "--memory {limit_bytes} ({}) is less than the coarsest levels of {cell} and its neighbours take, where no rules stand in for \
         them; give at least {} ({})",
        bytes(limit_bytes),
        memory.needed_bytes,
        bytes(memory.needed_bytes)
    ))
}

/// What a walk begins with, and may fail at. Where there is no such scene, those that are there are named.
async fn cannot_open<S: ByteSource + Clone>(args: &Args, source: &S, cause: Error) -> anyhow::Error {
    let Args { scene, tree, .. } = args;
    let what = format!("cannot open `{scene}` of {tree}");
    if !matches!(cause, Error::Missing(_)) {
        return anyhow::Error::new(cause).context(what);
    }
    let there = match Client::new(source.clone()).scenes().await {
        Ok(list) if list.scenes.is_empty() => "the list of scenes there is empty".to_owned(),
        Ok(list) => {
            let names = list.scenes.iter().take(NAMED_SCENES).map(|one| one.scene.to_string());
            let names = names.collect::<Vec<_>>().join(", ");
            match list.scenes.len().saturating_sub(NAMED_SCENES) {
                0 => format!("there are: {names}"),
                more => format!("there are: {names}, and {more} more"),
            }
        }
        Err(_) => {
            format!("nor is there a list of scenes, /v1/scenes/index.json; is {tree} the root of a published tree?")
        }
    };
    anyhow::anyhow!("{cause}; {there}").context(what)
}

/// The way of each visitor.
async fn scripts<S: ByteSource + Clone>(args: &Args, source: &S) -> anyhow::Result<Vec<Script>> {
    if let Some(file) = &args.script {
        let shown = file.display();
        let text = std::fs::read_to_string(file).with_context(|| format!("cannot read {shown}"))?;
        let script = Script::parse(&text).with_context(|| format!("{shown} is no script"))?;
        let script = args
            .speed
            .map_or(script.clone(), |speed_mps| script.at_speed(speed_mps));
        let [from_ms, to_ms] = script.times_ms();
        anyhow::ensure!(
            to_ms - from_ms <= 1000.0 * LONGEST_S,
            "{shown} takes {:.0} s at this speed; a walk takes at most {LONGEST_S}, a day",
            (to_ms - from_ms) / 1000.0
        );
        return Ok((0..args.sessions)
            .map(|number| script.later(f64::from(number) * 1000.0))
            .collect());
    }
    let scene = match Client::new(source.clone()).open(&args.scene).await {
        Ok(scene) => scene.giving_up(),
        Err(cause) => return Err(cannot_open(args, source, cause).await),
    };
    let speed_mps = args.speed.unwrap_or(WALKING_MPS);
    let manner = match args.way {
        MadeUp::Random => Manner::Wander,
        MadeUp::Streets => Manner::StreetTour,
    };
    let mut rambles = Rambles::through(&scene, speed_mps, args.duration);
    let mut scripts = Vec::with_capacity(args.sessions as usize);
    for number in 0..u64::from(args.sessions) {
        match rambles.script(manner, args.seed.wrapping_add(number << 32)).await {
            Ok(script) => scripts.push(script),
            Err(cause) => {
                // What is gone may be gone because something else took its place.
                let newer = scene.newer_revision().await.unwrap_or_default();
                return Err(cause).context(no_way(newer));
            }
        }
    }
    Ok(scripts)
}

fn no_way(newer: Option<Revision>) -> String {
    let unknown = "the cells of the scene cannot be read, and without them no way can be made up";
    match newer {
        Some(revision) => format!("{unknown}: it was published anew meanwhile, as revision {revision}; walk again"),
        None => format!("{unknown}; give one with --script"),
    }
}

/// What is printed.
#[derive(Debug, serde::Serialize)]
struct Report {
    #[serde(flatten)]
    outcome: Outcome,
    #[serde(skip_serializing_if = "Option::is_none")]
    machine: Option<Machine>,
    #[serde(skip_serializing_if = "Option::is_none")]
    live: Option<live::Live>,
}

fn summary(Report { outcome, live, .. }: &Report) -> String {
    let row = |name: &str, value: String| vec![name.to_owned(), value];
    let causes = &outcome.bytes;
    let converged = outcome.convergence_s.map_or_else(
        || "never, for some".to_owned(),
        |seconds| format!("after {seconds:.1} s"),
    );
    let quality = &outcome.quality;
    let shown = |share: Option<f64>| share.map_or_else(|| "no frame".to_owned(), percent);
    let mut rows = vec![
        row("visitors, frames", format!("{}, {}", outcome.sessions, outcome.frames)),
        row("all in sight, first", converged),
        row("download quality since, mean", shown(quality.mean)),
        row(
            "  … the worst of twenty, and of all frames",
            format!("{}, {}", shown(quality.p5), shown(quality.min)),
        ),
        row(
            "as sharp as the eye can tell; drawn by smooth LODs",
            format!("{}; {}", shown(outcome.sharp), shown(outcome.drawn_by_rungs)),
        ),
        row(
            "objects in sight without any level, summed over frames",
            outcome.holes.to_string(),
        ),
        row("bytes that were needed", bytes(causes.needed)),
        row("  … fetched ahead and seen", bytes(causes.prefetched_used)),
        row("  … fetched ahead and never seen", bytes(causes.prefetched_wasted)),
        row("  … that came in vain", bytes(causes.failed)),
        row("requests", outcome.requests.to_string()),
        row("  … for documents, files alone, packs, bundles", {
            let ways = &outcome.came;
            let files = [ways.alone, ways.packs, ways.bundles].map(|way| way.requests);
            let documents = outcome.requests - files.iter().sum::<u64>();
            format!("{documents}, {}, {}, {}", files[0], files[1], files[2])
        }),
        row(
            "most memory of a visitor; a cell and its neighbours take",
            format!(
                "{}; {}",
                bytes(outcome.memory.peak_bytes),
                bytes(outcome.memory.needed_bytes)
            ),
        ),
        row(
            "their real latency, half and 99 of 100 below",
            format!("{:.1} ms, {:.1} ms", outcome.latency_ms.p50, outcome.latency_ms.p99),
        ),
    ];
    if outcome.memory.evicted_bytes > 0 {
        let memory = &outcome.memory;
        rows.push(row(
            "  … went for want of it; was fetched again; was all the time seen from the cell or the next",
            format!(
                "{}; {}; {}",
                bytes(memory.evicted_bytes),
                bytes(memory.again_bytes),
                bytes(memory.cycle_bytes)
            ),
        ));
    }
    if outcome.memory.missing > 0 {
        rows.push(row(
            "  … found no room for, objects in sight summed over frames",
            outcome.memory.missing.to_string(),
        ));
    }
    if outcome.unknown_frames > 0 {
        rows.push(row(
            "frames of which nothing says what is seen",
            outcome.unknown_frames.to_string(),
        ));
    }
    if outcome.lost_files > 0 {
        rows.push(row(
            "files that could not be had or read",
            outcome.lost_files.to_string(),
        ));
    }
    if let Some(revision) = outcome.newer_revision {
        rows.push(row("published anew meanwhile, as revision", revision.to_string()));
    }
    rows.extend(live.iter().flat_map(live::Live::rows));
    let mut text = table(&["", ""], &rows).trim_start_matches('\n').to_owned();
    // Sentences would make a column of the table as wide as they are.
    let causes = live.iter().flat_map(live::Live::first_failures);
    let causes: Vec<_> = outcome.first_failures.iter().chain(causes).collect();
    if !causes.is_empty() {
        text.push_str("\nwent wrong first:\n");
        causes.iter().for_each(|cause| text.push_str(&format!("  {cause}\n")));
    }
    text
}

/// A share with all the digits that were given.
fn exact(share: f64) -> String {
    format!("{} %", (1e8 * share).round() / 1e6)
}

#[cfg(test)]
mod tests {
    use belvedere_scene::CellId;

    use super::*;

    #[test]
    fn who_is_short_of_memory_hears_what_levels_take_without_rules() {
        let mut outcome = Outcome::of(&[]);
        assert_eq!(short_of_memory(&outcome, 1000), None);
        outcome.memory.needed_bytes = 2500;
        outcome.memory.needed_in = Some(CellId(3));
        outcome.memory.short_cells = 1;
        let said = short_of_memory(&outcome, 1000).expect("it is short");
        assert_eq!(
            said,
            "--memory 1000 (1.0 kB) is less than the coarsest levels of c3 and its neighbours take, where no rules stand in for them; \
             give at least 2500 (2.5 kB)"
        );
    }
}
