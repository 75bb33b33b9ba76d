//! `belvedere bake FILE --scene NAME`: import, bake, publish.

use std::{io::Read, path::PathBuf, sync::Arc, time::Duration};

use belvedere_bake::{
    BakeSettings,
    import::Limits,
    lod::{self, LodSettings},
    visibility::{Method, VisibilitySettings},
};
use belvedere_scene::SceneName;
use tokio::task::JoinError;

use super::{
    output::{bytes, counted, percent, print, print_json},
    sowing::{SowingArgs, blamed},
};
use crate::{
    confine::{self, confine, was_short_of_memory},
    db::Claim,
    jobs::{CLAIM, Fault},
    place::{Absent, PlaceArgs},
    progress::{BakeProgress, Show},
    publish::{self, BakeInput, OnFirst, Request, data::DataFolder, report::Report},
};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A glTF 2.0 scene (.glb, .gltf or a .zip of one), a floor plan (.plan) or rules (.dcg)
    file: PathBuf,
    /// The name under which it is published: a-z, 0-9, `-` and `_`
    #[arg(long)]
    scene: SceneName,
    /// Its name for people; by default the source's own
    #[arg(long)]
    title: Option<String>,
    #[command(flatten)]
    place: PlaceArgs,
    /// The most memory that the decoded source may take, in MiB; a source that claims more is refused
    #[arg(long, default_value_t = Limits::default().memory_bytes >> 20,
        value_parser = clap::value_parser!(u64).range(1..=1 << 20))]
    memory_mib: u64,
    #[command(flatten)]
    sowing: SowingArgs,
    /// Bake even when neither the source nor the settings have changed
    #[arg(long)]
    again: bool,
    /// Threads to use, up to 256; by default one for each core
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Option<u16>,
    /// How visible sets are computed: auto, sampled, occluders, portals or conservative
    #[arg(long, default_value_t)]
    visibility: Method,
    /// Who makes levels of detail: octree, quadric, or best: for each level the one whose error is smaller
    #[arg(long, default_value_t)]
    lod: lod::Method,
    /// Make the scene private before anything of it is published: only links and API keys open it
    #[arg(long)]
    private: bool,
    /// Publish a first revision with larger visible sets and without smooth LODs long before, and go on
    #[arg(long)]
    preview: bool,
    /// Print the report as JSON; how far it is goes to standard error
    #[arg(long)]
    json: bool,
    /// The most address space that this process may take, in MiB; beyond it, it is ended
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u64).range(64..=1 << 20))]
    limit_memory_mib: Option<u64>,
    /// How long all cores may be busy with it, in minutes; beyond it, it is ended
    #[arg(long, value_name = "MIN", value_parser = clap::value_parser!(u64).range(1..=1 << 20))]
    limit_minutes: Option<u64>,
    /// Say how far it is and what came of it as one JSON object a line, and stop when standard input closes: how the
    /// server runs bakes of uploads
    #[arg(long, conflicts_with_all = ["json", "preview"])]
    tied: bool,
    /// The job that this is, JOB/WORKER: publish only as long as it is this worker's
    #[arg(long, hide = true, env = CLAIM, hide_env_values = true, requires = "tied")]
    claim: Option<Claim>,
}

impl Args {
    fn show(&self) -> Show {
        if self.tied { Show::Lines } else { Show::Bars }
    }
}

pub(super) async fn run(args: Args) -> anyhow::Result<()> {
    let tied = args.tied;
    let done = bake(args).await;
    if let (Err(cause), true) = (&done, tied) {
        print(&serde_json::json!({"failed": fault(cause)}).to_string())?;
    }
    done
}

/// Whose fault it is.
fn fault(cause: &anyhow::Error) -> Fault {
    match Absent::of(cause) {
        Some(absent) => Fault::Absent(absent),
        None if publish::is_of_the_source(cause) => Fault::Source(super::sentence(cause)),
        None => Fault::Server,
    }
}

async fn bake(args: Args) -> anyhow::Result<()> {
    let limits = confine::Limits {
        memory_bytes: args.limit_memory_mib.map(|mib| mib << 20),
        time: args.limit_minutes.map(|minutes| Duration::from_secs(60 * minutes)),
    };
    if args.tied || limits.memory_bytes.is_some() || limits.time.is_some() {
        confine(&limits)?;
    }
    let progress = Arc::new(BakeProgress::new(args.show()));
    if let Some(threads) = args.threads {
        rayon::ThreadPoolBuilder::new()
            .num_threads(usize::from(threads))
            .build_global()?;
    }
    // Before anything is made for it.
    let input = BakeInput::File(args.file);
    input.find()?;
    let data = DataFolder::open(&args.place).await?;
    if args.private {
        super::private::make_private(data.catalogue(), &args.scene).await?;
    }
    let request = Request {
        scene: args.scene,
        title: args.title,
        input,
        sowing: args.sowing.try_into()?,
        settings: BakeSettings {
            visibility: VisibilitySettings {
                method: args.visibility,
                ..VisibilitySettings::default()
            },
            lod: LodSettings {
                method: args.lod,
                ..LodSettings::default()
            },
            ..BakeSettings::default()
        },
        again: args.again,
        claim: args.claim,
        limits: Limits {
            memory_bytes: args.memory_mib << 20,
            ..Limits::default()
        },
    };
    let quiet = args.json;
    let on_first: OnFirst = Box::new(move |report| {
        if !quiet {
            // Who cannot be told goes without; the bake goes on.
            _ = print(&summary(report));
        }
    });
    stop_on_interrupt(&progress);
    if args.tied {
        stop_when_untied(&progress);
    }
    let baked = publish::bake(&data, request, progress, args.preview.then_some(on_first)).await;
    let report = baked.map_err(|cause| match cause.downcast_ref::<JoinError>() {
        Some(_) if was_short_of_memory(&limits) => cause.context("Cannot allocate memory"),
        _ => blamed(cause),
    })?;
    if args.tied {
        print(&serde_json::json!({"report": report}).to_string())
    } else if args.json {
        print_json(&report)
    } else {
        print(&summary(&report))
    }
}

/// An interrupt stops a bake at its next step: what is not published yet will not be, and what was found is kept.
pub(super) fn stop_on_interrupt(progress: &Arc<BakeProgress>) {
    let progress = progress.clone();
    tokio::spawn(async move {
        if tokio::signal::ctrl_c().await.is_ok() {
            progress.cancel();
        }
    });
}

/// Whoever holds the other end of standard input wants the bake, for as long as it does: when it is killed, the system
/// closes that end.
fn stop_when_untied(progress: &Arc<BakeProgress>) {
    /// How long the step may take that a bake is in when it shall stop.
    const GRACE: Duration = Duration::from_secs(3);
    let progress = progress.clone();
    std::thread::spawn(move || {
        // Nothing is ever said there, only its end counts.
        _ = std::io::stdin().lock().read_to_end(&mut Vec::new());
        progress.cancel();
        std::thread::sleep(GRACE);
        eprintln!("belvedere: cancelled");
        std::process::exit(1);
    });
}

/// The report for a person.
pub(super) fn summary(report: &Report) -> String {
    let size = |name: &str| bytes(report.bytes.get(name).copied().unwrap_or(0));
    let mut lines = Vec::new();
    if report.unchanged {
        lines.push(format!(
            "scene {} is up to date: revision {}",
            report.scene, report.revision
        ));
    } else {
        let seconds: f64 = report.seconds.values().sum();
        lines.push(format!(
            "scene {} published: revision {}, {seconds:.1} s",
            report.scene, report.revision
        ));
    }
    lines.push(format!(
        "  {} of {}, {}; {} source, {} published",
        counted(report.objects as usize, "object"),
        counted(report.models as usize, "model"),
        counted(report.triangles as usize, "triangle"),
        size("source"),
        size("published"),
    ));
    lines.push(format!(
        "  {}; {:.1} objects visible from a cell on average, {} culled ({})",
        counted(report.cells as usize, "view cell"),
        report.visibility.mean_visible,
        percent(report.visibility.mean_culled),
        report.visibility.method,
    ));
    lines.push(format!("  {}: {}", report.visibility.method, report.visibility.reason));
    if report.visibility.remembered_cells > 0 {
        lines.push(format!(
            "  {} of these cells as an earlier bake found them, {} looked from anew",
            report.visibility.remembered_cells,
            report.cells - report.visibility.remembered_cells,
        ));
    }
    lines.push(format!(
        "  coarsest levels {}, finest {}, smooth LODs {}",
        size("coarsest"),
        size("level0"),
        size("smooth")
    ));
    let records = &report.records;
    lines.push(format!(
        "  a cell record has {:.1} B on average, {:.1} of them its set; a step to the next cell {:.1} B, {:.1} of them the \
         change of the set",
        records.mean_record, records.mean_record_set, records.mean_step, records.mean_step_set,
    ));
    let packs = &report.packs;
    lines.push(format!(
        "  {} of {} in {}: with nothing in hand a cell takes {:.1} requests for them on average, \
         coming from next door {:.1}; {} of the bytes are of what it does not see",
        packs.files,
        counted(report.models as usize, "coarsest level"),
        counted(packs.packs as usize, "pack"),
        packs.requests_per_cell,
        packs.requests_per_crossing,
        percent(packs.wasted_share),
    ));
    lines.extend(report.growable.sentence().map(|told| format!("  {told}")));
    if report.whole {
        lines.push("  a small world: the manifest lists every object, and clients load all of them".to_owned());
    }
    for defect in &report.defects {
        let places = match &defect.others[..] {
            [] => format!("first: {}", defect.first),
            others => format!("{}, {}", defect.first, others.join(", ")),
        };
        lines.push(format!("  {} × {} ({places})", defect.count, defect.kind));
    }
    lines.extend(report.notes.iter().map(|note| format!("  {note}")));
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use belvedere_bake::import::ImportError;

    use super::*;

    #[test]
    fn a_bake_that_was_stopped_while_it_read_says_nothing_of_its_source() {
        let stopped = anyhow::Error::from(ImportError::Cancelled).context("cannot import town.glb");
        assert!(matches!(fault(&stopped), Fault::Server));
    }
}
