//! Which way of finding visible sets is wanted?

use std::{fmt, str::FromStr};

use super::{conservative::ConservativeSettings, prover::Proofs};

/// Cells are halved so often for what could not be proved hidden from all of them.
const HALVINGS: u32 = 4;
/// … and cells and the objects that are left then so often, to ask about parts of both.
const CUTS: u32 = 1 << 14;

/// How visible sets are computed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Method {
    /// [`Conservative`](Self::Conservative) where that is tight, else [`Sampled`](Self::Sampled).
    #[default]
    Auto,
    /// What rays saw; proofs only say where to look: see [`super::sampler`].
    Sampled,
    /// What no convex bodies, alone or fused, hide: see [`super::prover`] and [`super::fusion`].
    Occluders,
    /// What no walls with openings hide: see [`super::prover`].
    Portals,
    /// What neither hides: the intersection of both.
    Conservative,
}

impl Method {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Auto,
        Self::Sampled,
        Self::Occluders,
        Self::Portals,
        Self::Conservative,
    ];

    /// Its name in records and reports, and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Sampled => "sampled",
            Self::Occluders => "occluders",
            Self::Portals => "portals",
            Self::Conservative => "conservative",
        }
    }

    /// The proofs that it uses.
    #[must_use]
    pub fn proofs(self) -> ConservativeSettings {
        let [bodies, walls] = match self {
            Self::Occluders => [true, false],
            Self::Portals => [false, true],
            Self::Auto | Self::Sampled | Self::Conservative => [true, true],
        };
        ConservativeSettings {
            proofs: Proofs { bodies, walls },
            fusion: bodies,
            halvings: HALVINGS,
            cuts: CUTS,
            steps: u32::MAX,
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A name that no method has.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no way to compute visible sets: use auto, sampled, occluders, portals or conservative")]
pub struct UnknownMethod(String);

impl FromStr for Method {
    type Err = UnknownMethod;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let found = Self::ALL.into_iter().find(|method| method.name() == name);
        found.ok_or_else(|| UnknownMethod(name.to_owned()))
    }
}
