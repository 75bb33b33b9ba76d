//! In what order is a smooth LOD told? In passes over all vertices known so far; one function for writer and reader.
//!
//! A pass says whether the lattice becomes finer, and if so, the lowest bit of every coordinate ([`super::pass`]); then it
//! asks every vertex that was there at its beginning, in tree order, whether it is split, and if so, how. Batches of splits
//! with one flag for each vertex are from Pajarola & Rossignac, *Compressed progressive meshes* (2000).

use super::attributes::{Attributes, Done};
use super::change::Change;
use super::course::Told;
use super::draft::Draft;
use super::fan::Star;
use super::geometry::{Hood, Weights};
use super::header::Header;
use super::looks::{Looks, TOO_MANY_LOOKS};
use super::mesh::{Birth, Mesh};
use super::model::Bit;
use super::pass::PassModels;
use super::rans::Coder;
use super::residual::ResidualModels;
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
    /// Before the flag of the vertex whose turn it is.
    Visit,
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
    pub(super) pass: PassModels,
    flags: [[[Bit; 2]; 12]; 9],
    split: SplitModels,
    residual: ResidualModels,
}

/// The mesh so far, and where in the stream one is.
#[derive(Debug, Clone)]
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
    pub(super) looks: Looks,
    weights: Weights,
    pub(super) pass: u8,
    /// Vertices at the beginning of the pass in the order of the tree, in which parents come right before their children,
    /// latest first; and those whose turn it was, with what came of them.
    pub(super) order: Vec<u32>,
    pub(super) visited: Vec<u32>,
    /// The place in `order` of the one whose turn it is.
    pub(super) turn: usize,
    pub(super) sizes: u64,
    pub(super) mean_size: i32,
    split: Split,
    /// What a writer was told to write; empty when reading.
    given: Split,
    star: Star,
    change: Change,
    hood: Hood,
}

/// Why a stream cannot be right.
pub(super) type Damage = &'static str;

pub(super) const ENDS_EARLY: Damage = "it ends before its mesh does";

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
            looks: Looks::of(header),
            mesh: Mesh::new(),
            phase: Phase::Pass,
            models: Models::default(),
            bits,
            coarse_bits: bits,
            weights: header.weights,
            pass: 0,
            order: Vec::new(),
            visited: vec![0],
            turn: 0,
            sizes: 0,
            mean_size: 0,
            split: Split::default(),
            given: Split::default(),
            star: Star::default(),
            change: Change::default(),
            hood: Hood::default(),
        }
    }

    /// Makes room for what may come out of so many bytes, so that arrays need not be moved as they grow.
    pub(super) fn reserve(&mut self, bytes: usize) {
        let vertices = self.most_vertices.min(bytes);
        let triangles = self.most_triangles.min(2 * bytes);
        self.mesh.reserve(vertices, triangles);
        self.attributes.reserve(vertices, triangles, bytes);
        for order in [&mut self.order, &mut self.visited] {
            order.reserve(vertices.saturating_sub(order.len()));
        }
    }

    /// Goes through a whole stream as its writer. What it tells does not depend on weights. `None` when readers would
    /// have to look at more than they do.
    ///
    /// # Panics
    /// When the script tells what no stream can hold.
    pub fn draft<S: Script>(mut self, script: &mut S) -> Option<Draft> {
        let mut draft = Draft::new(self.most_vertices);
        while self.phase != Phase::End {
            if self.phase == Phase::Pass {
                draft.begin_pass();
            }
            let done = self.advance(&mut draft, Some(script));
            if done == Err(TOO_MANY_LOOKS) {
                return None;
            }
            assert!(done.is_ok(), "the script tells what no stream can hold: {done:?}");
        }
        draft.births = self.mesh.births;
        Some(draft)
    }

    /// All vertices in the order of the tree.
    pub(super) fn tree_order(&self) -> impl Iterator<Item = u32> {
        self.visited.iter().chain(&self.order[self.turn..]).copied()
    }

    /// The mesh so far, of which so many vertices are on the next lattice.
    #[inline(always)]
    pub(super) fn told(&self, refined: u32) -> Told {
        Told {
            vertices: self.mesh.points.len() as u32,
            coarse_bits: self.coarse_bits,
            refined,
        }
    }

    /// Bytes that the next step takes at most: a [`Bit`] takes up to 9 bits, a [`Nibble`](super::model::Nibble) up to 12.
    fn step_bytes(&self) -> usize {
        match self.phase {
            Phase::Extra(_) => 16 + 8 * self.split.extras as usize,
            Phase::Place(_) => self.place_bytes(),
            Phase::Visit => self.visit_bytes(self.order[self.turn]),
            _ => 16,
        }
    }

    /// The worst are fans of one triangle: what becomes of it, how many, the first.
    #[inline(always)]
    fn visit_bytes(&self, vertex: u32) -> usize {
        16 + 5 * self.mesh.valence(vertex)
    }

    /// Six residuals and which coordinates are shared; then corners: of moved triangles, and of those that are new.
    #[inline(always)]
    fn place_bytes(&self) -> usize {
        let (fans, spokes) = (self.star.fans.len(), self.star.spokes.len());
        let corners = spokes + 3 * (2 * fans + self.split.extra.len());
        32 + self.attributes.step_bytes(corners)
    }

    /// One step, or many visits, if their bytes have come; says so. The mesh does not change when it stops.
    pub(super) fn advance<C: Coder, S: Script>(
        &mut self,
        coder: &mut C,
        script: Option<&mut S>,
    ) -> Result<bool, Damage> {
        let refined = match self.phase {
            Phase::Refine { next, .. } => next,
            _ => 0,
        };
        if !coder.has(self.step_bytes(), self.told(refined)) {
            return Ok(false);
        }
        self.phase = match self.phase {
            Phase::Visit => self.visit(coder, script)?,
            Phase::Place(vertex) => self.place(coder, script, vertex)?,
            Phase::Extra(vertex) => self.extra(coder, script.is_some(), vertex)?,
            Phase::Refine { next, more } => self.refine(coder, script, next, more)?,
            Phase::Pass => self.begin(coder, script)?,
            Phase::End => Phase::End,
        };
        Ok(true)
    }

    /// Visits vertices as long as all goes its usual way and bytes have come.
    fn visit<C: Coder, S: Script>(&mut self, coder: &mut C, mut script: Option<&mut S>) -> Result<Phase, Damage> {
        while let Some(&vertex) = self.order.get(self.turn) {
            if !coder.has(self.visit_bytes(vertex), self.told(0)) {
                return Ok(Phase::Visit);
            }
            if !self.splits(coder, script.as_deref_mut(), vertex) {
                if coder.starved() {
                    return Err(ENDS_EARLY);
                }
                self.visited.push(vertex);
                self.turn += 1;
                continue;
            }
            self.star.read(&self.mesh, vertex);
            let given = script.as_deref_mut().map(|script| {
                script.split(&self.star, &mut self.given);
                &self.given
            });
            let models = &mut self.models.split;
            models.code_fans(coder, &self.mesh, vertex, &self.star, given, &mut self.split);
            if coder.starved() {
                return Err(ENDS_EARLY);
            }
            std::mem::swap(&mut self.split.extra, &mut self.given.extra);
            if self.split.extras > 0 {
                return Ok(Phase::Extra(vertex));
            }
            if !coder.has(self.place_bytes(), self.told(0)) {
                return Ok(Phase::Place(vertex));
            }
            self.place(coder, script.as_deref_mut(), vertex)?;
        }
        Ok(Phase::Pass)
    }

    /// Whether a vertex is split in this pass.
    #[inline(always)]
    fn splits<C: Coder, S: Script>(&mut self, coder: &mut C, script: Option<&mut S>, vertex: u32) -> bool {
        let point = &self.mesh.points[vertex as usize];
        let size = (i32::from(point.size) - self.mean_size).clamp(-4, 4) + 4;
        let recent = usize::from(point.pass.wrapping_add(1) == self.pass);
        let valence = point.star.length().min(11);
        let model = &mut self.models.flags[size as usize][valence][recent];
        coder.bit(model, script.is_some_and(|script| script.splits(vertex)))
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
            hood,
            looks,
            ..
        } = self;
        let first_born = mesh.triangles.len() as u32;
        change.lay_out(star, split, first_born);
        let new = mesh.points.len() as u32;
        let born = change.opened.len() + split.extra.len();
        if new as usize >= self.most_vertices || first_born as usize + born > self.most_triangles {
            return Err("it has more vertices or triangles than its header says");
        }
        hood.look_around(mesh, star, split, change, vertex);
        looks.take(star.spokes.len());
        for opened in &change.opened {
            looks.take_for_search(mesh.valence(opened.born.third));
        }
        let origin = mesh.points[vertex as usize].at();
        let mut script = script;
        let given = script.as_mut().map_or([0; 3], |script| script.position(hood, origin));
        let before = usize::from(mesh.births[vertex as usize].shared);
        let (step, shared) = coder.place(
            &mut self.models.residual,
            hood,
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
        let size = hood.size;
        let old = &mut mesh.points[vertex as usize];
        self.sizes = self.sizes + 2 * u64::from(size) - u64::from(old.size);
        old.size = size;
        old.pass = self.pass;
        let birth = Birth {
            parent: vertex,
            triangles: first_born,
            shared: shared as u8,
        };
        let fresh = mesh.push(at, birth);
        fresh.size = size;
        fresh.pass = self.pass;
        self.visited.extend([vertex, new]);
        self.turn += 1;
        change.apply(mesh, star, split, vertex, new);
        if let Some(script) = &mut script {
            script.born(first_born, change, split);
        }
        let done = Done {
            old: vertex,
            new,
            first: first_born,
            size,
        };
        self.attributes.dress(coder, mesh, script, done, looks)?;
        if mesh.stars.places() > self.most_places {
            return Err("its vertices have more triangles than they can");
        }
        if looks.are_used_up() {
            return Err(TOO_MANY_LOOKS);
        }
        if coder.starved() {
            return Err(ENDS_EARLY);
        }
        Ok(if self.turn < self.order.len() {
            Phase::Visit
        } else {
            Phase::Pass
        })
    }
}
