//! Which triangles of one smooth LOD are worth drawing from here? Fine ones near the eye and in the view, few far away.
//!
//! Schmalstieg, *The Remote Rendering Pipeline* (1997), §7.6, "variable resolution within one object", as Luebke & Erikson,
//! *View-dependent simplification of arbitrary polygonal environments* (1997), carry it out: a cut of the tree of vertex
//! clusters is kept from frame to frame, and each corner of a triangle is drawn where the cluster is that holds it. Two
//! neighbours share their corners in every cut, so there are no cracks; a triangle is there only when its corners lie in
//! three clusters.
//!
//! * [`tree`]: the clusters, and what leaving out a split costs. [`front`]: one cut and the triangles that it gives.
//! * [`view`]: which splits an eye needs. [`selection`]: how a cut follows it, a bounded amount of work at a time.
//!
//! `viewer/core/select` does the same in the same order, with the same floating-point operations: the same
//! stream and the same views give the same triangles, bit for bit (`tests/golden/smooth/views.json`).

mod around;
mod distance;
mod front;
mod selection;
#[cfg(test)]
mod tests;
mod tree;
mod view;

pub use selection::{Progress, Selection};
pub use tree::ClusterTree;
pub use view::View;
