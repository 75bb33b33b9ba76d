//! How does whoever started a bake see that it goes on? A person at a terminal sees one bar a stage, with an estimate; a
//! log gets a line now and then; a program that asked for it reads lines of JSON.

use std::{
    collections::BTreeMap,
    io::{IsTerminal, Write},
    sync::{
        Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use belvedere_bake::progress::{Progress, Stage};
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::json;

/// Between two lines of JSON of one stage.
const LINE_INTERVAL: Duration = Duration::from_millis(200);
/// Between two lines of a log, of any stage: what takes less says nothing.
const LOG_INTERVAL: Duration = Duration::from_secs(10);

/// How progress is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Show {
    /// On standard error: bars when that is a terminal, else a line now and then.
    Bars,
    /// One JSON object a line on standard output.
    Lines,
    /// Not at all.
    Nothing,
}

/// Shows the stages of a bake, times them, and carries the wish to stop.
#[derive(Debug)]
pub(crate) struct BakeProgress {
    show: Show,
    current: Mutex<Option<Current>>,
    seconds: Mutex<BTreeMap<&'static str, f64>>,
    /// When the log last had a line.
    logged: Mutex<Instant>,
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
        Self {
            show,
            current: Mutex::default(),
            seconds: Mutex::default(),
            logged: Mutex::new(Instant::now()),
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

    /// What a log is told now, if anything.
    fn line(&self, Current { stage, bar, .. }: &Current) -> Option<String> {
        let mut logged = self.logged.lock().unwrap_or_else(PoisonError::into_inner);
        if logged.elapsed() < LOG_INTERVAL {
            return None;
        }
        *logged = Instant::now();
        let share = 100 * bar.position() / bar.length().unwrap_or(0).max(1);
        let (elapsed, of) = (HumanDuration(bar.elapsed()), HumanDuration(bar.duration()));
        Some(format!("{}: {share} %, {elapsed} of about {of}", stage.name()))
    }

    fn current(&self) -> MutexGuard<'_, Option<Current>> {
        self.current.lock().unwrap_or_else(PoisonError::into_inner)
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
        let template = "{msg:>11} {bar:40.cyan/dim} {percent:>3} %  {elapsed} of about {duration}";
        bar.set_style(
            ProgressStyle::with_template(template)
                .expect("the template is a constant")
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
            if self.show == Show::Bars
                && current.bar.is_hidden()
                && let Some(line) = self.line(current)
            {
                // Whoever has closed the pipe does not want to know.
                _ = writeln!(std::io::stderr().lock(), "{line}");
            }
        }
    }

    fn cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
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
    fn a_log_gets_a_line_now_and_then() {
        let progress = BakeProgress::new(Show::Bars);
        progress.start(Stage::Visibility, 40);
        progress.advance(10);
        let current = progress.current();
        let current = current.as_ref().unwrap();
        assert_eq!(progress.line(current), None);
        *progress.logged.lock().unwrap() -= LOG_INTERVAL;
        let line = progress.line(current).unwrap();
        assert!(line.starts_with("visibility: 25 %, "), "{line}");
        assert_eq!(progress.line(current), None);
    }
}
