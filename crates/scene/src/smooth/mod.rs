//! What is a smooth LOD? A stream of which every beginning is a coarser mesh of the same model.
//!
//! After Schmalstieg, *The Remote Rendering Pipeline* (1997), chapter 7: a tree of vertex clusters is undone from its root,
//! and each step tells one vertex more and what it changes in the triangles around. `docs/SLOD.md` specifies the bytes.
//!
//! A tour, from the outside in:
//!
//! * [`Decoder`]: bytes in, [`Snapshot`]s out. [`Header`]: what a file says before its stream.
//! * [`replay`]: the order of the story: passes over all known vertices. One function for reader and writer; [`script`] is
//!   what a writer brings.
//! * [`split`], [`fan`] and [`change`]: what becomes of the triangles around a vertex that is split.
//! * [`geometry`]: where the new vertex is. [`attributes`] and [`octahedron`]: what its corners look like.
//! * `model` and `rans`: how decisions become bits; [`draft`]: how a writer gets weights for where vertices are;
//!   [`course`]: what readers have after how many bytes.
//! * [`select`]: which triangles to draw from where.
//!
//! [`thesis`] reads the packets of the thesis itself.
//!
//! All arithmetic on which reader and writer must agree is on integers, exact also in languages with only 53 bits.

pub mod attributes;
pub mod change;
pub mod course;
mod decoder;
pub mod draft;
pub mod fan;
pub mod geometry;
mod header;
mod looks;
mod mesh;
mod model;
pub mod octahedron;
mod pass;
mod quotient;
mod rans;
pub mod replay;
mod residual;
mod runs;
pub mod script;
pub mod select;
mod snapshot;
pub mod split;
mod stars;
#[cfg(test)]
mod tests;
pub mod thesis;

pub use decoder::Decoder;
pub use header::{Cut, Header};
pub use snapshot::{Lattice, Snapshot};

/// Why a smooth LOD cannot be decoded.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SmoothError {
    /// It is something else.
    #[error("this is not a smooth LOD: it does not begin with \"SLOD\"")]
    NotSmooth,
    /// It is something else.
    #[error("these are not packets of a smooth LOD: they do not begin with \"SLTH\" and three extents")]
    NotThesis,
    /// It is from another time.
    #[error("this smooth LOD has version {0}, and only 2 is known: update this program or bake the scene again")]
    Version(u8),
    /// It may take too much memory.
    #[error("this smooth LOD may take {needed_bytes} bytes of memory, and {most_bytes} are allowed: raise the limit")]
    Memory {
        /// What its header asks for.
        needed_bytes: u64,
        /// What is allowed.
        most_bytes: u64,
    },
    /// It cannot be right.
    #[error("this smooth LOD is damaged: {0}; fetch it again")]
    Damaged(&'static str),
}
