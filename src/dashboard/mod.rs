//! What does whoever has started the server see of it in the terminal?
//!
//! A few lines that are drawn anew every second, below the log. They are made of what `/metrics` says and of nothing else, so
//! they cannot say anything else: [`reading`] takes the figures out of that text, [`figures`] makes lines of two of them,
//! [`screen`] draws these, and keeps the log whole.

mod figures;
mod reading;
mod screen;

use std::time::{Duration, Instant};

pub(crate) use screen::Screen;

use figures::lines;
use reading::Reading;

/// Between two frames. Rates are means over it.
const FRAME: Duration = Duration::from_secs(1);

/// Draws what `metrics` say, over and over; ends with the runtime.
pub(crate) async fn show(screen: Screen, metrics: impl Fn() -> Option<String>) {
    let (started, mut before) = (Instant::now(), None);
    let mut frames = tokio::time::interval(FRAME);
    loop {
        frames.tick().await;
        let Some(now) = metrics().map(|text| Reading::of(&text)) else {
            continue;
        };
        let at = Instant::now();
        let last = before.replace((at, now.clone()));
        if let Some((since, last)) = last {
            let (screen, lines) = (screen.clone(), lines(&now, &last, at - since, started.elapsed()));
            // A terminal that somebody has stopped holds up a thread of its own.
            _ = tokio::task::spawn_blocking(move || screen.draw(lines)).await;
        }
    }
}
