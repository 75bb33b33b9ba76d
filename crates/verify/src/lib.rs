//! Is every object that one can see from a cell in the cell's visible set?
//!
//! An oracle: it knows a published scene ([`belvedere_scene`]) and nothing of how the sets were made. It stands eyes
//! into each cell, draws what a renderer would draw on the six faces of a cube around each, and looks for objects in
//! the picture that the record does not list. What it finds is true as far as it goes: eyes and pixels are finite, so
//! a clean answer is evidence, and a miss that is confirmed in double precision is proof.
//!
//! A tour, in the order of the data:
//!
//! * [`glb`]: a published level 0 becomes a [`scene::Model`].
//! * [`scene`]: what is drawn, and which sides of it show and hide.
//! * [`eyes`]: where one looks from: at random, and where sets are wrong most easily.
//! * [`cube`]: the item buffer (Weghorst, Hooper and Greenberg, *Improved Computational Methods for Ray Tracing*,
//!   1984): which object shows at each pixel.
//! * [`sight`]: single sight lines in `f64`, which confirm or reject what the item buffer claims.
//! * [`blockade`]: straight ways between any two points, many of them, doors open or closed.
//! * [`between`]: whether any sight line leads from one cell into another; `shut`: a proof that none does; `flat`: what is covered
//!   in a plane; `block`: a box.
//! * [`check`]: all cells, all eyes, and what came out; [`closed`]: the same with doors closed, [`leaf`] being how these stand.
//! * [`mod@line`]: one sight line from a cell to an object.
//! * [`verdict`]: whether that is good enough.
//! * [`picture`]: a view for people.
//!
//! `docs/VERIFY.md` states the semantics that the sets are held to.

pub mod between;
mod block;
pub mod blockade;
pub mod check;
pub mod closed;
pub mod cube;
pub mod eyes;
mod flat;
pub mod glb;
pub mod leaf;
pub mod line;
pub mod picture;
mod random;
pub mod scene;
mod shut;
pub mod sight;
pub mod verdict;

#[cfg(test)]
mod testing;
