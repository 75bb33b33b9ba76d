//! Which triangles meet at a vertex? Lists in one array, in blocks of 8, 16, 32 … places that are used again.

/// The lists of all vertices.
#[derive(Debug, Default)]
pub(super) struct Stars {
    lists: Vec<List>,
    places: Vec<u32>,
    /// First places of unused blocks, by class.
    free: Vec<Vec<u32>>,
}

#[derive(Debug, Clone, Copy)]
struct List {
    first: u32,
    length: u32,
    /// The block has 8 · 2^class places.
    class: u8,
}

const SMALLEST: usize = 8;

impl Stars {
    /// Adds a vertex without triangles.
    pub(super) fn push_empty(&mut self) {
        let first = self.block(0);
        self.lists.push(List {
            first,
            length: 0,
            class: 0,
        });
    }

    #[inline(always)]
    pub(super) fn of(&self, vertex: u32) -> &[u32] {
        let List { first, length, .. } = self.lists[vertex as usize];
        &self.places[first as usize..][..length as usize]
    }

    #[inline(always)]
    pub(super) fn len(&self, vertex: u32) -> usize {
        self.lists[vertex as usize].length as usize
    }

    /// Replaces a list.
    #[inline(always)]
    pub(super) fn set(&mut self, vertex: u32, triangles: &[u32]) {
        self.make_room(vertex, triangles.len(), 0);
        let list = &mut self.lists[vertex as usize];
        list.length = triangles.len() as u32;
        self.places[list.first as usize..][..triangles.len()].copy_from_slice(triangles);
    }

    /// Puts a triangle at a place of a list, not behind its end.
    #[inline(always)]
    pub(super) fn insert(&mut self, vertex: u32, at: usize, triangle: u32) {
        let length = self.len(vertex);
        self.make_room(vertex, length + 1, length);
        let list = &mut self.lists[vertex as usize];
        list.length += 1;
        let places = &mut self.places[list.first as usize..][..length + 1];
        places.copy_within(at..length, at + 1);
        places[at] = triangle;
    }

    /// Makes a list's block large enough; its first `kept` places stay.
    #[inline(always)]
    fn make_room(&mut self, vertex: u32, length: usize, kept: usize) {
        let list = self.lists[vertex as usize];
        if length > SMALLEST << list.class {
            self.grow(vertex, length, kept);
        }
    }

    #[cold]
    fn grow(&mut self, vertex: u32, length: usize, kept: usize) {
        let old = self.lists[vertex as usize];
        let class = length.div_ceil(SMALLEST).next_power_of_two().ilog2() as u8;
        let first = self.block(class);
        self.places
            .copy_within(old.first as usize..old.first as usize + kept, first as usize);
        self.free[usize::from(old.class)].push(old.first);
        let list = &mut self.lists[vertex as usize];
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
