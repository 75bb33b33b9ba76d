//! How fast is the line? Bytes by the time in which they came and nothing else did, and what may be under way on it: enough
//! that it never rests, and no more, so that what turns out to be urgent need not wait behind what is not.

/// How much one answer changes the mean.
const WEIGHT: f64 = 0.2;
/// So many requests are under way at most …
const MOST_REQUESTS: usize = 8;
/// … and no more than what comes in this time, beside one …
const AHEAD_S: f64 = 0.5;
/// … or so many bytes, while nobody knows how fast it is.
const UNKNOWN_BYTES: f64 = 64.0 * 1024.0;

/// Learns from what comes.
#[derive(Debug, Clone, Copy, Default)]
pub struct Meter {
    bytes_per_s: Option<f64>,
    last_came_s: f64,
}

impl Meter {
    /// So many bytes that were asked for at one time came at another, both in seconds from any beginning.
    pub fn came(&mut self, asked_s: f64, came_s: f64, bytes: f64) {
        let busy_s = came_s - asked_s.max(self.last_came_s);
        self.last_came_s = self.last_came_s.max(came_s);
        if busy_s <= 0.0 {
            return;
        }
        let now = bytes / busy_s;
        let before = self.bytes_per_s.unwrap_or(now);
        self.bytes_per_s = Some(before + WEIGHT * (now - before));
    }

    /// Bytes a second; infinite while nothing is known.
    #[must_use]
    pub fn bytes_per_s(&self) -> f64 {
        self.bytes_per_s.unwrap_or(f64::INFINITY)
    }

    /// Whether one more may be under way beside so many requests with so many bytes.
    #[must_use]
    pub fn has_room(&self, requests: usize, bytes: u64) -> bool {
        let most_bytes = self.bytes_per_s.map_or(UNKNOWN_BYTES, |rate| rate * AHEAD_S);
        requests < 2 || requests < MOST_REQUESTS && (bytes as f64) < most_bytes
    }
}
