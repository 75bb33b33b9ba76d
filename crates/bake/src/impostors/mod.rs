//! Which pictures stand for a model from far away? Its *impostor*: one view of it for each point of an octahedral grid of
//! directions (`belvedere_scene::impostor`), drawn by a small rasteriser of our own and put into an atlas.
//!
//! Pre-rendered views of an object are Maciel and Shirley's impostors (1995; Schmalstieg, *The Remote Rendering Pipeline*,
//! 1997, §2.6, §8.4). Views here also hold normals, so that light falls on them as on the model, and depth, so that what
//! lies in front or behind shifts as it should between two views ([`show`] is what a viewer has to do).
//!
//! A tour, in the order in which data flows: [`surface`] says which colour a point has, [`raster`] draws a view,
//! [`atlas`] joins views, [`show`] draws the model from any direction by them, [`measure`] says how far off that is.
//!
//! What moves is drawn in several poses, and what of its colour each who wears the model chooses is noted: so crowds of
//! virtual humans are drawn by images for angles around one, for each frame of its animation, and colours that are blended
//! in at run time (Tecchia et al.).
//!
//! The same model gives the same bytes for any number of threads. An atlas has at most 1,536 pixels along a side, all frames
//! together at most 4,096.

pub mod atlas;
#[cfg(test)]
mod frames_tests;
pub mod measure;
pub mod raster;
pub mod show;
pub mod surface;
#[cfg(test)]
mod tests;

use belvedere_scene::impostor::Wish;
use rayon::prelude::*;

use crate::progress::{Cancelled, Progress};
use crate::source::SourceModel;
use atlas::Atlas;
use raster::Body;
use surface::Surfaces;

/// A model with fewer triangles is drawn as fast as the pictures are.
const LEAST_TRIANGLES: usize = 64;

/// Whether pictures can be of use for a model that asks for them.
#[must_use]
pub fn is_worthwhile(model: &SourceModel) -> bool {
    model.triangle_count() >= LEAST_TRIANGLES
}

/// An impostor before it is stored.
#[derive(Debug, Clone, PartialEq)]
pub struct Baked {
    /// Base colour and coverage, PNG.
    pub colour: Vec<u8>,
    /// Normals and depth, and whose colours are not its own, PNG.
    pub shape: Vec<u8>,
    /// How many poses are shown.
    pub frames: u32,
    /// Middle of the ball that views show, in the model's space.
    pub centre: [f64; 3],
    /// Its radius.
    pub radius: f64,
    /// The longer of a pixel and of the mean distance between outlines, in the model's units.
    pub error: f64,
}

/// Draws all views of a model in all of its poses; `None` when it has no triangle with an extent. How far off pictures are
/// is measured by the first pose. Poses are drawn one after the other, and each is a step of progress.
///
/// Costs a pass over its triangles for each view.
///
/// # Errors
/// When who looks on wants to stop.
pub fn bake(
    model: &SourceModel,
    surfaces: &Surfaces<'_>,
    wish: Wish,
    progress: &dyn Progress,
) -> Result<Option<Baked>, Cancelled> {
    let wish = Wish { frames: 1, ..wish };
    let pose = |number| {
        if progress.cancelled() {
            return Err(Cancelled);
        }
        Ok(model.pose(number))
    };
    let Some((centre, radius)) = raster::ball(model.pose_count(), pose)? else {
        return Ok(None);
    };
    let mut off_px: f64 = 1.0;
    let mut frames: Option<Atlas> = None;
    for number in 0..model.pose_count() {
        let pose = pose(number)?;
        let body = Body::within(&pose, surfaces, (centre, radius));
        let drawn = draw(&body, wish);
        progress.advance(1);
        match &mut frames {
            None => {
                off_px = off_px.max(measure::outline_px(&body, &drawn));
                frames = Some(drawn);
            }
            Some(frames) => frames.add_below(drawn),
        }
    }
    let pixel = 2.0 * radius / f64::from(wish.size_px);
    Ok(frames.map(|atlas| Baked {
        colour: atlas.colour_png(),
        shape: atlas.shape_png(),
        frames: atlas.wish.frames,
        centre: centre.to_array(),
        radius,
        error: pixel * off_px,
    }))
}

/// All views of a body.
fn draw(body: &Body<'_>, wish: Wish) -> Atlas {
    let mapping = wish.mapping();
    let views: Vec<_> = (0..wish.views * wish.views)
        .into_par_iter()
        .map(|number| {
            let direction = mapping.of_view([number % wish.views, number / wish.views], wish.views);
            body.picture(direction, wish.size_px)
        })
        .collect();
    Atlas::of_views(&views, wish)
}
