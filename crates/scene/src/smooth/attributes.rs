//! What do corners look like? Normals, texture coordinates and colours with seams, and a material for each triangle.
//!
//! Positions are welded; a *wedge* (Hoppe 1996) is one set of attribute values at a vertex, shared by those corners there
//! that have no seam between them. When a vertex is split, each corner of the new vertex, and each other corner of a new
//! triangle, says which wedge of its vertex it has, nearest ones in the fan first, or that it has a new one. Then the
//! values of new wedges are told: copied from a corner beside it, or a residual. Expected of a normal is that
//! of the triangles around it; of all else, that it goes on evenly over the triangle that was there before the split.

use super::geometry::residual;
use super::header::MOST_CHANNELS;
use super::mesh::{Mesh, NONE};
use super::model::{Nibble, number};
use super::rans::Coder;
use super::replay::Damage;
use super::script::Script;
use super::values::{Beside, Corner};

/// What a channel holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChannelKind {
    /// A direction as a point on an octahedron: two numbers from −127 to 127.
    Normal,
    /// Two texture coordinates.
    Uv,
    /// Red, green, blue and alpha.
    Colour,
}

/// Some attribute of a corner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Channel {
    /// What it holds.
    pub kind: ChannelKind,
    /// Real value of a number: `low[i] + number · step[i]`. Without meaning for normals.
    pub low: [f32; 2],
    /// See `low`.
    pub step: [f32; 2],
}

impl ChannelKind {
    /// How many numbers it has.
    #[must_use]
    pub fn numbers(self) -> usize {
        match self {
            Self::Normal | Self::Uv => 2,
            Self::Colour => 4,
        }
    }
}

/// Attributes while a mesh grows.
#[derive(Debug)]
pub(super) struct Attributes {
    kinds: Vec<ChannelKind>,
    /// Numbers of a wedge.
    pub(super) stride: usize,
    pub(super) values: Vec<i32>,
    /// The wedge that a vertex got last; by wedge, the one that its vertex got before it.
    latest: Vec<u32>,
    before: Vec<u32>,
    /// Wedges of the triangles' corners.
    pub(super) corners: Vec<[u32; 3]>,
    /// Of each triangle.
    pub(super) materials: Vec<u16>,
    material_count: u32,
    most_wedges: usize,
    models: AttributeModels,
    /// The corners of the new vertex, as they were before the split.
    was: Vec<Corner>,
    /// Corners that have wedges that are still to be told, each with the place here of the next one that has the same.
    asked: Vec<(Corner, u32)>,
    /// The first and the last place of each of those wedges.
    pending: Vec<(u32, u32)>,
    /// The corners of the one that is being told.
    telling: Vec<Corner>,
    present: Vec<u32>,
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

#[derive(Debug, Clone)]
struct AttributeModels {
    same_material: Nibble,
    material: Nibble,
    rank: [[Nibble; 4]; 5],
    copy: Vec<[Nibble; 5]>,
    size: Vec<[[Nibble; 8]; 16]>,
    last_copy: Vec<usize>,
}

/// More wedges of one vertex cannot be named again.
const MOST_PRESENT: usize = 15;

/// Why a corner is asked for its wedge.
#[derive(Clone, Copy)]
enum Asked {
    /// It moved, and had the same wedge as the one beside it.
    MovedSame = 0,
    /// It moved, and had another.
    MovedOther = 1,
    BornNew = 2,
    BornOld = 3,
    BornThird = 4,
}

impl Attributes {
    pub(super) fn new(kinds: Vec<ChannelKind>, material_count: u32, most_wedges: usize) -> Self {
        let numbers: Vec<usize> = kinds.iter().map(|kind| kind.numbers()).collect();
        let stride = numbers.iter().sum();
        let row = || std::array::from_fn(|_| Nibble::default());
        Self {
            stride,
            values: Vec::new(),
            latest: Vec::new(),
            before: Vec::new(),
            corners: Vec::new(),
            materials: Vec::new(),
            material_count,
            most_wedges,
            models: AttributeModels {
                same_material: Nibble::default(),
                material: Nibble::default(),
                rank: std::array::from_fn(|_| row()),
                copy: kinds
                    .iter()
                    .map(|_| std::array::from_fn(|_| Nibble::default()))
                    .collect(),
                size: (0..stride)
                    .map(|_| std::array::from_fn(|_| std::array::from_fn(|_| Nibble::default())))
                    .collect(),
                last_copy: vec![0; kinds.len()],
            },
            was: Vec::new(),
            asked: Vec::new(),
            pending: Vec::new(),
            telling: Vec::new(),
            present: Vec::with_capacity(MOST_PRESENT),
            kinds,
        }
    }

    /// Whether there is nothing to tell.
    pub(super) fn is_empty(&self) -> bool {
        self.stride == 0 && self.material_count < 2
    }

    /// Bytes that [`Attributes::dress`] takes at most for so many corners.
    pub(super) fn step_bytes(&self, corners: usize) -> usize {
        if self.is_empty() {
            0
        } else {
            corners * (8 + 7 * self.stride)
        }
    }

    /// After a split: tells what the new vertex's corners and those of new triangles look like.
    pub(super) fn dress<C: Coder, S: Script>(
        &mut self,
        coder: &mut C,
        mesh: &Mesh,
        mut script: Option<&mut S>,
        split: Done,
    ) -> Result<(), Damage> {
        let Done { old, new, first, .. } = split;
        self.code_materials(coder, mesh, script.as_deref_mut(), new, first);
        if self.stride == 0 {
            return Ok(());
        }
        self.corners.resize(mesh.triangles.len(), [NONE; 3]);
        self.latest.resize(mesh.points.len(), NONE);
        self.asked.clear();
        self.pending.clear();
        let wedges = (self.values.len() / self.stride) as u32;
        let star = mesh.stars.of(mesh.points[new as usize].star);
        // The corners of moved triangles still hold wedges of the old vertex.
        self.was.clear();
        for &triangle in star {
            let side = side_of(mesh, triangle, new);
            let was = std::mem::replace(&mut self.corners[triangle as usize][side], NONE);
            self.was.push((triangle, side, was));
        }
        let mut beside = NONE;
        for i in 0..self.was.len() {
            let corner = self.was[i];
            let asked = match corner.2 {
                NONE => Asked::BornNew,
                wedge if wedge == beside => Asked::MovedSame,
                _ => Asked::MovedOther,
            };
            beside = corner.2;
            self.code_rank(coder, script.as_deref_mut(), star, (new, mesh), corner, (wedges, asked));
        }
        for triangle in first..mesh.triangles.len() as u32 {
            for vertex in mesh.triangles[triangle as usize] {
                if vertex != new {
                    let star = mesh.stars.of(mesh.points[vertex as usize].star);
                    let corner = (triangle, side_of(mesh, triangle, vertex), NONE);
                    let asked = if vertex == old {
                        Asked::BornOld
                    } else {
                        Asked::BornThird
                    };
                    self.code_rank(
                        coder,
                        script.as_deref_mut(),
                        star,
                        (vertex, mesh),
                        corner,
                        (wedges, asked),
                    );
                }
            }
        }
        for i in 0..self.pending.len() {
            self.code_values(coder, script.as_deref_mut(), mesh, wedges, i, split);
        }
        // Only now, so that what was drawn so far stays whole.
        if self.pending.len() + wedges as usize > self.most_wedges {
            return Err("it has more wedges than its header says");
        }
        Ok(())
    }

    fn code_materials<C: Coder, S: Script>(
        &mut self,
        coder: &mut C,
        mesh: &Mesh,
        mut script: Option<&mut S>,
        new: u32,
        first: u32,
    ) {
        if self.material_count < 2 {
            self.materials.resize(mesh.triangles.len(), 0);
            return;
        }
        let star = mesh.stars.of(mesh.points[new as usize].star);
        for triangle in first..mesh.triangles.len() as u32 {
            // As the triangle before it around the new vertex, or else the next one that is known.
            let at = star.iter().position(|&t| t == triangle).unwrap_or(0);
            let (behind, ahead) = star.split_at(at);
            let near = behind.iter().rev().chain(ahead).find(|&&t| t < triangle);
            let expected = near.map_or(0, |&t| self.materials[t as usize]);
            let given = script.as_mut().map_or(0, |script| script.material(triangle));
            let differs = usize::from(given != expected);
            let mut material = expected;
            if coder.symbol(&mut self.models.same_material, differs) > 0 {
                let most = self.material_count - 1;
                material = number(coder, &mut self.models.material, u32::from(given)).min(most) as u16;
            }
            self.materials.push(material);
        }
    }

    /// Which wedge a corner has: those of the corners nearest in its vertex's star come first.
    fn code_rank<C: Coder, S: Script>(
        &mut self,
        coder: &mut C,
        script: Option<&mut S>,
        star: &[u32],
        (vertex, mesh): (u32, &Mesh),
        corner: Corner,
        (wedges, asked): (u32, Asked),
    ) {
        let (triangle, side, _) = corner;
        let count = self.count_present(vertex);
        let given = script.map_or(0, |script| {
            self.find_present(mesh, star, vertex, triangle, count);
            script.wedge(vertex, triangle, &self.present).unwrap_or(count)
        });
        let rank = if count == 0 {
            0
        } else {
            let model = &mut self.models.rank[asked as usize][count.min(3)];
            coder.symbol(model, given).min(count)
        };
        let latest = self.latest[vertex as usize];
        let wedge = if rank == count {
            self.pending.push((NONE, NONE));
            self.before.push(latest);
            self.latest[vertex as usize] = self.before.len() as u32 - 1;
            wedges + self.pending.len() as u32 - 1
        } else if count == 1 {
            latest
        } else {
            self.find_present(mesh, star, vertex, triangle, rank + 1);
            self.present[rank]
        };
        self.corners[triangle as usize][side] = wedge;
        if wedge >= wedges {
            let place = self.asked.len() as u32;
            self.asked.push((corner, NONE));
            let (first, last) = &mut self.pending[(wedge - wedges) as usize];
            match self.asked.get_mut(*last as usize) {
                Some((_, next)) => *next = place,
                None => *first = place,
            }
            *last = place;
        }
    }

    /// How many wedges a vertex got. Its corners have no others, so this tells their number before any is looked at.
    fn count_present(&self, vertex: u32) -> usize {
        let mut count = 0;
        let mut wedge = self.latest[vertex as usize];
        while wedge != NONE && count < MOST_PRESENT {
            count += 1;
            wedge = self.before[wedge as usize];
        }
        count
    }

    /// The first `count` wedges of a vertex: from a triangle's place in its star to both sides in turn, then any others,
    /// latest first.
    fn find_present(&mut self, mesh: &Mesh, star: &[u32], vertex: u32, triangle: u32, count: usize) {
        self.present.clear();
        let mut behind = star.iter().position(|&t| t == triangle).unwrap_or(0);
        let mut ahead = behind + 1;
        while self.present.len() < count && (behind > 0 || ahead < star.len()) {
            if behind > 0 {
                behind -= 1;
                let t = star[behind];
                self.add_present(self.corners[t as usize][side_of(mesh, t, vertex)]);
            }
            if let Some(&t) = star.get(ahead) {
                ahead += 1;
                self.add_present(self.corners[t as usize][side_of(mesh, t, vertex)]);
            }
        }
        // A wedge that no corner has at the moment may come back.
        let mut wedge = self.latest[vertex as usize];
        while wedge != NONE && self.present.len() < count {
            self.add_present(wedge);
            wedge = self.before[wedge as usize];
        }
    }

    #[inline(always)]
    fn add_present(&mut self, wedge: u32) {
        if wedge != NONE && self.present.len() < MOST_PRESENT && !self.present.contains(&wedge) {
            self.present.push(wedge);
        }
    }

    fn code_values<C: Coder, S: Script>(
        &mut self,
        coder: &mut C,
        mut script: Option<&mut S>,
        mesh: &Mesh,
        wedges: u32,
        i: usize,
        split: Done,
    ) {
        self.telling.clear();
        let mut place = self.pending[i].0;
        while let Some(&(corner, next)) = self.asked.get(place as usize) {
            self.telling.push(corner);
            place = next;
        }
        let pending = &self.telling;
        let mut given = [0; 4 * MOST_CHANNELS];
        let given = &mut given[..self.stride];
        if let Some(script) = &mut script {
            script.values(wedges + i as u32, given);
        }
        let (triangle, side, was) = pending[0];
        let corners = self.corners[triangle as usize];
        let sources = [corners[(side + 1) % 3], corners[(side + 2) % 3], was];
        let mut at = 0;
        for channel in 0..self.kinds.len() {
            let kind = self.kinds[channel];
            let numbers = at..at + kind.numbers();
            let beside = Beside {
                mesh,
                corners: &self.corners,
                values: &self.values,
                stride: self.stride,
                pending,
                split: (split.old, split.new),
            };
            let copies = sources.map(|wedge| Some(&beside.value(wedge)?[numbers.clone()]));
            let given_copy = copies
                .iter()
                .position(|copy| copy.is_some_and(|copy| copy == &given[numbers.clone()]));
            let model = &mut self.models.copy[channel][self.models.last_copy[channel]];
            let copy = coder.symbol(model, given_copy.map_or(0, |i| i + 1)).min(3);
            self.models.last_copy[channel] = copy;
            let mut found = [0; 4];
            let copied = copy.checked_sub(1).and_then(|i| copies[i]);
            if let Some(copied) = copied {
                found[..copied.len()].copy_from_slice(copied);
            } else {
                let expected = beside.expected(kind, &numbers);
                let mut context = 0;
                for (k, number) in numbers.clone().enumerate() {
                    let like = match kind {
                        ChannelKind::Normal => pending.len().min(15),
                        _ => usize::from(split.size / 2),
                    };
                    let model = &mut self.models.size[number][like][context];
                    let (value, class) = residual(coder, model, given[number].wrapping_sub(expected[k]));
                    found[k] = value.wrapping_add(expected[k]);
                    context = class / 2;
                }
            }
            self.values.extend_from_slice(&found[..kind.numbers()]);
            at = numbers.end;
        }
    }
}

/// Which corner of a triangle a vertex is.
fn side_of(mesh: &Mesh, triangle: u32, vertex: u32) -> usize {
    let [a, b, c] = mesh.triangles[triangle as usize];
    usize::from(a != vertex && b == vertex) + 2 * usize::from(a != vertex && b != vertex && c == vertex)
}
