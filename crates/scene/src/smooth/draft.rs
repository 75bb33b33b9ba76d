//! How does a writer find out how positions are predicted best, without telling its story twice?
//!
//! Weights change what is coded of positions and nothing else. So a stream is first told as a draft, in which every position
//! stands with what surrounds it; when the weights are known, what was noted is copied and the positions are put in. What readers
//! wait for is noted too, so that it is known what they have after how many bytes.

use super::course::{Course, Told};
use super::geometry::{Hood, Weights};
use super::mesh::Birth;
use super::model::{Bit, Nibble};
use super::rans::{Coder, Writer};
use super::residual::ResidualModels;

/// About so many decisions, but for positions, and waits are there for each vertex: arrays with room for these are moved seldom.
const DECISIONS: usize = 16;
const WAITS: usize = 8;

/// A stream as it was told, but for positions.
#[derive(Debug, Default)]
pub struct Draft {
    writer: Writer,
    places: Vec<Place>,
    waits: Vec<Wait>,
    /// The wait with which each pass begins.
    passes: Vec<usize>,
    pub(super) births: Vec<Birth>,
}

/// A position that is still to be coded.
#[derive(Debug)]
struct Place {
    /// So many decisions come before it, without those of positions.
    decisions: usize,
    hood: Hood,
    /// From the old vertex.
    way: [i32; 3],
}

/// What a reader waits for before it goes on.
#[derive(Debug)]
struct Wait {
    /// So many decisions come before it, without those of positions.
    decisions: usize,
    bytes: u32,
    told: Told,
}

impl Draft {
    /// Before anything is told of a mesh that will have so many vertices.
    pub(super) fn new(vertices: usize) -> Self {
        Self {
            writer: Writer::with_room(DECISIONS * vertices),
            places: Vec::with_capacity(vertices),
            waits: Vec::with_capacity(WAITS * vertices),
            ..Self::default()
        }
    }

    /// A pass begins.
    pub(super) fn begin_pass(&mut self) {
        self.passes.push(self.waits.len());
    }

    /// The stream with these weights, and what of it decides what.
    #[must_use]
    pub fn finish(mut self, weights: &Weights) -> (Vec<u8>, Course) {
        let mut models = ResidualModels::default();
        let mut writer = Writer::with_room(self.writer.decisions() + DECISIONS * self.places.len());
        let mut marks = Vec::with_capacity(self.waits.len());
        let mut waits = self.waits.iter().peekable();
        let mut copied = 0;
        for (place, vertex) in self.places.iter().zip(1..) {
            let of_positions = writer.decisions() - copied;
            while let Some(wait) = waits.next_if(|wait| wait.told.vertices <= vertex) {
                marks.push(wait.decisions + of_positions);
            }
            writer.copy(&self.writer, copied..place.decisions);
            copied = place.decisions;
            let parent = self.births[vertex as usize].parent;
            let before = self.births[parent as usize].shared;
            let (_, shared) = models.code(&mut writer, &place.hood, weights, usize::from(before), place.way);
            self.births[vertex as usize].shared = shared as u8;
        }
        let of_positions = writer.decisions() - copied;
        marks.extend(waits.map(|wait| wait.decisions + of_positions));
        writer.copy(&self.writer, copied..self.writer.decisions());
        let (bytes, ends) = writer.finish(&marks);
        let passes = self.passes.iter().map(|&wait| ends[wait]).collect();
        let steps = self
            .waits
            .iter()
            .zip(&ends)
            .map(|(wait, end)| (end + wait.bytes as usize, wait.told));
        (bytes, Course::new(passes, steps.collect()))
    }
}

impl Coder for Draft {
    const WRITES: bool = true;

    #[inline(always)]
    fn bit(&mut self, model: &mut Bit, bit: bool) -> bool {
        self.writer.bit(model, bit)
    }

    #[inline(always)]
    fn symbol(&mut self, model: &mut Nibble, symbol: usize) -> usize {
        self.writer.symbol(model, symbol)
    }

    #[inline(always)]
    fn raw(&mut self, bits: u32, value: u32) -> u32 {
        self.writer.raw(bits, value)
    }

    #[inline(always)]
    fn has(&mut self, bytes: usize, told: Told) -> bool {
        self.waits.push(Wait {
            decisions: self.writer.decisions(),
            bytes: bytes as u32,
            told,
        });
        true
    }

    #[inline(always)]
    fn place(
        &mut self,
        _: &mut ResidualModels,
        hood: &Hood,
        _: &Weights,
        _: usize,
        way: [i32; 3],
    ) -> ([i32; 3], usize) {
        self.places.push(Place {
            decisions: self.writer.decisions(),
            hood: *hood,
            way,
        });
        (way, 0)
    }
}
