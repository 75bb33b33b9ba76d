//! What has a reader after so many bytes? A writer knows without reading: it notes what each step waits for.

/// The mesh at some point of the story.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Told {
    /// Vertices that there are.
    pub vertices: u32,
    /// Bits that the lattice lacks.
    pub coarse_bits: u32,
    /// So many vertices, in order of birth, have got one of these already.
    pub refined: u32,
}

/// What of a stream decides what.
#[derive(Debug, Clone, Default)]
pub struct Course {
    /// Bytes that decide what comes before each pass.
    pub passes: Vec<usize>,
    /// What stands before each step, and how many bytes a reader needs to take it and all before it; they do not fall.
    steps: Vec<(usize, Told)>,
}

impl Course {
    /// Of passes, and of steps with what stands before them and the bytes that they wait for, each step after those before it.
    pub(super) fn new(passes: Vec<usize>, mut steps: Vec<(usize, Told)>) -> Self {
        let mut most = 0;
        for (bytes, _) in &mut steps {
            most = most.max(*bytes);
            *bytes = most;
        }
        Self { passes, steps }
    }

    /// What a reader has made of so many bytes of the stream, when it knows that more will come.
    #[must_use]
    pub fn told(&self, bytes: usize) -> Told {
        let taken = self.steps.partition_point(|(needed, _)| *needed <= bytes);
        let waiting = self.steps.get(taken).or(self.steps.last());
        waiting.map_or_else(Told::default, |(_, told)| *told)
    }
}
