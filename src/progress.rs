//! How does a person at a terminal see that the bake goes on? One bar a stage, with an estimate; nothing in a pipe.

use std::{
    collections::BTreeMap,
    io::IsTerminal,
    sync::{
        Mutex,
        atomic::{AtomicBool, Ordering},
    },
    time::Instant,
};

use belvedere_bake::progress::{Progress, Stage};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Shows the stages of a bake, times them, and carries the wish to stop.
#[derive(Debug)]
pub(crate) struct BakeProgress {
    visible: bool,
    current: Mutex<Option<(Stage, Instant, ProgressBar)>>,
    seconds: Mutex<BTreeMap<&'static str, f64>>,
    cancelled: AtomicBool,
}

impl BakeProgress {
    /// Draws on standard error when that is a terminal and `quiet` is not set.
    pub(crate) fn new(quiet: bool) -> Self {
        Self {
            visible: !quiet && std::io::stderr().is_terminal(),
            current: Mutex::default(),
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
        let seconds = self.seconds.lock().expect("no thread panics while it holds this lock");
        seconds.iter().map(|(stage, s)| ((*stage).to_owned(), *s)).collect()
    }

    fn end_current(&self) {
        let ended = self
            .current
            .lock()
            .expect("no thread panics while it holds this lock")
            .take();
        if let Some((stage, started, bar)) = ended {
            bar.finish();
            let mut seconds = self.seconds.lock().expect("no thread panics while it holds this lock");
            *seconds.entry(stage.name()).or_default() += started.elapsed().as_secs_f64();
        }
    }
}

impl Progress for BakeProgress {
    fn start(&self, stage: Stage, steps: u64) {
        self.end_current();
        let target = if self.visible {
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
        *self.current.lock().expect("no thread panics while it holds this lock") = Some((stage, Instant::now(), bar));
    }

    fn advance(&self, steps: u64) {
        if let Some((_, _, bar)) = &*self.current.lock().expect("no thread panics while it holds this lock") {
            bar.inc(steps);
        }
    }

    fn cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}
