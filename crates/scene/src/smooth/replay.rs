//! In what order is a smooth LOD told? In passes over all vertices known so far; one function for writer and reader.
//!
//! A pass says whether the lattice becomes finer, and if so, the lowest bit of every coordinate; then it asks every
//! vertex that was there at its beginning, in order of birth, whether it is split, and if so, how. Batches of splits
//! with one flag for each vertex are from Pajarola & Rossignac, *Compressed progressive meshes* (2000).

use super::attributes::{Attributes, Done};
use super::change::Change;
use super::fan::Star;
use super::geometry::{Hood, ResidualModels, Weights};
use super::header::Header;
use super::mesh::{Mesh, NONE, Point};
use super::model::{Bit, Nibble, number};
use super::rans::{Coder, Writer};
use super::script::Script;
use super::split::{Split, SplitModels};
use super::stars::most_places;

/// Where in the stream one is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Phase {
    /// At the beginning of a pass.
    Pass,
    /// Before the lowest bits of a vertex.
    Refine {
        /// The vertex.
        next: u32,
        /// So many more bits come after this one.
        more: u32,
    },
    /// Before the flag of a vertex.
    Visit(u32),
    /// It is split, and the fans are known; before extra triangles.
    Extra(u32),
    /// Before the position.
    Place(u32),
    /// After the last pass.
    End,
}

/// Models of everything.
#[derive(Debug, Clone, Default)]
pub(super) struct Models {
    pass: Nibble,
    low_bits: [Nibble; 8],
    flags: [[[Bit; 2]; 12]; 9],
    split: SplitModels,
    residual: ResidualModels,
}

/// The mesh so far, and where in the stream one is.
#[derive(Debug)]
pub struct Replay {
    pub(super) mesh: Mesh,
    pub(super) phase: Phase,
    pub(super) models: Models,
    bits: u32,
    /// Bits that the lattice still lacks.
    pub(super) coarse_bits: u32,
    pub(super) attributes: Attributes,
    most_vertices: usize,
    most_triangles: usize,
    most_places: usize,
    weights: Weights,
    /// Vertices at the beginning of the pass.
    known: u32,
    pass: u8,
    sizes: u64,
    mean_size: i32,
    split: Split,
    star: Star,
    change: Change,
}

/// Why a stream cannot be right.
pub(super) type Damage = &'static str;

const ENDS_EARLY: Damage = "it ends before its mesh does";

impl Replay {
    /// Before the first pass: one vertex on a lattice without bits.
    #[must_use]
    pub fn new(header: &Header) -> Self {
        let bits = header.bits;
        let kinds = header.channels.iter().map(|channel| channel.kind).collect();
        Self {
            attributes: Attributes::new(kinds, u32::from(header.materials), header.wedges as usize),
            most_vertices: header.vertices as usize,
            most_triangles: header.triangles as usize,
            most_places: most_places(header.vertices, header.triangles),
            mesh: Mesh::new(),
            phase: Phase::Pass,
            models: Models::default(),
            bits,
            coarse_bits: bits,
            weights: header.weights,
            known: 0,
            pass: 0,
            sizes: 0,
            mean_size: 0,
            split: Split::default(),
            star: Star::default(),
            change: Change::default(),
        }
    }

    /// Goes through a whole stream as its writer. Gives the number of decisions after each pass.
    ///
    /// # Panics
    /// When the script tells what no stream can hold.
    pub fn write<S: Script>(&mut self, writer: &mut Writer, script: &mut S) -> Vec<usize> {
        let mut marks = Vec::new();
        while self.phase != Phase::End {
            if self.phase == Phase::Pass {
                marks.push(writer.decisions());
            }
            let done = self.advance(writer, Some(script));
            assert!(done.is_ok(), "the script tells what no stream can hold: {done:?}");
        }
        marks
    }

    /// Bytes that the next step takes at most: a [`Bit`] takes up to 9 bits, a [`Nibble`] up to 12.
    #[inline(always)]
    pub(super) fn step_bytes(&self) -> usize {
        match self.phase {
            // The worst are fans of one triangle: what becomes of it, how many, the first.
            Phase::Visit(vertex) => 16 + 5 * self.mesh.valence(vertex),
            Phase::Extra(_) => 16 + 8 * self.split.extras as usize,
            // Six residuals and which coordinates are shared; then corners: of moved triangles, and of those that are new.
            Phase::Place(_) => {
                let (fans, spokes) = (self.star.fans.len(), self.star.spokes.len());
                let corners = spokes + 3 * (2 * fans + self.split.extra.len());
                32 + self.attributes.step_bytes(corners)
            }
            _ => 16,
        }
    }

    /// One step. The mesh does not change when it stops.
    #[inline(always)]
    pub(super) fn advance<C: Coder, S: Script>(&mut self, coder: &mut C, script: Option<&mut S>) -> Result<(), Damage> {
        self.phase = match self.phase {
            Phase::Visit(vertex) => self.visit(coder, script, vertex)?,
            Phase::Place(vertex) => self.place(coder, script, vertex)?,
            Phase::Extra(vertex) => self.extra(coder, script.is_some(), vertex)?,
            Phase::Refine { next, more } => self.refine(coder, script, next, more)?,
            Phase::Pass => self.begin(coder, script)?,
            Phase::End => Phase::End,
        };
        Ok(())
    }

    #[inline(always)]
    fn visit<C: Coder, S: Script>(
        &mut self,
        coder: &mut C,
        mut script: Option<&mut S>,
        vertex: u32,
    ) -> Result<Phase, Damage> {
        let point = &self.mesh.points[vertex as usize];
        let size = (i32::from(point.size) - self.mean_size).clamp(-4, 4) + 4;
        let recent = usize::from(point.pass.wrapping_add(1) == self.pass);
        let valence = self.mesh.valence(vertex).min(11);
        let model = &mut self.models.flags[size as usize][valence][recent];
        let splits = coder.bit(model, script.as_mut().is_some_and(|script| script.splits(vertex)));
        if !splits {
            return if coder.starved() {
                Err(ENDS_EARLY)
            } else {
                Ok(visit(point.next))
            };
        }
        self.star.read(&self.mesh, vertex);
        let given = script.map(|script| script.split(&self.star));
        let models = &mut self.models.split;
        models.code_fans(coder, &self.mesh, vertex, &self.star, given.as_ref(), &mut self.split);
        if coder.starved() {
            return Err(ENDS_EARLY);
        }
        if let Some(given) = given {
            self.split.extra = given.extra;
        }
        Ok(if self.split.extras > 0 {
            Phase::Extra(vertex)
        } else {
            Phase::Place(vertex)
        })
    }

    #[cold]
    fn extra<C: Coder>(&mut self, coder: &mut C, is_writer: bool, vertex: u32) -> Result<Phase, Damage> {
        let room = self.most_triangles - self.mesh.triangles.len();
        if self.split.extras as usize > room {
            return Err("it has more triangles than its header says");
        }
        let given = is_writer.then(|| self.split.extra.clone());
        let models = &mut self.models.split;
        models.code_extra(coder, &self.mesh, &self.star, given.as_deref(), &mut self.split);
        if coder.starved() {
            return Err(ENDS_EARLY);
        }
        if self.split.extra.iter().any(|born| born.third == vertex) {
            return Err("a triangle has a corner twice");
        }
        Ok(Phase::Place(vertex))
    }

    #[inline(always)]
    fn place<C: Coder, S: Script>(
        &mut self,
        coder: &mut C,
        script: Option<&mut S>,
        vertex: u32,
    ) -> Result<Phase, Damage> {
        let Self {
            mesh,
            star,
            split,
            change,
            ..
        } = self;
        let first_born = mesh.triangles.len() as u32;
        change.lay_out(star, split, first_born);
        let new = mesh.points.len() as u32;
        let born = change.opened.len() + split.extra.len();
        if new as usize >= self.most_vertices || first_born as usize + born > self.most_triangles {
            return Err("it has more vertices or triangles than its header says");
        }
        let hood = Hood::around(mesh, star, split, change, vertex);
        let origin = mesh.points[vertex as usize].at;
        let mut script = script;
        let given = script.as_mut().map_or([0; 3], |script| script.position(&hood, origin));
        let before = usize::from(mesh.points[vertex as usize].shared);
        let (step, shared) = self.models.residual.code(
            coder,
            &hood,
            &self.weights,
            before,
            std::array::from_fn(|axis| given[axis] - origin[axis]),
        );
        if coder.starved() {
            return Err(ENDS_EARLY);
        }
        let at: [i32; 3] = std::array::from_fn(|axis| origin[axis].wrapping_add(step[axis]));
        let end = 1 << (self.bits - self.coarse_bits);
        if at.iter().any(|&x| x < 0 || x >= end) {
            return Err("a vertex lies outside of the box");
        }
        let old = &mut mesh.points[vertex as usize];
        self.sizes = self.sizes + 2 * u64::from(hood.size) - u64::from(old.size);
        old.size = hood.size;
        old.pass = self.pass;
        let next = std::mem::replace(&mut old.next, new);
        mesh.push(Point {
            at,
            parent: vertex,
            next,
            size: hood.size,
            shared: shared as u8,
            pass: self.pass,
            born: first_born,
            ..Point::default()
        });
        change.apply(mesh, star, split, vertex, new);
        if let Some(script) = &mut script {
            script.born(first_born, change, split);
        }
        let done = Done {
            old: vertex,
            new,
            first: first_born,
            size: hood.size,
        };
        self.attributes.dress(coder, mesh, script, done)?;
        if mesh.stars.places() > self.most_places {
            return Err("its vertices have more triangles than they can");
        }
        if coder.starved() {
            return Err(ENDS_EARLY);
        }
        Ok(visit(next))
    }

    fn begin<C: Coder, S: Script>(&mut self, coder: &mut C, script: Option<&mut S>) -> Result<Phase, Damage> {
        // 0 is the end, 1 a pass on the same lattice, 2 one on a lattice that is finer by one bit …
        let given = script.map_or(0, |script| script.pass().map_or(0, |finer| finer + 1));
        let found = number(coder, &mut self.models.pass, given);
        if coder.starved() {
            return Err(ENDS_EARLY);
        }
        if found == 0 {
            return Ok(Phase::End);
        }
        if found - 1 > self.coarse_bits {
            return Err("its lattice becomes finer than it can");
        }
        self.pass = self.pass.wrapping_add(1);
        self.known = self.mesh.points.len() as u32;
        Ok(if found > 1 {
            Phase::Refine {
                next: 0,
                more: found - 2,
            }
        } else {
            self.first_visit()
        })
    }

    fn first_visit(&mut self) -> Phase {
        self.mean_size = (self.sizes / u64::from(self.known)) as i32;
        Phase::Visit(0)
    }

    #[inline(always)]
    fn refine<C: Coder, S: Script>(
        &mut self,
        coder: &mut C,
        script: Option<&mut S>,
        next: u32,
        more: u32,
    ) -> Result<Phase, Damage> {
        let points = &self.mesh.points;
        let point = points[next as usize];
        // Where a coordinate equalled that of the vertex it was split from, it likely still does.
        let parent = points[point.parent as usize].at;
        let mut same = 0;
        let mut parents_bits = 0;
        if point.parent < next {
            for (axis, (parents, own)) in parent.iter().zip(&point.at).enumerate() {
                same |= usize::from(parents >> 1 == *own) << axis;
                parents_bits |= ((parents & 1) as usize) << axis;
            }
        }
        let expected = parents_bits & same;
        let given = script.map_or(0, |script| script.low_bits(next));
        let bits = coder.symbol(&mut self.models.low_bits[same], given ^ expected) ^ expected;
        if coder.starved() {
            return Err(ENDS_EARLY);
        }
        self.mesh.refine(next, bits);
        if next + 1 < self.known {
            return Ok(Phase::Refine { next: next + 1, more });
        }
        self.coarse_bits -= 1;
        for point in &mut self.mesh.points {
            point.size = (point.size + 2).min(31);
        }
        if more > 0 {
            return Ok(Phase::Refine {
                next: 0,
                more: more - 1,
            });
        }
        self.sizes = self.mesh.points.iter().map(|point| u64::from(point.size)).sum();
        self.mesh.add_up();
        Ok(self.first_visit())
    }
}

#[inline(always)]
fn visit(next: u32) -> Phase {
    if next == NONE { Phase::Pass } else { Phase::Visit(next) }
}
