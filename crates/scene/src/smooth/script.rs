//! What must a writer know? Answers to what comes next in the story that [`super::replay`] tells.

use super::change::Change;
use super::fan::Star;
use super::geometry::Hood;
use super::split::Split;

/// What a writer tells; a reader has none.
pub trait Script {
    /// Whether another pass comes, and by how many bits its lattice is finer.
    fn pass(&mut self) -> Option<u32>;
    /// The new lowest bits of a vertex: x in bit 0, y, z.
    fn low_bits(&mut self, vertex: u32) -> usize;
    /// Whether a vertex is split in this pass.
    fn splits(&mut self, vertex: u32) -> bool;
    /// How the vertex is split that was just said to be, given the fans around it: written over an earlier split.
    fn split(&mut self, star: &Star, split: &mut Split);
    /// Where the new vertex is, on the present lattice. It is predicted from `hood`; the vertex it was split from is at
    /// `origin`.
    fn position(&mut self, hood: &Hood, origin: [i32; 3]) -> [i32; 3];
    /// What was done: new triangles have the numbers from `first` on, those of opened edges before the extra ones.
    fn born(&mut self, first: u32, change: &Change, split: &Split);
    /// The material of a triangle.
    fn material(&mut self, triangle: u32) -> u16;
    /// Which of the wedges that are present at a vertex one of its corners has; `None` for a new one.
    fn wedge(&mut self, vertex: u32, triangle: u32, present: &[u32]) -> Option<usize>;
    /// The values of a new wedge; they are asked for in order.
    fn values(&mut self, wedge: u32, values: &mut [i32]);
}

/// A reader tells nothing.
#[derive(Debug)]
pub(super) enum Nothing {}

impl Script for Nothing {
    fn pass(&mut self) -> Option<u32> {
        match *self {}
    }
    fn low_bits(&mut self, _: u32) -> usize {
        match *self {}
    }
    fn splits(&mut self, _: u32) -> bool {
        match *self {}
    }
    fn split(&mut self, _: &Star, _: &mut Split) {
        match *self {}
    }
    fn position(&mut self, _: &Hood, _: [i32; 3]) -> [i32; 3] {
        match *self {}
    }
    fn born(&mut self, _: u32, _: &Change, _: &Split) {
        match *self {}
    }
    fn material(&mut self, _: u32) -> u16 {
        match *self {}
    }
    fn wedge(&mut self, _: u32, _: u32, _: &[u32]) -> Option<usize> {
        match *self {}
    }
    fn values(&mut self, _: u32, _: &mut [i32]) {
        match *self {}
    }
}
