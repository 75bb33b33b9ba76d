//! What is a procedural model? A text of rules that grows the same triangles on every machine.
//!
//! After Schmalstieg, *The Remote Rendering Pipeline* (1997), chapter 8: a directed cyclic graph, equivalent to a
//! parametric L-system, of groups, selections, calculations, transforms and terminals. `docs/PROCEDURAL.md` is its
//! specification, `viewer/core/procedural` the same in TypeScript.
//!
//! A tour, in the order in which data flows:
//!
//! * [`lexer`], [`parser`] and [`link`]: from texts to a [`Program`], which is [`syntax`] with every name resolved.
//! * [`evaluator`]: from a program and [`Settings`] to a [`Grown`] model, or only to its bounds.
//! * [`solid`]: from the numbers of a terminal to triangles.
//! * [`arithmetic`], [`random`], [`affine`]: what must give the same bits everywhere.
//! * [`limits`], [`problem`], [`wording`], [`signs`], [`columns`] and [`error`]: what a model may take, and what is said when it is wrong.
//!
//! Guarantee: the same texts, parameters, seed and level of detail give the same bits, on every platform and in both
//! languages. Any text gives a model or an error, in bounded time and memory.

pub mod affine;
pub mod arithmetic;
mod columns;
mod error;
mod evaluator;
mod foreign;
mod given;
mod grown;
mod lexer;
pub mod limits;
mod link;
mod operation;
mod parser;
mod problem;
pub mod random;
mod recipe;
mod signs;
mod solid;
mod spelling;
mod syntax;
#[cfg(test)]
mod tests;
mod value;
mod wording;

pub use error::{Caller, DcgError, is_order};
pub use evaluator::{
    Boxes, PHASE, Settings, Watch, bounds, bounds_watched, grow, grow_part, grow_part_watched, grow_watched, grow_with,
};
pub use given::in_place_of_text;
pub use grown::{Grown, Instance, Part, Placement, SaidInFile, Surface};
pub use limits::{Limits, Usage};
pub use link::{Loader, NoImports, Program};
pub use parser::tidied;
pub use problem::Problem;
pub use recipe::Recipe;
pub use solid::Mesh;
pub use spelling::nearest;
pub use value::Value;
pub use wording::cut;
