//! Which pixels of one face does a triangle or a line cover?
//!
//! Clipping: Sutherland and Hodgman, *Reentrant Polygon Clipping*, 1974, against a pyramid a little wider than the face
//! and a near plane. Both faces at a shared edge clip it from the inside to the outside, so they get the same points.
//! Filling: edge functions (Pineda, *A Parallel Algorithm for Polygon Rasterization*, 1988) evaluated with the ends of an
//! edge in a fixed order, so that both faces at it get the same value with opposite signs, and inclusive on both sides.

use glam::{DVec2, Vec3};

use super::{Cube, FACES, Paint};

/// Clipped polygons have at most this many corners: three, and one for each of five planes.
const CORNERS: usize = 8;
/// The clipping pyramid is this much wider than the face.
const WIDE: f32 = 1.01;
/// An edge that rises by less, in pixels, is too level for a guess of where it crosses a row.
const LEVEL: f64 = 1e-6;

struct Polygon {
    corners: [Vec3; CORNERS],
    count: usize,
}

impl Polygon {
    fn push(&mut self, corner: Vec3) {
        // Rounding cannot make a convex polygon cross a plane more than twice in a way that overflows unnoticed.
        if let Some(slot) = self.corners.get_mut(self.count) {
            *slot = corner;
            self.count += 1;
        }
    }

    fn corners(&self) -> &[Vec3] {
        &self.corners[..self.count]
    }
}

/// Signed distances of a point to the planes; inside where none is negative.
fn sides(p: Vec3, near: f32) -> [f32; 5] {
    [
        p.z - near,
        WIDE * p.z - p.x,
        WIDE * p.z + p.x,
        WIDE * p.z - p.y,
        WIDE * p.z + p.y,
    ]
}

fn clip(corners: [Vec3; 3], near: f32) -> Polygon {
    let mut polygon = Polygon {
        corners: [Vec3::ZERO; CORNERS],
        count: 3,
    };
    polygon.corners[..3].copy_from_slice(&corners);
    if corners.iter().all(|p| sides(*p, near).iter().all(|side| *side >= 0.0)) {
        return polygon;
    }
    for plane in 0..5 {
        let mut kept = Polygon {
            corners: [Vec3::ZERO; CORNERS],
            count: 0,
        };
        let corners = polygon.corners();
        for (i, a) in corners.iter().enumerate() {
            let b = &corners[(i + 1) % corners.len()];
            let (here, there) = (sides(*a, near)[plane], sides(*b, near)[plane]);
            if here >= 0.0 {
                kept.push(*a);
            }
            if here >= 0.0 && there < 0.0 {
                kept.push(crossing(*a, *b, here, there));
            } else if here < 0.0 && there >= 0.0 {
                kept.push(crossing(*b, *a, there, here));
            }
        }
        polygon = kept;
    }
    polygon
}

/// Where an edge leaves, from its inner to its outer end.
fn crossing(inner: Vec3, outer: Vec3, inside: f32, outside: f32) -> Vec3 {
    inner + inside / (inside - outside) * (outer - inner)
}

/// The line through two points as a function that is positive on one side; the same function, up to its sign, from
/// either end.
struct Edge {
    x: f64,
    y: f64,
    constant: f64,
}

impl Edge {
    fn between(p: DVec2, q: DVec2) -> Self {
        let swapped = (q.x, q.y) < (p.x, p.y);
        let (from, to) = if swapped { (q, p) } else { (p, q) };
        let sign = if swapped { -1.0 } else { 1.0 };
        let (x, y) = (from.y - to.y, to.x - from.x);
        Self {
            x: sign * x,
            y: sign * y,
            constant: sign * -(x * from.x + y * from.y),
        }
    }

    fn at(&self, x: f64, y: f64) -> f64 {
        self.x * x + self.y * y + self.constant
    }
}

/// One over the depth of a plane, linear on the screen.
struct Slope {
    x: f64,
    y: f64,
    constant: f64,
    least: f64,
    most: f64,
}

/// The columns from `left` to `right` whose middles lie in a triangle. Each edge function is monotone along a row, also
/// when rounded, so they are one run: a guess from where edges cross the row is put right at both ends.
fn span(edges: &[Edge; 3], middle_y: f64, left: usize, right: usize) -> Option<(usize, usize)> {
    let inside = |x: usize| edges.iter().all(|edge| edge.at(x as f64 + 0.5, middle_y) >= 0.0);
    let (mut first, mut last) = (left as f64, right as f64);
    for edge in edges {
        let crossing = -(edge.y * middle_y + edge.constant) / edge.x - 0.5;
        if edge.x > LEVEL {
            first = first.max(crossing);
        } else if edge.x < -LEVEL {
            last = last.min(crossing);
        }
    }
    // Rounding moves a crossing by far less than a pixel.
    let mut first = (first - 0.5).max(left as f64) as usize;
    let mut last = (last + 1.5).clamp(0.0, right as f64) as usize;
    while first <= last && !inside(first) {
        first += 1;
    }
    while first < last && !inside(last) {
        last -= 1;
    }
    (first <= last).then_some((first, last))
}

/// The ceiling of a number that is not negative; `f64::ceil` is a call on processors without rounding instructions.
fn rounded_up(value: f64) -> usize {
    let below = value as usize;
    below + usize::from((below as f64) < value)
}

impl Cube {
    pub(super) fn fill_triangle(&mut self, face: usize, corners: [Vec3; 3], paint: Paint) {
        let views = corners.map(|p| FACES[face].view(p));
        let polygon = clip(views, self.near);
        let corners = polygon.corners();
        if corners.len() < 3 {
            return;
        }
        let mut screen = [DVec2::ZERO; CORNERS];
        let (mut least, mut most) = (f64::INFINITY, 0.0f64);
        for (slot, corner) in screen.iter_mut().zip(corners) {
            *slot = self.on_screen(*corner);
            let inverse = 1.0 / f64::from(corner.z);
            least = least.min(inverse);
            most = most.max(inverse);
        }
        let screen = &screen[..corners.len()];
        if self.covered_range(screen, |p| p.x).is_none() || self.covered_range(screen, |p| p.y).is_none() {
            return;
        }
        let [a, b, c] = views.map(|p| p.as_dvec3());
        let normal = (b - a).cross(c - a);
        let distance = normal.dot(a);
        if distance == 0.0 {
            return;
        }
        let normal = normal / distance;
        // A pixel's middle lies at ±(2 pixel + 1 − size) / size of the face.
        let step = 2.0 / self.size as f64;
        let slope = Slope {
            x: step * normal.x,
            y: -step * normal.y,
            constant: normal.z - normal.x + normal.y,
            least,
            most,
        };
        for i in 2..screen.len() {
            self.fill(face, [screen[0], screen[i - 1], screen[i]], &slope, paint);
        }
    }

    /// Where a view lies on the face, in pixels from the upper left corner.
    fn on_screen(&self, view: Vec3) -> DVec2 {
        let half = 0.5 * self.size as f64;
        let view = view.as_dvec3();
        DVec2::new(half + half * view.x / view.z, half - half * view.y / view.z)
    }

    /// The pixels whose middles lie between the extremes of some points.
    fn covered_range(&self, points: &[DVec2], along: fn(&DVec2) -> f64) -> Option<(usize, usize)> {
        let values = points.iter().map(along);
        let (min, max) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), v| {
            (min.min(v), max.max(v))
        });
        let size = self.size as f64;
        let first = rounded_up((min - 0.5).clamp(0.0, size));
        let last = (max + 0.5).clamp(0.0, size) as usize;
        (first < last).then(|| (first, last - 1))
    }

    fn fill(&mut self, face: usize, [a, b, c]: [DVec2; 3], slope: &Slope, paint: Paint) {
        let area = (b - a).perp_dot(c - a);
        if area == 0.0 {
            return;
        }
        let (b, c) = if area > 0.0 { (b, c) } else { (c, b) };
        let (Some((left, right)), Some((top, bottom))) = (
            self.covered_range(&[a, b, c], |p| p.x),
            self.covered_range(&[a, b, c], |p| p.y),
        ) else {
            return;
        };
        let edges = [Edge::between(a, b), Edge::between(b, c), Edge::between(c, a)];
        for y in top..=bottom {
            let middle_y = y as f64 + 0.5;
            let Some((first, last)) = span(&edges, middle_y, left, right) else {
                continue;
            };
            let row = self.index(face, 0, y);
            let depth_of_row = slope.y * middle_y + slope.constant;
            let depth_at = |x: usize| {
                let depth = slope.x * (x as f64 + 0.5) + depth_of_row;
                depth.clamp(slope.least, slope.most) as f32
            };
            if paint.hides {
                let depths = &mut self.inverse_depth[row + first..=row + last];
                let items = &mut self.item[row + first..=row + last];
                for (i, (known, item)) in depths.iter_mut().zip(items).enumerate() {
                    let depth = depth_at(first + i);
                    if depth > *known {
                        *known = depth;
                        *item = paint.object;
                    }
                }
            } else {
                for x in first..=last {
                    self.show(row + x, depth_at(x), paint);
                }
            }
        }
    }

    /// A line one pixel wide: in each column or row that it crosses, the pixel at its middle. A point is one pixel.
    pub(super) fn trace_line(&mut self, face: usize, ends: [Vec3; 2], paint: Paint) {
        let [mut a, mut b] = ends.map(|p| FACES[face].view(p));
        for plane in 0..5 {
            let (here, there) = (sides(a, self.near)[plane], sides(b, self.near)[plane]);
            match (here >= 0.0, there >= 0.0) {
                (false, false) => return,
                (true, false) => b = crossing(a, b, here, there),
                (false, true) => a = crossing(b, a, there, here),
                (true, true) => {}
            }
        }
        let (from, to) = (self.on_screen(a), self.on_screen(b));
        let length = (to - from).abs().max_element();
        let steps = length.ceil().max(1.0);
        let (near, far) = (1.0 / f64::from(a.z), 1.0 / f64::from(b.z));
        for step in 0..steps as usize {
            let share = (step as f64 + 0.5) / steps;
            let p = from.lerp(to, share);
            let size = self.size as f64;
            if (0.0..size).contains(&p.x) && (0.0..size).contains(&p.y) {
                let at = self.index(face, p.x as usize, p.y as usize);
                self.show(at, (near + share * (far - near)) as f32, paint);
            }
        }
    }
}
