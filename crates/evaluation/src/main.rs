//! `make evaluation`: runs experiments and writes `docs/EVALUATION.md`.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
    process::Command,
    time::{Duration, Instant},
};

use anyhow::Context;
use belvedere_evaluation::{
    document::{self, FOLDER},
    experiments::ALL,
    host::Host,
    results::{self, Kept},
};
use clap::Parser;

#[derive(Debug, Parser)]
#[command(about = "Measures what the papers measured and writes docs/EVALUATION.md")]
struct Args {
    /// Run only these, separated by commas; the others keep their results
    #[arg(long, value_delimiter = ',', value_name = "ID")]
    only: Vec<String>,
    /// Run nothing: render the page from the results that are there
    #[arg(long, conflicts_with = "only")]
    render: bool,
    /// Name the experiments and run nothing
    #[arg(long)]
    list: bool,
    /// The folder of the page
    #[arg(long, default_value_os_t = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs"))]
    docs: PathBuf,
    /// The program; by default the one that was built beside this one
    #[arg(long)]
    belvedere: Option<PathBuf>,
    /// The folder in which worlds are baked and kept from run to run; by default beside the program
    #[arg(long)]
    work: Option<PathBuf>,
    /// A data folder that holds a baked scene `town`; without it the town is baked
    #[arg(long, value_name = "DIR")]
    town_data: Option<PathBuf>,
    /// Minutes that the bake of the town may take; then its first revision is walked through. 0: a generated city instead
    #[arg(long, default_value_t = 90)]
    town_minutes: u64,
}

#[allow(clippy::print_stderr, clippy::print_stdout, reason = "a tool of the command line")]
fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    if args.list {
        for experiment in &ALL {
            println!(
                "{:10} {}: {}",
                experiment.id,
                experiment.title,
                experiment.repeats.join(", ")
            );
        }
        return Ok(());
    }
    let known: BTreeSet<_> = ALL.iter().map(|experiment| experiment.id).collect();
    if let Some(unknown) = args.only.iter().find(|id| !known.contains(id.as_str())) {
        let known: Vec<_> = ALL.iter().map(|experiment| experiment.id).collect();
        anyhow::bail!("there is no experiment `{unknown}`; there are {}", known.join(", "));
    }
    let folder = args.docs.join(FOLDER);
    let mut failed = Vec::new();
    if !args.render {
        let host = host(&args)?;
        for experiment in &ALL {
            if !args.only.is_empty() && !args.only.iter().any(|id| id == experiment.id) {
                continue;
            }
            eprintln!("{}: {}", experiment.id, experiment.title);
            // Whoever edits while it runs does not change what is measured.
            let (sources, started) = (sources(), Instant::now());
            match (experiment.run)(&host) {
                Ok(measured) => Kept {
                    experiment: experiment.id.to_owned(),
                    sources,
                    build: if cfg!(debug_assertions) {
                        "development"
                    } else {
                        "release"
                    }
                    .to_owned(),
                    cores: std::thread::available_parallelism().map_or(1, usize::from),
                    seconds: started.elapsed().as_secs_f64(),
                    measured,
                }
                .write(&folder)?,
                Err(cause) => {
                    eprintln!("  failed, what was measured before is kept: {cause:#}");
                    failed.push(experiment.id);
                }
            }
        }
    }
    let document = document::render(&results::read_all(&folder)?)?;
    fs::create_dir_all(&folder)?;
    for plot in &document.plots {
        fs::write(folder.join(&plot.file), &plot.svg)?;
    }
    let page = args.docs.join("EVALUATION.md");
    fs::write(&page, document.markdown).with_context(|| format!("cannot write {}", page.display()))?;
    eprintln!("{} is written", page.display());
    anyhow::ensure!(failed.is_empty(), "failed: {}", failed.join(", "));
    Ok(())
}

fn host(args: &Args) -> anyhow::Result<Host> {
    let beside = std::env::current_exe()?
        .parent()
        .context("a program stands in a folder")?
        .to_owned();
    let belvedere = args.belvedere.clone().unwrap_or_else(|| beside.join("belvedere"));
    anyhow::ensure!(
        belvedere.is_file(),
        "{} is not there: build it (`cargo build`), or name it with --belvedere",
        belvedere.display()
    );
    let work = args.work.clone().unwrap_or_else(|| beside.join("evaluation"));
    fs::create_dir_all(&work).with_context(|| format!("cannot make {}", work.display()))?;
    Ok(Host {
        belvedere,
        work,
        town_data: args.town_data.clone(),
        town_budget: Duration::from_secs(60 * args.town_minutes),
    })
}

/// What is measured, as git names it: the revision, and whether anything but documents differs from it.
fn sources() -> String {
    let git = |args: &[&str]| {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let output = Command::new("git").args(args).current_dir(folder).output().ok()?;
        let text = String::from_utf8(output.stdout).ok()?;
        output.status.success().then(|| text.trim().to_owned())
    };
    let changed = git(&[
        "status",
        "--porcelain",
        "--untracked-files=no",
        "--",
        ".",
        ":!docs",
        ":!*.md",
    ]);
    match (git(&["rev-parse", "--short", "HEAD"]), changed) {
        (Some(revision), Some(changed)) if changed.is_empty() => revision,
        (Some(revision), _) => format!("{revision} with changes"),
        (None, _) => "unknown sources".to_owned(),
    }
}
