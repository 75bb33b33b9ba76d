//! Which triangles meet at a vertex? Lists in one array, in blocks of 8, 16, 32 … places that are used again.

/// The places of all lists.
#[derive(Debug, Default)]
pub(super) struct Stars {
    places: Vec<u32>,
    /// First places of unused blocks, by class.
    free: Vec<Vec<u32>>,
}

/// A list. Made by [`Stars::empty`].
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct List {
    first: u32,
    pub(super) length: u32,
    /// The block has 8 · 2^class places.
    class: u8,
}

const SMALLEST: usize = 8;

/// No sound stream needs more places than this.
pub(super) fn most_places(vertices: u32, triangles: u32) -> usize {
    (16 * u64::from(vertices) + 32 * u64::from(triangles) + 1024) as usize
}

impl Stars {
    /// A list without triangles.
    pub(super) fn empty(&mut self) -> List {
        List {
            first: self.block(0),
            ..List::default()
        }
    }

    #[inline(always)]
    pub(super) fn of(&self, list: List) -> &[u32] {
        &self.places[list.first as usize..][..list.length as usize]
    }

    /// How many places there are.
    pub(super) fn places(&self) -> usize {
        self.places.len()
    }

    /// Replaces a list.
    #[inline(always)]
    pub(super) fn set(&mut self, list: &mut List, triangles: &[u32]) {
        self.make_room(list, triangles.len(), 0);
        if list.class > 0 && 4 * triangles.len() < SMALLEST << list.class {
            // Much room would stay empty.
            self.move_to(list, triangles.len(), 0);
        }
        list.length = triangles.len() as u32;
        self.places[list.first as usize..][..triangles.len()].copy_from_slice(triangles);
    }

    /// Puts a triangle after or before another, or at the end if that is not there.
    #[inline(always)]
    pub(super) fn insert(&mut self, list: &mut List, (neighbour, after): (u32, bool), triangle: u32) {
        let length = list.length as usize;
        self.make_room(list, length + 1, length);
        list.length += 1;
        let places = &mut self.places[list.first as usize..][..length + 1];
        let found = places[..length].iter().position(|&t| t == neighbour);
        let at = found.map_or(length, |at| at + usize::from(after));
        for i in (at..length).rev() {
            places[i + 1] = places[i];
        }
        places[at] = triangle;
    }

    /// Makes a list's block large enough; its first `kept` places stay.
    #[inline(always)]
    fn make_room(&mut self, list: &mut List, length: usize, kept: usize) {
        if length > SMALLEST << list.class {
            self.move_to(list, length, kept);
        }
    }

    /// Gives a list another block, as large as it needs.
    #[cold]
    fn move_to(&mut self, list: &mut List, length: usize, kept: usize) {
        let class = length.div_ceil(SMALLEST).max(1).next_power_of_two().ilog2() as u8;
        let first = self.block(class);
        let old = list.first as usize;
        self.places.copy_within(old..old + kept, first as usize);
        self.free[usize::from(list.class)].push(list.first);
        list.first = first;
        list.class = class;
    }

    fn block(&mut self, class: u8) -> u32 {
        let class = usize::from(class);
        if self.free.len() <= class {
            self.free.resize(class + 1, Vec::new());
        }
        self.free[class].pop().unwrap_or_else(|| {
            let first = self.places.len();
            self.places.resize(first + (SMALLEST << class), 0);
            first as u32
        })
    }
}
