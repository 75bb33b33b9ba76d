//! `belvedere verify SCENE`: does any eye see what the record of its cell lacks? Reads the published files, asks the
//! oracle of `belvedere-verify`, tells what came out, and fails when that is not good enough.

pub(super) mod load;
mod png;
mod report;

use std::{path::PathBuf, time::Instant};

use anyhow::Context;
use belvedere_scene::{CellId, SceneName};
use belvedere_verify::{
    check::{Cell, Outcome, Settings, check, eyes_of},
    closed::Closed,
    cube::Cube,
    picture::{self, Mark},
    scene::Scene,
};
use glam::DVec3;
use indicatif::{ProgressBar, ProgressStyle};

use super::output::{print, print_json};
use crate::{place::PlaceArgs, progress, publish::data::DataFolder};
use report::Report;

/// Eyes in a cell when nobody says how many in all: one in each kind of place.
const EYES_A_CELL: u64 = 8;
/// … but at least so many in all.
const LEAST_EYES: u64 = 1000;
/// Pixels along the side of a cube face of a picture.
const PICTURE_PX: usize = 512;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The scene
    scene: SceneName,
    /// Eyes in all cells together, and as many more that look while doors are closed [default: 8 a cell, at least 1000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
    eyes: Option<u64>,
    /// Check one cell only
    #[arg(long)]
    cell: Option<CellId>,
    /// Pixels along the side of each of the six faces around an eye
    #[arg(long, value_name = "PX", default_value_t = 256, value_parser = clap::value_parser!(u16).range(16..=2048))]
    size: u16,
    /// Another number gives other eyes
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Draw the worst view into this file, what is missing in red
    #[arg(long, value_name = "PNG")]
    picture: Option<PathBuf>,
    #[command(flatten)]
    place: PlaceArgs,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

pub(super) async fn run(args: Args) -> anyhow::Result<()> {
    let data = DataFolder::open_existing(&args.place).await?;
    let published = load::published(&data, &args.scene, args.cell).await?;
    let bar = progress(!args.json);
    let (settings, shown) = (settings(&args, published.cells.len()), bar.clone());
    let started = Instant::now();
    let (published, found) = tokio::task::spawn_blocking(move || {
        let (scene, cells) = (&published.scene, &published.cells);
        let closed = Closed::of(scene, cells, &settings);
        shown.set_length(eyes_of(cells.len(), settings.eyes) + closed.eyes());
        let advance = || shown.inc(1);
        let found = Found {
            open: check(scene, cells, &settings, &advance),
            doors: closed.doors(),
            situations: closed.situations(),
            closed: closed.check(scene, &settings, &advance),
        };
        (published, found)
    })
    .await?;
    bar.finish_and_clear();
    let drawn = match &args.picture {
        Some(file) => draw(file, &published.scene, &published.cells, &found)?,
        None => None,
    };
    let report = Report::new(&published, &settings, &found, started.elapsed().as_secs_f64());
    if args.json {
        print_json(&report)?;
    } else {
        print(&report.text(drawn.as_deref()))?;
    }
    anyhow::ensure!(report.passed(), "{}", report.refusal());
    Ok(())
}

/// What came out with all doors open and with some closed.
struct Found {
    open: Outcome,
    /// Doors that some record names.
    doors: usize,
    /// Pairs of a cell and what is closed there.
    situations: usize,
    closed: Outcome,
}

fn settings(args: &Args, cells: usize) -> Settings {
    let usual = || (EYES_A_CELL * cells as u64).max(LEAST_EYES);
    Settings {
        eyes: args.eyes.unwrap_or_else(usual),
        size_px: usize::from(args.size),
        seed: args.seed,
    }
}

fn progress(wanted: bool) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(None, progress::target(wanted));
    let template = "     verify {bar:40.cyan/dim} {pos} of {len} eyes  {elapsed} of about {duration}";
    bar.with_style(ProgressStyle::with_template(template).expect("the template is a constant"))
}

/// Draws the worst view there is; says what it shows, or nothing when there was no eye.
fn draw(file: &std::path::Path, scene: &Scene, cells: &[Cell], found: &Found) -> anyhow::Result<Option<String>> {
    let Found { open, closed, .. } = found;
    let sure = open.misses.first().or(closed.misses.first());
    let worst = sure.or(open.unconfirmed.first()).or(closed.unconfirmed.first());
    let doors = worst.map_or(&[][..], |miss| &miss.closed);
    let (cell, eye, mark, what) = match (worst, open.loosest()) {
        (Some(miss), _) => {
            let what = format!(
                "{} from {} at {:?}, {} in red{}",
                miss.place,
                miss.cell,
                miss.eye,
                miss.object,
                report::with_closed(doors)
            );
            let mark = Mark {
                object: miss.object.0,
                direction: DVec3::from(miss.direction),
            };
            (miss.cell, miss.eye, Some(mark), what)
        }
        (None, Some(loosest)) => {
            let eye = cells
                .iter()
                .find(|cell| cell.id == loosest.cell)
                .map_or(DVec3::ZERO, |cell| cell.room.middle());
            let what = format!("nothing missing; the middle of the least tight cell {}", loosest.cell);
            (loosest.cell, eye.to_array(), None, what)
        }
        (None, None) => return Ok(None),
    };
    let Some(cell) = cells.iter().find(|known| known.id == cell) else {
        return Ok(None);
    };
    let mut cube = Cube::new(PICTURE_PX);
    let scene = &scene.with_closed(doors);
    cube.draw(scene, DVec3::from(eye), &cell.expected(scene));
    let cross = picture::cross(&cube, mark);
    let bytes = png::encode(cross.width, cross.height, &cross.rgb)?;
    std::fs::write(file, bytes).with_context(|| format!("cannot write {}", file.display()))?;
    Ok(Some(format!("{}: {what}", file.display())))
}
