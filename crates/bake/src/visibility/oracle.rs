//! What is really visible from a point? Two answers that share no code with the sampler: a plain loop over all
//! triangles for single sight lines, and an item buffer for whole views.

use glam::{DVec3, Vec3};

use crate::world::World;

/// The object of the first hiding face on a segment from `eye` to `target`, in double precision, by trying all.
pub(super) fn first_hiding_face(world: &World, eye: DVec3, target: DVec3) -> Option<u32> {
    let direction = target - eye;
    let mut first: Option<(f64, u32)> = None;
    for triangle in world.triangles() {
        let [a, b, c] = triangle.corners.map(|p| p.as_dvec3());
        let normal = (b - a).cross(c - a);
        let facing = normal.dot(direction);
        if facing == 0.0 || !triangle.hides_from(eye.as_vec3()) {
            continue;
        }
        let t = normal.dot(a - eye) / facing;
        let point = eye + t * direction;
        let inside = [(a, b), (b, c), (c, a)]
            .iter()
            .all(|(from, to)| normal.dot((*to - *from).cross(point - *from)) >= -SEAM * normal.length_squared());
        if inside && (0.0..=1.0 + 1e-9).contains(&t) && first.is_none_or(|(nearest, _)| t < nearest) {
            first = Some((t, triangle.object));
        }
    }
    first.map(|(_, object)| object)
}

/// Pixels of each object on the six faces of a cube around an eye. Only sides that hide are drawn.
pub(super) struct ItemBuffer {
    size: usize,
    depth: Vec<f32>,
    item: Vec<u32>,
    pub(super) pixels: Vec<u32>,
    /// Items and directions of the first pixels of rarely seen objects.
    views: Vec<(u32, Vec3)>,
}

const NONE: u32 = u32::MAX;
/// Triangles are this share larger, so that nothing is seen through the seams between them.
const SEAM: f64 = 1e-6;
const NEAR_M: f32 = 1e-6;

impl ItemBuffer {
    pub(super) fn new(size: usize, objects: usize) -> Self {
        Self {
            size,
            depth: vec![0.0; size * size],
            item: vec![NONE; size * size],
            pixels: vec![0; objects],
            views: Vec::new(),
        }
    }

    /// Whether the plain loop agrees that one sees the object, through the middle of one of its first pixels. A
    /// rasteriser sees through the seam between two faces, an eye does not.
    pub(super) fn confirms(&mut self, world: &World, eye: Vec3, object: u32) -> bool {
        const TRIED: usize = 8;
        let views = std::mem::take(&mut self.views);
        let reach_m = 10.0 * world.bounds().diagonal_m();
        let confirmed = views
            .iter()
            .filter(|(item, _)| *item == object)
            .take(TRIED)
            .any(|(_, direction)| {
                let eye = eye.as_dvec3();
                first_hiding_face(world, eye, eye + reach_m * direction.as_dvec3().normalize()) == Some(object)
            });
        self.views = views;
        confirmed
    }

    pub(super) fn draw(&mut self, world: &World, eye: Vec3) {
        self.pixels.fill(0);
        self.views.clear();
        let front: Vec<_> = world
            .triangles()
            .filter(|t| t.hides_from(eye))
            .map(|t| (t.corners.map(|p| p - eye), t.object))
            .collect();
        for face in 0..6 {
            self.depth.fill(0.0);
            self.item.fill(NONE);
            let axis = face / 2;
            let sign = if face % 2 == 0 { 1.0 } else { -1.0 };
            for (corners, object) in &front {
                let view = corners.map(|p| Vec3::new(p[(axis + 1) % 3], p[(axis + 2) % 3], sign * p[axis]));
                self.draw_triangle(&view, *object);
            }
            for (index, item) in self.item.iter().enumerate().filter(|(_, item)| **item != NONE) {
                let pixels = &mut self.pixels[*item as usize];
                *pixels += 1;
                if pixels.is_power_of_two() {
                    let at = |i: usize| (i as f32 + 0.5) / (0.5 * self.size as f32) - 1.0;
                    let mut direction = Vec3::ZERO;
                    direction[(axis + 1) % 3] = at(index % self.size);
                    direction[(axis + 2) % 3] = at(index / self.size);
                    direction[axis] = sign;
                    self.views.push((*item, direction));
                }
            }
        }
    }

    fn draw_triangle(&mut self, view: &[Vec3; 3], object: u32) {
        // The sides of the view, a little wide, and a near plane: without the sides, screen positions could be too
        // large for their precision.
        let planes = [
            (Vec3::new(1.0, 0.0, 1.001), 0.0),
            (Vec3::new(-1.0, 0.0, 1.001), 0.0),
            (Vec3::new(0.0, 1.0, 1.001), 0.0),
            (Vec3::new(0.0, -1.0, 1.001), 0.0),
            (Vec3::Z, -NEAR_M),
        ];
        let mut polygon = view.to_vec();
        for (normal, offset) in planes {
            let side = |p: Vec3| normal.dot(p) + offset;
            let mut kept = Vec::with_capacity(polygon.len() + 1);
            for (i, a) in polygon.iter().enumerate() {
                let b = polygon[(i + 1) % polygon.len()];
                let (here, there) = (side(*a), side(b));
                if here >= 0.0 {
                    kept.push(*a);
                }
                if (here >= 0.0) != (there >= 0.0) {
                    kept.push(a + here / (here - there) * (b - a));
                }
            }
            if kept.is_empty() {
                return;
            }
            polygon = kept;
        }
        let half = 0.5 * self.size as f32;
        let screen: Vec<_> = polygon
            .iter()
            .map(|p| Vec3::new(half * (p.x / p.z + 1.0), half * (p.y / p.z + 1.0), 1.0 / p.z))
            .collect();
        for i in 2..screen.len() {
            self.fill([screen[0], screen[i - 1], screen[i]], object);
        }
    }

    /// Fills a screen triangle whose z is one over depth.
    fn fill(&mut self, [a, b, c]: [Vec3; 3], object: u32) {
        let edge = |p: Vec3, q: Vec3, x: f32, y: f32| {
            f64::from(q.x - p.x) * f64::from(y - p.y) - f64::from(q.y - p.y) * f64::from(x - p.x)
        };
        let area = edge(a, b, c.x, c.y);
        if area == 0.0 {
            return;
        }
        let limit = |v: f32| v.clamp(0.0, self.size as f32) as usize;
        let columns = limit(a.x.min(b.x).min(c.x))..limit(a.x.max(b.x).max(c.x) + 1.0);
        for y in limit(a.y.min(b.y).min(c.y))..limit(a.y.max(b.y).max(c.y) + 1.0) {
            for x in columns.clone() {
                let (px, py) = (x as f32 + 0.5, y as f32 + 0.5);
                let weights = [
                    edge(b, c, px, py) / area,
                    edge(c, a, px, py) / area,
                    edge(a, b, px, py) / area,
                ];
                if weights.iter().all(|w| *w >= 0.0) {
                    let depth = (0..3).map(|i| weights[i] * f64::from([a, b, c][i].z)).sum::<f64>() as f32;
                    let index = y * self.size + x;
                    if depth > self.depth[index] {
                        self.depth[index] = depth;
                        self.item[index] = object;
                    }
                }
            }
        }
    }
}
