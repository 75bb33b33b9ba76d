//! Who hears of which moving object, and when?
//!
//! The online rules of one scene, as a state machine: inputs with their time go into a [`World`], events for sessions
//! come out. Nothing here waits, reads a clock or knows a wire; the server runs it in one task for each scene.
//!
//! * [`cells`]: where a point is, what a ball touches, what is seen from a cell: what the rules need of a published scene,
//!   and what closed doors leave of it.
//! * [`motion`]: poses, dead reckoning, trajectories.
//! * [`tbv`]: temporal bounding volumes: where a hidden mover surely is, and for how long.
//! * [`aoi`]: areas of interest with hysteresis.
//! * [`nodes`]: what the nodes of a scene tell each other, so that people meet who are connected to different ones.
//! * [`pace`]: how often and how much a session is told.
//! * [`crowd`]: who is hidden among many.
//! * [`event`]: what it is told.
//! * [`journal`]: what has happened, written down, and lived through again.
//! * [`world`]: the rules themselves. Who may see what is decided in `world::sight` and nowhere else.

pub mod aoi;
pub mod cells;
pub mod crowd;
pub mod event;
pub mod journal;
pub mod motion;
pub mod nodes;
pub mod pace;
mod screen;
mod screens;
pub mod tbv;
pub mod world;

pub use world::World;

/// Milliseconds of one clock, whose origin the caller chooses.
pub type Ms = i64;
