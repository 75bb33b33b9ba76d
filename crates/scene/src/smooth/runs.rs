//! How is a list put together from short runs of other lists, fast?
//!
//! Most runs have one to six numbers. A loop over each would end where no processor can guess it, so eight are copied
//! whatever the length, and what is too much is written over by the next run.

use super::stars::SMALLEST;

/// A list of numbers. Behind its end there is room for a run's worth of anything.
#[derive(Debug, Clone, Default)]
pub(super) struct Runs {
    numbers: Vec<u32>,
    length: usize,
}

impl Runs {
    /// Empties the list, and makes room for so many numbers.
    #[inline(always)]
    pub(super) fn clear(&mut self, room: usize) {
        self.length = 0;
        if self.numbers.len() < room + SMALLEST {
            self.numbers.resize(2 * (room + SMALLEST), 0);
        }
    }

    #[inline(always)]
    pub(super) fn length(&self) -> usize {
        self.length
    }

    #[inline(always)]
    pub(super) fn all(&self) -> &[u32] {
        &self.numbers[..self.length]
    }

    /// As many as a small block of a list holds; those behind the end are anything.
    #[inline(always)]
    pub(super) fn first_few(&self) -> [u32; SMALLEST] {
        self.numbers.first_chunk().copied().unwrap_or_default()
    }

    /// Numbers from a slice, which may go on behind them.
    #[inline(always)]
    pub(super) fn add_first(&mut self, from: &[u32], count: usize) {
        let to = &mut self.numbers[self.length..];
        match (to.first_chunk_mut::<SMALLEST>(), from.first_chunk::<SMALLEST>()) {
            (Some(to), Some(from)) if count <= SMALLEST => *to = *from,
            _ => to[..count].copy_from_slice(&from[..count]),
        }
        self.length += count;
    }

    /// The numbers of another list from `first` to before `end`.
    #[inline(always)]
    pub(super) fn add_run(&mut self, from: &Self, first: usize, end: usize) {
        self.add_first(&from.numbers[first..], end.saturating_sub(first));
    }

    /// The numbers from `first` to before `end` themselves.
    #[inline(always)]
    pub(super) fn add_numbers(&mut self, first: usize, end: usize) {
        let count = end.saturating_sub(first);
        let to = &mut self.numbers[self.length..];
        match to.first_chunk_mut::<SMALLEST>() {
            Some(to) if count <= SMALLEST => *to = std::array::from_fn(|i| (first + i) as u32),
            _ => to[..count]
                .iter_mut()
                .zip(first..end)
                .for_each(|(to, i)| *to = i as u32),
        }
        self.length += count;
    }

    /// One number. There must be room for it.
    #[inline(always)]
    pub(super) fn push(&mut self, number: u32) {
        self.numbers[self.length] = number;
        self.length += 1;
    }
}
