//! What stands for a model from far away? An *impostor*: pictures of it from many directions in one atlas (Maciel and
//! Shirley 1995, in Schmalstieg, *The Remote Rendering Pipeline*, 1997, §2.6; "images are very efficient at medium and far
//! ranges", §8.4). [`octahedral`] says which pictures an eye needs.

pub mod octahedral;

use serde::{Deserialize, Serialize};

use crate::object::TextureRef;
use octahedral::Mapping;

/// What an author asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wish {
    /// Views along each side of the atlas.
    pub views: u32,
    /// Pixels along each side of a view; one of [`Wish::SIZES_PX`].
    pub size_px: u32,
    /// Whether it is also seen from below its horizon.
    pub below: bool,
}

impl Wish {
    /// Fewer views would not surround anything.
    pub const LEAST_VIEWS: u32 = 2;
    /// With the largest size 1,536 pixels along each side of an atlas.
    pub const MOST_VIEWS: u32 = 12;
    /// Powers of two, so that a view stays by itself in the smaller sizes that graphics cards make of a picture.
    pub const SIZES_PX: [u32; 4] = [16, 32, 64, 128];
    /// When nothing is said.
    pub const DEFAULT: Self = Self {
        views: 8,
        size_px: 64,
        below: false,
    };

    /// What suffices for both.
    #[must_use]
    pub fn join(self, other: Self) -> Self {
        Self {
            views: self.views.max(other.views),
            size_px: self.size_px.max(other.size_px),
            below: self.below || other.below,
        }
    }

    /// How its views surround a model.
    #[must_use]
    pub fn mapping(self) -> Mapping {
        if self.below {
            Mapping::Octahedral
        } else {
            Mapping::HemiOctahedral
        }
    }
}

/// Pictures of a model, as its object info lists them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Impostor {
    /// Base colour, and in alpha how much of a pixel is covered (PNG, sRGB, alpha not multiplied in).
    pub colour: TextureRef,
    /// For each pixel of `colour` the normal and the depth (PNG, no colours).
    pub shape: TextureRef,
    /// How views surround the model.
    pub mapping: Mapping,
    /// Views along each side of the atlas.
    pub views: u32,
    /// Pixels along each side of a view.
    pub size_px: u32,
    /// Middle of the ball that every view shows, in the model's space.
    pub centre: [f64; 3],
    /// Its radius, in the model's space.
    pub radius: f64,
    /// The longer of a pixel and of how far outlines lie on average from where level 0 has them, measured between views.
    /// Space as for [`Level::geometric_error_m`](crate::object::Level::geometric_error_m).
    pub error_m: f64,
    /// From this distance (eye to bounding box) on, that error covers at most one pixel. Space as for `error_m`.
    pub switch_distance_m: f64,
}

impl Impostor {
    /// The same with errors and distances in metres, where the model's space is scaled.
    #[must_use]
    pub fn scaled(&self, scale: f64) -> Self {
        Self {
            error_m: self.error_m * scale,
            switch_distance_m: self.switch_distance_m * scale,
            ..self.clone()
        }
    }
}
