//! How does whoever started a bake see that it goes on? A person at a terminal sees one bar a stage, with an estimate; a
//! log gets a line now and then; a program that asked for it reads lines of JSON.

use std::{
    collections::BTreeMap,
    io::{IsTerminal, Write as _},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError, Weak,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use belvedere_bake::progress::{Progress, Stage};
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use serde_json::json;

/// Between two lines of JSON of one stage.
const LINE_INTERVAL: Duration = Duration::from_millis(200);
/// Between two lines of a log: stages that take less say nothing.
const LOG_INTERVAL: Duration = Duration::from_secs(10);

/// How progress is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Show {
    /// On standard error: bars when that is a terminal, else a line now and then.
    Bars,
    /// One JSON object a line on standard output.
    Lines,
}

/// Shows the stages of a bake, times them, and carries the wish to stop.
#[derive(Debug)]
pub(crate) struct BakeProgress {
    show: Show,
    current: Arc<Mutex<Option<Current>>>,
    seconds: Mutex<BTreeMap<&'static str, f64>>,
    cancelled: AtomicBool,
}

#[derive(Debug)]
struct Current {
    stage: Stage,
    started: Instant,
    bar: ProgressBar,
    told: Instant,
}

impl BakeProgress {
    pub(crate) fn new(show: Show) -> Self {
        let current = Arc::default();
        if show == Show::Bars && !std::io::stderr().is_terminal() {
            let watched = Arc::downgrade(&current);
            std::thread::spawn(move || log(&watched));
        }
        Self {
            show,
            current,
            seconds: Mutex::default(),
            cancelled: AtomicBool::new(false),
        }
    }

    /// Asks the bake to stop at its next step.
    pub(crate) fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Ends the last stage; gives the seconds that each stage took.
    pub(crate) fn seconds(&self) -> BTreeMap<String, f64> {
        self.end_current();
        let seconds = self.seconds.lock().unwrap_or_else(PoisonError::into_inner);
        seconds.iter().map(|(stage, s)| ((*stage).to_owned(), *s)).collect()
    }

    fn end_current(&self) {
        let ended = self.current().take();
        if let Some(Current {
            stage, started, bar, ..
        }) = ended
        {
            bar.finish();
            let mut seconds = self.seconds.lock().unwrap_or_else(PoisonError::into_inner);
            *seconds.entry(stage.name()).or_default() += started.elapsed().as_secs_f64();
        }
    }

    fn current(&self) -> MutexGuard<'_, Option<Current>> {
        locked(&self.current)
    }
}

impl Progress for BakeProgress {
    fn start(&self, stage: Stage, steps: u64) {
        self.end_current();
        let target = if self.show == Show::Bars && std::io::stderr().is_terminal() {
            ProgressDrawTarget::stderr()
        } else {
            ProgressDrawTarget::hidden()
        };
        let bar = ProgressBar::with_draw_target(Some(steps), target).with_message(stage.name());
        let template = "{msg:>11} {bar:40.cyan/dim} {percent:>3} %  {elapsed} of about {whole}";
        bar.set_style(
            ProgressStyle::with_template(template)
                .expect("the template is a constant")
                .with_key("whole", |state: &ProgressState, to: &mut dyn std::fmt::Write| {
                    let whole = whole(state.elapsed(), state.pos(), state.len());
                    _ = write!(to, "{}", HumanDuration(whole.unwrap_or_default()));
                })
                .progress_chars("━╸─"),
        );
        if self.show == Show::Lines {
            tell(stage, &bar);
        }
        let started = Instant::now();
        *self.current() = Some(Current {
            stage,
            started,
            bar,
            told: started,
        });
    }

    fn advance(&self, steps: u64) {
        if let Some(current) = &mut *self.current() {
            current.bar.inc(steps);
            if self.show == Show::Lines && current.told.elapsed() >= LINE_INTERVAL {
                tell(current.stage, &current.bar);
                current.told = Instant::now();
            }
        }
    }

    fn cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

/// Writes a line now and then, as long as there is somebody whose bakes it can be about.
fn log(current: &Weak<Mutex<Option<Current>>>) {
    loop {
        std::thread::sleep(LOG_INTERVAL);
        let Some(current) = current.upgrade() else { return };
        let line = locked(&current).as_ref().map(Current::line);
        if let Some(line) = line {
            // Whoever has closed the pipe does not want to know.
            _ = writeln!(std::io::stderr().lock(), "{line}");
        }
    }
}

impl Current {
    fn line(&self) -> String {
        let Self { stage, bar, .. } = self;
        let (stage, elapsed) = (stage.name(), bar.elapsed());
        let share = (100 * bar.position()).checked_div(bar.length().unwrap_or(0));
        match share.zip(whole(elapsed, bar.position(), bar.length())) {
            None | Some((0, _)) => format!("{stage}: for {}", HumanDuration(elapsed)),
            Some((share, whole)) => format!(
                "{stage}: {share} %, {} of about {}",
                HumanDuration(elapsed),
                HumanDuration(whole)
            ),
        }
    }
}

/// How long all of a stage takes if the rest goes on as it did so far; its steps come in no order that says more.
fn whole(elapsed: Duration, done: u64, of: Option<u64>) -> Option<Duration> {
    let share = done as f64 / of? as f64;
    Duration::try_from_secs_f64(elapsed.as_secs_f64() / share).ok()
}

fn locked<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

fn tell(stage: Stage, bar: &ProgressBar) {
    let (done, of) = (bar.position(), bar.length().unwrap_or(0));
    let line = json!({"progress": {"stage": stage.name(), "done": done.min(of), "of": of}});
    // Whoever has closed the pipe does not want to know.
    _ = writeln!(std::io::stdout().lock(), "{line}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_says_how_far_a_stage_is() {
        let progress = BakeProgress::new(Show::Bars);
        let line = || progress.current().as_ref().map(Current::line);
        assert_eq!(line(), None);
        progress.start(Stage::Visibility, 40);
        assert_eq!(line().unwrap(), "visibility: for 0 seconds");
        progress.advance(10);
        let line = line().unwrap();
        assert!(line.starts_with("visibility: 25 %, 0 seconds of about "), "{line}");
    }

    #[test]
    fn the_rest_of_a_stage_takes_as_long_as_what_is_done() {
        let minute = Duration::from_secs(60);
        assert_eq!(whole(minute, 20, Some(100)), Some(5 * minute));
        assert_eq!(whole(minute, 100, Some(100)), Some(minute));
        assert_eq!(whole(minute, 0, Some(100)), None);
        assert_eq!(whole(minute, 3, None), None);
    }
}
