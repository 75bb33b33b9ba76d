//! What stands for a model from far away? An *impostor*: pictures of it from many directions in one atlas (Maciel and
//! Shirley 1995, in Schmalstieg, *The Remote Rendering Pipeline*, 1997, §2.6; "images are very efficient at medium and far
//! ranges", §8.4). [`octahedral`] says which pictures an eye needs.

pub mod octahedral;

use serde::{Deserialize, Serialize};

use crate::object::TextureRef;
use octahedral::Mapping;

/// What an author asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wish {
    /// Views along each side of the atlas.
    pub views: u32,
    /// Pixels along each side of a view; one of [`Wish::SIZES_PX`].
    pub size_px: u32,
    /// Whether it is also seen from below its horizon.
    pub below: bool,
    /// Moments of a round of its movement that are shown, 1 for what keeps still.
    pub frames: u32,
    /// How far it walks in a round, in the model's units; 0 for who has not said so.
    pub stride: f64,
}

impl Wish {
    /// Fewer views would not surround anything.
    pub const LEAST_VIEWS: u32 = 2;
    /// With the largest size 1,536 pixels along each side of an atlas.
    pub const MOST_VIEWS: u32 = 12;
    /// Powers of two, so that a view stays by itself in the smaller sizes that graphics cards make of a picture.
    pub const SIZES_PX: [u32; 4] = [16, 32, 64, 128];
    /// More would not be told apart from far away.
    pub const MOST_FRAMES: u32 = 16;
    /// What any graphics card can hold: frames stand below each other in one picture.
    pub const MOST_HEIGHT_PX: u32 = 4096;
    /// When nothing is said.
    pub const DEFAULT: Self = Self {
        views: 8,
        size_px: 64,
        below: false,
        frames: 1,
        stride: 0.0,
    };
    /// Views of what moves, when nothing is said: there are as many of them as frames.
    pub const VIEWS_OF_FRAMES: u32 = 6;

    /// Whether a picture can hold it.
    #[must_use]
    pub fn fits(self) -> bool {
        self.views * self.size_px * self.frames <= Self::MOST_HEIGHT_PX
    }

    /// What suffices for both, but for views that a picture has no room for.
    #[must_use]
    pub fn join(self, other: Self) -> Self {
        let size_px = self.size_px.max(other.size_px);
        let frames = self.frames.max(other.frames);
        let room = Self::MOST_HEIGHT_PX / (size_px * frames);
        Self {
            views: self.views.max(other.views).min(room),
            size_px,
            below: self.below || other.below,
            frames,
            stride: self.stride.max(other.stride),
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
    /// For each pixel of `colour` the normal and the depth; in alpha, where there is one, which share of the colour is its
    /// own, and not for each who wears the model to choose (PNG, no colours).
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
    /// Moments of a round of its movement, each an atlas of its own below the one before; 1 for what keeps still.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub frames: u32,
    /// How far it walks in a round; absent for what keeps still. Space as for `error_m`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stride_m: Option<f64>,
}

fn one() -> u32 {
    1
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde asks so")]
fn is_one(frames: &u32) -> bool {
    *frames == 1
}

impl Impostor {
    /// The same with errors and distances in metres, where the model's space is scaled.
    #[must_use]
    pub fn scaled(&self, scale: f64) -> Self {
        Self {
            error_m: self.error_m * scale,
            switch_distance_m: self.switch_distance_m * scale,
            stride_m: self.stride_m.map(|stride| stride * scale),
            ..self.clone()
        }
    }
}
