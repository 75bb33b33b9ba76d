//! What can be seen from each cell?
//!
//! Two answers bracket the truth. [`sampled`] finds what rays see: everything in it is visible, something may be
//! missing, and it says how much at most. [`conservative`] keeps what cannot be proved hidden: nothing is missing,
//! something may be too much. Both are computed; what the proofs leave open and rays have not seen is looked for once
//! more. Then the [`Method`] decides which of the two is published.

pub mod conservative;
mod doors;
pub mod epsilon;
pub mod fusion;
mod glance;
pub mod prover;
pub mod sampled;

pub(crate) mod random;
mod sampler;
mod segment;
mod solid;
mod targets;

#[cfg(test)]
mod conservative_tests;
#[cfg(test)]
mod oracle;
#[cfg(test)]
mod tests;

use std::{fmt, str::FromStr};

use belvedere_scene::record::Guarantee;

use crate::{
    cells::CellGraph,
    occluders::Region,
    progress::{Cancelled, Progress, Stage},
    world::World,
};
use conservative::{ConservativeSettings, Observer, Scenery};
pub use glance::glance;
use prover::Proofs;
pub use sampled::SampledSettings;
use sampled::Survey;
use sampler::Sampler;

/// How visible sets are computed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Method {
    /// [`Conservative`](Self::Conservative) where that is tight, else [`Sampled`](Self::Sampled).
    #[default]
    Auto,
    /// What rays saw: see [`sampled`].
    Sampled,
    /// What no convex bodies, alone or fused, hide: see [`prover`] and [`fusion`].
    Occluders,
    /// What no walls with openings hide: see [`prover`].
    Portals,
    /// What neither hides: the intersection of both.
    Conservative,
}

/// Everything that decides visible sets besides world and cells.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct VisibilitySettings {
    /// What is published.
    pub method: Method,
    /// How hard rays look; by default as hard as the number of cells allows.
    pub sampled: Option<SampledSettings>,
}

/// Conservative sets that hold at most so many times as many objects as rays have seen are published: who never misses
/// anything may fetch a few things too many, last of all.
pub const WORTH: f64 = 2.0;
/// Where a few cells show that thorough proofs come this near, all cells get them.
const TIGHT: f64 = 1.3;
/// Cells are halved so often for what could not be proved hidden from all of them.
const HALVINGS: u32 = 4;
/// … and so often the boxes of what is left then.
const TARGET_HALVINGS: u32 = 3;
/// … and less often where that is not tight anyway.
const FEW_HALVINGS: u32 = 1;
/// About so many cells tell whether proofs are tight.
const TRIED_CELLS: usize = 24;
/// An object that no ray has seen is taken to fill this solid angle, in steradians.
const UNSEEN_SR: f32 = 1e-9;
/// … and to be visible along this share of sight lines.
const UNSEEN_FRACTION: f32 = 1.0 / 64.0;

/// What all cells see, and how that came about.
#[derive(Debug, Clone, PartialEq)]
pub struct Visibility {
    /// One for each cell.
    pub cells: Vec<CellVisibility>,
    /// Which method's sets these are; never [`Method::Auto`].
    pub method: Method,
    /// What they promise.
    pub guarantee: Guarantee,
    /// Mean number of objects in a cell's set that rays have seen, a lower bound of the truth.
    pub mean_seen: f64,
    /// Mean number of objects in a cell's set that cannot be proved hidden, an upper bound of the truth; `None` when nobody
    /// asked.
    pub mean_not_hidden: Option<f64>,
    /// Why this method, for people.
    pub reason: String,
}

/// What one cell sees. Object and cell numbers are indices.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CellVisibility {
    /// Objects that can be seen from somewhere in the cell, largest solid angle first, then by number.
    pub objects: Vec<SeenObject>,
    /// Other cells into which a sight line leads, and the adjacent ones, rising.
    pub cells: Vec<u32>,
    /// Upper bound, at 95 % confidence, of the chance that a random sight line from the cell ends on an object that is
    /// missing above; 0 when nothing can be missing.
    pub miss_bound: f64,
    /// Rays that were cast for this cell.
    pub rays: u64,
}

/// An object that can be seen from somewhere in a cell.
#[derive(Debug, Clone, PartialEq)]
pub struct SeenObject {
    /// Its number.
    pub object: u32,
    /// Estimated share of sight lines from the cell to its surface that nothing else blocks, in (0, 1].
    pub fraction: f32,
    /// Mean solid angle of what is visible of it over all eyes in the cell, in steradians, above 0.
    pub solid_angle: f32,
    /// Doors each of which hides it from the whole cell when it is closed, rising.
    pub doors: Vec<u32>,
}

impl Method {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Auto,
        Self::Sampled,
        Self::Occluders,
        Self::Portals,
        Self::Conservative,
    ];

    /// Its name in records and reports, and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Sampled => "sampled",
            Self::Occluders => "occluders",
            Self::Portals => "portals",
            Self::Conservative => "conservative",
        }
    }

    /// The proofs that it uses; `None` for one that proves nothing.
    #[must_use]
    pub fn proofs(self) -> Option<ConservativeSettings> {
        let settings = |bodies, walls| ConservativeSettings {
            proofs: Proofs { bodies, walls },
            fusion: bodies,
            halvings: HALVINGS,
            target_halvings: TARGET_HALVINGS,
            steps: u32::MAX,
        };
        match self {
            Self::Sampled => None,
            Self::Occluders => Some(settings(true, false)),
            Self::Portals => Some(settings(false, true)),
            Self::Auto | Self::Conservative => Some(settings(true, true)),
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A name that no method has.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no way to compute visible sets: use auto, sampled, occluders, portals or conservative")]
pub struct UnknownMethod(String);

impl FromStr for Method {
    type Err = UnknownMethod;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let found = Self::ALL.into_iter().find(|method| method.name() == name);
        found.ok_or_else(|| UnknownMethod(name.to_owned()))
    }
}

/// Computes what each cell sees.
///
/// # Errors
/// When cancelled.
pub fn compute(
    world: &World,
    graph: &CellGraph,
    scenery: &Scenery,
    settings: &VisibilitySettings,
    progress: &dyn Progress,
) -> Result<Visibility, Cancelled> {
    let count = graph.cells.len();
    let sampled = settings.sampled.unwrap_or_else(|| SampledSettings::for_cells(count));
    // Sampling; then proofs for a few cells, for all of them, and doors.
    progress.start(Stage::Visibility, sampled.steps(count) + 3 * count as u64);
    // Who proves needs no guard against what rays miss, which would show what lies beyond an opening that is a roof.
    let guard_m = if settings.method == Method::Sampled {
        graph.voxel_m as f32
    } else {
        0.0
    };
    let mut survey = Survey::new(world, graph, &sampled, guard_m, progress);
    survey.look()?;
    let mut proofs = settings.method.proofs();
    let ask = |settings| {
        move |cell: usize, sampler: &mut Sampler| {
            let eye = Region::of_cell(world, &graph.cells[cell]);
            let (seen, mut observer) = (sampler.seen(), Observer::new(scenery, settings));
            observer.visible_or_found(&eye, &seen, &mut |part, object| sampler.look_from(part, object))
        }
    };
    if let (Method::Auto, Some(thorough)) = (settings.method, proofs) {
        let step = count.div_ceil(TRIED_CELLS).max(1);
        let tried = survey.search(|cell, sampler| (cell % step == 0).then(|| ask(thorough)(cell, sampler).len()))?;
        let not_hidden: usize = tried.iter().flatten().sum();
        let seen: usize = survey.seen_counts().step_by(step).sum();
        if not_hidden as f64 > TIGHT * seen as f64 {
            proofs = Some(ConservativeSettings {
                halvings: FEW_HALVINGS,
                target_halvings: 0,
                ..thorough
            });
        }
    } else {
        progress.advance(count as u64);
    }
    let not_hidden = match proofs {
        Some(proofs) => Some(survey.search(ask(proofs))?),
        None => {
            progress.advance(count as u64);
            None
        }
    };
    let sightings = survey.sightings();
    let mut cells = survey.measured()?;
    let mean = |total: usize| total as f64 / count.max(1) as f64;
    let mean_seen = mean(cells.iter().map(|cell| cell.objects.len()).sum());
    let mean_not_hidden = not_hidden.as_ref().map(|sets| {
        // Whatever measuring rays still found is in both.
        let extra = cells.iter().zip(sets).map(|(cell, set)| unseen(cell, set).len());
        mean_seen + mean(extra.sum())
    });
    let (method, reason) = decide(settings.method, mean_seen, mean_not_hidden);
    if let Some(not_hidden) = not_hidden.filter(|_| method != Method::Sampled) {
        for (cell, not_hidden) in cells.iter_mut().zip(not_hidden) {
            add_unseen(cell, &not_hidden);
        }
    }
    doors::mark(world, graph, scenery, &sightings, &mut cells, progress)?;
    Ok(Visibility {
        cells,
        method,
        guarantee: if method == Method::Sampled {
            Guarantee::Sampled
        } else {
            Guarantee::Conservative
        },
        mean_seen,
        mean_not_hidden,
        reason,
    })
}

fn decide(wanted: Method, mean_seen: f64, mean_not_hidden: Option<f64>) -> (Method, String) {
    let ratio = mean_not_hidden.map(|n| n / mean_seen.max(f64::MIN_POSITIVE));
    match (wanted, ratio) {
        (Method::Auto, Some(ratio)) if ratio <= WORTH => (
            Method::Conservative,
            format!("sets that are proved complete hold {ratio:.2} times what rays have seen"),
        ),
        (Method::Auto, Some(ratio)) => (
            Method::Sampled,
            format!("sets that are proved complete would hold {ratio:.2} times what rays have seen, more than {WORTH}"),
        ),
        (wanted, Some(ratio)) => (wanted, format!("asked for; {ratio:.2} times what rays have seen")),
        (wanted, None) => (wanted, "asked for".to_owned()),
    }
}

/// What of a set no ray has seen.
fn unseen(cell: &CellVisibility, not_hidden: &[u32]) -> Vec<u32> {
    let mut seen: Vec<_> = cell.objects.iter().map(|s| s.object).collect();
    seen.sort_unstable();
    let unseen = not_hidden.iter().filter(|o| seen.binary_search(o).is_err());
    unseen.copied().collect()
}

/// Completes what rays saw with what nobody can prove hidden.
fn add_unseen(cell: &mut CellVisibility, not_hidden: &[u32]) {
    let unseen = unseen(cell, not_hidden).into_iter();
    cell.objects.extend(unseen.map(|object| SeenObject {
        object,
        fraction: UNSEEN_FRACTION,
        solid_angle: UNSEEN_SR,
        doors: Vec::new(),
    }));
    cell.objects
        .sort_by(|a, b| b.solid_angle.total_cmp(&a.solid_angle).then(a.object.cmp(&b.object)));
    cell.miss_bound = 0.0;
}
