//! How do bytes follow from other bytes? As literals and copies from what is known: the bytes before the step, then
//! those that are already written (Ziv & Lempel, *A universal algorithm for sequential data compression*, 1977). Two
//! geometry sections of neighbours have the same layout, so a copy mostly goes on where the last one stopped.

use std::collections::BTreeMap;

use super::{
    DecodeError,
    range::{Bit, Change, Coder, Number, Symbol},
};

/// No geometry section is larger. A decoder never allocates more for it.
pub(super) const LONGEST_TEXT: usize = 1 << 20;
/// A copy from where the last one stopped is worth its bits from this length on …
const SHORTEST_ON: usize = 2;
/// … and one from anywhere else from this one on.
const SHORTEST: usize = 4;
/// How many places with the same beginning are compared.
const PLACES: usize = 16;

/// Learns how one text follows from another.
#[derive(Default)]
pub(super) struct Text {
    length: Number,
    copies: [Bit; 2],
    place: Change,
    copied: Number,
    literal: Box<Symbol<256>>,
}

impl Text {
    /// Gives the text after, see [`Coder`].
    pub(super) fn code(&mut self, coder: &mut impl Coder, before: &[u8], after: &[u8]) -> Result<Vec<u8>, DecodeError> {
        let length = self.length.code(coder, after.len() as u64)? as usize;
        if length > LONGEST_TEXT {
            return Err(DecodeError::damaged("its geometry claims to be larger than any"));
        }
        let end = before.len() + length;
        let mut known = before.to_vec();
        let mut finder = Finder::default();
        let (mut on, mut copied_last) = (0, false);
        while known.len() < end {
            let rest = after.get(known.len() - before.len()..).unwrap_or_default();
            let found = finder.find(&known, rest, on);
            copied_last = coder.bit(&mut self.copies[usize::from(copied_last)], found.is_some())?;
            if !copied_last {
                let byte = rest.first().copied().unwrap_or_default();
                known.push(self.literal.code(coder, byte)?);
                on += 1;
                continue;
            }
            let (from, count) = found.unwrap_or_default();
            let (from, _) = self.place.code(coder, 0, on as i64, from as i64)?;
            let count = self.copied.code(coder, count.saturating_sub(1) as u64)? as usize + 1;
            let from = usize::try_from(from).ok().filter(|from| *from < known.len());
            let from = from.ok_or_else(|| DecodeError::damaged("it copies from where nothing is"))?;
            if count > end - known.len() {
                return Err(DecodeError::damaged("it copies beyond its end"));
            }
            for at in from..from + count {
                known.push(known[at]);
            }
            on = from + count;
        }
        Ok(known.split_off(before.len()))
    }
}

/// Finds what can be copied.
#[derive(Default)]
struct Finder {
    /// Where known text begins with these bytes, rising.
    places: BTreeMap<[u8; SHORTEST], Vec<usize>>,
    noted: usize,
}

impl Finder {
    /// Where a beginning of `rest` stands in `known`, and how much of it; `on` is where the last copy stopped.
    fn find(&mut self, known: &[u8], rest: &[u8], on: usize) -> Option<(usize, usize)> {
        let next = known.get(on..).map_or(0, |there| common(there, rest));
        let here = (next >= SHORTEST_ON).then_some((on, next));
        let Some(start) = rest.first_chunk() else {
            return here;
        };
        while let Some(key) = known.get(self.noted..).and_then(<[u8]>::first_chunk) {
            self.places.entry(*key).or_default().push(self.noted);
            self.noted += 1;
        }
        let places = self.places.get(start).map_or(&[][..], Vec::as_slice);
        let elsewhere = places
            .iter()
            .rev()
            .take(PLACES)
            .map(|from| (*from, common(&known[*from..], rest)))
            .max_by_key(|(from, count)| (*count, *from));
        // A longer copy from elsewhere must make up for saying where.
        elsewhere.filter(|(_, count)| *count > next + 2).or(here)
    }
}

fn common(a: &[u8], b: &[u8]) -> usize {
    a.iter().zip(b).take_while(|(a, b)| a == b).count()
}
