//! How does whoever started a bake see that it goes on? A person at a terminal sees one bar a stage, with an estimate of the rest of
//! the bake ([`forecast`]); a log gets a line now and then; a program that asked for it reads lines of JSON.

mod forecast;

use std::{
    collections::BTreeMap,
    io::{IsTerminal, Write as _},
    sync::{
        Arc, Mutex, MutexGuard, OnceLock, PoisonError, Weak,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use belvedere_bake::progress::{Progress, Stage};
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use serde_json::json;

use crate::place::Absent;
use forecast::{Forecast, Now};

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
    forecast: Arc<Mutex<Forecast>>,
    cancelled: AtomicBool,
}

#[derive(Debug)]
struct Current {
    stage: Stage,
    bar: ProgressBar,
    told: Instant,
    /// When its last step was made.
    made: Arc<OnceLock<Duration>>,
}

/// Where a bar is drawn: on a terminal, if one is wanted.
pub(crate) fn target(is_wanted: bool) -> ProgressDrawTarget {
    if is_wanted && std::io::stderr().is_terminal() {
        ProgressDrawTarget::stderr()
    } else {
        ProgressDrawTarget::hidden()
    }
}

impl BakeProgress {
    pub(crate) fn new(show: Show) -> Self {
        let (current, forecast) = (Arc::default(), Arc::default());
        if show == Show::Bars && !std::io::stderr().is_terminal() {
            let (watched, forecast) = (Arc::downgrade(&current), Arc::clone(&forecast));
            std::thread::spawn(move || log(&watched, &forecast));
        }
        Self {
            show,
            current,
            seconds: Mutex::default(),
            forecast,
            cancelled: AtomicBool::new(false),
        }
    }

    /// Asks the bake to stop at its next step.
    pub(crate) fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Says for what the bake waits, or that it goes on.
    pub(crate) fn waits(&self, absent: Option<Absent>, why: &str) {
        // Whoever has closed the pipe does not want to know.
        let say = || match self.show {
            Show::Bars => _ = writeln!(std::io::stderr().lock(), "{why}"),
            Show::Lines => {
                _ = writeln!(
                    std::io::stdout().lock(),
                    "{}",
                    json!({"waits": {"absent": absent, "why": why}})
                )
            }
        };
        match &*self.current() {
            Some(current) => current.bar.suspend(say),
            None => say(),
        }
    }

    /// Ends the last stage; gives the seconds that each stage took.
    pub(crate) fn seconds(&self) -> BTreeMap<String, f64> {
        self.end_current();
        let seconds = locked(&self.seconds);
        seconds.iter().map(|(stage, s)| ((*stage).to_owned(), *s)).collect()
    }

    fn end_current(&self) {
        let ended = self.current().take();
        if let Some(current) = ended {
            let now = current.now();
            current.bar.finish();
            *locked(&self.seconds).entry(now.stage.name()).or_default() += now.seconds;
            locked(&self.forecast).end(now);
        }
    }

    fn current(&self) -> MutexGuard<'_, Option<Current>> {
        locked(&self.current)
    }

    /// Writes a line of JSON.
    fn tell(&self, current: &Current) {
        let now = current.now();
        let rest_s = locked(&self.forecast).rest_s(now).map(f64::round);
        let Now { stage, done, of, .. } = now;
        let line = json!({"progress": {"stage": stage.name(), "done": done, "of": of, "rest_s": rest_s}});
        // Whoever has closed the pipe does not want to know.
        _ = writeln!(std::io::stdout().lock(), "{line}");
    }
}

impl Progress for BakeProgress {
    fn start(&self, stage: Stage, steps: u64) {
        self.end_current();
        let bar =
            ProgressBar::with_draw_target(Some(steps), target(self.show == Show::Bars)).with_message(stage.name());
        let template = "{msg:>11} {bar:40.cyan/dim} {percent:>3} %  {elapsed}{left}";
        let (forecast, made) = (Arc::clone(&self.forecast), Arc::<OnceLock<Duration>>::default());
        let made_here = Arc::clone(&made);
        bar.set_style(
            ProgressStyle::with_template(template)
                .expect("the template is a constant")
                .with_key("left", move |state: &ProgressState, to: &mut dyn std::fmt::Write| {
                    let steps = (state.pos(), state.len());
                    let now = now(stage, state.elapsed(), &made_here, steps);
                    _ = write!(to, "{}", left(&locked(&forecast), now));
                })
                .progress_chars("━╸─"),
        );
        let current = Current {
            stage,
            bar,
            told: Instant::now(),
            made,
        };
        if self.show == Show::Lines {
            self.tell(&current);
        }
        *self.current() = Some(current);
    }

    fn advance(&self, steps: u64) {
        if let Some(current) = &mut *self.current() {
            current.bar.inc(steps);
            if Some(current.bar.position()) >= current.bar.length() {
                current.made.get_or_init(|| current.bar.elapsed());
            }
            if self.show == Show::Lines && current.told.elapsed() >= LINE_INTERVAL {
                self.tell(current);
                current.told = Instant::now();
            }
        }
    }

    fn expect(&self, stage: Stage, steps: u64) {
        locked(&self.forecast).expect(stage, steps);
    }

    fn cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

/// Writes a line now and then, as long as there is somebody whose bakes it can be about.
fn log(current: &Weak<Mutex<Option<Current>>>, forecast: &Mutex<Forecast>) {
    loop {
        std::thread::sleep(LOG_INTERVAL);
        let Some(current) = current.upgrade() else { return };
        let line = locked(&current).as_ref().map(|current| current.line(&locked(forecast)));
        if let Some(line) = line {
            // Whoever has closed the pipe does not want to know.
            _ = writeln!(std::io::stderr().lock(), "{line}");
        }
    }
}

impl Current {
    /// How far it is.
    fn now(&self) -> Now {
        let steps = (self.bar.position(), self.bar.length());
        now(self.stage, self.bar.elapsed(), &self.made, steps)
    }

    fn line(&self, forecast: &Forecast) -> String {
        let now = self.now();
        let elapsed = HumanDuration(self.bar.elapsed());
        let left = left(forecast, now);
        match (100 * now.done).checked_div(now.of) {
            None | Some(0) => format!("{}: for {elapsed}{left}", now.stage),
            Some(share) => format!("{}: {share} %, for {elapsed}{left}", now.stage),
        }
    }
}

/// How far a stage is whose bar is so far, and whose last step was `made` then, if it was.
fn now(stage: Stage, elapsed: Duration, made: &OnceLock<Duration>, (done, of): (u64, Option<u64>)) -> Now {
    let of = of.unwrap_or(0);
    Now {
        stage,
        seconds: elapsed.as_secs_f64(),
        stepping_s: made.get().unwrap_or(&elapsed).as_secs_f64(),
        done: done.min(of),
        of,
    }
}

/// What a person is told of the rest of the bake.
fn left(forecast: &Forecast, now: Now) -> String {
    let rest = forecast.rest_s(now);
    let Some(rest) = rest.and_then(|rest_s| Duration::try_from_secs_f64(rest_s).ok()) else {
        return String::new();
    };
    let gone_s = forecast.gone_s(now);
    let share = (100.0 * gone_s / (gone_s + rest.as_secs_f64())).max(0.0) as u32;
    format!("; {share} % of all, done in about {}", HumanDuration(rest))
}

fn locked<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_says_how_far_a_stage_is() {
        let progress = BakeProgress::new(Show::Bars);
        let line = || {
            let current = progress.current();
            current
                .as_ref()
                .map(|current| current.line(&locked(&progress.forecast)))
        };
        assert_eq!(line(), None);
        progress.start(Stage::Cells, 4);
        assert_eq!(line().unwrap(), "cells: for 0 seconds");
        progress.advance(1);
        assert_eq!(line().unwrap(), "cells: 25 %, for 0 seconds");
        progress.start(Stage::Visibility, 40);
        progress.advance(10);
        let line = line().unwrap();
        assert!(line.starts_with("visibility: 25 %, for 0 seconds; "), "{line}");
        assert!(line.contains(" % of all, done in about "), "{line}");
    }
}
