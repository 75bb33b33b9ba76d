//! Does Belvedere do what the papers did? `make evaluation` measures what they measured and writes `docs/EVALUATION.md`.
//!
//! * [`papers`]: their numbers;
//! * [`experiments`]: one module for each table or figure: what is asked, how it is measured, what it says;
//! * [`results`]: what is kept of a run, as JSON;
//! * [`page`], [`document`]: how results become Markdown and SVG, without running anything;
//! * [`streams`]: event streams, which are measured by a program of their own;
//! * [`host`], [`models`], [`timing`]: the program that is measured, meshes, clocks.

pub mod document;
pub mod experiments;
pub mod host;
pub mod models;
pub mod page;
pub mod papers;
pub mod results;
pub mod streams;
pub mod timing;
