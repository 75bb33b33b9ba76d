//! What does the source file hold?

pub mod plan;
