//! What does the writer of a smooth LOD tell? The cluster tree, undone pass by pass.

use belvedere_scene::smooth::change::Change;
use belvedere_scene::smooth::fan::{Fan, Spoke, Star};
use belvedere_scene::smooth::geometry::Hood;
use belvedere_scene::smooth::script::Script;
use belvedere_scene::smooth::split::{Born, Move, Row, Split};

use super::collapse::{ClusterTree, Collapse};
use super::quantise::QuantisedMesh;
use super::weights::Fit;

const NONE: u32 = u32::MAX;

/// A split: the collapse that it undoes, and how many triangles there were before.
struct Undone<'a> {
    collapse: &'a Collapse,
    triangles: usize,
}

/// Undoes collapses.
pub(super) struct Undo<'a> {
    mesh: &'a QuantisedMesh,
    tree: &'a ClusterTree,
    /// The lattice of each pass lacks so many bits; finest pass first.
    coarse_bits: &'a [u32],
    /// Passes not yet undone.
    passes_left: usize,
    /// Bits that the lattice lacks now.
    lacking: u32,
    /// Corners of the source's triangles as they are now.
    corners: Vec<[u32; 3]>,
    /// By source vertex: number of the collapse onto it in this pass.
    collapse_onto: Vec<u32>,
    source_vertex: Vec<u32>,
    stream_vertex: Vec<u32>,
    /// By stream triangle: its first corner (three times the source's triangle, plus which).
    first_corner: Vec<u32>,
    stream_triangle: Vec<u32>,
    /// By stream triangle: the last split in which it moved.
    moved_in: Vec<u32>,
    splits: u32,
    current: Option<&'a Collapse>,
    /// Splits so far.
    undone: Vec<Undone<'a>>,
    /// By stream wedge.
    pub(super) source_wedge: Vec<u32>,
    wedges: WedgesOfVertices,
    /// New triangles of the current split, by first corner.
    newborn: Vec<(u32, Born)>,
    /// Of each of them, whether it was said already how it comes.
    is_explained: Vec<bool>,
    /// Gathers what weights are fitted to.
    pub(super) fit: Fit,
}

impl<'a> Undo<'a> {
    pub(super) fn new(mesh: &'a QuantisedMesh, tree: &'a ClusterTree, coarse_bits: &'a [u32]) -> Self {
        let vertices = mesh.positions.len();
        let mut stream_vertex = vec![NONE; vertices];
        stream_vertex[tree.root as usize] = 0;
        Self {
            mesh,
            tree,
            coarse_bits,
            passes_left: tree.passes.len(),
            lacking: mesh.bits,
            corners: tree.triangles.clone(),
            collapse_onto: vec![NONE; vertices],
            source_vertex: vec![tree.root],
            stream_vertex,
            first_corner: Vec::with_capacity(mesh.triangles.len()),
            stream_triangle: vec![NONE; mesh.triangles.len()],
            moved_in: Vec::with_capacity(mesh.triangles.len()),
            splits: 0,
            current: None,
            undone: Vec::with_capacity(vertices),
            source_wedge: Vec::new(),
            wedges: WedgesOfVertices::of(mesh),
            newborn: Vec::new(),
            is_explained: Vec::new(),
            fit: Fit::new(),
        }
    }

    /// Corners of the source's triangles before the first split.
    pub(super) fn first_corners(&self) -> &[[u32; 3]] {
        &self.tree.triangles
    }

    /// Of a split that has been told, by its new vertex: that in the source, and the corners of the source that it moved there.
    pub(super) fn split(&self, vertex: u32) -> (u32, &[u32]) {
        let collapse = self.undone[vertex as usize - 1].collapse;
        (collapse.gone, self.tree.corners(collapse))
    }

    /// How many triangles there are when there are so many vertices.
    pub(super) fn triangles_before(&self, vertices: u32) -> usize {
        let next = self.undone.get(vertices as usize - 1);
        next.map_or(self.first_corner.len(), |split| split.triangles)
    }

    /// The number in the stream of one of the source's vertices.
    pub(super) fn stream_vertex(&self, vertex: u32) -> u32 {
        self.stream_vertex[vertex as usize]
    }

    /// The source's corners (three times the triangle, plus which) that those of a triangle of the stream are.
    pub(super) fn corners_of(&self, triangle: u32) -> [u32; 3] {
        let corner = self.first_corner[triangle as usize];
        let (first, side) = (corner - corner % 3, corner % 3);
        [0, 1, 2].map(|next| first + (side + next) % 3)
    }

    /// The source's triangle that one of the stream becomes.
    pub(super) fn source_triangle(&self, triangle: u32) -> usize {
        self.first_corner[triangle as usize] as usize / 3
    }

    fn at(&self, source_vertex: u32) -> [i32; 3] {
        self.mesh.positions[source_vertex as usize].map(|x| x >> self.lacking)
    }

    fn distance(&self, a: u32, b: u32) -> u32 {
        let stride = self.mesh.stride();
        let [a, b] = [a, b].map(|wedge| &self.mesh.values[wedge as usize * stride..][..stride]);
        a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).sum()
    }

    /// A new triangle of this kind that was not yet explained.
    fn unexplained(&self, born: Born) -> Option<usize> {
        let mut newborn = self.newborn.iter().zip(&self.is_explained);
        newborn.position(|(&(_, b), &is_explained)| !is_explained && b == born)
    }

    fn explain(&mut self, star: &Star, fan: Fan, torn: &mut Vec<bool>) -> Move {
        let spokes = star.of(fan);
        let length = fan.length;
        let moves = |spoke: &Spoke| self.moved_in[spoke.triangle as usize] == self.splits;
        let third = |i: usize| match spokes.get(i) {
            Some(spoke) => spoke.from,
            None if fan.closed => spokes[i - length].from,
            None => spokes[length - 1].to,
        };
        // Where the moved ones begin, if they are in one row; if there are none or all, wherever most edges open.
        let (mut count, mut begins, mut begin) = (0, 0, 0);
        let mut moved_before = fan.closed && moves(&spokes[length - 1]);
        for (i, spoke) in spokes.iter().enumerate() {
            let moved = moves(spoke);
            if moved && !moved_before {
                begins += 1;
                begin = i;
            }
            count += usize::from(moved);
            moved_before = moved;
        }
        let rows = match begins {
            1 => begin..begin + 1,
            0 if count == 0 && !fan.closed => 0..length + 1,
            0 => 0..length,
            _ => 0..0,
        };
        let mut best: Option<(usize, Row, [Option<usize>; 2])> = None;
        for first in rows {
            let born = |i: usize, old_first| Born {
                third: third(i),
                old_first,
            };
            let explained = [born(first, false), born(first + count, true)].map(|born| self.unexplained(born));
            let opened = explained.iter().flatten().count();
            if best.is_none_or(|(most, _, _)| opened > most) {
                let row = Row {
                    first: first as u32,
                    count: count as u32,
                    opens: explained.map(|newborn| newborn.is_some()),
                };
                best = Some((opened, row, explained));
            }
        }
        match best {
            Some((opened, row, explained)) if opened > 0 || count > 0 && count < length => {
                explained
                    .into_iter()
                    .flatten()
                    .for_each(|i| self.is_explained[i] = true);
                Move::Row(row)
            }
            _ if count == 0 => Move::Stay,
            _ if count == length => Move::Go,
            _ => {
                torn.extend(spokes.iter().map(moves));
                Move::Torn
            }
        }
    }
}

/// Which wedges the corners at each source vertex have, triangle by triangle.
struct WedgesOfVertices {
    wedges: Vec<u32>,
    /// Where in `wedges` those of a vertex begin; that of the last one ends where that of the vertex behind it would begin.
    begins: Vec<u32>,
}

impl WedgesOfVertices {
    fn of(mesh: &QuantisedMesh) -> Self {
        let mut begins = vec![0; mesh.positions.len() + 1];
        let corners = mesh.triangles.as_flattened().iter().zip(mesh.corners.as_flattened());
        for (&vertex, _) in corners.clone() {
            begins[vertex as usize] += 1;
        }
        let mut end = 0;
        for begin in &mut begins {
            end += *begin;
            *begin = end;
        }
        let mut wedges = vec![0; end as usize];
        for (&vertex, &wedge) in corners.rev() {
            let begin = &mut begins[vertex as usize];
            *begin -= 1;
            wedges[*begin as usize] = wedge;
        }
        Self { wedges, begins }
    }

    fn of_vertex(&self, vertex: u32) -> &[u32] {
        let begins = &self.begins[vertex as usize..];
        &self.wedges[begins[0] as usize..begins[1] as usize]
    }
}

impl Script for Undo<'_> {
    fn pass(&mut self) -> Option<u32> {
        for collapse in self
            .tree
            .passes
            .get(self.passes_left)
            .map_or(&[][..], |pass| &pass.collapses)
        {
            self.collapse_onto[collapse.kept as usize] = NONE;
        }
        if self.passes_left == 0 {
            return None;
        }
        self.passes_left -= 1;
        for (i, collapse) in self.tree.passes[self.passes_left].collapses.iter().enumerate() {
            self.collapse_onto[collapse.kept as usize] = i as u32;
        }
        Some(self.lacking - self.coarse_bits[self.passes_left])
    }

    fn low_bits(&mut self, vertex: u32) -> usize {
        if vertex == 0 {
            self.lacking -= 1;
        }
        let at = self.at(self.source_vertex[vertex as usize]);
        (0..3).map(|axis| ((at[axis] & 1) as usize) << axis).sum()
    }

    fn splits(&mut self, vertex: u32) -> bool {
        let onto = self.collapse_onto[self.source_vertex[vertex as usize] as usize];
        self.current = self.tree.passes[self.passes_left].collapses.get(onto as usize);
        self.current.is_some()
    }

    fn split(&mut self, star: &Star, split: &mut Split) {
        split.clear();
        let Some(collapse) = self.current else {
            return;
        };
        self.splits += 1;
        self.newborn.clear();
        for &corner in self.tree.corners(collapse) {
            self.corners[corner as usize / 3][corner as usize % 3] = collapse.gone;
        }
        for &corner in self.tree.corners(collapse) {
            let triangle = corner / 3;
            let corners = self.corners[triangle as usize];
            let [a, b, c] = corners;
            let stream = self.stream_triangle[triangle as usize];
            if stream != NONE {
                self.moved_in[stream as usize] = self.splits;
            } else if a != b && b != c && c != a {
                let side = corner as usize % 3;
                let (next, before) = (corners[(side + 1) % 3], corners[(side + 2) % 3]);
                let old_first = before == collapse.kept;
                let third = self.stream_vertex[if old_first { next } else { before } as usize];
                let first = if old_first { (side + 2) % 3 } else { side };
                self.newborn
                    .push((3 * triangle + first as u32, Born { third, old_first }));
            }
        }
        self.is_explained.clear();
        self.is_explained.resize(self.newborn.len(), false);
        for &fan in &star.fans {
            let moved = self.explain(star, fan, &mut split.torn);
            split.moves.push(moved);
        }
        let newborn = self.newborn.iter().zip(&self.is_explained);
        let unexplained = newborn.filter(|(_, is_explained)| !**is_explained);
        split.extra.extend(unexplained.map(|(&(_, born), _)| born));
        split.extras = split.extra.len() as u32;
    }

    fn position(&mut self, hood: &Hood, origin: [i32; 3]) -> [i32; 3] {
        let at = self.current.map_or(origin, |collapse| self.at(collapse.gone));
        self.fit.add(hood, std::array::from_fn(|axis| at[axis] - origin[axis]));
        at
    }

    fn born(&mut self, first: u32, change: &Change, split: &Split) {
        if let Some(collapse) = self.current {
            self.stream_vertex[collapse.gone as usize] = self.source_vertex.len() as u32;
            self.source_vertex.push(collapse.gone);
            self.undone.push(Undone {
                collapse,
                triangles: first as usize,
            });
        }
        let opened = change.opened.iter().map(|opened| opened.born);
        for (i, born) in opened.chain(split.extra.iter().copied()).enumerate() {
            let at = self.newborn.iter().position(|&(_, b)| b == born);
            let (corner, _) = self.newborn.swap_remove(at.unwrap_or_default());
            self.stream_triangle[corner as usize / 3] = first + i as u32;
            self.first_corner.push(corner);
            self.moved_in.push(0);
        }
    }

    fn material(&mut self, triangle: u32) -> u16 {
        self.mesh.materials[self.source_triangle(triangle)]
    }

    fn wedge(&mut self, vertex: u32, triangle: u32, present: &[u32]) -> Option<usize> {
        let source = self.source_triangle(triangle);
        let source_vertex = self.source_vertex[vertex as usize];
        let side = (0..3)
            .find(|&side| self.corners[source][side] == source_vertex)
            .unwrap_or(0);
        let wanted = self.mesh.corners[source][side];
        let is_home = self.mesh.triangles[source][side] == source_vertex;
        let found = if is_home {
            present
                .iter()
                .position(|&wedge| self.source_wedge[wedge as usize] == wanted)
        } else {
            // It will move on to a vertex of its own: until then, the wedge here that looks most like it.
            let distance = |wedge: u32| self.distance(self.source_wedge[wedge as usize], wanted);
            (0..present.len()).min_by_key(|&i| distance(present[i]))
        };
        if found.is_none() {
            let own = self.wedges.of_vertex(source_vertex).iter().copied();
            let nearest = || own.min_by_key(|&wedge| self.distance(wedge, wanted));
            let wedge = if is_home { Some(wanted) } else { nearest() };
            self.source_wedge.push(wedge.unwrap_or(wanted));
        }
        found
    }

    fn values(&mut self, wedge: u32, values: &mut [i32]) {
        let source = self.source_wedge[wedge as usize] as usize;
        let stride = values.len();
        values.copy_from_slice(&self.mesh.values[source * stride..][..stride]);
    }
}
