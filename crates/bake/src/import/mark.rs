//! What does an author mark a thing as? By the beginning of its name, in glTF as in rules, or in glTF by `extras.belvedere.kind`.

use crate::source::{Authored, AuthoredShape, Role};

/// What something is marked as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mark {
    /// Drawn.
    Drawn(Role),
    /// A shape for the bake, not drawn.
    Authored(AuthoredKind),
    /// Somebody's body, which moves and so is no part of the scene.
    Avatar,
}

/// What a shape for the bake is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum AuthoredKind {
    /// A view cell.
    Cell,
    /// An opening between two cells.
    Portal,
    /// A body that hides.
    Occluder,
}

impl Mark {
    /// What a kind says; `None` where it is none, and so says nothing.
    pub(super) fn of(kind: &str) -> Option<Self> {
        Some(match kind {
            "door" => Self::Drawn(Role::Door),
            "cell" => Self::Authored(AuthoredKind::Cell),
            "portal" => Self::Authored(AuthoredKind::Portal),
            "occluder" => Self::Authored(AuthoredKind::Occluder),
            "avatar" => Self::Avatar,
            _ => return None,
        })
    }

    /// The same for what stands before the first colon of a name.
    pub(super) fn of_name(name: &str) -> Option<Self> {
        Self::of(name.split_once(':')?.0)
    }
}

impl AuthoredKind {
    /// Where the bake looks for such shapes.
    pub(super) fn list(self, authored: &mut Authored) -> &mut Vec<AuthoredShape> {
        match self {
            Self::Cell => &mut authored.cells,
            Self::Portal => &mut authored.portals,
            Self::Occluder => &mut authored.occluders,
        }
    }
}
