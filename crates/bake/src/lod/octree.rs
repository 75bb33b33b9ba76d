//! Which vertices fall together, and in which order?
//!
//! D. Schmalstieg, *The Remote Rendering Pipeline* (1997), §6.2: vertices are entered into an octree over the model's box
//! until each has a cell of its own; doublets share one (the thesis's case 2), and two that meet in one cell divide it
//! (case 3). Clusters are then formed by closing cells, children before parents, in an [`Order`]; a closed cell is
//! represented by one of its vertices (`representative`). So a level never leaves the source's box and has no
//! coordinates that the source has not.
//!
//! The octree is built from a sorted row of Morton codes: a cell is a run of points whose codes begin alike, and only
//! cells with at least two children are kept. It is thus the same for any order of insertion, has fewer cells than
//! points, and no input makes it deep. Locked positions stay outside and never move.
//!
//! Cost: O(n log n) for n vertices; a cut is linear.

use std::collections::BTreeSet;

use glam::DVec3;

use crate::lod::ancestry::Ancestry;
use crate::lod::cube::{MAX_DEPTH, RootCube};
use crate::lod::representative::{Involved, Measures, Part, representative};
use crate::{radix, source::Primitive};

/// Stands for "this vertex is used by no shape".
const UNUSED: u32 = u32::MAX;

/// Which cell is closed first. Cells are never closed before those in them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Order {
    /// The one that costs the least quadric error, of any depth: flat parts first, however large their cells.
    #[default]
    LeastError,
    /// The deepest; of several, the one with the most vertices. Keeps small distinctive features.
    MostVertices,
    /// The deepest; of several, the one with the fewest vertices. Keeps the sum of errors small.
    FewestVertices,
}

/// How the octree generator works.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OctreeSettings {
    /// Which clusters are formed first.
    pub order: Order,
    /// Which vertex represents a cluster.
    pub measures: Measures,
}

/// The distinct positions of a model and the cells around them.
pub(super) struct Octree {
    /// The free ones in Morton order, then the locked ones.
    points: Vec<[f32; 3]>,
    free: usize,
    /// For each primitive, for each vertex, the index of its point.
    point_of_vertex: Vec<Vec<u32>>,
    /// Cells with at least two children, each after its children.
    cells: Vec<Cell>,
    /// For each cell, which number it is in the order of closing.
    rank: Vec<u32>,
}

/// A cell: a run of free points.
#[derive(Debug, Clone, Copy)]
struct Cell {
    first: u32,
    end: u32,
    representative: u32,
    /// Smaller is closed earlier.
    key: u64,
}

/// Points that fall together.
pub(super) struct Clusters {
    /// For each primitive, for each vertex, its cluster. Meaningless for vertices that no shape uses.
    pub(super) of_vertex: Vec<Vec<u32>>,
    /// For each cluster, the position that stands for it: one of the source's.
    pub(super) representatives: Vec<[f32; 3]>,
}

/// Positions that must not move, by their bits.
#[derive(Debug, Default)]
pub(super) struct Locked(BTreeSet<[u32; 3]>);

impl Locked {
    pub(super) fn new(positions: &[[f32; 3]]) -> Self {
        Self(positions.iter().map(|p| position_bits(*p)).collect())
    }

    pub(super) fn contains(&self, position: [f32; 3]) -> bool {
        !self.0.is_empty() && self.0.contains(&position_bits(position))
    }
}

impl Octree {
    /// Enters every vertex that a shape uses.
    pub(super) fn new(primitives: &[Primitive], locked: &Locked, settings: &OctreeSettings) -> Self {
        let mut octree = Self {
            points: Vec::new(),
            free: 0,
            point_of_vertex: primitives.iter().map(|p| vec![UNUSED; p.positions.len()]).collect(),
            cells: Vec::new(),
            rank: Vec::new(),
        };
        let root = RootCube::around(primitives.iter().flat_map(used_positions));
        let (codes, counts) = octree.enter(primitives, &root, locked);
        let involved = Involved::new(
            primitives,
            &octree.point_of_vertex,
            &octree.points,
            &root,
            settings.measures,
        );
        octree.cells = divide(&codes, &counts, &involved, settings.order);
        octree.rank_cells();
        octree
    }

    /// Sorts vertices into points; gives the codes of the free ones, and how many vertices each has.
    fn enter(&mut self, primitives: &[Primitive], root: &RootCube, locked: &Locked) -> (Vec<u64>, Vec<u32>) {
        // Vertices of all primitives are numbered on.
        let most = primitives.iter().map(|p| p.positions.len()).sum();
        let mut vertices: Vec<(u32, u32)> = Vec::with_capacity(most);
        let mut positions: Vec<[u32; 3]> = Vec::with_capacity(most);
        let mut rows: Vec<(u64, u32)> = Vec::with_capacity(most);
        let mut stay: Vec<([u32; 3], u32)> = Vec::new();
        for (p, primitive) in primitives.iter().enumerate() {
            let used = used_vertices(primitive);
            for (v, &position) in primitive.positions.iter().enumerate().filter(|&(v, _)| used[v]) {
                let number = vertices.len() as u32;
                vertices.push((p as u32, v as u32));
                positions.push(position_bits(position));
                if locked.contains(position) {
                    stay.push((position_bits(position), number));
                } else {
                    rows.push((root.code(to_f64(position)), number));
                }
            }
        }
        radix::sort(&mut rows);
        stay.sort_unstable();
        let bits = |number: u32| positions[number as usize];
        self.points.reserve(most);
        let (mut codes, mut counts) = (Vec::with_capacity(most), Vec::with_capacity(most));
        for same in rows.chunk_by_mut(|a, b| a.0 == b.0) {
            if same[1..].iter().any(|row| bits(row.1) != bits(same[0].1)) {
                same.sort_unstable_by_key(|row| (bits(row.1), row.1));
            }
            for doublets in same.chunk_by(|a, b| bits(a.1) == bits(b.1)) {
                codes.push(doublets[0].0);
                counts.push(doublets.len() as u32);
                let doubled = doublets.iter().map(|row| vertices[row.1 as usize]);
                self.add_point(doubled, bits(doublets[0].1));
            }
        }
        self.free = self.points.len();
        for doublets in stay.chunk_by(|a, b| a.0 == b.0) {
            self.add_point(doublets.iter().map(|row| vertices[row.1 as usize]), doublets[0].0);
        }
        (codes, counts)
    }

    fn add_point(&mut self, vertices: impl Iterator<Item = (u32, u32)>, bits: [u32; 3]) {
        for (p, v) in vertices {
            self.point_of_vertex[p as usize][v as usize] = self.points.len() as u32;
        }
        self.points.push(bits.map(f32::from_bits));
    }

    fn rank_cells(&mut self) {
        let mut order: Vec<(u64, u32)> = self.cells.iter().map(|cell| cell.key).zip(0..).collect();
        radix::sort(&mut order);
        self.rank = vec![0; self.cells.len()];
        for (rank, (_, cell)) in (0..).zip(order) {
            self.rank[cell as usize] = rank;
        }
    }

    /// Which cells hold which.
    pub(super) fn ancestry(&self) -> Ancestry {
        let cells = self.cells.iter().zip(&self.rank);
        Ancestry::new(self.free, cells.map(|(cell, &rank)| (cell.first, cell.end, rank)))
    }

    /// The point of each vertex of a primitive.
    pub(super) fn points_of(&self, primitive: usize) -> &[u32] {
        &self.point_of_vertex[primitive]
    }

    /// The most cells that can be closed.
    pub(super) fn cell_count(&self) -> usize {
        self.cells.len()
    }

    /// For each point its cluster, and for each cluster the point that represents it, when so many cells are closed.
    pub(super) fn cut(&self, closed: usize) -> (Vec<u32>, Vec<u32>) {
        let mut of_point = vec![0; self.points.len()];
        let mut representatives = Vec::new();
        // Cells come after those in them: from the last, the outermost closed ones come first.
        let mut begin = self.free as u32;
        let mut outermost = Vec::new();
        for (cell, &rank) in self.cells.iter().zip(&self.rank).rev() {
            if (rank as usize) < closed && cell.end <= begin {
                outermost.push(cell);
                begin = cell.first;
            }
        }
        let mut point = 0;
        while point < self.points.len() as u32 {
            let cell = outermost.pop_if(|cell| cell.first == point);
            let (end, representative) = cell.map_or((point + 1, point), |cell| (cell.end, cell.representative));
            of_point[point as usize..end as usize].fill(representatives.len() as u32);
            representatives.push(representative);
            point = end;
        }
        (of_point, representatives)
    }

    /// The clusters when so many cells are closed.
    pub(super) fn clusters(&self, closed: usize) -> Clusters {
        let (of_point, representatives) = self.cut(closed);
        let of_vertex = self.point_of_vertex.iter().map(|points| {
            let cluster = |&point: &u32| of_point.get(point as usize).copied().unwrap_or(UNUSED);
            points.iter().map(cluster).collect()
        });
        Clusters {
            of_vertex: of_vertex.collect(),
            representatives: representatives
                .iter()
                .map(|&point| self.points[point as usize])
                .collect(),
        }
    }
}

/// Finds the cells with at least two children and who represents them, each cell after those in it.
fn divide(codes: &[u64], counts: &[u32], involved: &Involved<'_>, order: Order) -> Vec<Cell> {
    /// A cell whose end is not reached yet.
    struct Open {
        depth: u32,
        first_child: usize,
    }
    let mut open: Vec<Open> = Vec::new();
    let mut parts: Vec<Part> = Vec::new();
    let mut cells = Vec::new();
    for (i, code) in codes.iter().enumerate() {
        parts.push(involved.leaf(i as u32, counts[i]));
        let depth = codes.get(i + 1).map(|next| common_depth(*code, *next));
        while let Some(top) = open.pop_if(|top| depth.is_none_or(|depth| top.depth > depth)) {
            cells.push(close(&mut parts, top.first_child, top.depth, involved, order));
        }
        if let Some(depth) = depth
            && open.last().is_none_or(|top| top.depth < depth)
        {
            let first_child = parts.len() - 1;
            open.push(Open { depth, first_child });
        }
    }
    cells
}

/// Makes one part of several.
fn close(parts: &mut Vec<Part>, first_child: usize, depth: u32, involved: &Involved<'_>, order: Order) -> Cell {
    let children = &parts[first_child..];
    let whole = representative(children, f64::from(depth).exp2().recip(), involved);
    let shallowness = u64::from(MAX_DEPTH - depth) << 32;
    let key = match order {
        // Bits of numbers that are not negative rise with them.
        Order::LeastError => whole.error.to_bits(),
        Order::MostVertices => shallowness | u64::from(u32::MAX - whole.vertices),
        Order::FewestVertices => shallowness | u64::from(whole.vertices),
    };
    let cell = Cell {
        first: whole.first,
        end: whole.end,
        representative: whole.representative,
        key,
    };
    parts.truncate(first_child);
    parts.push(whole);
    cell
}

/// The depth of the smallest cell that holds both.
fn common_depth(a: u64, b: u64) -> u32 {
    match a ^ b {
        0 => MAX_DEPTH,
        differs => MAX_DEPTH - 1 - (63 - differs.leading_zeros()) / 3,
    }
}

/// Whether a shape has each vertex.
fn used_vertices(primitive: &Primitive) -> Vec<bool> {
    let mut used = vec![false; primitive.positions.len()];
    primitive.indices.iter().for_each(|&i| used[i as usize] = true);
    used
}

/// Positions that shapes use.
pub(super) fn used_positions(primitive: &Primitive) -> impl Iterator<Item = DVec3> {
    let used = primitive.positions.iter().zip(used_vertices(primitive));
    used.filter(|(_, used)| *used).map(|(position, _)| to_f64(*position))
}

/// Bits that are equal exactly when the positions are; −0 is 0.
pub(super) fn position_bits(position: [f32; 3]) -> [u32; 3] {
    position.map(|x| (x + 0.0).to_bits())
}

pub(super) fn to_f64(position: [f32; 3]) -> DVec3 {
    DVec3::from_array(position.map(f64::from))
}

/// A Morton order for things with centres: the order in which to put them.
pub(crate) fn morton_order(centers: &[DVec3]) -> Vec<u32> {
    let root = RootCube::around(centers.iter().copied());
    let mut order: Vec<(u64, u32)> = centers.iter().map(|c| root.code(*c)).zip(0..).collect();
    radix::sort(&mut order);
    order.into_iter().map(|(_, i)| i).collect()
}
