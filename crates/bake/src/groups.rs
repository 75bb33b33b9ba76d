//! What belongs together when it is joined pair by pair? Disjoint sets of numbers, each known by its smallest.

/// Sets of numbers: for each number itself, or a smaller one of its set.
pub(crate) struct Groups(Vec<u32>);

impl Groups {
    /// So many numbers, each alone.
    pub(crate) fn of_one(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    /// Numbers of which each is joined with one that is no larger.
    pub(crate) fn joined_with(smaller: Vec<u32>) -> Self {
        Self(smaller)
    }

    /// The smallest number of a number's set.
    pub(crate) fn root(&mut self, mut number: u32) -> u32 {
        while self.0[number as usize] != number {
            self.0[number as usize] = self.0[self.0[number as usize] as usize];
            number = self.0[number as usize];
        }
        number
    }

    /// Makes one set of two numbers' sets.
    pub(crate) fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}
