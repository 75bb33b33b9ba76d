//! How urgent is a download, and why? Each purpose has a band, as in `viewer/core/strategy/priority.ts`; within it, what has most
//! benefit goes first. One number decides, and every wish says in words where it has it from.

use std::fmt;

use belvedere_scene::{CellId, ModelId, ObjectId};

use super::grade::Grade;

/// Why something is wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cause {
    /// It can be seen, and nothing of it is here.
    Missing {
        /// What is visible of it, steradians.
        solid_angle_sr: f64,
    },
    /// What is here of it is not good enough.
    Finer {
        /// So many pixels off; infinite where what is here is of no use.
        error_px: f64,
    },
    /// It can be seen from a cell that one may enter soon.
    Ahead {
        /// That cell.
        cell: CellId,
        /// Which of the three steps: where one heads, next door, beyond.
        step: u8,
        /// One may be there after so long.
        in_s: f64,
        /// Whether there is just time enough to fetch it.
        due: bool,
    },
}

/// Where the bands of priorities begin; lower goes first. Documents come before all of them.
pub mod band {
    /// Something of everything visible.
    pub const COARSEST: f64 = 1e6;
    /// What may be visible before it could come otherwise.
    pub const DUE: f64 = 1.5e6;
    /// Finer grades.
    pub const FINER: f64 = 2e6;
    /// What may be visible later.
    pub const AHEAD: f64 = 3e6;
}

impl Cause {
    /// The priority of the `rank`th wish of its kind.
    #[must_use]
    pub fn priority(&self, rank: usize) -> f64 {
        match self {
            Self::Missing { .. } => band::COARSEST + rank as f64,
            Self::Ahead { due: true, .. } => band::DUE + rank as f64,
            Self::Finer { error_px } => band::FINER + 100_000.0 / (1.0 + error_px),
            Self::Ahead { due: false, .. } => band::AHEAD + rank as f64,
        }
    }

    /// Whether it is for what cannot be seen yet.
    #[must_use]
    pub fn is_ahead(&self) -> bool {
        matches!(self, Self::Ahead { .. })
    }

    /// Whether both are of one kind, so that they may come together.
    #[must_use]
    pub fn is_like(&self, other: &Self) -> bool {
        std::mem::discriminant(self) == std::mem::discriminant(other)
    }
}

/// A grade that should be fetched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wish {
    /// Its model.
    pub model: ModelId,
    /// The object that needs it most.
    pub object: ObjectId,
    /// The grade.
    pub grade: Grade,
    /// Bytes that have still to travel for it.
    pub cost_bytes: f64,
    /// Why.
    pub cause: Cause,
    /// Lower is more urgent.
    pub priority: f64,
}

impl Wish {
    /// What a byte of it gains: steradians of something where nothing is, or pixels of error.
    #[must_use]
    pub fn benefit_per_byte(&self) -> f64 {
        let benefit = match self.cause {
            Cause::Missing { solid_angle_sr } => solid_angle_sr,
            Cause::Finer { error_px } => error_px,
            Cause::Ahead { in_s, .. } => 1.0 / (1.0 + in_s),
        };
        benefit / self.cost_bytes.max(1.0)
    }
}

/// Why it is fetched, in a few words.
impl fmt::Display for Wish {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { model, grade, .. } = self;
        match self.cause {
            Cause::Missing { solid_angle_sr } => write!(f, "not here yet, {solid_angle_sr:.2} sr: {model} {grade}")?,
            Cause::Finer { error_px } => write!(f, "{error_px:.1} px off: {model} {grade}")?,
            Cause::Ahead { cell, in_s, .. } => write!(f, "seen from {cell}, {in_s:.1} s ahead: {model} {grade}")?,
        }
        match self.cost_bytes {
            // It came in a pack, or for something else.
            0.0 => f.write_str(", which was here"),
            bytes => write!(f, ", {bytes:.0} bytes"),
        }
    }
}
