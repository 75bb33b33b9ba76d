//! What to fetch next, and why? The client's strategy without any I/O and without a clock of its own: given what is visible
//! here, which cells may be entered soon, what is held and on its way, and the budgets, it says which request comes next. The
//! same rules as in `viewer/core/strategy` (`docs/STRATEGY.md`); [`crate::tour`] and [`crate::Explorer`] carry them out.
//!
//! * [`plan`](mod@plan): what is wanted of what is visible ([`priority`]: how urgent, and why; [`grade`]: levels, rungs or rules,
//!   of which many models count a share each);
//! * [`ahead`]: which cells may be entered soon, by [`motion`];
//! * [`planner`]: wishes become requests: alone, in packs, in [`bundles`], as much as the line ([`meter`]) and memory take;
//! * [`order`]: what the planner takes and gives;
//! * [`residency`]: what is held, by reference counts, and what goes ([`nearness`]), on which terms ([`memory`]);
//! * [`progress`]: how much of what one can see is here.

pub mod ahead;
pub mod bundles;
pub mod file;
pub mod grade;
pub mod memory;
pub mod meter;
mod models;
pub mod motion;
pub mod nearness;
pub mod order;
pub mod plan;
pub mod planner;
pub mod priority;
pub mod progress;
pub mod residency;
mod sharing;
pub mod sight;
#[cfg(test)]
pub(crate) mod tests;
