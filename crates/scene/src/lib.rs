//! What does a published scene look like?
//!
//! This crate is the only thing that the offline half (`belvedere-bake`), the server and the client share: the
//! vocabulary of a published scene and its encodings. It does no I/O and nothing in it is async.
//!
//! A tour, from the outside in:
//!
//! * [`id`]: names of things (`o9`, `c12`, `m3`, a [`BlobHash`], a [`SceneName`]).
//! * [`bounds`]: axis-aligned boxes in metres.
//! * [`convex`]: convex cells: is a point inside?
//! * [`mod@pointer`]: the one small mutable document of a scene, and the list of scenes.
//! * [`manifest`]: the immutable entry of one revision; it names the roots of the two index trees.
//! * [`index`]: pages and chunks, through which a client finds a cell or an object without reading the whole world.
//! * [`smooth`]: smooth LODs: streams of which every beginning is a coarser mesh; their decoder.
//! * [`walk`]: from a known cell to the cell at a point nearby.
//! * [`procedural`]: models written as rules, and what grows out of them.
//! * [`object`]: object infos: where an object stands and which levels of detail it has.
//! * [`population`]: where grown models stand, in few bytes, for clients that grow rules themselves.
//! * [`impostor`]: pictures that stand for a model from far away, and which of them an eye needs.
//! * [`rung`]: the slices in which a smooth LOD is fetched, and what an object info says of them.
//! * [`bundle`]: many small objects, rungs and slices in one answer.
//! * [`foliage`]: where leaves hide a share of what is behind them.
//! * [`record`]: what is visible from one view cell; a compact binary form and a JSON twin.
//! * [`mod@start`]: all that one needs to know first in a cell where one may begin.
//!
//! `docs/FORMAT.md` specifies all of it to the byte.

pub mod bounds;
pub mod bundle;
pub mod convex;
pub mod foliage;
pub mod id;
pub mod impostor;
pub mod index;
pub mod manifest;
pub mod object;
pub mod pointer;
pub mod population;
pub mod procedural;
pub mod record;
pub mod rung;
pub mod smooth;
mod sound;
pub mod start;
pub mod walk;

pub use bounds::Bounds;
pub use id::{BlobHash, BlobHasher, BlobName, CellId, IdError, ModelId, ObjectId, Revision, SceneName};
