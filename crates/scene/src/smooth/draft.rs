//! How does a writer find out how positions are predicted best, without telling its story twice?
//!
//! Weights change what is coded of positions and nothing else. So a stream is first told as a draft, in which every position
//! stands with what surrounds it; when the weights are known, what was noted is copied and the positions are put in.

use super::geometry::{Hood, Weights};
use super::mesh::Birth;
use super::model::{Bit, Nibble};
use super::rans::{Coder, Writer};
use super::residual::ResidualModels;

/// A stream as it was told, but for positions.
#[derive(Debug, Default)]
pub struct Draft {
    writer: Writer,
    places: Vec<Place>,
    /// Numbers of decisions before each pass, without those of positions.
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

impl Draft {
    /// A pass begins.
    pub(super) fn begin_pass(&mut self) {
        self.passes.push(self.writer.decisions());
    }

    /// The stream with these weights, and how many bytes of it decide what comes before each pass.
    #[must_use]
    pub fn finish(mut self, weights: &Weights) -> (Vec<u8>, Vec<usize>) {
        let mut models = ResidualModels::default();
        let mut writer = Writer::default();
        let mut marks = Vec::with_capacity(self.passes.len());
        let mut passes = self.passes.into_iter().peekable();
        let mut copied = 0;
        for (place, vertex) in self.places.into_iter().zip(1..) {
            // A pass tells how it begins before any position.
            while let Some(pass) = passes.next_if(|pass| *pass < place.decisions) {
                writer.copy(&self.writer, copied..pass);
                copied = pass;
                marks.push(writer.decisions());
            }
            writer.copy(&self.writer, copied..place.decisions);
            copied = place.decisions;
            let parent = self.births[vertex].parent;
            let before = self.births[parent as usize].shared;
            let (_, shared) = models.code(&mut writer, &place.hood, weights, usize::from(before), place.way);
            self.births[vertex].shared = shared as u8;
        }
        for pass in passes {
            writer.copy(&self.writer, copied..pass);
            copied = pass;
            marks.push(writer.decisions());
        }
        writer.copy(&self.writer, copied..self.writer.decisions());
        writer.finish(&marks)
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
