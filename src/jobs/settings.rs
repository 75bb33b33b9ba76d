//! What can be set of uploads and their bakes?

use std::time::Duration;

use super::JobError;

/// Limits of uploads and of the bakes that follow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JobSettings {
    /// How large an upload may be.
    pub upload_bytes: u64,
    /// How many bakes run at once; none leaves jobs to another server of the same data folder.
    pub bakes: usize,
    /// Address space of one bake.
    pub memory_bytes: u64,
    /// How long one bake may take.
    pub time: Duration,
    /// How many jobs of one key may wait or run.
    pub open_of_a_key: u32,
    /// How many jobs may wait or run.
    pub open_of_all: u32,
}

impl JobSettings {
    /// Whether there is room for one more job of a key that has so many open ones, of so many in all.
    pub(super) fn room(&self, theirs: u32, all: u32) -> Result<(), JobError> {
        if theirs >= self.open_of_a_key {
            let most = self.open_of_a_key;
            return Err(JobError::QuotaMet { most });
        }
        if all >= self.open_of_all {
            let most = self.open_of_all;
            return Err(JobError::Full { most });
        }
        Ok(())
    }
}

impl Default for JobSettings {
    fn default() -> Self {
        Self {
            upload_bytes: 1 << 30,
            bakes: 1,
            memory_bytes: 8 << 30,
            time: Duration::from_secs(6 * 3600),
            open_of_a_key: 8,
            open_of_all: 64,
        }
    }
}
