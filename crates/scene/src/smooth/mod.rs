//! What is a smooth LOD? A stream of which every beginning is a coarser mesh of the same model.

mod decoder;
pub mod fan;
pub mod geometry;
mod mesh;
pub mod model;
pub mod rans;
pub mod replay;
pub mod split;
mod stars;

pub use decoder::{Decoder, SmoothError};
