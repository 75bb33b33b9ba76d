//! When does what was asked for arrive? A line with a bandwidth and a latency, on which answers follow each other.

/// A line between server and visitor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Bits a second; infinite where nobody limits it.
    pub bits_per_s: f64,
    /// From the request to the first byte of its answer, in milliseconds.
    pub latency_ms: f64,
}

impl Default for Line {
    fn default() -> Self {
        Self {
            bits_per_s: f64::INFINITY,
            latency_ms: 0.0,
        }
    }
}

/// What a request and its answer take besides the body: their headers.
pub const HEADER_BYTES: u64 = 400;

/// A line in use.
#[derive(Debug)]
pub(super) struct Traffic {
    line: Line,
    free_ms: f64,
}

impl Traffic {
    pub(super) fn on(line: Line) -> Self {
        Self { line, free_ms: 0.0 }
    }

    /// Sends an answer of so many bytes to a request of this time; says when all of it is there.
    pub(super) fn send(&mut self, asked_ms: f64, bytes: u64) -> f64 {
        let bits = 8.0 * (bytes + HEADER_BYTES) as f64;
        self.free_ms = self.free_ms.max(asked_ms + self.line.latency_ms) + 1000.0 * bits / self.line.bits_per_s;
        self.free_ms
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_follow_each_other_and_their_latencies_overlap() {
        let line = Line {
            bits_per_s: 8000.0,
            latency_ms: 100.0,
        };
        let mut traffic = Traffic::on(line);
        assert_eq!(traffic.send(0.0, 600), 1100.0);
        assert_eq!(traffic.send(0.0, 600), 2100.0);
        assert_eq!(traffic.send(5000.0, 600), 6100.0);
        assert_eq!(Traffic::on(Line::default()).send(7.0, 1 << 40), 7.0);
    }
}
