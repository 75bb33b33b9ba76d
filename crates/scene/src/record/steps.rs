//! What changes on the way to each neighbour? The steps from one cell in one object (`.steps`).
//!
//! One object for all of them, because a client that has arrived wants to know all its neighbours before it goes on,
//! and a step is smaller than the headers of a request for it. Each step stands alone.

use super::{
    CellRecord, DecodeError,
    binary::{after_header, header, push_integer, take_integer},
};
use crate::CellId;

/// The first bytes of steps.
const MAGIC: &str = "BVST";

/// The steps from one cell to its neighbours.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Steps {
    /// The cell that they start from.
    pub from: CellId,
    /// Each neighbour, rising, with what [`CellRecord::follow`] takes.
    pub to: Vec<(CellId, Vec<u8>)>,
}

impl Steps {
    /// The steps from a record to those of its neighbours, which must rise.
    #[must_use]
    pub fn between<'a>(from: &CellRecord, to: impl IntoIterator<Item = &'a CellRecord>) -> Self {
        Self {
            from: from.cell,
            to: to.into_iter().map(|next| (next.cell, from.step_to(next))).collect(),
        }
    }

    /// The step to a neighbour.
    #[must_use]
    pub fn step(&self, to: CellId) -> Option<&[u8]> {
        let at = self.to.binary_search_by_key(&to, |(cell, _)| *cell).ok()?;
        Some(&self.to[at].1)
    }

    /// The binary form: `BVST`, the version as u16 little-endian, the cell, how many steps, for each the cell that it
    /// leads to and its length, then the steps.
    #[must_use]
    pub fn encode(&self) -> Vec<u8> {
        let mut bytes = header(MAGIC);
        push_integer(&mut bytes, self.from.0.into());
        push_integer(&mut bytes, self.to.len() as u64);
        for (to, step) in &self.to {
            push_integer(&mut bytes, to.0.into());
            push_integer(&mut bytes, step.len() as u64);
        }
        for (_, step) in &self.to {
            bytes.extend(step);
        }
        bytes
    }

    /// Reads the binary form.
    ///
    /// # Errors
    /// When the bytes are cut short, go on after their end, are of another version, or name neighbours that do not rise.
    pub fn decode(bytes: &[u8]) -> Result<Self, DecodeError> {
        let mut rest = after_header(bytes, MAGIC)?;
        let cell = |rest: &mut &[u8]| -> Result<CellId, DecodeError> {
            let id = u32::try_from(take_integer(rest)?);
            id.map(CellId)
                .map_err(|_| DecodeError::damaged("the id of a cell has more than 32 bits"))
        };
        let from = cell(&mut rest)?;
        let count = take_integer(&mut rest)?;
        let mut lengths: Vec<(CellId, u64)> = Vec::new();
        for _ in 0..count {
            let to = cell(&mut rest)?;
            if lengths.last().is_some_and(|(last, _)| *last >= to) {
                return Err(DecodeError::damaged("the cells that it leads to do not rise"));
            }
            lengths.push((to, take_integer(&mut rest)?));
        }
        let mut to = Vec::with_capacity(lengths.len());
        for (cell, length) in lengths {
            let split = usize::try_from(length)
                .ok()
                .and_then(|length| rest.split_at_checked(length));
            let (step, after) = split.ok_or_else(|| DecodeError::damaged("it ends within a step"))?;
            to.push((cell, step.to_vec()));
            rest = after;
        }
        if !rest.is_empty() {
            return Err(DecodeError::damaged("bytes follow its last step"));
        }
        Ok(Self { from, to })
    }
}
