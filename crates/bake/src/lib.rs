//! How does a source file become a published scene?
//!
//! The offline half of Belvedere, one module for each stage, in the order in which data flows:
//!
//! 1. [`import`] reads a glTF file, a zip of one or a floor plan into a [`source::SourceScene`] and counts its defects;
//! 2. [`cells`] cuts the free space into convex view cells with portals;
//! 3. [`visibility`] finds for each cell the objects and cells that can be seen from it;
//!    `foliage` measures what hides a share of what is behind it;
//! 4. [`lod`] makes levels of detail, each with a true object-space error;
//!    [`glb`] writes them as files that any glTF viewer opens; [`smooth`] writes smooth LODs, of which every beginning
//!    is a coarser mesh; [`impostors`] draws pictures that stand for a model from far away;
//! 5. [`records`] writes all of it as the immutable objects of one revision.
//!
//! There is no clock, no I/O and no randomness that is not seeded here: the same source gives the same bytes, whatever
//! the thread count. Progress and cancelling are arguments.

pub mod cells;
pub mod city;
mod cutting;
#[cfg(test)]
mod cutting_tests;
pub mod defect;
pub mod digest;
mod foliage;
pub mod frame;
pub mod glb;
mod groups;
pub mod growable;
pub mod import;
pub mod impostors;
pub mod lod;
pub mod memory;
mod meshopt_view;
mod morton;
pub mod occluders;
pub mod pictures;
mod pipeline;
pub mod progress;
mod radix;
mod random;
pub mod records;
mod share;
pub mod smooth;
pub mod source;
pub mod visibility;
pub mod world;

pub use pipeline::{BakeError, BakeSettings, FirstRevision, Host, Source, as_published, bake};
