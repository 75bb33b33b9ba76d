//! What has a session been told? Events have numbers from here on, and the last of them are kept for a reader that was cut off.

use std::collections::VecDeque;

use bytes::Bytes;

use super::Line;

/// So many bytes are kept for one that comes back.
const KEPT_BYTES: usize = 64 << 10;

/// An event without its number.
#[derive(Debug, Clone)]
pub(super) struct Said {
    pub(super) name: &'static str,
    pub(super) data: Bytes,
}

impl Said {
    /// An `object-pos`.
    pub(super) fn poses(data: Bytes) -> Self {
        let name = "object-pos";
        Self { name, data }
    }

    /// About what it takes in the stream.
    fn bytes(&self) -> usize {
        /// What stands around name and data, with the longest number.
        const AROUND: usize = 48;
        AROUND + self.name.len() + self.data.len()
    }

    fn write(&self, number: u64, piece: &mut Vec<u8>) {
        piece.reserve(self.bytes());
        self.parts(&Digits::of(number))
            .iter()
            .for_each(|part| piece.extend_from_slice(part));
    }

    /// What it is in the stream, one after the other.
    fn parts<'a>(&'a self, number: &'a Digits) -> [&'a [u8]; 7] {
        let (name, data) = (self.name.as_bytes(), &self.data[..]);
        [b"id: ", number.text(), b"\nevent: ", name, b"\ndata: ", data, b"\n\n"]
    }
}

/// A number as it is written: many are, so that to ask for it in general takes longer than all else.
struct Digits {
    text: [u8; Self::MOST],
    from: usize,
}

impl Digits {
    const MOST: usize = 20;

    fn of(number: u64) -> Self {
        let (mut text, mut from, mut left) = ([0; Self::MOST], Self::MOST, number);
        loop {
            from -= 1;
            text[from] = b'0' + (left % 10) as u8;
            left /= 10;
            if left == 0 {
                return Self { text, from };
            }
        }
    }

    fn text(&self) -> &[u8] {
        &self.text[self.from..]
    }
}

/// What was read, or is to be read again.
#[derive(Debug)]
pub(super) struct Told {
    /// The last one has the number before `next`.
    kept: VecDeque<Said>,
    kept_bytes: usize,
    /// The number of the next event.
    next: u64,
    /// The number of the next event to be read again; `next` when there is none.
    again: u64,
}

/// Whoever takes a session up counts on so much further, past all that was told before.
const NUMBERS: u64 = 1 << 32;

impl Default for Told {
    fn default() -> Self {
        Self::after(0)
    }
}

impl Told {
    /// Nothing was told here yet, to a session that was taken up so often.
    pub(super) fn after(taken: u64) -> Self {
        let first = taken.saturating_mul(NUMBERS).saturating_add(1);
        Self {
            kept: VecDeque::new(),
            kept_bytes: 0,
            next: first,
            again: first,
        }
    }

    /// Whether nobody was told anything yet.
    pub(super) fn is_nothing(&self) -> bool {
        self.next == 1
    }

    /// All that was told is void; numbers go on.
    pub(super) fn clear(&mut self) {
        self.kept = VecDeque::new();
        self.kept_bytes = 0;
        self.again = self.next;
    }

    /// Whether something is to be read again.
    pub(super) fn has_more(&self) -> bool {
        self.again < self.next
    }

    /// Goes back to what comes after an event; whether all of that is there.
    pub(super) fn go_back_to(&mut self, last_seen: u64) -> bool {
        let known = (self.oldest()..=self.next).contains(&last_seen.saturating_add(1));
        if known {
            self.again = last_seen + 1;
        }
        known
    }

    /// Writes what is to be read again, up to so many bytes and one event.
    pub(super) fn write_again(&mut self, piece: &mut Vec<u8>, most_bytes: usize) {
        while self.has_more() && piece.len() < most_bytes {
            if let Some(said) = self.kept.get((self.again - self.oldest()) as usize) {
                said.write(self.again, piece);
            }
            self.again += 1;
        }
    }

    /// Writes what is about to be told next.
    pub(super) fn write_next(&self, said: &Said, piece: &mut Vec<u8>) {
        said.write(self.next, piece);
    }

    /// Writes what is about to be told next as a line takes it.
    pub(super) fn frame_next(&self, said: &Said, line: &dyn Line, wire: &mut Vec<u8>) {
        let number = Digits::of(self.next);
        line.frame(&said.parts(&number), wire);
    }

    /// Keeps what was told next for readers that come back.
    pub(super) fn keep(&mut self, said: Said) {
        self.kept_bytes += said.bytes();
        if self.kept.capacity() == 0 {
            // Most hear little more than that they have come.
            self.kept.reserve_exact(1);
        }
        self.kept.push_back(said);
        self.next += 1;
        self.again = self.next;
        while self.kept_bytes > KEPT_BYTES
            && let Some(oldest) = self.kept.pop_front()
        {
            self.kept_bytes -= oldest.bytes();
        }
    }

    /// The number of the first event that is kept.
    fn oldest(&self) -> u64 {
        self.next - self.kept.len() as u64
    }

    #[cfg(test)]
    pub(super) fn last(&self) -> Option<&Said> {
        self.kept.back()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_everybody_writes_them() {
        for number in [0, 9, 10, 1 << 32, u64::MAX - 1, u64::MAX] {
            assert_eq!(Digits::of(number).text(), number.to_string().as_bytes());
        }
    }
}
