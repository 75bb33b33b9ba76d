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

    /// Sends an answer of so many bytes to a request of this time.
    pub(super) fn send(&mut self, asked_ms: f64, bytes: u64) -> Transfer {
        let bits = 8.0 * (bytes + HEADER_BYTES) as f64;
        let begun_ms = self.free_ms.max(asked_ms + self.line.latency_ms);
        self.free_ms = begun_ms + 1000.0 * bits / self.line.bits_per_s;
        Transfer {
            begun_ms,
            there_ms: self.free_ms,
        }
    }
}

/// An answer on a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Transfer {
    /// When the line begins to carry it.
    pub(super) begun_ms: f64,
    /// When all of it is there.
    pub(super) there_ms: f64,
}

impl Transfer {
    /// What is asked for at a time and takes none.
    pub(super) fn at(asked_ms: f64) -> Self {
        Self {
            begun_ms: asked_ms,
            there_ms: asked_ms,
        }
    }

    /// When so much of it is there, of 0 to 1.
    pub(super) fn share_ms(&self, share: f64) -> f64 {
        self.begun_ms + share * (self.there_ms - self.begun_ms)
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
        let transfers = [0.0, 0.0, 5000.0].map(|asked_ms| traffic.send(asked_ms, 600));
        let times = transfers.map(|transfer| [transfer.begun_ms, transfer.share_ms(0.25), transfer.there_ms]);
        assert_eq!(
            times,
            [
                [100.0, 350.0, 1100.0],
                [1100.0, 1350.0, 2100.0],
                [5100.0, 5350.0, 6100.0]
            ]
        );
        assert_eq!(Traffic::on(Line::default()).send(7.0, 1 << 40), Transfer::at(7.0));
    }
}
