//! Which face does a ray meet first?

use glam::Vec3;
use obvhs::ray::Ray;

use super::{
    SEAM, World,
    triangle::{BACK_HIDES, FRONT_HIDES, Triangle},
};

/// Where a ray ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance from the ray's start in lengths of its direction.
    pub t: f32,
    /// Number of the triangle, for [`World::triangle`].
    pub triangle: u32,
    /// The object of that triangle.
    pub object: u32,
}

/// A triangle as rays meet it.
pub(super) struct Facet {
    corner: Vec3,
    edges: [Vec3; 2],
    /// Its place among the triangles of its mesh.
    index: u32,
    object: u32,
    hides: u8,
}

impl Facet {
    pub(super) fn of(triangle: &Triangle, index: u32) -> Self {
        let [a, b, c] = triangle.corners;
        Self {
            corner: a,
            edges: [b - a, c - a],
            index,
            object: triangle.object,
            hides: triangle.hides,
        }
    }

    /// Distance and whether the face hides on the side that is hit (Möller & Trumbore 1997, with grown edges).
    fn hit(&self, ray: &Ray) -> Option<(f32, bool)> {
        let (origin, direction) = (Vec3::from(ray.origin), Vec3::from(ray.direction));
        let [e1, e2] = self.edges;
        let p = direction.cross(e2);
        let det = e1.dot(p);
        let inverse = 1.0 / det;
        let s = origin - self.corner;
        let u = s.dot(p) * inverse;
        let q = s.cross(e1);
        let v = direction.dot(q) * inverse;
        let t = e2.dot(q) * inverse;
        // A NaN or infinity from a ray in the plane of the face fails these comparisons.
        let inside = u >= -SEAM && v >= -SEAM && u + v <= 1.0 + SEAM && t >= 0.0 && t <= ray.tmax;
        let side = if det > 0.0 { FRONT_HIDES } else { BACK_HIDES };
        inside.then_some((t, self.hides & side != 0))
    }
}

/// What a ray has met so far.
struct Met<'p> {
    end: Option<Hit>,
    /// What hides nothing.
    passed: &'p mut Vec<Hit>,
}

impl Met<'_> {
    /// Notes a hit; where the ray ends now, if that is new.
    fn note(&mut self, hit: Hit, hides: bool) -> f32 {
        if !hides {
            self.passed.push(hit);
            return f32::INFINITY;
        }
        if self.end.is_none_or(|end| hit.is_before(&end)) {
            self.end = Some(hit);
        }
        hit.t
    }
}

impl World {
    /// Casts a ray up to `reach` lengths of `direction`. Returns its first hiding hit, of several at one place that of
    /// the first triangle. `passed` is overwritten with the hits before that which hide nothing, nearest first.
    pub fn cast(&self, eye: Vec3, direction: Vec3, reach: f32, passed: &mut Vec<Hit>) -> Option<Hit> {
        self.cast_among(eye, direction, reach, |_| true, passed)
    }

    /// The same, as if there were only some objects.
    pub fn cast_among(
        &self,
        eye: Vec3,
        direction: Vec3,
        reach: f32,
        among: impl Fn(u32) -> bool,
        passed: &mut Vec<Hit>,
    ) -> Option<Hit> {
        passed.clear();
        let mut met = Met { end: None, passed };
        let ray = |reach: f32| Ray::new(eye.into(), direction.into(), 0.0, reach);
        let hit = |t: f32, object: u32, index: u32| Hit {
            t,
            triangle: self.number_of(object, index),
            object,
        };
        self.flat.traverse(ray(reach), |ray, facet| {
            let found = among(facet.object).then(|| facet.hit(ray)).flatten();
            found.map_or(f32::INFINITY, |(t, hides)| {
                met.note(hit(t, facet.object, facet.index), hides)
            })
        });
        let reach = met.end.map_or(reach, |end| end.t);
        self.copies.traverse(ray(reach), &among, |placing, ray, facet| {
            facet.hit(ray).map_or(f32::INFINITY, |(t, hides)| {
                met.note(hit(t, placing.object(), facet.index), hides && !placing.is_open())
            })
        });
        let Met { end, passed } = met;
        if let Some(end) = end {
            passed.retain(|hit| hit.t <= end.t);
        }
        // The order in which trees gave them says nothing about the scene.
        passed.sort_unstable_by(|a, b| a.t.total_cmp(&b.t).then(a.triangle.cmp(&b.triangle)));
        end
    }
}

impl Hit {
    fn is_before(&self, other: &Self) -> bool {
        (self.t, self.triangle) < (other.t, other.triangle)
    }
}
