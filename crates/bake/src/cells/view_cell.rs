//! What is a view cell, and what does it hold?

use belvedere_scene::{
    Bounds,
    convex::{self, HalfSpace},
    record::Hull,
};

use super::{hull::CellHull, near::Boxes};
use crate::digest::{Digest, Digester};

/// All view cells of a scene; a cell's index is its id. Neighbours in space have near ids.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CellGraph {
    /// At least one.
    pub cells: Vec<ViewCell>,
    /// The longest edge of a voxel inside the scene, in metres: openings smaller than that may be closed. Of author's
    /// cells what counts as touching.
    pub voxel_m: f64,
    /// How the cells came about, for people.
    pub reason: String,
}

/// A convex region of eye positions.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewCell {
    /// The box around the region, in world space.
    pub bounds: Bounds,
    /// The region when it is not that box.
    pub hull: Option<CellHull>,
    /// Openings to neighbours, by neighbour.
    pub portals: Vec<Portal>,
    /// Cells with which it shares an opening, rising.
    pub adjacent: Vec<u32>,
}

/// An opening between two cells. Both cells know it.
#[derive(Debug, Clone, PartialEq)]
pub struct Portal {
    /// Index of the cell on the other side.
    pub to: u32,
    /// A convex polygon in world space: its corners in order around it.
    pub polygon: Vec<[f64; 3]>,
    /// The object that closes it, if it is a door.
    pub door: Option<u32>,
}

/// Cells that can be found by place.
pub(crate) struct CellsByPlace<'a> {
    cells: &'a [ViewCell],
    boxes: Boxes,
}

impl CellsByPlace<'_> {
    /// As [`CellGraph::cell_at`].
    pub(crate) fn cell_at(&self, point: [f64; 3]) -> Option<u32> {
        let mut near = self.boxes.holding(point).into_iter();
        near.find(|cell| self.cells[*cell as usize].contains(point))
    }
}

impl CellGraph {
    /// The cell that contains a point in world space; the one with the smallest id where two touch.
    #[must_use]
    pub fn cell_at(&self, point: [f64; 3]) -> Option<u32> {
        let holder = self.cells.iter().position(|cell| cell.contains(point));
        holder.map(|index| index as u32)
    }

    /// The cells, for who asks about many points.
    pub(crate) fn by_place(&self) -> CellsByPlace<'_> {
        CellsByPlace {
            cells: &self.cells,
            boxes: Boxes::of(self.cells.iter().map(|cell| cell.bounds).collect()),
        }
    }

    /// Adds an opening to both of its cells.
    pub(super) fn join(&mut self, [a, b]: [u32; 2], polygon: &[[f64; 3]]) {
        for (cell, to) in [(a, b), (b, a)] {
            self.cells[cell as usize].portals.push(Portal {
                to,
                polygon: polygon.to_vec(),
                door: None,
            });
        }
    }

    /// Orders openings by neighbour and notes who is adjacent to whom.
    pub(super) fn settle(&mut self) {
        for cell in &mut self.cells {
            cell.portals.sort_by_key(|portal| portal.to);
            cell.adjacent = cell.portals.iter().map(|portal| portal.to).collect();
            cell.adjacent.dedup();
        }
    }
}

impl ViewCell {
    /// A digest of where it is.
    pub(crate) fn digest_of_shape(&self) -> Digest {
        let mut digester = Digester::default();
        digester.doubles(&self.bounds.min).doubles(&self.bounds.max);
        let planes = self.planes();
        digester.count(planes.len());
        planes.iter().for_each(|plane| _ = digester.doubles(plane));
        digester.finish()
    }

    /// A digest of where it is and where its openings are.
    pub(crate) fn digest(&self) -> Digest {
        let mut digester = Digester::default();
        digester.add(self.digest_of_shape()).count(self.portals.len());
        for portal in &self.portals {
            digester.count(portal.polygon.len());
            portal.polygon.iter().for_each(|corner| _ = digester.doubles(corner));
        }
        digester.finish()
    }

    /// A box without neighbours.
    #[must_use]
    pub fn of_box(bounds: Bounds) -> Self {
        Self {
            bounds,
            hull: None,
            portals: Vec::new(),
            adjacent: Vec::new(),
        }
    }

    /// A polyhedron without neighbours.
    #[must_use]
    pub fn of_hull(hull: CellHull) -> Self {
        Self {
            bounds: hull.bounds(),
            hull: Some(hull),
            portals: Vec::new(),
            adjacent: Vec::new(),
        }
    }

    /// Its half-spaces; none when it is its box.
    #[must_use]
    pub fn planes(&self) -> &[HalfSpace] {
        self.hull.as_ref().map_or(&[], |hull| &hull.planes)
    }

    /// Its corners and faces.
    #[must_use]
    pub fn shape(&self) -> Hull {
        let of_box = || Hull::of_box(&self.bounds);
        self.hull.as_ref().map_or_else(of_box, |hull| hull.shape.clone())
    }

    /// Whether a point lies in it or on its surface.
    #[must_use]
    pub fn contains(&self, point: [f64; 3]) -> bool {
        self.distance_m(point) == 0.0
    }

    /// Whether a box lies in it.
    #[must_use]
    pub fn contains_box(&self, bounds: &Bounds) -> bool {
        let corners_in = || bounds.corners().into_iter().all(|corner| self.contains(corner));
        self.bounds.contains(bounds.min) && self.bounds.contains(bounds.max) && (self.hull.is_none() || corners_in())
    }

    /// Zero inside, else how far away a point is, see [`convex::distance_m`].
    #[must_use]
    pub fn distance_m(&self, point: [f64; 3]) -> f64 {
        convex::distance_m(&self.bounds, self.planes(), point)
    }

    /// A point well inside: the middle of its corners.
    #[must_use]
    pub fn center(&self) -> [f64; 3] {
        match &self.hull {
            None => self.bounds.center(),
            Some(hull) => {
                let count = hull.shape.points.len() as f64;
                [0, 1, 2].map(|axis| hull.shape.points.iter().map(|p| p[axis]).sum::<f64>() / count)
            }
        }
    }
}
