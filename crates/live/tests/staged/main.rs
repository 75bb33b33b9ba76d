//! What do sessions hear of each other? Told on a stage, whose geometry is known; one binary, since all stand on it.

#![allow(missing_docs)]

mod crowds;
mod doors;
mod journal;
mod nodes;
mod plan;
mod properties;
mod showing;
mod stories;
