//! Which triangles do cones, spheres and turned profiles have? Rings around the y axis, joined by strips.

use std::rc::Rc;

use super::mesh::Writer;
use crate::procedural::arithmetic::sin_cos;

/// A circle of vertices with normals that lean outwards.
#[derive(Debug, Clone, Copy)]
struct Ring {
    radius: f64,
    y: f64,
    /// Outward and upward part of the normal.
    normal: [f64; 2],
}

/// A mantle, and a disc at each end that has a radius when it is closed.
pub(super) fn write_cone(writer: &mut Writer, circle: &[[f64; 2]], (radii, height): ([f64; 2], f64), closed: bool) {
    let [low, high] = radii;
    let ring = |radius, y| Ring {
        radius,
        y,
        normal: [height, low - high],
    };
    strip(writer, circle, &[ring(low, 0.0), ring(high, height)]);
    if closed {
        disc(writer, circle, (low, 0.0), false);
        disc(writer, circle, (high, height), true);
    }
}

/// Half as many rows as sides.
pub(super) fn write_sphere(writer: &mut Writer, circle: &[[f64; 2]], radius: f64) {
    let rows = (circle.len() as u32).div_ceil(2).max(2);
    let ring = |row: u32| {
        let (sin, cos) = sin_cos(180.0 * f64::from(row) / f64::from(rows));
        Ring {
            radius: radius * sin,
            y: -radius * cos,
            normal: [sin, -cos],
        }
    };
    strip(writer, circle, &(0..=rows).map(ring).collect::<Vec<_>>());
}

/// A strip for each part of the profile, or one for all of it when it is smooth.
pub(super) fn write_lathe(writer: &mut Writer, circle: &[[f64; 2]], profile: &[[f64; 2]], smooth: bool) {
    let outward = |i: usize| {
        let ([r, y], [to_r, to_y]) = (profile[i], profile[i + 1]);
        let (dr, dy) = (to_r - r, to_y - y);
        let length = (dr * dr + dy * dy).sqrt();
        if length > 0.0 {
            [dy / length, -dr / length]
        } else {
            [0.0, 0.0]
        }
    };
    let last = profile.len() - 1;
    let ring = |i: usize, normal| Ring {
        radius: profile[i][0],
        y: profile[i][1],
        normal,
    };
    if smooth {
        let rings = (0..=last).map(|i| {
            let (a, b) = (outward(i.saturating_sub(1)), outward(i.min(last - 1)));
            ring(i, [a[0] + b[0], a[1] + b[1]])
        });
        strip(writer, circle, &rings.collect::<Vec<_>>());
        return;
    }
    for i in 0..last {
        let normal = outward(i);
        strip(writer, circle, &[ring(i, normal), ring(i + 1, normal)]);
    }
}

/// Circles that were asked for, by their sides.
#[derive(Debug, Default)]
pub(super) struct Circles(Vec<Option<Rc<[[f64; 2]]>>>);

impl Circles {
    /// Directions x, z of the corners, the first along x, then towards −z: counter-clockwise from above.
    pub(super) fn of(&mut self, sides: u32) -> Rc<[[f64; 2]]> {
        let at = sides as usize;
        if self.0.len() <= at {
            self.0.resize(at + 1, None);
        }
        let direction = |side: u32| {
            let (sin, cos) = sin_cos(360.0 * f64::from(side) / f64::from(sides));
            [cos, -sin]
        };
        Rc::clone(self.0[at].get_or_insert_with(|| (0..sides).map(direction).collect()))
    }
}

/// Joins each ring to the next; where one has no radius, with triangles. A ring without triangles is not written, so that
/// there are never more than twice as many vertices as triangles.
fn strip(writer: &mut Writer, circle: &[[f64; 2]], rings: &[Ring]) {
    let sides = circle.len() as u32;
    let mut below: Option<(u32, Ring)> = None;
    for (i, ring) in rings.iter().enumerate() {
        let around = &rings[i.saturating_sub(1)..rings.len().min(i + 2)];
        if around.iter().all(|near| near.radius == 0.0) {
            below = None;
            continue;
        }
        let first = writer.next();
        // A tip is one point, which each side has for itself.
        if ring.radius != 0.0 || !writer.same_positions(circle.len(), [0.0, ring.y, 0.0]) {
            writer.positions(circle.iter().map(|[x, z]| [ring.radius * x, ring.y, ring.radius * z]));
        }
        match below {
            Some((under, lower)) if lower.normal.map(f64::to_bits) == ring.normal.map(f64::to_bits) => {
                writer.same_normals(under, sides);
            }
            _ => {
                let [outward, upward] = ring.normal;
                writer.normals(circle.iter().map(|[x, z]| [outward * x, upward, outward * z]));
            }
        }
        if let Some((under, lower)) = below {
            let corners = |side: u32| {
                let next = if side + 1 == sides { 0 } else { side + 1 };
                let low = [under + side, under + next, first + next];
                [low, [under + side, first + next, first + side]]
            };
            match (lower.radius > 0.0, ring.radius > 0.0) {
                (true, true) => writer.triangles(sides, corners),
                (true, false) => writer.triangles(sides, |side| [corners(side)[0]]),
                (false, true) => writer.triangles(sides, |side| [corners(side)[1]]),
                (false, false) => {}
            }
        }
        below = Some((first, *ring));
    }
}

/// A flat, regular polygon; nothing without a radius.
fn disc(writer: &mut Writer, circle: &[[f64; 2]], (radius, y): (f64, f64), looks_up: bool) {
    if radius == 0.0 {
        return;
    }
    let normal = writer.normal([0.0, if looks_up { 1.0 } else { -1.0 }, 0.0]);
    let first = writer.next();
    writer.flat(circle.iter().map(|[x, z]| [radius * x, y, radius * z]), normal);
    for next in first + 2..first + circle.len() as u32 {
        if looks_up {
            writer.triangle(first, next - 1, next);
        } else {
            writer.triangle(first, next, next - 1);
        }
    }
}
