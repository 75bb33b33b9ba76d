//! Triangles in one space, ready for rays: those of the world that stand for themselves, or those of a model that stands in
//! many places.

use glam::Vec3A;
use obvhs::{
    aabb::Aabb,
    bvh2::Bvh2,
    ray::{Ray, RayHit},
};

use super::{SEAM, cast::Facet, each_near, tree_over, triangle::Triangle};

/// Triangles, and a tree over them.
pub(super) struct Mesh {
    /// In source order.
    pub(super) triangles: Vec<Triangle>,
    /// Sum of the areas of the object's triangles up to and including this one, m².
    pub(super) area_sums: Vec<f32>,
    /// The triangles again, in the order of the tree.
    facets: Vec<Facet>,
    tree: Bvh2,
}

/// A box with room for rays that pass a seam and for what rounding has lost.
pub(super) fn padded(mut bounds: Aabb) -> Aabb {
    let pad = Vec3A::splat(2.0 * SEAM * bounds.diagonal().max_element() + f32::MIN_POSITIVE);
    let rounding = bounds.min.abs().max(bounds.max.abs()) * f32::EPSILON;
    bounds.min -= pad + rounding;
    bounds.max += pad + rounding;
    bounds
}

/// The box around a triangle.
pub(super) fn padded_box(triangle: &Triangle) -> Aabb {
    padded(Aabb::from_points(&triangle.corners.map(Vec3A::from)))
}

impl Mesh {
    pub(super) fn of(triangles: Vec<Triangle>) -> Self {
        let boxes: Vec<_> = triangles.iter().map(padded_box).collect();
        let tree = tree_over(&boxes);
        let facet = |index: &u32| Facet::of(&triangles[*index as usize], *index);
        let mut sum = (u32::MAX, 0.0);
        let area_sum = |triangle: &Triangle| {
            let before = if sum.0 == triangle.object { sum.1 } else { 0.0 };
            sum = (triangle.object, before + triangle.area_m2());
            sum.1
        };
        Self {
            area_sums: triangles.iter().map(area_sum).collect(),
            facets: tree.primitive_indices.iter().map(facet).collect(),
            triangles,
            tree,
        }
    }

    /// Calls with every facet that a ray meets before its end, which is where `meet` says that it was, if anywhere.
    pub(super) fn traverse(&self, ray: Ray, mut meet: impl FnMut(&Ray, &Facet) -> f32) {
        if !self.facets.is_empty() {
            let meet = |ray: &Ray, index: usize| meet(ray, &self.facets[index]);
            self.tree.ray_traverse(ray, &mut RayHit::none(), meet);
        }
    }

    /// Calls with the number of every triangle that may reach into a box.
    pub(super) fn near(&self, around: Aabb, visit: &mut dyn FnMut(usize)) {
        each_near(&self.tree, around, |index| {
            let index = index as usize;
            if padded_box(&self.triangles[index]).intersect_aabb(&around) {
                visit(index);
            }
        });
    }
}
