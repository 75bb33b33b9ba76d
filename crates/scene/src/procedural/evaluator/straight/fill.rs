//! Which solid do these numbers make? They have been checked; what a solid is made of stays where it is from turn to turn.

use super::code::Register;
use super::plan::Planned;
use crate::Bounds;
use crate::procedural::evaluator::terminal::sides_of;
use crate::procedural::solid::Solid;

impl Planned {
    /// Places triangles in all turns at once, where it is nothing but triangles, and sound. Some lie within `bounds` already.
    #[inline(always)]
    pub(super) fn place<const N: usize>(&mut self, numbers: &[[f64; N]], bounds: &Bounds) {
        let faces = (&self.numbers[..], &self.triangles[..]);
        self.is_placed = !self.triangles.is_empty() && self.sheaf.place(numbers, &self.frame, faces, bounds);
    }

    /// Puts in what `at` gives for the registers of the solid.
    pub(super) fn fill(&mut self, detail: u32, at: impl Fn(Register) -> f64) {
        let numbers = &self.numbers;
        let number = |i: usize| at(numbers[i]);
        match &mut self.solid {
            Solid::Box(size) => *size = [number(0), number(1), number(2)],
            Solid::Cone {
                radii,
                height,
                sides,
                closed,
            } => {
                *radii = [number(0), number(1)];
                *height = number(2);
                *sides = sides_of(number(3), detail);
                *closed = number(4) != 0.0;
            }
            Solid::Sphere { radius, sides } => {
                *radius = number(0);
                *sides = sides_of(number(1), detail);
            }
            Solid::Prism { footprint, height } => {
                *height = number(0);
                put_rows(footprint, &numbers[1..], at);
            }
            Solid::Lathe { profile, sides, smooth } => {
                *sides = sides_of(number(0), detail);
                *smooth = number(1) != 0.0;
                put_rows(profile, &numbers[2..], at);
            }
            Solid::Mesh { points, .. } => put_rows(points, numbers, at),
            Solid::Heights(_) => {}
        }
    }
}

fn put_rows<const N: usize>(rows: &mut [[f64; N]], numbers: &[Register], at: impl Fn(Register) -> f64) {
    for (row, numbers) in rows.iter_mut().zip(numbers.chunks_exact(N)) {
        for (number, register) in row.iter_mut().zip(numbers) {
            *number = at(*register);
        }
    }
}
