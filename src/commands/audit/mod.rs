//! `belvedere audit FILE`: does a recording of live sessions come out again as it was written, and was anybody told of what it
//! cannot see, or not told of what it sees, or told what is not so? `docs/LIVE.md` describes it for users.
//!
//! Two answers that share nothing: the rules replay the recording and must say the same to the last byte; and the account of
//! who was where and was told what is held against geometry alone, level 0 of everything and rays, without visible sets.

mod account;
mod clock;
mod crowd;
mod doors;
#[cfg(test)]
mod hall;
mod heard;
mod judge;
mod mover;
mod poses;
mod promises;
mod report;
mod sights;
mod suspect;
mod telling;

use std::{
    collections::{BTreeMap, btree_map::Entry},
    fs::File,
    io::BufReader,
    path::PathBuf,
};

use anyhow::Context;
use belvedere_live::{
    Ms,
    journal::{Input, replay::Replay},
};
use belvedere_scene::{Revision, SceneName};
use belvedere_verify::{between::Between, blockade::Blockade};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::Value;

use super::{
    output::{print, print_json},
    verify::load,
};
use crate::{
    live::{Block, Recording},
    place::PlaceArgs,
    progress,
    publish::data::DataFolder,
};
use account::Account;
use judge::Judge;
use report::{Difference, Report, SceneReport};
use sights::{Looked, Sights};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// What `serve --record` has written
    file: PathBuf,
    /// Look for misses each so many ticks
    #[arg(long, value_name = "TICKS", default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    every: u64,
    /// Hunt sight lines between at most so many pairs of cells of a scene; what is told beyond that is undecided
    #[arg(long, value_name = "PAIRS", default_value_t = 1_000)]
    hunts: usize,
    /// Exit with 1 also when it stays undecided of something that was told whether it could be seen
    #[arg(long)]
    fail_on_undecided: bool,
    #[command(flatten)]
    place: PlaceArgs,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

pub(super) async fn run(args: Args) -> anyhow::Result<()> {
    let cannot = || format!("cannot read the recording {}", args.file.display());
    let file = File::open(&args.file).with_context(cannot)?;
    let bar = progress(file.metadata().with_context(cannot)?.len(), !args.json);
    let mut recording = Recording::open(BufReader::new(file)).with_context(cannot)?;
    let data = DataFolder::open_existing(&args.place).await?;
    let mut scenes: BTreeMap<String, Scene> = BTreeMap::new();
    while let Some(block) = recording.next_block().with_context(cannot)? {
        let scene = match scenes.entry(block.scene.clone()) {
            Entry::Occupied(there) => there.into_mut(),
            Entry::Vacant(new) => new.insert(Scene::begin(&block.scene)?),
        };
        for revision in revisions(&block) {
            scene.load(&data, revision, args.hunts).await?;
        }
        tokio::task::block_in_place(|| scene.take(&block, args.every));
        scene.leave_revisions();
        bar.set_position(recording.whole_bytes());
        let Looked { cells, hunted, .. } = scenes.values().map(Scene::looked).sum();
        bar.set_message(format!("from {cells} cells, {hunted} hunts"));
    }
    bar.finish_and_clear();
    recording.check_end().with_context(cannot)?;
    let report = Report {
        whole_bytes: recording.whole_bytes(),
        scenes: scenes.into_values().map(Scene::report).collect(),
    };
    if args.json {
        print_json(&report)?;
    } else {
        print(&report.text())?;
    }
    match report.verdict(args.fail_on_undecided) {
        Some(verdict) => anyhow::bail!(verdict),
        None => Ok(()),
    }
}

fn progress(bytes: u64, wanted: bool) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(bytes), progress::target(wanted));
    let template = "     audit {bar:40.cyan/dim} {bytes} of {total_bytes}  {elapsed} of about {duration}  {msg}";
    bar.with_style(ProgressStyle::with_template(template).expect("the template is a constant"))
}

/// The revisions with which a block goes on.
fn revisions(block: &Block) -> Vec<Revision> {
    let inputs = block.entries.lines().step_by(2);
    // Only these say what is there, and few do.
    let grounds = inputs.filter(|input| input.contains("\"ground\""));
    let inputs = grounds.filter_map(|input| serde_json::from_str(input).ok());
    let revisions = inputs.filter_map(|(_, input): (Ms, Input)| match input {
        Input::Begin { ground, .. } | Input::Rebase { ground, .. } => Some(ground.revision),
        _ => None,
    });
    revisions.collect()
}

/// A scene of the recording.
struct Scene {
    name: SceneName,
    /// What is seen in the revisions of a block; nothing is known of those that are not kept any more.
    sights: BTreeMap<Revision, Option<Sights>>,
    /// How much was looked at in those that it has left.
    left: Looked,
    replay: Replay,
    account: Option<Account>,
    judge: Judge,
    first_ms: Option<Ms>,
    report: SceneReport,
}

impl Scene {
    fn begin(name: &str) -> anyhow::Result<Self> {
        Ok(Self {
            name: name.parse().context("the recording names no scene")?,
            sights: BTreeMap::new(),
            left: Looked::default(),
            replay: Replay::default(),
            account: None,
            judge: Judge::default(),
            first_ms: None,
            report: SceneReport {
                scene: name.to_string(),
                ..SceneReport::default()
            },
        })
    }

    /// Reads the geometry of a revision, if there is any.
    async fn load(&mut self, data: &DataFolder, revision: Revision, hunts: usize) -> anyhow::Result<()> {
        if let Entry::Vacant(new) = self.sights.entry(revision) {
            let published = load::revision(data, &self.name, revision).await?;
            new.insert(published.map(|published| {
                let scene = &published.scene;
                let between = Between::new(Blockade::of(scene), published.cells, scene.largest_error_m());
                Sights::new(between, hunts)
            }));
        }
        Ok(())
    }

    /// Puts the geometry away of all revisions but the last one: a recording may go through many, and one that comes back is read
    /// again.
    fn leave_revisions(&mut self) {
        let Some(account) = &self.account else { return };
        let current = self.sights.remove_entry(&account.revision);
        let left = std::mem::replace(&mut self.sights, current.into_iter().collect());
        self.left = left.values().flatten().map(Sights::looked).chain([self.left]).sum();
    }

    fn looked(&self) -> Looked {
        let here = self.sights.values().flatten().map(Sights::looked);
        here.chain([self.left]).sum()
    }

    fn take(&mut self, block: &Block, every: u64) {
        let mut lines = block.entries.lines();
        while let (Some(input), Some(output)) = (lines.next(), lines.next()) {
            self.report.entries += 1;
            self.entry(input, output, every);
        }
    }

    fn entry(&mut self, input: &str, output: &str, every: u64) {
        let entry = self.report.entries;
        let replayed = match self.replay.take(input) {
            Ok(replayed) => replayed,
            Err(error) => {
                let (at_ms, why) = (self.report.lasted_ms + self.first_ms.unwrap_or(0), error.to_string());
                return self.report.differences.add(Difference { entry, at_ms, why });
            }
        };
        let at_ms = replayed.at_ms;
        if replayed.output != output {
            let why = difference(&replayed.output, output);
            self.report.differences.add(Difference { entry, at_ms, why });
        }
        let first_ms = *self.first_ms.get_or_insert(at_ms);
        self.report.lasted_ms = at_ms - first_ms;
        self.report.sessions += u64::from(matches!(replayed.input, Input::Open { .. }));
        self.account_for(&replayed.input, output, at_ms);
        if replayed.input == Input::Tick {
            self.report.ticks += 1;
            self.judge(at_ms, every);
        }
    }

    fn account_for(&mut self, input: &Input, output: &str, at_ms: Ms) {
        if let Input::Begin { rules, ground, .. } = input {
            self.account = Some(Account::begin(*rules, ground));
        }
        let Some(account) = &mut self.account else { return };
        let said: Value = serde_json::from_str(output).unwrap_or_default();
        if said["answer"].get("refused").is_none() {
            account.hear(input, at_ms);
            self.judge
                .untrue
                .extend(account.answered(input, &said["answer"], at_ms));
        }
        let told = said["told"].as_array().map_or(&[][..], Vec::as_slice);
        for told in told {
            let wrong = account.tell(told, at_ms);
            self.judge.note(account, wrong, at_ms);
        }
    }

    fn judge(&mut self, at_ms: Ms, every: u64) {
        let Some(account) = &mut self.account else { return };
        self.judge.untrue.extend(account.drifted(at_ms));
        if let Some(Some(sights)) = self.sights.get_mut(&account.revision) {
            self.judge.look(account, sights, at_ms, every);
        } else {
            self.report.ticks_not_looked_at += 1;
            account.told.clear();
            account.doors_told.clear();
        }
    }

    fn report(self) -> SceneReport {
        let Looked { pairs, cells, hunted } = self.looked();
        let promises = self.account.map(|account| account.promises).unwrap_or_default();
        let mut report = self.report;
        self.judge.leaks.into_iter().for_each(|leak| report.leaks.add(leak));
        self.judge
            .undecided
            .into_iter()
            .for_each(|found| report.undecided.add(found));
        self.judge.misses.into_iter().for_each(|miss| report.misses.add(miss));
        self.judge.astray.into_iter().for_each(|told| report.astray.add(told));
        self.judge.untrue.into_iter().for_each(|told| report.untrue.add(told));
        SceneReport {
            told: self.judge.told,
            doors: self.judge.doors,
            untold: self.judge.untold,
            culled: self.judge.culled,
            waiting: self.judge.waiting,
            hushed: promises.begun,
            broken: promises.broken,
            pairs,
            cells,
            hunted,
            ..report
        }
    }
}

/// What the rules say beside what was written, from where they part.
fn difference(now: &str, written: &str) -> String {
    const SHOWN: usize = 80;
    let same = now.chars().zip(written.chars()).take_while(|(a, b)| a == b).count();
    let from = same.saturating_sub(SHOWN / 4);
    let part = |text: &str| text.chars().skip(from).take(SHOWN).collect::<String>();
    format!("the rules say …{}… where it says …{}…", part(now), part(written))
}
