//! What does a visitor get to see while the bytes are still coming? Walks through a scene along a script, over a simulated
//! line, and measures (Marvie & Bouatouch, *A VRML97-X3D extension for massive scenery management in virtual worlds*, 2004,
//! §7: download quality, convergence time, with and without prefetching).
//!
//! * [`script`]: where the visitor is, and when; [`ramble`]: made-up ways;
//! * [`mod@line`]: when what was asked for arrives;
//! * `metered`: what every document cost;
//! * `courier`: what comes over the line;
//! * `visitor`: carries out [`crate::strategy`];
//! * `ledger`: whether what came ahead was worth it;
//! * [`outcome`]: what became of it;
//! * [`meeting`]: whom one meets on the way, where the scene is live.
//!
//! Bytes are fetched for real, as fast as they come; *when* they arrive is simulated. So a tour of minutes takes seconds, and
//! the same script gives the same numbers on any machine, but for the latencies of real requests. Others move in real time, and
//! so does who meets them.

mod courier;
mod ledger;
pub mod line;
pub mod meeting;
mod metered;
pub mod outcome;
pub mod ramble;
pub mod script;
mod streams;
#[cfg(test)]
mod tests;
mod visitor;

pub use line::Line;
pub use meeting::{Echoes, Meeting};
pub use outcome::{Causes, Frame, Latency, Memory, Outcome, Quality, Tour, Way, Ways};
pub use ramble::{Manner, Rambles};
pub use script::{Script, ScriptError};

use crate::{ByteSource, Client, Error, strategy::order::Budgets};
use belvedere_scene::SceneName;
use metered::Metered;
use visitor::Visitor;

/// How a visitor walks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TourSettings {
    /// The line to the visitor.
    pub line: Line,
    /// Whether what can be seen from cells that may be entered soon is fetched ahead.
    pub prefetch: bool,
    /// Whether smooth LODs are used where they cost less than levels.
    pub smooth: bool,
    /// Whether models are grown from rules where that costs less than levels; growing takes no time on the simulated line.
    pub rules: bool,
    /// Whether small files come together where the server offers that.
    pub bundles: bool,
    /// Memory of all files that are held or on their way, bytes; documents apart.
    pub memory_bytes: u64,
    /// Frames each second, of the scripted time.
    pub frames_per_s: f64,
    /// Levels are refined until their error covers at most so many pixels of a picture 1,080 pixels high.
    pub target_px: f64,
}

impl Default for TourSettings {
    fn default() -> Self {
        Self {
            line: Line::default(),
            prefetch: true,
            smooth: true,
            rules: true,
            bundles: true,
            memory_bytes: u64::MAX,
            frames_per_s: 10.0,
            target_px: 1.0,
        }
    }
}

impl TourSettings {
    fn frame_ms(&self) -> f64 {
        1000.0 / self.frames_per_s
    }

    fn budgets(&self) -> Budgets {
        Budgets {
            target_px: self.target_px,
            memory_bytes: self.memory_bytes,
            prefetch: self.prefetch,
            ..Budgets::default()
        }
    }
}

/// Sends one visitor along a script; the visitor holds nothing at first. `each_frame` hears of each of [`frames`] when it is over.
///
/// # Errors
/// When the scene cannot be opened. What cannot be fetched later is counted, and the tour goes on without it.
pub async fn walk<S: ByteSource>(
    source: S,
    scene: &SceneName,
    script: &Script,
    settings: &TourSettings,
    each_frame: impl Fn(),
) -> Result<Tour, Error> {
    let client = Client::new(Metered::new(source));
    let scene = client.open(scene).await?.giving_up();
    Ok(Visitor::new(&scene, settings).walk(script, each_frame).await)
}

/// No tour has more frames after its first: a day at ten a second.
const MOST_FRAMES: u64 = 864_000;

/// How many frames a visitor looks at on a way.
#[must_use]
pub fn frames(script: &Script, settings: &TourSettings) -> u64 {
    let [from_ms, to_ms] = script.times_ms();
    let last = ((to_ms - from_ms) / settings.frame_ms()).floor();
    (last as u64).min(MOST_FRAMES) + 1
}
