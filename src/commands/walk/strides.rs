//! How far have visitors gone? A bar on a terminal, and elsewhere a line on standard error now and then, since a walk may take long.

use std::{
    sync::Mutex,
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressStyle};

use crate::progress;

/// Between two lines.
const PAUSE: Duration = Duration::from_secs(10);

/// Frames that all visitors together have looked at.
pub(super) struct Strides {
    bar: ProgressBar,
    /// When a line is due, where there is no bar.
    due: Option<Mutex<Instant>>,
}

impl Strides {
    pub(super) fn new(frames: u64, json: bool) -> anyhow::Result<Self> {
        let target = progress::target(!json);
        let has_bar = !target.is_hidden();
        let bar = ProgressBar::with_draw_target(Some(frames), target);
        bar.set_style(ProgressStyle::with_template(
            "    walk {bar:40.cyan/dim} {percent} % of {len} frames, {eta} left",
        )?);
        Ok(Self {
            bar,
            due: (!has_bar).then(|| Mutex::new(Instant::now() + PAUSE)),
        })
    }

    /// One more.
    pub(super) fn step(&self) {
        self.bar.inc(1);
        let Some(due) = &self.due else { return };
        let mut due = due.lock().expect("nothing panics while it holds this lock");
        let now = Instant::now();
        if now >= *due {
            *due = now + PAUSE;
            let all = self.bar.length().unwrap_or_default();
            eprintln!(
                "belvedere: {} of {all} frames have been walked through",
                self.bar.position()
            );
        }
    }

    pub(super) fn end(&self) {
        self.bar.finish_and_clear();
    }
}
