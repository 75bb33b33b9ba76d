//! What does an impostor look like from any direction? The three views around it, each shifted by its depths, blended by
//! how near they are. `viewer/three/impostors` does the same on the graphics card.
//!
//! A ray through a pixel meets a view's picture where the surface that the view shows would be: it is sought in
//! [`STEPS`] steps, each from the depth at the place found before (relief without a search; the views are near enough).

use belvedere_scene::impostor::octahedral::Axes;
use glam::{DVec3, Vec2, Vec3};

use super::atlas::Atlas;
use super::raster::Pixel;
use crate::pictures;

/// Looks at depths.
const STEPS: usize = 2;

/// Draws its first frame as an eye in this direction sees it: as many rows of pixels as a view has.
#[must_use]
pub fn picture(atlas: &Atlas, direction: [f64; 3]) -> Vec<Pixel> {
    let size = atlas.wish.size_px as usize;
    let eye = single(&Axes::of(direction));
    let mapping = atlas.wish.mapping();
    let views = mapping.nearest(direction, atlas.wish.views).map(|near| {
        let axes = single(&Axes::of(mapping.of_view(near.view, atlas.wish.views)));
        (near.view, axes, near.weight as f32)
    });
    let pixel = |index: usize| {
        let place = |i: usize| (i as f32 + 0.5) * 2.0 / size as f32 - 1.0;
        let on_plane = eye[0] * place(index % size) - eye[1] * place(index / size);
        let mut sum = Pixel::default();
        for (view, axes, weight) in &views {
            let into = |v: Vec3| Vec3::from_array(axes.map(|axis| axis.dot(v)));
            let (origin, along) = (into(on_plane), into(-eye[2]));
            let at_depth = |depth: f32| {
                let way = (depth - origin.z) / along.z.min(-0.2);
                origin.truncate() + way * along.truncate()
            };
            let place = (0..STEPS).fold(at_depth(0.0), |place, _| at_depth(atlas.depth(*view, place)));
            let seen = atlas.at(*view, place);
            let share = weight * seen.coverage;
            let normal: Vec3 = (0..3).map(|i| axes[i] * seen.normal[i]).sum();
            sum.colour += share * seen.colour;
            sum.normal += share * normal;
            sum.depth += share * seen.depth;
            sum.recolour += share * seen.recolour;
            sum.coverage += share;
        }
        if sum.coverage > 0.0 {
            sum.colour /= sum.coverage;
            sum.depth /= sum.coverage;
            sum.recolour /= sum.coverage;
            sum.normal = Vec3::from_array(eye.map(|axis| axis.dot(sum.normal))).normalize_or(Vec3::Z);
        }
        sum
    };
    (0..size * size).map(pixel).collect()
}

impl Atlas {
    /// The depth at a place of a view, −1 to 1 with y up.
    fn depth(&self, view: [u32; 2], place: Vec2) -> f32 {
        self.mixed(view, place, |at| f32::from(self.shape[at][2]) / 127.5 - 1.0)
    }

    /// What a view shows at a place; nothing outside.
    fn at(&self, view: [u32; 2], place: Vec2) -> Pixel {
        if place.abs().max_element() > 1.0 {
            return Pixel::default();
        }
        let colour = |i: usize| {
            self.mixed(view, place, |at| {
                pictures::linear(f32::from(self.colour[at][i]) / 255.0)
            })
        };
        let shape = |i: usize| self.mixed(view, place, |at| f32::from(self.shape[at][i]) / 127.5 - 1.0);
        let [x, y] = [shape(0), shape(1)];
        Pixel {
            colour: Vec3::new(colour(0), colour(1), colour(2)),
            coverage: self.mixed(view, place, |at| f32::from(self.colour[at][3]) / 255.0),
            normal: Vec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt()),
            depth: shape(2),
            recolour: (1.0 - shape(3)) / 2.0,
        }
    }

    /// A number between the four pixels around a place, none of another view.
    fn mixed(&self, view: [u32; 2], place: Vec2, number: impl Fn(usize) -> f32) -> f32 {
        let size = self.wish.size_px as f32;
        let at = Vec2::new(place.x + 1.0, 1.0 - place.y) / 2.0 * size - 0.5;
        let at = at.clamp(Vec2::ZERO, Vec2::splat(size - 1.0));
        let low = at.floor().min(Vec2::splat(size - 2.0));
        let part = at - low;
        let side = self.side_px() as usize;
        let first = [0, 1].map(|axis| (view[axis] * self.wish.size_px) as usize + low[axis] as usize);
        let pixel = |dx: usize, dy: usize| number((first[1] + dy) * side + first[0] + dx);
        let row = |dy: usize| pixel(0, dy) * (1.0 - part.x) + pixel(1, dy) * part.x;
        row(0) * (1.0 - part.y) + row(1) * part.y
    }
}

fn single(axes: &Axes) -> [Vec3; 3] {
    [axes.right, axes.up, axes.towards].map(|axis| DVec3::from(axis).as_vec3())
}
