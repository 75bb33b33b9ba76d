//! Why can an author's cell not be a view cell, and where did the author draw it?

use std::{fmt, sync::Arc};

use super::author::MAX_FACES;
use crate::source::Said;

/// Why an author's cell cannot be a view cell, and where rules draw it, when rules do.
#[derive(Debug, Clone, PartialEq)]
pub struct AuthorError {
    /// What is wrong with it.
    pub flaw: CellFlaw,
    /// Where it was called a cell.
    pub said: Option<Arc<Said>>,
}

impl fmt::Display for AuthorError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match &self.said {
            Some(said) => f.write_str(&said.told(self.flaw.to_string())),
            None => self.flaw.fmt(f),
        }
    }
}

impl std::error::Error for AuthorError {}

/// What is wrong with an author's cell.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CellFlaw {
    /// Nothing to stand in.
    #[error(
        "author's cell `{node}` has no volume (shapes with a position that is not finite are left out): give it a closed \
         convex mesh, or take its mark `cell:` away"
    )]
    NoVolume {
        /// The name of its node.
        node: String,
    },
    /// The mesh has a hole.
    #[error(
        "author's cell `{node}` is not closed: of its surface, {} missing (shapes with a position that is not finite are \
         left out); close its mesh, or take its mark `cell:` away",
        told_area(*missing_m2)
    )]
    NotClosed {
        /// The name of its node.
        node: String,
        /// How much of its surface is missing; none where a whole side is, so that nothing says how far it would reach.
        missing_m2: Option<f64>,
    },
    /// The mesh has a dent.
    #[error(
        "author's cell `{node}` is not convex: it reaches {by_m:.3} m beyond one of its own faces; cut it into convex \
         cells"
    )]
    NotConvex {
        /// The name of its node.
        node: String,
        /// How far it reaches beyond a face.
        by_m: f64,
    },
    /// Too detailed.
    #[error("author's cell `{node}` has more than {MAX_FACES} faces: draw a simpler one")]
    TooManyFaces {
        /// The name of its node.
        node: String,
    },
    /// Two cells claim the same place.
    #[error(
        "author's cells `{node}` and `{other}` overlap by {by_m:.3} m: an eye there would be in both; make them touch \
         instead"
    )]
    Overlap {
        /// The name of one node.
        node: String,
        /// The name of the other.
        other: String,
        /// By how much.
        by_m: f64,
    },
    /// More than a record can hold.
    #[error(
        "author's cell `{node}` has {openings} openings, most of them into `{other}`, more than its record can hold: draw fewer \
         and simpler `portal:` polygons, or cut the cell into several"
    )]
    TooManyOpenings {
        /// The name of its node.
        node: String,
        /// The name of the node that most of them lead to.
        other: String,
        /// How many there are.
        openings: usize,
    },
}

impl CellFlaw {
    pub(super) fn said(self, said: &Option<Arc<Said>>) -> AuthorError {
        let said = said.clone();
        AuthorError { flaw: self, said }
    }
}

fn told_area(missing_m2: Option<f64>) -> String {
    missing_m2.map_or_else(
        || "a whole side is".to_owned(),
        |area_m2| format!("{area_m2:.3} m² are"),
    )
}
