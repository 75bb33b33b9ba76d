//! Which material has each new triangle? Mostly that of the one beside it around the new vertex.

use super::super::mesh::Mesh;
use super::super::model::{Nibble, number};
use super::super::rans::Coder;
use super::super::script::Script;
use super::Done;

/// Materials of triangles, if there are several.
#[derive(Debug, Clone)]
pub(super) struct Materials {
    of: Vec<u16>,
    count: u32,
    same: Nibble,
    which: Nibble,
    /// Where each new triangle stands in the star of the new vertex.
    places: Vec<u32>,
}

impl Materials {
    pub(super) fn new(count: u32) -> Self {
        Self {
            of: Vec::new(),
            count,
            same: Nibble::default(),
            which: Nibble::default(),
            places: Vec::new(),
        }
    }

    /// Whether triangles differ.
    pub(super) fn are_told(&self) -> bool {
        self.count > 1
    }

    pub(super) fn reserve(&mut self, triangles: usize) {
        if self.are_told() {
            self.of.reserve(triangles.saturating_sub(self.of.len()));
        }
    }

    pub(super) fn of(&self, triangle: usize) -> u16 {
        self.of.get(triangle).copied().unwrap_or(0)
    }

    /// Tells those of new triangles.
    pub(super) fn code<C: Coder, S: Script>(
        &mut self,
        coder: &mut C,
        mesh: &Mesh,
        mut script: Option<&mut S>,
        split: Done,
    ) {
        let star = mesh.stars.of(mesh.points[split.new as usize].star);
        self.places.clear();
        self.places.resize(mesh.triangles.len() - split.first as usize, 0);
        for (place, &triangle) in (0..).zip(star) {
            let new = triangle.checked_sub(split.first);
            if let Some(known) = new.and_then(|new| self.places.get_mut(new as usize)) {
                *known = place;
            }
        }
        for (triangle, &at) in (split.first..).zip(&self.places) {
            // As the triangle before it around the new vertex, or else the next one that is known.
            let (behind, ahead) = star.split_at(at as usize);
            let near = behind.iter().rev().chain(ahead).find(|&&t| t < triangle);
            let expected = near.map_or(0, |&t| self.of[t as usize]);
            let given = script.as_mut().map_or(0, |script| script.material(triangle));
            let differs = usize::from(given != expected);
            let mut material = expected;
            if coder.symbol(&mut self.same, differs) > 0 {
                material = number(coder, &mut self.which, u32::from(given)).min(self.count - 1) as u16;
            }
            self.of.push(material);
        }
    }
}
