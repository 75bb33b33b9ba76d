//! What is a face, and from which sides does it hide?

use glam::Vec3;

use crate::source::Material;

pub(super) const FRONT_HIDES: u8 = 1;
pub(super) const BACK_HIDES: u8 = 2;
/// What faces of doors hide when they are closed stands so many bits higher: sets are made with all doors open.
const WHEN_CLOSED: u8 = 2;

/// A triangle in space relative to [`World::origin`](super::World::origin), counter-clockwise seen from its front.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triangle {
    /// Its corners.
    pub corners: [Vec3; 3],
    /// The object it belongs to.
    pub object: u32,
    pub(super) hides: u8,
}

impl Triangle {
    /// One that hides from its front.
    #[cfg(test)]
    pub(crate) fn between(corners: [Vec3; 3]) -> Self {
        Self {
            corners,
            object: 0,
            hides: FRONT_HIDES,
        }
    }

    /// Whether it hides anything from at least one side.
    #[must_use]
    pub fn hides(&self) -> bool {
        self.hides & (FRONT_HIDES | BACK_HIDES) != 0
    }

    /// Whether its side that faces a point hides what is behind it.
    #[must_use]
    pub fn hides_from(&self, eye: Vec3) -> bool {
        let [a, b, c] = self.corners;
        let side = if (b - a).cross(c - a).dot(eye - a) > 0.0 {
            FRONT_HIDES
        } else {
            BACK_HIDES
        };
        self.hides & side != 0
    }

    /// Whether it hides what is behind it when seen from its front.
    #[must_use]
    pub fn hides_from_front(&self) -> bool {
        self.hides & FRONT_HIDES != 0
    }

    /// Whether it hides what is before it when seen from its back.
    #[must_use]
    pub fn hides_from_back(&self) -> bool {
        self.hides & BACK_HIDES != 0
    }

    /// Whether its front faces down, and its back hides nothing.
    pub(crate) fn faces_down(&self) -> bool {
        let [a, b, c] = self.corners;
        !self.hides_from_back() && (b - a).cross(c - a).y < 0.0
    }

    /// The same face of a door that is open.
    pub(super) fn opened(self) -> Self {
        Self {
            hides: self.hides << WHEN_CLOSED,
            ..self
        }
    }

    /// The same face of a door that was open, when it is closed.
    pub(crate) fn closed(self) -> Self {
        Self {
            hides: self.hides >> WHEN_CLOSED,
            ..self
        }
    }

    /// Its area in m².
    #[must_use]
    pub fn area_m2(&self) -> f32 {
        let [a, b, c] = self.corners;
        0.5 * (b - a).cross(c - a).length()
    }
}

/// From which sides a face of this material hides; glTF's default material is opaque and has a front only.
pub(super) fn hides(material: Option<&Material>) -> u8 {
    match material {
        Some(m) if m.see_through => 0,
        Some(m) if m.double_sided => FRONT_HIDES | BACK_HIDES,
        _ => FRONT_HIDES,
    }
}
