//! Which face does a ray meet first?

use glam::Vec3;
use obvhs::ray::{Ray, RayHit};

use super::{BACK_HIDES, FRONT_HIDES, SEAM, World};

/// Where a ray ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance from the ray's start in lengths of its direction.
    pub t: f32,
    /// Index into [`World::triangles`].
    pub triangle: u32,
    /// The object of that triangle.
    pub object: u32,
}

/// A triangle as rays meet it.
pub(super) struct Facet {
    pub(super) corner: Vec3,
    pub(super) edges: [Vec3; 2],
    pub(super) triangle: u32,
    pub(super) object: u32,
    pub(super) hides: u8,
}

impl Facet {
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
        if self.facets.is_empty() {
            return None;
        }
        let mut end: Option<Hit> = None;
        let mut nearest = RayHit::none();
        self.hierarchy.ray_traverse(
            Ray::new(eye.into(), direction.into(), 0.0, reach),
            &mut nearest,
            |ray, index| {
                let facet = &self.facets[index];
                let Some((t, hides)) = among(facet.object).then(|| facet.hit(ray)).flatten() else {
                    return f32::INFINITY;
                };
                let hit = Hit {
                    t,
                    triangle: facet.triangle,
                    object: facet.object,
                };
                if !hides {
                    passed.push(hit);
                    return f32::INFINITY;
                }
                if end.is_none_or(|end| hit.is_before(&end)) {
                    end = Some(hit);
                }
                t
            },
        );
        if let Some(end) = end {
            passed.retain(|hit| hit.t <= end.t);
        }
        // The order in which the hierarchy gave them says nothing about the scene.
        passed.sort_unstable_by(|a, b| a.t.total_cmp(&b.t).then(a.triangle.cmp(&b.triangle)));
        end
    }
}

impl Hit {
    fn is_before(&self, other: &Self) -> bool {
        (self.t, self.triangle) < (other.t, other.triangle)
    }
}
