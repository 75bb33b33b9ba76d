//! What attributes can corners have?

/// What a channel holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChannelKind {
    /// A direction as a point on an octahedron: two numbers from −127 to 127.
    Normal,
    /// Two texture coordinates.
    Uv,
    /// Red, green, blue and alpha.
    Colour,
}

/// Some attribute of a corner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Channel {
    /// What it holds.
    pub kind: ChannelKind,
    /// Real value of a number: `low[i] + number · step[i]`. Without meaning for normals.
    pub low: [f32; 2],
    /// See `low`.
    pub step: [f32; 2],
}

impl ChannelKind {
    /// How many numbers it has.
    #[must_use]
    pub fn numbers(self) -> usize {
        match self {
            Self::Normal | Self::Uv => 2,
            Self::Colour => 4,
        }
    }
}
