//! What does a view look like?
//!
//! The six faces of a cube unfolded to a cross: left, ahead, right and behind in a row, above and below ahead. Each object
//! has a colour of its own, shaded by how it faces the eye. One that is marked is red, with a ring around one place
//! where it shows, because that may be less than a pixel.

use glam::{DVec3, Vec3};

use crate::cube::{Cube, NOTHING};

/// An image, three bytes a pixel, row by row from the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Red, green, blue.
    pub rgb: Vec<u8>,
}

/// Where each face of [`crate::cube::FACES`] stands in the cross: column and row. −Z is ahead.
const CROSS: [(usize, usize); 6] = [(2, 1), (0, 1), (1, 0), (1, 2), (3, 1), (1, 1)];
const PAPER: [u8; 3] = [255, 255, 255];
const SKY: [u8; 3] = [214, 228, 240];
const MARK: [u8; 3] = [230, 0, 20];
/// Inner and outer radius of a ring, in pixels.
const RING: (f32, f32) = (9.0, 12.0);

/// What is shown in red.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mark {
    /// The object.
    pub object: u32,
    /// Where it shows; the ring is around that.
    pub direction: DVec3,
}

/// The picture of what a cube has drawn.
#[must_use]
pub fn cross(cube: &Cube, mark: Option<Mark>) -> Picture {
    let size = cube.size();
    let (width, height) = (4 * size, 3 * size);
    let mut picture = Picture {
        width,
        height,
        rgb: PAPER.repeat(width * height),
    };
    for (face, (column, row)) in CROSS.iter().enumerate() {
        for y in 0..size {
            for x in 0..size {
                picture.paint(column * size + x, row * size + y, color(cube, face, x, y));
            }
        }
    }
    let Some(mark) = mark else { return picture };
    for at in cube.unexpected().iter().filter(|at| at.object == mark.object) {
        let (column, row) = CROSS[usize::from(at.face)];
        picture.paint(column * size + usize::from(at.x), row * size + usize::from(at.y), MARK);
    }
    if let Some((face, x, y)) = cube.pixel_towards(mark.direction) {
        let (column, row) = CROSS[face];
        picture.ring(column * size + x, row * size + y);
    }
    picture
}

fn color(cube: &Cube, face: usize, x: usize, y: usize) -> [u8; 3] {
    let (object, inverse_depth) = cube.shown(face, x, y);
    if object == NOTHING {
        return SKY;
    }
    // Golden-ratio steps around the hue circle keep neighbouring numbers apart.
    let hue = (object as f32 * 0.618_034).fract();
    let shade = if inverse_depth > 0.0 {
        shade(cube, face, x, y)
    } else {
        0.9
    };
    [0.0, 1.0 / 3.0, 2.0 / 3.0].map(|turn| {
        let wave = 0.5 + 0.5 * (std::f32::consts::TAU * (hue + turn)).cos();
        (255.0 * shade * (0.45 + 0.4 * wave)) as u8
    })
}

/// How squarely the surface at a pixel faces the eye, from the depths of its neighbours.
fn shade(cube: &Cube, face: usize, x: usize, y: usize) -> f32 {
    let last = cube.size() - 1;
    let at = |x: usize, y: usize| {
        let inverse_depth = cube.shown(face, x, y).1.max(f32::MIN_POSITIVE);
        cube.direction(face, x, y).as_vec3() / inverse_depth
    };
    let (x, y) = (x.min(last - 1), y.min(last - 1));
    let here = at(x, y);
    let normal = (at(x + 1, y) - here).cross(at(x, y + 1) - here).normalize_or(Vec3::Y);
    0.55 + 0.45 * normal.dot(here.normalize_or(Vec3::Y)).abs()
}

impl Picture {
    fn paint(&mut self, x: usize, y: usize, color: [u8; 3]) {
        let at = 3 * (y * self.width + x);
        self.rgb[at..at + 3].copy_from_slice(&color);
    }

    fn ring(&mut self, x: usize, y: usize) {
        let reach = RING.1 as usize;
        for row in y.saturating_sub(reach)..=(y + reach).min(self.height - 1) {
            for column in x.saturating_sub(reach)..=(x + reach).min(self.width - 1) {
                let radius = (column.abs_diff(x) as f32).hypot(row.abs_diff(y) as f32);
                if (RING.0..RING.1).contains(&radius) {
                    self.paint(column, row, MARK);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{OPAQUE, quad, scene};

    #[test]
    fn what_is_marked_is_red_where_it_shows_and_has_a_ring() {
        let scene = scene(vec![
            quad([-9.0, -9.0], [9.0, 9.0], -2.0, OPAQUE),
            quad([-0.1, -0.1], [0.1, 0.1], -1.0, OPAQUE),
        ]);
        let mut cube = Cube::new(64);
        cube.draw(&scene, DVec3::ZERO, &[true, false]);
        let mark = Mark {
            object: 1,
            direction: DVec3::NEG_Z,
        };
        let red = |picture: &Picture, x: usize, y: usize| picture.rgb[3 * (y * picture.width + x)..][..3] == MARK;
        let marked = cross(&cube, Some(mark));
        assert_eq!((marked.width, marked.height), (256, 192));
        // The face ahead stands in the middle of the cross.
        assert!(red(&marked, 64 + 32, 64 + 32));
        assert!(red(&marked, 64 + 32 + 10, 64 + 32), "the ring");
        assert!(!red(&marked, 64 + 32 + 6, 64 + 32), "between both");
        let plain = cross(&cube, None);
        assert!((0..256 * 192).all(|at| !red(&plain, at % 256, at / 256)));
        assert_eq!(plain.rgb[..3], PAPER);
    }
}
