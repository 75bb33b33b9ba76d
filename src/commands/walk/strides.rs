//! How far have visitors gone? A bar on a terminal, and elsewhere a line on standard error now and then, since a walk may take long.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use crate::progress;

/// Between two lines.
const PAUSE: Duration = Duration::from_secs(10);

/// Frames that all visitors together have looked at.
pub(super) struct Strides {
    bar: ProgressBar,
    has_bar: bool,
}

impl Strides {
    pub(super) fn new(frames: u64, json: bool) -> anyhow::Result<Self> {
        let target = progress::target(!json);
        let has_bar = !target.is_hidden();
        let bar = ProgressBar::with_draw_target(Some(frames), target);
        bar.set_style(ProgressStyle::with_template(
            "    walk {bar:40.cyan/dim} {percent} % of {len} frames, {eta} left",
        )?);
        Ok(Self { bar, has_bar })
    }

    /// One more.
    pub(super) fn step(&self) {
        self.bar.inc(1);
    }

    /// Says so every few seconds where there is no bar, for as long as this is waited for: also while a frame waits for its files.
    pub(super) async fn tell(&self) {
        if self.has_bar {
            return;
        }
        loop {
            tokio::time::sleep(PAUSE).await;
            let (gone, all) = (self.bar.position(), self.bar.length().unwrap_or_default());
            eprintln!("belvedere: {gone} of {all} frames have been walked through");
        }
    }

    pub(super) fn end(&self) {
        self.bar.finish_and_clear();
    }
}
