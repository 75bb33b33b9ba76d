//! Which triangles meet at a vertex? Lists in one array, in blocks of 8, 16, 32 … places that are used again.

use super::mesh::NONE;
use super::runs::Runs;

/// The places of all lists.
#[derive(Debug, Clone, Default)]
pub(super) struct Stars {
    places: Vec<u32>,
    /// First places of unused blocks, by class.
    free: Vec<Vec<u32>>,
}

/// A list. Made by [`Stars::empty`].
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct List {
    first: u32,
    /// Its length, and in the lowest bits the class of its block, which has 8 · 2^class places.
    shape: u32,
}

/// Places of the smallest block, and as many as are copied at once.
pub(super) const SMALLEST: usize = 8;
const CLASS_BITS: u32 = 5;
/// No list may be longer.
pub(super) const MOST_LENGTH: u32 = u32::MAX >> CLASS_BITS;

impl List {
    #[inline(always)]
    pub(super) fn length(self) -> usize {
        (self.shape >> CLASS_BITS) as usize
    }

    #[inline(always)]
    fn class(self) -> u32 {
        self.shape & ((1 << CLASS_BITS) - 1)
    }

    #[inline(always)]
    fn room(self) -> usize {
        SMALLEST << self.class()
    }

    #[inline(always)]
    fn set_length(&mut self, length: usize) {
        self.shape = (length as u32) << CLASS_BITS | self.class();
    }
}

/// No sound stream needs more places than this.
pub(super) fn most_places(vertices: u32, triangles: u32) -> usize {
    (16 * u64::from(vertices) + 32 * u64::from(triangles) + 1024) as usize
}

impl Stars {
    /// Makes room for the lists of so many vertices in all.
    pub(super) fn reserve(&mut self, vertices: usize) {
        let places = SMALLEST * vertices;
        self.places.reserve(places.saturating_sub(self.places.len()));
    }

    /// A list without triangles.
    #[inline(always)]
    pub(super) fn empty(&mut self) -> List {
        List {
            first: self.block(0),
            shape: 0,
        }
    }

    #[inline(always)]
    pub(super) fn of(&self, list: List) -> &[u32] {
        &self.places[list.first as usize..][..list.length()]
    }

    /// Adds a list to another, which has room for it.
    #[inline(always)]
    pub(super) fn copy(&self, list: List, to: &mut Runs) {
        to.add_first(&self.places[list.first as usize..], list.length());
    }

    /// How many places there are.
    pub(super) fn places(&self) -> usize {
        self.places.len()
    }

    /// Replaces a list.
    #[inline(always)]
    pub(super) fn set(&mut self, list: &mut List, triangles: &Runs) {
        let length = triangles.length();
        // Too little room, or so much that most of it would stay empty.
        if length > list.room() || (list.class() > 0 && 4 * length < list.room()) {
            self.move_to(list, length, 0);
        }
        list.set_length(length);
        let places = &mut self.places[list.first as usize..];
        match places.first_chunk_mut::<SMALLEST>() {
            Some(block) if length <= SMALLEST => *block = triangles.first_few(),
            _ => places[..length].copy_from_slice(triangles.all()),
        }
    }

    /// Puts a triangle after or before another, or at the end if that is not there; for [`NONE`] it is not looked for.
    #[inline(always)]
    pub(super) fn insert(&mut self, list: &mut List, (neighbour, after): (u32, bool), triangle: u32) {
        let length = list.length();
        if length >= SMALLEST {
            return self.insert_into_long(list, (neighbour, after), triangle);
        }
        list.set_length(length + 1);
        let Some(block) = self.places[list.first as usize..].first_chunk_mut::<SMALLEST>() else {
            return;
        };
        // All places at once, whatever the list's length: loops of a few steps end where nobody can guess it.
        let before = *block;
        let mut at = length;
        for i in (0..SMALLEST).rev() {
            at = if before[i] == neighbour { i } else { at };
        }
        let at = if at < length { at + usize::from(after) } else { length };
        *block = std::array::from_fn(|i| {
            let moved = if i > at { before[i.saturating_sub(1)] } else { before[i] };
            if i == at { triangle } else { moved }
        });
    }

    #[cold]
    fn insert_into_long(&mut self, list: &mut List, (neighbour, after): (u32, bool), triangle: u32) {
        let length = list.length();
        if length == list.room() {
            self.move_to(list, length + 1, length);
        }
        list.set_length(length + 1);
        let places = &mut self.places[list.first as usize..][..length + 1];
        let known = (neighbour != NONE).then_some(&places[..length]);
        let found = known.and_then(|places| places.iter().position(|&t| t == neighbour));
        let at = found.map_or(length, |at| at + usize::from(after));
        places.copy_within(at..length, at + 1);
        places[at] = triangle;
    }

    /// Gives a list another block, as large as it needs; its first `kept` places stay.
    #[cold]
    #[inline(never)]
    fn move_to(&mut self, list: &mut List, length: usize, kept: usize) {
        let class = length.div_ceil(SMALLEST).max(1).next_power_of_two().ilog2();
        let first = self.block(class);
        let old = list.first as usize;
        self.places.copy_within(old..old + kept, first as usize);
        let class_before = list.class() as usize;
        if self.free.len() <= class_before {
            self.free.resize(class_before + 1, Vec::new());
        }
        self.free[class_before].push(list.first);
        list.first = first;
        list.shape = (list.shape >> CLASS_BITS) << CLASS_BITS | class;
    }

    #[inline(always)]
    fn block(&mut self, class: u32) -> u32 {
        let unused = self.free.get_mut(class as usize).and_then(Vec::pop);
        unused.unwrap_or_else(|| {
            let first = self.places.len();
            self.places.resize(first + (SMALLEST << class), 0);
            first as u32
        })
    }
}
