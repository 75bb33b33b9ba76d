//! How fast is the line? Bytes by the time in which they came and nothing else did, and what may be under way on it: enough
//! that it never rests, and no more, so that what turns out to be urgent need not wait behind what is not.

/// What each answer lets be forgotten of those before it.
const FORGETTING: f64 = 0.2;
/// So many requests are under way at most …
const MOST_REQUESTS: usize = 8;
/// … and no more than what comes in this time, beside one …
pub(super) const AHEAD_S: f64 = 0.5;
/// … or so many bytes, while nobody knows how fast it is.
const UNKNOWN_BYTES: f64 = 64.0 * 1024.0;

/// Learns from what comes.
#[derive(Debug, Clone, Copy, Default)]
pub struct Meter {
    /// What came, the latest most …
    bytes: f64,
    /// … and in what time.
    busy_s: f64,
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
        self.bytes += bytes - FORGETTING * self.bytes;
        self.busy_s += busy_s - FORGETTING * self.busy_s;
    }

    /// Bytes a second; infinite while nothing is known.
    #[must_use]
    pub fn bytes_per_s(&self) -> f64 {
        if self.is_known() {
            self.bytes / self.busy_s
        } else {
            f64::INFINITY
        }
    }

    /// Whether one more may be under way beside so many requests, whose answers take so many bytes on the line.
    #[must_use]
    pub fn has_room(&self, requests: usize, bytes: f64) -> bool {
        let most_bytes = if self.is_known() {
            AHEAD_S * self.bytes_per_s()
        } else {
            UNKNOWN_BYTES
        };
        requests < 2 || requests < MOST_REQUESTS && bytes < most_bytes
    }

    fn is_known(&self) -> bool {
        self.busy_s > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_as_fast_as_what_came_in_all_of_its_time() {
        let mut meter = Meter::default();
        assert_eq!(meter.bytes_per_s(), f64::INFINITY);
        // Two files share the line, and end nearly together.
        meter.came(0.0, 0.998, 8_000.0);
        meter.came(0.0, 1.0, 8_000.0);
        let rate = meter.bytes_per_s();
        assert!((14_000.0..=20_000.0).contains(&rate), "{rate}");
        for second in 1..40 {
            meter.came(f64::from(second), f64::from(second) + 0.5, 20_000.0);
        }
        let rate = meter.bytes_per_s();
        assert!((rate - 40_000.0).abs() < 40.0, "what was long ago is forgotten: {rate}");
    }

    #[test]
    fn as_much_may_be_under_way_as_comes_in_half_a_second() {
        let mut meter = Meter::default();
        assert_eq!(
            [60_000.0, 70_000.0].map(|bytes| meter.has_room(7, bytes)),
            [true, false]
        );
        meter.came(0.0, 1.0, 16_000.0);
        assert_eq!([7_999.0, 8_000.0].map(|bytes| meter.has_room(2, bytes)), [true, false]);
        assert!(meter.has_room(1, 1e9) && !meter.has_room(8, 0.0));
    }
}
