//! How does a pass begin? It says whether the lattice becomes finer, and if so, the lowest bit of each coordinate of each
//! vertex, in order of birth.
//!
//! Coordinates that equalled those of the vertex it was split from likely still do: that is what the models are told.

use super::looks::TOO_MANY_LOOKS;
use super::mesh::Mesh;
use super::model::{Nibble, number};
use super::rans::Coder;
use super::replay::{Damage, ENDS_EARLY, Phase, Replay};
use super::script::Script;

/// Models of what comes before the vertices are visited.
#[derive(Debug, Clone, Default)]
pub(super) struct PassModels {
    /// By how many bits the lattice becomes finer.
    finer: Nibble,
    /// The three bits of a vertex, by which coordinates equalled the parent's.
    low_bits: [Nibble; 8],
}

impl Replay {
    /// Begins a pass, or ends.
    pub(super) fn begin<C: Coder, S: Script>(
        &mut self,
        coder: &mut C,
        script: Option<&mut S>,
    ) -> Result<Phase, Damage> {
        // 0 is the end, 1 a pass on the same lattice, 2 one on a lattice that is finer by one bit …
        let given = script.map_or(0, |script| script.pass().map_or(0, |finer| finer + 1));
        let found = number(coder, &mut self.models.pass.finer, given);
        if coder.starved() {
            return Err(ENDS_EARLY);
        }
        if found == 0 {
            return Ok(Phase::End);
        }
        if found - 1 > self.coarse_bits {
            return Err("its lattice becomes finer than it can");
        }
        self.looks.take(self.mesh.points.len());
        if self.looks.are_used_up() {
            return Err(TOO_MANY_LOOKS);
        }
        self.pass = self.pass.wrapping_add(1);
        std::mem::swap(&mut self.order, &mut self.visited);
        self.visited.clear();
        self.turn = 0;
        Ok(if found > 1 {
            Phase::Refine {
                next: 0,
                more: found - 2,
            }
        } else {
            self.first_visit()
        })
    }

    /// Refines vertices from `next` on as long as their bytes have come; `more` lattices come after this one.
    pub(super) fn refine<C: Coder, S: Script>(
        &mut self,
        coder: &mut C,
        mut script: Option<&mut S>,
        next: u32,
        more: u32,
    ) -> Result<Phase, Damage> {
        for vertex in next..self.mesh.points.len() as u32 {
            if !coder.has(STEP_BYTES, self.told(vertex)) {
                return Ok(Phase::Refine { next: vertex, more });
            }
            let (same, expected) = likely(&self.mesh, vertex);
            let given = script.as_deref_mut().map_or(0, |script| script.low_bits(vertex));
            let bits = coder.symbol(&mut self.models.pass.low_bits[same], given ^ expected) ^ expected;
            if coder.starved() {
                return Err(ENDS_EARLY);
            }
            self.mesh.refine(vertex, bits);
        }
        self.coarse_bits -= 1;
        self.sizes = 0;
        for point in &mut self.mesh.points {
            point.size = (point.size + 2).min(31);
            self.sizes += u64::from(point.size);
        }
        if more > 0 {
            return Ok(Phase::Refine {
                next: 0,
                more: more - 1,
            });
        }
        self.mesh.add_up();
        Ok(self.first_visit())
    }

    fn first_visit(&mut self) -> Phase {
        self.mean_size = (self.sizes / self.mesh.points.len() as u64) as i32;
        Phase::Visit
    }
}

/// Bytes that the bits of one vertex take at most.
const STEP_BYTES: usize = 16;

/// On which axes a vertex's coordinate equalled that of its parent, which is already refined, and the parent's bits there.
#[inline(always)]
fn likely(mesh: &Mesh, vertex: u32) -> (usize, usize) {
    let parent = mesh.births[vertex as usize].parent;
    if parent >= vertex {
        return (0, 0);
    }
    let (parents, own) = (mesh.points[parent as usize].at(), mesh.points[vertex as usize].at());
    let mut same = 0;
    let mut bits = 0;
    for axis in 0..3 {
        same |= usize::from(parents[axis] >> 1 == own[axis]) << axis;
        bits |= ((parents[axis] & 1) as usize) << axis;
    }
    (same, bits & same)
}
