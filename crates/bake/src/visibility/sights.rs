//! What do all cells share that look around in one world?

use glam::Vec3;
use obvhs::{bvh2::Bvh2, ray::Ray};

use super::{segment, solid::Solid, targets::Lookout};
use crate::{cells::CellGraph, world::World};

/// A world, its cells, and which of them a sight line passes.
pub(super) struct Sights<'a> {
    pub(super) world: &'a World,
    pub(super) lookouts: Vec<Lookout>,
    tree: Bvh2,
}

impl<'a> Sights<'a> {
    pub(super) fn of(world: &'a World, graph: &CellGraph) -> Self {
        let lookouts = Lookout::all(world, graph);
        Self {
            world,
            tree: segment::tree(lookouts.iter().map(|l| [l.min, l.max]), 0.0),
            lookouts,
        }
    }

    /// Marks and lists the cells that a sight line passes, up to `reach` lengths of `direction`, and that are not marked yet.
    pub(super) fn mark(&self, eye: Vec3, direction: Vec3, reach: f32, (marks, listed): (&mut [bool], &mut Vec<u32>)) {
        let ray = Ray::new(eye.into(), direction.into(), 0.0, reach);
        self.tree.ray_traverse_anyhit(ray, |ray, index| {
            let cell = self.tree.primitive_indices[index] as usize;
            let lookout = &self.lookouts[cell];
            let passes = |solid: &Solid| solid.meets(eye, direction, reach);
            if !marks[cell] && lookout.around().intersect_ray(ray) < reach && lookout.solid.as_ref().is_none_or(passes)
            {
                marks[cell] = true;
                listed.push(cell as u32);
            }
        });
    }
}
