//! What do corners look like? Normals, texture coordinates and colours with seams, and a material for each triangle.
//!
//! Positions are welded; a *wedge* (Hoppe 1996) is one set of attribute values at a vertex, shared by those corners there
//! that have no seam between them. When a vertex is split, each corner of the new vertex, and each other corner of a new
//! triangle, says which wedge of its vertex it has, nearest ones in the fan first, or that it has a new one ([`wedges`]).
//! Then the values of new wedges are told: copied from a corner beside it, or a residual ([`values`]). Expected of a normal
//! is that of the triangles around it; of all else, that it goes on evenly over the triangle that was there before the
//! split ([`expected`]).

mod channel;
mod expected;
mod materials;
mod values;
mod wedges;

pub use channel::{Channel, ChannelKind};

use super::looks::Looks;
use super::mesh::Mesh;
use super::rans::Coder;
use super::replay::Damage;
use super::script::Script;
use materials::Materials;
use values::Values;
use wedges::{Corner, Wedges};

/// Attributes while a mesh grows.
#[derive(Debug, Clone)]
pub(super) struct Attributes {
    materials: Materials,
    wedges: Wedges,
    values: Values,
    most_wedges: usize,
    /// The corners of the wedge that is being told.
    telling: Vec<Corner>,
}

/// A split that has been done.
#[derive(Debug, Clone, Copy)]
pub(super) struct Done {
    /// The vertex that was split.
    pub(super) old: u32,
    /// The one that came.
    pub(super) new: u32,
    /// The first of the new triangles.
    pub(super) first: u32,
    /// Size class of the neighbourhood.
    pub(super) size: u8,
}

impl Attributes {
    pub(super) fn new(kinds: Vec<ChannelKind>, materials: u32, most_wedges: usize) -> Self {
        Self {
            materials: Materials::new(materials),
            wedges: Wedges::default(),
            values: Values::new(kinds),
            most_wedges,
            telling: Vec::new(),
        }
    }

    /// Makes room for so many vertices and triangles in all, and wedges, as if each took a byte.
    pub(super) fn reserve(&mut self, vertices: usize, triangles: usize, bytes: usize) {
        self.materials.reserve(triangles);
        if self.stride() > 0 {
            let wedges = self.most_wedges.min(bytes);
            self.wedges.reserve(vertices, triangles, wedges);
            self.values.reserve(wedges);
        }
    }

    /// Numbers of a wedge.
    pub(super) fn stride(&self) -> usize {
        self.values.stride
    }

    /// Numbers of wedges, one wedge after the other.
    pub(super) fn values(&self) -> &[i32] {
        &self.values.numbers
    }

    /// Wedges of the triangles' corners; none without channels.
    pub(super) fn corners(&self) -> &[[u32; 3]] {
        &self.wedges.corners
    }

    /// The material of a triangle.
    pub(super) fn material(&self, triangle: usize) -> u16 {
        self.materials.of(triangle)
    }

    /// Bytes that [`Attributes::dress`] takes at most for so many corners.
    #[inline(always)]
    pub(super) fn step_bytes(&self, corners: usize) -> usize {
        if self.stride() > 0 || self.materials.are_told() {
            corners * (8 + 7 * self.stride())
        } else {
            0
        }
    }

    /// After a split: tells what the new vertex's corners and those of new triangles look like.
    #[inline(always)]
    pub(super) fn dress<C: Coder, S: Script>(
        &mut self,
        coder: &mut C,
        mesh: &Mesh,
        mut script: Option<&mut S>,
        split: Done,
        looks: &mut Looks,
    ) -> Result<(), Damage> {
        if self.materials.are_told() {
            self.materials.code(coder, mesh, script.as_deref_mut(), split);
        }
        if self.stride() == 0 {
            return Ok(());
        }
        let told = self.values.wedges();
        self.wedges
            .code(coder, mesh, script.as_deref_mut(), (split, told), looks);
        for i in 0..self.wedges.pending() {
            self.wedges.gather(i, &mut self.telling);
            let telling = (&self.telling[..], split);
            self.values
                .code(coder, mesh, script.as_deref_mut(), &self.wedges.corners, telling);
        }
        // Only now, so that what was drawn so far stays whole.
        if told as usize + self.wedges.pending() > self.most_wedges {
            return Err("it has more wedges than its header says");
        }
        Ok(())
    }
}
